#include "dynamics/solid_contact.h"

#include "base/vector_at.h"
#include "statics/joined_yielding.h"

#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace gewebe {

namespace {

constexpr double same_place = 1e-4; ///< of the smallest radius
constexpr double sure = 3e-4;       ///< tolerance of a step that instruments touch
constexpr int max_pushes = 40;
constexpr int max_idle = 8;       ///< pushes on end that came no nearer
constexpr double nearer = 0.9;    ///< than the best one
constexpr int max_held_back = 12; ///< times that half of a way is left
/// Pushes in all whose rounds ran out: of what comes of such nothing is learned.
constexpr int max_unfinished = 2;

/// Displacements of nodes that are there, the first ones of a model.
std::vector<double> shape_at(const Model& model, std::span<const double> places) {
  std::vector<double> shape(places.size());
  for (std::uint32_t i = 0; i < places.size() / 3; ++i)
    for (int a = 0; a < 3; ++a)
      shape[axis_of(i, a)] = places[axis_of(i, a)] - model.nodes[i].position[a];
  return shape;
}

/// One that somebody else has.
class Lent final : public Yielding {
public:
  explicit Lent(Yielding& one) : one_(one) {}
  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override {
    return one_.delassus_operator(nodes);
  }
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override {
    return one_.push(touches, at);
  }
  std::span<const double> shape() override { return one_.shape(); }

private:
  Yielding& one_;
};

} // namespace

/// A step that gives way to forces of contact.
class SolidContact::Object final : public Yielding {
public:
  Object(SolidContact& all, const Step& step, std::span<const NodeTouch> touches,
         const Context& context)
      : all_(all), step_(step), context_(context),
        force_(sums_of_touches({touches.begin(), touches.end()})),
        places_(step.engine.places().begin(), step.engine.places().end()),
        speed_(step.engine.velocity().begin(), step.engine.velocity().end()),
        velocity_(step.clearing ? std::vector<double>(speed_.size()) : speed_) {
    double radius = HUGE_VAL;
    for (const auto& i : step.instruments)
      if (i)
        radius = std::min(radius, i->shape.radius);
    tolerance_ = same_place * radius;
    if (step.meets)
      tolerance_ = std::min(tolerance_, surface_depth * all.pairs_->edge());
  }

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override {
    if (!ran_)
      run();
    if (step_.meets && !nodes.empty() && !took_tangent_) {
      took_tangent_ = true;
      if (step_.engine.take_tangent(context_)) {
        ++took_.factorisations;
        all_.renew();
      }
    }
    const std::size_t size = 3 * nodes.size();
    need_columns(nodes);
    DelassusOperator delassus;
    delassus.nodes.assign(nodes.begin(), nodes.end());
    if (all_.learned_of_ != delassus.nodes) {
      all_.learned_of_ = delassus.nodes;
      all_.learned_.resize(size * size);
      for (std::size_t c = 0; c < size; ++c)
        for (std::size_t r = c; r < size; ++r) // columns are of single precision
          all_.learned_[c * size + r] = all_.learned_[r * size + c] =
              (entry(nodes, r, c) + entry(nodes, c, r)) / 2;
    }
    delassus.compliance = all_.learned_;
    if (nodes_ != delassus.nodes)
      start_pushes();
    nodes_ = delassus.nodes;
    note();
    for (const std::uint32_t node : nodes) {
      const Vec3 u = vector_at(step_.engine.places(), node) - all_.model_.nodes[node].position;
      delassus.free.insert(delassus.free.end(), {u.x, u.y, u.z});
    }
    for (const NodeTouch& t : force_) { // without these
      const auto k =
          static_cast<std::size_t>(std::ranges::lower_bound(nodes, t.node) - nodes.begin());
      if (k == nodes.size() || nodes[k] != t.node)
        continue;
      for (std::size_t r = 0; r < size; ++r)
        for (std::size_t a = 0; a < 3; ++a)
          delassus.free[r] -=
              delassus.compliance[(3 * k + a) * size + r] * t.force[static_cast<int>(a)];
    }
    return delassus;
  }

  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override {
    force_.assign(touches.begin(), touches.end());
    run();
    double miss = 0;
    for (std::size_t k = 0; k < at.size(); ++k) {
      const double error = norm(vector_at(step_.engine.places(), nodes_[k]) - at[k]);
      miss = error <= miss ? miss : error;
    }
    learn();
    const bool agreed = miss <= tolerance_ && (miss == 0 || put_touched(at));
    idle_ = miss < nearer * best_ ? 0 : idle_ + 1;
    best_ = std::min(best_, miss);
    if (!agreed && ++pushes_ < max_pushes && idle_ < max_idle && unfinished_ < max_unfinished)
      return false;
    exact_ = exact_ && agreed;
    start_pushes();
    return true;
  }

