#pragma once
// exp2ela --fit: the moduli of a solid from what was measured of it.

#include "model/model.h"
#include "tools/cli/cli.h"

#include <string>

namespace gewebe::cli {

/// Reads gewebe_measurements(5) from `file`, gives the model's materials the Young's moduli that
/// fit, and reports them with their intervals; of a swing its frequency and damping, which
/// the model has no place for. \throw Error if the model isn't one of tetrahedra alone, if a
/// material isn't there, as fit_young and fit_swing
void fit_model(Run& run, model::Model& model, const std::string& file);

} // namespace gewebe::cli
