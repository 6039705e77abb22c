// Bodies that would pass each other within a step are kept from it.

#include "base/context.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::one_thread;

fem::SolidModelOptions gel() {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = false;
  return options;
}

/// Two tetrahedra whose long edges cross over each other at right angles, 0.1 mm apart along z: no
/// node of one comes near the other.
tetrahedra::TetMesh wedge(bool upper) {
  tetrahedra::TetMesh mesh;
  if (upper)
    mesh.points = {{0, -10, 0.1}, {0, 10, 0.1}, {-3, 0, 5}, {3, 0, 5}};
  else
    mesh.points = {{-10, 0, 0}, {10, 0, 0}, {0, 3, -5}, {0, -3, -5}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  const Vec3 a = mesh.points[1] - mesh.points[0], b = mesh.points[2] - mesh.points[0],
             c = mesh.points[3] - mesh.points[0];
  if (dot(a, cross(b, c)) < 0)
    std::swap(mesh.tetrahedra[0][2], mesh.tetrahedra[0][3]);
  return mesh;
}

void add(scene::Simulation& s, const std::string& name, const model::Model& model) {
  s.add_object(name, model, scene::Method::ela, {}, scene::Integration::implicit);
}

double lowest(const scene::Simulation& s, std::size_t object) {
  double z = HUGE_VAL;
  const std::vector<double> u = test::shape(s, object);
  for (std::size_t i = 0; i < s.model(object).nodes.size(); ++i)
    z = test::smaller(z, s.model(object).nodes[i].position.z + u[3 * i + 2]);
  return z;
}

TEST(SurfacePassing, AWedgeRestsAcrossAnother) {
  scene::Simulation s(one_thread(), {});
  model::Model below = fem::solid_model(wedge(false), gel(), {});
  for (model::Node& n : below.nodes)
    n.fixed = model::fixed_all;
  model::Model above = fem::solid_model(wedge(true), gel(), {});
  for (model::Node& n : above.nodes)
    n.fixed = 3; // it slides along z alone
  add(s, "below", below);
  add(s, "above", above);
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.apply(scene::SetContact{0, 1, 0});
  for (int k = 0; k < 20; ++k)
    s.step(1.0 / 60);
  EXPECT_GT(lowest(s, 1), 0);
  Vec3 sum;
  for (const contact::NodeVector& f : s.contact_forces(1))
    sum += f.value;
  EXPECT_GT(sum.z, 0);
}

/// So fast that it would be beyond the plate in one step: it stays above.
TEST(SurfacePassing, AFastBlockDoesNotPass) {
  scene::Simulation s(one_thread(), {});
  model::Model plate = fem::solid_model(test::box_tetrahedra(4, 4, 1, 4), gel(), {});
  for (model::Node& n : plate.nodes)
    n.fixed = model::fixed_all;
  fem::SolidModelOptions firm = gel();
  firm.material.materials[0].young = 2e5;
  model::Model cube = fem::solid_model(test::box_tetrahedra(1, 1, 1, 4), firm, {});
  for (model::Node& n : cube.nodes)
    n.position += Vec3{6.3, 5.9, 13};
  add(s, "plate", plate);
  add(s, "cube", cube);
  s.apply(scene::SetTimestep{1.0 / 60});
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.apply(scene::SetContact{0, 1, 0});
  double least = HUGE_VAL;
  for (int k = 0; k < 8; ++k) {
    s.step(1.0 / 60);
    least = test::smaller(least, lowest(s, 1));
  }
  EXPECT_GT(s.counts().contact.steps, 0U);
  EXPECT_GT(least, 4);
}

/// A bag without anything inside falls on a floor; its walls come to lie on each other.
TEST(SurfacePassing, ALimpBagLiesOnAFloor) {
  scene::Simulation s(one_thread(), {});
  model::BuildOptions options;
  options.bend = true;
  options.centrals = 0;
  model::Model bag =
      model::build_model(test::ball(1, 10, {8.3, 8.1, 15}), options, Context{}).model;
  model::Model floor = fem::solid_model(test::box_tetrahedra(4, 4, 1, 4), gel(), {});
  for (model::Node& n : floor.nodes)
    n.fixed = model::fixed_all;
  add(s, "floor", floor);
  add(s, "bag", bag);
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.apply(scene::SetContact{0, 1, 0.3});
  s.apply(scene::SetContact{1, 1, 0.3});
  for (int k = 0; k < 12; ++k)
    s.step(1.0 / 60);
  EXPECT_GT(lowest(s, 1), 4);
  EXPECT_LE(s.counts().solids.rounds, 40 * s.counts().solids.steps) << "250 before";
}

} // namespace
} // namespace gewebe::test
