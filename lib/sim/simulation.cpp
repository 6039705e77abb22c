#include "sim/simulation.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace gewebe {

namespace {

constexpr double strain_limit = 0.1, turn_limit = 0.2;
constexpr double same_time = 1e-9; // of a step's length

std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::string percent(double part) {
  return number_text(std::round(1000 * part) / 10) + " %";
}

} // namespace

struct Simulation::Object {
  std::string name;
  Model model; // never moves: the methods refer to it
  Method method = Method::ela;
  Load load;
  std::optional<Elastostatic> still;
  std::optional<Elastodynamic> moving;
  double safe = 0; // largest stable step

  std::vector<double> displacement;
  std::vector<NodeVector> forces;
  bool shown = true; // displacement and forces are those of the present state
  bool warned_range = false, warned_step = false;
};

Simulation::Simulation(const Context& context, SimulationOptions options)
    : context_(context), options_(std::move(options)) {
  context_.progress = nullptr;
}
Simulation::~Simulation() = default;

void Simulation::add_object(const std::string& name, Model model, Method method,
                            StiffnessParts parts) {
  for (const auto& other : objects_)
    if (other->name == name)
      throw Error("there is an object '" + name + "' already, expected another name");
  auto object = std::make_unique<Object>();
  object->name = name;
  object->model = std::move(model);
  object->method = method;
  object->displacement.assign(3 * object->model.nodes.size(), 0);
  object->load.gravity = gravity_;
  if (method == Method::ffe) {
    object->still.emplace(object->model, std::move(parts), context_,
                          ElastostaticOptions{.measure_error = options_.measure_error});
  } else {
    object->safe = safe_step(object->model);
    object->moving.emplace(object->model);
  }
  object->shown = object->load.empty();
  objects_.push_back(std::move(object));
}

const std::string& Simulation::name(std::size_t object) const {
  return objects_.at(object)->name;
}

const Model& Simulation::model(std::size_t object) const {
  return objects_.at(object)->model;
}

Method Simulation::method(std::size_t object) const {
  return objects_.at(object)->method;
}

std::size_t Simulation::find(const std::string& name) const {
  std::string list;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (objects_[i]->name == name)
      return i;
    list += (list.empty() ? "" : ", ") + objects_[i]->name;
  }
  throw Error("there is no object '" + name + "', expected " +
              (list.empty() ? "an object command first" : "one of " + list));
}

void Simulation::check(const Change& change) const {
  const auto* const set = std::get_if<SetDisplacement>(&change);
  if (set == nullptr)
    return;
  const Model& model = objects_.at(set->object)->model;
  for (const std::uint32_t node : set->nodes)
    for (int a = 0; a < 3; ++a)
      if (is_fixed(model, node, a) && set->displacement[a] != 0)
        throw Error("node " + std::to_string(node) + " is fixed along " + "xyz"[a] +
                    ", expected a displacement of 0 there");
}

void Simulation::apply(const Change& change) {
  check(change);
  Object* touched = nullptr;
  if (const auto* const force = std::get_if<SetForce>(&change)) {
    touched = objects_.at(force->object).get();
    for (const std::uint32_t node : force->nodes)
      if (force->force == Vec3{})
        touched->load.force.erase(node);
      else
        touched->load.force[node] = force->force;
  } else if (const auto* const set = std::get_if<SetDisplacement>(&change)) {
    touched = objects_.at(set->object).get();
    for (const std::uint32_t node : set->nodes)
      touched->load.displacement[node] = set->displacement;
  } else if (const auto* const release = std::get_if<Release>(&change)) {
    touched = objects_.at(release->object).get();
    for (const std::uint32_t node : release->nodes) {
      touched->load.force.erase(node);
      touched->load.displacement.erase(node);
    }
  } else if (const auto* const pull = std::get_if<SetGravity>(&change)) {
    gravity_ = pull->gravity;
    for (const auto& object : objects_) {
      object->load.gravity = gravity_;
      object->shown = false;
    }
  } else if (const auto* const wish = std::get_if<SetTimestep>(&change)) {
    timestep_ = wish->dt;
  } else if (std::get<Emit>(change).forces) {
    emit_forces_ = true;
  } else {
    emit_shapes_ = true;
  }
  if (touched != nullptr)
    touched->shown = false;
}

void Simulation::schedule(double time, const Change& change) {
  if (!(time >= time_))
    throw Error("the time " + number_text(time) + " s is past, expected " + number_text(time_) +
                " s or later");
  if (time == time_) {
    apply(change);
    return;
  }
  check(change);
  events_.emplace(time, change);
}

