#pragma once
// Body of front_kernel_*.cpp: dense Cholesky and update of a front by register tiles. Each of these
// files compiles it for one instruction set.

#include "cholesky/front_kernel_internal.h"
#include "cholesky/fused_internal.h"

#include <algorithm>
#include <cmath>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

// Based on: Goto, van de Geijn, Anatomy of High-Performance Matrix Multiplication, 2008 (packed
// strips, a tile of the result in registers).

namespace gewebe::cholesky {
namespace {

/// A tile: rows of one strip, in so many registers, by so many columns.
#if defined(__AVX512F__)
inline constexpr std::size_t lanes = 8, max_parts = 3, tile_columns = 8;
#elif defined(__AVX2__)
inline constexpr std::size_t lanes = 4, max_parts = 3, tile_columns = 4;
#else
inline constexpr std::size_t lanes = 2, max_parts = 2, tile_columns = 4;
#endif
inline constexpr std::size_t strip_rows = lanes * max_parts;
static_assert(strip_rows % tile_columns == 0);
using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));
using Unaligned =
    double __attribute__((vector_size(lanes * sizeof(double)), aligned(sizeof(double)), may_alias));

/// sum - a b, rounded once, at every level.
inline Lanes lose(Lanes sum, Lanes a, double b) {
#if defined(__AVX512F__)
  return _mm512_fnmadd_pd(a, _mm512_set1_pd(b), sum);
#elif defined(__AVX2__)
  return _mm256_fnmadd_pd(a, _mm256_set1_pd(b), sum);
#else
  return lose_fused(sum, a, Lanes{b, b});
#endif
}

template <std::size_t Parts>
struct Tile {
  Lanes part[tile_columns][Parts];

  void load(double* const* columns) {
    for (std::size_t j = 0; j < tile_columns; ++j)
      for (std::size_t i = 0; i < Parts; ++i)
        part[j][i] = reinterpret_cast<const Unaligned*>(columns[j])[i];
  }
  void store(double* const* columns) const {
    for (std::size_t j = 0; j < tile_columns; ++j)
      for (std::size_t i = 0; i < Parts; ++i)
        reinterpret_cast<Unaligned*>(columns[j])[i] = part[j][i];
  }
  /// Loses a bᵀ, `depth` columns of both, `a_step` and `b_step` numbers from one to the next.
  void lose(const double* a, std::size_t a_step, const double* b, std::size_t b_step,
            std::size_t depth) {
    for (std::size_t k = 0; k < depth; ++k, a += a_step, b += b_step) {
      Lanes row[Parts];
      for (std::size_t i = 0; i < Parts; ++i)
        row[i] = reinterpret_cast<const Unaligned*>(a)[i];
      for (std::size_t j = 0; j < tile_columns; ++j)
        for (std::size_t i = 0; i < Parts; ++i)
          part[j][i] = gewebe::cholesky::lose(part[j][i], row[i], b[j]);
    }
  }
  /// X L' = this, of a square with the reciprocals of its pivots.
  void solve(const double* square, std::size_t step, const double* reciprocal) {
#pragma GCC unroll 8
    for (std::size_t j = 0; j < tile_columns; ++j) {
#pragma GCC unroll 8
      for (std::size_t k = 0; k < j; ++k)
        for (std::size_t i = 0; i < Parts; ++i)
          part[j][i] = gewebe::cholesky::lose(part[j][i], part[k][i], square[k * step + j]);
      for (std::size_t i = 0; i < Parts; ++i)
        part[j][i] *= reciprocal[j];
    }
  }
};

/// Gains `count` numbers.
inline void gain(double* to, const double* from, std::size_t count) {
  std::size_t k = 0;
  for (; k + lanes <= count; k += lanes) {
    Lanes sum = *reinterpret_cast<const Unaligned*>(to + k);
    sum += *reinterpret_cast<const Unaligned*>(from + k);
    *reinterpret_cast<Unaligned*>(to + k) = sum;
  }
#if defined(__AVX512F__)
  if (k < count) {
    const auto some = static_cast<__mmask8>((1U << (count - k)) - 1);
    _mm512_mask_storeu_pd(
        to + k, some,
        _mm512_add_pd(_mm512_maskz_loadu_pd(some, to + k), _mm512_maskz_loadu_pd(some, from + k)));
  }
#else
  for (; k < count; ++k)
    to[k] += from[k];
#endif
}

