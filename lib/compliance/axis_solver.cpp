#include "compliance/axis_solver.h"

#include "base/error.h"
#include "contact/load.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "linalg/stiffness.h"

#include <string>
#include <utility>

namespace gewebe::compliance {

void AxisSolver::solve(std::span<double> over_axes, std::size_t columns) const {
  const std::size_t axes = row_of_axis.size(), order = factor.order();
  std::vector<double> f(order * columns), u(order * columns);
  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t a = 0; a < axes; ++a)
      if (row_of_axis[a] >= 0)
        f[c * order + static_cast<std::size_t>(row_of_axis[a])] = over_axes[c * axes + a];
  factor.solve(f, u, columns);
  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t a = 0; a < axes; ++a)
      over_axes[c * axes + a] =
          row_of_axis[a] < 0 ? 0 : u[c * order + static_cast<std::size_t>(row_of_axis[a])];
}

AxisSolver factorise_axes(const model::Model& model, const Context& context) {
  linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model, {}, context);
  linalg::StiffnessCheck check;
  linalg::Factor factor = linalg::checked_factor(model, matrix, context, check);
  return {std::move(factor), std::move(matrix.row_of_axis)};
}

AxisSolver factorise_axes(const model::Model& model, std::span<const std::uint8_t> held,
                          const Context& context) {
  linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model, held, context);
  return {linalg::Factor(matrix, context), std::move(matrix.row_of_axis)};
}

AxisSolver stored_axes(const model::Model& model, linalg::Factor factor) {
  std::vector<std::int64_t> rows(3 * model.nodes.size(), -1);
  std::int64_t next = 0;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      if (!contact::is_fixed(model, i, a))
        rows[3 * i + static_cast<std::size_t>(a)] = next++;
  if (factor.order() != static_cast<std::size_t>(next))
    throw Error("the factor has " + std::to_string(factor.order()) + " rows, expected " +
                std::to_string(next) + " as the model has free axes");
  return {std::move(factor), std::move(rows)};
}

} // namespace gewebe::compliance
