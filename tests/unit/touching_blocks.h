#pragma once
// Soft blocks whose surfaces touch in scenes, and what tests ask of them.

#include "contact/surface_pairs.h"
#include "larger.h"
#include "scene/simulation.h"
#include "simulation_scenes.h"
#include "solid/solid_model.h"
#include "tet_fixtures.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::test {

inline constexpr double block_edge = 4; ///< mm, of the elements

/// A block of so many elements, its lowest corner there.
inline Model block(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz, const Vec3& corner,
                   bool held = false) {
  SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = false;
  Model model = solid_model(box_tetrahedra(nx, ny, nz, block_edge), options, {});
  for (Node& node : model.nodes) {
    if (held && node.position.z == 0)
      node.fixed = fixed_all;
    node.position += corner;
  }
  return model;
}

inline void add(Simulation& s, const std::string& name, const Model& model) {
  s.add_object(name, model, Method::ela, {}, Integration::implicit);
}

inline Vec3 sum_of_forces(const Simulation& s, std::size_t object) {
  Vec3 sum;
  for (const NodeVector& f : s.contact_forces(object))
    sum += f.value;
  return sum;
}

/// The least gap of any pair of two objects' surfaces, or of one with itself, over the length of an
/// edge.
inline double least_gap(const Simulation& s, std::size_t a, std::size_t b) {
  Model all = s.model(a);
  std::vector<double> u = shape(s, a);
  const auto first = static_cast<std::uint32_t>(all.nodes.size());
  NodeRange other{0, first};
  if (a != b) {
    const Model& more = s.model(b);
    all.nodes.insert(all.nodes.end(), more.nodes.begin(), more.nodes.end());
    for (Triangle t : more.triangles) {
      for (std::uint32_t& corner : t)
        corner += first;
      all.triangles.push_back(t);
    }
    const std::vector<double> of_other = shape(s, b);
    u.insert(u.end(), of_other.begin(), of_other.end());
    other = {first, static_cast<std::uint32_t>(all.nodes.size())};
  }
  SurfacePairs pairs(all, {{{0, first}, other, 0}});
  const std::vector<double> rest(u.size());
  double least = HUGE_VAL;
  for (const SurfacePair& p : pairs.find(u, a == b ? rest : u, HUGE_VAL))
    least = smaller(least, p.gap);
  return least / pairs.edge();
}

inline double weight_of(const Simulation& s, std::size_t object) {
  double mass = 0;
  for (const Node& n : s.model(object).nodes)
    mass += n.mass;
  return 9810 * mass;
}

inline std::vector<std::uint32_t> nodes_of(const Model& model) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    all.push_back(i);
  return all;
}

} // namespace gewebe::test
