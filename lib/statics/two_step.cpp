#include "statics/two_step.h"

#include "base/copy_on_write.h"
#include "base/error.h"
#include "geometry/vector_at.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

// Based on: H. Çakmak, U. Kühnapfel, G. Bretthauer, report FZKA 7190, 2006, section 3.3.3;
// M. Bro-Nielsen, Finite element modeling in surgery simulation, 1998.

namespace gewebe::statics {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;
using Matrix = Eigen::Map<const MatrixXd>;
using Vector = Eigen::Map<const VectorXd>;

constexpr double contact_tolerance = 1e-6; // as that of Elastostatic
constexpr double definite = 1e-12;         // least eigenvalue, of A1's
constexpr int parts_of_s = 16, max_rounds = 200;

Vector vector(std::span<const double> values) {
  return {values.data(), static_cast<Index>(values.size())};
}

double outer_force(const model::Model& model, const contact::Load& load, std::uint32_t node,
                   int axis) {
  const auto force = load.force.find(node);
  return (force == load.force.end() ? 0 : force->second[axis]) +
         model.nodes[node].mass * load.gravity[axis];
}

/// Norm of the load over the free axes; with those of displaced nodes if `displaced_too`.
double norm_of(const model::Model& model, const contact::Load& load, bool displaced_too) {
  double sum = 0;
  const auto add = [&](std::uint32_t node) {
    if (!displaced_too && load.displacement.contains(node))
      return;
    for (int a = 0; a < 3; ++a)
      if (!contact::is_fixed(model, node, a)) {
        const double f = outer_force(model, load, node, a);
        sum += f * f;
      }
  };
  if (load.gravity == Vec3{})
    for (const auto& [node, force] : load.force)
      add(node);
  else
    for (std::uint32_t node = 0; node < model.nodes.size(); ++node)
      add(node);
  return std::sqrt(sum);
}

} // namespace

double load_norm(const model::Model& model, const contact::Load& load) {
  return norm_of(model, load, true);
}

// ---- the contact axes

// With A1 = L Lᵀ and L⁻¹ A2 L⁻ᵀ = Q Θ Qᵀ every A1 - (1-s) B is L Q (1 - (1-s) Φ) Qᵀ Lᵀ, with Φ = Θ,
// or 1 - Θ in series: for W = L⁻ᵀ Q its inverse is W (1 - (1-s) Φ)⁻¹ Wᵀ.
struct TwoStepContact::State {
  bool series = false;
  MatrixXd first, second, w;
  VectorXd theta;

  VectorXd denominators(double s) const {
    return series ? VectorXd(s + (1 - s) * theta.array())
                  : VectorXd((1 - theta.array()) + s * theta.array());
  }
  VectorXd product(double s, const VectorXd& force) const { // (A1 - (1-s) B) f
    if (series)
      return s * (first * force) + (1 - s) * (second * force);
    return first * force - (1 - s) * (second * force);
  }
};

TwoStepContact::TwoStepContact(std::span<const double> first, std::span<const double> second,
                               std::size_t size, bool series)
    : state_(std::make_unique<State>()) {
  const auto n = static_cast<Index>(size);
  state_->series = series;
  state_->first = Matrix(first.data(), n, n);
  state_->second = Matrix(second.data(), n, n);
  const Eigen::LLT<MatrixXd> llt(state_->first);
  if (llt.info() != Eigen::Success)
    throw Error("the first stage's compliance of the displaced nodes is not positive definite, "
                "expected fewer nodes or a store with another model");
  MatrixXd h = llt.matrixL().solve(state_->second);
  h = llt.matrixL().solve(h.transpose().eval());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (h + h.transpose()));
  if (eigen.info() != Eigen::Success)
    throw Error("the two stages' compliances have no common eigenvectors, expected finite ones");
  state_->theta = eigen.eigenvalues();
  const double min = state_->theta[0], max = state_->theta[n - 1];
  if (!(min > 0))
    throw Error("the second stage's compliance of the displaced nodes is not positive definite, "
                "expected fewer nodes or a store with another model");
  if (!series && !(max < 1 - definite))
    throw Error("beyond the threshold no force gives these displacements, for the second stage is "
                "not stiffer than the first in every direction (C1 - C2 is not positive definite "
                "on the displaced nodes), expected a stiffer one or `series`");
  state_->w = llt.matrixU().solve(eigen.eigenvectors());
}
TwoStepContact::~TwoStepContact() = default;
TwoStepContact::TwoStepContact(TwoStepContact&&) noexcept = default;
TwoStepContact& TwoStepContact::operator=(TwoStepContact&&) noexcept = default;

