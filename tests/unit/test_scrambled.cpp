// Solids whose nodes are anywhere find back: those that stay inside out by one rule alone, and one
// that an instrument presses on meanwhile.

#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "integrator/solid_motion.h"
#include "scene/simulation.h"
#include "simulation_scenes.h"
#include "tests/stress/motion_bodies.h"
#include "tests/unit/larger.h"
#include "tests/unit/tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::test {
namespace {

using Numbers = std::vector<double>;

/// Of stress_scrambled, seeds that it found: without loosening all of these stay inside out.
TEST(Scrambled, BodiesThatStandInsideOutFindBack) {
  struct Case {
    std::size_t kind;
    std::uint32_t seed;
  };
  for (const auto& [kind, seed] :
       {Case{0, 1100}, Case{0, 2746}, Case{0, 3233}, Case{0, 6001}, Case{0, 8480}, Case{0, 13996},
        Case{0, 14957}, Case{0, 16108}, Case{0, 18208}, Case{0, 19019}, Case{1, 328}, Case{1, 973},
        Case{3, 93}, Case{3, 95}, Case{3, 147}}) {
    const test::Scrambled of = test::scrambled(seed, test::kinds.at(kind));
    integrator::SolidMotion body(of.mesh, std::vector<fem::SolidMaterial>{of.material}, of.options);
    body.set_state(of.displacement, Numbers(of.displacement.size()));
    const double first = body.elastic_energy();
    double before = first;
    for (int n = 0; n < 50 && !(body.elastic_energy() <= 1e-9 * first); ++n) {
      (void)body.step(0.05, test::one_thread());
      const double after = body.elastic_energy() + body.kinetic_energy();
      EXPECT_LE(after, before + 1e-10 * first) << seed;
      before = after;
    }
    EXPECT_EQ(test::inverted(of.mesh, body.places()), 0) << test::kinds.at(kind).name() << seed;
  }
}

/// Where corotational elements have minima inside out: without another way back every fifth stays.
TEST(Scrambled, ScrambledBodiesThatKeepTheirVolumeFindBack) {
  const tetrahedra::TetMesh m = test::box_tetrahedra(3, 3, 2, 5);
  const std::size_t axes = 3 * m.points.size();
  test::Chance chance{std::mt19937(11)};
  for (int n = 0; n < 20; ++n) {
    integrator::SolidMotion moving(m, std::vector<fem::SolidMaterial>{{2e4, 0.49, 1e-3}}, {});
    const Numbers u = chance.numbers(axes, 7);
    moving.set_state(u, Numbers(axes));
    const double first = moving.elastic_energy();
    double before = first;
    for (int k = 0; k < 100 && !(moving.elastic_energy() <= 1e-10 * first); ++k) {
      (void)moving.step(0.05, test::one_thread());
      const double after = moving.elastic_energy() + moving.kinetic_energy();
      EXPECT_LE(after, before + 1e-10 * first) << n;
      before = after;
    }
    EXPECT_EQ(test::inverted(m, moving.places()), 0) << n;
    integrator::SolidMotion standing(m, std::vector<fem::SolidMaterial>{{2e4, 0.49, 1e-3}}, {});
    standing.set_state(moving.displacement(), Numbers(axes)); // it is its own again
    EXPECT_NEAR(moving.elastic_energy(), standing.elastic_energy(), 1e-7 * first) << n;
  }
}

/// A body that is right side out after its first step, which was a step of recovery, responds to
/// forces as one that never was inside out.
TEST(Scrambled, ABodyThatFindsBackInOneStepAnswersForces) {
  constexpr double young = 2e4, edge = 5, volume = 2 * edge * edge * edge;
  const tetrahedra::TetMesh m = test::box_tetrahedra(2, 1, 1, edge);
  const std::size_t axes = 3 * m.points.size();
  std::vector<std::uint8_t> held(axes);
  Numbers mirrored(axes);
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    if (m.points[i].x == 0)
      std::fill_n(held.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, std::uint8_t{1});
    mirrored[3 * i] = -2 * m.points[i].x;
  }
  const auto answered = [&](const Numbers& displacement, int inverted) {
    integrator::SolidMotion body(m, std::vector<fem::SolidMaterial>{{young, 0.3, 1e-3}}, {});
    body.hold(held);
    body.set_state(displacement, Numbers(axes));
    EXPECT_EQ(test::inverted(m, body.places()) > 0, inverted > 0);
    (void)body.step(10, test::one_thread()); // next to what statics says
    EXPECT_EQ(test::inverted(m, body.places()), 0);
    EXPECT_LE(body.elastic_energy(), 1e-9 * young * volume);
    Numbers step(axes), columns(3 * axes);
    body.begin_step(10, test::one_thread());
    body.linearise_step(step, Numbers(axes), test::one_thread());
    const auto last = static_cast<std::uint32_t>(m.points.size() - 1);
    body.unit_responses({&last, 1}, columns);
    return Numbers(columns.end() - static_cast<std::ptrdiff_t>(axes), columns.end());
  };
  const Numbers right = answered(Numbers(axes), 0), found = answered(mirrored, 1);
  EXPECT_GT(right[axes - 1], 1e-6);
  for (std::size_t axis = 0; axis < axes; ++axis)
    EXPECT_NEAR(found[axis], right[axis], 1e-3 * right[axes - 1]) << axis;
}

