#include "update/corrected_columns.h"

#include "base/error.h"
#include "base/parallel.h"
#include "columns/costs.h"
#include "update/response_sum.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace gewebe::update {

namespace {

constexpr std::size_t rows_at_once = 768; // so that a block of responses stays in the second cache
static_assert(rows_at_once % response_tile == 0);

std::size_t packed_index(std::size_t row, std::size_t k, std::size_t rank) {
  return (row / response_tile * rank + k) * response_tile + row % response_tile;
}

/// As ResponseSum takes them.
std::vector<double> packed(const std::vector<double>& columns, std::size_t rows, std::size_t rank) {
  std::vector<double> result((rows + response_tile - 1) / response_tile * response_tile * rank);
  for (std::size_t begin = 0; begin < rows; begin += response_tile)
    for (std::size_t k = 0; k < rank; ++k)
      std::copy_n(columns.begin() + static_cast<std::ptrdiff_t>(k * rows + begin),
                  std::min(response_tile, rows - begin),
                  result.begin() + static_cast<std::ptrdiff_t>(packed_index(begin, k, rank)));
  return result;
}

} // namespace

CorrectedColumns::CorrectedColumns(std::shared_ptr<const columns::ColumnSource> before,
                                   StiffnessChange change, AxesSolve solve, const Context& context,
                                   AxesSolve solve_before, std::size_t solve_entries)
    : before_(std::move(before)), change_(std::move(change)), solve_(std::move(solve)),
      solve_before_(std::move(solve_before)), solve_entries_(solve_entries), context_(context) {
  context_.progress = nullptr;
  if (3 * before_->node_count() != change_.old_axes)
    throw Error("the columns are of " + std::to_string(before_->node_count()) +
                " nodes, expected " + std::to_string(change_.old_axes / 3));
  if (before_->row_nodes() != before_->node_count())
    throw Error("the columns have rows for " + std::to_string(before_->row_nodes()) +
                " nodes alone, expected all of them");
  std::vector<std::size_t> place(before_->node_count(), SIZE_MAX);
  for (std::size_t k = 0; k < before_->nodes().size(); ++k)
    place[before_->nodes()[k]] = k;
  for (std::uint32_t node = 0; node < change_.origin.size(); ++node)
    if (const std::size_t k = place[change_.origin[node]]; k != SIZE_MAX) {
      nodes_.push_back(node);
      stored_.push_back(k);
    }
}

bool CorrectedColumns::pays(std::size_t count) const {
  const int responses = warm_ ? 0 : solve_before_ ? 2 : 1;
  return count > 0 && (solve_entries_ == 0 ||
                       columns::costs::correcting_columns_pays(
                           3 * count, change_.new_axes, solve_entries_, change_.rank(), responses));
}

void CorrectedColumns::prepare() const {
  if (prepared_) {
    warm_ = true;
    return;
  }
  response_ = packed(change_response(change_, solve_, context_), change_.new_axes, change_.rank());
  if (solve_before_) {
    answers_.assign(change_.old_axes * change_.rank(), 0.0);
    for (std::size_t k = 0; k < change_.rank(); ++k)
      change_.answer.add_to(k, 1,
                            std::span(answers_).subspan(k * change_.old_axes, change_.old_axes));
    solve_before_(answers_, change_.rank());
  }
  prepared_ = warm_ = true;
}

void CorrectedColumns::read(std::size_t k, std::span<double> out) const {
  read(k, 1, out);
}

void CorrectedColumns::read(std::size_t first, std::size_t count, std::span<double> out) const {
  prepare();
  const std::size_t rank = change_.rank(), axes = change_.new_axes, old_axes = change_.old_axes;
  std::vector<double> factor(3 * count * rank); // of the responses
  std::vector<double> before(3 * old_axes);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t node = nodes_[first + k], origin = change_.origin[node];
    before_->read(stored_[first + k], before);
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t column = 3 * k + a;
      const auto was = std::span<const double>(before).subspan(a * old_axes, old_axes);
      copy_displacements(change_, was, out.subspan(column * axes, axes));
      double* const by = factor.data() + 3 * k * rank + a; // [rank][3]
      for (std::size_t r = 0; r < rank; ++r)
        by[3 * r] = -change_.weight[r] *
                    (answers_.empty() ? change_.answer.times(r, was)
                                      : answers_[r * old_axes + 3 * std::size_t{origin} + a]);
      // The load is on the kept node: a copy's column is that, and the response of pulling it from
      // there.
      const auto at = std::lower_bound(change_.copy_axis.begin(), change_.copy_axis.end(),
                                       static_cast<std::uint32_t>(3 * std::size_t{node} + a));
      if (at != change_.copy_axis.end() && *at == 3 * std::size_t{node} + a)
        by[3 * (change_.springs + static_cast<std::size_t>(at - change_.copy_axis.begin()))] += 1;
    }
  }
  if (rank == 0)
    return;
  Context some = context_;
  if (3 * count * rank * axes < columns::costs::worth_threads)
    some.threads = 1;
  const ResponseSum sum = response_sum(context_.cpu);
  parallel_blocks(some, axes, rows_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = 0; k < count; ++k)
      sum(response_.data(), rank, factor.data() + 3 * k * rank, out.data() + 3 * k * axes, axes,
          begin / response_tile, end);
  });
}

void CorrectedColumns::read_single(std::size_t k, std::span<float> out) const {
  std::vector<double> wide(out.size());
  read(k, wide);
  for (std::size_t r = 0; r < out.size(); ++r)
    out[r] = static_cast<float>(wide[r]);
}

columns::EntryBound CorrectedColumns::bound() const {
  columns::EntryBound bound = before_->bound();
  if (bound.entry > 0)
    bound.entry *= error_gain();
  return bound;
}

double CorrectedColumns::error_gain() const {
  prepare();
  if (!answers_.empty())
    return 1;
  std::vector<double> gain(change_.new_axes, 1.0);
  for (std::size_t r = 0; r < change_.rank(); ++r) {
    double sum = 0;
    for (std::size_t k = change_.answer.start[r]; k < change_.answer.start[r + 1]; ++k)
      sum += std::abs(change_.answer.value[k]);
    sum *= std::abs(change_.weight[r]);
    for (std::size_t row = 0; row < gain.size(); ++row)
      gain[row] += sum * std::abs(response_[packed_index(row, r, change_.rank())]);
  }
  return *std::max_element(gain.begin(), gain.end());
}

} // namespace gewebe::update
