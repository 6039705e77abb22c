#include "integrator/solid_motion.h"

#include "base/error.h"
#include "fem/assembly_blocks.h"
#include "integrator/motion_body_internal.h"
#include "integrator/motion_descent_internal.h"
#include "integrator/motion_forecast_internal.h"
#include "integrator/motion_limit_internal.h"
#include "integrator/motion_objective_internal.h"
#include "integrator/motion_quick_internal.h"
#include "integrator/motion_recovery_internal.h"
#include "integrator/motion_stages_internal.h"
#include "integrator/motion_tangent_internal.h"
#include "integrator/solid_energy_internal.h"
#include "viscous/solid_memory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace gewebe::integrator {

namespace {

MotionBody body_of(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
                   const SolidNet& net, double drag, const Context& context) {
  MotionBody body;
  body.mesh = mesh;
  body.elements = fem::solid_elements(mesh, materials, context);
  body.masses = fem::solid_masses(mesh, materials);
  for (const Vec3& p : mesh.points)
    body.rest.insert(body.rest.end(), {p.x, p.y, p.z});
  body.drag.assign(net.drag.begin(), net.drag.end());
  body.drag.resize(body.nodes(), drag);
  body.in_elements.resize(body.nodes());
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (std::size_t a = 0; a < fem::solid_nodes(mesh); ++a)
      body.in_elements[fem::solid_node(mesh, t, a)] = 1;
  for (std::size_t i = 0; i < std::min(body.nodes(), net.masses.size()); ++i)
    body.masses[i] =
        body.in_elements[i] == 0 ? net.masses[i] : std::max(body.masses[i], net.masses[i]);
  return body;
}

} // namespace

/// An energy above that of the model by more than this part of the model's quadratic part is not
/// what the model promised: with less, rounds lower the energy by a part of that at least.
constexpr double energy_excess = 0.9;
/// A matrix becomes stiffer by no more than 1 over this from round to round.
constexpr double least_factor = 0.1;

double damping_per_stiffness(double ratio, double frequency) {
  return ratio / (std::numbers::pi * frequency);
}

struct SolidMotion::State {
  SolidMotionOptions options;
  MotionBody body;
  MotionState now;
  viscous::SolidMemory memory;
  SolidEnergy energy;
  double elastic = 0;      ///< energy of now.place
  double allowed = 0;      ///< at the end of the last step, of all kinds
  MotionForecast forecast; ///< of steps of `last_step`
  MotionStages stages;
  double last_step = 0;
  Numbers target; ///< of held axes in the next step: displacements
  bool moved = false;
  std::vector<FollowingForce> following;
  Numbers reactions;
  MotionQuick quick;
  MotionTangent tangent;
  MotionRecovery recovery;
  /// A step in parts.
  struct Open {
    MotionObjective objective;
    MotionPoint point; ///< where the model was built
    MotionPoint found; ///< the iterate; its value and forces are known if evaluated
    bool evaluated = false;
    Numbers base, step; ///< the iterate when it was linearised, and the model's step from there
    /// Nothing was linearised yet, now and when it was linearised last.
    bool fresh = true, was_fresh = true;
    /// At rest: A^-1 of what does not balance at the iterate under these forces, by this matrix.
    struct Unbalanced {
      std::uint64_t version = 0;
      Numbers forces, by;
    } unbalanced{};
    bool exact = false;                         ///< the matrix is a tangent
    bool renews = false;                        ///< ... that of the next round
    bool is_new = false;                        ///< ... and is that of the present round
    int rounds_of_matrix = 0;                   ///< with the tangent
    bool was_kept = false;                      ///< ... and was made in an earlier step
    double relaxation = 1, next_relaxation = 1; ///< the matrix is over this
    double share = 1;                           ///< of the step that the iterate lacks
    SolidStep counts{};
  };
  std::optional<Open> open;
  std::uint64_t matrix_version = 0; ///< of the last model
  /// The tangent is that of the last step, where it has served to the end: the next one of
  /// `last_step` begins with it.
  bool keeps_tangent = false;

  State(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidMaterial> materials,
        const SolidNet& net, const SolidMotionOptions& with, const Context& context)
      : options(with), body(body_of(mesh, materials, net, with.drag, context)),
        memory(body.mesh, materials, body.elements), energy(body, net, with),
        recovery(body, materials, net, with) {
    const std::size_t axes = body.axes();
    now = {body.rest, Numbers(axes), Numbers(axes), std::vector<std::uint8_t>(axes)};
    target = reactions = Numbers(axes);
  }
  MotionForecast& present_forecast() { return stages.is_second() ? stages.forecast() : forecast; }
  void clear_forecasts() {
    forecast.clear();
    stages.forecast().clear();
  }
  void begin_stage(numeric::Stage stage);
  Numbers go_on(const Numbers& at, double h, const MotionStart& start);
  void recall(double h, const Context& context);
  void remember(const Context& context);
  void stand(double elapsed, const Context& context);
  bool take_tangent();
  void renew_matrix(const Context& context);
  void solve_open(Numbers& v, const Context& context);
  void take_over(SolidMotion& soft);
  void limit(SolidStep& step);
  SolidStep step_softly(double h, const Context& context);
  MotionPoint search(const MotionObjective& objective, SolidStep& step, const Context& context);
  bool balance_at_rest(std::span<const double> forces, double room, const Context& context);
  bool moves_held_from(const Numbers& at) const;
  void foresee_held(const Numbers& from, MotionPoint& point, const Context& context);
  MotionPoint search_rest(const MotionObjective& objective, SolidStep& step,
                          const Context& context);
};

