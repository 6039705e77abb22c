#pragma once
// The body of bent_kernel_*.cpp, each of which compiles it for its instruction set.

#include "base/four_lanes.h"
#include "statics/bent_kernel_internal.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe {
namespace {

inline constexpr std::size_t panel = 8;         ///< columns that are eliminated one by one
inline constexpr std::size_t one_panel = 16;    ///< so many rows are one
inline constexpr std::size_t small_panel = 4;   ///< unknowns that are solved one by one
inline constexpr std::size_t least_blocks = 20; ///< rows, depth and columns of a product by blocks
inline constexpr std::size_t least_in_turns =
    8; ///< depth from where on such a product has two sums

using Lanes = long long __attribute__((vector_size(32), aligned(8), may_alias));

/// Four lanes from here, of which the last `count` are on, or off.
inline const Lanes& lanes(std::size_t count, bool on) {
  static constexpr long long all[12]{0, 0, 0, 0, -1, -1, -1, -1, 0, 0, 0, 0};
  return *reinterpret_cast<const Lanes*>(all + (on ? count : 4 + count));
}

inline void keep(Four& v, const Lanes& those) {
  v = reinterpret_cast<Four>(reinterpret_cast<Lanes>(v) & those);
}

/// Σ A_k x_k of `Depth` columns, of four rows.
template <std::size_t Depth>
void sum_of(const double* a, std::size_t stride, const double* x, Four& sum) {
  sum = four(a) * x[0];
  for (std::size_t k = 1; k < Depth; ++k)
    sum += four(a + k * stride) * x[k];
}

/// to -= A x. Rows that are no four are done with those before them. \pre there are four rows up to
/// the last
inline void subtract_below(const double* a, std::size_t stride, const double* x, double* to,
                           std::size_t rows) {
  Four sum;
  std::size_t r = 0;
  for (; r + 4 <= rows; r += 4) {
    sum_of<small_panel>(a + r, stride, x, sum);
    four(to + r) -= sum;
  }
  if (r == rows)
    return;
  sum_of<small_panel>(a + rows - 4, stride, x, sum);
  keep(sum, lanes(rows - r, true));
  four(to + rows - 4) -= sum;
}

/// The same, with those behind them. \pre there are four rows from the first on
inline void subtract_above(const double* a, std::size_t stride, const double* x, double* to,
                           std::size_t rows) {
  Four sum;
  const std::size_t first = rows & 3;
  for (std::size_t r = first; r < rows; r += 4) {
    sum_of<small_panel>(a + r, stride, x, sum);
    four(to + r) -= sum;
  }
  if (first == 0)
    return;
  sum_of<small_panel>(a, stride, x, sum);
  keep(sum, lanes(4 - first, false));
  four(to) -= sum;
}

/// Whether a product sums a row's even and odd numbers each for themselves: behind the last four
/// rows, of two that are left, in columns by four.
inline bool in_turns(std::size_t rows, std::size_t depth, std::size_t columns) {
  return (rows & 2) != 0 && depth >= least_in_turns && rows + depth + columns >= least_blocks;
}

/// Σ a_k x_k of a row, even and odd ones of whole eights each for themselves.
inline double sum_in_turns(const double* a, std::size_t stride, const double* x,
                           std::size_t depth) {
  const std::size_t even = depth & ~std::size_t{7};
  double first = 0, second = 0;
  for (std::size_t k = 0; k < even; k += 2) {
    first += a[k * stride] * x[k];
    second += a[(k + 1) * stride] * x[k + 1];
  }
  first += second;
  for (std::size_t k = even; k < depth; ++k)
    first += a[k * stride] * x[k];
  return first;
}

/// L U of `columns` columns of a matrix.
inline void factor_panel(double* a, std::size_t stride, std::size_t rows, std::size_t columns,
                         std::uint32_t* swapped) {
  for (std::size_t k = 0; k < std::min(rows, columns); ++k) {
    double* const own = a + k * stride;
    std::size_t pivot = k;
    double largest = std::abs(own[k]);
    for (std::size_t r = k + 1; r < rows; ++r)
      if (const double size = std::abs(own[r]); size > largest) {
        largest = size;
        pivot = r;
      }
    swapped[k] = static_cast<std::uint32_t>(pivot);
    if (largest != 0) {
      for (std::size_t c = 0; c < columns && pivot != k; ++c)
        std::swap(a[c * stride + k], a[c * stride + pivot]);
      const double by = own[k];
      for (std::size_t r = k + 1; r < rows; ++r)
        own[r] /= by;
    }
    for (std::size_t c = k + 1; c < columns; ++c) {
      double* const to = a + c * stride;
      const double by = to[k];
      std::size_t r = k + 1;
      for (; r + 4 <= rows; r += 4)
        four(to + r) -= four(own + r) * by;
      if (rows < 4) {
        for (; r < rows; ++r)
          to[r] -= own[r] * by;
      } else if (r < rows) {
        Four last = four(own + rows - 4) * by;
        keep(last, lanes(rows - r, true));
        four(to + rows - 4) -= last;
      }
    }
  }
}

/// The triangle of a small panel at `a`: below its diagonal, or above it.
template <bool Lower>
struct Triangle {
  double of[small_panel][small_panel]; ///< by columns

