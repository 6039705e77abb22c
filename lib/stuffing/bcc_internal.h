#pragma once
// The body-centred cubic lattice: two cubic lattices, corners (i, j, k) and centres
// (i + ½, j + ½, k + ½), each point joined to 6 of its own kind by long edges (of length 1) and to
// 8 of the other by short ones (of length √¾). For the room alone.

#include "geometry/vec3.h"
#include "stuffing/stuffing.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace gewebe::stuffing::bcc {

inline constexpr unsigned directions = 14;
/// Directions 0 … 5 are -x +x -y +y -z +z; 6 + o is (±½, ±½, ±½), with a + along axis a where bit a
/// of o is set.
constexpr bool is_long(unsigned direction) {
  return direction < 6;
}
constexpr unsigned opposite(unsigned direction) {
  return is_long(direction) ? direction ^ 1U : 6 + (7 ^ (direction - 6));
}
constexpr double alpha(unsigned direction) {
  return is_long(direction) ? stuffing_alpha_long : stuffing_alpha_short;
}
/// Twice the step along a direction.
constexpr Int3 doubled_step(unsigned direction) {
  if (is_long(direction)) {
    Int3 step{};
    step[direction / 2] = direction % 2 != 0 ? 2 : -2;
    return step;
  }
  const unsigned octant = direction - 6;
  return {(octant & 1) != 0 ? 1 : -1, (octant & 2) != 0 ? 1 : -1, (octant & 4) != 0 ? 1 : -1};
}
/// The direction of a doubled step. \pre it is one
constexpr unsigned direction_of(const Int3& doubled) {
  for (unsigned d = 0; d < directions; ++d)
    if (doubled_step(d)[0] == doubled[0] && doubled_step(d)[1] == doubled[1] &&
        doubled_step(d)[2] == doubled[2])
      return d;
  return directions;
}
inline Vec3 step(unsigned direction) {
  const Int3 twice = doubled_step(direction);
  return {twice[0] / 2.0, twice[1] / 2.0, twice[2] / 2.0};
}

/// A lattice point: of `kind` 0 a corner, 1 a centre.
struct Point {
  unsigned kind = 0;
  Int3 place{};
};
/// Where a direction leads from a point of `kind`, as a step of `place`; the kind changes along a
/// short edge.
constexpr Int3 place_step(unsigned kind, unsigned direction) {
  const Int3 twice = doubled_step(direction);
  Int3 result{};
  for (std::size_t a = 0; a < 3; ++a)
    result[a] = is_long(direction) ? twice[a] / 2
                : kind == 0        ? (twice[a] - 1) / 2
                                   : (twice[a] + 1) / 2;
  return result;
}
constexpr unsigned kind_after(unsigned kind, unsigned direction) {
  return is_long(direction) ? kind : 1 - kind;
}
inline Vec3 position(const Point& point) {
  const double half = point.kind == 0 ? 0 : 0.5;
  return {point.place[0] + half, point.place[1] + half, point.place[2] + half};
}

/// Points of one colour have no edge in common: corners and centres by the parity of their sum.
inline constexpr unsigned colours = 4;
constexpr unsigned colour(const Point& point) {
  return 2 * point.kind +
         (static_cast<unsigned>(point.place[0] + point.place[1] + point.place[2]) & 1U);
}

// ---- what lies round a centre

/// The points of a cell: its centre, the next centres along x, y, z, its 8 corners by octant.
inline constexpr unsigned cell_points = 12;
constexpr Point cell_point(unsigned n) {
  if (n == 0)
    return {1, {0, 0, 0}};
  if (n < 4) {
    Point point{1, {0, 0, 0}};
    point.place[n - 1] = 1;
    return point;
  }
  const int o = static_cast<int>(n) - 4;
  return {0, {o & 1, o >> 1 & 1, o >> 2}};
}

