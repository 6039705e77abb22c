#include "scene/simulation.h"

#include "scene/rules_internal.h"
#include "statics/linear_range.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::scene {

namespace {

/// The place of the one of this name among so many.
template <class NameOf>
std::size_t place_of(const std::string& name, std::size_t count, NameOf&& name_of) {
  std::size_t k = 0;
  while (k < count && name_of(k) != name)
    ++k;
  return k;
}

/// As place_of. \throw Error naming those there are
template <class NameOf>
std::size_t number_of(const char* what, const std::string& name, std::size_t count,
                      NameOf&& name_of) {
  const std::size_t place = place_of(name, count, name_of);
  if (place < count)
    return place;
  std::string list;
  for (std::size_t k = 0; k < count; ++k)
    list += (list.empty() ? "" : ", ") + name_of(k);
  throw Error(std::string("there is no ") + what + " '" + name + "', expected " +
              (list.empty() ? std::string("an ") + what + " command first" : "one of " + list));
}

void require_not_past(const World& w, double time) {
  if (!(time >= w.now.clock.time))
    throw Error("the time " + text::number_text(time) + " s is past, expected " +
                text::number_text(w.now.clock.time) + " s or later");
}

} // namespace

Simulation::Simulation(const Context& context, SimulationOptions options)
    : world_(std::make_unique<World>(World{.context = context, .options = std::move(options)})) {
  world_->context.progress = nullptr;
}
Simulation::~Simulation() = default;

// ---- objects

void Simulation::add_object(const std::string& name, ObjectSource source, Method method,
                            Integration integration, const integrator::SolidChoice& solid) {
  Object object;
  object.matter->name = name;
  object.matter->source = std::move(source);
  object.integration = integration;
  object.matter->solid = solid;
  object.method = method;
  insert(*world_, std::move(object));
}

void Simulation::add_object(const std::string& name, model::Model model, Method method,
                            std::shared_ptr<compliance::ComplianceSource> source,
                            Integration integration, const integrator::SolidChoice& solid) {
  World& w = *world_;
  Object object;
  object.matter->name = name;
  object.matter->source.model = [&] { return std::move(model); };
  object.integration = integration;
  object.matter->solid = solid;
  object.method = method;
  need_model(object);
  object.matter->source = {};
  if (method == Method::ffe && has_law(object))
    (void)strained_of(w, object);
  else if (method == Method::ffe && !is_held_altogether(object))
    make_solver(w, object, std::move(source));
  insert(w, std::move(object));
  if (method == Method::ffe)
    return;
  try {
    need_body(w, w.now.objects.size() - 1);
  } catch (...) {
    w.now.objects.pop_back();
    throw;
  }
}

std::size_t Simulation::object_count() const noexcept {
  return world_->now.objects.size();
}

const model::Model& Simulation::model(std::size_t object) const {
  need_model(world_->now.objects.at(object));
  return world_->now.objects[object].model();
}

const model::Model& Simulation::first_model(std::size_t object) const {
  const model::Model& now = model(object);
  const auto& first = world_->now.objects[object].cut.first;
  return first ? *first : now;
}

model::Model Simulation::weighed_model(std::size_t object) const {
  need_model(world_->now.objects.at(object));
  return scene::weighed_model(world_->now.objects[object]);
}

ObjectFacts Simulation::object(std::size_t object) const {
  const Object& one = world_->now.objects.at(object);
  const Shown& shown = one.shown;
  const auto whole = [&] {
    return !shown.whole->empty() || shown.displacement->size() == 3 * one.model().nodes.size();
  };
  return {one.name(),
          one.method,
          one.matter->known,
          one.matter->known && shown.shaped && whole(),
          one.body != nullptr && !one.body->moving->resting(),
          one.stages.model != nullptr,
          one.warp,
          (one.method == Method::ela || has_law(one)) && one.matter->known && is_solid(one),
          law_of(one).value_or(integrator::SolidLaw::corotational),
          *one.cut.first_nodes,
          *one.cut.places};
}