  Triangle(const double* a, std::size_t stride) {
    for (std::size_t c = 0; c < small_panel; ++c)
      for (std::size_t r = Lower ? c + 1 : 0; r < (Lower ? small_panel : c); ++r)
        of[c][r] = a[c * stride + r];
  }
};

/// L⁻¹ of columns, in place. \param l of unit diagonal
inline void solve_lower(const double* l, std::size_t stride, std::size_t n, double* columns,
                        std::size_t column_stride, std::size_t count) {
  std::size_t k = 0;
  for (; k + small_panel <= n; k += small_panel) {
    const std::size_t next = k + small_panel;
    const Triangle<true> own(l + k * stride + k, stride);
    for (std::size_t c = 0; c < count; ++c) {
      double* const x = columns + c * column_stride + k;
      x[1] -= x[0] * own.of[0][1];
      x[2] -= x[0] * own.of[0][2];
      x[3] -= x[0] * own.of[0][3];
      x[2] -= x[1] * own.of[1][2];
      x[3] -= x[1] * own.of[1][3];
      x[3] -= x[2] * own.of[2][3];
      subtract_below(l + k * stride + next, stride, x, x + small_panel, n - next);
    }
  }
  for (std::size_t c = 0; c < count && k < n; ++c) {
    double* const x = columns + c * column_stride;
    for (std::size_t p = k; p < n; ++p)
      for (std::size_t r = p + 1; r < n; ++r)
        x[r] -= x[p] * l[p * stride + r];
  }
}

/// U⁻¹ of columns, in place.
inline void solve_upper(const double* u, std::size_t n, double* columns, std::size_t count) {
  std::size_t end = n;
  for (; end >= small_panel; end -= small_panel) {
    const std::size_t begin = end - small_panel;
    const double* const diagonal = u + begin * n + begin;
    const Triangle<false> own(diagonal, n);
    double by[small_panel];
    for (std::size_t p = 0; p < small_panel; ++p)
      by[p] = 1 / diagonal[p * n + p];
    for (std::size_t c = 0; c < count; ++c) {
      double* const x = columns + c * n + begin;
      x[3] *= by[3];
      x[0] -= x[3] * own.of[3][0];
      x[1] -= x[3] * own.of[3][1];
      x[2] -= x[3] * own.of[3][2];
      x[2] *= by[2];
      x[0] -= x[2] * own.of[2][0];
      x[1] -= x[2] * own.of[2][1];
      x[1] *= by[1];
      x[0] -= x[1] * own.of[1][0];
      x[0] *= by[0];
      subtract_above(u + begin * n, n, x, x - begin, begin);
    }
  }
  for (std::size_t c = 0; c < count; ++c) {
    double* const x = columns + c * n;
    for (std::size_t p = end; p-- > 0;) {
      x[p] *= 1 / u[p * n + p];
      for (std::size_t r = 0; r < p; ++r)
        x[r] -= x[p] * u[p * n + r];
    }
  }
}

/// What a panel's columns leave of those behind it: to -= A B. \param rows as many as columns
inline void subtract_panel(const double* a, const double* b, double* to, std::size_t stride,
                           std::size_t rows) {
  const std::size_t fours = rows & ~std::size_t{3}, left = rows - fours;
  const std::size_t two = in_turns(rows, panel, rows) ? fours : 0; // columns in which a row has
  for (std::size_t c = 0; c < rows; ++c, b += stride, to += stride) {
    Four sum;
    for (std::size_t r = 0; r < fours; r += 4) {
      sum_of<panel>(a + r, stride, b, sum);
      four(to + r) -= sum;
    }
    if (left == 0)
      continue;
    const double* const last = a + rows - 4;
    sum_of<panel>(last, stride, b, sum);
    if (c < two) {
      Four even = four(last) * b[0], odd = four(last + stride) * b[1];
      for (std::size_t k = 2; k < panel; k += 2) {
        even += four(last + k * stride) * b[k];
        odd += four(last + (k + 1) * stride) * b[k + 1];
      }
      even += odd;
      if (left == 3) {
        keep(even, lanes(1, false));
        keep(sum, lanes(1, true));
        sum += even;
      } else {
        sum = even;
      }
    }
    keep(sum, lanes(left, true));
    four(to + rows - 4) -= sum;
  }
}

inline void factor(double* a, std::size_t n, std::uint32_t* swapped) {
  if (n <= one_panel)
    return factor_panel(a, n, n, n, swapped);
  for (std::size_t k = 0; k < n; k += panel) {
    const std::size_t width = std::min(panel, n - k), next = k + width;
    double* const own = a + k * n;
    factor_panel(own + k, n, n - k, width, swapped + k);
    for (std::size_t p = k; p < next; ++p) {
      swapped[p] += static_cast<std::uint32_t>(k);
      if (const std::size_t with = swapped[p]; with != p) {
        for (std::size_t c = 0; c < k; ++c)
          std::swap(a[c * n + p], a[c * n + with]);
        for (std::size_t c = next; c < n; ++c)
          std::swap(a[c * n + p], a[c * n + with]);
      }
    }
    if (next == n)
      return;
    double* const behind = a + next * n;
    solve_lower(own + k, n, width, behind + k, n, n - next);
    subtract_panel(own + next, behind + k, behind + next, n, n - next);
  }
}

inline void solve(const double* lu, const std::uint32_t* swapped, std::size_t n, double* columns,
                  std::size_t count) {
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t k = 0; k < n; ++k)
      std::swap(columns[c * n + k], columns[c * n + swapped[k]]);
  solve_lower(lu, n, n, columns, n, count);
  solve_upper(lu, n, columns, count);
}