SolidMotion::~SolidMotion() = default;
SolidMotion::SolidMotion(SolidMotion&&) noexcept = default;
SolidMotion& SolidMotion::operator=(SolidMotion&&) noexcept = default;

SolidMotion::SolidMotion(const tetrahedra::TetMesh& mesh,
                         std::span<const fem::SolidMaterial> materials,
                         const SolidMotionOptions& options, const Context& context)
    : SolidMotion(mesh, materials, SolidNet{}, options, context) {}

SolidMotion::SolidMotion(const tetrahedra::TetMesh& mesh,
                         std::span<const fem::SolidMaterial> materials, const SolidNet& net,
                         const SolidMotionOptions& options, const Context& context)
    : state_(std::make_unique<State>(mesh, materials, net, options, context)) {
  const auto sound = [](double value) { return value >= 0 && std::isfinite(value); };
  if (!sound(options.drag) || !sound(options.damping))
    throw Error("the damping of a solid is not a number of 0 or more");
  if (net.bulk > 0 && options.reference)
    throw Error("Newton's method has no volumes that nets enclose");
  if (!(options.tolerance > 0) || options.max_rounds < 1)
    throw Error("a step of a solid has no tolerance or no rounds");
  for (const double mass : state_->body.masses)
    if (!(mass > 0))
      throw Error("a node of a solid is in no tetrahedron");
  for (const double rate : state_->body.drag)
    if (!sound(rate))
      throw Error("the damping of a solid is not a number of 0 or more");
  if (net.springs.empty())
    return;
  Numbers forces(state_->body.axes()); // springs need not be at rest
  state_->elastic = state_->energy.evaluate(state_->now.place, {}, forces, context);
  state_->energy.keep();
}

/// Elements have the energy of a step of h from now on, and `elastic` is that of the place in it.
void SolidMotion::State::recall(double h, const Context& context) {
  if (memory.empty())
    return;
  memory.begin(h);
  Numbers forces(body.axes());
  elastic = energy.evaluate(now.place, {}, forces, context);
}

/// Ends what recall() began, at the place of the last evaluation: `elastic` becomes what is stored.
void SolidMotion::State::remember(const Context& context) {
  if (memory.empty())
    return;
  Numbers u = now.place;
  add(u, -1, body.rest);
  std::vector<Vec3> bubbles(body.mesh.middles.empty() ? 0 : body.elements.size());
  for (std::size_t t = 0; t < bubbles.size(); ++t)
    bubbles[t] = energy.bubble(t);
  memory.end(u, bubbles, context);
  elastic += memory.beyond();
}

/// At a place that it has come to in this time.
void SolidMotion::State::stand(double elapsed, const Context& context) {
  if (!memory.empty())
    memory.begin(elapsed);
  Numbers forces(body.axes());
  elastic = energy.evaluate(now.place, {}, forces, context);
  energy.keep();
  remember(context);
}

/// Begins a stage, or a step of its own.
void SolidMotion::State::begin_stage(numeric::Stage stage) {
  Numbers places;
  if (stage == numeric::Stage::second && moved) {
    places = body.rest;
    add(places, 1, target);
  }
  stages.begin(stage, now, places, energy);
}

/// Speeds at the end of a step that ends at `at`. \return accelerations
Numbers SolidMotion::State::go_on(const Numbers& at, double h, const MotionStart& start) {
  Numbers acceleration(body.axes());
  for (std::size_t axis = 0; axis < body.axes(); ++axis) {
    const double speed = (at[axis] - start.place[axis]) / h;
    acceleration[axis] = (speed - start.velocity[axis]) / h;
    now.velocity[axis] = speed;
  }
  return acceleration;
}

/// Speeds at the end of a step.
void SolidMotion::State::limit(SolidStep& step) {
  const double work = work_of_load(body, now.load, now.place),
               rounding =
                   energy.unsure_at_rest() + 1e-12 * (motion_energy(body, now.velocity) + elastic +
                                                      std::abs(allowed) + std::abs(work));
  step.limited = limit_energy(body, now, elastic, allowed, rounding);
}

