#pragma once
// The law by which a solid of tetrahedra moves or rests under large strains.

#include "integrator/solid_motion.h"
#include "model/model.h"

#include <optional>

namespace gewebe::dynamics {

/// The law that is chosen; else that of the materials, where one of them has a law; else none.
/// A viscoelastic material has one.
/// \throw Error naming a material whose law is another one than the chosen one, the classical
/// Neo-Hookean one, which does not serve here, or a viscoelastic one where corotational is chosen
std::optional<integrator::SolidLaw> law_of(const model::Model& model,
                                           const std::optional<integrator::SolidLaw>& chosen);

/// Whether a solid has a viscoelastic material.
bool is_viscoelastic(const model::Model& model);

} // namespace gewebe::dynamics
