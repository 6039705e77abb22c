#pragma once
// A hyperelastic solid at rest under dead loads and prescribed displacements, by Newton's method:
// what large displacements are judged by. (fem/hyperelastic.h is the element.)
//
// A round costs the tangents of all elements and a factor of their sum, so that this is no method
// for a simulation's answers.

#include "base/context.h"
#include "fem/assembly.h"
#include "fem/hyperelastic.h"
#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::fit {

/// On or of the nodes' 3 n axes, and the bubbles of quadratic elements (one per tetrahedron; empty
/// counts as 0).
struct SolidVector {
  std::vector<double> axes;
  std::vector<Vec3> bubbles;
};

/// The forces of gravity under an acceleration in mm/s².
/// \pre elements are those of the mesh and the materials
SolidVector hyperelastic_weight(const tetrahedra::TetMesh& mesh,
                                std::span<const fem::SolidMaterial> materials,
                                std::span<const fem::SolidElement> elements,
                                const Vec3& acceleration);

/// The energy under displacements, g mm²/s². The same bits on any number of threads.
double hyperelastic_energy(const tetrahedra::TetMesh& mesh,
                           std::span<const fem::SolidElement> elements,
                           const SolidVector& displacement, const Context& context = {});

/// -dE/du, on fixed axes too. \pre as hyperelastic_response: a classical Neo-Hookean solid is
/// nowhere inverted
SolidVector hyperelastic_forces(const tetrahedra::TetMesh& mesh,
                                std::span<const fem::SolidElement> elements,
                                const SolidVector& displacement, const Context& context = {});

struct HyperelasticOptions {
  /// The norm of unbalanced forces over that of all forces of elements on nodes and the load's, or
  /// what rounding leaves if that is more, as under loads so small that F is nearly I.
  double tolerance = 1e-10;
  int max_rounds = 20;      ///< of Newton in one load step, before it is halved
  double least_step = 1e-3; ///< of the load, before it gives up
  /// Empty, or a balance of the same supports under nearby loads or materials, from which the way
  /// is tried first.
  SolidVector start{};
};

struct HyperelasticState {
  SolidVector displacement;
  double residual = 0; ///< what the tolerance is for; 0 where it is rounding
  int rounds = 0;      ///< factors made
  int steps = 0;       ///< load steps
};

/// The state in balance. `prescribed` (empty, or 3 n) is read where `fixed` is set; otherwise those
/// are 0. Load and prescribed displacements grow together from rest, in one step if Newton finds
/// its way, else in smaller ones. Where the tangent is definite a round takes Newton's whole step;
/// elsewhere it goes downhill in energy by the positive tangent. So unstable balances are left,
/// unless the state stands in one exactly, as a column does that is pushed along its axis.
/// \pre load.axes.size() == fixed.size() == 3 n, as in solid_stiffness
/// \throw Error if it doesn't get there in steps of least_step, or as solid_stiffness; Cancelled
HyperelasticState hyperelastic_statics(const tetrahedra::TetMesh& mesh,
                                       std::span<const fem::SolidElement> elements,
                                       std::span<const std::uint8_t> fixed,
                                       std::span<const double> prescribed, const SolidVector& load,
                                       const HyperelasticOptions& options = {},
                                       const Context& context = {});

/// How a balance moves when its load changes by each of `changes`, to first order: displacements of
/// the 3 n axes, 0 on fixed ones. \pre `at` is a balance of these elements
/// \throw Error if the balance isn't stable; Cancelled
std::vector<std::vector<double>>
hyperelastic_response_to(const tetrahedra::TetMesh& mesh,
                         std::span<const fem::SolidElement> elements,
                         std::span<const std::uint8_t> fixed, const SolidVector& at,
                         std::span<const SolidVector> changes,
                         const HyperelasticOptions& options = {}, const Context& context = {});

} // namespace gewebe::fit
