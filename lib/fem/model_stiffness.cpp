#include "fem/model_stiffness.h"

#include "fem/assembly.h"
#include "fem/solid_model.h"

#include <cstddef>

namespace gewebe::fem {
namespace {

/// Flags of all axes that can't move.
std::vector<std::uint8_t> held_axes(const model::Model& model,
                                    std::span<const std::uint8_t> fixed) {
  std::vector<std::uint8_t> held(fixed.begin(), fixed.end());
  held.resize(3 * model.nodes.size());
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a)
      if ((model.nodes[i].fixed >> a & 1) != 0)
        held[3 * i + a] = 1;
  return held;
}

} // namespace

linalg::StiffnessMatrix stiffness_matrix(const model::Model& model,
                                         std::span<const std::uint8_t> fixed,
                                         const Context& context) {
  if (model.tetrahedra.empty())
    return linalg::spring_stiffness(model, fixed);
  const tetrahedra::TetMesh mesh = element_mesh(model);
  const std::vector<SolidElement> elements =
      solid_elements(mesh, element_materials(model), context);
  linalg::StiffnessMatrix solid = solid_stiffness(mesh, elements, held_axes(model, fixed), context);
  return model.springs.empty() ? solid : sum(linalg::spring_stiffness(model, fixed), solid);
}

StiffnessOperator::StiffnessOperator(const model::Model& model, const Context& context)
    : model_(model), springs_(linalg::stiffness_blocks(model)) {
  if (model.tetrahedra.empty())
    return;
  mesh_ = element_mesh(model);
  elements_ = solid_elements(mesh_, element_materials(model), context);
}

void StiffnessOperator::multiply(std::span<const double> u, std::span<double> f) const {
  linalg::multiply_springs(model_, springs_, u, f);
  if (elements_.empty())
    return;
  std::vector<double> solid(f.size());
  multiply_solid(mesh_, elements_, u, solid);
  for (std::size_t axis = 0; axis < f.size(); ++axis)
    f[axis] += solid[axis];
}

std::vector<double> weight_of(const model::Model& model, const Vec3& acceleration) {
  std::vector<double> weight(3 * model.nodes.size()), lumped(model.nodes.size());
  // On linear elements the consistent load is that of the lumped masses.
  if (!model.middles.empty()) {
    const tetrahedra::TetMesh mesh = element_mesh(model);
    const std::vector<SolidMaterial> materials = element_materials(model);
    weight = gravity_load(mesh, materials, solid_elements(mesh, materials), acceleration);
    lumped = solid_masses(mesh, materials);
  }
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      weight[3 * i + static_cast<std::size_t>(a)] +=
          (model.nodes[i].mass - lumped[i]) * acceleration[a];
  return weight;
}

void multiply_stiffness(const model::Model& model, std::span<const double> u, std::span<double> f) {
  StiffnessOperator(model).multiply(u, f);
}

} // namespace gewebe::fem
