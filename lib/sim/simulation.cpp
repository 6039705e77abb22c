#include "sim/simulation.h"

#include "base/error.h"
#include "sim/simulation_internal.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace gewebe {

std::string simulation::number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

Simulation::Simulation(const Context& context, SimulationOptions options)
    : context_(context), options_(std::move(options)) {
  context_.progress = nullptr;
}
Simulation::~Simulation() = default;

void Simulation::add_object(const std::string& name, Model model, Method method,
                            StiffnessParts parts, Integration integration) {
  for (const auto& other : objects_)
    if (other->name == name)
      throw Error("there is an object '" + name + "' already, expected another name");
  auto object = std::make_unique<Object>();
  object->name = name;
  object->model = std::move(model);
  object->method = method;
  object->integration = integration;
  object->displacement.assign(3 * object->model.nodes.size(), 0);
  object->load.gravity = gravity_;
  object->shown = object->load.empty();
  if (method == Method::ffe)
    object->still.emplace(object->model, std::move(parts), context_,
                          ElastostaticOptions{.measure_error = options_.measure_error,
                                              .tolerance = options_.tolerance});
  objects_.push_back(std::move(object));
  if (method == Method::ffe)
    return;
  try {
    bodies_.push_back(make_body({objects_.size() - 1}));
  } catch (...) {
    objects_.pop_back();
    throw;
  }
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

std::span<const double> Simulation::displacement(std::size_t object) const {
  shape(*objects_.at(object));
  return objects_[object]->displacement;
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
    const ElastostaticCounts c = object->still->counts();
    sum.updates += c.updates;
    sum.unchanged += c.unchanged;
    sum.shapes += c.shapes;
    sum.terms += c.terms;
    sum.skipped += c.skipped;
    sum.shape_error = std::max(sum.shape_error, c.shape_error);
    sum.solves += c.solves;
    sum.columns_read += c.columns_read;
    sum.factors += c.factors;
    sum.backward_error = std::max(sum.backward_error, c.backward_error);
    sum.contact_error = std::max(sum.contact_error, c.contact_error);
    if (!object->two_step)
      continue;
    const ElastostaticCounts second = object->two_step->second_counts();
    sum.solves += second.solves;
    sum.columns_read += second.columns_read;
    sum.factors += second.factors;
  }
  return all;
}

SimulationState Simulation::state() const {
  SimulationState state;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const auto& object = objects_[i];
    state.strain = std::max(state.strain, linear_range(object->model, displacement(i)).strain);
    if (object->body == nullptr)
      continue;
    const auto motion =
        object->body->moving->motion().subspan(object->offset, object->model.nodes.size());
    state.kinetic_energy += kinetic_energy(object->model, motion);
    state.elastic_energy += elastic_energy(object->model, motion);
    state.safe_step = std::min(state.safe_step, object->body->safe);
  }
  return state;
}

} // namespace gewebe