/// The matrix of the open step is the tangent of the next round from then on. \return whether there
/// is any
bool SolidMotion::State::take_tangent() {
  if (!energy.volumes().empty() && !quick.wants_tangent())
    return false;
  open->renews = true;
  if (!open->is_new) // else it had to be so stiff
    open->next_relaxation = 1;
  if (quick.wants_tangent() || open->exact)
    return true;
  energy.note_frames();
  open->evaluated = false;
  return true;
}

/// Makes the matrix of a model at the point of the last evaluation. \pre open
void SolidMotion::State::renew_matrix(const Context& context) {
  open->relaxation = open->next_relaxation;
  ++open->rounds_of_matrix;
  open->is_new = std::exchange(open->renews, false);
  if (quick.wants_tangent()) {
    open->is_new = open->is_new || !quick.has_tangent();
    if (open->is_new)
      quick.take_tangent(body, energy.springs(), open->point.at, context);
  } else if (open->is_new) {
    tangent.make(open->objective, open->point.at, context);
    open->rounds_of_matrix = 0;
    ++open->counts.factorisations;
    open->exact = true;
    open->was_kept = false;
  }
  if (open->exact) {
    matrix_version = tangent.version();
    return;
  }
  quick.turn(energy, context);
  quick.fill(energy.volumes(), context);
  matrix_version = quick.version();
}

/// Solves with the matrix of the model, in place. \pre open, linearised
void SolidMotion::State::solve_open(Numbers& v, const Context& context) {
  if (open->exact) {
    tangent.solve(v);
    return;
  }
  quick.into_frames(v, context);
  quick.solve(v, context);
  quick.out_of_frames(v, context);
}

/// What the body that moves meanwhile has come to.
void SolidMotion::State::take_over(SolidMotion& soft) {
  std::ranges::copy(soft.places(), now.place.begin());
  std::ranges::copy(soft.velocity(), now.velocity.begin());
  std::ranges::copy(soft.reactions(), reactions.begin());
  elastic = recovery.elastic();
}

/// A step of recovery.
SolidStep SolidMotion::State::step_softly(double h, const Context& context) {
  SolidMotion& soft = recovery.soft();
  soft.set_load(now.load);
  if (std::exchange(moved, false))
    soft.move_held(target);
  SolidStep step = soft.step(h, context);
  take_over(soft);
  last_step = h;
  if (!MotionRecovery::is_right(body, now.place))
    return step;
  Numbers forces(body.axes());
  const double whole = energy.evaluate(now.place, {}, forces, context, true);
  if (!(whole <= elastic))
    return step;
  elastic = whole;
  energy.keep();
  quick.forget();
  clear_forecasts();
  recovery.end();
  return step;
}

/// The part of a move of held axes by which forces are found that it takes, by differences.
constexpr double part_of_move = 1e-5;
/// What may be left of a shape in contact, over the displacement.
constexpr double left_in_contact = 3e-5;

/// Whether the forces balance at the iterate, or do so once it has moved by no more than `room`.
bool SolidMotion::State::balance_at_rest(std::span<const double> forces, double room,
                                         const Context& context) {
  if (open->share != 0)
    return false;
  if (!std::exchange(open->evaluated, true))
    open->objective.evaluate(open->found, context, true);
  Numbers by = open->found.gradient;
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    if (now.held[axis] == 0)
      by[axis] -= forces[axis];
  solve_open(by, context);
  open->unbalanced = {matrix_version, Numbers(forces.begin(), forces.end()), by};
  double most = 0, displaced = 0;
  for (std::size_t axis = 0; axis < body.axes(); ++axis) {
    most = std::max(most, std::abs(by[axis]));
    displaced = std::max(displaced, std::abs(open->found.at[axis] - body.rest[axis]));
  }
  if (!(most <= room))
    return most <= left_in_contact * displaced;
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    if (now.held[axis] == 0)
      open->found.at[axis] -= by[axis];
  open->evaluated = false;
  open->unbalanced = {};
  return true;
}

/// Whether held axes are to go elsewhere than they are.
bool SolidMotion::State::moves_held_from(const Numbers& at) const {
  if (!moved)
    return false;
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    if (now.held[axis] != 0 && body.rest[axis] + target[axis] != at[axis])
      return true;
  return false;
}

/// What the energy and its derivatives become to second order when held axes go to their targets
/// and the rest stays: what is so near to them may be inside out there. \param point  becomes that
void SolidMotion::State::foresee_held(const Numbers& from, MotionPoint& point,
                                      const Context& context) {
  Numbers by(body.axes());
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    if (now.held[axis] != 0)
      by[axis] = body.rest[axis] + target[axis] - from[axis];
  MotionPoint near;
  near.at = from;
  add(near.at, part_of_move, by);
  open->objective.evaluate(near, context);
  point.at = from;
  open->objective.evaluate(point, context, true);
  for (std::size_t axis = 0; axis < body.axes(); ++axis) {
    const double change = (near.forces[axis] - point.forces[axis]) / part_of_move;
    point.value += by[axis] * (point.forces[axis] + change / 2);
    point.forces[axis] += change;
    if (now.held[axis] == 0)
      point.gradient[axis] += change;
    else
      point.at[axis] = body.rest[axis] + target[axis];
  }
}

