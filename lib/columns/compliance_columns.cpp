#include "columns/compliance_columns.h"

#include "base/error.h"
#include "base/parallel.h"
#include "columns/panel_columns.h"
#include "linalg/condition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace gewebe::columns {

namespace {

constexpr std::size_t block_nodes = compliance_block;

/// The blocks that are computed at the same time, while those before them are handed over.
std::size_t wave_blocks(std::size_t nodes, const Context& context) {
  const std::size_t blocks = (nodes + block_nodes - 1) / block_nodes;
  return std::min<std::size_t>(blocks, 2 * static_cast<std::size_t>(thread_count(context)));
}

/// 3 m for the first `row_nodes` nodes.
std::size_t rows_of(const linalg::StiffnessMatrix& matrix, std::size_t row_nodes) {
  return 3 * std::min(row_nodes, matrix.row_of_axis.size() / 3);
}

/// The columns of a few nodes, and the backward error of their sum.
struct Block {
  std::vector<double> columns;      ///< [node][axis][3 m]
  std::vector<double> x, sum, load; ///< kept from block to block
  double residual = 0;
};

/// What column c of a block counts in the sum that is checked: no two alike.
double weight(std::size_t c) {
  return 1 + static_cast<double>(c) / 32;
}

class Columns {
public:
  Columns(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor, double norm,
          std::span<const std::uint32_t> nodes, CpuLevel cpu, std::size_t row_nodes)
      : matrix_(matrix), factor_(factor), norm_(norm), nodes_(nodes), cpu_(cpu),
        rows_(rows_of(matrix, row_nodes)), place_(matrix.order()) {
    const std::span<const std::int64_t> permutation = factor.view().permutation;
    for (std::size_t k = 0; k < place_.size(); ++k)
      place_[static_cast<std::size_t>(permutation[k])] = static_cast<std::int64_t>(k);
  }

  std::size_t blocks() const { return (nodes_.size() + block_nodes - 1) / block_nodes; }

  void solve(std::size_t block, Block& out) const {
    const auto nodes = nodes_of(block);
    const std::size_t n = matrix_.order(), axes = rows_;
    out.columns.resize(block_nodes * 3 * axes); // 0 on fixed axes, which nothing writes
    std::vector<std::size_t> asked;             // only free axes have an equation
    std::vector<std::int64_t> places;
    for (std::size_t column = 0; column < 3 * nodes.size(); ++column) {
      const std::int64_t row = row_of(nodes[column / 3], column % 3);
      if (row < 0) {
        std::fill_n(out.columns.begin() + static_cast<std::ptrdiff_t>(column * axes), axes, 0.0);
        continue;
      }
      asked.push_back(column);
      places.push_back(place_[static_cast<std::size_t>(row)]);
    }
    const std::size_t width = factor_.solve_units(places, out.x);
    out.sum.assign(n, 0.0);
    out.load.assign(n, 0.0);
    for (std::size_t c = 0; c < asked.size(); ++c)
      out.load[static_cast<std::size_t>(row_of(nodes[asked[c] / 3], asked[c] % 3))] = weight(c);
    std::vector<double*> to;
    std::vector<double> weights;
    for (std::size_t c = 0; c < asked.size(); ++c) {
      to.push_back(out.columns.data() + asked[c] * axes);
      weights.push_back(weight(c));
    }
    take_panel(cpu_)({.x = out.x.data(),
                      .width = width,
                      .place = place_,
                      .at = matrix_.axis_of_row,
                      .end = static_cast<std::int64_t>(axes)},
                     to, weights.data(), out.sum.data());
    out.residual = linalg::backward_error(matrix_, norm_, out.sum, out.load);
  }

  void hand_over(std::size_t block, const Block& from, ColumnSink& sink, double& residual) const {
    const std::size_t each = 3 * rows_;
    keep_worst(residual, from.residual); // nothing wrong is handed over
    for (std::size_t k = 0; k < nodes_of(block).size(); ++k)
      sink.write(block * block_nodes + k, {from.columns.data() + k * each, each}, from.residual);
  }

private:
  std::span<const std::uint32_t> nodes_of(std::size_t block) const {
    return nodes_.subspan(block * block_nodes,
                          std::min(block_nodes, nodes_.size() - block * block_nodes));
  }
  std::int64_t row_of(std::uint32_t node, std::size_t axis) const {
    return matrix_.row_of_axis[3 * std::size_t{node} + axis];
  }
  static void keep_worst(double& worst, double error) {
    if (!(error <= linalg::max_backward_error))
      throw Error("a column has a backward error beyond 1e-14");
    worst = std::max(worst, error);
  }

  const linalg::StiffnessMatrix& matrix_;
  const linalg::Factor& factor_;
  double norm_;
  std::span<const std::uint32_t> nodes_;
  CpuLevel cpu_;
  std::size_t rows_;                ///< 3 m
  std::vector<std::int64_t> place_; ///< of a row in the order of elimination
};

} // namespace

double compliance_columns_bytes(const linalg::StiffnessMatrix& matrix, std::size_t nodes,
                                const Context& context, std::size_t row_nodes) {
  // A block has a panel and the columns; those of the wave before wait to be handed over.
  const double block =
      8.0 * 3 * static_cast<double>(block_nodes) * 2 *
      (static_cast<double>(matrix.order()) + static_cast<double>(rows_of(matrix, row_nodes)));
  return block * static_cast<double>(wave_blocks(nodes, context));
}

double compliance_columns(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor,
                          double norm, std::span<const std::uint32_t> nodes, const Context& context,
                          ColumnSink& sink, std::size_t row_nodes) {
  require_memory(context,
                 compliance_columns_bytes(matrix, nodes.size(), context, row_nodes) +
                     8 * static_cast<double>(factor.entries()),
                 "the factor with a block of columns");
  const Columns columns(matrix, factor, norm, nodes, context.cpu, row_nodes);
  const std::size_t wave = wave_blocks(nodes.size(), context);
  Context quiet = context;
  quiet.progress = nullptr;
  std::array<std::vector<Block>, 2> buffers{std::vector<Block>(wave), std::vector<Block>(wave)};
  double residual = 0;
  // Wave w is computed while wave w - 1 is handed over, by one of the jobs.
  const std::size_t waves = wave == 0 ? 0 : (columns.blocks() + wave - 1) / wave;
  for (std::size_t w = 0; waves > 0 && w <= waves; ++w) {
    const std::size_t begin = std::min(w * wave, columns.blocks());
    const std::size_t end = std::min(begin + wave, columns.blocks());
    std::vector<Block>& now = buffers[w % 2];
    const std::vector<Block>& before = buffers[(w + 1) % 2];
    parallel_blocks(quiet, end - begin + 1, 1, [&](std::size_t job, std::size_t) {
      if (job > 0)
        return columns.solve(begin + job - 1, now[job - 1]);
      const std::size_t first = w == 0 ? 0 : (w - 1) * wave;
      for (std::size_t b = first; b < begin; ++b)
        columns.hand_over(b, before[b - first], sink, residual);
    });
    if (context.progress)
      context.progress(static_cast<double>(end) / static_cast<double>(columns.blocks()));
  }
  return residual;
}

} // namespace gewebe::columns
