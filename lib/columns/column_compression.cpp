#include "columns/column_compression.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace gewebe::columns {

namespace {

/// So many nodes of all show how large C is, in groups that are solved for together.
constexpr std::size_t shown_every = 16, shown_together = 8;

double largest_on_diagonal(std::uint32_t node, std::span<const double> columns) {
  const std::size_t axes = columns.size() / 3;
  double max = 0;
  for (std::size_t a = 0; a < 3; ++a)
    max = std::max(max, columns[a * axes + 3 * std::size_t{node} + a]);
  return max;
}

/// Keeps the columns of a few nodes, or only how large they are.
class Kept final : public ColumnSink {
public:
  Kept(std::span<const std::uint32_t> nodes, std::span<double> columns, double& largest)
      : nodes_(nodes), columns_(columns), largest_(largest) {}
  void write(std::size_t k, std::span<const double> columns, double /*residual*/) override {
    largest_ = std::max(largest_, largest_on_diagonal(nodes_[k], columns));
    if (!columns_.empty())
      std::copy(columns.begin(), columns.end(),
                columns_.begin() + static_cast<std::ptrdiff_t>(k * columns.size()));
  }

private:
  std::span<const std::uint32_t> nodes_;
  std::span<double> columns_;
  double& largest_;
};

/// Nodes that show the size of C: not all alike, and spread.
std::vector<std::uint32_t> shown(std::span<const std::uint32_t> nodes) {
  const std::size_t count =
      std::min(nodes.size(), (nodes.size() / shown_every / shown_together + 1) * shown_together);
  std::vector<std::uint32_t> some;
  for (std::size_t k = 0; k < count; ++k)
    some.push_back(nodes[k * nodes.size() / count]);
  return some;
}

std::vector<std::uint32_t> others(std::size_t all, std::span<const std::uint32_t> nodes) {
  std::vector<bool> has(all);
  for (const std::uint32_t node : nodes)
    has[node] = true;
  std::vector<std::uint32_t> rest;
  for (std::uint32_t node = 0; node < all; ++node)
    if (!has[node])
      rest.push_back(node);
  return rest;
}

/// The block of C between the nodes of a cluster, whose columns these are, and those of another.
std::vector<double> gather(std::span<const double> columns, std::size_t axes, std::size_t rows,
                           std::span<const std::uint32_t> other) {
  std::vector<double> block;
  block.reserve(rows * 3 * other.size());
  for (std::size_t r = 0; r < rows; ++r)
    for (const std::uint32_t node : other)
      for (std::size_t a = 0; a < 3; ++a)
        block.push_back(columns[r * axes + 3 * std::size_t{node} + a]);
  return block;
}

void make_symmetric(std::vector<double>& block, std::size_t rows) {
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < i; ++j)
      block[i * rows + j] = block[j * rows + i] = (block[i * rows + j] + block[j * rows + i]) / 2;
}

} // namespace

std::unique_ptr<CompressedColumns> compressed_columns(CompressedMade made, std::size_t nodes) {
  return std::make_unique<CompressedColumns>(
      std::move(made.layout), nodes,
      [chunks = std::move(made.chunks)](std::size_t chunk) { return chunks[chunk]; });
}

CompressedMade compress_columns(std::span<const Vec3> positions,
                                std::span<const std::uint32_t> nodes, double relative,
                                const ColumnMaker& maker, const Context& context) {
  const std::size_t axes = 3 * positions.size();
  CompressedMade made;
  CompressedLayout& layout = made.layout;
  layout.relative = relative;
  append_clusters(positions, nodes, cluster_nodes, layout.clusters);
  layout.with_columns = layout.clusters.size();
  append_clusters(positions, others(positions.size(), nodes), cluster_nodes, layout.clusters);
  const double bytes =
      24 * static_cast<double>(std::min(cluster_nodes, nodes.size())) * static_cast<double>(axes);
  require_memory(context, bytes, "the columns of a cluster of nodes");

  Context quiet = context;
  quiet.progress = nullptr;
  double largest = 0;
  const std::vector<std::uint32_t> some = shown(nodes);
  Kept sizes(some, {}, largest);
  made.residual = some.empty() ? 0 : maker(some, sizes);
  std::vector<double> columns;
  for (std::size_t a = 0; a < layout.with_columns; ++a) {
    const auto members = layout.clusters.nodes(a);
    const std::size_t rows = 3 * members.size();
    columns.resize(rows * axes);
    Kept kept(members, columns, largest);
    made.residual = std::max(made.residual, maker(members, kept));
    // The largest so far: later chunks may be wrong by more, none by more than it will be.
    layout.bound = relative * largest;
    if (!(std::isfinite(layout.bound) && layout.bound > 0))
      throw Error("no displacement under unit force is above 0, expected some to compress");
    const std::size_t blocks = layout.clusters.size() - a;
    std::vector<Crosses> crosses(blocks);
    std::vector<CrossCount> count(blocks);
    parallel_blocks(quiet, blocks, 1, [&](std::size_t k, std::size_t) {
      std::vector<double> block = gather(columns, axes, rows, layout.clusters.nodes(a + k));
      if (k == 0)
        make_symmetric(block, rows);
      count[k] = append_crosses(block, rows, k == 0, layout.bound, context.cpu, crosses[k]);
    });
    Crosses chunk;
    for (const Crosses& c : crosses) {
      chunk.scale.insert(chunk.scale.end(), c.scale.begin(), c.scale.end());
      chunk.wide.insert(chunk.wide.end(), c.wide.begin(), c.wide.end());
      chunk.narrow.insert(chunk.narrow.end(), c.narrow.begin(), c.narrow.end());
    }
    layout.count.insert(layout.count.end(), count.begin(), count.end());
    made.chunks.push_back(bytes_of(chunk));
    if (context.progress)
      context.progress(static_cast<double>(a + 1) / static_cast<double>(layout.with_columns));
  }
  return made;
}

} // namespace gewebe::columns
