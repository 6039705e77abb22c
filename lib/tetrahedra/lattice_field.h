#pragma once
// Interpolation of vectors from the nodes of tetrahedra to a lattice, by the elements' shape
// functions.

#include "base/context.h"
#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::tetrahedra {

/// Places origin + i step[0] + j step[1] + k step[2], numbered (k·size[1] + j)·size[0] + i.
struct PlaceLattice {
  Vec3 origin;                     ///< mm
  std::array<Vec3, 3> step;        ///< mm, linearly independent
  std::array<std::size_t, 3> size; ///< 1 or more each

  std::size_t places() const { return size[0] * size[1] * size[2]; }
};

/// A vector for each place of a lattice.
struct LatticeField {
  explicit LatticeField(std::size_t places) : values(places), held(places) {}
  std::vector<std::array<float, 3>> values; ///< 0 where nothing holds the place
  std::vector<std::uint8_t> held;           ///< 1 where an element does
};

/// Gives each place that an element of `mesh` holds, and that none held before, the interpolation
/// of `values` at the nodes: with barycentric coordinates L linearly, or of quadratic elements,
/// whose shape is so as well, by L (2 L - 1) at corners and 4 L L' in the middles of edges; the
/// place's coordinates there are found by Newton's method. Of elements that share a place, as on
/// their faces, the first counts, so that the bytes do not depend on the number of threads. An
/// element holds a place up to 1e-9 in its coordinates, and where it is turned inside out, or flat,
/// it holds none. \pre check_mesh(mesh) passes; one value for each point; field.held.size() ==
/// lattice.places() \throw Cancelled
void interpolate_on_lattice(const TetMesh& mesh, std::span<const Vec3> values,
                            const PlaceLattice& lattice, LatticeField& field,
                            const Context& context);

} // namespace gewebe::tetrahedra
