#include "dynamics/solid_dynamic.h"

#include "base/error.h"
#include "dynamics/solid_law.h"
#include "dynamics/spring_force.h"
#include "fem/assembly.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "numeric/larger.h"
#include "numeric/two_stages.h"
#include "text/number_text.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace gewebe::dynamics {

namespace {

constexpr double rest_tolerance = 1e-9, rest_rounding = 1e-13;
/// In contact, mm/s: a tenth of contact::Parameters::stick_speed, the largest creep of sticking
/// vertices.
constexpr double rest_in_contact = 1e-2;
constexpr int quiet_steps = 2;
constexpr double same_step = 1e-9; ///< lengths that differ by less are one
constexpr double max_steps = 1e9;
constexpr double largest_force = 1e38; ///< squares of what it does are finite
constexpr double same_mass = 1e-6;
/// Largest number of iterations of a step with a given tolerance.
constexpr int rounds_for_tolerance = 200;
/// The same with springs, whose part of the constant matrix is a bound and not a tangent.
constexpr int rounds_with_springs = 40;

/// Default tolerance of a step of a net: spring forces are as rough as their model.
constexpr double tolerance_of_nets = 0.02;

bool about(double value, double expected) {
  return std::abs(value - expected) <= same_mass * expected;
}

/// What moves along with the elements.
struct Net {
  std::vector<integrator::SolidSpring> springs;
  std::vector<double> masses, drag;
};

/// Springs, masses of nodes and drag per mass.
Net net_of(const model::Model& model) {
  Net net;
  std::vector<std::uint8_t> tied(model.nodes.size());
  for (const model::Spring& s : model.springs) {
    net.springs.push_back({s.i, s.j, s.stiffness, s.damping, s.rest});
    tied[s.i] = tied[s.j] = 1;
  }
  const std::vector<double> masses =
      fem::solid_masses(fem::element_mesh(model), fem::element_materials(model));
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const model::Node& node = model.nodes[i];
    const std::string name = "node " + std::to_string(i);
    if (!(masses[i] > 0) && tied[i] == 0 && !model.tetrahedra.empty())
      throw Error(name + " is in no tetrahedron, expected none such of a solid that moves");
    const bool of_elements = masses[i] > 0 && about(node.mass, masses[i]);
    if (masses[i] > 0 && !of_elements && !(node.mass > masses[i]))
      throw Error(name + " has a mass of " + text::number_text(node.mass) +
                  " g, expected at least that of its tetrahedra, " + text::number_text(masses[i]) +
                  " g, of a solid that moves");
    const bool massless = node.mass == 0; // and stays where it is: any mass will do
    net.masses.push_back(massless ? 1 : of_elements ? masses[i] : node.mass);
    net.drag.push_back(massless ? 0 : node.drag / node.mass);
  }
  require_masses(model);
  return net;
}

} // namespace

SolidDynamic::SolidDynamic(const model::Model& model, const integrator::SolidChoice& choice,
                           const Context& context)
    : model_(model), context_(context), motion_(model.nodes.size()) {
  options_.law = law_of(model, choice.law).value_or(integrator::SolidLaw::corotational);
  options_.damping = choice.damping.value_or(options_.damping);
  if (!model.springs.empty())
    options_.max_rounds = rounds_with_springs;
  if (model.tetrahedra.empty())
    options_.tolerance = tolerance_of_nets;
  if (choice.bulk) {
    if (!model.tetrahedra.empty())
      throw Error("is a solid, whose Poisson's ratio keeps its volume, expected a net for bulk=");
    bulk_ = *choice.bulk;
  }
  if (choice.tolerance) {
    options_.tolerance = *choice.tolerance;
    options_.max_rounds = rounds_for_tolerance;
  }
  Box3 box;
  std::vector<double>& places = state_.places.write();
  for (const model::Node& node : model.nodes) {
    box.add(node.position);
    places.insert(places.end(), {node.position.x, node.position.y, node.position.z});
  }
  size_ = box.longest_side();
  state_.velocity.write().resize(places.size());
  state_.reactions.write().resize(places.size());
  read_load();
  (void)engine(context);
}

integrator::SolidMotion& SolidDynamic::engine(const Context& context) {
  if (!engine_) {
    const Net net = net_of(model_);
    engine_.emplace(
        fem::element_mesh(model_), fem::element_materials(model_),
        integrator::SolidNet{net.springs, net.masses, net.drag, model_.triangles, bulk_}, options_,
        context);
    engine_->hold(held_);
    engine_->restore(*state_.places, *state_.velocity, context);
  } else if (behind_) {
    engine_->restore(*state_.places, *state_.velocity, held_, *state_.past, context);
    state_.past = nullptr;
    behind_ = false;
  }
  return *engine_;
}