std::size_t TwoStepContact::size() const noexcept {
  return static_cast<std::size_t>(state_->theta.size());
}

TwoStepContact::Answer TwoStepContact::solve(const Problem& problem) const {
  const State& state = *state_;
  const VectorXd start = vector(problem.wanted) - vector(problem.first);
  const VectorXd change = state.series ? VectorXd(vector(problem.first) - vector(problem.other))
                                       : vector(problem.other);
  const auto carried = vector(problem.carried);
  const VectorXd a = state.w.transpose() * start, b = state.w.transpose() * change;

  const auto force_at = [&](double s) {
    const VectorXd below = state.denominators(s);
    VectorXd force = state.w * ((a + (1 - s) * b).array() / below.array()).matrix();
    // What rounding in W has cost comes back by one residual.
    const VectorXd missing = start + (1 - s) * change - state.product(s, force);
    force += state.w * ((state.w.transpose() * missing).array() / below.array()).matrix();
    return force;
  };
  const auto size_of = [&](const VectorXd& force) {
    return std::hypot((carried + force).norm(), problem.outside);
  };
  struct Point {
    double value = 0, slope = 0; // of s |f| - f0
    VectorXd force;
  };
  const auto at = [&](double s) {
    Point p;
    p.force = force_at(s);
    const double size = size_of(p.force);
    p.value = s * size - problem.threshold;
    // d/ds of the force: M' = B, so that M f' = -(w + B f), with 1 - s falling as s grows.
    const VectorXd below = state.denominators(s);
    const auto phi = state.series ? VectorXd(1 - state.theta.array()) : state.theta;
    const VectorXd top = (a + (1 - s) * b).array() * phi.array() / below.array();
    const VectorXd turn = -(state.w * ((b + top).array() / below.array()).matrix());
    p.slope = size + s * (carried + p.force).dot(turn) / size;
    return p;
  };
  const auto answer = [&](double s, const VectorXd& force) {
    return Answer{s, {force.data(), force.data() + force.size()}};
  };

  double high = 1, low = 0;
  Point top = at(1);
  if (!(top.value > 0))
    return answer(1, top.force);
  for (int k = parts_of_s - 1; k > 0; --k) {
    const double s = static_cast<double>(k) / parts_of_s;
    Point p = at(s);
    if (p.value > 0) {
      high = s;
      top = std::move(p);
    } else {
      low = s;
      break;
    }
  }
  // Newton's steps from above; where one leaves the bracket, its middle. At s = 0 the value is -f0.
  double s = high;
  Point p = top;
  for (int round = 0; round < max_rounds; ++round) {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    if (std::abs(p.value) <= 2 * epsilon * problem.threshold || high - low <= epsilon * high)
      break;
    double next = s - p.value / p.slope;
    if (!(next > low && next < high))
      next = low + (high - low) / 2;
    if (next == s)
      break;
    s = next;
    p = at(s);
    (p.value > 0 ? high : low) = s;
  }
  return answer(problem.threshold / size_of(p.force), p.force);
}

// ---- an object

struct TwoStep::Past {
  /// The last load, its reactions, and its shapes once they were read.
  struct Last {
    TwoStepOptions options;
    CopyOnWrite<std::optional<contact::Load>> last{};
    CopyOnWrite<std::vector<contact::NodeVector>> forces{};
    double norm = 0, largest = 0;
    double s = 1;
    CopyOnWrite<contact::Load> total{}; // beyond the threshold: all forces, those of contact too

    /// That of `last`, where known.
    struct Shape {
      CopyOnWrite<std::vector<double>> u{};
      bool known = true;
    };
    Shape whole{}, surface{}, rough{}; // each is computed when it is read

    std::vector<std::uint32_t> nodes{}; // of contact
    std::vector<std::size_t> axes{};    // of them, those that are free: 3 k + a for nodes[k]
    std::shared_ptr<const TwoStepContact> contact{};
  };

  std::shared_ptr<const Elastostatic::Past> second;
  Last last;
};

struct TwoStep::State : Past::Last {
  const model::Model& model;
  Elastostatic second;
  double tolerance = 0;

