#pragma once
// The stiffness of a solid by its nodes, which follows cuts row by row.

#include "linalg/node_matrix.h"
#include "model/model.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::update {

/// K of the elements. \pre check_model(model) passes, and there are no springs
/// \throw Error as solid_elements
linalg::NodeMatrix node_stiffness(const model::Model& model);

/// Updates the matrix to a model with as many nodes, or more: these rows are replaced, all others
/// stay. Equal to node_stiffness(model), to the bit, except for the order of blocks.
/// \param rows ascending: nodes of elements that are others than before, all new ones among them
void update_node_stiffness(linalg::NodeMatrix& matrix, const model::Model& model,
                           std::span<const std::uint32_t> rows);

/// Nodes of a model whose elements are others than those of the model before.
/// \param place by node before: its number now, or CutModel::gone \return ascending
std::vector<std::uint32_t> changed_rows(const model::Model& before, const model::Model& now,
                                        std::span<const std::uint32_t> place);

/// The largest sum of magnitudes along a row of the node; of all nodes the largest is ‖K‖₁.
double row_norm(const linalg::NodeMatrix& matrix, std::size_t node);

} // namespace gewebe::update
