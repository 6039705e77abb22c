#pragma once
// The body of supernodal_solve_*.cpp; each of these files compiles it for one instruction set. A
// result is the same bits whatever the width: each unknown sees its subtractions in one fixed
// order, and there is no fused multiplication.

#include "linalg/supernodal_solve_internal.h"

#include <cstdint>
#include <type_traits>
#include <utility>

namespace gewebe::linalg {
namespace {

#if defined(__AVX512F__)
inline constexpr std::size_t lanes = 8, narrow_lanes = 4;
#elif defined(__AVX2__)
inline constexpr std::size_t lanes = 4, narrow_lanes = 4;
#else
inline constexpr std::size_t lanes = 2, narrow_lanes = 2;
#endif
// What a register holds, and the same at any address of a double. Written out for both widths: in a
// template GCC loses the last two attributes.
using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));
using Unaligned =
    double __attribute__((vector_size(lanes * sizeof(double)), aligned(sizeof(double)), may_alias));
using NarrowLanes = double __attribute__((vector_size(narrow_lanes * sizeof(double))));
using NarrowUnaligned = double
    __attribute__((vector_size(narrow_lanes * sizeof(double)), aligned(sizeof(double)), may_alias));

/// The right-hand sides of one row: one number, or a panel of them; how many rows lose products at
/// once, and of how many columns: so many short streams the caches can hold.
struct Single {
  static constexpr std::size_t width = 1, registers = 1, rows = 8, columns = rows;
  using Value = double;
  using Stored = double;
};
struct Narrow {
  static constexpr std::size_t width = 4, registers = width / narrow_lanes, rows = 8 / registers,
                               columns = 64;
  using Value = NarrowLanes;
  using Stored = NarrowUnaligned;
};
struct Wide {
  static constexpr std::size_t width = panel_width, registers = panel_width / lanes, rows = lanes,
                               columns = 64;
  using Value = Lanes;
  using Stored = Unaligned;
};

/// Three registers of right-hand sides: a number of L that is there serves all of them.
struct Broad {
  static constexpr std::size_t width = 3 * lanes, registers = 3, rows = lanes == 8 ? 8 : 4,
                               columns = 64;
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
  bool far;                ///< too large for the second cache, see fetch
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
  constexpr std::size_t near = std::size_t{192} << 10; // bytes
  const bool far = columns * rows * sizeof(double) > near;
  return {columns, rows - columns, rows, far, first, a.s + a.pi[k] + columns, l};
}

inline constexpr std::size_t ahead = 64; ///< how far ahead in a column L is prefetched, if far

/// N rows from `r` on lose what columns [begin, end) contribute; `x` are the supernode's own,
/// `stride` numbers from one row to the next.
template <class Of, bool Far, std::size_t N>
void lose_columns(const Supernode& n, std::size_t r, std::size_t begin, std::size_t end,
                  const double* x, std::size_t stride, Row<Of> (&sum)[N]) {
  for (std::size_t c = begin; c < end; ++c) {
    Row<Of> xc;
    xc.load(x + c * stride);
    const double* const l = n.l + c * n.rows + r;
    if constexpr (Far)
      __builtin_prefetch(l + ahead);
    for (std::size_t i = 0; i < N; ++i)
      sum[i].subtract(l[i], xc);
  }
}

/// Solves N own columns from `c` on. \pre all columns before them are solved, and those before
/// `begin` are subtracted already
template <class Of, std::size_t N>
void forward_own(const Supernode& n, std::size_t begin, std::size_t c, double* x,
                 std::size_t stride) {
  Row<Of> sum[N];
  for (std::size_t i = 0; i < N; ++i)
    sum[i].load(x + (c + i) * stride);
  lose_columns<Of, false>(n, c, begin, c, x, stride, sum);
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      sum[i].subtract(n.at(c + i, c + j), sum[j]);
    sum[i].divide(n.at(c + i, c + i));
    sum[i].store(x + (c + i) * stride);
  }
}

