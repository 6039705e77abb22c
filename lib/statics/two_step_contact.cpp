#include "statics/two_step_contact.h"

#include "base/error.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <limits>

namespace gewebe {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double met = 1e-13, nearly_met = 1e-9; ///< of the threshold
constexpr int parts_of_s = 16;                   ///< as TwoStepContact

} // namespace

DelassusOperator TwoStepYielding::delassus_operator(std::span<const std::uint32_t> nodes) {
  const auto [first, both] = stages_();
  if (!std::equal(nodes.begin(), nodes.end(), nodes_.begin(), nodes_.end())) {
    nodes_.assign(nodes.begin(), nodes.end());
    one_ = {};
    s_ = 1;
  }
  if (s_ == 1)
    return first.delassus_operator(load_, nodes);
  if (one_.nodes.empty()) {
    std::vector<std::uint32_t> all = nodes_;
    for (const auto& entry : load_.displacement)
      all.push_back(entry.first);
    std::sort(all.begin(), all.end());
    one_ = first.delassus_operator(outer_, all);
    two_ = both.second_delassus_operator(outer_, all);
    rows_.clear();
    held_.clear();
    for (std::size_t row = 0; row < 3 * all.size(); ++row)
      if (!load_.displacement.contains(all[row / 3]))
        rows_.push_back(row);
      else if (!is_fixed(model_, all[row / 3], static_cast<int>(row % 3)))
        held_.push_back(row);
  }
  return combined();
}

/// Both stages at s, what is displaced held.
DelassusOperator TwoStepYielding::combined() {
  const bool series = stages_().second.options().series;
  const double a = series ? s_ : 1, b = series ? 1 - s_ : s_ - 1;
  const auto all = static_cast<Index>(one_.free.size());
  const auto sum = [&](const std::vector<double>& x, const std::vector<double>& y, Index columns) {
    return MatrixXd(a * Eigen::Map<const MatrixXd>(x.data(), all, columns) +
                    b * Eigen::Map<const MatrixXd>(y.data(), all, columns));
  };
  const MatrixXd c = sum(one_.compliance, two_.compliance, all);
  const VectorXd v = sum(one_.free, two_.free, 1);
  MatrixXd w = c(rows_, rows_);
  VectorXd free = v(rows_);
  if (!held_.empty()) {
    VectorXd d(static_cast<Index>(held_.size()));
    for (std::size_t k = 0; k < held_.size(); ++k)
      d[static_cast<Index>(k)] =
          load_.displacement.at(one_.nodes[held_[k] / 3])[static_cast<int>(held_[k] % 3)];
    const Eigen::LLT<MatrixXd> llt(MatrixXd(c(held_, held_)));
    if (llt.info() != Eigen::Success)
      throw Error("the two stages' compliances of the displaced nodes are not positive definite, "
                  "expected fewer of them");
    const MatrixXd across = c(held_, rows_);
    const VectorXd of_free = llt.solve(d - v(held_));
    const MatrixXd of_touch = llt.solve(across);
    free += across.transpose() * of_free;
    w -= across.transpose() * of_touch;
    of_free_.assign(of_free.data(), of_free.data() + of_free.size());
    of_touch_.assign(of_touch.data(), of_touch.data() + of_touch.size());
    w = (0.5 * (w + w.transpose())).eval();
  }
  DelassusOperator delassus;
  delassus.nodes = nodes_;
  delassus.compliance.assign(w.data(), w.data() + w.size());
  delassus.free.assign(free.data(), free.data() + free.size());
  return delassus;
}