/// Where the body is at rest.
MotionPoint SolidMotion::State::search_rest(const MotionObjective& objective, SolidStep& step,
                                            const Context& context) {
  MotionPoint found;
  found.at = now.place;
  if (energy.law() == SolidLaw::hyperelastic && energy.springs().empty() &&
      energy.volumes().empty()) {
    Numbers ahead = now.place;
    for (std::size_t axis = 0; axis < body.axes(); ++axis)
      if (now.held[axis] != 0 && moved)
        ahead[axis] = body.rest[axis] + target[axis];
    newton_to_rest(objective, found, ahead, following, quick, tangent, open->exact, options, step,
                   context);
    return found;
  }
  energy.note_frames();
  if (moves_held_from(now.place)) {
    foresee_held(now.place, found, context);
    quick.turn(energy, context);
    quick.fill(energy.volumes(), context);
    MotionPoint ahead;
    ahead.at = found.at;
    Numbers way = found.gradient;
    quick.into_frames(way, context);
    quick.solve(way, context);
    quick.out_of_frames(way, context);
    add(ahead.at, -1, way);
    for (std::size_t axis = 0; axis < body.axes(); ++axis)
      if (now.held[axis] != 0)
        ahead.at[axis] = found.at[axis];
    objective.evaluate(ahead, context);
    objective.evaluate(found, context);
    if (ahead.value <= found.value)
      found = std::move(ahead);
  }
  objective.evaluate(found, context, true);
  bool exact = open->exact;
  descend_to_rest(objective, found, quick, tangent, exact, options, step, context);
  open->exact = exact;
  return found;
}

/// Where a step ends under the load.
MotionPoint SolidMotion::State::search(const MotionObjective& objective, SolidStep& step,
                                       const Context& context) {
  const double h = objective.step();
  if (!std::isfinite(h))
    return search_rest(objective, step, context);
  MotionPoint found;
  found.at.assign(objective.start().place.begin(), objective.start().place.end());
  add(found.at, h, objective.start().velocity);
  if (last_step != h)
    clear_forecasts();
  present_forecast().add_to(found.at, h * h, context);
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    if (now.held[axis] != 0)
      found.at[axis] = moved ? body.rest[axis] + target[axis] : now.place[axis];
  objective.evaluate(found, context, true);
  // The shape of now, moved as its momentum has it: what rounds get below leaves speeds of the body
  // as a whole to themselves.
  MotionPoint stiff;
  stiff.at = now.place;
  if (!now.any_held())
    objective.keep_momentum(stiff);
  if (!(found.value <= objective.value_of_shape(stiff.at, elastic))) {
    for (std::size_t axis = 0; axis < body.axes(); ++axis)
      if (now.held[axis] == 0)
        found.at[axis] = stiff.at[axis];
    objective.evaluate(found, context, true);
  }
  if (options.reference)
    descend_as_reference(objective, found, tangent, step, context);
  else
    descend_quickly(objective, found, quick, options, step, context);
  return found;
}

void SolidMotion::set_load(std::span<const double> forces) {
  State& s = *state_;
  if (s.open && !std::ranges::equal(s.now.load, forces))
    s.open->evaluated = false;
  s.now.load.assign(forces.begin(), forces.end());
}

void SolidMotion::hold(std::span<const std::uint8_t> held) {
  State& s = *state_;
  for (std::size_t axis = 0; axis < s.body.axes(); ++axis) {
    s.now.held[axis] = held[axis];
    if (held[axis] == 0)
      continue;
    s.now.velocity[axis] = 0;
    s.forecast.hold(axis);
    s.stages.forecast().hold(axis);
  }
  s.stages.forget();
  s.tangent.renew();
  s.keeps_tangent = false;
  if (s.recovery.on())
    s.recovery.soft().hold(held);
}

void SolidMotion::move_held(std::span<const double> displacement) {
  State& s = *state_;
  std::ranges::copy(displacement, s.target.begin());
  s.moved = true;
}