inline void add(const FrontArrays& f, const FrontGain& child, std::size_t first, std::size_t last) {
  const auto runs = child.runs;
  auto run = std::partition_point(runs.begin(), runs.end(), [&](const FrontRun& r) {
    return r.to + (r.end - r.begin) <= first;
  });
  for (; run != runs.end() && run->to < last; ++run) {
    const std::size_t stop = run->begin + std::min(run->end - run->begin, last - run->to);
    for (std::size_t c = run->begin + (std::max(first, run->to) - run->to); c < stop; ++c) {
      // [r] is row r, of the child and of the front
      const double* const from = child.update + (c * child.below - c * (c + 1) / 2);
      double* const to = f.column(run->to + c - run->begin);
      gain(to + run->to + c - run->begin, from + c, run->end - c);
      for (auto rows = run + 1; rows != runs.end(); ++rows)
        gain(to + rows->to, from + rows->begin, rows->end - rows->begin);
    }
  }
}

/// The square of `count` columns in its scratch: columns of `step` numbers, with room for whole
/// tiles at their ends and behind the last, and then the reciprocals of the pivots.
struct Square {
  std::size_t columns, step;
  double* at;

  Square(std::size_t count, double* scratch)
      : columns((count + tile_columns - 1) / tile_columns * tile_columns),
        step(columns + strip_rows), at(scratch) {}
  double* column(std::size_t c) const { return at + c * step; }
  double* reciprocal() const { return at + columns * step; }
  static std::size_t size(std::size_t count) {
    const Square s(count, nullptr);
    return s.columns * s.step + s.columns;
  }
};

inline std::size_t square_size(std::size_t count) {
  return Square::size(count);
}

/// Rows [row, end) of a group of columns, once all columns before it are taken from them.
template <std::size_t Parts>
void square_rows(const Square& s, std::size_t group, std::size_t row) {
  double* columns[tile_columns];
  for (std::size_t j = 0; j < tile_columns; ++j)
    columns[j] = s.column(group + j) + row;
  Tile<Parts> tile;
  tile.load(columns);
  tile.lose(s.at + row, s.step, s.at + group, s.step, group);
  tile.store(columns);
}

/// Cholesky of a group's own square. \return how many of its columns were eliminated
inline std::size_t corner(const Square& s, std::size_t group, std::size_t count,
                          const double* min_pivot) {
  for (std::size_t j = 0; j < count; ++j) {
    double* const column = s.column(group + j) + group;
    for (std::size_t k = 0; k < j; ++k) {
      const double* const before = s.column(group + k) + group;
      for (std::size_t r = j; r < tile_columns; ++r)
        column[r] = std::fma(-before[r], before[j], column[r]);
    }
    if (!(column[j] > min_pivot[j]) || !std::isfinite(column[j]))
      return j;
    column[j] = std::sqrt(column[j]);
    const double reciprocal = 1 / column[j];
    s.reciprocal()[group + j] = reciprocal;
    for (std::size_t r = j + 1; r < tile_columns; ++r)
      column[r] *= reciprocal;
  }
  return count;
}

template <std::size_t Parts>
void square_solve(const Square& s, std::size_t group, std::size_t row) {
  double* columns[tile_columns];
  for (std::size_t j = 0; j < tile_columns; ++j)
    columns[j] = s.column(group + j) + row;
  Tile<Parts> tile;
  tile.load(columns);
  tile.solve(s.column(group) + group, s.step, s.reciprocal() + group);
  tile.store(columns);
}

