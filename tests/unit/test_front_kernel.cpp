// The dense part of a front against a plain triple loop, and solves with its numbers against plain
// substitution, bit by bit: each entry loses its products one by one in the order of elimination.

#include "cholesky/front_kernel_internal.h"
#include "linalg/supernodal_solve_internal.h"
#include "stiffness_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <numeric>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::test;

namespace {

/// A front with numbers whose pivots are positive.
struct MadeFront {
  std::vector<double> l, update;
  cholesky::FrontArrays arrays;

  MadeFront(std::size_t columns, std::size_t below)
      : l(random_vector(cholesky::front_offset(columns + below, columns), 1)),
        update(random_vector(below * (below + 1) / 2, 2)) {
    arrays = {columns + below, columns, l.data(), update.data()};
    for (std::size_t c = 0; c < columns; ++c)
      arrays.column(c)[c] = 2.0 * static_cast<double>(arrays.rows);
  }
};

void plainly(const cholesky::FrontArrays& f) {
  for (std::size_t c = 0; c < f.rows; ++c)
    for (std::size_t r = c; r < f.rows; ++r) {
      double& entry = f.column(c)[r];
      for (std::size_t k = 0; k < std::min(c, f.columns); ++k)
        entry = std::fma(-f.column(k)[r], f.column(k)[c], entry);
      if (c < f.columns)
        entry = r == c ? std::sqrt(entry) : entry * (1 / f.column(c)[c]);
    }
}

/// As the factorisation does it, strips in `parts`.
void by_kernel(const cholesky::FrontKernel& kernel, const cholesky::FrontArrays& f,
               std::size_t parts) {
  std::vector<double> square(kernel.square_size(cholesky::front_block)),
      strips(kernel.strips_size(f.rows, std::min(f.columns, cholesky::front_block)));
  const cholesky::FrontScratch scratch{square.data(), strips.data()};
  const std::vector<double> min_pivot(f.columns);
  for (std::size_t begin = 0; begin < f.columns; begin += cholesky::front_block) {
    const std::size_t count = std::min(cholesky::front_block, f.columns - begin);
    ASSERT_EQ(kernel.eliminate(f, begin, count, min_pivot.data(), scratch), count);
    const std::size_t all = kernel.strips(f.rows - begin - count);
    for (std::size_t p = 0; p < parts; ++p)
      kernel.solve(f, begin, count, scratch, all * p / parts, all * (p + 1) / parts);
    for (std::size_t p = parts; p-- > 0;)
      kernel.update(f, begin, count, scratch, all * p / parts, all * (p + 1) / parts);
  }
}

bool has_avx2() {
  return best_cpu_level() != CpuLevel::baseline;
}

/// Those that this processor can run.
std::vector<const cholesky::FrontKernel*> kernels() {
  std::vector<const cholesky::FrontKernel*> all{&cholesky::front_kernel_baseline};
  if (has_avx2())
    all.push_back(&cholesky::front_kernel_avx2);
  if (best_cpu_level() == CpuLevel::avx512)
    all.push_back(&cholesky::front_kernel_avx512);
  return all;
}

TEST(FrontKernel, IsAPlainTripleLoopAtEverySizeAndLevel) {
  for (const auto& [columns, below] :
       std::vector<std::pair<std::size_t, std::size_t>>{{1, 0},
                                                        {1, 1},
                                                        {3, 5},
                                                        {4, 12},
                                                        {5, 11},
                                                        {11, 13},
                                                        {12, 24},
                                                        {13, 37},
                                                        {30, 7},
                                                        {48, 49},
                                                        {127, 50},
                                                        {128, 1},
                                                        {129, 61},
                                                        {140, 203},
                                                        {300, 100}}) {
    MadeFront plain(columns, below);
    plainly(plain.arrays);
    for (const cholesky::FrontKernel* kernel : kernels()) {
      for (const std::size_t parts : std::array<std::size_t, 2>{1, 3}) {
        MadeFront made(columns, below);
        by_kernel(*kernel, made.arrays, parts);
        std::size_t different = 0;
        for (std::size_t c = 0; c < columns + below; ++c)
          for (std::size_t r = c; r < columns + below; ++r)
            different += made.arrays.column(c)[r] != plain.arrays.column(c)[r] ? 1 : 0;
        EXPECT_EQ(different, 0U) << columns << " + " << below << ", parts " << parts;
      }
    }
  }
}

/// Runs of all lengths up to 17 and gaps between them, over columns and what is below them.
TEST(FrontKernel, AddsAChildAtItsRowsAtEveryLevel) {
  std::vector<cholesky::FrontRun> runs;
  std::vector<std::size_t> row; // of the front, by that of the child
  std::size_t rows = 2;
  for (std::size_t length = 1; length <= 17; ++length) {
    runs.push_back({row.size(), row.size() + length, rows});
    for (std::size_t k = 0; k < length; ++k)
      row.push_back(rows++);
    rows += length % 4 + 1;
  }
  const std::size_t columns = 131, below = row.size();
  const std::vector<double> update = random_vector(below * (below + 1) / 2, 3);
  MadeFront plain(columns, rows - columns);
  std::size_t at = 0;
  for (std::size_t c = 0; c < below; ++c)
    for (std::size_t r = c; r < below; ++r)
      plain.arrays.column(row[c])[row[r]] += update[at++];
  for (const cholesky::FrontKernel* kernel : kernels())
    for (const std::size_t at_once : std::array<std::size_t, 3>{1, 16, 1000}) {
      MadeFront made(columns, rows - columns);
      for (std::size_t first = 0; first < rows; first += at_once)
        kernel->add(made.arrays, {update.data(), below, runs}, first,
                    std::min(first + at_once, rows));
      EXPECT_EQ(made.l, plain.l) << at_once;
      EXPECT_EQ(made.update, plain.update) << at_once;
    }
}

/// Columns of all rows, one behind the other: one supernode, however wide.
std::vector<double> square_columns(const cholesky::FrontArrays& f) {
  std::vector<double> l(f.rows * f.columns);
  for (std::size_t c = 0; c < f.columns; ++c)
    std::copy_n(f.column(c) + c, f.rows - c, l.data() + c * f.rows + c);
  return l;
}

/// Two supernodes, the second of what is below the first.
struct MadeFactor {
  std::vector<double> first, second;
  std::vector<std::int64_t> super, pi, s;
  std::array<const double*, 2> blocks{};

