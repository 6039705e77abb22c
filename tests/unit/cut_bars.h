#pragma once
// Bars of finite elements that tests cut: what they are, where, and what must hold of them.

#include "embedding/skin.h"
#include "fem/solid_model.h"
#include "larger.h"
#include "mesh/check.h"
#include "model_meshes.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {

/// A bar of 20 x 10 x 10 mm of two materials, held at x = 0 if it is.
inline model::Model bar(bool quadratic, bool held = true) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(8, 4, 4, 2.5);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    double x = 0;
    for (const std::uint32_t corner : t)
      x += mesh.points[corner].x / 4;
    mesh.material.push_back(x < 10 ? 0 : 1);
  }
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 20000, 1, 0.2, 0.4},
                                {"stone", 2e-3, 60000, 1, 0.2, 0.2}};
  options.material.of_part = {0, 1};
  options.quadratic = quadratic;
  options.drag_rate = 0;
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  for (model::Node& node : model.nodes)
    node.fixed = held && node.position.x == 0 ? model::fixed_all : model::fixed_none;
  model.name = "bar";
  return model;
}

/// The bar with an ellipsoid for its skin: corners stand out of it, it stands out of the faces.
inline model::Model skinned_bar(bool quadratic, bool held = true) {
  model::Model model = bar(quadratic, held);
  TriangleMesh skin = ball(4, 1, {0, 0, 0});
  for (Vec3& p : skin.points)
    p = {10 + 11 * p.x, 5 + 6 * p.y, 5 + 6 * p.z};
  (void)embedding::add_skin(model, skin, {}, {});
  return model;
}

/// Each closed, and together as large as they were. Splinters of elements outside have none.
inline void expect_skins_sound(std::span<const model::Model> models, double volume) {
  double sum = 0;
  for (const model::Model& model : models) {
    model::check_model(model);
    if (model.skin.points.empty())
      continue;
    const TriangleMesh surface = model::shown_mesh(model);
    const mesh::MeshReport report = mesh::examine_mesh(surface);
    EXPECT_TRUE(report.closed() && report.oriented() && report.manifold());
    EXPECT_EQ(report.components, model::components(model).count);
    sum += signed_volume(surface);
  }
  EXPECT_NEAR(sum, volume, 1e-6 * volume);
}

inline std::vector<model::Model> models_of(const scene::Simulation& s) {
  std::vector<model::Model> models;
  for (std::size_t k = 0; k < s.object_count(); ++k)
    models.push_back(s.model(k));
  return models;
}

inline std::vector<std::uint32_t> nodes_where(const model::Model& model, auto&& holds) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (holds(model.nodes[i].position))
      nodes.push_back(i);
  return nodes;
}

/// Across the bar, over its upper part alone.
inline scene::CutObject notch(const model::Model& model, double x) {
  return {0, scene::PlaneToCut{{{x, 0, 0}, {1, 0.1, 0.05}},
                               nodes_where(model, [](const Vec3& p) { return p.z > 4; })}};
}

inline scene::CutObject off(double x) {
  return {0, scene::PlaneToCut{{{x, 5, 5}, {1, 0.1, 0.2}}, {}}};
}

inline void expect_sound(const model::Model& model, double volume, double mass) {
  model::check_model(model);
  const TriangleMesh surface = model::surface_mesh(model);
  EXPECT_NEAR(signed_volume(surface), volume, 1e-12 * volume);
  EXPECT_NEAR(model::total_mass(model), mass, 1e-12 * mass);
  const mesh::MeshReport report = mesh::examine_mesh(surface);
  EXPECT_TRUE(report.closed() && report.oriented() && report.manifold());
}

/// Against a factor of its own of the same model under the same load.
inline double error_of_shape(const scene::Simulation& s, const contact::Load& load) {
  const model::Model model = s.model(0);
  statics::Elastostatic fresh(model, {}, one_thread());
  fresh.update(load);
  const std::span<const double> want = fresh.displacement();
  const std::vector<double> is = shape(s, 0);
  EXPECT_EQ(is.size(), want.size());
  double largest = 0, worst = 0;
  for (std::size_t i = 0; i < std::min(want.size(), is.size()); ++i) {
    largest = numeric::larger(largest, std::abs(want[i]));
    worst = numeric::larger(worst, std::abs(want[i] - is[i]));
  }
  EXPECT_GT(largest, 0);
  return worst / largest;
}

} // namespace gewebe::test
