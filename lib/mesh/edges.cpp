#include "mesh/edges.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <string>
#include <utility>

namespace gewebe {

namespace {

constexpr std::size_t max_triangles = (std::size_t{1} << 31) / 3;

/// Calls visit(low, side) for the sides of all faces, by face.
template <class Visit>
void for_each_side(std::span<const Triangle> triangles, Visit&& visit) {
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto [a, b, c] = triangles[f];
    if (has_equal_corners(triangles[f]))
      continue;
    const auto corner = static_cast<std::uint32_t>(3 * f);
    visit(std::min(b, c), EdgeSide(std::max(b, c), corner, b > c));
    visit(std::min(c, a), EdgeSide(std::max(c, a), corner + 1, c > a));
    visit(std::min(a, b), EdgeSide(std::max(a, b), corner + 2, a > b));
  }
}

} // namespace

EdgeSides::EdgeSides(std::size_t points, std::span<const Triangle> triangles) : first_(points + 1) {
  fill(triangles);
  sort_buckets(0, points);
}

EdgeSides::EdgeSides(std::size_t points, std::span<const Triangle> triangles,
                     const Context& context)
    : first_(points + 1) {
  fill(triangles);
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, points, 8192,
                  [&](std::size_t begin, std::size_t end) { sort_buckets(begin, end); });
}

void EdgeSides::fill(std::span<const Triangle> triangles) {
  if (triangles.size() > max_triangles)
    throw Error(std::to_string(triangles.size()) + " triangles, expected at most " +
                std::to_string(max_triangles));
  for_each_side(triangles, [&](std::uint32_t low, const EdgeSide&) { ++first_[low + 1]; });
  for (std::size_t p = 1; p < first_.size(); ++p)
    first_[p] += first_[p - 1];
  sides_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for_each_side(triangles,
                [&](std::uint32_t low, const EdgeSide& side) { sides_[next[low]++] = side; });
}

void EdgeSides::sort_buckets(std::size_t begin, std::size_t end) {
  constexpr std::uint32_t few = 24;
  for (std::size_t p = begin; p < end; ++p) {
    const std::uint32_t first = first_[p], stop = first_[p + 1];
    if (stop - first > few) {
      std::sort(sides_.begin() + first, sides_.begin() + stop);
      continue;
    }
    for (std::uint32_t n = first + 1; n < stop; ++n) {
      const EdgeSide side = sides_[n];
      std::uint32_t m = n;
      for (; m > first && side < sides_[m - 1]; --m)
        sides_[m] = sides_[m - 1];
      sides_[m] = side;
    }
  }
}

namespace {

EdgeTable table_of(const EdgeSides& sides) {
  EdgeTable table;
  table.ends.reserve(sides.size() / 2 + sides.size() / 8);
  table.first.reserve(table.ends.capacity() + 1);
  table.corners.reserve(sides.size());
  sides.for_each_edge([&](std::uint32_t low, std::span<const EdgeSide> edge) {
    table.ends.push_back({low, edge[0].high()});
    table.first.push_back(static_cast<std::uint32_t>(table.corners.size()));
    for (const EdgeSide& side : edge)
      table.corners.push_back(side.corner());
  });
  table.first.push_back(static_cast<std::uint32_t>(table.corners.size()));
  return table;
}

} // namespace

EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count) {
  return table_of(EdgeSides(point_count, triangles));
}

EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count,
                     const Context& context) {
  return table_of(EdgeSides(point_count, triangles, context));
}

std::size_t EdgeTable::find(const std::array<std::uint32_t, 2>& wanted) const {
  const auto at = std::lower_bound(ends.begin(), ends.end(), wanted);
  return at != ends.end() && *at == wanted ? static_cast<std::size_t>(at - ends.begin()) : no_edge;
}

} // namespace gewebe
