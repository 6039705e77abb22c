#pragma once
// Soft blocks whose surfaces touch in scenes, and what tests ask of them.

#include "contact_checks.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::test {

inline constexpr double block_edge = 4; ///< mm, of the elements

/// A block of so many elements, its lowest corner there.
inline model::Model block(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz, const Vec3& corner,
                          bool held = false) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = false;
  model::Model model = fem::solid_model(box_tetrahedra(nx, ny, nz, block_edge), options, {});
  for (model::Node& node : model.nodes) {
    if (held && node.position.z == 0)
      node.fixed = model::fixed_all;
    node.position += corner;
  }
  return model;
}

inline void add(scene::Simulation& s, const std::string& name, const model::Model& model) {
  s.add_object(name, model, scene::Method::ela, {}, scene::Integration::implicit);
}

inline Vec3 sum_of_forces(const scene::Simulation& s, std::size_t object) {
  Vec3 sum;
  for (const contact::NodeVector& f : s.contact_forces(object))
    sum += f.value;
  return sum;
}

/// Median length of the edges of two objects' surfaces.
inline double median_edge(const scene::Simulation& s, std::size_t a, std::size_t b) {
  std::vector<double> lengths;
  for (const std::size_t o : {a, b})
    for (const Triangle& t : s.model(o).triangles)
      for (std::size_t k = 0; k < 3; ++k)
        lengths.push_back(
            norm(s.model(o).nodes[t[k]].position - s.model(o).nodes[t[(k + 1) % 3]].position));
  std::ranges::sort(lengths);
  return lengths[lengths.size() / 2];
}

/// Distance of two objects' surfaces, or of one from itself, over the length of an edge; below 0
/// where they pass each other.
inline double least_gap(const scene::Simulation& s, std::size_t a, std::size_t b) {
  collision::CollisionSurface all;
  std::vector<Vec3> places;
  std::vector<std::size_t> objects{a};
  if (a != b)
    objects.push_back(b);
  for (const std::size_t o : objects) {
    const model::Model& model = s.model(o);
    const std::vector<double> u = shape(s, o);
    contact::BodySurface surface;
    std::vector<Vec3> x;
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
      surface.rest.push_back(model.nodes[i].position);
      x.push_back(model.nodes[i].position + vector_at(u, i));
    }
    for (const Triangle& t : model.triangles)
      surface.triangles.push_back({t[0], t[1], t[2]});
    add_surface(all, places, surface, x, o == a ? 0 : 1);
  }
  collision::complete_surface(all);
  collision::AllowedPairs allowed(objects.size(), 0);
  allowed.set(0, objects.size() - 1, 1);
  return surface_distance(all, places, allowed) / median_edge(s, a, b);
}

/// Surfaces at rest on each other stand apart by less than this, over the length of an edge.
inline constexpr double gap_allowed = 1.001e-3;

inline double weight_of(const scene::Simulation& s, std::size_t object) {
  double mass = 0;
  for (const model::Node& n : s.model(object).nodes)
    mass += n.mass;
  return 9810 * mass;
}

inline std::vector<std::uint32_t> nodes_of(const model::Model& model) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    all.push_back(i);
  return all;
}

} // namespace gewebe::test