  std::span<const double> shape() override {
    if (!ran_) // nothing has asked for it yet
      run();
    shape_ = shape_at(all_.model_, step_.engine.places());
    return shape_;
  }

  /// Behind all: a cleared body goes on as it moved.
  void end() const {
    if (ran_ && step_.clearing)
      step_.engine.restore(
          std::vector<double>(step_.engine.places().begin(), step_.engine.places().end()), speed_,
          context_);
  }
  /// What pushed in the last step does no more.
  void let_go() {
    force_.clear();
    if (ran_)
      run();
  }
  bool exact() const { return exact_; }
  void distrust(bool inexact) { exact_ = exact_ && !inexact; }
  const SolidStep& took() const { return took_; }

private:
  void start_pushes() {
    pushes_ = idle_ = 0;
    best_ = HUGE_VAL;
  }
  /// The forces on the touched nodes, and where these stand: 3 for each.
  std::vector<double> forces_now() const {
    std::vector<double> all(3 * nodes_.size());
    for (const NodeTouch& t : force_)
      if (const auto at = std::ranges::lower_bound(nodes_, t.node);
          at != nodes_.end() && *at == t.node)
        for (int a = 0; a < 3; ++a)
          all[axis_of(static_cast<std::uint32_t>(at - nodes_.begin()), a)] += t.force[a];
    return all;
  }
  std::vector<double> places_now() const {
    std::vector<double> all;
    for (const std::uint32_t node : nodes_)
      for (int a = 0; a < 3; ++a)
        all.push_back(step_.engine.places()[axis_of(node, a)]);
    return all;
  }
  void note() {
    noted_force_ = forces_now();
    noted_place_ = places_now();
  }
  /// Columns of A⁻¹.
  void need_columns(std::span<const std::uint32_t> nodes) {
    const std::size_t axes = places_.size();
    for (const std::uint32_t node : nodes) {
      std::vector<double>& columns = all_.columns_[node];
      if (!columns.empty())
        continue;
      columns.resize(3 * axes);
      for (int a = 0; a < 3; ++a) {
        const std::span<double> column =
            std::span(columns).subspan(static_cast<std::size_t>(a) * axes, axes);
        column[axis_of(node, a)] = 1;
        step_.engine.respond(column, context_);
      }
    }
  }
  /// Of H A⁻¹ Hᵀ as the columns have it: of single precision, symmetric to that.
  double entry(std::span<const std::uint32_t> nodes, std::size_t r, std::size_t c) const {
    return all_.columns_.at(
        nodes[c / 3])[(c % 3) * places_.size() + 3 * std::size_t{nodes[r / 3]} + r % 3];
  }
  /// Those that instruments may touch; with surfaces that touch each other, those that are touched:
  /// what these do keeps its momentum.
  bool put_touched(std::span<const Vec3> at) {
    if (!step_.meets)
      return put(nodes_, at);
    std::vector<std::uint32_t> nodes;
    std::vector<Vec3> there;
    for (std::size_t k = 0; k < nodes_.size(); ++k)
      if (std::ranges::any_of(force_, [&](const NodeTouch& t) {
            return t.node == nodes_[k] && t.instrument != other_surface;
          })) {
        nodes.push_back(nodes_[k]);
        there.push_back(at[k]);
      }
    return nodes.empty() || put(nodes, there);
  }
  /// The touched nodes stand where the contacts have them, to rounding; what is missing to there is
  /// as small as what a step leaves, and takes what is around along as forces there would.
  /// \return whether it can be done
  bool put(std::span<const std::uint32_t> nodes, std::span<const Vec3> at) {
    need_columns(nodes);
    const auto size = static_cast<Eigen::Index>(3 * nodes.size());
    Eigen::MatrixXd w(size, size);
    Eigen::VectorXd missing(size);
    for (Eigen::Index c = 0; c < size; ++c) {
      const auto k = static_cast<std::size_t>(c);
      const int a = static_cast<int>(k % 3);
      missing[c] = at[k / 3][a] - step_.engine.places()[axis_of(nodes[k / 3], a)];
      for (Eigen::Index r = 0; r < size; ++r)
        w(r, c) = entry(nodes, static_cast<std::size_t>(r), k);
    }
    for (Eigen::Index k = 0; k < size; ++k)
      if (!(w(k, k) > 0)) { // held
        w(k, k) = 1;
        missing[k] = 0;
      }
    const Eigen::VectorXd force = w.partialPivLu().solve(missing);
    std::vector<double> by(places_.size());
    for (std::size_t k = 0; k < nodes.size(); ++k)
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t axis = 0; axis < by.size(); ++axis)
          by[axis] += force[static_cast<Eigen::Index>(3 * k + a)] *
                      all_.columns_.at(nodes[k])[a * by.size() + axis];
    if (!std::ranges::all_of(by, [](double b) { return std::isfinite(b); }))
      return false;
    step_.engine.nudge(by, context_);
    return true;
  }
  /// What the last forces have moved corrects W: the update of BFGS, with forces for places.
  void learn() {
    std::vector<double> s = forces_now(), y = places_now();
    if (s.size() != noted_force_.size())
      return;
    double curvature = 0, own = 0;
    for (std::size_t k = 0; k < s.size(); ++k) {
      s[k] -= noted_force_[k];
      y[k] -= noted_place_[k];
      curvature += s[k] * y[k];
    }
    const std::size_t size = s.size();
    std::vector<double>& w = all_.learned_;
    std::vector<double> ws(size);
    for (std::size_t c = 0; c < size; ++c)
      for (std::size_t r = 0; r < size; ++r)
        ws[r] += w[c * size + r] * s[c];
    for (std::size_t k = 0; k < size; ++k)
      own += s[k] * ws[k];
    if (!(curvature > 1e-3 * own) || !(own > 0)) // rounding, or nothing that W can know
      return;
    for (std::size_t c = 0; c < size; ++c)
      for (std::size_t r = 0; r < size; ++r)
        w[c * size + r] += y[c] * y[r] / curvature - ws[c] * ws[r] / own;
  }
  void run() {
    SolidMotion& engine = step_.engine;
    const std::vector<double> end(engine.places().begin(), engine.places().end());
    if (ran_) { // once more, from where it led
      engine.begin_again(places_, velocity_, context_);
      engine.guess(end);
    } else if (step_.clearing) {
      engine.restore(places_, velocity_, context_);
    }
    std::vector<double> forces(step_.forces.begin(), step_.forces.end()), between;
    if (step_.meets && step_.beside == nullptr) // which gives and takes energy that nobody knows
      between.resize(forces.size());
    double pushed_with = 0;
    for (const NodeTouch& t : force_) {
      pushed_with += t.instrument == other_surface ? norm(t.force) / 2 : 0;
      for (int a = 0; a < 3; ++a) {
        forces[axis_of(t.node, a)] += t.force[a];
        if (t.instrument == other_surface && !between.empty())
          between[axis_of(t.node, a)] += t.force[a];
      }
    }
    // They are right within the depth that they may miss by.
    const double depth = all_.pairs_ ? surface_depth * all_.pairs_->edge() : 0;
    engine.set_load(forces, {between, depth * pushed_with});
    if (!step_.target.empty())
      engine.move_held(step_.target);
    const bool pushed = !force_.empty() || ran_;
    const double tolerance =
        pushed ? std::min(sure, step_.options.tolerance) : step_.options.tolerance;
    engine.set_tolerance(tolerance, step_.options.max_rounds);
    const SolidStep took = engine.step(step_.h, context_);
    ran_ = true;
    unfinished_ += took.left <= tolerance ? 0 : 1;
    took_.rounds += took.rounds;
    took_.factorisations += took.factorisations;
    took_.change = took.change;
    took_.left = took.left;
    took_.limited = took.limited;
    took_.excess = took.excess;
    if (took.factorisations > 0)
      all_.renew();
  }

  SolidContact& all_;
  const Step& step_;
  const Context& context_;
  std::vector<NodeTouch> force_;
  std::vector<double> places_, speed_, velocity_; ///< where it begins, and how it moves there
  std::vector<double> shape_;                     ///< the last one
  std::vector<std::uint32_t> nodes_;
  double tolerance_ = 0;
  int pushes_ = 0, idle_ = 0, unfinished_ = 0;
  double best_ = HUGE_VAL; ///< miss of a push
  std::vector<double> noted_force_, noted_place_;
  bool ran_ = false, took_tangent_ = false, exact_ = true;
  SolidStep took_;
};

