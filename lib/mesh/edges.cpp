#include "mesh/edges.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "mesh/face_ranges.h"

#include <algorithm>
#include <string>
#include <utility>

namespace gewebe::mesh {

namespace {

constexpr std::size_t max_triangles = (std::size_t{1} << 31) / 3;

/// Calls visit(low, side) for the sides of faces [begin, end), by face.
template <class Visit>
void for_each_side(std::span<const Triangle> triangles, std::size_t begin, std::size_t end,
                   const Visit& visit) {
  for (std::size_t f = begin; f < end; ++f) {
    const auto [a, b, c] = triangles[f];
    if (has_equal_corners(triangles[f]))
      continue;
    const auto corner = static_cast<std::uint32_t>(3 * f);
    visit(std::min(b, c), EdgeSide(std::max(b, c), corner, b > c));
    visit(std::min(c, a), EdgeSide(std::max(c, a), corner + 1, c > a));
    visit(std::min(a, b), EdgeSide(std::max(a, b), corner + 2, a > b));
  }
}

Context without_progress(const Context& context) {
  Context quiet = context;
  quiet.progress = nullptr;
  return quiet;
}

Context one_thread() {
  Context context;
  context.threads = 1;
  return context;
}

} // namespace

EdgeSides::EdgeSides(std::size_t points, std::span<const Triangle> triangles)
    : EdgeSides(points, triangles, one_thread()) {}

EdgeSides::EdgeSides(std::size_t points, std::span<const Triangle> triangles,
                     const Context& context)
    : first_(points + 1) {
  if (triangles.size() > max_triangles)
    throw Error(std::to_string(triangles.size()) + " triangles, expected at most " +
                std::to_string(max_triangles));
  const Context quiet = without_progress(context);
  const FaceRanges ranges(triangles, points, quiet);
  const auto each_range = [&](const auto& body) {
    gewebe::parallel_blocks(quiet, points, ranges.grain(), body);
  };
  const auto each_side = [&](std::size_t begin, std::size_t end, const auto& visit) {
    ranges.for_each_block(begin, end, [&](std::size_t first, std::size_t stop, bool whole) {
      gewebe::mesh::for_each_side(triangles, first, stop,
                                  [&](std::uint32_t low, const gewebe::mesh::EdgeSide& side) {
                                    if (whole || (low >= begin && low < end))
                                      visit(low, side);
                                  });
    });
  };
  each_range([&](std::size_t begin, std::size_t end) {
    each_side(begin, end, [&](std::uint32_t low, const EdgeSide&) { ++first_[low + 1]; });
  });
  for (std::size_t p = 1; p < first_.size(); ++p)
    first_[p] += first_[p - 1];
  reserve_touched(quiet, sides_, first_.back());
  sides_.resize(first_.back());
  each_range([&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> next(&first_[begin], &first_[end]);
    each_side(begin, end,
              [&](std::uint32_t low, const EdgeSide& side) { sides_[next[low - begin]++] = side; });
    sort_buckets(begin, end);
  });
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

EdgeTable table_of(const EdgeSides& sides, const Context& context) {
  constexpr std::size_t grain = 8192;
  const Context quiet = without_progress(context);
  const std::size_t points = sides.points();
  std::vector<std::size_t> first((points + grain - 1) / grain + 1); // edge of each block
  parallel_blocks(quiet, points, grain, [&](std::size_t begin, std::size_t end) {
    std::size_t edges = 0;
    sides.for_each_edge(begin, end, [&](std::uint32_t, std::span<const EdgeSide>) { ++edges; });
    first[begin / grain + 1] = edges;
  });
  for (std::size_t block = 1; block < first.size(); ++block)
    first[block] += first[block - 1];
  EdgeTable table;
  reserve_touched(quiet, table.ends, first.back());
  reserve_touched(quiet, table.first, first.back() + 1);
  reserve_touched(quiet, table.corners, sides.size());
  table.ends.resize(first.back());
  table.first.resize(first.back() + 1);
  table.corners.resize(sides.size());
  parallel_blocks(quiet, points, grain, [&](std::size_t begin, std::size_t end) {
    std::size_t edge = first[begin / grain], corner = sides.size_before(begin);
    sides.for_each_edge(begin, end, [&](std::uint32_t low, std::span<const EdgeSide> faces) {
      table.ends[edge] = {low, faces[0].high()};
      table.first[edge++] = static_cast<std::uint32_t>(corner);
      for (const EdgeSide& side : faces)
        table.corners[corner++] = side.corner();
    });
  });
  table.first.back() = static_cast<std::uint32_t>(sides.size());
  return table;
}

} // namespace

EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count) {
  return edge_table(triangles, point_count, one_thread());
}

EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count,
                     const Context& context) {
  return table_of(EdgeSides(point_count, triangles, context), context);
}

std::size_t EdgeTable::find(const std::array<std::uint32_t, 2>& wanted) const {
  const auto at = std::lower_bound(ends.begin(), ends.end(), wanted);
  return at != ends.end() && *at == wanted ? static_cast<std::size_t>(at - ends.begin()) : no_edge;
}

} // namespace gewebe::mesh
