#include "fem/solid_model.h"

#include "base/error.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/order.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace gewebe::fem {
namespace {

void drop_unused(tetrahedra::TetMesh& mesh, const tetrahedra::NodeOrder& order) {
  mesh.points.resize(mesh.points.size() - order.unused);
}

/// The triangles of the boundary; each as four where it has middles.
std::vector<Triangle> surface_triangles(const tetrahedra::TetBoundary& surface) {
  std::vector<Triangle> triangles;
  triangles.reserve((surface.middles.empty() ? 1 : 4) * surface.mesh.triangles.size());
  for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
    const Triangle& of = surface.mesh.triangles[t];
    const std::uint32_t a = surface.node[of[0]], b = surface.node[of[1]], c = surface.node[of[2]];
    if (surface.middles.empty()) {
      triangles.push_back({a, b, c});
      continue;
    }
    const auto& [ab, bc, ca] = surface.middles[t];
    for (const Triangle& quarter :
         {Triangle{a, ab, ca}, Triangle{b, bc, ab}, Triangle{c, ca, bc}, Triangle{ab, bc, ca}})
      triangles.push_back(quarter);
  }
  return triangles;
}

/// Normals of the surface's nodes; 0 for all other nodes.
std::vector<Vec3> surface_normals(const model::Model& model) {
  std::vector<Vec3> normals(model.nodes.size());
  for (const auto& [a, b, c] : model.triangles) {
    const Vec3 &p = model.nodes[a].position, &q = model.nodes[b].position,
               &r = model.nodes[c].position;
    const Vec3 area = cross(q - p, r - p);
    for (const std::uint32_t corner : {a, b, c})
      normals[corner] += area;
  }
  for (Vec3& normal : normals)
    if (const double length = norm(normal); length > 0)
      normal = normal / length;
  return normals;
}

} // namespace

model::Model solid_model(tetrahedra::TetMesh mesh, const SolidModelOptions& options,
                         const Context& context) {
  if (!options.quadratic && !mesh.middles.empty())
    throw Error("the mesh has quadratic elements, expected linear ones");
  if (options.quadratic && mesh.middles.empty())
    tetrahedra::make_quadratic(mesh);
  drop_unused(mesh, tetrahedra::order_nodes(mesh));
  model::Model model;
  model.materials = options.material.materials;
  model.name = model.materials.at(0).name;
  model.tetrahedron_material.reserve(mesh.tetrahedra.size());
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    model.tetrahedron_material.push_back(
        model::chosen_material(options.material, mesh.material.empty() ? 0 : mesh.material[t]));
  mesh.material = model.tetrahedron_material;
  model.tetrahedra = mesh.tetrahedra;
  model.middles = mesh.middles;
  model.triangles = surface_triangles(tetrahedra::boundary(mesh));

  model.nodes.resize(mesh.points.size());
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    model.nodes[n].position = mesh.points[n];
    model.nodes[n].material = -1;
  }
  const auto use = [&](std::uint32_t node, std::int32_t material) {
    if (model.nodes[node].material < 0)
      model.nodes[node].material = material;
  };
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    for (const std::uint32_t corner : mesh.tetrahedra[t])
      use(corner, mesh.material[t]);
    if (!mesh.middles.empty())
      for (const std::uint32_t middle : mesh.middles[t])
        use(middle, mesh.material[t]);
  }
  const std::vector<SolidMaterial> materials = element_materials(model);
  (void)solid_elements(mesh, materials, context); // what is wrong with it is known now
  const std::vector<double> masses = solid_masses(mesh, materials);
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    model.nodes[n].mass = masses[n];
    model.nodes[n].drag = options.drag_rate * masses[n];
  }
  if (options.normals)
    model.normals = surface_normals(model);
  return model;
}

tetrahedra::TetMesh element_mesh(const model::Model& model) {
  tetrahedra::TetMesh mesh;
  mesh.points.reserve(model.nodes.size());
  for (const model::Node& node : model.nodes)
    mesh.points.push_back(node.position);
  mesh.tetrahedra = model.tetrahedra;
  mesh.middles = model.middles;
  mesh.material = model.tetrahedron_material;
  return mesh;
}

std::vector<SolidMaterial> element_materials(const model::Model& model) {
  std::vector<SolidMaterial> materials(model.materials.size());
  std::vector<std::uint8_t> used(model.materials.size());
  for (const std::int32_t m : model.tetrahedron_material)
    used[static_cast<std::size_t>(m)] = 1;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const model::Material& of = model.materials[m];
    if (used[m] != 0 && !of.poisson)
      throw Error("the material '" + of.name + "' has no Poisson's ratio, expected one");
    materials[m] = {of.young, of.poisson.value_or(0), of.density,
                    of.law.value_or(model::HyperelasticLaw{}), of.prony};
  }
  return materials;
}

} // namespace gewebe::fem
