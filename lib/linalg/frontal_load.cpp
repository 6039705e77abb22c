// A load's forward solve that follows the factor: fronts that neither the load nor the factor has
// changed keep theirs.

#include "cholesky/front_layout.h"
#include "linalg/frontal_factor_internal.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace gewebe::linalg {

using namespace frontal;

std::span<const std::int64_t> FrontalFactor::State::rows_of(std::size_t front) const {
  const auto begin = static_cast<std::size_t>(blocks.pi[blocks.first[front]]);
  return std::span(blocks.s).subspan(begin, fronts[front].rows);
}

void FrontalFactor::State::forward(std::size_t front, std::span<const std::int64_t> row,
                                   std::span<double> space) {
  const cholesky::Front& f = fronts[front];
  constexpr std::array<std::uint32_t, 1> only{0};
  for (std::size_t c = 0; c < f.columns; c += cholesky::front_block) {
    const auto first = static_cast<std::int64_t>(c);
    const auto last = static_cast<std::int64_t>(std::min(c + cholesky::front_block, f.columns));
    const std::array<std::int64_t, 2> super{first, last},
        rows{first, static_cast<std::int64_t>(f.rows)};
    const double* const block = f.l + cholesky::front_offset(f.rows, c);
    const SupernodalArrays l{1, super.data(), rows.data(), nullptr, row.data(), nullptr, &block};
    forward_supernodal(cpu)(l, only, loads[front].values.data(), 1, space.data());
  }
}

std::size_t FrontalFactor::State::carry(std::span<const double> over_axes) {
  const std::size_t count = tree.fronts();
  loads.resize(count);
  std::vector<std::uint32_t> child(count, none), sibling(count, none);
  for (std::size_t f = count; f-- > 0;) // lists that ascend
    if (const std::uint32_t parent = tree.parent[f]; parent != none) {
      sibling[f] = child[parent];
      child[parent] = static_cast<std::uint32_t>(f);
    }
  std::vector<std::int64_t> numbers;
  std::vector<std::size_t> at(axis_of_row.size()); // rows of L within the front
  std::vector<double> own, space;
  std::size_t solved = 0;
  for (std::size_t f = 0; f < count; ++f) {
    const cholesky::Front& front = fronts[f];
    FrontLoad& load = loads[f];
    own.clear();
    for (std::size_t c = 0; c < front.columns; ++c)
      own.push_back(over_axes[axis_of_row[first_row(f) + c]] + 0.0); // no -0
    if (load.current && own == load.load)
      continue;
    load.load = own;
    load.values = own;
    load.values.resize(front.rows, 0.0);
    const std::span<const std::int64_t> rows = rows_of(f);
    for (std::size_t r = 0; r < rows.size(); ++r)
      at[static_cast<std::size_t>(rows[r])] = r;
    for (std::uint32_t c = child[f]; c != none; c = sibling[c]) {
      const std::span<const std::int64_t> below = rows_of(c);
      for (std::size_t r = fronts[c].columns; r < below.size(); ++r)
        load.values[at[static_cast<std::size_t>(below[r])]] += loads[c].values[r];
    }
    if (numbers.size() < front.rows) {
      const auto from = static_cast<std::ptrdiff_t>(numbers.size());
      numbers.resize(front.rows);
      std::iota(numbers.begin() + from, numbers.end(), static_cast<std::int64_t>(from));
      space.resize(front.rows);
    }
    forward(f, numbers, space);
    load.current = true;
    ++solved;
    if (tree.parent[f] != none)
      loads[tree.parent[f]].current = false;
  }
  return solved;
}

} // namespace gewebe::linalg