inline std::size_t eliminate(const FrontArrays& f, std::size_t begin, std::size_t count,
                             const double* min_pivot, const FrontScratch& scratch) {
  const Square s(count, scratch.square);
  std::fill_n(s.at, s.columns * s.step + s.columns, 0.0);
  for (std::size_t c = 0; c < count; ++c)
    std::copy_n(f.block(begin) + c * (f.rows - begin) + c, count - c, s.column(c) + c);
  for (std::size_t group = 0; group < count; group += tile_columns) {
    const std::size_t own = std::min(tile_columns, count - group);
    std::size_t row = group;
    if (group > 0) {
      for (; row + strip_rows <= s.columns; row += strip_rows)
        square_rows<max_parts>(s, group, row);
      for (; row < s.columns; row += lanes)
        square_rows<1>(s, group, row);
    }
    const std::size_t done = corner(s, group, own, min_pivot + begin + group);
    if (done < own)
      return group + done;
    row = group + tile_columns;
    for (; row + strip_rows <= s.columns; row += strip_rows)
      square_solve<max_parts>(s, group, row);
    for (; row < s.columns; row += lanes)
      square_solve<1>(s, group, row);
  }
  for (std::size_t c = 0; c < count; ++c)
    std::copy_n(s.column(c) + c, count - c, f.block(begin) + c * (f.rows - begin) + c);
  return count;
}

/// Rows behind the eliminated columns, in strips that end with the last row; the first one may
/// begin above `end`.
struct Strips {
  std::size_t end, count;
  std::ptrdiff_t first; ///< row where the first would begin

  Strips(const FrontArrays& f, std::size_t behind)
      : end(behind), count((f.rows - behind + strip_rows - 1) / strip_rows),
        first(static_cast<std::ptrdiff_t>(f.rows) -
              static_cast<std::ptrdiff_t>(strip_rows * count)) {}
  std::ptrdiff_t start(std::size_t strip) const {
    return first + static_cast<std::ptrdiff_t>(strip_rows * strip);
  }
  /// Rows of a strip that are none.
  std::size_t missing(std::size_t strip) const {
    return strip == 0 ? static_cast<std::size_t>(static_cast<std::ptrdiff_t>(end) - first) : 0;
  }
};

/// A strip goes to its place, is solved there, and back.
inline void solve_strip(const FrontArrays& f, std::size_t begin, std::size_t count,
                        const Square& square, double* packed, std::ptrdiff_t start,
                        std::size_t missing) {
  const std::size_t step = f.rows - begin;
  double* const block = f.block(begin) + (start - static_cast<std::ptrdiff_t>(begin));
  const auto copy = [&](std::size_t from, std::size_t to, bool back) {
    for (std::size_t c = from; c < to; ++c) {
      double* const rows = block + c * step;
      double* const there = packed + c * strip_rows;
      if (back) {
        for (std::size_t r = missing; r < strip_rows; ++r)
          rows[r] = there[r];
      } else {
        for (std::size_t r = missing; r < strip_rows; ++r)
          there[r] = rows[r];
      }
    }
  };
  if (missing > 0)
    std::fill_n(packed, count * strip_rows, 0.0);
  copy(0, count, false);
  double unused[strip_rows] = {}; // columns of the last tile that are none
  for (std::size_t group = 0; group < count; group += tile_columns) {
    double* columns[tile_columns];
    for (std::size_t j = 0; j < tile_columns; ++j)
      columns[j] = group + j < count ? packed + (group + j) * strip_rows : unused;
    Tile<max_parts> tile;
    tile.load(columns);
    tile.lose(packed, strip_rows, square.at + group, square.step, group);
    tile.solve(square.column(group) + group, square.step, square.reciprocal() + group);
    tile.store(columns);
  }
  copy(0, count, true);
}

inline void solve(const FrontArrays& f, std::size_t begin, std::size_t count,
                  const FrontScratch& scratch, std::size_t first, std::size_t last) {
  const Square square(count, scratch.square);
  const Strips strips(f, begin + count);
  for (std::size_t strip = first; strip < last; ++strip)
    solve_strip(f, begin, count, square, scratch.strips + strip * strip_rows * count,
                strips.start(strip), strips.missing(strip));
}

