#include "update/cut_stiffness.h"

#include "base/error.h"
#include "columns/costs.h"
#include "compliance/forward_blocks.h"
#include "cutting/cut.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"
#include "numeric/larger.h"
#include "update/corrected_columns.h"
#include "update/node_stiffness.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace gewebe {

namespace {

// Beyond this condition of the small system a refactorisation is worth its digits.
constexpr double max_woodbury_condition = 1e8;
// Below this the condition may be too large, and is looked at: by one column of C, or an estimate.
// What moves freely takes less than ten thousand other axes with it, or else it did before the cut.
constexpr double weak_pivot = 1e-8, column_margin = 100, estimate_margin = 3;

std::vector<std::uint32_t> identity(std::size_t count) {
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0U);
  return numbers;
}

/// Two steps as one.
void follow(std::vector<std::uint32_t>& origin, std::vector<std::uint32_t>& place,
            std::span<const std::uint32_t> next_origin, std::span<const std::uint32_t> next_place) {
  std::vector<std::uint32_t> from;
  from.reserve(next_origin.size());
  for (const std::uint32_t node : next_origin)
    from.push_back(origin[node]);
  for (std::uint32_t& node : place)
    if (node != CutModel::gone)
      node = next_place[node];
  origin = std::move(from);
}

/// How many nodes are copies.
std::size_t copies(std::span<const std::uint32_t> origin, std::span<const std::uint32_t> place) {
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < origin.size(); ++i)
    count += place[origin[i]] != i ? 1 : 0;
  return count;
}

constexpr const char* nearly_singular =
    "the stiffness matrix is nearly singular, expected more that holds the object";

/// \throw SingularStiffness if K is, naming what moves
void tell_what_moves(const Model& model, const Context& context) {
  const StiffnessMatrix matrix = stiffness_matrix(model);
  StiffnessCheck check;
  (void)checked_factor(model, matrix, context, check);
}

/// A bound of ‖K‖₁. Cuts leave no spring stiffer than it was.
double stiffness_bound(const Model& model) {
  std::vector<double> sum(model.nodes.size());
  double max = 0;
  for (const Spring& s : model.springs) {
    const SymmetricBlock b = stiffness_block(model, s);
    const double largest = std::max({std::abs(b[0]) + std::abs(b[1]) + std::abs(b[2]),
                                     std::abs(b[1]) + std::abs(b[3]) + std::abs(b[4]),
                                     std::abs(b[2]) + std::abs(b[4]) + std::abs(b[5])});
    for (const std::uint32_t i : {s.i, s.j}) {
      sum[i] += 2 * largest; // on the diagonal and beside it
      max = sum[i] <= max ? max : sum[i];
    }
  }
  return max;
}

/// ‖K‖₁, where the norms of these rows are others. \param norms by node
double follow_norms(const NodeMatrix& matrix, std::span<const std::uint32_t> rows,
                    std::vector<double>& norms) {
  norms.resize(matrix.nodes());
  for (const std::uint32_t row : rows)
    norms[row] = row_norm(matrix, row);
  double norm = 0;
  for (const double of_row : norms)
    norm = larger(norm, of_row);
  return norm;
}

/// The factor of a cut model, or one before that is corrected; columns of the first model, to be
/// corrected; blocks where the factor is that of the model.
class CutSource final : public ComplianceSource {
public:
  CutSource(AxesSolve solve, std::size_t entries, std::unique_ptr<ForwardBlocks> blocks,
            std::unique_ptr<CorrectedColumns> columns)
      : solve_(std::move(solve)), entries_(entries), blocks_(std::move(blocks)),
        columns_(std::move(columns)) {}

  void open(const Model&, const Context&) override {}
  void solve(std::span<double> over_axes, std::size_t columns) override {
    solve_(over_axes, columns);
  }
  std::size_t entries() const override { return entries_; }
  const ColumnSource* columns() const override { return columns_.get(); }
  ForwardBlocks* blocks() override { return blocks_.get(); }

private:
  AxesSolve solve_;
  std::size_t entries_;
  std::unique_ptr<ForwardBlocks> blocks_;
  std::unique_ptr<CorrectedColumns> columns_;
};

} // namespace

CutStiffness::CutStiffness(std::shared_ptr<const Model> first,
                           std::shared_ptr<const ComplianceSource> source, const Context& context)
    : first_(std::move(first)), now_(first_), source_(std::move(source)), context_(context),
      first_origin_(identity(first_->nodes.size())), first_place_(first_origin_) {
  context_.progress = nullptr;
}

/// Checks the condition of K in three steps. A small pivot is the first sign. The column of C for
/// its axis then shows how far the free part moves. If that is far, the norm of C is estimated.
/// \throw SingularStiffness if the condition is too large
void CutStiffness::require_condition() {
  const double weakest = factor_->weakest_pivot();
  if (weakest > weak_pivot || weakest > 0.5 * accepted_pivot_)
    return;
  const std::size_t axes = factor_->axes();
  std::vector<double> column(axes);
  column[factor_->weakest_axis()] = 1;
  factor_->solve(column);
  double size = 0;
  for (const double value : column)
    size += std::abs(value);
  if (!(norm_ * size < max_condition / column_margin)) {
    size = inverse_norm(axes, [&](std::span<const double> x, std::span<double> y) {
      std::copy(x.begin(), x.end(), y.begin());
      factor_->solve(y);
    });
    if (!(norm_ * size < max_condition / estimate_margin))
      tell_what_moves(*now_, context_);
  }
  accepted_pivot_ = weakest;
}

