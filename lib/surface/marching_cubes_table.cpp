#include "surface/marching_cubes_table.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

// Based on: Lorensen and Cline, Marching Cubes: A High Resolution 3D Surface Construction
// Algorithm, 1987; the rule for ambiguous faces as in Montani, Scateni and Scopigno, A Modified
// Look-up Table for Implicit Disambiguation of Marching Cubes, 1994.

namespace gewebe::surface {
namespace {

using Loop = std::vector<int>; // crossed edges in order, counter-clockwise from outside
using Triangles = std::vector<std::array<int, 3>>;

int edge_between(int a, int b) {
  const int low = std::min(a, b), axis = (a ^ b) >> 1; // 1, 2, 4 -> 0, 1, 2
  for (int e = 4 * axis; e < 4 * axis + 4; ++e)
    if (cell_edges[static_cast<std::size_t>(e)].corner == low)
      return e;
  return -1;
}

/// The corners of a face, counter-clockwise seen from outside the cell.
std::array<int, 4> face_corners(int axis, int side) {
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
  if (side == 1)
    return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

/// Do two edges of the cell lie in one face?
bool share_face(int e, int f) {
  const auto start = [](int edge) { return cell_edges[static_cast<std::size_t>(edge)].corner; };
  const auto axis = [](int edge) { return cell_edges[static_cast<std::size_t>(edge)].axis; };
  for (int a = 0; a < 3; ++a)
    if (axis(e) != a && axis(f) != a && ((start(e) ^ start(f)) >> a & 1) == 0)
      return true;
  return false;
}

std::vector<Loop> loops_of(int inside) {
  std::array<int, 12> next{};
  next.fill(-1);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const std::array<int, 4> corners = face_corners(axis, side);
      const auto corner = [&](int n) { return corners[static_cast<std::size_t>(n & 3)]; };
      const auto is_inside = [&](int n) { return (inside >> corner(n) & 1) != 0; };
      for (int last = 0; last < 4; ++last) {
        if (!is_inside(last) || is_inside(last + 1))
          continue;
        int first = last;
        while (is_inside(first - 1))
          --first;
        // The run first … last is cut off. Its corners pass counter-clockwise seen from outside the
        // cell; a loop that is counter-clockwise seen from outside the body goes along with them.
        next[static_cast<std::size_t>(edge_between(corner(first), corner(first - 1)))] =
            edge_between(corner(last), corner(last + 1));
      }
    }
  std::vector<Loop> loops;
  for (int start = 0; start < 12; ++start) {
    Loop loop;
    for (int e = start; next[static_cast<std::size_t>(e)] >= 0;) {
      loop.push_back(e);
      e = std::exchange(next[static_cast<std::size_t>(e)], -1);
    }
    if (!loop.empty())
      loops.push_back(std::move(loop));
  }
  return loops;
}

/// All triangulations of loop[first … last]; the chord first-last is there already.
std::vector<Triangles> triangulations(const Loop& loop, std::size_t first, std::size_t last) {
  if (last - first < 2)
    return {{}};
  const auto allowed = [&](std::size_t a, std::size_t b) {
    return b - a == 1 || !share_face(loop[a], loop[b]);
  };
  std::vector<Triangles> all;
  for (std::size_t apex = first + 1; apex < last; ++apex) {
    if (!allowed(first, apex) || !allowed(apex, last))
      continue;
    for (const Triangles& left : triangulations(loop, first, apex))
      for (const Triangles& right : triangulations(loop, apex, last)) {
        Triangles joined = left;
        joined.insert(joined.end(), right.begin(), right.end());
        joined.push_back({loop[first], loop[apex], loop[last]});
        all.push_back(std::move(joined));
      }
  }
  return all;
}

/// Squared area over the fourth power of the longest side (times 4), crossings in mid-edge.
double quality(const std::array<int, 3>& triangle) {
  std::array<std::array<int, 3>, 3> p{};
  for (std::size_t n = 0; n < 3; ++n) {
    const CellEdge edge = cell_edges[static_cast<std::size_t>(triangle[n])];
    for (std::size_t a = 0; a < 3; ++a)
      p[n][a] = 2 * (edge.corner >> a & 1) + (edge.axis == a ? 1 : 0);
  }
  const auto difference = [&](std::size_t m, std::size_t n) {
    return std::array<int, 3>{p[n][0] - p[m][0], p[n][1] - p[m][1], p[n][2] - p[m][2]};
  };
  const auto square = [](const std::array<int, 3>& v) {
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  };
  const auto a = difference(0, 1), b = difference(1, 2), c = difference(2, 0);
  const int longest = std::max({square(a), square(b), square(c)});
  const std::array<int, 3> normal{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                  a[0] * b[1] - a[1] * b[0]};
  return static_cast<double>(square(normal)) / (longest * longest);
}

double worst_quality(const Triangles& triangles) {
  double worst = 1e9;
  for (const auto& triangle : triangles)
    worst = std::min(worst, quality(triangle));
  return worst;
}

CellCase make_case(int inside) {
  CellCase result;
  for (const Loop& loop : loops_of(inside)) {
    const std::vector<Triangles> choices = triangulations(loop, 0, loop.size() - 1);
    const Triangles* best = &choices.front();
    for (const Triangles& choice : choices)
      if (worst_quality(choice) > worst_quality(*best))
        best = &choice;
    for (const auto& triangle : *best) {
      auto& slot = result.triangles[result.count++];
      for (std::size_t n = 0; n < 3; ++n)
        slot[n] = static_cast<std::uint8_t>(triangle[n]);
    }
    for (const int e : loop)
      result.edges = static_cast<std::uint16_t>(result.edges | 1 << e);
  }
  return result;
}

} // namespace

const std::array<CellCase, 256>& marching_cubes_table() {
  static const std::array<CellCase, 256> table = [] {
    std::array<CellCase, 256> cases{};
    for (int inside = 0; inside < 256; ++inside)
      cases[static_cast<std::size_t>(inside)] = make_case(inside);
    return cases;
  }();
  return table;
}

} // namespace gewebe::surface