/// Tiles on the diagonal. Only their entries on and below the diagonal exist.
inline void update_corner(double* const* columns, std::ptrdiff_t start, std::size_t missing,
                          std::size_t count, const double* a) {
  double square[strip_rows][strip_rows] = {};
  for (std::size_t j = missing; j < strip_rows; ++j)
    for (std::size_t i = j; i < strip_rows; ++i)
      square[j][i] = columns[j][start + static_cast<std::ptrdiff_t>(i)];
  const auto lose = [&]<std::size_t Parts>(std::size_t group, gewebe::cholesky::Tile<Parts> tile) {
    constexpr std::size_t row = Parts * gewebe::cholesky::lanes < gewebe::cholesky::strip_rows
                                    ? gewebe::cholesky::strip_rows - Parts * gewebe::cholesky::lanes
                                    : 0;
    double* into[gewebe::cholesky::tile_columns];
    for (std::size_t j = 0; j < gewebe::cholesky::tile_columns; ++j)
      into[j] = square[group + j] + row;
    tile.load(into);
    tile.lose(a + row, gewebe::cholesky::strip_rows, a + group, gewebe::cholesky::strip_rows,
              count);
    tile.store(into);
  };
  for (std::size_t group = missing / tile_columns * tile_columns; group < strip_rows;
       group += tile_columns) {
    if constexpr (lanes == tile_columns && max_parts == 3) {
      if (group == 0)
        lose(group, Tile<3>{});
      else if (group == tile_columns)
        lose(group, Tile<2>{});
      else
        lose(group, Tile<1>{});
    } else {
      lose(group, Tile<max_parts>{});
    }
  }
  for (std::size_t j = missing; j < strip_rows; ++j)
    for (std::size_t i = j; i < strip_rows; ++i)
      columns[j][start + static_cast<std::ptrdiff_t>(i)] = square[j][i];
}

/// A tile comes to the first cache while the one before it is computed; fetched earlier, the strips
/// would replace it there.
inline void fetch_tile(double* const* columns, std::ptrdiff_t start) {
  for (std::size_t j = 0; j < tile_columns; ++j) {
    __builtin_prefetch(columns[j] + start, 1);
    __builtin_prefetch(columns[j] + start + strip_rows - 1, 1);
  }
}

inline void update(const FrontArrays& f, std::size_t begin, std::size_t count,
                   const FrontScratch& scratch, std::size_t first, std::size_t last) {
  const Strips strips(f, begin + count);
  const std::size_t size = strip_rows * count;
  const double* const packed = scratch.strips;
  constexpr std::size_t at_once = 4; // strips of columns that wait in the second cache
  double unused[strip_rows];
  for (std::size_t from = first; from < last; from += at_once) {
    const std::size_t to = std::min(from + at_once, last);
    double* columns[at_once][strip_rows];
    for (std::size_t c = from; c < to; ++c)
      for (std::size_t j = 0; j < strip_rows; ++j)
        columns[c - from][j] = f.column(static_cast<std::size_t>(
            strips.start(c) + static_cast<std::ptrdiff_t>(std::max(j, strips.missing(c)))));
    for (std::size_t r = from; r < strips.count; ++r) {
      const std::ptrdiff_t start = strips.start(r);
      const double* const a = packed + r * size;
      for (std::size_t c = from; c < std::min(to, r + 1); ++c) {
        const std::size_t missing = strips.missing(c);
        if (c == r) {
          update_corner(columns[c - from], start, missing, count, a);
          continue;
        }
        for (std::size_t group = missing / tile_columns * tile_columns; group < strip_rows;
             group += tile_columns) {
          double* into[tile_columns];
          for (std::size_t j = 0; j < tile_columns; ++j)
            into[j] = group + j < missing ? unused : columns[c - from][group + j] + start;
          Tile<max_parts> tile;
          tile.load(into);
          if (group + tile_columns < strip_rows)
            fetch_tile(columns[c - from] + group + tile_columns, start);
          else if (c + 1 < std::min(to, r + 1))
            fetch_tile(columns[c - from + 1], start);
          else
            fetch_tile(columns[0], start + static_cast<std::ptrdiff_t>(strip_rows));
          tile.lose(a, strip_rows, packed + c * size + group, strip_rows, count);
          tile.store(into);
        }
      }
    }
  }
}

} // namespace
} // namespace gewebe::cholesky
