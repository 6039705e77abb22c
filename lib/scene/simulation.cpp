#include "scene/simulation.h"

#include "base/error.h"
#include "scene/simulation_internal.h"

#include <algorithm>
#include <utility>

namespace gewebe {

using simulation::add_counts;

void simulation::add_counts(ElastostaticCounts& sum, const ElastostaticCounts& more) {
  sum.updates += more.updates;
  sum.unchanged += more.unchanged;
  sum.shapes += more.shapes;
  sum.terms += more.terms;
  sum.skipped += more.skipped;
  sum.solves += more.solves;
  sum.columns_read += more.columns_read;
  sum.factors += more.factors;
  sum.backward_error = std::max(sum.backward_error, more.backward_error);
  sum.contact_error = std::max(sum.contact_error, more.contact_error);
  sum.shape_error = std::max(sum.shape_error, more.shape_error);
}

Simulation::Simulation(const Context& context, SimulationOptions options)
    : context_(context), options_(std::move(options)), undo_(std::make_unique<Undo>()) {
  context_.progress = nullptr;
}
Simulation::~Simulation() = default;

const std::string& Simulation::name(std::size_t object) const {
  return objects_.at(object)->name;
}

const Model& Simulation::model(std::size_t object) const {
  need_model(*objects_.at(object));
  return objects_[object]->model;
}

const Model& Simulation::first_model(std::size_t object) const {
  need_model(*objects_.at(object));
  return objects_[object]->first ? *objects_[object]->first : objects_[object]->model;
}

std::span<const std::uint32_t> Simulation::first_nodes(std::size_t object) const {
  return objects_.at(object)->first_nodes;
}

std::span<const std::uint32_t> Simulation::places(std::size_t object) const {
  return objects_.at(object)->places;
}

bool Simulation::known(std::size_t object) const {
  return objects_.at(object)->known;
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
  for (const auto& object : objects_) {
    add_counts(all.elastostatic, object->spent);
    if (object->still)
      add_counts(all.elastostatic, object->still->counts());
    if (!object->two_step)
      continue;
    const ElastostaticCounts second = object->two_step->second_counts();
    all.elastostatic.solves += second.solves;
    all.elastostatic.columns_read += second.columns_read;
    all.elastostatic.factors += second.factors;
  }
  return all;
}

std::vector<std::size_t> Simulation::take_renewed() {
  return std::exchange(renewed_, {});
}

SimulationState Simulation::state() const {
  SimulationState state;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const auto& object = objects_[i];
    if (!object->known)
      continue;
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
