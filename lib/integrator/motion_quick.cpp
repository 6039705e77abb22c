#include "integrator/motion_quick_internal.h"

#include "base/unique_number.h"
#include "fem/assembly.h"
#include "linalg/condition.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::integrator {

namespace {

/// Whether every node is held along all its axes or none.
bool held_by_nodes(const std::vector<std::uint8_t>& held) {
  for (std::size_t axis = 0; axis < held.size(); axis += 3)
    if (held[axis] != held[axis + 1] || held[axis] != held[axis + 2])
      return false;
  return true;
}

/// Zeros on the diagonal of the free nodes' first axes.
linalg::StiffnessMatrix no_stiffness(const std::vector<std::uint8_t>& held) {
  linalg::StiffnessMatrix matrix;
  matrix.row_of_axis.assign(held.size(), -1);
  matrix.column_start.push_back(0);
  for (std::size_t axis = 0; axis < held.size(); axis += 3) {
    if (held[axis] != 0)
      continue;
    const auto row = static_cast<std::int64_t>(matrix.order());
    matrix.row_of_axis[axis] = row;
    matrix.axis_of_row.push_back(static_cast<std::int64_t>(axis));
    matrix.row.push_back(row);
    matrix.column_start.push_back(row + 1);
  }
  matrix.value.resize(matrix.order());
  return matrix;
}

} // namespace

void add_masses(const MotionBody& body, double h, linalg::StiffnessMatrix& matrix) {
  for (std::size_t c = 0; c < matrix.order(); ++c) {
    const std::size_t node = static_cast<std::size_t>(matrix.axis_of_row[c]) / 3;
    matrix.value[static_cast<std::size_t>(matrix.column_start[c])] +=
        body.masses[node] * body.inertia(node, h);
  }
}

int MotionQuick::prepare(const MotionBody& body, const MotionSprings& springs,
                         const std::vector<std::uint8_t>& held, double h,
                         const SolidMotionOptions& options, const Context& context) {
  if (factor_ && step_ == h && *held_ == held)
    return 0;
  const double scale = 1 + options.damping / h;
  const bool same_pattern = factor_ && *held_ == held;
  if (!same_pattern) {
    // Springs are bounded along every axis alike: of a net alone one matrix serves all three.
    alike_ = body.mesh.tetrahedra.empty() && held_by_nodes(held);
    stiffness_ =
        alike_ ? no_stiffness(held) : fem::solid_stiffness(body.mesh, body.elements, held, context);
  }
  stiffness_is_bound_ = body.mesh.tetrahedra.empty() && !springs.empty();
  linalg::StiffnessMatrix a = stiffness_;
  for (double& value : a.value)
    value *= scale;
  if (!springs.empty())
    a = springs.with_bound(a, 1 / h);
  add_masses(body, h, a);
  step_ = 0; // of no use if this throws
  if (same_pattern)
    factor_->refactor(a, context);
  else
    factor_.emplace(a, context);
  single_.emplace(*factor_);
  version_ = unique_number();
  step_ = h;
  if (*held_ != held)
    held_.replace() = held;
  tangent_.taken = false;
  forget();
  still_.resize(body.nodes());
  for (std::size_t i = 0; i < body.nodes(); ++i)
    still_[i] = body.in_elements[i] == 0 || held[3 * i] != 0 || held[3 * i + 1] != 0 ||
                held[3 * i + 2] != 0;
  all_still_ = std::ranges::all_of(still_, [](std::uint8_t still) { return still != 0; });
  return 1;
}

void MotionQuick::take_tangent(const MotionBody& body, const MotionSprings& springs,
                               const Numbers& at, const Context& context) {
  if (!(tangent_.factor && tangent_.held == *held_))
    tangent_.axes = fem::solid_stiffness(body.mesh, body.elements, *held_, context);
  linalg::StiffnessMatrix a = springs.with_tangent(tangent_.axes, at, 1 / step_);
  add_masses(body, step_, a);
  drop_tangent();
  tangent_.version = 0; // should it fail
  tangent_.matrix = std::make_shared<const linalg::StiffnessMatrix>(std::move(a));
  factorise_tangent(context);
  tangent_.taken = true;
  tangent_.version = version_ = unique_number();
  forget();
}

void MotionQuick::factorise_tangent(const Context& context) {
  if (tangent_.factor && tangent_.held == *held_)
    tangent_.factor->refactor(*tangent_.matrix, context);
  else
    tangent_.factor.emplace(*tangent_.matrix, context);
  tangent_.single.emplace(*tangent_.factor);
  tangent_.held = *held_;
}

MotionQuick::Past MotionQuick::past() const {
  return {.step = step_,
          .held = held_,
          .tangent = tangent_.taken ? tangent_.matrix : nullptr,
          .tangent_version = tangent_.version,
          .secants = secants_,
          .rate = rate_};
}

void MotionQuick::restore(const Past& past, const MotionBody& body, const MotionSprings& springs,
                          const SolidMotionOptions& options, const Context& context) {
  drop_tangent();
  if (past.step > 0)
    (void)prepare(body, springs, *past.held, past.step, options, context);
  else
    step_ = 0;
  if (past.tangent) {
    if (!(tangent_.factor && tangent_.held == *held_))
      tangent_.axes = fem::solid_stiffness(body.mesh, body.elements, *held_, context);
    const bool same = past.tangent_version == tangent_.version && tangent_.held == *held_;
    tangent_.version = 0; // should it fail
    tangent_.matrix = past.tangent;
    if (!same)
      factorise_tangent(context);
    tangent_.taken = true;
    tangent_.version = version_ = past.tangent_version;
  }
  secants_ = past.secants;
  rate_ = past.rate;
}

