#pragma once
// Inner loop of elastostatics: a sum of columns of the compliance matrix. It is compiled once per
// CPU level. Every level gives the same bits, because there is no fused multiplication and each row
// is summed in the order of the columns. Columns may be float32 or small integers: they are widened
// to double, and the sum is double.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>

namespace gewebe::columns {

/// sum[r] += Σ factor[k] column[k][r] for begin <= r < end.
template <class Entry>
using ColumnSum = void (*)(const Entry* const* column, const double* factor, std::size_t count,
                           double* sum, std::size_t begin, std::size_t end);

void column_sum_baseline(const double* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end);
void column_sum_baseline(const float* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end);
void column_sum_baseline(const std::int16_t* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end);
void column_sum_baseline(const std::int8_t* const* column, const double* factor, std::size_t count,
                         double* sum, std::size_t begin, std::size_t end);
void column_sum_avx2(const double* const* column, const double* factor, std::size_t count,
                     double* sum, std::size_t begin, std::size_t end);
void column_sum_avx2(const float* const* column, const double* factor, std::size_t count,
                     double* sum, std::size_t begin, std::size_t end);
void column_sum_avx2(const std::int16_t* const* column, const double* factor, std::size_t count,
                     double* sum, std::size_t begin, std::size_t end);
void column_sum_avx2(const std::int8_t* const* column, const double* factor, std::size_t count,
                     double* sum, std::size_t begin, std::size_t end);

template <class Entry>
ColumnSum<Entry> column_sum(CpuLevel level) {
  if (level == CpuLevel::baseline)
    return &column_sum_baseline;
  return &column_sum_avx2;
}

} // namespace gewebe::columns