std::size_t find_object(const Simulation& simulation, const std::string& name) {
  return number_of("object", name, simulation.object_count(),
                   [&](std::size_t k) { return simulation.object(k).name; });
}

// ---- instruments

std::size_t Simulation::instrument_count() const noexcept {
  return world_->now.instruments.size();
}

std::size_t find_instrument(const Simulation& simulation, const std::string& name) {
  return number_of("instrument", name, simulation.instrument_count(),
                   [&](std::size_t k) { return simulation.instrument(k).name; });
}

std::size_t instrument_place(const Simulation& simulation, const std::string& name) {
  return place_of(name, simulation.instrument_count(),
                  [&](std::size_t k) { return simulation.instrument(k).name; });
}

InstrumentReport Simulation::instrument(std::size_t instrument) const {
  return report_of(*world_, instrument);
}

std::vector<AttachmentReport> Simulation::attachments() const {
  const auto position = [&](std::size_t object, std::uint32_t node) {
    const Object& o = world_->now.objects[object];
    return o.model().nodes[node].position + motion_of(o)[node].displacement;
  };
  std::vector<AttachmentReport> all;
  for (const Tie& tie : world_->now.ties) {
    auto found = std::ranges::find_if(all, [&](const AttachmentReport& a) {
      return a.object == tie.object && a.other == tie.other;
    });
    if (found == all.end())
      found = all.insert(all.end(), AttachmentReport{tie.object, tie.other, 0, {}});
    ++found->springs;
    const Vec3 way = position(tie.other, tie.other_node) - position(tie.object, tie.node);
    const double length = norm(way);
    if (length > 0)
      found->force += way * (tie.stiffness * (length - tie.rest) / length);
  }
  return all;
}

// ---- changes

void Simulation::apply(const Change& change) {
  scene::apply(*world_, change);
}

void Simulation::schedule(double time, const Change& change, std::optional<double> period) {
  World& w = *world_;
  require_not_past(w, time);
  if (period) {
    require_period(*period);
    accept(w, change);
    w.now.events.write().emplace(time + *period, Event{change, time, *period, 1});
    return;
  }
  if (time == w.now.clock.time) {
    apply(change);
    return;
  }
  accept(w, change);
  announce(w, change);
  w.now.events.write().emplace(time, Event{change});
}

std::size_t Simulation::pending() const noexcept {
  const auto& events = *world_->now.events;
  return static_cast<std::size_t>(std::count_if(
      events.begin(), events.end(), [](const auto& e) { return e.second.period == 0; }));
}

// ---- time

double Simulation::time() const noexcept {
  return world_->now.clock.time;
}

const SceneSettings& Simulation::settings() const noexcept {
  return world_->now.settings;
}

void Simulation::step(double dt) {
  World& w = *world_;
  const Clock clock = w.now.clock;
  // Neumaier's sum: ten steps of 0.1 s end at 1 s.
  const double sum = clock.sum + dt;
  if (!std::isfinite(sum))
    throw Error("a step of " + text::number_text(dt) + " s from " + text::number_text(clock.time) +
                " s, expected an end that is finite");
  const double lost =
      clock.lost + (clock.sum >= dt ? (clock.sum - sum) + dt : (dt - sum) + clock.sum);
  guarded(w, [&] { advance(w, std::max(sum + lost, clock.time)); });
  w.now.clock.sum = sum;
  w.now.clock.lost = lost;
}

void Simulation::step_to(double time) {
  World& w = *world_;
  require_not_past(w, time);
  guarded(w, [&] { advance(w, time); });
  w.now.clock.sum = time;
  w.now.clock.lost = 0;
}

// ---- results

std::span<const double> Simulation::displacement(std::size_t object) const {
  return whole_shape(*world_, world_->now.objects.at(object));
}