  State(const model::Model& m, std::shared_ptr<compliance::ComplianceSource> source,
        const Context& context, double t)
      : model(m), second(m, std::move(source), context, {.tolerance = t}), tolerance(t) {
    whole.u.write().resize(3 * m.nodes.size());
    surface = rough = whole;
  }

  using Displacement = std::span<const double> (Elastostatic::*)();

  void forget_contact() {
    contact.reset();
    nodes.clear();
  }

  void prepare_contact(const DelassusOperator& one, const DelassusOperator& two) {
    if (contact && one.nodes == nodes)
      return;
    forget_contact();
    const std::size_t rows = one.free.size();
    axes.clear();
    for (std::size_t r = 0; r < rows; ++r)
      if (!contact::is_fixed(model, one.nodes[r / 3], static_cast<int>(r % 3)))
        axes.push_back(r);
    if (axes.empty())
      return;
    std::vector<double> block1, block2;
    for (const std::size_t j : axes)
      for (const std::size_t i : axes) {
        block1.push_back(one.compliance[j * rows + i]);
        block2.push_back(two.compliance[j * rows + i]);
      }
    contact = std::make_shared<const TwoStepContact>(block1, block2, axes.size(), options.series);
    nodes = one.nodes;
  }

  /// Whether displacements take a load beyond the threshold; if so it is found.
  bool beyond(Elastostatic& first, const contact::Load& load) {
    std::vector<std::uint32_t> now;
    for (const auto& [node, d] : load.displacement)
      now.push_back(node);
    contact::Load outer = load;
    outer.displacement.clear();
    const DelassusOperator one = first.delassus_operator(outer, now),
                           two = second.delassus_operator(outer, now);
    prepare_contact(one, two);
    if (!contact)
      return false;
    std::vector<double> d, v1, v2, carried;
    for (const std::size_t axis : axes) {
      const std::uint32_t node = now[axis / 3];
      const int a = static_cast<int>(axis % 3);
      d.push_back(load.displacement.at(node)[a]);
      v1.push_back(one.free[axis]);
      v2.push_back(two.free[axis]);
      carried.push_back(outer_force(model, load, node, a));
    }
    const TwoStepContact::Answer answer =
        contact->solve({d, v1, v2, carried, norm_of(model, load, false), options.threshold});
    if (!(answer.s < 1))
      return false;
    std::vector<contact::NodeVector> found;
    for (const std::uint32_t node : now)
      found.push_back({node, {}});
    for (std::size_t k = 0; k < axes.size(); ++k)
      found[axes[k] / 3].value[static_cast<int>(axes[k] % 3)] = answer.force[k];
    for (const contact::NodeVector& f : found)
      outer.force[f.node] += f.value;
    total = std::move(outer);
    forces = std::move(found);
    s = answer.s;
    norm = options.threshold / s;
    return true;
  }

  void update(Elastostatic& first, const contact::Load& load) {
    if (load.displacement.empty()) {
      norm = load_norm(model, load);
      s = norm > options.threshold ? options.threshold / norm : 1;
      if (s < 1)
        total = load;
      forces = {};
      return;
    }
    if (contact && beyond(first, load))
      return;
    first.update(load);
    contact::Load all = load;
    all.displacement.clear();
    for (const contact::NodeVector& f : first.contact_forces())
      all.force[f.node] += f.value;
    norm = load_norm(model, all);
    if (norm > options.threshold && beyond(first, load))
      return;
    s = 1;
    forces = first.contact_forces();
  }

  /// The first stage under what acts.
  void take_load(Elastostatic& first) const { first.update(s < 1 ? *total : **last); }

  void shape(Elastostatic& first, Displacement of, std::vector<double>& u) {
    take_load(first);
    if (!(s < 1)) {
      const std::span<const double> u1 = (first.*of)();
      u.assign(u1.begin(), u1.end());
      return;
    }
    second.update(*total);
    const std::span<const double> u1 = (first.*of)(), u2 = (second.*of)();
    u.resize(std::min(u1.size(), u2.size()));
    const double a = options.series ? s : 1, b = options.series ? 1 - s : s - 1;
    for (std::size_t r = 0; r < u.size(); ++r)
      u[r] = a * u1[r] + b * u2[r];
    meet(std::max(largest_size(u1), largest_size(u2)),
         of == &Elastostatic::rough_surface ? tolerance : 0, u);
    double sum = 0;
    for (const double value : u)
      sum += std::abs(value);
    if (!std::isfinite(sum))
      throw Error("the shape is not finite, expected a smaller load");
  }

