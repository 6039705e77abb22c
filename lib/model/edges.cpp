#include "model/edges.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <string>

namespace gewebe {

EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count,
                     const Context& context) {
  if (triangles.size() > UINT32_MAX / 3)
    throw Error(std::to_string(triangles.size()) + " triangles, expected at most " +
                std::to_string(UINT32_MAX / 3));
  // A bucket sort by the lower end; what remains is short: higher end and corner in one word each.
  const auto each_edge = [&](auto&& visit) {
    for (std::size_t f = 0; f < triangles.size(); ++f)
      for (unsigned k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles[f][(k + 1) % 3], b = triangles[f][(k + 2) % 3];
        visit(std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(3 * f + k));
      }
  };
  std::vector<std::uint32_t> start(point_count + 1);
  each_edge([&](std::uint32_t low, std::uint32_t, std::uint32_t) { ++start[low + 1]; });
  for (std::size_t i = 0; i < point_count; ++i)
    start[i + 1] += start[i];
  std::vector<std::uint64_t> entries(3 * triangles.size());
  std::vector<std::uint32_t> fill(start.begin(), start.end() - 1);
  each_edge([&](std::uint32_t low, std::uint32_t high, std::uint32_t corner) {
    entries[fill[low]++] = std::uint64_t{high} << 32 | corner;
  });
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, point_count, 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      std::sort(entries.begin() + start[i], entries.begin() + start[i + 1]);
  });

  EdgeTable table;
  table.ends.reserve(entries.size() / 2 + entries.size() / 8);
  table.first.reserve(table.ends.capacity() + 1);
  table.corners.resize(entries.size());
  for (std::uint32_t i = 0; i < point_count; ++i)
    for (std::uint32_t e = start[i]; e < start[i + 1]; ++e) {
      const auto high = static_cast<std::uint32_t>(entries[e] >> 32);
      if (e == start[i] || high != static_cast<std::uint32_t>(entries[e - 1] >> 32)) {
        table.ends.push_back({i, high});
        table.first.push_back(e);
      }
      table.corners[e] = static_cast<std::uint32_t>(entries[e]);
    }
  table.first.push_back(static_cast<std::uint32_t>(entries.size()));
  return table;
}

} // namespace gewebe
