#include "dynamics/solid_static.h"

#include "base/error.h"
#include "dynamics/solid_law.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "linalg/condition.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace gewebe::dynamics {

namespace {

/// What is left of the way to a shape, over the displacement: a hundredth of what contact and the
/// quickest readers of results (single precision, forces within 1e-4) resolve.
constexpr double tolerance_at_rest = 1e-6;
constexpr int max_rounds = 400;
/// Of the volume, inside out: a shape with more is none, as in
/// integrator/motion_recovery_internal.h. Coarse elements at sharp folds may be so in the shape of
/// least energy.
constexpr double scrambled_part = 0.01;
/// Shortest part of the way to a load.
constexpr double least_part = 1.0 / 64;
/// Change of the pressure's forces by a last shape, over all of them; shapes until then, and those
/// in a row that are no nearer to it than one before.
constexpr double pressure_tolerance = 1e-7;
constexpr int max_pressings = 40, max_astray = 6;
/// Steps of a viscoelastic solid, over the sum of its shortest time and the time since its load
/// changed: creep is then within 3e-4.
constexpr double relaxation_step = 0.1;
/// ... while the load changes, over the shortest time and over the change's own; at most so many.
constexpr double gradual_step = 0.1, gradual_part = 1.0 / 8, most_gradual = 256;

/// The load on the way between two. \param places  where nodes stood under `from`
contact::Load part_of_way(const model::Model& model, const contact::Load& from,
                          const contact::Load& to, std::span<const double> places, double part) {
  if (part == 1)
    return to;
  contact::Load load;
  load.gravity = from.gravity + part * (to.gravity - from.gravity);
  for (const auto& [node, f] : from.force)
    load.force[node] += (1 - part) * f;
  for (const auto& [node, f] : to.force)
    load.force[node] += part * f;
  for (const auto& [node, p] : from.pressure)
    load.pressure[node].pressure += (1 - part) * p.pressure;
  for (const auto& [node, p] : to.pressure)
    load.pressure[node].pressure += part * p.pressure;
  for (const auto& [node, u] : to.displacement) {
    const Vec3 stood = vector_at(places, node) - model.nodes[node].position;
    load.displacement[node] = stood + part * (u - stood);
  }
  return load;
}

} // namespace

struct SolidStatic::State {
  const model::Model& model;
  Context context;
  integrator::SolidLaw law;
  std::vector<double> rest; // places
  integrator::SolidMotion engine;
  std::vector<std::uint8_t> held; // of the engine
  bool prepared = false;          // its factor, for what is held
  std::optional<Vec3> weighed;
  std::vector<double> weight;
  std::shared_ptr<const SolidRest> answer;
  std::vector<double> displacement; // of the answer, once it was read
  contact::TypicalContact typical;
  std::vector<std::uint32_t> vertices; // of the body
  std::unique_ptr<SolidContactBody> body;
  contact::Load acting; // in the step with contact
  RestTime acting_time;
  double shortest = 0;         // s, of a Prony series; 0: elastic
  viscous::MemoryState memory; // from which the next shape is sought
  SolidStaticCounts counts;

  static integrator::SolidMotionOptions options(integrator::SolidLaw law) {
    integrator::SolidMotionOptions options;
    options.law = law;
    options.tolerance = tolerance_at_rest;
    options.max_rounds = max_rounds;
    options.recover = false;
    return options;
  }

  State(const model::Model& m, integrator::SolidLaw l, const Context& c)
      : model(m), context(c), law(l),
        engine(fem::element_mesh(m), fem::element_materials(m), options(l), c),
        typical(contact::typical_contact(m)) {
    for (const model::Node& node : m.nodes)
      rest.insert(rest.end(), {node.position.x, node.position.y, node.position.z});
    if (is_viscoelastic(m))
      shortest = HUGE_VAL;
    for (const model::Material& material : m.materials)
      for (const model::PronyTerm& term : material.prony)
        shortest = std::min(shortest, term.time);
  }

  std::vector<double> start() const { return answer ? answer->places : rest; }

  // ---- loads

  /// Forces on the 3 n axes but those that follow.
  std::vector<double> dead_forces(const contact::Load& load) {
    if (weighed != load.gravity) {
      weight = fem::weight_of(model, load.gravity);
      weighed = load.gravity;
    }
    std::vector<double> all = weight;
    for (const auto& [node, force] : load.force)
      for (int a = 0; a < 3; ++a)
        all[axis_of(node, a)] += force[a];
    return all;
  }

