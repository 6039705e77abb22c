#include "update/followed_factor.h"

#include "base/unique_number.h"
#include "linalg/stiffness.h"
#include "numeric/larger.h"
#include "update/node_stiffness.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe::update {

namespace {

/// A bound of ‖K‖₁. Cuts leave no spring stiffer than it was.
double stiffness_bound(const model::Model& model) {
  std::vector<double> sum(model.nodes.size());
  double max = 0;
  for (const model::Spring& s : model.springs) {
    const linalg::SymmetricBlock b = linalg::stiffness_block(model, s);
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

bool is_solid(const model::Model& model) {
  return !model.tetrahedra.empty();
}

bool stays(std::span<const std::uint32_t> place) {
  for (std::uint32_t i = 0; i < place.size(); ++i)
    if (place[i] != i)
      return false;
  return true;
}

} // namespace

/// The numbers, those of the factor that was read last.
struct FollowedFactor::Place {
  std::mutex mutex;
  std::uint64_t number = 0; ///< of that factor; 0: none
  std::optional<linalg::FrontalFactor> factor;
  linalg::NodeMatrix matrix;    ///< of a solid
  std::vector<double> row_norm; ///< of its nodes

  /// Writes K of a solid. \param rows  that differ; empty: all of them \return ‖K‖₁
  double assemble(const model::Model& model, const std::vector<std::uint32_t>* rows) {
    if (rows != nullptr)
      update_node_stiffness(matrix, model, *rows);
    else
      matrix = node_stiffness(model);
    row_norm.resize(matrix.nodes());
    if (rows != nullptr)
      for (const std::uint32_t row : *rows)
        row_norm[row] = gewebe::update::row_norm(matrix, row);
    else
      for (std::uint32_t row = 0; row < matrix.nodes(); ++row)
        row_norm[row] = gewebe::update::row_norm(matrix, row);
    double norm = 0;
    for (const double of_row : row_norm)
      norm = numeric::larger(norm, of_row);
    return norm;
  }
};

void FollowedFactor::note() {
  tree_ = at_->factor->tree();
  work_ = at_->factor->work();
  entries_ = at_->factor->entries();
  number_ = at_->number = unique_number();
}

FollowedFactor::FollowedFactor(std::shared_ptr<const model::Model> model, const Context& context)
    : at_(std::make_shared<Place>()), model_(std::move(model)), context_(context) {
  if (is_solid(*model_)) {
    norm_ = at_->assemble(*model_, nullptr);
    at_->factor.emplace(at_->matrix, context_);
  } else {
    norm_ = stiffness_bound(*model_);
    at_->factor.emplace(*model_, context_);
  }
  note();
}

linalg::FrontalFactor& FollowedFactor::factor() const {
  const std::lock_guard lock(at_->mutex);
  if (at_->number == number_)
    return *at_->factor;
  at_->number = 0;
  if (is_solid(*model_)) {
    (void)at_->assemble(*model_, nullptr);
    at_->factor.emplace(at_->matrix, tree_, context_);
  } else {
    at_->factor.emplace(*model_, tree_, context_);
  }
  at_->number = number_;
  return *at_->factor;
}

std::shared_ptr<const FollowedFactor>
FollowedFactor::follow(std::shared_ptr<const model::Model> next,
                       std::span<const std::uint32_t> origin, std::span<const std::uint32_t> place,
                       const Context& context) const {
  linalg::FrontalFactor& factor = this->factor();
  std::shared_ptr<FollowedFactor> now(new FollowedFactor());
  now->at_ = at_;
  now->model_ = std::move(next);
  now->context_ = context;
  now->norm_ = norm_;
  at_->number = 0; // should it fail
  if (is_solid(*now->model_)) {
    const std::vector<std::uint32_t> rows = changed_rows(*model_, *now->model_, place);
    now->norm_ = at_->assemble(*now->model_, stays(place) ? &rows : nullptr);
    (void)factor.refactor(at_->matrix, origin, place, rows, context);
  } else {
    (void)factor.refactor(*now->model_, origin, place, context);
  }
  now->note();
  return now;
}

} // namespace gewebe::update