/// A bar held at an end whose surface is anywhere, let go while a ball is pressed onto it.
TEST(Scrambled, BodiesFindBackUnderAnInstrument) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.45}};
  options.quadratic = false;
  model::Model model = fem::solid_model(test::box_tetrahedra(5, 2, 2, 4), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  tetrahedra::TetMesh mesh;
  for (const model::Node& node : model.nodes)
    mesh.points.push_back(node.position);
  mesh.tetrahedra = model.tetrahedra;
  integrator::SolidChoice choice;
  choice.law = integrator::SolidLaw::corotational;
  choice.damping = integrator::damping_per_stiffness(0.5, 20);
  scene::Simulation s(test::one_thread(), {});
  s.add_object("o", model, scene::Method::ela, {}, scene::Integration::semi_implicit, choice);
  std::vector<std::uint32_t> moved;
  test::Chance chance{std::mt19937(3)};
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    if (const Vec3 p = model.nodes[i].position; p.x > 0) {
      s.apply(scene::SetDisplacement{
          0, {i}, Vec3{chance.from(2, 20), chance.from(0, 8), chance.from(0, 8)} - p});
      moved.push_back(i);
    }
  s.step(0);
  const auto places = [&] {
    Numbers all;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
      const Vec3 at = model.nodes[i].position + vector_at(s.displacement(0), i);
      all.insert(all.end(), {at.x, at.y, at.z});
    }
    return all;
  };
  EXPECT_GT(test::inverted(mesh, places()), 20);
  s.apply(scene::Release{0, moved});
  s.apply(scene::SetInstrument{0, {4, {}, 0}, {{14, 4, 20}, {}}, "probe"});
  s.apply(scene::MoveInstrument{0, {14, 4, 10}, {}, 0.5}); // 2 mm deep
  for (int n = 0; n < 100; ++n)
    s.step(0.02);
  EXPECT_EQ(test::inverted(mesh, places()), 0);
  EXPECT_GT(s.instrument(0).nodes, 0U);
  EXPECT_GT(s.instrument(0).force.z, 10);
  s.apply(scene::MoveInstrument{0, {14, 4, 40}, {}, 0});
  test::settle(s);
  double most = 0;
  for (const double u : test::shape(s, 0))
    most = test::larger(most, std::abs(u));
  EXPECT_LE(most, 1e-4);
}

} // namespace
} // namespace gewebe::test
