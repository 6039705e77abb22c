#include "solid/motion_quick_internal.h"

#include "solid/assembly.h"

#include <algorithm>
#include <cmath>

namespace gewebe {

void add_masses(const MotionBody& body, double h, StiffnessMatrix& matrix) {
  for (std::size_t c = 0; c < matrix.order(); ++c) {
    const std::size_t node = static_cast<std::size_t>(matrix.axis_of_row[c]) / 3;
    matrix.value[static_cast<std::size_t>(matrix.column_start[c])] +=
        body.masses[node] * body.inertia(node, h);
  }
}

int MotionQuick::prepare(const MotionBody& body, const MotionSprings& springs,
                         const std::vector<std::uint8_t>& held, double h,
                         const SolidMotionOptions& options, const Context& context) {
  if (factor_ && step_ == h && held_ == held)
    return 0;
  const double scale = 1 + options.damping / h;
  const bool same_pattern = factor_ && held_ == held;
  if (!same_pattern)
    stiffness_ = solid_stiffness(body.mesh, body.elements, held, context);
  StiffnessMatrix a = stiffness_;
  for (double& value : a.value)
    value *= scale;
  if (!springs.empty())
    a = springs.with_bound(a, 1 / h);
  add_masses(body, h, a);
  if (same_pattern)
    factor_->refactor(a, context);
  else
    factor_.emplace(a, context);
  single_.emplace(*factor_);
  step_ = h;
  held_ = held;
  forget();
  still_.resize(body.nodes());
  for (std::size_t i = 0; i < body.nodes(); ++i)
    still_[i] = body.in_elements[i] == 0 || held[3 * i] != 0 || held[3 * i + 1] != 0 ||
                held[3 * i + 2] != 0;
  all_still_ = std::ranges::all_of(still_, [](std::uint8_t still) { return still != 0; });
  return 1;
}

void MotionQuick::turn(SolidEnergy& energy, const Context& context) {
  if (all_still_)
    return;
  rotations_.resize(3 * held_.size());
  energy.node_rotations(rotations_, context);
  for (std::size_t i = 0; i < still_.size(); ++i)
    if (still_[i] != 0)
      for (std::size_t k = 0; k < 9; ++k)
        rotations_[9 * i + k] = k % 4 == 0 ? 1 : 0;
}

void MotionQuick::forget() {
  secants_.clear();
  rate_ = 1;
}

void MotionQuick::into_frames(Numbers& v, const Context& context) const {
  if (all_still_)
    return;
  parallel_blocks(context, v.size(), axes_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; at += 3) {
      const double* const r = rotations_.data() + 3 * at;
      const double x = v[at], y = v[at + 1], z = v[at + 2];
      for (std::size_t k = 0; k < 3; ++k)
        v[at + k] = r[k] * x + r[3 + k] * y + r[6 + k] * z;
    }
  });
}

void MotionQuick::out_of_frames(Numbers& v, const Context& context) const {
  if (all_still_)
    return;
  parallel_blocks(context, v.size(), axes_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; at += 3) {
      const double* const r = rotations_.data() + 3 * at;
      const double x = v[at], y = v[at + 1], z = v[at + 2];
      for (std::size_t k = 0; k < 3; ++k)
        v[at + k] = r[3 * k] * x + r[3 * k + 1] * y + r[3 * k + 2] * z;
    }
  });
}

void MotionQuick::fill(MotionVolumes& volumes, const Context& context) {
  filled_ = nullptr;
  if (volumes.empty())
    return;
  volumes.linearise([&](Numbers& v) { solve_constant(v, context); });
  filled_ = &volumes;
}

void MotionQuick::solve(Numbers& v, const Context& context) {
  solve_constant(v, context);
  if (filled_ != nullptr)
    filled_->correct(v);
}

void MotionQuick::solve_constant(Numbers& v, const Context& context) {
  const std::size_t order = stiffness_.order();
  rows_.resize(order);
  double scale = 0; // whatever the numbers are, single precision holds them
  for (std::size_t k = 0; k < order; ++k) {
    rows_[k] = v[static_cast<std::size_t>(stiffness_.axis_of_row[k])];
    scale = std::max(scale, std::abs(rows_[k]));
  }
  if (!(scale > 0 && std::isfinite(scale)))
    return;
  for (double& value : rows_)
    value /= scale;
  single_->solve(rows_, context);
  std::ranges::fill(v, 0.0);
  for (std::size_t k = 0; k < order; ++k)
    v[static_cast<std::size_t>(stiffness_.axis_of_row[k])] = scale * rows_[k];
}

} // namespace gewebe