SolidStep SolidMotion::step(double h, const Context& context, numeric::Stage stage) {
  State& s = *state_;
  const bool second = stage == numeric::Stage::second;
  s.stages.abandon(s.energy);
  if (!second)
    s.recovery.look(s.body, s.now, s.elastic, h, s.options, context);
  if (s.recovery.on()) {
    s.stages.forget();
    return s.step_softly(h, context);
  }
  s.begin_stage(stage);
  s.recall(second ? numeric::stage_extension * h : h, context);
  SolidStep step;
  step.change = step.left = HUGE_VAL;
  if (!s.options.reference)
    step.factorisations +=
        s.quick.prepare(s.body, s.energy.springs(), s.now.held, h, s.options, context);
  const double before = s.elastic;
  if (!second)
    s.allowed = motion_energy(s.body, s.now.velocity) + before -
                work_of_load(s.body, s.now.load, s.now.place);
  const MotionStart start = s.stages.start(s.now);
  const MotionObjective objective(s.body, s.now, start, s.energy, h, s.options);
  MotionPoint found = s.search(objective, step, context);
  if (!std::isfinite(found.value))
    throw Error("the motion of a solid is no longer finite, expected a smaller load or timestep");

  s.reactions = found.forces;
  for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
    if (s.now.held[axis] == 0)
      s.reactions[axis] = 0;
  if (!s.now.any_held())
    objective.keep_both_momenta(found);
  if (second)
    s.allowed =
        s.stages.allowed(s.now, found.at, before) - work_of_load(s.body, s.now.load, found.at);
  else
    for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
      s.allowed += s.reactions[axis] * (found.at[axis] - s.now.place[axis]);
  // Of the last evaluation, momentum kept by a translation alone.
  const double after = s.energy.elastic();
  MotionForecast& forecast = s.present_forecast();
  s.stages.end(s.body, h, s.now, found.at, s.energy, before, after);
  s.energy.keep();
  forecast.add(s.go_on(found.at, h, start), s.body.masses, context);
  s.now.place = std::move(found.at);
  s.elastic = after;
  if (!s.moved && stage != numeric::Stage::first)
    s.limit(step);
  s.remember(context);
  step.evaluations = objective.evaluations();
  s.last_step = h;
  s.moved = false;
  return step;
}

void SolidMotion::follow(std::vector<FollowingForce> forces) {
  state_->following = std::move(forces);
}

SolidStep SolidMotion::settle(const Context& context, double elapsed) {
  begin_step(HUGE_VAL, context, elapsed);
  solve_alone(context);
  const SolidStep found = state_->open->counts;
  SolidStep step = end_step({}, context);
  step.change = found.change;
  step.left = found.left;
  return step;
}

double SolidMotion::condition(const Context& context) {
  State& s = *state_;
  (void)s.quick.prepare(s.body, s.energy.springs(), s.now.held, HUGE_VAL, s.options, context);
  return s.quick.condition();
}

bool SolidMotion::has_first_stage(double h) const noexcept {
  return !state_->recovery.on() && state_->stages.has_first(h);
}

void SolidMotion::begin_step(double h, const Context& context, double elapsed,
                             numeric::Stage stage) {
  State& s = *state_;
  const bool second = stage == numeric::Stage::second;
  s.open.reset();
  s.stages.abandon(s.energy);
  s.energy.set_at_rest(!std::isfinite(h));
  if (!std::isfinite(h))
    s.recovery.end();
  else if (!second)
    s.recovery.look(s.body, s.now, s.elastic, h, s.options, context);
  if (s.recovery.on()) {
    s.stages.forget();
    SolidMotion& soft = s.recovery.soft();
    soft.set_load(s.now.load);
    if (s.moved)
      soft.move_held(s.target);
    soft.begin_step(h, context);
    return;
  }
  s.begin_stage(stage);
  s.recall(second ? numeric::stage_extension * h : std::isfinite(h) ? h : elapsed, context);
  const int made = s.quick.prepare(s.body, s.energy.springs(), s.now.held, h, s.options, context);
  s.open.emplace(State::Open{
      .objective = MotionObjective(s.body, s.now, s.stages.start(s.now), s.energy, h, s.options),
      .point = {},
      .found = {},
      .base = {},
      .step = {}});
  State::Open& open = *s.open;
  open.found.at = s.now.place;
  open.counts.factorisations = made;
  open.exact = open.was_kept =
      s.keeps_tangent && s.tangent.is_made() && made == 0 && h == s.last_step;
}

