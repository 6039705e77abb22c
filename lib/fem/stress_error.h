#pragma once
// A-posteriori error of a linear solid: recovered stress minus the stress of the elements.
//
// Superconvergent patch recovery (Zienkiewicz, Zhu, Int. J. Numer. Methods Eng. 33, 1992): around
// each corner of the mesh a linear function of the place is fitted, by least squares, to the
// stresses at the sampling points of the elements there: the middle of linear elements, four Gauss
// points of quadratic ones. Its values at corners and middles of edges (the mean of both ends) are
// interpolated by the functions of the elements. Stresses jump where materials meet, so each
// material has its own fit. The difference d = recovered - element stress approximates the error of
// the stress, and
//
//   ||e||² = a(e, e) ≈ s ∫ d : C⁻¹ : d
//
// that of the energy (Zienkiewicz, Zhu, Int. J. Numer. Methods Eng. 24, 1987), with a factor s for
// bodies that are clamped or pressed somewhere, as almost all are. Energies are forces:
// with displacements given at some nodes, r their reactions and u the given displacements, the
// elements have r·u = a(u, u) + ||e||²; with given forces f, they have f·u = a(u, u) - ||e||².

#include "base/context.h"
#include "fem/stress.h"

#include <span>
#include <vector>

namespace gewebe::fem {

struct StressError {
  std::vector<double> energy; ///< ||e||² by element, 1e-9 J
  /// By node: root of the mean square of d in the elements there, by volume; as a von Mises stress,
  /// Pa.
  std::vector<double> at_node;
};

/// What mesh and order of the elements cause, estimated: gewebe_serve(5).
struct DiscretisationError {
  double relative = 0;     ///< of the energy, and so of forces and displacements
  double force = 0;        ///< of the sum of forces at displaced and touched nodes, 1e-6 N
  double displacement = 0; ///< of the largest displacement of another node, mm
  double stress = 0;       ///< at the node of the largest von Mises stress, Pa
};

/// σ : C⁻¹ : σ of a stress, Pa: twice the energy per volume.
double energy_density(const Elasticity& material, const linalg::SymmetricBlock& stress);

/// \param stresses  of solid_stresses(), one per element \pre elements are those of the mesh
/// The same bytes for any number of threads.
StressError stress_error(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements,
                         std::span<const CornerTensors> stresses, const Context& context = {});

} // namespace gewebe::fem
