#pragma once
// Where a place that moves with a solid goes, as a sum of displacements of nodes: markers, probes.

#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::embedding {

/// u(place) = Σ weight u(node) over the first `count`.
struct SolidPlace {
  std::array<std::uint32_t, 10> node{};
  std::array<double, 10> weight{};
  std::size_t count = 0;
  double outside = 0; ///< distance to the element that carries it, mm; 0 inside
};

/// Of a place in a tetrahedron by its shape functions, bubbles left out; outside of all of them it
/// is carried by the nearest one, as its gradient there has it: what stands off a surface turns
/// with it. Looks at all elements. \pre mesh has tetrahedra of positive volume
SolidPlace find_place(const tetrahedra::TetMesh& mesh, const Vec3& place);

/// \pre u.size() == 3 n
Vec3 displacement_at(const SolidPlace& place, std::span<const double> u);

} // namespace gewebe::embedding
