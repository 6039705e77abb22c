#include "dynamics/implicit_euler.h"

#include <algorithm>
#include <cmath>

// Based on: Baraff, Witkin, Large Steps in Cloth Simulation, 1998.

namespace gewebe {

namespace {

constexpr int max_iterations = 200, max_parts = 10, max_refactors = 2;
constexpr double tolerance = 1e-10, size_tolerance = 1e-16;
constexpr double noise = 1e-12; // of the size: a change below it that does not shrink is rounding
constexpr double slow = 0.2;    // contraction above which the factor is made anew

SymmetricBlock block_of(const Model& model, const Spring& s, std::span<const NodeMotion> motion,
                        double h) {
  const Vec3 d = (model.nodes[s.j].position - model.nodes[s.i].position) +
                 (motion[s.j].displacement - motion[s.i].displacement);
  const double l = norm(d);
  if (!(l > 0))
    return {s.stiffness, 0, 0, s.stiffness, 0, s.stiffness};
  const Vec3 n = d / l;
  const double across = s.stiffness * std::max(0.0, 1 - s.rest / l);
  const double along = s.stiffness + s.damping / h - across;
  return {across + along * n.x * n.x, along * n.x * n.y, along * n.x * n.z,
          across + along * n.y * n.y, along * n.y * n.z, across + along * n.z * n.z};
}

} // namespace

ImplicitEuler::ImplicitEuler(const Model& model) : model_(model), network_(spring_network(model)) {
  Box3 box;
  for (const Node& node : model.nodes)
    box.add(node.position);
  size_ = box.longest_side();
}

ImplicitEuler::~ImplicitEuler() = default;

void ImplicitEuler::make_factor(std::span<const NodeMotion> motion, double h,
                                const Context& context) {
  std::vector<SymmetricBlock> blocks(model_.springs.size());
  for (std::size_t e = 0; e < blocks.size(); ++e)
    blocks[e] = block_of(model_, model_.springs[e], motion, h);
  std::vector<double> diagonal(model_.nodes.size());
  for (std::size_t i = 0; i < diagonal.size(); ++i)
    diagonal[i] = model_.nodes[i].mass / (h * h) + model_.nodes[i].drag / h;
  matrix_ = spring_matrix(model_, blocks, diagonal, held_);
  if (factor_)
    factor_->refactor(matrix_, context);
  else
    factor_ = std::make_unique<Factor>(matrix_, context);
  factor_step_ = h;
  ++factorisations_;
}

/// \return whether anything can move
bool ImplicitEuler::hold(std::span<const std::uint8_t> held) {
  if (!std::equal(held.begin(), held.end(), held_.begin(), held_.end())) {
    held_.assign(held.begin(), held.end());
    factor_.reset(); // another pattern
  }
  return std::find(held_.begin(), held_.end(), 0) != held_.end();
}

void ImplicitEuler::respond(std::span<double> over_axes, std::size_t columns) const {
  const std::size_t axes = 3 * model_.nodes.size(), order = matrix_.order();
  std::vector<double> f(order * columns), u(order * columns);
  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t r = 0; r < order; ++r)
      f[c * order + r] = over_axes[c * axes + static_cast<std::size_t>(matrix_.axis_of_row[r])];
  factor_->solve(f, u, columns);
  std::fill(over_axes.begin(), over_axes.end(), 0.0);
  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t r = 0; r < order; ++r)
      over_axes[c * axes + static_cast<std::size_t>(matrix_.axis_of_row[r])] = u[c * order + r];
}

bool ImplicitEuler::step(std::span<NodeMotion> motion, std::span<const Vec3> outer,
                         std::span<const std::uint8_t> held, double h, const Context& context,
                         std::uint32_t& worst) {
  const std::vector<NodeMotion> before(motion.begin(), motion.end());
  for (int part = 0, count = 1; part < max_parts; ++part, count *= 2) {
    bool solved = true;
    for (int k = 0; k < count && solved; ++k) {
      const std::vector<NodeMotion> from(motion.begin(), motion.end());
      solved = solve(from, motion, outer, held, h / count, false, context, worst);
    }
    if (solved)
      return true;
    std::copy(before.begin(), before.end(), motion.begin());
  }
  return false;
}