void MotionQuick::drop_tangent() noexcept {
  if (!std::exchange(tangent_.taken, false))
    return;
  version_ = unique_number();
  forget();
}

void MotionQuick::turn(SolidEnergy& energy, const Context& context) {
  if (all_still_)
    return;
  rotations_.resize(3 * held_->size());
  energy.node_rotations(rotations_, context);
  for (std::size_t i = 0; i < still_.size(); ++i)
    if (still_[i] != 0)
      for (std::size_t k = 0; k < 9; ++k)
        rotations_[9 * i + k] = k % 4 == 0 ? 1 : 0;
}

std::array<double, 9> MotionQuick::frame_of(std::size_t node) const {
  std::array<double, 9> frame{1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (!all_still_)
    std::copy_n(rotations_.begin() + static_cast<std::ptrdiff_t>(9 * node), 9, frame.begin());
  return frame;
}

double MotionQuick::rounds_of_tangent(const MotionBody& body) const {
  // Nanoseconds on two cores.
  constexpr double of_product = 0.05, of_entry = 0.25;
  const bool quadratic = !body.mesh.middles.empty();
  const double of_element = quadratic ? 5e3 : 2e2, of_element_tangent = quadratic ? 4e4 : 2e3;
  double products = 0;
  for (const std::int64_t rows : factor_->view().column_count)
    products += static_cast<double>(rows) * static_cast<double>(rows);
  const auto elements = static_cast<double>(body.elements.size());
  return (of_product * products + of_element_tangent * elements) /
         (of_entry * static_cast<double>(factor_->entries()) + of_element * elements);
}

void MotionQuick::solve_at_rest(Numbers& v) const {
  const Numbers f = v;
  linalg::solve_axes(stiffness_, *factor_, f, v);
}

double MotionQuick::condition() const {
  // Of K, whose columns are those of its lower triangle mirrored.
  std::vector<double> sums(stiffness_.order());
  for (std::size_t c = 0; c < stiffness_.order(); ++c)
    for (auto at = static_cast<std::size_t>(stiffness_.column_start[c]);
         at < static_cast<std::size_t>(stiffness_.column_start[c + 1]); ++at) {
      const auto r = static_cast<std::size_t>(stiffness_.row[at]);
      sums[c] += std::abs(stiffness_.value[at]);
      if (r != c)
        sums[r] += std::abs(stiffness_.value[at]);
    }
  double norm = 0;
  for (const double sum : sums)
    norm = std::max(norm, sum);
  return norm * linalg::inverse_norm(*factor_);
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
  version_ = unique_number();
}

void MotionQuick::unit_responses(std::span<const std::size_t> axes,
                                 std::span<double> columns) const {
  const std::size_t size = held_->size();
  if (tangent_.taken) {
    linalg::solve_unit_axes(tangent_.axes, *tangent_.factor, axes, columns);
  } else if (alike_) {
    std::vector<std::size_t> first(axes.begin(), axes.end()); // of their nodes
    for (std::size_t& axis : first)
      axis -= axis % 3;
    linalg::solve_unit_axes(stiffness_, *factor_, first, columns);
    for (std::size_t c = 0; c < axes.size(); ++c)
      for (std::size_t axis = 0; axis < size && axes[c] % 3 != 0; axis += 3)
        std::swap(columns[c * size + axis], columns[c * size + axis + axes[c] % 3]);
  } else {
    linalg::solve_unit_axes(stiffness_, *factor_, axes, columns);
  }
  if (filled_ == nullptr)
    return;
  Numbers column;
  for (std::size_t c = 0; c < axes.size(); ++c) {
    const std::span<double> at = columns.subspan(c * size, size);
    column.assign(at.begin(), at.end());
    filled_->correct(column);
    std::ranges::copy(column, at.begin());
  }
}

void MotionQuick::solve(Numbers& v, const Context& context) {
  solve_constant(v, context);
  if (filled_ != nullptr)
    filled_->correct(v);
}

void MotionQuick::solve_constant(Numbers& v, const Context& context) {
  const linalg::StiffnessMatrix& axes = tangent_.taken ? tangent_.axes : stiffness_;
  linalg::SingleFactor& factor = tangent_.taken ? *tangent_.single : *single_;
  const std::size_t alike = alike_ && !tangent_.taken ? 3 : 1;
  double scale = 0; // whatever the numbers are, single precision holds them
  for (const std::int64_t at : axes.axis_of_row)
    for (std::size_t a = 0; a < alike; ++a)
      scale = std::max(scale, std::abs(v[static_cast<std::size_t>(at) + a]));
  if (!(scale > 0 && std::isfinite(scale)))
    return;
  const std::size_t order = axes.order();
  rows_.resize(order);
  solved_.assign(v.size(), 0);
  for (std::size_t a = 0; a < alike; ++a) {
    for (std::size_t k = 0; k < order; ++k)
      rows_[k] = v[static_cast<std::size_t>(axes.axis_of_row[k]) + a] / scale;
    factor.solve(rows_, context);
    for (std::size_t k = 0; k < order; ++k)
      solved_[static_cast<std::size_t>(axes.axis_of_row[k]) + a] = scale * rows_[k];
  }
  v.swap(solved_);
}

} // namespace gewebe::integrator
