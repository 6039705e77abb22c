#pragma once
// Copies panels, which are stored by rows, to columns, and computes a weighted sum of each row. It
// is compiled once per CPU level. Every level gives the same bits, because there is no fused
// multiplication and each row is summed in the order of the columns.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::columns {

struct PanelRows {
  const double* x = nullptr;           ///< x[place][column]
  std::size_t width = 0;               ///< distance from one place to the next
  std::span<const std::int64_t> place; ///< of each row
  /// Index of a row in a column: ascending. Rows with an index of `end` or more are not copied.
  std::span<const std::int64_t> at;
  std::int64_t end = 0;
};

/// column[c][at[r]] = x[place[r]][c] and sum[r] = Σ weight[c] x[place[r]][c] for each row r and
/// each of the columns. \pre as many weights as columns, at most `width`; sum for each row
using TakePanel = void (*)(const PanelRows& rows, std::span<double* const> column,
                           const double* weight, double* sum);

void take_panel_baseline(const PanelRows& rows, std::span<double* const> column,
                         const double* weight, double* sum);
void take_panel_avx2(const PanelRows& rows, std::span<double* const> column, const double* weight,
                     double* sum);

inline TakePanel take_panel(CpuLevel level) {
  return level == CpuLevel::baseline ? &take_panel_baseline : &take_panel_avx2;
}

} // namespace gewebe::columns