/// What holds the displaced nodes, at s.
std::vector<NodeVector> TwoStepYielding::held_forces(std::span<const NodeTouch> touches) {
  std::vector<NodeVector> forces;
  for (const auto& entry : load_.displacement)
    forces.push_back({entry.first, {}});
  if (held_.empty())
    return forces;
  VectorXd f = VectorXd::Zero(static_cast<Index>(rows_.size()));
  for (const NodeTouch& t : touches) {
    const auto found = std::lower_bound(nodes_.begin(), nodes_.end(), t.node);
    if (found == nodes_.end() || *found != t.node)
      continue; // it gives no way
    const auto k = found - nodes_.begin();
    for (int a = 0; a < 3; ++a)
      f[3 * k + a] += t.force[a];
  }
  const auto size = static_cast<Index>(held_.size());
  const VectorXd held = Eigen::Map<const VectorXd>(of_free_.data(), size) -
                        Eigen::Map<const MatrixXd>(of_touch_.data(), size, f.size()) * f;
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const std::uint32_t node = one_.nodes[held_[k] / 3];
    const auto at =
        std::lower_bound(forces.begin(), forces.end(), node,
                         [](const NodeVector& v, std::uint32_t wanted) { return v.node < wanted; });
    at->value[static_cast<int>(held_[k] % 3)] = held[static_cast<Index>(k)];
  }
  // The support of a displaced node carries what touches it.
  for (const NodeTouch& t : touches) {
    const auto at =
        std::lower_bound(forces.begin(), forces.end(), t.node,
                         [](const NodeVector& v, std::uint32_t wanted) { return v.node < wanted; });
    if (at == forces.end() || at->node != t.node)
      continue;
    for (int a = 0; a < 3; ++a)
      if (!is_fixed(model_, t.node, a))
        at->value[a] -= t.force[a];
  }
  return forces;
}

/// From s |f| - f0 at s to another s. \return false: there is none
bool TwoStepYielding::next(double value) {
  const double last = s_;
  if (value > 0) {
    high_ = last;
    high_value_ = value;
  } else {
    scanning_ = false;
    low_ = last;
    low_value_ = value;
  }
  if (scanning_) {
    s_ = (std::ceil(high_ * parts_of_s) - 1) / parts_of_s;
    if (s_ > 0)
      return true;
    scanning_ = false;
    low_ = 0;
    low_value_ = -stages_().second.threshold();
  }
  if (!(high_ - low_ > 2 * std::numeric_limits<double>::epsilon() * high_))
    return false;
  // The chord, unless it stays at one end.
  const double chord = high_ - high_value_ * (high_ - low_) / (high_value_ - low_value_);
  const double middle = low_ + (high_ - low_) / 2;
  s_ = ++rounds_ % 3 != 0 && chord > low_ && chord < high_ ? chord : middle;
  return s_ > low_ && s_ < high_;
}

bool TwoStepYielding::push(std::span<const NodeTouch> touches, std::span<const Vec3> at) {
  const auto [first, both] = stages_();
  if (at.empty()) {
    both.update(first, load_);
    return true;
  }
  Load pushed = load_;
  for (const NodeTouch& t : touches)
    pushed.force[t.node] += t.force;
  std::vector<NodeVector> held;
  if (s_ == 1) {
    scanning_ = true;
    rounds_ = 0;
    high_value_ = 0;
    if (!load_.displacement.empty())
      first.update(pushed);
    held = load_.displacement.empty() ? std::vector<NodeVector>{} : first.contact_forces();
  } else {
    held = held_forces(touches);
  }
  Load total = pushed;
  total.displacement.clear();
  for (const NodeVector& f : held)
    total.force[f.node] += f.value;
  const double norm = load_norm(model_, total), threshold = both.threshold();
  const double value = s_ * norm - threshold;
  const double here = s_;
  const bool agreed = s_ == 1 ? !(value > 0) : std::abs(value) <= met * threshold;
  if (!agreed && next(value))
    return false;
  solved_ = solved_ && (agreed || std::abs(value) <= nearly_met * threshold);
  s_ = here;
  both.settle(std::move(pushed), {std::move(total), std::move(held), s_, norm});
  s_ = 1; // should nodes join
  one_ = {};
  return true;
}

std::span<const double> TwoStepYielding::shape() {
  const auto [first, both] = stages_();
  return both.surface_displacement(first);
}

} // namespace gewebe
