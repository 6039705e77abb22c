#pragma once
// Strains and stresses of a solid under given displacements.
//
// In each tetrahedron they are constant (linear elements) or linear (quadratic ones, the change of
// volume and the bubble projected on linear functions: fem/element.h), and given at its corners.
// They jump from one tetrahedron to the next.

#include "fem/assembly.h"
#include "fem/element.h"
#include "geometry/vec3.h"
#include "linalg/stiffness.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <span>
#include <vector>

namespace gewebe::fem {

/// Symmetric tensors at the four corners of a tetrahedron: xx xy xz yy yz zz.
using CornerTensors = std::array<linalg::SymmetricBlock, 4>;

/// In which frames displacements are those of small strains: at rest, or in ones that turn by their
/// curl, as statics/rotation_warp.h has them, or those that turn with each element, nearest to its
/// gradient in the middle, as fem/corotational.h has them: there displacements are in space.
enum class StrainFrames { resting, turning, elements };

/// Strains under displacements u (mm) of the 3 n axes and gravity (acceleration in mm/s²), without
/// which the bubbles of a body that its weight deforms would be wrong; at rest in space, 0. Those
/// of other frames are turned by their rotations, so that the result is in space. \pre elements are
/// those of the mesh and the materials, u.size() == 3 n
std::vector<CornerTensors> solid_strains(const tetrahedra::TetMesh& mesh,
                                         std::span<const SolidMaterial> materials,
                                         std::span<const SolidElement> elements,
                                         std::span<const double> u, const Vec3& acceleration = {},
                                         StrainFrames frames = StrainFrames::resting);

/// Stresses of strains, Pa. \pre one strain per element
std::vector<CornerTensors> solid_stresses(std::span<const SolidElement> elements,
                                          std::span<const CornerTensors> strains);

/// Where barycentric coordinates are given, (1/4, 1/4, 1/4, 1/4) in the middle.
linalg::SymmetricBlock tensor_at(const CornerTensors& tensors,
                                 const std::array<double, 4>& coordinates);

/// Means at the nodes of what the tetrahedra around them have there, by their volumes: smooth, but
/// also where materials meet and stresses do jump. 0 at nodes of no tetrahedron.
std::vector<linalg::SymmetricBlock> nodal_tensors(const tetrahedra::TetMesh& mesh,
                                                  std::span<const SolidElement> elements,
                                                  std::span<const CornerTensors> tensors);

/// Von Mises's equivalent stress: of a tension alone that tension, of a pressure on all sides 0.
double von_mises(const linalg::SymmetricBlock& stress);

/// Strains and stresses of a shape: in the middle of each element, and means at each node.
struct SolidFields {
  std::vector<linalg::SymmetricBlock> element_strain, node_strain;
  std::vector<linalg::SymmetricBlock> element_stress, node_stress; ///< Pa
};
/// \pre as for solid_strains
SolidFields solid_fields(const tetrahedra::TetMesh& mesh, std::span<const SolidMaterial> materials,
                         std::span<const SolidElement> elements, std::span<const double> u,
                         const Vec3& acceleration = {},
                         StrainFrames frames = StrainFrames::resting);

} // namespace gewebe::fem