void SolidDynamic::set_load(const contact::Load& load, double time) {
  if (load == *state_.load)
    return;
  state_.load = std::make_shared<const contact::Load>(load);
  apply_load(time);
}

/// What follows from the load alone.
void SolidDynamic::read_load() {
  const contact::Load& load = *state_.load;
  held_.assign(3 * model_.nodes.size(), 0);
  for (std::uint32_t i = 0; i < model_.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      held_[axis_of(i, a)] =
          contact::is_fixed(model_, i, a) || load.displacement.contains(i) ? 1 : 0;
  all_held_ = std::ranges::all_of(held_, [](std::uint8_t held) { return held != 0; });
  if (weighed_ != load.gravity) {
    weight_ = fem::weight_of(model_, load.gravity);
    weighed_ = load.gravity;
  }
  steady_ = weight_;
  for (const auto& [node, force] : load.force)
    if (!load.force_period.contains(node))
      for (int a = 0; a < 3; ++a)
        steady_[axis_of(node, a)] += force[a];
  pressed_ = contact::pressed_corners(load, model_);
}

/// Where a displaced node stands.
Vec3 SolidDynamic::held_at(std::uint32_t node, double time) const {
  const auto way = state_.load->ramp.find(node);
  return way != state_.load->ramp.end() ? way->second.at(time) : state_.load->displacement.at(node);
}

void SolidDynamic::apply_load(double time) {
  if (engine_)
    (void)engine(context_);
  const std::vector<std::uint8_t> held_before = std::exchange(held_, {});
  read_load();
  bool jumped = false;
  std::vector<double>&places = state_.places.write(), &velocity = state_.velocity.write();
  for (const auto& [node, displacement] : state_.load->displacement) {
    const Vec3 to = model_.nodes[node].position + held_at(node, time);
    for (int a = 0; a < 3; ++a) {
      double& place = places[axis_of(node, a)];
      jumped = jumped || !(place == to[a]);
      place = to[a];
    }
  }
  for (std::size_t axis = 0; axis < held_.size(); ++axis)
    if (held_[axis] != 0)
      velocity[axis] = 0;
  if (engine_ && held_ != held_before)
    engine_->hold(held_);
  if (engine_ && jumped)
    engine_->restore(places, velocity, context_);
  if (!state_.load->displacement.empty()) {
    integrator::SolidMotion& moving = engine(context_);
    moving.set_load(forces_at(time));
    moving.find_reactions(context_);
    state_.reactions.replace().assign(moving.reactions().begin(), moving.reactions().end());
  }
  state_.time = time;
  state_.quiet = 0;
  state_.resting = false;
  state_.version = ++versions_;
  motion_shown_ = false;
}

/// All forces on the 3 n axes at this time, in the present shape, or in the one that present speeds
/// lead to by `ahead` s.
std::vector<double> SolidDynamic::forces_at(double time, double ahead) const {
  std::vector<double> forces = steady_;
  const auto add = [&](std::uint32_t node, const Vec3& force) {
    for (int a = 0; a < 3; ++a)
      forces[axis_of(node, a)] += force[a];
  };
  for (const auto& [node, period] : state_.load->force_period)
    add(node, contact::pulse(time, period) * state_.load->force.at(node));
  const std::span<const double> places = engine_ ? engine_->places() : *state_.places;
  const std::span<const double> speeds = engine_ ? engine_->velocity() : *state_.velocity;
  contact::press(
      pressed_, time,
      [&](std::uint32_t node) {
        const Vec3 at = vector_at(places, node);
        return ahead > 0 ? at + ahead * vector_at(speeds, node) : at;
      },
      add);
  return forces;
}

std::span<const NodeMotion> SolidDynamic::motion() const {
  if (motion_shown_)
    return motion_;
  for (std::uint32_t i = 0; i < motion_.size(); ++i)
    motion_[i] = {vector_at(*state_.places, i) - model_.nodes[i].position,
                  vector_at(*state_.velocity, i)};
  for (const auto& [node, displacement] : state_.load->displacement) { // exactly
    motion_[node].displacement = held_at(node, state_.time);
    const auto way = state_.load->ramp.find(node);
    if (way == state_.load->ramp.end() || !(state_.time < way->second.end))
      motion_[node].velocity = {};
  }
  motion_shown_ = true;
  return motion_;
}

void SolidDynamic::set_motion(std::span<const NodeMotion> motion) {
  std::vector<double>&places = state_.places.write(), &velocity = state_.velocity.write();
  for (std::uint32_t i = 0; i < motion.size(); ++i) {
    const Vec3 at = model_.nodes[i].position + motion[i].displacement;
    for (int a = 0; a < 3; ++a) {
      places[axis_of(i, a)] = at[a];
      velocity[axis_of(i, a)] = motion[i].velocity[a];
    }
  }
  begin_anew();
  apply_load(state_.time);
}

std::any SolidDynamic::memory() {
  return engine(context_).memory();
}

void SolidDynamic::remember(const std::any& memory) {
  const auto* const state = std::any_cast<viscous::MemoryState>(&memory);
  if (state == nullptr || !state->tensors)
    return;
  integrator::SolidMotion& moving = engine(context_);
  moving.set_memory(*state);
  moving.restore(*state_.places, *state_.velocity, context_);
  state_.version = ++versions_;
}

std::any SolidDynamic::snapshot() const {
  State state = state_;
  if (engine_ && !behind_)
    state.past = engine_->past();
  return state;
}

void SolidDynamic::go_back(const std::any& snapshot) {
  const State& was = std::any_cast<const State&>(snapshot);
  const bool same = was.version == state_.version;
  const std::shared_ptr<const integrator::SolidMotion::Past> past =
      same && !behind_ ? nullptr : was.past; // else the engine has it
  state_ = was;
  state_.past = past;
  if (same)
    return;
  read_load();
  motion_shown_ = false;
  behind_ = past != nullptr;
  if (!behind_)
    begin_anew();
}

/// The next engine knows nothing of earlier steps.
void SolidDynamic::begin_anew() {
  body_.reset();
  engine_.reset();
  behind_ = false;
  state_.past = nullptr;
  state_.last_step = 0;
}

std::uint64_t SolidDynamic::advance(double duration, const TimeSteps& of, const Context& context,
                                    double start) {
  if (state_.resting || duration == 0)
    return 0;
  // A hair more than a whole number of steps is rounding.
  const double exact = duration / of.largest * (1 - 1e-12);
  if (!(exact <= max_steps))
    throw Error("a step of this length takes over 1e9 integration steps, expected fewer");
  const double count = std::max(1.0, std::ceil(exact));
  const double length = duration / count;
  const double h = keep_length(of.order > 1 ? numeric::stage_length * length : length);
  const auto steps = static_cast<std::uint64_t>(count);
  const auto since = std::chrono::steady_clock::now();
  (void)engine(context);
  state_.version = ++versions_;
  motion_shown_ = false;
  std::uint64_t taken = 0;
  const auto at = [&](std::uint64_t step) {
    return step == steps ? start + duration
                         : start + static_cast<double>(step) * (of.order > 1 ? length : h);
  };
  while (taken < steps && !state_.resting) {
    const contact::Interval whole{at(taken), at(taken + 1)};
    if (of.order > 1)
      two_stages(h, whole, context);
    else
      step(h, whole, context);
    ++taken;
  }
  take_over();
  state_.time = start + duration;
  counts_.steps += taken;
  counts_.seconds +=
      std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
  return taken;
}

/// The length of a stage or a step from now on, which is that of the last one if it is about that,
/// so that the factor serves on.
double SolidDynamic::keep_length(double h) {
  if (!(std::abs(h - state_.last_step) <= same_step * state_.last_step))
    state_.last_step = h;
  return state_.last_step;
}

/// Forces, and where held axes go: the target, or nothing where they stay.
std::vector<double> SolidDynamic::begin_step(const contact::Interval& step) {
  integrator::SolidMotion& moving = *engine_;
  const auto [from, to, stage] = step;
  const std::vector<double> forces = forces_at(to, stage == numeric::Stage::whole ? 0 : to - from);
  for (std::size_t axis = 0; axis < forces.size(); ++axis)
    if (!(std::abs(forces[axis]) <= largest_force))
      throw MotionError(static_cast<std::uint32_t>(axis / 3), to,
                        "is under a force beyond single precision, expected a smaller one");
  moving.set_load(forces);
  load_ = forces;
  const auto& ramps = state_.load->ramp;
  const bool moves = std::ranges::any_of(ramps, [&](const auto& r) { return from < r.second.end; });
  std::vector<double> target;
  if (!moves && !all_held_)
    return target;
  target.resize(forces.size());
  for (const auto& [node, displacement] : state_.load->displacement) {
    const Vec3 u = held_at(node, to);
    for (int a = 0; a < 3; ++a)
      target[axis_of(node, a)] = u[a];
  }
  return target;
}

/// A step of a body that is held everywhere.
void SolidDynamic::hold_all(std::span<const double> target, double h, const Context& context) {
  std::vector<double> places(target.begin(), target.end()), velocity(target.size());
  for (std::uint32_t i = 0; i < model_.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a) {
      double& place = places[axis_of(i, a)];
      place += model_.nodes[i].position[a];
      velocity[axis_of(i, a)] = (place - engine_->places()[axis_of(i, a)]) / h;
    }
  engine_->restore(places, velocity, context, h);
  engine_->find_reactions(context);
}

/// Behind a step: whether it has come to rest. \param room  mm, that counts as no motion
void SolidDynamic::settle(std::span<const double> before, double to, double room,
                          const Context& context) {
  integrator::SolidMotion& moving = *engine_;
  double moved = 0, largest = 0;
  for (std::uint32_t i = 0; i < model_.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a) {
      const std::size_t axis = axis_of(i, a);
      const double by = std::abs(moving.places()[axis] - before[axis]);
      moved = numeric::larger(moved, by);
      largest = std::max(largest, std::abs(before[axis] - model_.nodes[i].position[a]));
    }
  const bool quiet = moved <= std::max({rest_tolerance * largest, rest_rounding * size_, room}) &&
                     !moving.recovering() && !moving.fades() &&
                     !(state_.load->changes_until() > to);
  state_.quiet = quiet ? state_.quiet + 1 : 0;
  if (state_.quiet < quiet_steps)
    return;
  state_.resting = true;
  moving.restore(std::vector<double>(moving.places().begin(), moving.places().end()),
                 std::vector<double>(before.size()), context);
}

/// A step of h, or a stage of one, without settling.
void SolidDynamic::move(double h, const contact::Interval& step, const Context& context) {
  integrator::SolidMotion& moving = *engine_;
  const std::vector<double> target = begin_step(step);
  if (all_held_) {
    hold_all(target, step.stage == numeric::Stage::whole ? h : step.to - step.from, context);
    return;
  }
  if (!target.empty())
    moving.move_held(target);
  const integrator::SolidStep took = moving.step(h, context, step.stage);
  counts_.rounds += static_cast<std::uint64_t>(took.rounds);
  counts_.factors += static_cast<std::uint64_t>(took.factorisations);
  counts_.unfinished += took.left <= options_.tolerance ? 0 : 1;
  counts_.limited += took.limited ? 1 : 0;
}

void SolidDynamic::step(double h, const contact::Interval& step, const Context& context) {
  const std::vector<double> before(engine_->places().begin(), engine_->places().end());
  move(h, step, context);
  settle(before, step.to, 0, context);
}

/// A step of second order by two stages of h.
void SolidDynamic::two_stages(double h, const contact::Interval& step, const Context& context) {
  const std::vector<double> before(engine_->places().begin(), engine_->places().end());
  const auto [first, second] = contact::stages_of(step);
  move(h, first, context);
  if (has_first_stage())
    move(h, second, context);
  else // by recovery, of first order
    move(keep_length(second.to - second.from), {second.from, second.to}, context);
  settle(before, step.to, 0, context);
}

bool SolidDynamic::has_first_stage() const {
  return all_held_ || (engine_ && engine_->has_first_stage(state_.last_step));
}

// ---- contact

const contact::ModelSurface& SolidDynamic::collision_surface() {
  if (surface_)
    return *surface_;
  surface_ = contact::model_surface(model_);
  return *surface_;
}

contact::ContactBody& SolidDynamic::begin_contact_step(const contact::Interval& step,
                                                       const Context& context) {
  integrator::SolidMotion& moving = engine(context);
  const bool second = step.stage == numeric::Stage::second;
  const double h = second ? state_.last_step : keep_length(step.to - step.from);
  step_ = step;
  if (!second)
    begun_.assign(moving.places().begin(), moving.places().end());
  state_.version = ++versions_;
  if (!body_)
    body_ =
        std::make_unique<SolidContactBody>(moving, collision_surface().node, model_.nodes.size());
  std::vector<double> target = begin_step(step);
  if (all_held_) {
    std::vector<Vec3> before, behind;
    for (const std::uint32_t node : collision_surface().node) {
      before.push_back(vector_at(moving.places(), node));
      behind.push_back(model_.nodes[node].position +
                       vector_at(std::span<const double>(target), node));
    }
    target_ = std::move(target);
    held_body_ = std::make_unique<contact::HeldBody>(std::move(before), std::move(behind));
    return *held_body_;
  }
  if (!target.empty())
    moving.move_held(target);
  moving.begin_step(h, context, 0, step.stage);
  if (!typical_)
    typical_ = contact::typical_contact(model_);
  contact::TypicalContact typical = *typical_;
  typical.force = typical_force(h, typical.force);
  body_->begin(h, state_.contact, typical, context);
  return *body_;
}

void SolidDynamic::end_contact_step(std::span<const contact::VertexForce> forces, bool still,
                                    const Context& context) {
  integrator::SolidMotion& moving = *engine_;
  const double length = step_.to - step_.from;
  integrator::SolidStep took;
  viscous::MemoryState was; // no time passes while surfaces part
  if (all_held_) {
    std::vector<double> all = load_;
    for (const contact::VertexForce& f : forces)
      for (int a = 0; a < 3; ++a)
        all[axis_of(collision_surface().node[f.vertex], a)] += f.force[a];
    moving.set_load(all);
    hold_all(target_, length, context);
  } else {
    if (still)
      was = moving.memory();
    took = moving.end_step(body_->forces(), context, body_->inner_factor());
  }
  state_.contact.assign(forces.begin(), forces.end());
  state_.version = ++versions_;
  state_.resting = false;
  motion_shown_ = false;
  counts_.steps += step_.stage == numeric::Stage::first ? 0 : 1;
  counts_.rounds += static_cast<std::uint64_t>(took.rounds);
  counts_.factors += static_cast<std::uint64_t>(took.factorisations);
  if (still) {
    const std::vector<double> places(moving.places().begin(), moving.places().end());
    if (was.tensors)
      moving.set_memory(was);
    moving.restore(places, *state_.velocity, context);
    take_over();
    return;
  }
  counts_.limited += body_ && body_->inner_factor() < 1 ? 1 : 0;
  if (step_.stage != numeric::Stage::first) {
    const double whole =
        step_.stage == numeric::Stage::second ? length / (1 - numeric::stage_length) : length;
    settle(begun_, step_.to, forces.empty() ? 0 : rest_in_contact * whole, context);
  }
  take_over();
  state_.time = step_.to;
}

/// An eighth of the load of a body, or of the force that would stop a free one in a step; else
/// `strained`.
double SolidDynamic::typical_force(double h, double strained) const {
  if (all_held_)
    return 0;
  Vec3 load, momentum;
  for (std::uint32_t i = 0; i < model_.nodes.size(); ++i) {
    load += vector_at(std::span<const double>(load_), i);
    momentum += engine_->masses()[i] * vector_at(engine_->velocity(), i);
  }
  if (norm(load) > 0)
    return norm(load) / 8;
  const bool free = std::ranges::none_of(held_, [](std::uint8_t held) { return held != 0; });
  if (free && norm(momentum) > 0)
    return norm(momentum) / (8 * h);
  return strained;
}

void SolidDynamic::clear_contact() {
  state_.contact.clear();
}

/// The engine's state, to be kept.
void SolidDynamic::take_over() {
  const auto keep = [](std::span<const double> from, CopyOnWrite<std::vector<double>>& to) {
    to.replace().assign(from.begin(), from.end());
  };
  keep(engine_->places(), state_.places);
  keep(engine_->velocity(), state_.velocity);
  keep(engine_->reactions(), state_.reactions);
  state_.energies = {engine_->kinetic_energy(), engine_->elastic_energy()};
}

std::vector<contact::NodeVector> SolidDynamic::contact_forces() const {
  std::vector<contact::NodeVector> forces;
  forces.reserve(state_.load->displacement.size());
  for (const auto& [node, displacement] : state_.load->displacement) {
    Vec3 force = vector_at(*state_.reactions, node);
    for (int a = 0; a < 3; ++a)
      if (contact::is_fixed(model_, node, a) || force[a] == 0)
        force[a] = 0; // no -0
    forces.push_back({node, force});
  }
  return forces;
}

SolidStepCounts SolidDynamic::take_counts() {
  return std::exchange(counts_, {});
}

std::optional<MotionEnergies> SolidDynamic::energies() const {
  return state_.energies;
}

} // namespace gewebe::dynamics