/// The factor of now, or none. \throw SingularStiffness naming what moves, and what the work throws
void CutStiffness::factorise(const std::function<void()>& work) {
  try {
    work();
    require_condition();
  } catch (const NotPositiveDefinite&) {
    factor_.reset();
    tell_what_moves(*now_, context_);
    throw SingularStiffness(nearly_singular);
  } catch (...) {
    factor_.reset();
    throw;
  }
}

void CutStiffness::prepare() {
  if (factor_ != nullptr)
    return;
  if (is_solid()) {
    matrix_ = node_stiffness(*now_);
    norm_ = follow_norms(matrix_, identity(matrix_.nodes()), row_norm_);
    factorise([&] { factor_ = std::make_shared<FrontalFactor>(matrix_, context_); });
  } else {
    norm_ = stiffness_bound(*now_);
    factorise([&] { factor_ = std::make_shared<FrontalFactor>(*now_, context_); });
  }
  factored_ = now_;
  woodbury_.reset();
  origin_ = place_ = identity(now_->nodes.size());
  fresh_operations_ = factor_->work().all_operations;
}

/// The matrix of now, from that of factored_. \return the rows that are others
std::vector<std::uint32_t> CutStiffness::follow_matrix() {
  std::vector<std::uint32_t> rows = changed_rows(*factored_, *now_, place_);
  bool stay = true;
  for (std::uint32_t i = 0; i < place_.size(); ++i)
    stay = stay && place_[i] == i;
  if (stay) {
    update_node_stiffness(matrix_, *now_, rows);
    norm_ = follow_norms(matrix_, rows, row_norm_);
  } else {
    matrix_ = node_stiffness(*now_);
    norm_ = follow_norms(matrix_, identity(matrix_.nodes()), row_norm_);
  }
  return rows;
}

bool CutStiffness::woodbury_pays(std::size_t rank) const {
  return costs::woodbury_pays({.nodes = now_->nodes.size(),
                               .rank = rank,
                               .entries = factor_->entries(),
                               .all_operations = factor_->work().all_operations,
                               .reached = reached_});
}

CutWork CutStiffness::cut(std::shared_ptr<const Model> next, std::span<const std::uint32_t> origin,
                          std::span<const std::uint32_t> place, std::optional<CutWay> way) {
  CutWork work;
  work.unprepared = factor_ == nullptr;
  prepare(); // whether it was announced or not, the same way is gone
  follow(first_origin_, first_place_, origin, place);
  now_ = std::move(next);
  if (way != CutWay::fresh) {
    follow(origin_, place_, origin, place);
    const bool some_gone = std::find(place_.begin(), place_.end(), CutModel::gone) != place_.end();
    work.rank = 3 * copies(origin_, place_);
    std::optional<StiffnessChange> change;
    if (!some_gone && !is_solid() && (way ? way == CutWay::woodbury : woodbury_pays(work.rank))) {
      change = stiffness_change(*factored_, *now_, origin_, place_);
      work.rank = change->rank();
    }
    if (change && (way || woodbury_pays(work.rank))) {
      try {
        const std::shared_ptr<const FrontalFactor> factor = factor_;
        auto woodbury = std::make_shared<const WoodburySolver>(
            std::move(*change),
            [factor](std::span<double> f, std::size_t columns) { factor->solve(f, columns); },
            context_);
        if (woodbury->condition() < max_woodbury_condition) {
          woodbury_ = std::move(woodbury);
          work.way = CutWay::woodbury;
          return work;
        }
      } catch (const Cancelled&) {
        throw;
      } catch (const Error&) {
        // Singular, or nearly so: a refactorisation decides.
      }
    }
    woodbury_.reset();
    if (!costs::order_is_worn_out(factor_->work().all_operations, fresh_operations_)) {
      ++*generation_;
      factorise([&] {
        if (is_solid()) {
          const std::vector<std::uint32_t> rows = follow_matrix();
          work.factor = factor_->refactor(matrix_, origin_, place_, rows, context_);
        } else {
          work.factor = factor_->refactor(*now_, origin_, place_, context_);
        }
      });
      work.way = CutWay::refactor;
      reached_ = work.factor.operations;
      factored_ = now_;
      origin_ = place_ = identity(now_->nodes.size());
      return work;
    }
  }
  factor_.reset();
  prepare();
  work.factor = factor_->work();
  return work;
}

/// Throws when another cut has changed the factor.
std::function<void()> CutStiffness::still_valid() const {
  return [generation = generation_, made = *generation_] {
    if (*generation != made)
      throw Error("the object was cut since, expected a call for its new stiffness");
  };
}

/// Solves for the model of now.
AxesSolve CutStiffness::solver() const {
  return [factor = std::shared_ptr<const FrontalFactor>(factor_), woodbury = woodbury_,
          check = still_valid()](std::span<double> f, std::size_t columns) {
    check();
    if (woodbury != nullptr)
      woodbury->solve(f, columns);
    else
      factor->solve(f, columns);
  };
}

std::shared_ptr<ComplianceSource> CutStiffness::compliance() const {
  AxesSolve solve = solver();
  std::size_t entries = factor_->entries();
  std::unique_ptr<ForwardBlocks> blocks;
  if (woodbury_ == nullptr)
    blocks = std::make_unique<ForwardBlocks>(factor_, still_valid());
  else
    entries += woodbury_->change().rank() * factor_->axes();
  std::unique_ptr<CorrectedColumns> columns;
  if (!is_solid() && source_ != nullptr && source_->columns() != nullptr)
    columns = std::make_unique<CorrectedColumns>(
        std::shared_ptr<const ColumnSource>(source_, source_->columns()),
        stiffness_change(*first_, *now_, first_origin_, first_place_), solve, context_, AxesSolve{},
        entries);
  return std::make_shared<CutSource>(std::move(solve), entries, std::move(blocks),
                                     std::move(columns));
}

} // namespace gewebe
