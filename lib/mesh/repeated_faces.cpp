#include "mesh/repeated_faces.h"

#include <algorithm>
#include <tuple>

namespace gewebe::mesh {

namespace {

/// In the bucket of its smallest corner.
struct Entry {
  std::uint32_t second, third; ///< the other corners in order, or in that of the face
  std::uint32_t face;
};

/// The smallest corner first.
Triangle in_order(Triangle t, SameFace same) {
  if (same == SameFace::corners)
    std::sort(t.begin(), t.end());
  else
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

} // namespace

std::vector<bool> repeated_faces(std::size_t points, std::span<const Triangle> triangles,
                                 SameFace same, std::span<const std::int32_t> part) {
  std::vector<std::uint32_t> first(points + 1);
  for (const Triangle& t : triangles)
    ++first[*std::min_element(t.begin(), t.end()) + 1];
  for (std::size_t p = 0; p < points; ++p)
    first[p + 1] += first[p];
  std::vector<Entry> entries(triangles.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const auto [a, b, c] = in_order(triangles[f], same);
    entries[next[a]++] = {b, c, f};
  }
  const auto part_of = [&](const Entry& e) { return part.empty() ? 0 : part[e.face]; };
  const auto before = [&](const Entry& a, const Entry& b) {
    return std::tuple(a.second, a.third, part_of(a), a.face) <
           std::tuple(b.second, b.third, part_of(b), b.face);
  };
  std::vector<bool> repeated(triangles.size());
  for (std::size_t p = 0; p < points; ++p) {
    std::sort(entries.begin() + first[p], entries.begin() + first[p + 1], before);
    for (std::size_t n = first[p] + std::size_t{1}; n < first[p + 1]; ++n) {
      const Entry &a = entries[n - 1], &b = entries[n];
      repeated[b.face] = a.second == b.second && a.third == b.third && part_of(a) == part_of(b);
    }
  }
  return repeated;
}

} // namespace gewebe::mesh
