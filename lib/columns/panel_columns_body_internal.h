#pragma once
// Body of panel_columns_*.cpp: copies a panel to columns, with the weighted sum of each row. Each
// of these files compiles it for one instruction set.

#include "columns/panel_columns.h"
#include "numeric/four_lanes.h"

#include <cstddef>
#include <span>

namespace gewebe::columns {
namespace {

inline constexpr std::size_t rows_at_once = 8; ///< two blocks, whose sums don't wait for each other

/// Transposes a block of four rows.
inline void transpose(numeric::Four& a, numeric::Four& b, numeric::Four& c, numeric::Four& d) {
  const numeric::Four low = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  const numeric::Four high = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const numeric::Four lower = __builtin_shufflevector(c, d, 0, 4, 2, 6);
  const numeric::Four higher = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(low, lower, 0, 1, 4, 5);
  b = __builtin_shufflevector(high, higher, 0, 1, 4, 5);
  c = __builtin_shufflevector(low, lower, 2, 3, 6, 7);
  d = __builtin_shufflevector(high, higher, 2, 3, 6, 7);
}

inline const double* panel_row(const PanelRows& rows, std::size_t r) {
  return rows.x + static_cast<std::size_t>(rows.place[r]) * rows.width;
}

/// Copies eight rows that are consecutive in a column, four columns at a time.
inline void take_together(const PanelRows& rows, std::size_t first, std::span<double* const> column,
                          const double* weight, double* sum) {
  const double* x[rows_at_once];
  for (std::size_t i = 0; i < rows_at_once; ++i)
    x[i] = panel_row(rows, first + i);
  const auto at = static_cast<std::size_t>(rows.at[first]);
  numeric::Four low{}, high{};
  std::size_t c = 0;
  for (; c + 4 <= column.size(); c += 4) {
    numeric::Four a[4], b[4];
    for (std::size_t i = 0; i < 4; ++i) {
      numeric::load(x[i] + c, a[i]);
      numeric::load(x[i + 4] + c, b[i]);
    }
    transpose(a[0], a[1], a[2], a[3]);
    transpose(b[0], b[1], b[2], b[3]);
    for (std::size_t j = 0; j < 4; ++j) {
      low += weight[c + j] * a[j];
      high += weight[c + j] * b[j];
      numeric::four(column[c + j] + at) = a[j];
      numeric::four(column[c + j] + at + 4) = b[j];
    }
  }
  for (; c < column.size(); ++c)
    for (std::size_t i = 0; i < 4; ++i) {
      low[i] += weight[c] * x[i][c];
      high[i] += weight[c] * x[i + 4][c];
      column[c][at + i] = x[i][c];
      column[c][at + i + 4] = x[i + 4][c];
    }
  numeric::four(sum + first) = low;
  numeric::four(sum + first + 4) = high;
}

inline void take_one(const PanelRows& rows, std::size_t r, std::span<double* const> column,
                     const double* weight, double* sum) {
  const double* const x = panel_row(rows, r);
  double all = 0;
  for (std::size_t c = 0; c < column.size(); ++c)
    all += weight[c] * x[c];
  sum[r] = all;
  if (rows.at[r] < rows.end)
    for (std::size_t c = 0; c < column.size(); ++c)
      column[c][rows.at[r]] = x[c];
}

inline void take(const PanelRows& rows, std::span<double* const> column, const double* weight,
                 double* sum) {
  constexpr std::size_t ahead = 2 * rows_at_once, line = 64 / sizeof(double);
  const std::size_t count = rows.place.size();
  for (std::size_t r = 0; r < count;) {
    const std::size_t last = r + rows_at_once - 1;
    if (last + ahead < count) // places are scattered, so that the hardware can't prefetch them
      for (std::size_t i = 0; i < rows_at_once; ++i)
        for (std::size_t c = 0; c < rows.width; c += line)
          __builtin_prefetch(panel_row(rows, r + ahead + i) + c);
    if (last < count && rows.at[last] < rows.end &&
        rows.at[last] - rows.at[r] == static_cast<std::int64_t>(rows_at_once) - 1) {
      take_together(rows, r, column, weight, sum);
      r += rows_at_once;
    } else {
      take_one(rows, r++, column, weight, sum);
    }
  }
}

} // namespace
} // namespace gewebe::columns
