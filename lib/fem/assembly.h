#pragma once
// A solid of tetrahedra: its stiffness matrix, the masses of its nodes, and loads on them.
//
// Meshes are linear, or quadratic where they have middles, which must stand in the middle of their
// edges (a thousandth of the edge's length is taken for rounding; sides are straight in between).
// Units are mm, g, s: stiffness g/s², forces g mm/s² (1e-6 N), as in linalg/stiffness.h, so that
// springs and solids add. The same bytes on any number of threads.

#include "base/context.h"
#include "fem/element.h"
#include "linalg/stiffness.h"
#include "model/prony.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/tet_mesh.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::fem {

struct SolidMaterial {
  double young = 1e4;           ///< Young's modulus, Pa
  double poisson = 0.49;        ///< Poisson's ratio, 0 to below 1/2
  double density = 1e-3;        ///< g/mm³
  model::HyperelasticLaw law{}; ///< of large strains (fem/hyperelastic.h)
  /// None: elastic. Read where a body is made of it (viscous/solid_memory.h).
  std::span<const model::PronyTerm> prony{};
};

/// The elements of a mesh whose tetrahedra are of materials[mesh.material[t]], or all of the first.
/// \pre check_mesh(mesh) passes   \throw Error naming the first tetrahedron without a positive
/// volume, with a material that isn't there, or with a middle away from its edge's; if a material's
/// value is out of its range; Cancelled
std::vector<SolidElement> solid_elements(const tetrahedra::TetMesh& mesh,
                                         std::span<const SolidMaterial> materials,
                                         const Context& context = {});

/// K of the elements of `mesh` on the axes that `fixed` (empty, or 3 n flags) leaves free; nodes
/// count as in mesh.points. A node of no tetrahedron has rows of 0. \pre elements are those of the
/// mesh   \throw Error if no axis is free, or a sum isn't finite; Cancelled
linalg::StiffnessMatrix solid_stiffness(const tetrahedra::TetMesh& mesh,
                                        std::span<const SolidElement> elements,
                                        std::span<const std::uint8_t> fixed = {},
                                        const Context& context = {});

/// The sum of two matrices on the same axes, as of springs and of solids.
/// \throw Error if their axes differ
linalg::StiffnessMatrix sum(const linalg::StiffnessMatrix& a, const linalg::StiffnessMatrix& b);

/// f = K u over all 3 n axes, the fixed ones too, where it is what the supports hold against.
/// \pre u.size() == f.size() == 3 n
void multiply_solid(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements,
                    std::span<const double> u, std::span<double> f);

/// The mass of each node, g: that of its tetrahedra, shared out in proportion to the diagonal of
/// the consistent mass (Hinton, Rock, Zienkiewicz, A note on mass lumping and related processes in
/// the finite element method, 1976): 1/4 to each corner of a linear element; 1/36 to each corner
/// and 4/27 to each middle of a quadratic one, where row sums would be negative.
/// \pre as for solid_elements, which passed
std::vector<double> solid_masses(const tetrahedra::TetMesh& mesh,
                                 std::span<const SolidMaterial> materials);

/// The forces of gravity on each axis under an acceleration in mm/s²: consistent loads, with what
/// bubbles hand on. \pre elements are those of the mesh and the materials
std::vector<double> gravity_load(const tetrahedra::TetMesh& mesh,
                                 std::span<const SolidMaterial> materials,
                                 std::span<const SolidElement> elements, const Vec3& acceleration);

/// The forces of a constant traction (Pa) on triangles of the boundary: thirds of the force on the
/// corners of linear elements, on the middles of quadratic ones, whose corners carry nothing.
/// \pre `of_mesh` is boundary(mesh), triangles are below its count
std::vector<double> traction_load(const tetrahedra::TetMesh& mesh,
                                  const tetrahedra::TetBoundary& of_mesh,
                                  std::span<const std::uint32_t> triangles, const Vec3& traction);

/// The same of a pressure (Pa), which acts against the normals at rest.
std::vector<double> pressure_load(const tetrahedra::TetMesh& mesh,
                                  const tetrahedra::TetBoundary& of_mesh,
                                  std::span<const std::uint32_t> triangles, double pressure);

} // namespace gewebe::fem
