#pragma once
// Young's moduli of a solid from loads and the displacements that they were measured to cause.
//
// Displacements are those of a stable Neo-Hookean solid at rest under each load
// (fit/hyperelastic_statics.h), so that they may be large; Poisson's ratios and densities are
// taken as they are. Sought is the least sum of squared differences to what was measured, over the
// compliance 1/E of each material, by Gauss and Newton's method with exact derivatives:
// K_T du/dlog E = f, f the forces of the material's elements at the balance. Under dead loads and
// small strains displacements are linear in one material's 1/E, so that one round ends it; the
// start is the small strains' answer, with the moduli's ratios as given.
//
// Confidence is that of nonlinear least squares (Seber, Wild, Nonlinear regression, 1989, 5.1):
// differences independent, alike and normal, their variance estimated from what is left. It knows
// nothing of errors that all measurements share, as of the body's shape or the load.
//
// Units: mm, Pa, forces g mm/s².

#include "base/context.h"
#include "fem/assembly.h"
#include "fit/hyperelastic_statics.h"
#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gewebe::fit {

/// A displacement of one place.
struct Measurement {
  Vec3 place; ///< at rest; off the body it follows the nearest element, see find_place()
  std::array<std::optional<double>, 3> displacement; ///< along the axes measured
  std::string name;                                  ///< for messages, such as "line 12"
};

/// What is measured under one load.
struct MeasuredCase {
  SolidVector load;
  std::vector<Measurement> measurements;
};

struct FittedYoung {
  std::size_t material = 0;
  double young = 0; ///< Pa
  /// Where it lies with a probability of 95 %; none where there are no more measured axes than
  /// materials.
  std::optional<std::array<double, 2>> interval;
};

struct YoungFit {
  std::vector<FittedYoung> materials;
  std::vector<SolidVector> displacement; ///< of each case, at the moduli found
  double residual = 0;                   ///< root mean square of differences, mm
  double measured = 0;                   ///< root mean square of what was measured, mm
  std::size_t axes = 0;                  ///< measured
  int solves = 0;                        ///< of all cases together, each
  std::vector<std::string> outliers;     ///< names: off by more than chance, 95 %
};

struct YoungFitOptions {
  double tolerance = 1e-3; ///< relative change of a modulus in the last round
  int max_solves = 10;     ///< of all cases
};

/// \param sought materials whose modulus is found; the others keep theirs
/// \pre solid_elements(mesh, materials) passes, `sought` are different materials of elements,
///      fixed.size() == 3 n   \throw Error naming what is wrong: fewer measured axes than
/// materials; a measurement off the body by over a tenth of its size, of what is held, or all
/// against the load; materials on which no measurement depends, or that cannot be distinguished;
/// rounds that don't end; as hyperelastic_statics; Cancelled
YoungFit fit_young(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
                   std::span<const std::string> names, std::span<const std::size_t> sought,
                   std::span<const std::uint8_t> fixed, std::span<const MeasuredCase> cases,
                   const YoungFitOptions& options = {}, const Context& context = {});

} // namespace gewebe::fit
