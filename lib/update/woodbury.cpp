#include "update/woodbury.h"

#include "base/error.h"
#include "base/parallel.h"
#include "columns/column_sum.h"

#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

// Based on: Hager, Updating the Inverse of a Matrix, 1989.

namespace gewebe::update {

namespace {

/// Beyond this condition of the capacitance matrix nothing that it gives is meant.
constexpr double max_capacitance_condition = 1e13;

Eigen::Index index(std::size_t k) {
  return static_cast<Eigen::Index>(k);
}

} // namespace

struct WoodburySolver::State {
  StiffnessChange change;
  AxesSolve solve;
  Context context;
  std::vector<double> answers; ///< C Q, [rank][3 n]
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
  Eigen::VectorXd scale;
  double condition = 1;

  void prepare() {
    const std::size_t rank = change.rank(), axes = change.old_axes;
    require_memory(
        context, 16.0 * static_cast<double>(axes * rank) + 16.0 * static_cast<double>(rank * rank),
        "the responses to a cut");
    answers.assign(axes * rank, 0.0);
    parallel_blocks(context, rank, 24, [&](std::size_t begin, std::size_t end) {
      const auto some = std::span(answers).subspan(begin * axes, (end - begin) * axes);
      for (std::size_t k = begin; k < end; ++k)
        change.answer.add_to(k, 1, some.subspan((k - begin) * axes, axes));
      solve(some, end - begin);
    });
    if (rank == 0)
      return;
    Eigen::MatrixXd s(index(rank), index(rank));
    for (std::size_t c = 0; c < rank; ++c)
      for (std::size_t r = 0; r < rank; ++r)
        s(index(r), index(c)) = -change.answer.times(r, answer(c));
    for (std::size_t r = 0; r < change.springs; ++r)
      s(index(r), index(r)) -= 1 / change.weight[r];
    for (std::size_t r = 0; r < change.copy_block.count(); ++r)
      for (std::size_t k = change.copy_block.start[r]; k < change.copy_block.start[r + 1]; ++k)
        s(index(change.springs + r), index(change.springs + change.copy_block.axis[k])) +=
            change.copy_block.value[k];
    // Rows of springs have the unit mm/force, rows of copies force/mm. Rows and columns are scaled
    // by their terms before the responses are subtracted. A singular S is small against these.
    scale.resize(index(rank));
    for (std::size_t r = 0; r < rank; ++r) {
      const double own = std::abs(change.answer.times(r, answer(r)));
      double block = 0;
      if (r < change.springs)
        block = 1 / std::abs(change.weight[r]);
      else
        for (std::size_t k = change.copy_block.start[r - change.springs];
             k < change.copy_block.start[r - change.springs + 1]; ++k)
          if (change.copy_block.axis[k] == r - change.springs)
            block = std::abs(change.copy_block.value[k]);
      const double size = std::max(own, block);
      scale[index(r)] = size > 0 ? 1 / std::sqrt(size) : 1;
    }
    s = scale.asDiagonal() * s * scale.asDiagonal();
    if (!s.allFinite())
      throw Error("the capacitance matrix of the cut isn't finite");
    lu.compute(s);
    // Eigen calls any single number well conditioned; ours is small where it should be 0.
    condition = rank == 1 ? 1 / std::abs(s(0, 0)) : 1 / lu.rcond();
    if (!(condition <= max_capacitance_condition))
      throw Error("the cut leaves a part that nothing holds, expected one that is determined");
  }

  std::span<const double> answer(std::size_t k) const {
    return std::span<const double>(answers).subspan(k * change.old_axes, change.old_axes);
  }
};

WoodburySolver::WoodburySolver(StiffnessChange change, AxesSolve solve, const Context& context)
    : state_(std::make_unique<State>()) {
  if (std::find(change.place.begin(), change.place.end(), cutting::gone_node) != change.place.end())
    throw Error("nodes have left the model, expected a factor of what is left");
  state_->change = std::move(change);
  state_->solve = std::move(solve);
  state_->context = context;
  state_->context.progress = nullptr;
  state_->prepare();
}
WoodburySolver::~WoodburySolver() = default;
WoodburySolver::WoodburySolver(WoodburySolver&&) noexcept = default;
WoodburySolver& WoodburySolver::operator=(WoodburySolver&&) noexcept = default;

const StiffnessChange& WoodburySolver::change() const noexcept {
  return state_->change;
}
double WoodburySolver::condition() const noexcept {
  return state_->condition;
}

void WoodburySolver::solve(std::span<double> over_axes, std::size_t columns) const {
  const StiffnessChange& change = state_->change;
  const std::size_t rank = change.rank(), axes = change.old_axes, new_axes = change.new_axes;
  std::vector<double> moved(axes * columns, 0.0);
  Eigen::MatrixXd right(index(rank), index(columns));
  right.setZero();
  for (std::size_t c = 0; c < columns; ++c) {
    const double* const f = over_axes.data() + c * new_axes;
    double* const to = moved.data() + c * axes;
    for (std::size_t i = 0; i < change.origin.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a)
        to[3 * std::size_t{change.origin[i]} + a] += f[3 * i + a];
    for (std::size_t k = 0; k < change.copy_axis.size(); ++k)
      right(index(change.springs + k), index(c)) = f[change.copy_axis[k]];
  }
  state_->solve(moved, columns);
  if (rank > 0) {
    for (std::size_t c = 0; c < columns; ++c) {
      const auto u = std::span<const double>(moved).subspan(c * axes, axes);
      for (std::size_t r = 0; r < rank; ++r)
        right(index(r), index(c)) -= change.answer.times(r, u);
    }
    const Eigen::VectorXd& scale = state_->scale;
    right = scale.asDiagonal() * right;
    right = state_->lu.solve(right).eval();
    right = scale.asDiagonal() * right;
    right = -right;
    std::vector<const double*> response(rank);
    for (std::size_t r = 0; r < rank; ++r)
      response[r] = state_->answer(r).data();
    for (std::size_t c = 0; c < columns; ++c)
      columns::column_sum<double>(state_->context.cpu)(response.data(), right.col(index(c)).data(),
                                                       rank, moved.data() + c * axes, 0, axes);
    right = -right;
  }
  for (std::size_t c = 0; c < columns; ++c) {
    const auto to = over_axes.subspan(c * new_axes, new_axes);
    copy_displacements(change, std::span<const double>(moved).subspan(c * axes, axes), to);
    for (std::size_t k = 0; k < change.copy_axis.size(); ++k)
      to[change.copy_axis[k]] += right(index(change.springs + k), index(c));
  }
}

} // namespace gewebe::update
