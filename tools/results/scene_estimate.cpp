#include "tools/results/scene_estimate.h"

#include "fem/solid_model.h"
#include "fem/stress.h"
#include "fem/stress_error.h"
#include "geometry/vector_at.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace gewebe::cli {

namespace {

/// Whether small strains of tetrahedra alone give the object's shape.
bool can_estimate(const scene::ObjectFacts& object, const model::Model& model) {
  return object.method == scene::Method::ffe && !object.element_frames && !object.warp &&
         !object.staged && !model.tetrahedra.empty() && model.springs.empty();
}

/// Nodes that are displaced or touched: they stand where they must.
std::vector<std::uint8_t> led_nodes(std::span<const contact::NodeVector> forces,
                                    std::size_t nodes) {
  std::vector<std::uint8_t> led(nodes);
  for (const contact::NodeVector& f : forces)
    led[f.node] = 1;
  return led;
}

} // namespace

std::vector<formats::EstimateAnswer> SceneEstimates::find(const scene::Simulation& simulation,
                                                          const Vec3& gravity) {
  std::vector<formats::EstimateAnswer> answers;
  for (std::size_t i = 0; i < simulation.object_count(); ++i) {
    const scene::ObjectFacts facts = simulation.object(i);
    formats::EstimateAnswer& answer = answers.emplace_back();
    answer.object = i;
    if (!facts.known || !can_estimate(facts, simulation.model(i)))
      continue;
    if (formats::topology_changed(simulation, i) || !solids_.contains(i)) {
      Solid& made = solids_[i];
      made.mesh = fem::element_mesh(simulation.model(i));
      made.materials = fem::element_materials(simulation.model(i));
      made.elements = solid_elements(made.mesh, made.materials);
    }
    Solid& solid = solids_[i];
    solid.energy.clear();
    const std::span<const double> u = simulation.displacement(i);
    std::vector<fem::CornerTensors> stresses = solid_stresses(
        solid.elements, solid_strains(solid.mesh, solid.materials, solid.elements, u, gravity));
    fem::StressError error = stress_error(solid.mesh, solid.elements, stresses);
    std::vector<double> held(u.size());
    multiply_solid(solid.mesh, solid.elements, u, held);
    const double energy = std::inner_product(u.begin(), u.end(), held.begin(), 0.0);
    fem::DiscretisationError& found = answer.error.emplace();
    if (!(energy > 0))
      continue; // nothing is deformed
    found.relative = std::accumulate(error.energy.begin(), error.energy.end(), 0.0) / energy;
    Vec3 force;
    for (const contact::NodeVector& f : simulation.contact_forces(i))
      force += f.value;
    found.force = found.relative * norm(force);
    const std::vector<std::uint8_t> led =
        led_nodes(simulation.contact_forces(i), solid.mesh.points.size());
    double farthest = 0;
    for (std::size_t node = 0; node < led.size(); ++node)
      if (led[node] == 0)
        farthest = std::max(farthest, norm(vector_at(u, node)));
    found.displacement = found.relative * farthest;
    const std::vector<linalg::SymmetricBlock> at_nodes =
        nodal_tensors(solid.mesh, solid.elements, stresses);
    double largest = -1;
    for (std::size_t node = 0; node < at_nodes.size(); ++node)
      if (const double size = fem::von_mises(at_nodes[node]); size > largest) {
        largest = size;
        found.stress = error.at_node[node];
      }
    solid.energy = std::move(error.energy);
    solid.total = energy;
    solid.stresses = std::move(stresses);
  }
  return answers;
}

std::optional<ElementErrors> SceneEstimates::elements(std::size_t object) const {
  const auto found = solids_.find(object);
  if (found == solids_.end() || found->second.energy.empty())
    return std::nullopt;
  const Solid& solid = found->second;
  return ElementErrors{&solid.mesh, solid.energy, solid.total, solid.elements, solid.stresses};
}

} // namespace gewebe::cli
