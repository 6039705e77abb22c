#pragma once
// Makes compressed columns (compliance/compressed_columns.h).

#include "base/columns.h"
#include "base/context.h"
#include "base/vec3.h"
#include "compliance/compressed_columns.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

/// Where compression puts a layout and its chunks, in their order.
struct CompressedMade {
  CompressedLayout layout;
  std::vector<std::vector<std::uint8_t>> chunks;
  double residual = 0; ///< what the maker of columns returned, at most
};

/// Columns in memory, of a model of so many nodes.
std::unique_ptr<CompressedColumns> compressed_columns(CompressedMade made, std::size_t nodes);

/// Hands the columns of some nodes, ascending, to a sink, and returns their residual. They have
/// rows for as many nodes as have positions below.
using ColumnMaker = std::function<double(std::span<const std::uint32_t> nodes, ColumnSink& sink)>;

/// Compresses the columns of `nodes`, which are asked for cluster by cluster, and those of some
/// nodes before to find the size of C. No entry will be wrong by more than `relative` times the
/// largest of the entries on the diagonal, which of a positive definite C is the largest of all.
/// Takes memory for the columns of one cluster beside the result. The same bytes for any number of
/// threads.
/// \param positions of the nodes that columns have rows for: of all, or of the first ones \pre
/// nodes ascending, among these; relative in min_relative to 1 \throw Error if a number isn't
/// finite, or memory exceeds the context's; Cancelled; what the maker throws
CompressedMade compress_columns(std::span<const Vec3> positions,
                                std::span<const std::uint32_t> nodes, double relative,
                                const ColumnMaker& maker, const Context& context);

/// Rounding of the columns themselves stays below it.
inline constexpr double min_relative = 1e-7;
/// Nodes of a cluster.
inline constexpr std::size_t cluster_nodes = 96;

} // namespace gewebe
