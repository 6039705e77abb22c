#pragma once
// The body of front_kernel_*.cpp, each of which compiles it for its instruction set.

#include "sim/front_kernel_internal.h"

#include <algorithm>
#include <cmath>

namespace gewebe {
namespace {

#if defined(__AVX2__)
inline constexpr std::size_t lanes = 4;
#else
inline constexpr std::size_t lanes = 2;
#endif
inline constexpr std::size_t parts = front_strip / lanes;
using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));
using Unaligned =
    double __attribute__((vector_size(lanes * sizeof(double)), aligned(sizeof(double)), may_alias));

/// Rows of one column of a strip.
struct Rows {
  Lanes part[parts];

  void load(const double* from) {
    for (std::size_t i = 0; i < parts; ++i)
      part[i] = reinterpret_cast<const Unaligned*>(from)[i];
  }
  void store(double* to) const {
    for (std::size_t i = 0; i < parts; ++i)
      reinterpret_cast<Unaligned*>(to)[i] = part[i];
  }
  void subtract(const Rows& a, double b) {
    for (std::size_t i = 0; i < parts; ++i)
      part[i] -= a.part[i] * b;
  }
  void divide(double b) {
    for (std::size_t i = 0; i < parts; ++i)
      part[i] /= b;
  }
};

/// The square on the diagonal, column after column.
inline std::size_t eliminate_square(const FrontArrays& f, std::size_t begin, std::size_t count,
                                    const double* least) {
  const std::size_t end = begin + count;
  for (std::size_t c = begin; c < end; ++c) {
    double* const column = f.l + c * f.rows;
    for (std::size_t k = begin; k < c; ++k) {
      const double* const before = f.l + k * f.rows;
      const double factor = before[c];
      for (std::size_t r = c; r < end; ++r)
        column[r] -= before[r] * factor;
    }
    if (!(column[c] > least[c]) || !std::isfinite(column[c]))
      return c - begin;
    const double pivot = std::sqrt(column[c]);
    column[c] = pivot;
    for (std::size_t r = c + 1; r < end; ++r)
      column[r] /= pivot;
  }
  return count;
}

inline std::size_t eliminate(const FrontArrays& f, std::size_t begin, std::size_t count,
                             const double* least, double* packed) {
  if (const std::size_t done = eliminate_square(f, begin, count, least); done < count)
    return done;
  // Rows below: X L' = B, a strip of them at a time.
  const std::size_t end = begin + count;
  for (std::size_t r = end; r < f.rows; r += front_strip, packed += front_panel * front_strip) {
    const std::size_t there = std::min(front_strip, f.rows - r);
    if (there < front_strip)
      std::fill_n(packed, count * front_strip, 0.0);
    for (std::size_t c = 0; c < count; ++c)
      std::copy_n(f.l + (begin + c) * f.rows + r, there, packed + c * front_strip);
    for (std::size_t c = 0; c < count; ++c) {
      Rows x;
      x.load(packed + c * front_strip);
      for (std::size_t k = 0; k < c; ++k) {
        Rows before;
        before.load(packed + k * front_strip);
        x.subtract(before, f.l[(begin + k) * f.rows + begin + c]);
      }
      x.divide(f.l[(begin + c) * f.rows + begin + c]);
      x.store(packed + c * front_strip);
    }
    for (std::size_t c = 0; c < count; ++c)
      std::copy_n(packed + c * front_strip, there, f.l + (begin + c) * f.rows + r);
  }
  return count;
}

/// A column behind the eliminated ones, such that its entry in row r (counted from `end` on) is
/// [r].
inline double* column_at(const FrontArrays& f, std::size_t end, std::size_t c) {
  const std::size_t column = end + c;
  if (column < f.columns)
    return f.l + column * f.rows + end;
  const std::size_t below = f.rows - f.columns;
  // Rows from f.columns on: [r] is valid from there.
  return f.rest + (column - f.columns) * below - (f.columns - end);
}

/// Four columns from `c` on, eight rows from `r` on.
template <bool whole>
void take_tile(double* const* columns, std::size_t r, std::size_t c, std::size_t rows,
               std::size_t width, std::size_t count, const double* a, const double* b) {
  Rows sum[4];
  double edge[4][front_strip];
  for (std::size_t j = 0; j < 4; ++j) {
    if constexpr (whole) {
      sum[j].load(columns[j] + r);
    } else {
      for (std::size_t i = 0; i < front_strip; ++i)
        edge[j][i] = j < width && r + i < rows && r + i >= c + j ? columns[j][r + i] : 0;
      sum[j].load(edge[j]);
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    Rows ak;
    ak.load(a + k * front_strip);
    const double* const bk = b + k * front_strip;
    for (std::size_t j = 0; j < 4; ++j)
      sum[j].subtract(ak, bk[j]);
  }
  for (std::size_t j = 0; j < 4; ++j) {
    if constexpr (whole) {
      sum[j].store(columns[j] + r);
    } else {
      sum[j].store(edge[j]);
      for (std::size_t i = 0; i < front_strip; ++i)
        if (j < width && r + i < rows && r + i >= c + j)
          columns[j][r + i] = edge[j][i];
    }
  }
}

inline void take(const FrontArrays& f, std::size_t begin, std::size_t count, const double* packed,
                 std::size_t strip) {
  const std::size_t end = begin + count, rows = f.rows - end;
  const std::size_t first = strip * front_strip;
  constexpr std::size_t size = front_panel * front_strip;
  double* columns[front_strip] = {};
  const std::size_t width = std::min(front_strip, rows - first);
  for (std::size_t j = 0; j < width; ++j)
    columns[j] = column_at(f, end, first + j);
  const double* const b = packed + strip * size;
  for (std::size_t r = first; r < rows; r += front_strip) {
    const double* const a = packed + r / front_strip * size;
    const bool whole = r > first && width == front_strip && r + front_strip <= rows;
    for (std::size_t j = 0; j < width; j += 4) {
      if (whole)
        take_tile<true>(columns + j, r, first + j, rows, 4, count, a, b + j);
      else
        take_tile<false>(columns + j, r, first + j, rows, std::min<std::size_t>(4, width - j),
                         count, a, b + j);
    }
  }
}

} // namespace
} // namespace gewebe
