#pragma once
// The body of bent_kernel_*.cpp, each of which compiles it for its instruction set.

#include "base/four_lanes.h"
#include "statics/bent_kernel_internal.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe {
namespace {

constexpr std::size_t panel = 8;          ///< columns that are eliminated one by one
constexpr std::size_t one_panel = 16;     ///< so many rows are one
constexpr std::size_t small_panel = 4;    ///< unknowns that are solved one by one
constexpr std::size_t least_blocks = 20;  ///< rows, depth and columns of a product by blocks
constexpr std::size_t least_in_turns = 8; ///< depth from where on such a product has two sums

/// to -= Σ A_k x_k of `Depth` columns.
template <std::size_t Depth>
void subtract(const double* a, std::size_t stride, const double* x, double* to, std::size_t rows) {
  std::size_t r = 0;
  for (; r + 4 <= rows; r += 4) {
    Four sum = four(a + r) * x[0];
    for (std::size_t k = 1; k < Depth; ++k)
      sum += four(a + k * stride + r) * x[k];
    four(to + r) -= sum;
  }
  for (; r < rows; ++r) {
    double sum = a[r] * x[0];
    for (std::size_t k = 1; k < Depth; ++k)
      sum += a[k * stride + r] * x[k];
    to[r] -= sum;
  }
}

/// Whether a product sums a row's even and odd numbers each for themselves: behind the last four
/// rows, of two that are left, in columns by four.
bool in_turns(std::size_t rows, std::size_t depth, std::size_t columns) {
  return (rows & 2) != 0 && depth >= least_in_turns && rows + depth + columns >= least_blocks;
}

/// Σ a_k x_k of a row, even and odd ones of whole eights each for themselves.
double sum_in_turns(const double* a, std::size_t stride, const double* x, std::size_t depth) {
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
void factor_panel(double* a, std::size_t stride, std::size_t rows, std::size_t columns,
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
      for (; r < rows; ++r)
        to[r] -= own[r] * by;
    }
  }
}

/// L⁻¹ of columns, in place. \param l of unit diagonal
void solve_lower(const double* l, std::size_t stride, std::size_t n, double* columns,
                 std::size_t column_stride, std::size_t count) {
  for (std::size_t k = 0; k < n; k += small_panel) {
    const std::size_t width = std::min(small_panel, n - k), next = k + width;
    for (std::size_t c = 0; c < count; ++c) {
      double* const x = columns + c * column_stride;
      for (std::size_t p = k; p < next; ++p)
        for (std::size_t r = p + 1; r < next; ++r)
          x[r] -= x[p] * l[p * stride + r];
      if (next < n)
        subtract<small_panel>(l + k * stride + next, stride, x + k, x + next, n - next);
    }
  }
}

/// U⁻¹ of columns, in place.
void solve_upper(const double* u, std::size_t n, double* columns, std::size_t count) {
  for (std::size_t end = n; end > 0;) {
    const std::size_t width = std::min(small_panel, end), begin = end - width;
    double by[small_panel];
    for (std::size_t p = begin; p < end; ++p)
      by[p - begin] = 1 / u[p * n + p];
    for (std::size_t c = 0; c < count; ++c) {
      double* const x = columns + c * n;
      for (std::size_t p = end; p-- > begin;) {
        x[p] *= by[p - begin];
        for (std::size_t r = begin; r < p; ++r)
          x[r] -= x[p] * u[p * n + r];
      }
      if (begin > 0)
        subtract<small_panel>(u + begin * n, n, x + begin, x, begin);
    }
    end = begin;
  }
}

/// What a panel's columns leave of those behind it: to -= A B.
void subtract_panel(const double* a, const double* b, double* to, std::size_t stride,
                    std::size_t rows) {
  const std::size_t pair = rows & ~std::size_t{3}; // rows and columns are as many
  const std::size_t apart = in_turns(rows, panel, rows) ? pair : 0;
  for (std::size_t c = 0; c < rows; ++c, b += stride, to += stride) {
    const bool two = c < apart;
    const double first = two ? to[pair] - sum_in_turns(a + pair, stride, b, panel) : 0,
                 second = two ? to[pair + 1] - sum_in_turns(a + pair + 1, stride, b, panel) : 0;
    subtract<panel>(a, stride, b, to, rows);
    if (two) {
      to[pair] = first;
      to[pair + 1] = second;
    }
  }
}

void factor(double* a, std::size_t n, std::uint32_t* swapped) {
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

void solve(const double* lu, const std::uint32_t* swapped, std::size_t n, double* columns,
           std::size_t count) {
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t k = 0; k < n; ++k)
      std::swap(columns[c * n + k], columns[c * n + swapped[k]]);
  solve_lower(lu, n, n, columns, n, count);
  solve_upper(lu, n, columns, count);
}

/// `Count` columns of a product.
template <std::size_t Count>
void multiply_columns(const double* a, std::size_t rows, std::size_t depth, const double* b,
                      double* to) {
  std::size_t r = 0;
  for (; r + 4 <= rows; r += 4) {
    Four sum[Count] = {};
    for (std::size_t k = 0; k < depth; ++k)
      for (std::size_t c = 0; c < Count; ++c)
        sum[c] += four(a + k * rows + r) * b[c * depth + k];
    for (std::size_t c = 0; c < Count; ++c)
      four(to + c * rows + r) = sum[c];
  }
  for (; r < rows; ++r)
    for (std::size_t c = 0; c < Count; ++c) {
      double sum = 0;
      for (std::size_t k = 0; k < depth; ++k)
        sum += a[k * rows + r] * b[c * depth + k];
      to[c * rows + r] = sum;
    }
}

void multiply(const double* a, std::size_t rows, std::size_t depth, const double* b,
              std::size_t columns, double* to) {
  const std::size_t by_four = columns & ~std::size_t{3}, pair = rows & ~std::size_t{3};
  for (std::size_t c = 0; c < by_four; c += 4)
    multiply_columns<4>(a, rows, depth, b + c * depth, to + c * rows);
  for (std::size_t c = by_four; c < columns; ++c)
    multiply_columns<1>(a, rows, depth, b + c * depth, to + c * rows);
  for (std::size_t c = 0; c < by_four && in_turns(rows, depth, columns); ++c)
    for (std::size_t r = pair; r < pair + 2; ++r)
      to[c * rows + r] = sum_in_turns(a + r, rows, b + c * depth, depth);
}

} // namespace
} // namespace gewebe
