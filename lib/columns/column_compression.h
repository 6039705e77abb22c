#pragma once
// Compression of columns of the compliance (columns/compressed_columns.h).

#include "base/context.h"
#include "columns/columns.h"
#include "columns/compressed_columns.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::columns {

/// Result of a compression: the layout, and its chunks in order.
struct CompressedMade {
  CompressedLayout layout;
  std::vector<std::vector<std::uint8_t>> chunks;
  double residual = 0; ///< largest residual that the maker of columns returned
};

/// Compressed columns in memory. \param nodes  of the model
std::unique_ptr<CompressedColumns> compressed_columns(CompressedMade made, std::size_t nodes);

/// Computes the columns of some nodes, ascending, hands them to a sink, and returns their residual.
/// The columns have rows for the nodes of `positions`, see compress_columns.
using ColumnMaker = std::function<double(std::span<const std::uint32_t> nodes, ColumnSink& sink)>;

/// Compresses the columns of `nodes`. The error of each entry is at most `relative` times the
/// largest entry on the diagonal of C, which is the largest of all entries, because C is positive
/// definite. `maker` computes the columns of some nodes first, to find that entry, then those of
/// one cluster after the other. Memory is that of the result and the columns of one cluster. The
/// result is the same bytes for any number of threads.
/// \param positions  of the nodes that columns have rows for: of all, or of the first ones
/// \pre nodes ascending, among these; relative in min_relative to 1
/// \throw Error if a number isn't finite, or memory exceeds the context's; Cancelled; the
/// exceptions of the maker
CompressedMade compress_columns(std::span<const Vec3> positions,
                                std::span<const std::uint32_t> nodes, double relative,
                                const ColumnMaker& maker, const Context& context);

/// Smallest bound: above the rounding of the columns themselves.
inline constexpr double min_relative = 1e-7;
/// Largest number of nodes of a cluster.
inline constexpr std::size_t cluster_nodes = 96;

} // namespace gewebe::columns