SolidContact::SolidContact(const Model& model, std::size_t own,
                           std::vector<SurfaceMeeting> meetings)
    : model_(model), own_(own), contact_(model, std::vector<double>(3 * model.nodes.size())) {
  if (!meetings.empty())
    pairs_.emplace(model, std::move(meetings));
}

/// Displacements of all.
std::vector<double> SolidContact::shape_of(std::span<const double> places,
                                           std::span<const double> stands) const {
  std::vector<double> shape = shape_at(model_, places);
  shape.insert(shape.end(), stands.begin(), stands.end());
  return shape;
}

/// What gives way, with surfaces that touch. \return whether their forces are found
bool SolidContact::meet(const Step& step, Yielding& all, std::vector<NodeTouch>& touches,
                        std::vector<SurfacePush>& pushes, std::vector<double>& shape) {
  MeetingYielding both(
      all, *pairs_,
      [&](std::uint32_t node) {
        return model_.nodes[node].fixed == fixed_all || step.displaced.contains(node);
      },
      shape, std::move(pushes));
  contact_.update(both, step.displaced, step.instruments, shape, !step.clearing);
  met_.add(both.counts());
  touches = both.touches();
  pushes = both.kept();
  touches.insert(touches.end(), contact_.touches().begin(), contact_.touches().end());
  touches = sums_of_touches(std::move(touches));
  return both.solved();
}