  /// All of them, with nodes at these places.
  std::vector<double> forces(const contact::Load& load, std::span<const double> places) {
    std::vector<double> all = dead_forces(load);
    const auto add = [&](std::uint32_t node, const Vec3& force) {
      for (int a = 0; a < 3; ++a)
        all[axis_of(node, a)] += force[a];
    };
    if (!load.pressure.empty())
      contact::press(
          contact::pressed_corners(load, model), 0,
          [&](std::uint32_t node) { return vector_at(places, node); }, add);
    return all;
  }

  /// Holds what the model and the load hold.
  void hold(const contact::Load& load) {
    std::vector<std::uint8_t> now(3 * model.nodes.size());
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        now[axis_of(i, a)] =
            contact::is_fixed(model, i, a) || load.displacement.contains(i) ? 1 : 0;
    if (now != held) {
      engine.hold(now);
      held = std::move(now);
      prepared = false;
    }
    if (prepared)
      return;
    require_held();
    ++counts.factors;
    prepared = true;
  }

  /// \throw SingularStiffness
  void require_held() {
    try {
      if (engine.condition(context) <= linalg::max_condition)
        return;
    } catch (const linalg::NotPositiveDefinite&) {
      // Named below.
    }
    linalg::StiffnessCheck check;
    const tetrahedra::TetMesh mesh = fem::element_mesh(model);
    (void)linalg::checked_factor(
        model,
        fem::solid_stiffness(
            mesh, fem::solid_elements(mesh, fem::element_materials(model), context), held, context),
        context, check);
    throw linalg::SingularStiffness("the model is free to move, expected more nodes that are held");
  }

  std::vector<double> targets(const contact::Load& load) const {
    std::vector<double> all(rest.size());
    for (const auto& [node, u] : load.displacement)
      for (int a = 0; a < 3; ++a)
        all[axis_of(node, a)] = contact::is_fixed(model, node, a) ? 0 : u[a];
    return all;
  }

  void begin(const contact::Load& load, std::span<const double> places) {
    hold(load);
    if (shortest > 0)
      engine.set_memory(memory);
    engine.restore(places, std::vector<double>(places.size()), context);
    engine.set_load(forces(load, places));
    if (!load.displacement.empty())
      engine.move_held(targets(load));
  }

  // ---- shapes

  /// Whether too much of the volume is inside out: a minimum of another kind than tissue has.
  bool is_inside_out() const {
    const auto volume = [](std::span<const double> x, const Tetrahedron& t) {
      return tetrahedra::tetrahedron_volume(vector_at(x, t[0]), vector_at(x, t[1]),
                                            vector_at(x, t[2]), vector_at(x, t[3]));
    };
    double all = 0, turned = 0;
    for (const Tetrahedron& t : model.tetrahedra) {
      const double own = volume(rest, t);
      all += own;
      turned += volume(engine.places(), t) > 0 ? 0 : own;
    }
    return turned > scrambled_part * all;
  }

  bool settle(double elapsed = 0) {
    const integrator::SolidStep step = engine.settle(context, elapsed);
    counts.rounds += static_cast<std::uint64_t>(step.rounds);
    counts.factors += static_cast<std::uint64_t>(step.factorisations);
    return step.left <= tolerance_at_rest;
  }

  /// The same forces of pressures as forces() has.
  std::vector<integrator::FollowingForce> following(const contact::Load& load) const {
    std::vector<integrator::FollowingForce> all;
    for (const contact::PressedCorner& c : contact::pressed_corners(load, model))
      for (std::uint32_t k = 0; k < c.count; ++k)
        all.push_back({.node = c.bearers[k],
                       .triangle = c.triangle,
                       .factor = c.pressure.pressure / 6 / static_cast<double>(c.count)});
    return all;
  }

  /// As find, of hyperelastic elements: pressures are those of each round's shape.
  bool find_hyperelastic(const contact::Load& load, std::span<const double> places,
                         double elapsed) {
    begin(load, places);
    engine.set_load(dead_forces(load));
    engine.follow(following(load));
    const bool found = settle(elapsed) && !is_inside_out();
    engine.follow({});
    if (found && !load.pressure.empty()) {
      engine.set_load(forces(load, engine.places()));
      engine.find_reactions(context);
    }
    return found;
  }

