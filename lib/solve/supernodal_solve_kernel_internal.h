#pragma once
// The body of supernodal_solve_*.cpp, each of which compiles it for its instruction set. A result
// is the same bits whatever the width: each unknown sees its subtractions in one fixed order, and
// there is no fused multiplication.

#include "solve/supernodal_solve_internal.h"

#include <type_traits>
#include <utility>

namespace gewebe {
namespace {

#if defined(__AVX2__)
inline constexpr std::size_t lanes = 4;
#else
inline constexpr std::size_t lanes = 2;
#endif
/// What a register holds.
using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));
/// The same at any address of a double.
using Unaligned =
    double __attribute__((vector_size(lanes * sizeof(double)), aligned(sizeof(double)), may_alias));

/// The right-hand sides of one row: one number, or a panel of them.
struct Single {
  static constexpr std::size_t width = 1, registers = 1, rows = 8;
  using Value = double;
  using Stored = double;
};
struct Narrow {
  static constexpr std::size_t width = 4, registers = 4 / lanes, rows = 8 / registers;
  using Value = Lanes;
  using Stored = Unaligned;
};
struct Wide {
  static constexpr std::size_t width = panel_width, registers = panel_width / lanes, rows = lanes;
  using Value = Lanes;
  using Stored = Unaligned;
};

template <class Of>
struct Row {
  typename Of::Value part[Of::registers];

  void load(const double* from) {
    for (std::size_t i = 0; i < Of::registers; ++i)
      part[i] = reinterpret_cast<const typename Of::Stored*>(from)[i];
  }
  void store(double* to) const {
    for (std::size_t i = 0; i < Of::registers; ++i)
      reinterpret_cast<typename Of::Stored*>(to)[i] = part[i];
  }
  void subtract(double l, const Row& x) {
    for (std::size_t i = 0; i < Of::registers; ++i)
      part[i] -= l * x.part[i];
  }
  void divide(double l) {
    for (std::size_t i = 0; i < Of::registers; ++i)
      part[i] /= l;
  }
};

/// A supernode: `columns` of its own, `below` rows under them, `rows` = both.
struct Supernode {
  std::size_t columns, below, rows;
  std::size_t first;       ///< own column
  const std::int64_t* row; ///< of those below
  const double* l;

  double at(std::size_t r, std::size_t c) const { return l[c * rows + r]; }
};

inline Supernode supernode(const SupernodalArrays& a, std::size_t k) {
  const auto first = static_cast<std::size_t>(a.super[k]);
  const auto columns = static_cast<std::size_t>(a.super[k + 1]) - first;
  const auto rows = static_cast<std::size_t>(a.pi[k + 1] - a.pi[k]);
  const double* const l = a.blocks != nullptr ? a.blocks[k] : a.x + a.px[k];
  return {columns, rows - columns, rows, first, a.s + a.pi[k] + columns, l};
}

/// N rows from `r` on lose what columns [0, count) contribute; `x` are the supernode's own,
/// `stride` numbers from one row to the next.
template <class Of, std::size_t N>
void lose_columns(const Supernode& n, std::size_t r, std::size_t count, const double* x,
                  std::size_t stride, Row<Of> (&sum)[N]) {
  for (std::size_t c = 0; c < count; ++c) {
    Row<Of> xc;
    xc.load(x + c * stride);
    const double* const l = n.l + c * n.rows + r;
    for (std::size_t i = 0; i < N; ++i)
      sum[i].subtract(l[i], xc);
  }
}

/// N own columns from `c` on, once all before them are solved.
template <class Of, std::size_t N>
void forward_own(const Supernode& n, std::size_t c, double* x, std::size_t stride) {
  Row<Of> sum[N];
  for (std::size_t i = 0; i < N; ++i)
    sum[i].load(x + (c + i) * stride);
  lose_columns<Of, N>(n, c, c, x, stride, sum);
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      sum[i].subtract(n.at(c + i, c + j), sum[j]);
    sum[i].divide(n.at(c + i, c + i));
    sum[i].store(x + (c + i) * stride);
  }
}

template <class Of, std::size_t N>
void forward_below(const Supernode& n, std::size_t r, const double* own, double* x,
                   std::size_t stride) {
  Row<Of> sum[N];
  for (std::size_t i = 0; i < N; ++i)
    sum[i].load(x + static_cast<std::size_t>(n.row[r + i]) * stride);
  lose_columns<Of, N>(n, n.columns + r, n.columns, own, stride, sum);
  for (std::size_t i = 0; i < N; ++i)
    sum[i].store(x + static_cast<std::size_t>(n.row[r + i]) * stride);
}