/// N rows of the supernode behind columns [begin, end), which they lose; `to(row)` is where a row's
/// right-hand sides are.
template <class Of, std::size_t N, bool Far, class To>
void forward_rows(const Supernode& n, std::size_t r, std::size_t begin, std::size_t end,
                  const double* own, std::size_t stride, const To& to) {
  Row<Of> sum[N];
  for (std::size_t i = 0; i < N; ++i)
    sum[i].load(to(r + i));
  lose_columns<Of, Far>(n, r, begin, end, own, stride, sum);
  for (std::size_t i = 0; i < N; ++i)
    sum[i].store(to(r + i));
}

/// Prefetches all of L's block at once where it is small. Its columns are short streams, which no
/// hardware predicts, and one miss after the other would cost several times what memory needs to
/// deliver them. A large block would leave the cache before it is used: there each column is
/// prefetched a little ahead.
inline void fetch(const Supernode& n) {
  constexpr std::size_t line = 64 / sizeof(double);
  if (n.far)
    return;
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

/// Rows y lose what N columns of L contribute, `step` numbers from one to the next, in order.
template <std::size_t N>
void lose_streams(const double* l, std::size_t step, const double* x, double* y, std::size_t rows) {
  constexpr std::size_t at_once = 8, parts = at_once / lanes;
  std::size_t r = 0;
  for (; r + at_once <= rows; r += at_once) {
    Lanes sum[parts];
    for (std::size_t i = 0; i < parts; ++i)
      sum[i] = reinterpret_cast<const Unaligned*>(y + r)[i];
    for (std::size_t j = 0; j < N; ++j) {
      const double* const column = l + j * step + r;
      __builtin_prefetch(column + ahead);
      for (std::size_t i = 0; i < parts; ++i)
        sum[i] -= reinterpret_cast<const Unaligned*>(column)[i] * x[j];
    }
    for (std::size_t i = 0; i < parts; ++i)
      reinterpret_cast<Unaligned*>(y + r)[i] = sum[i];
  }
  for (; r < rows; ++r) {
    double sum = y[r];
    for (std::size_t j = 0; j < N; ++j)
      sum -= l[j * step + r] * x[j];
    y[r] = sum;
  }
}

/// One right-hand side: the rows below stand side by side in `work` meanwhile.
inline void forward_single(const Supernode& n, double* own, double* x, double* work) {
  for (std::size_t r = 0; r < n.below; ++r)
    work[r] = x[n.row[r]];
  in_runs<Single>(n.columns, [&](std::size_t c, auto run) {
    constexpr std::size_t count = decltype(run)::value;
    forward_own<Single, count>(n, c, c, own, 1);
    const double* const l = n.l + c * n.rows;
    lose_streams<count>(l + c + count, n.rows, own + c, own + c + count, n.columns - c - count);
    lose_streams<count>(l + n.columns, n.rows, own + c, work, n.below);
  });
  for (std::size_t r = 0; r < n.below; ++r)
    x[n.row[r]] = work[r];
}

/// A panel of right-hand sides.
template <class Of>
void forward_near(const Supernode& n, double* own, double* x, std::size_t stride) {
  in_runs<Of>(n.columns, [&](std::size_t c, auto run) {
    forward_own<Of, decltype(run)::value>(n, 0, c, own, stride);
  });
  const auto to = [&](std::size_t r) {
    return x + static_cast<std::size_t>(n.row[r - n.columns]) * stride;
  };
  in_runs<Of>(n.below, [&](std::size_t r, auto run) {
    forward_rows<Of, decltype(run)::value, false>(n, n.columns + r, 0, n.columns, own, stride, to);
  });
}

/// All panels: some columns, and whatever is behind them.
template <class Of>
void forward_far(const Supernode& n, double* own, double* x, std::size_t stride) {
  constexpr std::size_t rows_at_once = 256; // that stay in the second cache for all panels
  for (std::size_t begin = 0; begin < n.columns; begin += Of::columns) {
    const std::size_t end = begin + Of::columns < n.columns ? begin + Of::columns : n.columns;
    std::uint64_t some = 0; // panels that these columns mean anything to
    for (std::size_t v = 0; v < stride; v += Of::width)
      if (!all_zero<Of>(own + begin * stride + v, end - begin, stride)) {
        some |= std::uint64_t{1} << v / Of::width;
        in_runs<Of>(end - begin, [&](std::size_t c, auto run) {
          forward_own<Of, decltype(run)::value>(n, begin, begin + c, own + v, stride);
        });
      }
    for (std::size_t top = end; some != 0 && top < n.rows; top += rows_at_once) {
      const std::size_t count = n.rows - top < rows_at_once ? n.rows - top : rows_at_once;
      for (std::size_t v = 0; v < stride; v += Of::width) {
        if ((some >> v / Of::width & 1) == 0)
          continue;
        const auto to = [&](std::size_t r) {
          return v + (r < n.columns ? own + r * stride
                                    : x + static_cast<std::size_t>(n.row[r - n.columns]) * stride);
        };
        in_runs<Of>(count, [&](std::size_t r, auto run) {
          forward_rows<Of, decltype(run)::value, true>(n, top + r, begin, end, own + v, stride, to);
        });
      }
    }
  }
}

/// Where something is known to arrive. \pre at most 64 panels \param work as SupernodalSolve has it
template <class Of>
void forward_reached(const Supernode& n, double* x, std::size_t stride, double* work) {
  double* const own = x + n.first * stride;
  fetch(n);
  if constexpr (Of::width == 1)
    forward_single(n, own, x, work);
  else if (n.far)
    forward_far<Of>(n, own, x, stride);
  else
    for (std::size_t v = 0; v < stride; v += Of::width)
      forward_near<Of>(n, own + v, x + v, stride);
}

/// \pre, \param as forward_reached has them
template <class Of>
void forward(const Supernode& n, double* x, std::size_t stride, double* work) {
  double* const own = x + n.first * stride;
  bool fetched = false;
  for (std::size_t v = 0; v < stride; v += Of::width) {
    if (all_zero<Of>(own + v, n.columns, stride)) // and so stays what only hears from it
      continue;
    if (!fetched)
      fetch(n);
    fetched = true;
    if constexpr (Of::width == 1) {
      forward_single(n, own, x, work);
    } else if (n.far) {
      forward_far<Of>(n, own, x, stride);
      return;
    } else {
      forward_near<Of>(n, own + v, x + v, stride);
    }
  }
}

/// N own columns from `c` on, once all behind them are solved; `below` are the rows below. What
/// begins with zeros need not be set.
template <class Of, bool Far, std::size_t N>
void backward_own(const Supernode& n, std::size_t c, const double* below, double* x,
                  std::size_t stride, bool zeros) {
  Row<Of> sum[N];
  if (zeros)
    for (std::size_t i = 0; i < N; ++i)
      sum[i] = {};
  else
    for (std::size_t i = 0; i < N; ++i)
      sum[i].load(x + (c + i) * stride);
  const double* const l = n.l + c * n.rows;
  const auto lose = [&](std::size_t row, const double* values) {
    Row<Of> xr;
    xr.load(values);
    for (std::size_t i = 0; i < N; ++i)
      sum[i].subtract(l[i * n.rows + row], xr);
  };
  for (std::size_t r = 0; r < n.below; ++r) {
    constexpr std::size_t line = 64 / sizeof(double);
    if (Far && r % line == 0)
      for (std::size_t i = 0; i < N; ++i)
        __builtin_prefetch(l + i * n.rows + n.columns + r + ahead);
    lose(n.columns + r, below + r * Of::width);
  }
  for (std::size_t r = n.columns; r-- > c + N;)
    lose(r, x + r * stride);
  for (std::size_t i = N; i-- > 0;) {
    for (std::size_t j = N; j-- > i + 1;)
      sum[i].subtract(n.at(c + j, c + i), sum[j]);
    sum[i].divide(n.at(c + i, c + i));
    sum[i].store(x + (c + i) * stride);
  }
}

/// The rows below stand in `work` meanwhile, panel by panel.
template <class Of>
void backward(const Supernode& n, double* x, std::size_t stride, double* work, bool zeros) {
  fetch(n);
  for (std::size_t v = 0; v < stride; v += Of::width)
    for (std::size_t r = 0; r < n.below; ++r) {
      Row<Of> xr;
      xr.load(x + static_cast<std::size_t>(n.row[r]) * stride + v);
      xr.store(work + v * n.below + r * Of::width);
    }
  double* const own = x + n.first * stride;
  const auto panels = [&]<bool Far>(std::bool_constant<Far>, std::size_t begin, std::size_t end) {
    in_runs<Of>(n.columns, [&](std::size_t done, auto run) { // from the last column on
      constexpr std::size_t count = decltype(run)::value;
      for (std::size_t v = begin; v < end; v += Of::width)
        backward_own<Of, Far, count>(n, n.columns - done - count, work + v * n.below, own + v,
                                     stride, zeros);
    });
  };
  if (n.far) // what comes from afar is used for all of them
    panels(std::true_type{}, 0, stride);
  else
    for (std::size_t v = 0; v < stride; v += Of::width)
      panels(std::false_type{}, v, v + Of::width);
}

template <class Of>
void forward_some(const SupernodalArrays& l, std::span<const std::uint32_t> supernodes, double* x,
                  std::size_t stride, double* work) {
  for (const std::uint32_t k : supernodes)
    forward<Of>(supernode(l, k), x, stride, work);
}

/// A supernode is read once for all of the `stride` vectors side by side.
template <class Of>
void solve(const SupernodalArrays& l, double* x, std::size_t stride, double* work) {
  for (std::size_t k = 0; k < l.supernodes; ++k)
    forward<Of>(supernode(l, k), x, stride, work);
  for (std::size_t k = l.supernodes; k-- > 0;)
    backward<Of>(supernode(l, k), x, stride, work, false);
}

template <class Of>
void solve_reached(const SupernodalArrays& l, std::span<const std::uint32_t> reached, double* x,
                   std::size_t stride, double* work) {
  for (const std::uint32_t k : reached)
    forward_reached<Of>(supernode(l, k), x, stride, work);
  for (std::size_t k = l.supernodes, left = reached.size(); k-- > 0;) {
    const bool zeros = left == 0 || reached[left - 1] != k;
    backward<Of>(supernode(l, k), x, stride, work, zeros);
    left -= zeros ? 0 : 1;
  }
}

/// Calls work(Of) for whole solves of so many right-hand sides side by side.
template <class Work>
void by_width(std::size_t vectors, const Work& work) {
  if (vectors == 1)
    work(Single{});
  else if (vectors == 4)
    work(Narrow{});
  else if (vectors % Broad::width == 0)
    work(Broad{});
  else
    work(Wide{});
}

inline void solve_any(const SupernodalArrays& l, double* x, std::size_t vectors, double* work) {
  by_width(vectors, [&]<class Of>(Of) { solve<Of>(l, x, vectors, work); });
}

inline void reached_any(const SupernodalArrays& l, std::span<const std::uint32_t> reached,
                        double* x, std::size_t vectors, double* work) {
  by_width(vectors, [&]<class Of>(Of) { solve_reached<Of>(l, reached, x, vectors, work); });
}

inline void forward_any(const SupernodalArrays& l, std::span<const std::uint32_t> supernodes,
                        double* x, std::size_t vectors, double* work) {
  if (vectors == 1)
    forward_some<Single>(l, supernodes, x, 1, work);
  else if (vectors == 4)
    forward_some<Narrow>(l, supernodes, x, 4, work);
  else
    forward_some<Wide>(l, supernodes, x, vectors, work);
}

} // namespace
} // namespace gewebe::linalg
