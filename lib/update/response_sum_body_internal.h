#pragma once
// Body of response_sum_*.cpp. Each of these files compiles it for its instruction set.

#include "numeric/four_lanes.h"
#include "update/response_sum.h"

namespace gewebe::update {
namespace {

inline constexpr std::size_t parts = response_tile / 4;

/// Adds the vectors of a tile. Its twelve sums stay in registers.
inline void add_tile(const double* tile, std::size_t count, const double* factor,
                     double* const (&sum)[3]) {
  numeric::Four total[3][parts];
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t p = 0; p < parts; ++p)
      total[a][p] = reinterpret_cast<const numeric::Four*>(sum[a])[p];
  for (std::size_t k = 0; k < count; ++k) {
    const numeric::Four* const from =
        reinterpret_cast<const numeric::Four*>(tile + k * response_tile);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t p = 0; p < parts; ++p)
        total[a][p] += from[p] * factor[3 * k + a];
  }
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t p = 0; p < parts; ++p)
      reinterpret_cast<numeric::Four*>(sum[a])[p] = total[a][p];
}

inline void add_tiles(const double* packed, std::size_t count, const double* factor, double* sum,
                      std::size_t stride, std::size_t first_tile, std::size_t end) {
  for (std::size_t t = first_tile; t * response_tile < end; ++t) {
    const double* const tile = packed + t * count * response_tile;
    double* const at = sum + t * response_tile;
    if ((t + 1) * response_tile <= end) {
      add_tile(tile, count, factor, {at, at + stride, at + 2 * stride});
      continue;
    }
    double edge[3][response_tile] = {};
    const std::size_t rows = end - t * response_tile;
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t r = 0; r < rows; ++r)
        edge[a][r] = at[a * stride + r];
    add_tile(tile, count, factor, {edge[0], edge[1], edge[2]});
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t r = 0; r < rows; ++r)
        at[a * stride + r] = edge[a][r];
  }
}

} // namespace
} // namespace gewebe::update