/// Rows from r on, `Fours` times four, of `Count` columns of a product.
template <std::size_t Count, std::size_t Fours>
void multiply_rows(const double* const* a, std::size_t r, std::size_t rows, std::size_t depth,
                   const double* b, std::size_t stride, double* to) {
  Four sum[Count][Fours] = {};
  for (std::size_t k = 0; k < depth; ++k)
    for (std::size_t f = 0; f < Fours; ++f) {
      const Four& own = four(a[k] + r + 4 * f);
      for (std::size_t c = 0; c < Count; ++c)
        sum[c][f] += own * b[c * stride + k];
    }
  for (std::size_t c = 0; c < Count; ++c)
    for (std::size_t f = 0; f < Fours; ++f)
      four(to + c * rows + r + 4 * f) = sum[c][f];
}

/// `Count` columns of a product with those columns of the first that are given.
template <std::size_t Count>
void multiply_columns(const double* const* a, std::size_t rows, std::size_t depth, const double* b,
                      std::size_t stride, double* to) {
  constexpr std::size_t fours = Count == 1 ? 4 : 2;
  std::size_t r = 0;
  for (; r + 4 * fours <= rows; r += 4 * fours)
    multiply_rows<Count, fours>(a, r, rows, depth, b, stride, to);
  for (; r + 4 <= rows; r += 4)
    multiply_rows<Count, 1>(a, r, rows, depth, b, stride, to);
  if (r < rows && rows >= 4) // some of them once more
    return multiply_rows<Count, 1>(a, rows - 4, rows, depth, b, stride, to);
  for (; r < rows; ++r) {
    double sum[Count] = {};
    for (std::size_t k = 0; k < depth; ++k)
      for (std::size_t c = 0; c < Count; ++c)
        sum[c] += a[k][r] * b[c * stride + k];
    for (std::size_t c = 0; c < Count; ++c)
      to[c * rows + r] = sum[c];
  }
}

inline void multiply(const double* a, std::size_t rows, std::size_t depth, const double* b,
                     std::size_t columns, double* to) {
  const double* from[bent_kernel_rows];
  for (std::size_t k = 0; k < depth; ++k)
    from[k] = a + k * rows;
  const std::size_t by_four = columns & ~std::size_t{3}, pair = rows & ~std::size_t{3};
  for (std::size_t c = 0; c < by_four; c += 4)
    multiply_columns<4>(from, rows, depth, b + c * depth, depth, to + c * rows);
  for (std::size_t c = by_four; c < columns; ++c)
    multiply_columns<1>(from, rows, depth, b + c * depth, depth, to + c * rows);
  for (std::size_t c = 0; c < by_four && in_turns(rows, depth, columns); ++c)
    for (std::size_t r = pair; r < pair + 2; ++r)
      to[c * rows + r] = sum_in_turns(a + r, rows, b + c * depth, depth);
}

