#pragma once
// Compressed columns of the compliance C. They take a twentieth of their memory or less, with a
// bound for the error of each entry, and are evaluated without decompression.
//
// Nodes are put into clusters by their positions (columns/node_clusters.h); nodes with columns
// and nodes without are in different clusters. A block of C between two clusters is smooth unless
// they touch, and is stored as a sum of few rank-one terms of small integers
// (columns/crosses.h). C is symmetric, so one of two transposed blocks is stored. The blocks of
// a cluster with itself and with all later clusters form a chunk. A chunk is loaded when one of its
// blocks is first needed.

#include "base/context.h"
#include "columns/columns.h"
#include "columns/crosses.h"
#include "columns/node_clusters.h"
#include "contact/load.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::columns {

/// Structure of compressed columns, without their entries.
struct CompressedLayout {
  NodeClusters clusters;         ///< of the m nodes that columns have rows for
  std::size_t with_columns = 0;  ///< number of clusters of nodes with columns; these come first
  std::vector<CrossCount> count; ///< by block: chunk by chunk, cluster by cluster
  double relative = 0;           ///< requested error bound, over the largest entry of C
  double bound = 0;              ///< largest error of an entry, mm for 1e-6 N
};

/// Checks a layout that comes from a file.
/// \throw Error if it contradicts itself or isn't of the first `row_nodes` nodes
void check_layout(const CompressedLayout& layout, std::size_t row_nodes);
/// Bytes of each chunk. \pre check_layout passed
std::vector<std::uint64_t> chunk_sizes(const CompressedLayout& layout);
/// A chunk as bytes: scales, then int16, then int8, little-endian.
std::vector<std::uint8_t> bytes_of(const Crosses& chunk);

/// Forces on nodes of one cluster, by the nodes' numbers in its blocks.
struct ClusterLoad {
  std::size_t cluster = 0;
  std::vector<CrossLoad> load;
};

/// Reads the bytes of a chunk. It is called at most once for each chunk.
using ChunkReader = std::function<std::vector<std::uint8_t>(std::size_t chunk)>;

/// Compressed columns with their loaded chunks. Not to be used from several threads at once.
class CompressedColumns final : public ColumnSource {
public:
  /// \param nodes n, of all nodes of the model   \pre check_layout passed for n nodes or fewer
  CompressedColumns(CompressedLayout layout, std::size_t nodes, ChunkReader reader);

  const CompressedLayout& layout() const noexcept { return layout_; }
  std::size_t node_count() const override { return node_count_; }
  std::size_t row_nodes() const override { return place_.size(); }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  /// Decompresses a node's columns. \throw as the reader; so do all members below
  void read(std::size_t k, std::span<double> out) const override;
  const CompressedColumns* compressed() const override { return this; }
  EntryBound bound() const override { return {layout_.relative, layout_.bound}; }

  bool has(std::uint32_t node) const {
    return node < place_.size() && cluster_[node] < layout_.with_columns;
  }
  /// Block of C between a node that has columns and any other of the first m, [axis][axis of the
  /// other]. Exchanging the nodes gives the transpose, to the bit.
  std::array<std::array<double, 3>, 3> block(std::uint32_t node, std::uint32_t other) const;
  /// Entry of a block, with the same bits: a row's displacement under a force along an axis of the
  /// node.
  double entry(std::uint32_t node, int axis, std::size_t row) const;
  /// u += C f over the first 3 m axes, for forces at nodes that have columns. The result is the
  /// same bytes for any number of threads.
  void add(std::span<const contact::NodeVector> forces, const Context& context,
           std::span<double> u) const;

  /// C f at the nodes of some clusters of layout(): 3 numbers for each node, cluster by cluster,
  /// with the bits of add() to zeros. \pre as add
  std::vector<double> sum_at(std::span<const std::uint32_t> clusters,
                             std::span<const contact::NodeVector> forces,
                             const Context& context) const;
  /// Bound of the size of C f along an axis, by cluster. It costs much less than the sum. \pre as
  /// add
  std::vector<double> bounds(std::span<const contact::NodeVector> forces,
                             const Context& context) const;

  /// Number of values that a sum with forces at these nodes reads from memory.
  double numbers(std::span<const std::uint32_t> nodes) const;

  /// Reads all chunks that were not yet needed, so that later calls need not wait for any.
  void read_all() const;

  /// A chunk as it was read.
  std::vector<std::uint8_t> chunk_bytes(std::size_t index) const { return bytes_of(chunk(index)); }

  std::uint64_t chunks_read() const noexcept { return chunks_read_; }

private:
  std::uint32_t of(std::uint32_t node) const { return cluster_[node]; }
  /// The forces of a sum, by ascending clusters; reads what the sum needs.
  std::vector<ClusterLoad> loads_of(std::span<const contact::NodeVector> forces) const;
  /// C f at a cluster's nodes in their order.
  std::vector<double> sum_at(std::size_t cluster, std::span<const ClusterLoad> loads,
                             CpuLevel cpu) const;
  /// Order of two nodes in which C is evaluated, so that both orders give the same bits.
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
  std::span<const std::array<double, 2>> largest(std::size_t chunk, std::size_t cluster) const;
  mutable std::vector<std::optional<Crosses>> chunks_;
  /// By block: of its terms; empty while it was not needed.
  mutable std::vector<std::vector<std::array<double, 2>>> largest_;
  mutable std::uint64_t chunks_read_ = 0;
};

} // namespace gewebe::columns