bool ImplicitEuler::solve(std::span<const NodeMotion> before, std::span<NodeMotion> motion,
                          std::span<const Vec3> outer, std::span<const std::uint8_t> held, double h,
                          bool guess, const Context& context, std::uint32_t& worst) {
  if (!hold(held))
    return true;
  const std::size_t n = model_.nodes.size();
  if (!factor_ || factor_step_ != h)
    make_factor(before, h, context);
  const auto is_held = [&](std::size_t i, std::size_t a) { return held_[3 * i + a] != 0; };
  const auto set = [&](std::span<const double> moved) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t a = 0; a < 3; ++a)
        if (!is_held(i, a)) {
          const int axis = static_cast<int>(a);
          motion[i].displacement[axis] = before[i].displacement[axis] + moved[3 * i + a];
          motion[i].velocity[axis] = moved[3 * i + a] / h;
        }
  };
  std::vector<double> residual(3 * n), change(3 * n), moved(3 * n), trial(3 * n);
  /// F + f - M (v' - v)/h of the present state; its square, each node's over its mass
  const auto measure = [&] {
    double square = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (is_held(i, 0) && is_held(i, 1) && is_held(i, 2)) {
        residual[3 * i] = residual[3 * i + 1] = residual[3 * i + 2] = 0;
        continue;
      }
      const double mass = model_.nodes[i].mass;
      const Vec3 r = spring_force(network_, motion, i) + outer[i] -
                     mass / h * (motion[i].velocity - before[i].velocity);
      for (std::size_t a = 0; a < 3; ++a) {
        residual[3 * i + a] = is_held(i, a) ? 0 : r[static_cast<int>(a)];
        square += residual[3 * i + a] * residual[3 * i + a] / mass;
      }
    }
    return square;
  };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t a = 0; a < 3; ++a)
      if (const int axis = static_cast<int>(a); !is_held(i, a))
        moved[3 * i + a] = guess ? motion[i].displacement[axis] - before[i].displacement[axis]
                                 : h * before[i].velocity[axis];
  set(moved);
  double square = measure(), last_change = HUGE_VAL;
  int refactored = 0;
  for (int k = 0; k < max_iterations; ++k) {
    solve_axes(matrix_, *factor_, residual, change);
    ++solves_;
    double scale = 1, largest_change = 0, largest = 0, next_square = HUGE_VAL;
    for (int halvings = 0; halvings < 12; ++halvings) {
      scale = std::ldexp(1.0, -halvings);
      for (std::size_t x = 0; x < trial.size(); ++x)
        trial[x] = moved[x] + scale * change[x];
      set(trial);
      next_square = measure();
      if (next_square <= square * 4) // it may grow a little on the way through a bend
        break;
    }
    for (std::size_t x = 0; x < trial.size(); ++x) {
      if (!(scale * std::abs(change[x]) <= largest_change)) {
        largest_change = scale * std::abs(change[x]);
        worst = static_cast<std::uint32_t>(x / 3);
      }
      largest = std::max(largest, std::abs(trial[x]));
    }
    moved.swap(trial);
    square = next_square;
    if (!std::isfinite(square))
      return false;
    if (largest_change <= std::max(tolerance * largest, size_tolerance * size_))
      return true;
    if (largest_change <= noise * size_ && largest_change >= last_change / 2)
      return true;
    // A matrix of this very state may not help further: what the max leaves out limits the rate.
    if (refactored < max_refactors && k > 0 && !(largest_change <= slow * last_change)) {
      make_factor(motion, h, context);
      ++refactored;
    }
    last_change = largest_change;
  }
  return false;
}

} // namespace gewebe
