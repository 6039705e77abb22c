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

/// Rows behind the eliminated columns, in strips that end with the last row; the first one may
/// begin above `end`.
struct Strips {
  std::size_t end, count;
  std::ptrdiff_t first; ///< row where the first would begin

  Strips(const FrontArrays& f, std::size_t behind)
      : end(behind), count((f.rows - behind + front_strip - 1) / front_strip),
        first(static_cast<std::ptrdiff_t>(f.rows) -
              static_cast<std::ptrdiff_t>(front_strip * count)) {}
  std::ptrdiff_t start(std::size_t strip) const {
    return first + static_cast<std::ptrdiff_t>(front_strip * strip);
  }
  /// Rows of a strip that are none.
  std::size_t missing(std::size_t strip) const {
    return strip == 0 ? static_cast<std::size_t>(static_cast<std::ptrdiff_t>(end) - first) : 0;
  }
};

inline constexpr std::size_t strip_size = front_panel * front_strip;

/// X L' = B for N strips, packed: each waits for its own last subtraction, not for the others'.
template <std::size_t N>
void solve_strips(const FrontArrays& f, std::size_t begin, std::size_t count, double* packed) {
  for (std::size_t c = 0; c < count; ++c) {
    Rows x[N];
    for (std::size_t n = 0; n < N; ++n)
      x[n].load(packed + n * strip_size + c * front_strip);
    for (std::size_t k = 0; k < c; ++k) {
      const double factor = f.l[(begin + k) * f.rows + begin + c];
      for (std::size_t n = 0; n < N; ++n) {
        Rows before;
        before.load(packed + n * strip_size + k * front_strip);
        x[n].subtract(before, factor);
      }
    }
    const double pivot = f.l[(begin + c) * f.rows + begin + c];
    for (std::size_t n = 0; n < N; ++n) {
      x[n].divide(pivot);
      x[n].store(packed + n * strip_size + c * front_strip);
    }
  }
}

inline std::size_t eliminate(const FrontArrays& f, std::size_t begin, std::size_t count,
                             const double* least, double* packed) {
  if (const std::size_t done = eliminate_square(f, begin, count, least); done < count)
    return done;
  const Strips strips(f, begin + count);
  // Copies a strip out of the columns, or back into them.
  const auto copy = [&](std::size_t strip, bool out) {
    double* const to = packed + strip * strip_size;
    const std::size_t missing = strips.missing(strip);
    for (std::size_t c = 0; c < count; ++c) {
      double* const rows =
          f.l + (begin + c) * f.rows + strips.start(strip) + static_cast<std::ptrdiff_t>(missing);
      double* const there = to + c * front_strip + missing;
      if (out) {
        std::fill_n(to + c * front_strip, missing, 0.0);
        std::copy_n(rows, front_strip - missing, there);
      } else {
        std::copy_n(there, front_strip - missing, rows);
      }
    }
  };
  constexpr std::size_t at_once = 4;
  for (std::size_t strip = 0; strip < strips.count;) {
    const std::size_t some = strips.count - strip >= at_once ? at_once : 1;
    for (std::size_t n = 0; n < some; ++n)
      copy(strip + n, true);
    double* const first = packed + strip * strip_size;
    if (some == at_once)
      solve_strips<at_once>(f, begin, count, first);
    else
      solve_strips<1>(f, begin, count, first);
    for (std::size_t n = 0; n < some; ++n)
      copy(strip + n, false);
    strip += some;
  }
  return count;
}

/// A column behind the eliminated ones, such that [r] is its entry in row r.
inline double* column_at(const FrontArrays& f, std::size_t column) {
  if (column < f.columns)
    return f.l + column * f.rows;
  const std::size_t below = f.rows - f.columns;
  // Rows from f.columns on: [r] is valid from there.
  return f.rest + (column - f.columns) * below - f.columns;
}

/// The rows of one strip lose their products with N columns.
template <std::size_t N>
void take_tile(double* const* columns, std::ptrdiff_t r, std::size_t count, const double* a,
               const double* b) {
  Rows sum[N];
  for (std::size_t j = 0; j < N; ++j)
    sum[j].load(columns[j] + r);
  for (std::size_t k = 0; k < count; ++k) {
    Rows ak;
    ak.load(a + k * front_strip);
    const double* const bk = b + k * front_strip;
    for (std::size_t j = 0; j < N; ++j)
      sum[j].subtract(ak, bk[j]);
  }
  for (std::size_t j = 0; j < N; ++j)
    sum[j].store(columns[j] + r);
}

/// The tile on the diagonal where not all of its rows are there in each of its columns.
inline void take_corner(double* const* columns, std::ptrdiff_t start, std::size_t missing,
                        std::size_t count, const double* a) {
  double tile[front_strip][front_strip] = {};
  double* into[front_strip];
  for (std::size_t j = missing; j < front_strip; ++j)
    for (std::size_t i = j; i < front_strip; ++i)
      tile[j][i] = columns[j][start + static_cast<std::ptrdiff_t>(i)];
  for (std::size_t j = 0; j < front_strip; ++j)
    into[j] = tile[j];
  take_tile<4>(into, 0, count, a, a);
  take_tile<4>(into + 4, 0, count, a, a + 4);
  for (std::size_t j = missing; j < front_strip; ++j)
    for (std::size_t i = j; i < front_strip; ++i)
      columns[j][start + static_cast<std::ptrdiff_t>(i)] = tile[j][i];
}

inline void take(const FrontArrays& f, std::size_t begin, std::size_t count, const double* packed,
                 std::size_t strip) {
  const Strips strips(f, begin + count);
  const std::ptrdiff_t start = strips.start(strip);
  const std::size_t missing = strips.missing(strip);
  double* columns[front_strip] = {};
  for (std::size_t j = missing; j < front_strip; ++j)
    columns[j] = column_at(f, static_cast<std::size_t>(start + static_cast<std::ptrdiff_t>(j)));
  const double* const b = packed + strip * strip_size;
  std::size_t first = strip;
  const auto own = static_cast<std::ptrdiff_t>(f.columns);
  if (missing > 0 || (start < own && own < start + static_cast<std::ptrdiff_t>(front_strip))) {
    take_corner(columns, start, missing, count, b);
    ++first;
  }
  for (std::size_t r = first; r < strips.count; ++r) {
    const double* const a = packed + r * strip_size;
    const std::ptrdiff_t row = strips.start(r);
    switch (missing) { // the others are right of the diagonal at most, where nobody looks
    case 0:
      take_tile<4>(columns, row, count, a, b);
      break;
    case 1:
      take_tile<3>(columns + 1, row, count, a, b + 1);
      break;
    case 2:
      take_tile<2>(columns + 2, row, count, a, b + 2);
      break;
    case 3:
      take_tile<1>(columns + 3, row, count, a, b + 3);
      break;
    default:
      break;
    }
    switch (missing) {
    case 5:
      take_tile<3>(columns + 5, row, count, a, b + 5);
      break;
    case 6:
      take_tile<2>(columns + 6, row, count, a, b + 6);
      break;
    case 7:
      take_tile<1>(columns + 7, row, count, a, b + 7);
      break;
    default:
      take_tile<4>(columns + 4, row, count, a, b + 4);
      break;
    }
  }
}

} // namespace
} // namespace gewebe
