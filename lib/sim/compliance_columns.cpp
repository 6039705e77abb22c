#include "sim/compliance_columns.h"

#include "base/error.h"
#include "base/parallel.h"
#include "sim/condition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace gewebe {

namespace {

constexpr std::size_t block_nodes = 8; // solved by one job

/// The blocks that are computed at the same time, while those before them are handed over.
std::size_t wave_blocks(std::size_t nodes, const Context& context) {
  const std::size_t blocks = (nodes + block_nodes - 1) / block_nodes;
  return std::min<std::size_t>(blocks, 2 * static_cast<std::size_t>(thread_count(context)));
}

/// The columns of a few nodes, and their largest backward error.
struct Block {
  std::vector<double> columns; ///< [node][axis][3 n]
  std::vector<double> f, u;    ///< kept from block to block
  double residual = 0;
};

class Columns {
public:
  Columns(const StiffnessMatrix& matrix, const Factor& factor, double norm,
          std::span<const std::uint32_t> nodes)
      : matrix_(matrix), factor_(factor), norm_(norm), nodes_(nodes) {}

  std::size_t blocks() const { return (nodes_.size() + block_nodes - 1) / block_nodes; }

  void solve(std::size_t block, Block& out) const {
    const auto nodes = nodes_of(block);
    const std::size_t n = matrix_.order(), axes = matrix_.row_of_axis.size();
    // Only free axes have an equation.
    std::vector<std::size_t> asked;
    for (std::size_t k = 0; k < nodes.size(); ++k)
      for (std::size_t a = 0; a < 3; ++a)
        if (row_of(nodes[k], a) >= 0)
          asked.push_back(3 * k + a);
    std::vector<double>&f = out.f, &u = out.u;
    f.assign(n * asked.size(), 0.0);
    u.resize(f.size());
    for (std::size_t c = 0; c < asked.size(); ++c)
      f[c * n + static_cast<std::size_t>(row_of(nodes[asked[c] / 3], asked[c] % 3))] = 1;
    factor_.solve(f, u, asked.size());
    out.columns.assign(nodes.size() * 3 * axes, 0.0);
    out.residual = 0;
    for (std::size_t c = 0; c < asked.size(); ++c) {
      const std::span<const double> x(u.data() + c * n, n);
      for (std::size_t r = 0; r < n; ++r)
        out.columns[asked[c] * axes + static_cast<std::size_t>(matrix_.axis_of_row[r])] = x[r];
      if (c == 0 || asked[c] / 3 != asked[c - 1] / 3)
        keep_worst(out.residual, backward_error(matrix_, norm_, x, {f.data() + c * n, n}));
    }
  }

  void hand_over(std::size_t block, const Block& from, ColumnSink& sink, double& residual) const {
    const std::size_t each = 3 * matrix_.row_of_axis.size();
    for (std::size_t k = 0; k < nodes_of(block).size(); ++k)
      sink.write(block * block_nodes + k, {from.columns.data() + k * each, each});
    keep_worst(residual, from.residual);
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
    if (!(error <= max_backward_error))
      throw Error("a column has a backward error beyond 1e-14");
    worst = std::max(worst, error);
  }

  const StiffnessMatrix& matrix_;
  const Factor& factor_;
  double norm_;
  std::span<const std::uint32_t> nodes_;
};

} // namespace

double compliance_columns_bytes(const StiffnessMatrix& matrix, std::size_t nodes,
                                const Context& context) {
  // A block has right-hand sides, solutions, a panel of them and the columns; those of the wave
  // before wait to be handed over.
  const double block = 8.0 * 3 * static_cast<double>(block_nodes) *
                       (static_cast<double>(matrix.order()) * 3 +
                        static_cast<double>(matrix.row_of_axis.size()) * 2);
  return block * static_cast<double>(wave_blocks(nodes, context));
}

double compliance_columns(const StiffnessMatrix& matrix, const Factor& factor, double norm,
                          std::span<const std::uint32_t> nodes, const Context& context,
                          ColumnSink& sink) {
  require_memory(context,
                 compliance_columns_bytes(matrix, nodes.size(), context) +
                     8 * static_cast<double>(factor.entries()),
                 "the factor with a block of columns");
  const Columns columns(matrix, factor, norm, nodes);
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

} // namespace gewebe