std::span<const double> Simulation::local_displacement(std::size_t object) const {
  Object& one = world_->now.objects.at(object);
  const std::span<const double> whole = whole_shape(*world_, one);
  return one.method == Method::ffe && one.warped ? warped_of(*world_, one).local_displacement()
                                                 : whole;
}

std::span<const double> Simulation::surface_displacement(std::size_t object) const {
  shape(*world_, world_->now.objects.at(object));
  return *world_->now.objects[object].shown.displacement;
}

std::span<const double> Simulation::known_surface(std::size_t object) const {
  const Shown& shown = world_->now.objects.at(object).shown;
  return shown.shaped ? std::span<const double>(*shown.displacement) : std::span<const double>();
}

std::size_t Simulation::surface_nodes(std::size_t object) const {
  const model::Model& now = model(object);
  if (now.tetrahedra.empty())
    return now.nodes.size();
  return node_counts(object).surface;
}

const model::NodeCounts& Simulation::node_counts(std::size_t object) const {
  const model::Model& now = model(object);
  std::optional<model::NodeCounts>& counts = world_->now.objects[object].matter->counts;
  if (!counts)
    counts = gewebe::model::node_counts(now);
  return *counts;
}

const std::vector<contact::NodeVector>& Simulation::contact_forces(std::size_t object) const {
  return *world_->now.objects.at(object).shown.forces;
}

void Simulation::want_shapes() noexcept {
  world_->options.shapes = true;
}

const News& Simulation::news() const noexcept {
  return world_->now.news;
}

void Simulation::take_news() noexcept {
  world_->now.news = {};
}

void Simulation::warn_of_thresholds() {
  const World& w = *world_;
  for (Object& object : world_->now.objects) {
    Stages& stages = object.stages;
    if (!stages.options || stages.warned)
      continue;
    const auto& two_step = object.statics.two_step;
    const double largest = two_step ? two_step->largest() : 0;
    if (largest > stages.options->threshold)
      continue;
    stages.warned = true;
    if (w.options.warn)
      w.options.warn("object " + object.name() + ": its load never exceeded the threshold " +
                     text::number_text(stages.options->threshold) + " of two-step (" +
                     text::number_text(largest) + " at most), so the second stage had no effect");
  }
}

SimulationCounts Simulation::counts() const {
  SimulationCounts all = world_->now.counts;
  for (const Object& object : world_->now.objects) {
    const Statics& statics = object.statics;
    add_counts(all.elastostatic, static_counts(object));
    if (!statics.two_step)
      continue;
    const statics::ElastostaticCounts second = statics.two_step->second_counts();
    all.elastostatic.solves += second.solves;
    all.elastostatic.columns_read += second.columns_read;
    all.elastostatic.factors += second.factors;
  }
  return all;
}

SimulationState Simulation::state() const {
  SimulationState state;
  for (std::size_t i = 0; i < object_count(); ++i) {
    if (!object(i).known)
      continue;
    if (!model(i).springs.empty() && this->object(i).shaped)
      state.strain =
          std::max(state.strain, statics::linear_range(model(i), displacement(i)).strain);
    const Object& object = world_->now.objects[i];
    if (object.body == nullptr)
      continue;
    if (const auto energies = object.body->moving->energies()) { // of all parts
      const bool first = object.body->parts[0] == i;
      state.kinetic_energy += first ? energies->kinetic : 0;
      state.elastic_energy += first ? energies->elastic : 0;
      continue;
    }
    const std::span<const dynamics::NodeMotion> motion = motion_of(object);
    state.kinetic_energy += dynamics::kinetic_energy(object.model(), motion);
    for (const auto& [node, mass] : *object.hung)
      state.kinetic_energy += mass * dot(motion[node].velocity, motion[node].velocity) / 2;
    state.elastic_energy += dynamics::elastic_energy(object.model(), motion);
    state.safe_step = std::min(state.safe_step, object.body->safe);
  }
  return state;
}

} // namespace gewebe::scene
