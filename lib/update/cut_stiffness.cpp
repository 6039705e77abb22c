#include "update/cut_stiffness.h"

#include "base/error.h"
#include "columns/costs.h"
#include "compliance/forward_blocks.h"
#include "cutting/cut.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"
#include "update/corrected_columns.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace gewebe::update {

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
    if (node != cutting::CutModel::gone)
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
void tell_what_moves(const model::Model& model, const Context& context) {
  const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
  linalg::StiffnessCheck check;
  (void)linalg::checked_factor(model, matrix, context, check);
}

/// The factor of a cut model, or one before that is corrected; columns of the first model, to be
/// corrected; blocks where the factor is that of the model.
class CutSource final : public compliance::ComplianceSource {
public:
  CutSource(AxesSolve solve, std::size_t entries, std::unique_ptr<compliance::ForwardBlocks> blocks,
            std::unique_ptr<CorrectedColumns> columns)
      : solve_(std::move(solve)), entries_(entries), blocks_(std::move(blocks)),
        columns_(std::move(columns)) {}

  void open(const model::Model&, const Context&) override {}
  void solve(std::span<double> over_axes, std::size_t columns) override {
    solve_(over_axes, columns);
  }
  std::size_t entries() const override { return entries_; }
  const columns::ColumnSource* columns() const override { return columns_.get(); }
  compliance::ForwardBlocks* blocks() override { return blocks_.get(); }
  bool is_warm() const override { return columns_ != nullptr && columns_->is_warm(); }
  void set_warm(bool warm) override {
    if (columns_ != nullptr)
      columns_->set_warm(warm);
  }

private:
  AxesSolve solve_;
  std::size_t entries_;
  std::unique_ptr<compliance::ForwardBlocks> blocks_;
  std::unique_ptr<CorrectedColumns> columns_;
};

} // namespace

CutStiffness::CutStiffness(std::shared_ptr<const model::Model> first,
                           std::shared_ptr<const compliance::ComplianceSource> source,
                           const Context& context)
    : first_(std::move(first)), now_(first_), source_(std::move(source)), context_(context),
      first_origin_(identity(first_->nodes.size())), first_place_(first_origin_) {
  context_.progress = nullptr;
}

/// Checks the condition of K in three steps. A small pivot is the first sign. The column of C for
/// its axis then shows how far the free part moves. If that is far, the norm of C is estimated.
/// \throw SingularStiffness if the condition is too large
void CutStiffness::require_condition() {
  const linalg::FrontalFactor& factor = factor_->factor();
  const double weakest = factor.weakest_pivot(), norm = factor_->norm();
  if (weakest > weak_pivot || weakest > 0.5 * accepted_pivot_)
    return;
  const std::size_t axes = factor.axes();
  std::vector<double> column(axes);
  column[factor.weakest_axis()] = 1;
  factor.solve(column);
  double size = 0;
  for (const double value : column)
    size += std::abs(value);
  if (!(norm * size < linalg::max_condition / column_margin)) {
    size = linalg::inverse_norm(axes, [&](std::span<const double> x, std::span<double> y) {
      std::copy(x.begin(), x.end(), y.begin());
      factor.solve(y);
    });
    if (!(norm * size < linalg::max_condition / estimate_margin))
      tell_what_moves(*now_, context_);
  }
  accepted_pivot_ = weakest;
}

/// The factor of now, or none. \throw SingularStiffness naming what moves, and what the work throws
void CutStiffness::factorise(const std::function<std::shared_ptr<const FollowedFactor>()>& work) {
  try {
    factor_ = work();
    require_condition();
  } catch (const linalg::NotPositiveDefinite&) {
    factor_.reset();
    tell_what_moves(*now_, context_);
    throw linalg::SingularStiffness(nearly_singular);
  } catch (...) {
    factor_.reset();
    throw;
  }
}

void CutStiffness::prepare() {
  if (factor_ != nullptr)
    return;
  factorise([&] { return std::make_shared<const FollowedFactor>(now_, context_); });
  woodbury_.reset();
  origin_ = place_ = identity(now_->nodes.size());
  fresh_operations_ = factor_->work().all_operations;
}

bool CutStiffness::woodbury_pays(std::size_t rank) const {
  return columns::costs::woodbury_pays({.nodes = now_->nodes.size(),
                                        .rank = rank,
                                        .entries = factor_->entries(),
                                        .all_operations = factor_->work().all_operations,
                                        .reached = reached_});
}

CutWork CutStiffness::cut(std::shared_ptr<const model::Model> next,
                          std::span<const std::uint32_t> origin,
                          std::span<const std::uint32_t> place, std::optional<CutWay> way) {
  CutWork work;
  work.unprepared = factor_ == nullptr;
  prepare(); // whether it was announced or not, the same way is gone
  follow(first_origin_, first_place_, origin, place);
  now_ = std::move(next);
  if (way != CutWay::fresh) {
    follow(origin_, place_, origin, place);
    const bool some_gone =
        std::find(place_.begin(), place_.end(), cutting::CutModel::gone) != place_.end();
    work.rank = 3 * copies(origin_, place_);
    std::optional<StiffnessChange> change;
    const bool is_solid = !now_->tetrahedra.empty();
    if (!some_gone && !is_solid && (way ? way == CutWay::woodbury : woodbury_pays(work.rank))) {
      change = stiffness_change(factor_->model(), *now_, origin_, place_);
      work.rank = change->rank();
    }
    if (change && (way || woodbury_pays(work.rank))) {
      try {
        const std::shared_ptr<const FollowedFactor> factor = factor_;
        auto woodbury = std::make_shared<const WoodburySolver>(
            std::move(*change),
            [factor](std::span<double> f, std::size_t columns) {
              factor->factor().solve(f, columns);
            },
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
    if (!columns::costs::order_is_worn_out(factor_->work().all_operations, fresh_operations_)) {
      factorise([&, before = factor_] { return before->follow(now_, origin_, place_, context_); });
      work.factor = factor_->work();
      work.way = CutWay::refactor;
      reached_ = work.factor.operations;
      origin_ = place_ = identity(now_->nodes.size());
      return work;
    }
  }
  factor_.reset();
  prepare();
  work.factor = factor_->work();
  return work;
}

/// Solves for the model of now.
AxesSolve CutStiffness::solver() const {
  return [factor = factor_, woodbury = woodbury_](std::span<double> f, std::size_t columns) {
    if (woodbury != nullptr)
      woodbury->solve(f, columns);
    else
      factor->factor().solve(f, columns);
  };
}

std::shared_ptr<compliance::ComplianceSource> CutStiffness::compliance() const {
  AxesSolve solve = solver();
  std::size_t entries = factor_->entries();
  std::unique_ptr<compliance::ForwardBlocks> blocks;
  if (woodbury_ == nullptr)
    blocks = std::make_unique<compliance::ForwardBlocks>(
        [factor = factor_]() -> linalg::FrontalFactor& { return factor->factor(); });
  else
    entries += woodbury_->change().rank() * factor_->axes();
  std::unique_ptr<CorrectedColumns> columns;
  if (now_->tetrahedra.empty() && source_ != nullptr && source_->columns() != nullptr)
    columns = std::make_unique<CorrectedColumns>(
        std::shared_ptr<const columns::ColumnSource>(source_, source_->columns()),
        stiffness_change(*first_, *now_, first_origin_, first_place_), solve, context_, AxesSolve{},
        entries);
  return std::make_shared<CutSource>(std::move(solve), entries, std::move(blocks),
                                     std::move(columns));
}

} // namespace gewebe::update
