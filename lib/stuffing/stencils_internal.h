#pragma once
// The stencils of isosurface stuffing (Labelle and Shewchuk 2007, figure 3): what is inside of a
// tetrahedron of the lattice, by the signs of its corners. For the room and its tests.

#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace gewebe::stuffing {

/// A node of a stencil: corner 0 … 3, or the cut point on the edge from an inner corner i to an
/// outer one j.
struct StencilNode {
  std::uint8_t code = 0;

  static constexpr StencilNode corner(unsigned i) { return {static_cast<std::uint8_t>(i)}; }
  static constexpr StencilNode cut(unsigned i, unsigned j) {
    return {static_cast<std::uint8_t>(4 + 4 * i + j)};
  }
  constexpr bool is_cut() const { return code >= 4; }
  constexpr unsigned inner() const { return is_cut() ? (code - 4U) / 4 : code; }
  constexpr unsigned outer() const { return (code - 4U) % 4; }
  constexpr bool operator==(const StencilNode&) const = default;
};

using StencilTetrahedra = std::array<std::array<StencilNode, 4>, 3>;

struct Stencil {
  std::uint8_t count = 0; ///< of tetrahedra
  bool choice = false;    ///< `other` is as good; the one with the larger least angle is taken
  StencilTetrahedra tetrahedra{}; ///< all of positive volume
  StencilTetrahedra other{};
};

/// The stencil of a tetrahedron whose corners 0, 1 and 2, 3 are the ends of its long edges.
/// \param signs of each corner: -1 outside, 0 on the surface, 1 inside
/// \param even of each corner: are the coordinates of its point in its own lattice of even sum? Of
/// both ends of a long edge one is, so that of 0 and 2 say all.
const Stencil& stencil(const std::array<int, 4>& signs, bool even0, bool even2);

/// For an outer corner n, order[n][p] of the inner corners: the diagonal of the quadrilateral in
/// the face (p, q, n) starts at the first of p and q. They differ.
using DiagonalOrder = std::array<std::array<std::uint8_t, 4>, 4>;

/// The stencil of any tetrahedron of positive volume.
const Stencil& stencil(const std::array<int, 4>& signs, const DiagonalOrder& order);

/// The cosine of the least dihedral angle.
double least_angle_cosine(const std::array<Vec3, 4>& corners);

} // namespace gewebe::stuffing
