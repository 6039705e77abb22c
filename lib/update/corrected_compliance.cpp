#include "update/corrected_compliance.h"

#include "base/error.h"
#include "columns/compliance_columns.h"
#include "linalg/condition.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace gewebe::update {

namespace {

class Blocks {
public:
  Blocks(const linalg::StiffnessMatrix& matrix, const compliance::AxisSolver& solver, double norm)
      : matrix_(matrix), solver_(solver), norm_(norm) {}

  /// Backward error of a sum of the columns of these nodes.
  double residual(std::span<const std::uint32_t> nodes, std::span<const double> columns) const {
    const std::size_t order = matrix_.order(), axes = matrix_.row_of_axis.size();
    std::vector<double> sum(order), load(order);
    for (std::size_t c = 0; c < 3 * nodes.size(); ++c) {
      const double weight = 1 + static_cast<double>(c) / 32; // no two alike
      const std::int64_t row = matrix_.row_of_axis[3 * std::size_t{nodes[c / 3]} + c % 3];
      if (row >= 0)
        load[static_cast<std::size_t>(row)] = weight;
      for (std::size_t r = 0; r < order; ++r)
        sum[r] += weight * columns[c * axes + static_cast<std::size_t>(matrix_.axis_of_row[r])];
    }
    return linalg::backward_error(matrix_, norm_, sum, load);
  }

  void solve(std::span<const std::uint32_t> nodes, std::span<double> columns) const {
    const std::size_t axes = matrix_.row_of_axis.size();
    std::fill(columns.begin(), columns.end(), 0.0);
    for (std::size_t c = 0; c < 3 * nodes.size(); ++c)
      columns[c * axes + 3 * std::size_t{nodes[c / 3]} + c % 3] = 1;
    solver_.solve(columns, 3 * nodes.size());
  }

private:
  const linalg::StiffnessMatrix& matrix_;
  const compliance::AxisSolver& solver_;
  double norm_;
};

} // namespace

CorrectedCompliance corrected_compliance(const linalg::StiffnessMatrix& matrix,
                                         const compliance::AxisSolver& solver, double norm,
                                         const CorrectedColumns& columns, const Context& context,
                                         columns::ColumnSink& sink) {
  const std::span<const std::uint32_t> nodes = columns.nodes();
  CorrectedCompliance result;
  if (!columns.pays(nodes.size())) {
    result.residual =
        columns::compliance_columns(matrix, solver.factor, norm, nodes, context, sink);
    return result;
  }
  const double max = columns.single() ? static_cast<double>(std::numeric_limits<float>::epsilon())
                                      : linalg::max_backward_error;
  const Blocks blocks(matrix, solver, norm);
  const std::size_t each = 3 * matrix.row_of_axis.size();
  std::vector<double> kept(each * columns::compliance_block);
  for (std::size_t first = 0; first < nodes.size(); first += columns::compliance_block) {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
    const std::size_t count = std::min(columns::compliance_block, nodes.size() - first);
    const auto some = nodes.subspan(first, count);
    const auto block = std::span(kept).first(each * count);
    columns.read(first, count, block);
    double error = blocks.residual(some, block);
    if (error <= max) {
      result.corrected += 3 * count;
    } else {
      blocks.solve(some, block);
      error = blocks.residual(some, block);
      if (!(error <= linalg::max_backward_error))
        throw Error("a column has a backward error beyond 1e-14");
    }
    result.residual = std::max(result.residual, error);
    for (std::size_t k = 0; k < count; ++k)
      sink.write(first + k, block.subspan(k * each, each), error);
    if (context.progress)
      context.progress(static_cast<double>(first + count) / static_cast<double>(nodes.size()));
  }
  return result;
}

} // namespace gewebe::update