void SolidMotion::linearise_step(std::span<double> step, std::span<const double> forces,
                                 const Context& context) {
  State& s = *state_;
  if (s.recovery.on()) {
    s.recovery.soft().linearise_step(step, forces, context);
    return;
  }
  State::Open& open = *s.open;
  open.base = open.found.at;
  MotionPoint& point = open.point;
  const bool at_rest = !std::isfinite(open.objective.step());
  if (at_rest && s.moves_held_from(open.base)) {
    s.foresee_held(open.base, point, context);
  } else if (open.evaluated) {
    point = open.found;
  } else {
    point.at = open.base;
    if (open.fresh && !at_rest) {
      const MotionStart& start = open.objective.start();
      point.at.assign(start.place.begin(), start.place.end());
      add(point.at, open.objective.step(), start.velocity);
    }
    for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
      if (s.now.held[axis] != 0)
        point.at[axis] = s.moved ? s.body.rest[axis] + s.target[axis] : s.now.place[axis];
    open.objective.evaluate(point, context, true);
  }
  s.renew_matrix(context);
  Numbers direction;
  if (open.evaluated && open.exact && open.unbalanced.version == s.matrix_version &&
      std::ranges::equal(open.unbalanced.forces, forces)) {
    direction = std::move(open.unbalanced.by);
  } else {
    direction = point.gradient;
    for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
      if (s.now.held[axis] == 0)
        direction[axis] -= forces[axis];
    s.solve_open(direction, context);
    ++open.counts.rounds;
  }
  open.unbalanced = {};
  open.step.resize(s.body.axes());
  for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
    open.step[axis] = point.at[axis] -
                      (s.now.held[axis] != 0 ? 0 : open.relaxation * direction[axis]) -
                      open.base[axis];
  open.was_fresh = std::exchange(open.fresh, false);
  std::ranges::copy(open.step, step.begin());
}

void SolidMotion::unit_responses(std::span<const std::uint32_t> nodes,
                                 std::span<double> columns) const {
  State& s = *state_;
  if (s.recovery.on()) {
    s.recovery.soft().unit_responses(nodes, columns);
    return;
  }
  std::vector<std::size_t> axes;
  for (const std::uint32_t node : nodes)
    for (std::size_t a = 0; a < 3; ++a)
      axes.push_back(3 * std::size_t{node} + a);
  if (s.open->exact)
    s.tangent.unit_responses(axes, columns);
  else
    s.quick.unit_responses(axes, columns);
}

std::uint64_t SolidMotion::matrix_version() const noexcept {
  return state_->recovery.on() ? state_->recovery.soft().matrix_version() : state_->matrix_version;
}

std::array<double, 9> SolidMotion::frame_of(std::uint32_t node) const {
  State& s = *state_;
  if (s.recovery.on())
    return s.recovery.soft().frame_of(node);
  return s.open->exact ? std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1} : s.quick.frame_of(node);
}

void SolidMotion::move_iterate(double share, std::span<const double> change,
                               const Context& context) {
  State& s = *state_;
  if (s.recovery.on()) {
    s.recovery.soft().move_iterate(share, change, context);
    return;
  }
  State::Open& open = *s.open;
  open.evaluated = false;
  open.unbalanced = {};
  open.share = share;
  open.found.at = open.base;
  const bool still = std::ranges::all_of(change, [](double f) { return f == 0; });
  open.fresh = open.was_fresh && still && share == 1;
  add(open.found.at, 1 - share, open.step);
  if (!still) {
    Numbers answer(change.begin(), change.end());
    s.solve_open(answer, context);
    ++open.counts.rounds;
    for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
      if (s.now.held[axis] == 0)
        open.found.at[axis] += open.relaxation * answer[axis];
  }
}

double SolidMotion::relaxation() const noexcept {
  return state_->recovery.on() ? state_->recovery.soft().relaxation() : state_->open->relaxation;
}

bool SolidMotion::model_holds(std::span<const double> forces, const Context& context) {
  State& s = *state_;
  if (s.recovery.on())
    return s.recovery.soft().model_holds(forces, context);
  State::Open& open = *s.open;
  if (open.share != 0)
    return true;
  if (!std::exchange(open.evaluated, true))
    open.objective.evaluate(open.found, context, true);
  // The model's energy at the iterate, where its gradient is that of the forces, and what it is
  // below that at the point.
  double model = open.point.value, quadratic = 0;
  for (std::size_t axis = 0; axis < s.body.axes(); ++axis) {
    const double way = open.found.at[axis] - open.point.at[axis];
    const double force = s.now.held[axis] != 0 ? 0 : forces[axis];
    model += way * (force + open.point.gradient[axis]) / 2;
    quadratic += way * (force - open.point.gradient[axis]) / 2;
  }
  const double off = open.found.value - model, unsure = open.found.unsure + open.point.unsure;
  const bool holds = off <= energy_excess * std::max(quadratic, 0.0) + unsure;
  if (!holds && !open.is_new && s.take_tangent())
    return false;
  // The matrix that would have had the energy along this way.
  const double factor = quadratic > unsure ? 1 / (1 + off / quadratic) : holds ? 1 : 0;
  open.next_relaxation *=
      holds ? std::max(factor, least_factor) : std::clamp(factor, least_factor, 0.5);
  open.next_relaxation = std::min(open.next_relaxation, 1.0);
  return holds;
}

void SolidMotion::sharpen() {
  State& s = *state_;
  if (s.recovery.on()) {
    s.recovery.soft().sharpen();
    return;
  }
  // At rest, where a tangent serves for long, another one has to be worth its cost.
  const bool early = !std::isfinite(s.open->objective.step()) && s.open->exact &&
                     2 * s.open->rounds_of_matrix < s.quick.rounds_of_tangent(s.body);
  if (!early)
    (void)s.take_tangent();
}