  /// The displaced nodes stand exactly where they must.
  void meet(double size, double left_out, std::vector<double>& u) const {
    double miss = 0;
    for (const auto& [node, d] : (*last)->displacement)
      for (int a = 0; a < 3 && axis_of(node, a) < u.size(); ++a) {
        double& value = u[axis_of(node, a)];
        const double error = std::abs(value - d[a]);
        miss = std::isnan(error) ? error : std::max(miss, error);
        value = d[a];
      }
    if (!(miss <= (contact_tolerance + 2 * left_out) * size))
      throw Error("the two-step method misses a displacement by " + std::to_string(miss) +
                  " mm, expected nodes that are less near to each other");
  }
};

TwoStep::TwoStep(const model::Model& model, std::shared_ptr<compliance::ComplianceSource> second,
                 const Context& context, const TwoStepOptions& options, double tolerance) {
  if (second == nullptr)
    throw Error("the second stage has no factor, expected a store with one");
  state_ = std::make_unique<State>(model, std::move(second), context, tolerance);
  set(options);
}
TwoStep::~TwoStep() = default;
TwoStep::TwoStep(TwoStep&&) noexcept = default;

void TwoStep::set(const TwoStepOptions& options) {
  if (!(options.threshold > 0) || !std::isfinite(options.threshold))
    throw Error("the threshold of the two-step method is not positive, expected a force");
  if (options == state_->options)
    return;
  state_->options = options;
  state_->last = {};
  state_->forget_contact();
  state_->largest = 0;
}

std::shared_ptr<const TwoStep::Past> TwoStep::past() const {
  return std::make_shared<const Past>(Past{state_->second.past(), *state_});
}

void TwoStep::restore(const Past& past) {
  state_->second.restore(*past.second);
  static_cast<Past::Last&>(*state_) = past.last;
}

void TwoStep::update(Elastostatic& first, const contact::Load& load) {
  State& state = *state_;
  if (*state.last == load)
    return;
  state.last = {};
  state.update(first, load);
  if (!std::isfinite(state.norm))
    throw Error("the load is not finite, expected a smaller one");
  state.largest = std::max(state.largest, state.norm);
  state.last = std::optional(load);
  state.whole.known = state.surface.known = state.rough.known = false;
}

void TwoStep::second_compliance_blocks(const contact::Load& load, std::uint32_t node,
                                       std::span<const std::uint32_t> rows,
                                       std::span<std::array<double, 9>> blocks) {
  state_->second.compliance_blocks(load, node, rows, blocks);
}

namespace {

/// Shared by all displacements, so that none of them depends on which was read before.
template <class State, class Shape>
std::span<const double> shape_of(State& state, Elastostatic& first, typename State::Displacement of,
                                 Shape& shape) {
  if (*state.last && !shape.known) {
    state.shape(first, of, shape.u.replace());
    shape.known = true;
  }
  return *shape.u;
}

} // namespace

std::span<const double> TwoStep::displacement(Elastostatic& first) {
  return shape_of(*state_, first, &Elastostatic::displacement, state_->whole);
}
std::span<const double> TwoStep::surface_displacement(Elastostatic& first) {
  return shape_of(*state_, first, &Elastostatic::surface_displacement, state_->surface);
}
std::span<const double> TwoStep::rough_surface(Elastostatic& first) {
  if (state_->tolerance == 0 || state_->surface.known)
    return surface_displacement(first);
  return shape_of(*state_, first, &Elastostatic::rough_surface, state_->rough);
}
void TwoStep::verify(Elastostatic& first) {
  if (!*state_->last)
    return;
  state_->take_load(first);
  first.verify();
}
const std::vector<contact::NodeVector>& TwoStep::contact_forces() const noexcept {
  return *state_->forces;
}
const TwoStepOptions& TwoStep::options() const noexcept {
  return state_->options;
}
double TwoStep::threshold() const noexcept {
  return state_->options.threshold;
}
double TwoStep::load() const noexcept {
  return state_->norm;
}
double TwoStep::largest() const noexcept {
  return state_->largest;
}
ElastostaticCounts TwoStep::second_counts() const noexcept {
  return state_->second.counts();
}

} // namespace gewebe::statics
