#pragma once
// Inner loop of corrected columns: sums of the same vectors for a node's three columns. It is
// compiled once per CPU level. Every level gives the same bits, because there is no fused
// multiplication and each row is summed in the order of the vectors.

#include "base/cpu.h"

#include <cstddef>

namespace gewebe::update {

/// Number of rows of a tile. Vectors are packed as [tile][vector][row]; the last tile is filled up
/// with zeros.
inline constexpr std::size_t response_tile = 16;

/// sum[stride a + r] += Σ_k factor[3 k + a] vector_k[r] for a = 0, 1, 2 and the rows r < end of
/// tiles from first_tile on, of `count` vectors.
using ResponseSum = void (*)(const double* packed, std::size_t count, const double* factor,
                             double* sum, std::size_t stride, std::size_t first_tile,
                             std::size_t end);

void response_sum_baseline(const double* packed, std::size_t count, const double* factor,
                           double* sum, std::size_t stride, std::size_t first_tile,
                           std::size_t end);
void response_sum_avx2(const double* packed, std::size_t count, const double* factor, double* sum,
                       std::size_t stride, std::size_t first_tile, std::size_t end);

inline ResponseSum response_sum(CpuLevel level) {
  return level == CpuLevel::baseline ? &response_sum_baseline : &response_sum_avx2;
}

} // namespace gewebe::update