  /// From places to the shape under a load. \return whether it was found
  bool find(const contact::Load& load, std::span<const double> places, double elapsed = 0) {
    if (law == integrator::SolidLaw::hyperelastic)
      return find_hyperelastic(load, places, elapsed);
    begin(load, places);
    if (!settle())
      return false;
    if (load.pressure.empty())
      return !is_inside_out();
    // Forces of the shape before: a fixed point, by Anderson's mixing of two of them.
    std::vector<double> pressed = forces(load, places), change, before, change_before;
    double nearest = HUGE_VAL;
    int astray = 0;
    for (int k = 0; k < max_pressings; ++k) {
      const std::vector<double> now = forces(load, engine.places());
      double largest = 0, off = 0, across = 0, along = 0;
      change.resize(now.size());
      for (std::size_t axis = 0; axis < now.size(); ++axis) {
        change[axis] = now[axis] - pressed[axis];
        largest = std::max(largest, std::abs(now[axis]));
        off = std::max(off, std::abs(change[axis]));
      }
      if (!(off > pressure_tolerance * largest))
        return !is_inside_out();
      astray = off < nearest ? 0 : astray + 1;
      nearest = std::min(nearest, off);
      if (astray > max_astray)
        return false;
      std::vector<double> next = now;
      if (!before.empty()) {
        for (std::size_t axis = 0; axis < now.size(); ++axis) {
          const double d = change[axis] - change_before[axis];
          across += change[axis] * d;
          along += d * d;
        }
        const double share = along > 0 ? across / along : 0;
        for (std::size_t axis = 0; axis < now.size(); ++axis)
          next[axis] -= share * (now[axis] - (before[axis] + change_before[axis]));
      }
      before = std::exchange(pressed, std::move(next));
      change_before = change;
      engine.set_load(pressed);
      if (!settle())
        return false;
    }
    return false;
  }

  void update(const contact::Load& load, const RestTime& time) {
    ++counts.updates;
    const bool same = answer && answer->balanced && answer->load == load;
    if (shortest > 0) {
      pass(load, time, same);
      return;
    }
    if (same)
      ++counts.unchanged;
    else
      change(load);
  }

  /// To the shape under a load, at once.
  void change(const contact::Load& load) {
    const contact::Load from = answer ? answer->load : contact::Load{};
    const std::vector<double> stood = start();
    // What nothing loads is as it was at rest.
    std::vector<double> places = load.empty() ? rest : stood;
    double done = 0, part = 1;
    while (done < 1) {
      const double next = std::min(1.0, done + part);
      if (find(part_of_way(model, from, load, stood, next), places)) {
        places.assign(engine.places().begin(), engine.places().end());
        memory = engine.memory();
        done = next;
        part *= 2;
        continue;
      }
      part /= 4;
      if (part < least_part)
        throw Error("no shape at rest is found beyond " +
                    text::number_text(std::round(1000 * done) / 10) +
                    " % of the way to this load, expected a smaller one, or more steps");
    }
    set(load);
  }

  /// A viscoelastic solid on its way through this time.
  void pass(const contact::Load& load, const RestTime& time, bool same) {
    RestTime span = time;
    if (answer)
      span.start = answer->time;
    double since = answer ? answer->since : span.start;
    const double duration = span.end - span.start;
    if (same && !(duration > 0)) {
      ++counts.unchanged;
      return;
    }
    memory = answer ? answer->memory : viscous::MemoryState{};
    if (!same && span.gradual && duration > 0) {
      const contact::Load from = answer ? answer->load : contact::Load{};
      const std::vector<double> stood = start();
      const double least = std::max(gradual_step * shortest, duration / most_gradual),
                   count = std::ceil(duration / std::min(least, gradual_part * duration));
      std::vector<double> places = stood;
      for (int k = 1; k <= static_cast<int>(count); ++k) {
        relax(part_of_way(model, from, load, stood, k < count ? k / count : 1), places,
              duration / count, span.start + duration * k / count);
        places.assign(engine.places().begin(), engine.places().end());
      }
      set(load, false, span.end, span.end);
      return;
    }
    if (!same) {
      change(load);
      since = span.start;
    }
    std::vector<double> places = start();
    double at = span.start;
    while (at < span.end) {
      const double left = span.end - at,
                   h = std::min(left, relaxation_step * (shortest + (at - since)));
      at = left <= 1.5 * h ? span.end : at + h;
      relax(load, places, left <= 1.5 * h ? left : h, at);
      places.assign(engine.places().begin(), engine.places().end());
    }
    set(load, false, span.end, since);
  }

  void relax(const contact::Load& load, std::span<const double> places, double elapsed, double at) {
    if (!find(load, places, elapsed))
      throw Error("no shape at rest is found of what has relaxed until " + text::number_text(at) +
                  " s, expected a smaller load, or more steps");
    memory = engine.memory();
  }