SolidContact::Result SolidContact::step(const Step& step, std::vector<NodeTouch>& touches,
                                        std::vector<SurfacePush>& pushes,
                                        std::vector<double>& stands, const Context& context) {
  std::vector<NodeTouch> by_instruments;
  for (const NodeTouch& t : touches)
    if (t.instrument < step.instruments.size() && step.instruments[t.instrument] &&
        !step.displaced.contains(t.node))
      by_instruments.push_back(t);
  std::erase_if(touches, [&](const NodeTouch& t) {
    return t.instrument == other_surface
               ? !step.meets
               : std::ranges::find(by_instruments, t) == by_instruments.end();
  });
  std::erase_if(columns_, [&](const auto& of) {
    return std::ranges::none_of(touches, [&](const NodeTouch& t) { return t.node == of.first; });
  });
  Began began; // where surfaces that meet begin
  std::vector<double> shape = shape_of(step.engine.places(), stands);
  if (step.meets)
    began = {{step.engine.places().begin(), step.engine.places().end()}, shape};
  contact_.restart(shape, std::move(by_instruments));
  const auto own = static_cast<std::uint32_t>(own_),
             all = static_cast<std::uint32_t>(model_.nodes.size());
  const std::vector<NodeTouch> last = touches;
  Object object(*this, step, touches_of_part(last, 0, own), context);
  bool met = true, found = true; // found: what stands beside has found what was asked of it
  const auto go = [&](Yielding& yielding) {
    if (step.meets) {
      object.distrust(!meet(step, yielding, touches, pushes, shape));
      return;
    }
    contact_.update(yielding, step.displaced, step.instruments, shape, !step.clearing);
    touches = contact_.touches();
    pushes.clear();
  };
  if (step.beside == nullptr) {
    go(object);
  } else {
    const auto with = [&](std::span<const NodeTouch> pushed) {
      std::vector<JoinedYielding::Part> parts;
      parts.push_back({std::make_unique<Lent>(object), 0});
      parts.push_back({step.beside->yielding(step.time, touches_of_part(pushed, own, all)), own});
      JoinedYielding joined(std::move(parts), all);
      go(joined);
      found = step.beside->solved();
    };
    with(last);
    if (step.meets && !step.clearing && touches.empty() && !last.empty()) {
      // All let go: once more without what they pushed with, which nothing has taken back yet.
      shape = began.shape;
      pushes.clear();
      contact_.restart(shape, {});
      object.let_go();
      with({});
    }
    stands.assign(shape.begin() + static_cast<std::ptrdiff_t>(3 * own_), shape.end());
  }
  if (step.meets)
    met = object.exact() && (object.took().excess <= 0 || overlaps(shape));
  if (!met) // by what the step has moved, of which nothing is known behind its end
    hold_back(step, began, stands, object.took().excess, context);
  object.end();
  if (pushes.empty())
    step.engine.drop_tangent();
  step.engine.set_tolerance(step.options.tolerance, step.options.max_rounds);
  return {object.took(), object.exact() && found && contact_.solved(), met};
}

/// Whether surfaces are in each other: they have energy of their own.
bool SolidContact::overlaps(std::span<const double> shape) {
  return std::ranges::any_of(pairs_->find(shape, shape, 0), [&](const SurfacePair& p) {
    return p.gap < -surface_depth * pairs_->edge();
  });
}

/// Where forces were not found nothing has passed another surface nevertheless, and none has won.
void SolidContact::hold_back(const Step& step, const Began& began, std::vector<double>& stands,
                             double excess, const Context& context) {
  const auto passed = [&] {
    return !pairs_
                ->find_passed(shape_of(step.engine.places(), stands), began.shape,
                              surface_depth * pairs_->edge())
                .empty();
  };
  if (!(excess <= 0) && overlaps(began.shape))
    excess = 0;
  const std::span<const double> stood = std::span(began.shape).subspan(3 * own_);
  for (int halved = 0; !(excess <= 0) || passed(); ++halved) {
    const double part = halved < max_held_back ? 0.5 : 0;
    excess = step.engine.hold_back(began.places, part, context);
    for (std::size_t k = 0; k < stands.size(); ++k)
      stands[k] = stood[k] + part * (stands[k] - stood[k]);
    if (halved == max_held_back)
      return;
  }
}

} // namespace gewebe