bool SolidMotion::keep_momentum(std::span<const double> forces, double room,
                                const Context& context) {
  State& s = *state_;
  if (s.recovery.on())
    return s.recovery.soft().keep_momentum(forces, room, context);
  State::Open& open = *s.open;
  if (!std::isfinite(open.objective.step()))
    return s.balance_at_rest(forces, room, context);
  if (s.now.any_held())
    return true;
  const RigidChange by = open.objective.balance(open.found.at, forces);
  if (!(by.largest <= room))
    return false;
  open.objective.move(open.found, by);
  open.evaluated = false;
  return true;
}

void SolidMotion::solve_alone(const Context& context) {
  State& s = *state_;
  if (s.recovery.on()) {
    s.recovery.soft().solve_alone(context);
    return;
  }
  State::Open& open = *s.open;
  open.counts.change = open.counts.left = HUGE_VAL;
  open.found = s.search(open.objective, open.counts, context);
  open.evaluated = false;
  if (!s.now.any_held())
    open.objective.keep_both_momenta(open.found);
}

void SolidMotion::begin_iterate_again() {
  State& s = *state_;
  if (s.recovery.on()) {
    s.recovery.soft().begin_iterate_again();
    return;
  }
  s.open->found = {};
  s.open->found.at = s.now.place;
  s.open->evaluated = false;
  s.open->fresh = true;
}

bool SolidMotion::is_sharp() const noexcept {
  return state_->open->exact;
}

bool SolidMotion::moves_held() const noexcept {
  return state_->moved;
}

std::span<const double> SolidMotion::iterate() const noexcept {
  return state_->recovery.on() ? state_->recovery.soft().iterate()
                               : std::span<const double>(state_->open->found.at);
}

StageEnergy SolidMotion::stage_energy(const Context& context) {
  State& s = *state_;
  if (s.moved)
    return {};
  State::Open& open = *s.open;
  if (!std::exchange(open.evaluated, true))
    open.objective.evaluate(open.found, context, true);
  MotionState ends = s.now;
  ends.place = open.found.at;
  const MotionStart& start = open.objective.start();
  for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
    ends.velocity[axis] = (open.found.at[axis] - start.place[axis]) / open.objective.step();
  const double kinetic = motion_energy(s.body, ends.velocity), elastic = s.energy.elastic(),
               allowed = s.stages.allowed(s.now, open.found.at, s.elastic);
  StageEnergy energy;
  energy.gain = kinetic + elastic - allowed;
  energy.scale = kinetic + elastic + std::abs(allowed);
  energy.inner = inner_energy(s.body, ends);
  return energy;
}

SolidStep SolidMotion::end_step(std::span<const double> forces, const Context& context,
                                double inner) {
  State& s = *state_;
  if (s.recovery.on()) {
    SolidMotion& soft = s.recovery.soft();
    SolidStep step = soft.end_step(forces, context);
    s.take_over(soft);
    s.moved = false;
    if (MotionRecovery::is_right(s.body, s.now.place)) {
      Numbers own(s.body.axes());
      const double whole = s.energy.evaluate(s.now.place, {}, own, context, true);
      if (whole <= s.elastic) {
        s.elastic = whole;
        s.energy.keep();
        s.quick.forget();
        s.clear_forecasts();
        s.recovery.end();
      }
    }
    return step;
  }
  State::Open open = std::move(*s.open);
  s.open.reset();
  // One that had to be renewed in every step would cost more than the constant matrix.
  s.keeps_tangent = open.exact && (open.was_kept || !s.keeps_tangent);
  const double h = open.objective.step();
  open.objective.evaluate(open.found, context);
  if (!std::isfinite(open.found.value))
    throw Error("the motion of a solid is no longer finite, expected a smaller load or timestep");
  const double after = s.energy.elastic();
  const MotionStart& start = open.objective.start();
  MotionForecast& forecast = s.present_forecast();
  s.stages.end(s.body, h, s.now, open.found.at, s.energy, s.elastic, after);
  s.energy.keep();
  s.reactions = open.found.forces;
  for (std::size_t axis = 0; axis < s.body.axes(); ++axis) {
    if (s.now.held[axis] == 0)
      s.reactions[axis] = 0;
    else
      s.reactions[axis] -= forces.empty() ? 0 : forces[axis];
  }
  Numbers acceleration = s.go_on(open.found.at, h, start);
  if (s.last_step != h)
    s.clear_forecasts();
  if (std::isfinite(h))
    forecast.add(std::move(acceleration), s.body.masses, context);
  s.now.place = std::move(open.found.at);
  s.elastic = after;
  if (inner != 1)
    slow_inner(s.body, s.now, inner);
  s.remember(context);
  s.last_step = h;
  s.moved = false;
  open.counts.evaluations = open.objective.evaluations();
  open.counts.change = open.counts.left = 0;
  return open.counts;
}