  /// The engine's state is the answer.
  void set(const contact::Load& load, bool sharp = false, double time = 0, double since = 0) {
    auto next = std::make_shared<SolidRest>();
    next->load = load;
    next->sharp = sharp;
    if (shortest > 0) {
      next->memory = engine.memory();
      next->time = time;
      next->since = since;
    }
    next->places.assign(engine.places().begin(), engine.places().end());
    next->reactions.assign(engine.reactions().begin(), engine.reactions().end());
    take(std::move(next));
  }

  void take(std::shared_ptr<const SolidRest> next) {
    answer = std::move(next);
    displacement.clear();
  }

  // ---- contact

  contact::ContactBody& begin_contact(const contact::Load& load,
                                      std::vector<contact::VertexForce> last,
                                      const RestTime& time) {
    acting = load;
    acting_time = time;
    if (answer)
      acting_time.start = answer->time;
    memory = answer ? answer->memory : viscous::MemoryState{};
    begin(load, start());
    engine.begin_step(HUGE_VAL, context, std::max(0.0, acting_time.end - acting_time.start));
    if (answer && answer->sharp)
      engine.sharpen();
    if (!body) {
      vertices = contact::model_surface(model).node;
      body = std::make_unique<SolidContactBody>(engine, vertices, model.nodes.size());
    }
    body->begin(HUGE_VAL, std::move(last), typical, context);
    if (load.pressure.empty())
      body->follow({});
    else
      body->follow([this] { engine.set_load(forces(acting, engine.iterate())); });
    return *body;
  }

  void end_contact() {
    // What holds a displaced node bears what touches it, too.
    std::vector<double> touching(body->forces().begin(), body->forces().end());
    for (std::size_t axis = 0; axis < touching.size(); ++axis)
      if (held[axis] != 0)
        touching[axis] = 0;
    const bool sharp = engine.is_sharp();
    const integrator::SolidStep step = engine.end_step(touching, context);
    counts.rounds += static_cast<std::uint64_t>(step.rounds);
    counts.factors += static_cast<std::uint64_t>(step.factorisations);
    for (std::uint32_t node = 0; node < model.nodes.size(); ++node)
      if (const Vec3 f = vector_at(std::span<const double>(touching), node); f != Vec3{})
        acting.force[node] += f;
    set(acting, sharp, acting_time.end, acting_time.end);
  }
};

SolidStatic::SolidStatic(const model::Model& model, integrator::SolidLaw law,
                         const Context& context)
    : state_(std::make_unique<State>(model, law, context)) {}
SolidStatic::~SolidStatic() = default;
SolidStatic::SolidStatic(SolidStatic&&) noexcept = default;

void SolidStatic::update(const contact::Load& load, const RestTime& time) {
  state_->update(load, time);
}

void SolidStatic::prepare(const contact::Load& load) {
  state_->hold(load);
}

std::shared_ptr<const SolidRest> SolidStatic::answer() const noexcept {
  return state_->answer;
}

void SolidStatic::restore(std::shared_ptr<const SolidRest> answer) {
  if (answer != state_->answer)
    state_->take(std::move(answer));
}

std::span<const double> SolidStatic::displacement() {
  State& s = *state_;
  if (!s.displacement.empty())
    return s.displacement;
  ++s.counts.shapes;
  s.displacement.assign(s.rest.size(), 0);
  if (!s.answer)
    return s.displacement;
  for (std::size_t axis = 0; axis < s.rest.size(); ++axis)
    s.displacement[axis] = s.answer->places[axis] - s.rest[axis];
  for (const auto& [node, u] : s.answer->load.displacement)
    for (int a = 0; a < 3; ++a)
      s.displacement[axis_of(node, a)] = contact::is_fixed(s.model, node, a) ? 0 : u[a];
  return s.displacement;
}

std::vector<contact::NodeVector> SolidStatic::holding_forces() const {
  std::vector<contact::NodeVector> forces;
  const State& s = *state_;
  if (!s.answer || s.answer->reactions.empty())
    return forces;
  for (const auto& entry : s.answer->load.displacement) {
    contact::NodeVector force{entry.first, {}};
    for (int a = 0; a < 3; ++a)
      if (!contact::is_fixed(s.model, entry.first, a))
        force.value[a] = s.answer->reactions[axis_of(entry.first, a)];
    forces.push_back(force);
  }
  return forces;
}

contact::ContactBody& SolidStatic::begin_contact(const contact::Load& load,
                                                 std::vector<contact::VertexForce> last,
                                                 const RestTime& time) {
  return state_->begin_contact(load, std::move(last), time);
}

void SolidStatic::end_contact() {
  state_->end_contact();
}

SolidStaticCounts SolidStatic::counts() const noexcept {
  return state_->counts;
}

} // namespace gewebe::dynamics