/// The 12 tetrahedra of a cell, all of positive volume: corners 0, 1 at the ends of a long edge
/// between centres, 2, 3 at those of a long edge between corners that goes round it.
using CellTetrahedra = std::array<std::array<std::uint8_t, 4>, 12>;
constexpr CellTetrahedra make_cell_tetrahedra() {
  CellTetrahedra result{};
  std::size_t count = 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const unsigned b = (axis + 1) % 3, c = (axis + 2) % 3, base = 1U << axis;
    // Counter-clockwise seen against the axis: then (c, c + axis, u, v) has a positive volume.
    const std::array<unsigned, 5> ring{base, base | 1U << b, base | 1U << b | 1U << c,
                                       base | 1U << c, base};
    for (std::size_t n = 0; n < 4; ++n)
      result[count++] = {0, static_cast<std::uint8_t>(1 + axis),
                         static_cast<std::uint8_t>(4 + ring[n]),
                         static_cast<std::uint8_t>(4 + ring[n + 1])};
  }
  return result;
}
inline constexpr CellTetrahedra cell_tetrahedra = make_cell_tetrahedra();

/// By tetrahedron of the cell and two of its corners: the direction from one to the other.
using CellDirections = std::array<std::array<std::array<std::uint8_t, 4>, 4>, 12>;
constexpr CellDirections make_cell_directions() {
  CellDirections result{};
  for (std::size_t t = 0; t < 12; ++t)
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j) {
        const Point from = cell_point(cell_tetrahedra[t][i]),
                    to = cell_point(cell_tetrahedra[t][j]);
        const int kinds = static_cast<int>(to.kind) - static_cast<int>(from.kind);
        Int3 twice{};
        for (std::size_t a = 0; a < 3; ++a)
          twice[a] = 2 * (to.place[a] - from.place[a]) + kinds;
        result[t][i][j] = static_cast<std::uint8_t>(direction_of(twice));
      }
  return result;
}
inline constexpr CellDirections cell_directions = make_cell_directions();

// ---- what lies round a point

/// The faces opposite to a point in the 24 tetrahedra round it, each by three directions, and for
/// each of the 36 edges of this link its ends and the two faces at it.
struct Link {
  std::array<std::array<std::uint8_t, 3>, 24> faces{};
  struct Edge {
    std::array<std::uint8_t, 2> ends{}, faces{};
    std::array<std::uint8_t, 2> beyond{}; ///< third corner of each face
  };
  std::array<Edge, 36> edges{};
};
constexpr Link make_link() {
  Link link;
  std::size_t faces = 0;
  for (unsigned d = 0; d < 6; ++d) {
    const unsigned axis = d / 2, side = (d % 2) << axis, b = (axis + 1) % 3, c = (axis + 2) % 3;
    const std::array<unsigned, 5> ring{side, side | 1U << b, side | 1U << b | 1U << c,
                                       side | 1U << c, side};
    for (std::size_t n = 0; n < 4; ++n)
      link.faces[faces++] = {static_cast<std::uint8_t>(d), static_cast<std::uint8_t>(6 + ring[n]),
                             static_cast<std::uint8_t>(6 + ring[n + 1])};
  }
  std::size_t edges = 0;
  for (std::size_t f = 0; f < 24; ++f)
    for (std::size_t g = f + 1; g < 24; ++g) {
      Link::Edge edge;
      std::size_t shared = 0;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          if (link.faces[f][i] == link.faces[g][j]) {
            if (shared < 2)
              edge.ends[shared] = link.faces[f][i];
            ++shared;
          }
      if (shared != 2)
        continue;
      edge.faces = {static_cast<std::uint8_t>(f), static_cast<std::uint8_t>(g)};
      for (std::size_t i = 0; i < 3; ++i) {
        if (link.faces[f][i] != edge.ends[0] && link.faces[f][i] != edge.ends[1])
          edge.beyond[0] = link.faces[f][i];
        if (link.faces[g][i] != edge.ends[0] && link.faces[g][i] != edge.ends[1])
          edge.beyond[1] = link.faces[g][i];
      }
      link.edges[edges++] = edge;
    }
  return link;
}
inline constexpr Link link = make_link();

} // namespace gewebe::stuffing::bcc