void Simulation::step(double dt) {
  // Neumaier's sum: ten steps of 0.1 s end at 1 s.
  const double sum = sum_ + dt;
  const double lost = lost_ + (sum_ >= dt ? (sum_ - sum) + dt : (dt - sum) + sum_);
  advance(std::max(sum + lost, time_));
  sum_ = sum;
  lost_ = lost;
}

void Simulation::step_to(double time) {
  if (!(time >= time_))
    throw Error("the time " + number_text(time) + " s is past, expected " + number_text(time_) +
                " s or later");
  advance(time);
  sum_ = time;
  lost_ = 0;
}

template <class Work>
void Simulation::at_object(const Object& object, Work&& work) {
  try {
    work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error("object " + object.name + " at " + number_text(time_) +
                " s: " + (error.place().empty() ? "" : error.place() + ": ") + error.what());
  }
}

double Simulation::integration_step(Object& object) {
  const double usual = safe_step_fraction * object.safe;
  if (!timestep_)
    return usual;
  if (*timestep_ <= object.safe)
    return *timestep_;
  if (!object.warned_step && options_.warn)
    options_.warn("object " + object.name + ": the timestep " + number_text(*timestep_) +
                  " s is beyond the safe " + number_text(object.safe) +
                  " s, it takes smaller ones");
  object.warned_step = true;
  return usual;
}

void Simulation::advance(double to) {
  const double slack = same_time * (to - time_);
  const auto move_to = [&](double time) {
    const double duration = time - time_;
    for (const auto& object : objects_) {
      if (!object->moving)
        continue;
      if (!object->shown)
        object->moving->set_load(object->load);
      if (!(duration > 0))
        continue;
      at_object(*object, [&] {
        const std::uint64_t taken =
            object->moving->advance(duration, integration_step(*object), context_);
        counts_.integration += taken;
        counts_.resting += taken == 0 ? 1 : 0;
        object->shown = object->shown && taken == 0;
      });
    }
    time_ = std::max(time_, time);
  };
  while (!events_.empty() && events_.begin()->first <= to + slack) {
    move_to(std::min(events_.begin()->first, to));
    const Change change = std::move(events_.begin()->second);
    events_.erase(events_.begin());
    apply(change);
  }
  move_to(to);
  for (const auto& object : objects_)
    if (!object->shown)
      at_object(*object, [&] { show(*object); });
  ++counts_.steps;
}

void Simulation::show(Object& object) {
  if (object.still) {
    object.still->update(object.load);
    const std::span<const double> u = object.still->displacement();
    object.displacement.assign(u.begin(), u.end());
    object.forces = object.still->contact_forces();
    if (!object.warned_range)
      warn_of_range(object);
  } else {
    object.moving->set_load(object.load);
    const std::span<const NodeMotion> motion = object.moving->motion();
    for (std::size_t i = 0; i < motion.size(); ++i)
      for (int a = 0; a < 3; ++a)
        object.displacement[3 * i + static_cast<std::size_t>(a)] = motion[i].displacement[a];
    object.forces = object.moving->contact_forces();
  }
  object.shown = true;
}

void Simulation::warn_of_range(Object& object) {
  const LinearRange range = linear_range(object.model, object.displacement);
  const bool strained = !(range.strain <= strain_limit), turned = !(range.turn <= turn_limit);
  if (!strained && !turned)
    return;
  object.warned_range = true;
  if (!options_.warn)
    return;
  const Spring& spring = object.model.springs[strained ? range.strain_spring : range.turn_spring];
  options_.warn("object " + object.name + " at " + number_text(time_) +
                " s: beyond the linear range, the edge " + std::to_string(spring.i) + "-" +
                std::to_string(spring.j) +
                (strained ? " is strained by " + percent(range.strain)
                          : " is turned by " + percent(range.turn)) +
                ", the shape is not to be trusted there");
}

std::span<const double> Simulation::displacement(std::size_t object) const {
  return objects_.at(object)->displacement;
}

const std::vector<NodeVector>& Simulation::contact_forces(std::size_t object) const {
  return objects_.at(object)->forces;
}

SimulationCounts Simulation::counts() const {
  SimulationCounts all = counts_;
  ElastostaticCounts& sum = all.elastostatic;
  for (const auto& object : objects_) {
    if (!object->still)
      continue;
    const ElastostaticCounts& c = object->still->counts();
    sum.updates += c.updates;
    sum.unchanged += c.unchanged;
    sum.solves += c.solves;
    sum.columns_read += c.columns_read;
    sum.factors += c.factors;
    sum.backward_error = std::max(sum.backward_error, c.backward_error);
    sum.contact_error = std::max(sum.contact_error, c.contact_error);
  }
  return all;
}

} // namespace gewebe
