#include "tools/results/scene_stress.h"

#include "base/error.h"
#include "dynamics/solid_law.h"
#include "fem/solid_model.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

namespace gewebe::cli {

const std::vector<std::uint32_t>& SceneStress::ask(const scene::Simulation& simulation,
                                                   const formats::EmitStressCommand& command,
                                                   const model::LoadNodeList& lists) {
  const std::size_t object = scene::find_object(simulation, command.object);
  const model::Model& model = simulation.model(object);
  if (model.tetrahedra.empty())
    throw Error("object " + command.object +
                " has no tetrahedra, expected a solid for emit stress");
  if (simulation.object(object).staged)
    throw Error("object " + command.object +
                " has a second stage, so that its stress is that of no one material, expected no "
                "two-step");
  if (dynamics::is_viscoelastic(model))
    throw Error("object " + command.object +
                " is viscoelastic (prony:), whose stress is not that of its strains alone, "
                "expected an elastic one");
  Solid solid;
  if (command.nodes) {
    solid.nodes = model::select_nodes(model, *command.nodes, lists);
  } else {
    solid.nodes.resize(model.nodes.size());
    std::iota(solid.nodes.begin(), solid.nodes.end(), 0U);
  }
  const std::span<const std::uint32_t> first = simulation.object(object).first_nodes;
  for (const std::uint32_t node : solid.nodes)
    solid.first.push_back(first.empty() ? node : first[node]);
  std::ranges::sort(solid.first);
  take_elements(solid, model);
  return (solids_[object] = std::move(solid)).nodes;
}

void SceneStress::take_elements(Solid& solid, const model::Model& model) {
  solid.mesh = fem::element_mesh(model);
  solid.materials = fem::element_materials(model);
  solid.elements = fem::solid_elements(solid.mesh, solid.materials);
  solid.fields = fem::solid_fields(solid.mesh, solid.materials, solid.elements,
                                   std::vector<double>(3 * model.nodes.size()));
}

namespace {

fem::StrainFrames frames_of(const scene::ObjectFacts& object) {
  if (object.element_frames)
    return fem::StrainFrames::elements;
  return object.warp ? fem::StrainFrames::turning : fem::StrainFrames::resting;
}

} // namespace

void SceneStress::find(const scene::Simulation& simulation, const Vec3& gravity) {
  for (auto& [object, solid] : solids_) {
    if (formats::topology_changed(simulation, object)) {
      take_elements(solid, simulation.model(object));
      const std::span<const std::uint32_t> first = simulation.object(object).first_nodes;
      solid.nodes.clear();
      for (std::uint32_t i = 0; i < simulation.model(object).nodes.size(); ++i)
        if (std::ranges::binary_search(solid.first, first.empty() ? i : first[i]))
          solid.nodes.push_back(i);
    }
    solid.fields = fem::solid_fields(solid.mesh, solid.materials, solid.elements,
                                     simulation.local_displacement(object), gravity,
                                     frames_of(simulation.object(object)));
  }
}

const fem::SolidFields* SceneStress::fields(std::size_t object) const {
  const auto found = solids_.find(object);
  return found == solids_.end() ? nullptr : &found->second.fields;
}

std::vector<formats::StressAnswer> SceneStress::answers() const {
  std::vector<formats::StressAnswer> answers;
  for (const auto& [object, solid] : solids_)
    answers.push_back({object, solid.nodes, solid.fields.node_stress});
  return answers;
}

} // namespace gewebe::cli
