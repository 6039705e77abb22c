#pragma once
// Solids as input of other solvers: Abaqus and CalculiX (.inp), FEBio (.feb).

#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "model/model.h"

#include <vector>

namespace gewebe::formats {

/// inp, feb.
const std::vector<Kind>& solid_deck_kinds();

/// Writes nodes, elements by material, materials and fixed nodes; the caller commits. Units are mm,
/// g, s and Pa, which are consistent: forces are in 1e-6 N. An inp has linear elastic materials and
/// ends before the first step. A feb (version 4) has FEBio's neo-Hookean law for the classical one
/// and `isotropic elastic` where the model names no law, and a static step without loads. Skins are
/// left out.
/// \pre check_model(model) passes, the kind is one of the above
/// \throw Error with place: a model without tetrahedra or with springs; a law that the format or
/// this writer has not, by name; what Output throws
void write_solid_deck(Output& output, const model::Model& model, Kind kind);

} // namespace gewebe::formats