std::span<const double> SolidMotion::places() const noexcept {
  return state_->now.place;
}
std::vector<double> SolidMotion::displacement() const {
  std::vector<double> u = state_->now.place;
  add(u, -1, state_->body.rest);
  return u;
}
std::span<const double> SolidMotion::velocity() const noexcept {
  return state_->now.velocity;
}
std::span<const double> SolidMotion::reactions() const noexcept {
  return state_->reactions;
}
std::span<const double> SolidMotion::masses() const noexcept {
  return state_->body.masses;
}

void SolidMotion::set_state(std::span<const double> displacement, std::span<const double> velocity,
                            const Context& context) {
  Numbers places = state_->body.rest;
  add(places, 1, displacement);
  restore(places, velocity, context);
}

void SolidMotion::restore(std::span<const double> places, std::span<const double> velocity,
                          const Context& context, double elapsed) {
  State& s = *state_;
  s.quick.drop_tangent();
  s.quick.forget();
  s.keeps_tangent = false;
  s.recovery.end();
  std::ranges::copy(places, s.now.place.begin());
  std::ranges::copy(velocity, s.now.velocity.begin());
  s.clear_forecasts();
  s.stages.abandon(s.energy);
  s.stages.forget();
  s.energy.forget_bubbles();
  s.last_step = 0;
  s.stand(elapsed, context);
}

viscous::MemoryState SolidMotion::memory() const {
  return state_->memory.state();
}
void SolidMotion::set_memory(const viscous::MemoryState& memory) {
  state_->memory.restore(memory);
}
bool SolidMotion::fades() const noexcept {
  return !state_->memory.empty() && !state_->memory.still();
}

struct SolidMotion::Past {
  KeptStep energy;
  viscous::MemoryState memory;
  double elastic = 0, last_step = 0;
  MotionForecast forecast, second_forecast;
  MotionQuick::Past quick;
  std::optional<MotionTangent::Past> tangent; ///< if it serves on
  MotionRecovery::Past recovery;
};

std::shared_ptr<const SolidMotion::Past> SolidMotion::past() const {
  const State& s = *state_;
  auto past = std::make_shared<Past>(Past{.energy = s.energy.kept(),
                                          .memory = s.memory.state(),
                                          .elastic = s.elastic,
                                          .last_step = s.last_step,
                                          .forecast = s.forecast,
                                          .second_forecast = s.stages.forecast(),
                                          .quick = s.quick.past(),
                                          .tangent = {},
                                          .recovery = s.recovery.past()});
  if (s.keeps_tangent)
    past->tangent = s.tangent.past();
  return past;
}

void SolidMotion::restore(std::span<const double> places, std::span<const double> velocity,
                          std::span<const std::uint8_t> held, const Past& past,
                          const Context& context) {
  State& s = *state_;
  s.open.reset();
  s.stages.abandon(s.energy);
  s.stages.forget();
  s.moved = false;
  std::ranges::copy(places, s.now.place.begin());
  std::ranges::copy(velocity, s.now.velocity.begin());
  std::ranges::copy(held, s.now.held.begin());
  s.energy.restore(past.energy);
  s.memory.restore(past.memory);
  s.elastic = past.elastic;
  s.last_step = past.last_step;
  s.forecast = past.forecast;
  s.stages.forecast() = past.second_forecast;
  s.quick.restore(past.quick, s.body, s.energy.springs(), s.options, context);
  s.keeps_tangent = past.tangent.has_value();
  if (past.tangent)
    s.tangent.restore(*past.tangent, context);
  else
    s.tangent.renew();
  s.recovery.restore(past.recovery, s.body, s.now, s.options, context);
}

void SolidMotion::find_reactions(const Context& context) {
  State& s = *state_;
  if (s.recovery.on()) {
    s.recovery.soft().set_load(s.now.load);
    s.recovery.soft().find_reactions(context);
    s.take_over(s.recovery.soft());
    return;
  }
  Numbers forces(s.body.axes());
  if (!s.memory.empty())
    s.memory.begin(0);
  s.elastic = s.energy.evaluate(s.now.place, {}, forces, context) + s.memory.beyond_sudden();
  for (std::size_t axis = 0; axis < s.body.axes(); ++axis)
    s.reactions[axis] = s.now.held[axis] != 0 ? -forces[axis] - s.now.load[axis] : 0;
}

bool SolidMotion::recovering() const noexcept {
  return state_->recovery.on();
}
double SolidMotion::kinetic_energy() const {
  return motion_energy(state_->body, state_->now.velocity);
}
double SolidMotion::elastic_energy() const {
  return state_->elastic;
}
double SolidMotion::potential_energy() const {
  return state_->elastic - work_of_load(state_->body, state_->now.load, state_->now.place);
}

} // namespace gewebe::integrator
