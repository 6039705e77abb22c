#pragma once
// Columns of the compliance C that take a twentieth of their room or less, every entry within a
// bound, evaluated as they are.
//
// Nodes are put into clusters by their places (compliance/node_clusters.h), those that have columns
// apart from the rest. A block of C between two clusters is smooth unless they touch, and a sum of
// few crosses of small integers (compliance/crosses.h). C is symmetric: of two blocks that mirror
// each other one is kept. The blocks of a cluster with itself and with all clusters behind it make
// a chunk, which is loaded when one of them is first needed.

#include "base/columns.h"
#include "base/context.h"
#include "compliance/crosses.h"
#include "compliance/node_clusters.h"
#include "contact/load.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// What is known of compressed columns without any of their numbers.
struct CompressedLayout {
  NodeClusters clusters;         ///< of the m nodes that columns have rows for
  std::size_t with_columns = 0;  ///< the first so many clusters are of the nodes with columns
  std::vector<CrossCount> count; ///< by block: chunk by chunk, cluster by cluster
  double relative = 0;           ///< the bound that was asked for, over the largest entry of C
  double bound = 0;              ///< what any entry may be wrong by, mm for 1e-6 N
};

/// \throw Error if it contradicts itself or isn't of the first `row_nodes` nodes: it may come from
/// a file
void check_layout(const CompressedLayout& layout, std::size_t row_nodes);
/// Bytes of each chunk. \pre check_layout passed
std::vector<std::uint64_t> chunk_sizes(const CompressedLayout& layout);
/// A chunk as bytes: scales, then int16, then int8, little-endian.
std::vector<std::uint8_t> bytes_of(const Crosses& chunk);

/// Forces on nodes of one cluster, by the numbers that its blocks have.
struct ClusterLoad {
  std::size_t cluster = 0;
  std::vector<CrossLoad> load;
};

/// Asked for the bytes of a chunk once at most.
using ChunkReader = std::function<std::vector<std::uint8_t>(std::size_t chunk)>;

/// Not to be used from several threads at once.
class CompressedColumns final : public ColumnSource {
public:
  /// \param nodes n, of all nodes of the model   \pre check_layout passed for n nodes or fewer
  CompressedColumns(CompressedLayout layout, std::size_t nodes, ChunkReader reader);

  const CompressedLayout& layout() const noexcept { return layout_; }
  std::size_t node_count() const override { return node_count_; }
  std::size_t row_nodes() const override { return place_.size(); }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  /// Puts a node's columns together. \throw what the reader throws, as all below
  void read(std::size_t k, std::span<double> out) const override;
  const CompressedColumns* compressed() const override { return this; }
  EntryBound bound() const override { return {layout_.relative, layout_.bound}; }

  bool has(std::uint32_t node) const {
    return node < place_.size() && cluster_[node] < layout_.with_columns;
  }
  /// C between a node that has columns and any other of the first m, [axis][axis of the other];
  /// that of the two in the other order is its transpose, bit by bit.
  std::array<std::array<double, 3>, 3> block(std::uint32_t node, std::uint32_t other) const;
  /// One entry of it, bit by bit: a row's displacement under a force along an axis of the node.
  double entry(std::uint32_t node, int axis, std::size_t row) const;
  /// u += C f over the first 3 m axes, for forces at nodes that have columns. The same bytes for
  /// any number of threads.
  void add(std::span<const NodeVector> forces, const Context& context, std::span<double> u) const;

  /// Numbers that a sum with forces at these nodes takes from memory.
  double numbers(std::span<const std::uint32_t> nodes) const;

  /// Reads all chunks that were not yet needed, so that none is waited for later.
  void read_all() const;

  /// A chunk as it was read.
  std::vector<std::uint8_t> chunk_bytes(std::size_t index) const { return bytes_of(chunk(index)); }

  std::uint64_t chunks_read() const noexcept { return chunks_read_; }

private:
  std::uint32_t of(std::uint32_t node) const { return cluster_[node]; }
  /// The forces of a sum, by ascending clusters; reads what the sum needs.
  std::vector<ClusterLoad> loads_of(std::span<const NodeVector> forces) const;
  /// C f at a cluster's nodes in their order.
  std::vector<double> sum_at(std::size_t cluster, std::span<const ClusterLoad> loads,
                             CpuLevel cpu) const;
  /// C is taken with the first of two nodes first, so that both orders have the same bits.
  bool is_before(std::uint32_t a, std::uint32_t b) const {
    return of(a) < of(b) || (of(a) == of(b) && place_[a] < place_[b]);
  }
  const Crosses& chunk(std::size_t index) const;
  CrossView view(std::size_t chunk, std::size_t cluster) const;

  struct BlockPlace {
    std::size_t scale = 0, wide = 0, narrow = 0;
  };
  CompressedLayout layout_;
  std::size_t node_count_;
  ChunkReader reader_;
  std::vector<std::uint32_t> nodes_;   ///< that have columns
  std::vector<std::uint32_t> cluster_; ///< of a node
  std::vector<std::uint32_t> place_;   ///< of a node in its cluster
  std::vector<BlockPlace> at_;         ///< of each block in its chunk
  std::vector<double> row_numbers_;    ///< of a cluster's blocks with all others
  mutable std::vector<std::optional<Crosses>> chunks_;
  mutable std::uint64_t chunks_read_ = 0;
};

} // namespace gewebe