/// Asks for all of L's block at once: its columns are short streams, which no hardware foresees,
/// and one miss after the other would cost several times what memory needs to deliver them.
inline void fetch(const Supernode& n) {
  constexpr std::size_t line = 64 / sizeof(double);
  const std::size_t count = n.columns * n.rows;
  for (std::size_t k = 0; k < count; k += line)
    __builtin_prefetch(n.l + k);
}

template <class Of>
bool all_zero(const double* x, std::size_t count, std::size_t stride) {
  for (std::size_t r = 0; r < count; ++r)
    for (std::size_t i = 0; i < Of::width; ++i)
      if (x[r * stride + i] != 0)
        return false;
  return true;
}

/// work(first, N) for all of [0, count) in runs of Of::rows, then what is left as one shorter run:
/// one by one, each would wait for its own last subtraction.
template <class Of, class Work>
void in_runs(std::size_t count, const Work& work) {
  std::size_t k = 0;
  for (; k + Of::rows <= count; k += Of::rows)
    work(k, std::integral_constant<std::size_t, Of::rows>{});
  [&]<std::size_t... N>(std::index_sequence<N...>) {
    (void)((count - k == N + 1 && (work(k, std::integral_constant<std::size_t, N + 1>{}), true)) ||
           ...);
  }(std::make_index_sequence<Of::rows - 1>{});
}

template <class Of>
void forward(const Supernode& n, double* x, std::size_t stride) {
  double* const own = x + n.first * stride;
  if (all_zero<Of>(own, n.columns, stride)) // and so stays everything that only hears from it
    return;
  fetch(n);
  in_runs<Of>(n.columns, [&](std::size_t c, auto run) {
    forward_own<Of, decltype(run)::value>(n, c, own, stride);
  });
  in_runs<Of>(n.below, [&](std::size_t r, auto run) {
    forward_below<Of, decltype(run)::value>(n, r, own, x, stride);
  });
}

/// N own columns from `c` on, once all behind them are solved; `below` are the rows below.
template <class Of, std::size_t N>
void backward_own(const Supernode& n, std::size_t c, const double* below, double* x,
                  std::size_t stride) {
  Row<Of> sum[N];
  for (std::size_t i = 0; i < N; ++i)
    sum[i].load(x + (c + i) * stride);
  const double* const l = n.l + c * n.rows;
  for (std::size_t r = 0; r < n.below; ++r) {
    Row<Of> xr;
    xr.load(below + r * Of::width);
    for (std::size_t i = 0; i < N; ++i)
      sum[i].subtract(l[i * n.rows + n.columns + r], xr);
  }
  for (std::size_t r = n.columns; r-- > c + N;) {
    Row<Of> xr;
    xr.load(x + r * stride);
    for (std::size_t i = 0; i < N; ++i)
      sum[i].subtract(l[i * n.rows + r], xr);
  }
  for (std::size_t i = N; i-- > 0;) {
    for (std::size_t j = N; j-- > i + 1;)
      sum[i].subtract(n.at(c + j, c + i), sum[j]);
    sum[i].divide(n.at(c + i, c + i));
    sum[i].store(x + (c + i) * stride);
  }
}

template <class Of>
void backward(const Supernode& n, double* x, std::size_t stride, double* work) {
  fetch(n);
  for (std::size_t r = 0; r < n.below; ++r) {
    Row<Of> xr;
    xr.load(x + static_cast<std::size_t>(n.row[r]) * stride);
    xr.store(work + r * Of::width);
  }
  double* const own = x + n.first * stride;
  in_runs<Of>(n.columns, [&](std::size_t done, auto run) { // from the last column on
    constexpr std::size_t count = decltype(run)::value;
    backward_own<Of, count>(n, n.columns - done - count, work, own, stride);
  });
}

template <class Of>
void forward_some(const SupernodalArrays& l, std::span<const std::uint32_t> supernodes, double* x,
                  std::size_t stride) {
  for (const std::uint32_t k : supernodes)
    for (std::size_t v = 0; v < stride; v += Of::width)
      forward<Of>(supernode(l, k), x + v, stride);
}

/// `stride` vectors side by side, Of::width of them at a time: a supernode is read once for all.
template <class Of>
void solve(const SupernodalArrays& l, double* x, std::size_t stride, double* work) {
  for (std::size_t k = 0; k < l.supernodes; ++k) {
    const Supernode n = supernode(l, k);
    for (std::size_t v = 0; v < stride; v += Of::width)
      forward<Of>(n, x + v, stride);
  }
  for (std::size_t k = l.supernodes; k-- > 0;) {
    const Supernode n = supernode(l, k);
    for (std::size_t v = 0; v < stride; v += Of::width)
      backward<Of>(n, x + v, stride, work);
  }
}

} // namespace
} // namespace gewebe