  MadeFactor(std::size_t columns, std::size_t below) {
    MadeFront a(columns, below), b(below, 0);
    plainly(a.arrays);
    plainly(b.arrays);
    first = square_columns(a.arrays);
    second = square_columns(b.arrays);
    const auto c = static_cast<std::int64_t>(columns), n = static_cast<std::int64_t>(below) + c;
    super = {0, c, n};
    pi = {0, n, 2 * n - c};
    s.resize(static_cast<std::size_t>(pi[2]));
    std::iota(s.begin(), s.begin() + n, 0);
    std::iota(s.begin() + n, s.end(), c);
    blocks = {first.data(), second.data()};
  }
  linalg::SupernodalArrays arrays() const {
    return {2, super.data(), pi.data(), nullptr, s.data(), nullptr, blocks.data()};
  }
  /// L of row r and column c.
  double at(std::size_t r, std::size_t c) const {
    const auto columns = static_cast<std::size_t>(super[1]), all = static_cast<std::size_t>(pi[1]);
    return c < columns ? first[c * all + r] : second[(c - columns) * (all - columns) + r - columns];
  }
};

/// In the order that the solver promises: forward by ascending columns; backward the rows below
/// ascending, then the supernode's own from the last.
void substitute(const MadeFactor& l, std::vector<double>& x) {
  const std::size_t n = x.size(), columns = static_cast<std::size_t>(l.super[1]);
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t c = 0; c < r; ++c)
      x[r] -= l.at(r, c) * x[c];
    x[r] /= l.at(r, r);
  }
  for (std::size_t c = n; c-- > 0;) {
    const std::size_t end = c < columns ? columns : n;
    for (std::size_t r = end; r < n; ++r)
      x[c] -= l.at(r, c) * x[r];
    for (std::size_t r = end; r-- > c + 1;)
      x[c] -= l.at(r, c) * x[r];
    x[c] /= l.at(c, c);
  }
}

TEST(SupernodalSolve, IsPlainSubstitutionAtEverySizeWidthAndLevel) {
  for (const auto& [columns, below] : std::vector<std::pair<std::size_t, std::size_t>>{
           {1, 1}, {3, 8}, {7, 9}, {8, 5}, {33, 70}, {70, 300}, {131, 309}, {200, 17}}) {
    const MadeFactor l(columns, below);
    const std::size_t n = columns + below;
    for (const std::size_t width : std::array<std::size_t, 4>{1, 4, 8, 24}) {
      std::vector<double> x = random_vector(n * width, 3);
      for (std::size_t r = 0; r < n; ++r) // some that reach a part of the rows alone, or none
        for (std::size_t v = 0; v < width / 2; ++v)
          if (v == 1 || r < v * n / width)
            x[r * width + v] = 0;
      std::vector<double> plain = x, one(n);
      for (std::size_t v = 0; v < width; ++v) {
        for (std::size_t r = 0; r < n; ++r)
          one[r] = x[r * width + v];
        substitute(l, one);
        for (std::size_t r = 0; r < n; ++r)
          plain[r * width + v] = one[r];
      }
      for (const CpuLevel cpu : {CpuLevel::baseline, CpuLevel::avx2, CpuLevel::avx512}) {
        if (cpu > best_cpu_level())
          continue;
        std::vector<double> solved = x, work(below * width);
        linalg::solve_supernodal(cpu)(l.arrays(), solved.data(), width, work.data());
        EXPECT_EQ(std::memcmp(solved.data(), plain.data(), 8 * solved.size()), 0)
            << columns << " + " << below << ", " << width << " wide, " << cpu_level_name(cpu);
      }
    }
  }
}

} // namespace
