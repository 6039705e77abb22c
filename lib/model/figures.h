#pragma once
// Counts of a model for statistics.

#include "base/context.h"
#include "model/model.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace gewebe::model {

/// Names and counts: nodes (of the surface), centrals, springs_e, springs_b, springs_c, triangles,
/// components, boundary_edges (of exactly one triangle), fixed_nodes (of the surface, along an axis
/// or more). \pre the invariants of model.h hold   \throw Cancelled
std::vector<std::pair<const char*, std::uint64_t>> model_counts(const Model& model,
                                                                const Context& context);

} // namespace gewebe::model