/// Of `Count` columns of H, whose other rows are all 0.
template <std::size_t Count>
void spread_columns(const double* w, std::size_t rows, const std::ptrdiff_t* turning, std::size_t n,
                    const double* h, double* to) {
  const double* from[bent_kernel_rows];
  double by[Count * bent_kernel_rows];
  std::size_t depth = 0;
  for (std::size_t r = 0; r < n; ++r) {
    bool any = false;
    for (std::size_t c = 0; c < Count; ++c) {
      by[c * bent_kernel_rows + depth] = h[c * n + r];
      any = any || h[c * n + r] != 0;
    }
    from[depth] = w + static_cast<std::size_t>(turning[r]) * rows;
    depth += any ? 1 : 0;
  }
  multiply_columns<Count>(from, rows, depth, by, bent_kernel_rows, to);
}

inline void spread(const double* w, std::size_t rows, const std::ptrdiff_t* turning, std::size_t n,
                   const double* h, double* to) {
  std::size_t c = 0;
  for (; c + 3 <= n; c += 3)
    spread_columns<3>(w, rows, turning, n, h + c * n, to + c * rows);
  for (; c < n; ++c)
    spread_columns<1>(w, rows, turning, n, h + c * n, to + c * rows);
}

inline void times(const double* w, std::size_t rows, std::size_t columns, const double* v,
                  double* to) {
  const double* from[bent_kernel_rows];
  double by[bent_kernel_rows];
  std::size_t depth = 0;
  for (std::size_t c = 0; c < columns; ++c) {
    from[depth] = w + c * rows;
    by[depth] = v[c];
    depth += v[c] != 0 ? 1 : 0;
  }
  multiply_columns<1>(from, rows, depth, by, 0, to);
}

/// `Count` corners of read.
template <std::size_t Count>
void read_corners(const double* const* x, const double* weight, std::size_t columns,
                  const double* along, double* to) {
  std::size_t c = 0;
  for (; c + 4 <= columns; c += 4) {
    Four all = {};
    for (std::size_t a = 0; a < 3; ++a) {
      Four sum = four(x[0] + a * columns + c) * weight[0];
      for (std::size_t k = 1; k < Count; ++k)
        sum += four(x[k] + a * columns + c) * weight[k];
      all += sum * along[a];
    }
    four(to + c) = all;
  }
  for (; c < columns; ++c) {
    double all = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      double sum = x[0][a * columns + c] * weight[0];
      for (std::size_t k = 1; k < Count; ++k)
        sum += x[k][a * columns + c] * weight[k];
      all += sum * along[a];
    }
    to[c] = all;
  }
}

inline void read(const double* const* x, const double* weight, std::size_t count,
                 std::size_t columns, const double* along, double* to) {
  if (count == 3)
    return read_corners<3>(x, weight, columns, along, to);
  if (count == 2)
    return read_corners<2>(x, weight, columns, along, to);
  if (count == 1)
    return read_corners<1>(x, weight, columns, along, to);
  std::fill(to, to + columns, 0.0);
}

/// `Count` corners of push.
template <std::size_t Count>
void push_corners(const double* const* w, const double* weight, std::size_t rows,
                  const double* along, double* to) {
  std::size_t r = 0;
  for (; r + 4 <= rows; r += 4) {
    Four sum = {};
    for (std::size_t c = 0; c < Count; ++c) {
      const double* const at = w[c] + r;
      sum += (four(at) * along[0] + four(at + rows) * along[1] + four(at + 2 * rows) * along[2]) *
             weight[c];
    }
    four(to + r) = sum;
  }
  for (; r < rows; ++r) {
    double sum = 0;
    for (std::size_t c = 0; c < Count; ++c) {
      const double* const at = w[c] + r;
      sum += (at[0] * along[0] + at[rows] * along[1] + at[2 * rows] * along[2]) * weight[c];
    }
    to[r] = sum;
  }
}

inline void push(const double* const* w, const double* weight, std::size_t count, std::size_t rows,
                 const double* along, double* to) {
  if (count == 3)
    return push_corners<3>(w, weight, rows, along, to);
  if (count == 2)
    return push_corners<2>(w, weight, rows, along, to);
  if (count == 1)
    return push_corners<1>(w, weight, rows, along, to);
  std::fill(to, to + rows, 0.0);
}

} // namespace
} // namespace gewebe
