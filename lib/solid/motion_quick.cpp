#include "solid/motion_quick_internal.h"

#include "solid/assembly.h"

#include <algorithm>
#include <cmath>

namespace gewebe {

void add_masses(const MotionBody& body, double inertia, StiffnessMatrix& matrix) {
  for (std::size_t c = 0; c < matrix.order(); ++c)
    matrix.value[static_cast<std::size_t>(matrix.column_start[c])] +=
        body.masses[static_cast<std::size_t>(matrix.axis_of_row[c]) / 3] * inertia;
}

int MotionQuick::prepare(const MotionBody& body, const std::vector<std::uint8_t>& held, double h,
                         const SolidMotionOptions& options, const Context& context) {
  if (factor_ && step_ == h && held_ == held)
    return 0;
  const double scale = 1 + options.damping / h, inertia = 1 / (h * h) + options.drag / h;
  const bool same_pattern = factor_ && held_ == held;
  if (!same_pattern)
    stiffness_ = solid_stiffness(body.mesh, body.elements, held, context);
  StiffnessMatrix a = stiffness_;
  for (double& value : a.value)
    value *= scale;
  add_masses(body, inertia, a);
  if (same_pattern)
    factor_->refactor(a, context);
  else
    factor_.emplace(a, context);
  single_.emplace(*factor_);
  step_ = h;
  held_ = held;
  return 1;
}

void MotionQuick::turn(SolidEnergy& energy, const Context& context) {
  rotations_.resize(3 * held_.size());
  energy.node_rotations(rotations_, context);
  for (std::size_t i = 0; i < held_.size() / 3; ++i)
    if (held_[3 * i] != 0 || held_[3 * i + 1] != 0 || held_[3 * i + 2] != 0)
      for (std::size_t k = 0; k < 9; ++k)
        rotations_[9 * i + k] = k % 4 == 0 ? 1 : 0;
}

void MotionQuick::solve(Numbers& v, const Context& context) {
  const std::size_t order = stiffness_.order();
  Numbers rows(order), turned(v.size());
  for (std::size_t i = 0; i < v.size() / 3; ++i) {
    const double *const r = rotations_.data() + 9 * i, *const from = v.data() + 3 * i;
    for (std::size_t k = 0; k < 3; ++k)
      turned[3 * i + k] = r[k] * from[0] + r[3 + k] * from[1] + r[6 + k] * from[2];
  }
  double scale = 0; // whatever the numbers are, single precision holds them
  for (std::size_t k = 0; k < order; ++k) {
    rows[k] = turned[static_cast<std::size_t>(stiffness_.axis_of_row[k])];
    scale = std::max(scale, std::abs(rows[k]));
  }
  if (!(scale > 0 && std::isfinite(scale)))
    return;
  for (double& value : rows)
    value /= scale;
  single_->solve(rows, context);
  std::ranges::fill(turned, 0.0);
  for (std::size_t k = 0; k < order; ++k)
    turned[static_cast<std::size_t>(stiffness_.axis_of_row[k])] = scale * rows[k];
  for (std::size_t i = 0; i < v.size() / 3; ++i) {
    const double *const r = rotations_.data() + 9 * i, *const from = turned.data() + 3 * i;
    for (std::size_t k = 0; k < 3; ++k)
      v[3 * i + k] = r[3 * k] * from[0] + r[3 * k + 1] * from[1] + r[3 * k + 2] * from[2];
  }
}

} // namespace gewebe
