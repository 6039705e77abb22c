#include "tetrahedra/faces.h"

#include "base/error.h"

#include <algorithm>
#include <string>
#include <utility>

namespace gewebe::tetrahedra {
namespace {

void check_count(std::size_t tetrahedra, std::size_t max) {
  if (tetrahedra > max)
    throw Error(std::to_string(tetrahedra) + " tetrahedra, expected at most " +
                std::to_string(max));
}

/// Calls visit(low, face) for the faces of all tetrahedra.
template <class Visit>
void for_each_side_face(std::span<const Tetrahedron> tetrahedra, Visit&& visit) {
  for (std::size_t n = 0; n < tetrahedra.size(); ++n) {
    const Tetrahedron& t = tetrahedra[n];
    if (has_equal_corners(t))
      continue;
    for (std::uint32_t k = 0; k < 4; ++k) {
      auto [a, b, c] = corners_of_face(t, k);
      if (a > b)
        std::swap(a, b);
      if (b > c)
        std::swap(b, c);
      if (a > b)
        std::swap(a, b);
      visit(a, TetFace{b, c, static_cast<std::uint32_t>(4 * n + k)});
    }
  }
}

template <class Visit>
void for_each_side_edge(std::span<const Tetrahedron> tetrahedra, Visit&& visit) {
  for (std::size_t n = 0; n < tetrahedra.size(); ++n) {
    const Tetrahedron& t = tetrahedra[n];
    if (has_equal_corners(t))
      continue;
    for (std::uint32_t k = 0; k < 6; ++k) {
      const auto& edge = tetrahedron_edges[k];
      const auto [low, high] = std::minmax(t[edge[0]], t[edge[1]]);
      visit(low, TetEdge{high, static_cast<std::uint32_t>(6 * n + k)});
    }
  }
}

/// Sorts what `each` visits into buckets of their smallest corners.
template <class Side, class Each>
void fill(std::vector<std::uint32_t>& first, std::vector<Side>& sides, const Each& each) {
  each([&](std::uint32_t low, const Side&) { ++first[low + 1]; });
  for (std::size_t p = 1; p < first.size(); ++p)
    first[p] += first[p - 1];
  sides.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  each([&](std::uint32_t low, const Side& side) { sides[next[low]++] = side; });
  constexpr std::uint32_t few = 32;
  for (std::size_t p = 0; p + 1 < first.size(); ++p) {
    const std::uint32_t begin = first[p], stop = first[p + 1];
    if (stop - begin > few) {
      std::sort(sides.begin() + begin, sides.begin() + stop);
      continue;
    }
    for (std::uint32_t n = begin + 1; n < stop; ++n) {
      const Side side = sides[n];
      std::uint32_t m = n;
      for (; m > begin && side < sides[m - 1]; --m)
        sides[m] = sides[m - 1];
      sides[m] = side;
    }
  }
}

} // namespace

TetFaces::TetFaces(std::size_t points, std::span<const Tetrahedron> tetrahedra)
    : first_(points + 1) {
  check_count(tetrahedra.size(), (std::size_t{1} << 30U) - 1);
  fill(first_, sides_, [&](const auto& visit) { for_each_side_face(tetrahedra, visit); });
}

TetEdges::TetEdges(std::size_t points, std::span<const Tetrahedron> tetrahedra)
    : first_(points + 1) {
  check_count(tetrahedra.size(), UINT32_MAX / 6);
  fill(first_, sides_, [&](const auto& visit) { for_each_side_edge(tetrahedra, visit); });
}

} // namespace gewebe::tetrahedra
