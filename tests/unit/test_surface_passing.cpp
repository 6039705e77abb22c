// What passes surfaces within a step: found whatever the way is, and kept from passing in scenes.

#include "base/context.h"
#include "base/vector_at.h"
#include "contact/surface_pairs.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "solid/solid_model.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gewebe {
namespace {

using test::one_thread;

constexpr double depth = 1e-4; ///< mm

SolidModelOptions gel() {
  SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = false;
  return options;
}

/// Two tetrahedra whose long edges cross over each other at right angles, 0.1 mm apart along z: no
/// node of one comes near the other.
TetMesh wedge(bool upper) {
  TetMesh mesh;
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

/// All displaced by the same, from the node on.
std::vector<double> moved(std::size_t nodes, std::size_t from, const Vec3& by) {
  std::vector<double> u(3 * nodes);
  for (std::size_t i = from; i < nodes; ++i)
    for (int a = 0; a < 3; ++a)
      u[3 * i + static_cast<std::size_t>(a)] = by[a];
  return u;
}

Model joined(Model all, const Model& more) {
  const auto first = static_cast<std::uint32_t>(all.nodes.size());
  all.nodes.insert(all.nodes.end(), more.nodes.begin(), more.nodes.end());
  for (Triangle t : more.triangles) {
    for (std::uint32_t& corner : t)
      corner += first;
    all.triangles.push_back(t);
  }
  for (Tetrahedron t : more.tetrahedra) {
    for (std::uint32_t& corner : t)
      corner += first;
    all.tetrahedra.push_back(t);
  }
  return all;
}

TEST(SurfacePassing, EdgesThatCrossAreFoundWhereNoNodeIsInside) {
  const Model both =
      joined(solid_model(wedge(false), gel(), {}), solid_model(wedge(true), gel(), {}));
  SurfacePairs pairs(both, {{{0, 4}, {4, 8}, 0}});
  const std::vector<double> rest = moved(8, 8, {});
  for (const Vec3& way : {Vec3{0.3, 0.2, -0.9}, Vec3{0, 0, -3}, Vec3{5, -4, -0.2}}) {
    const std::vector<double> down = moved(8, 4, way);
    const std::vector<SurfacePair> found = pairs.find_passed(down, rest, depth);
    ASSERT_EQ(found.size(), 1U) << way.z;
    EXPECT_TRUE(found[0].edges);
    EXPECT_NEAR(std::abs(found[0].normal.z), 1, 1e-12);
    EXPECT_NEAR(found[0].gap, 0.1 + way.z, 1e-12);
    double sum = 0;
    for (const double share : found[0].share)
      sum += share;
    EXPECT_NEAR(sum, 0, 1e-15);
  }
  EXPECT_TRUE(pairs.find_passed(moved(8, 4, {0, 0, -0.09}), rest, depth).empty());
  EXPECT_TRUE(pairs.find_passed(moved(8, 4, {25, 0, -3}), moved(8, 4, {25, 0, 0}), depth).empty())
      << "beside it";
  // Back out: nobody keeps it inside.
  EXPECT_TRUE(pairs.find_passed(rest, moved(8, 4, {0, 0, -0.9}), depth).empty());
}

TEST(SurfacePassing, NodesThatJumpThroughAWholeBodyAreFound) {
  const Model plate = solid_model(test::box_tetrahedra(4, 4, 1, 4), gel(), {});
  Model cube = solid_model(test::box_tetrahedra(1, 1, 1, 4), gel(), {});
  for (Node& n : cube.nodes)
    n.position += Vec3{6.3, 5.9, 5};
  const Model both = joined(plate, cube);
  const auto nodes = static_cast<std::uint32_t>(both.nodes.size()),
             first = static_cast<std::uint32_t>(plate.nodes.size());
  SurfacePairs pairs(both, {{{0, first}, {first, nodes}, 0}});
  const std::vector<double> rest = moved(nodes, nodes, {}),
                            through = moved(nodes, first, {0, 0, -40});
  EXPECT_TRUE(pairs.find(through, rest, 0).empty()) << "it is far behind";
  std::size_t lower = 0;
  for (const SurfacePair& p : pairs.find_passed(through, rest, depth)) {
    EXPECT_LT(p.gap, 0);
    EXPECT_EQ(p.edges ? p.side * p.side : p.side, 1);
    lower += !p.edges && p.nodes[0] >= first && both.nodes[p.nodes[0]].position.z == 5 ? 1 : 0;
  }
  EXPECT_EQ(lower, 4U);
}

/// A net's own wall holds from within; that of a solid is held by its tissue.
TEST(SurfacePassing, ANetsWallIsMetFromWithin) {
  const Model net = test::organ(2);
  const auto nodes = static_cast<std::uint32_t>(net.nodes.size());
  SurfacePairs pairs(net, {{{0, nodes}, {0, nodes}, 0}});
  const std::uint32_t top = test::highest(net);
  std::vector<double> rest(3 * std::size_t{nodes}), in = rest, out = rest;
  in[3 * std::size_t{top} + 2] = -30;
  out[3 * std::size_t{top} + 2] = -50; // beyond the lower wall
  EXPECT_TRUE(pairs.find_passed(in, rest, depth).empty());
  bool met = false;
  for (const SurfacePair& p : pairs.find_passed(out, rest, depth))
    met = met || (!p.edges && p.nodes[0] == top && p.side == -1 && p.gap < 0);
  EXPECT_TRUE(met);
  const std::vector<SurfacePair> back = pairs.find_passed(rest, out, depth);
  met = false;
  for (const SurfacePair& p : back)
    met = met || (!p.edges && p.nodes[0] == top && p.side == 1 && p.gap < 0);
  EXPECT_TRUE(met);
}

TEST(SurfacePassing, NothingIsLookedAtThatIsFar) {
  const Model plate = solid_model(test::box_tetrahedra(4, 4, 1, 4), gel(), {});
  const auto nodes = static_cast<std::uint32_t>(plate.nodes.size());
  SurfacePairs pairs(plate, {{{0, nodes}, {0, nodes}, 0}});
  std::vector<double> places;
  for (const Node& n : plate.nodes)
    places.insert(places.end(), {n.position.x, n.position.y, n.position.z});
  const std::vector<double> still(places.size());
  std::vector<double> fast(places.size());
  EXPECT_FALSE(pairs.may_touch(places, still, 0.01));
  EXPECT_FALSE(pairs.may_have_touched(places));
  std::vector<double> there(places);
  for (double& p : there)
    p += 1000; // as a whole
  EXPECT_FALSE(pairs.may_touch(there, still, 0.01));
  EXPECT_FALSE(pairs.may_have_touched(there));
  there[0] += 20;
  EXPECT_TRUE(pairs.may_have_touched(there));
  fast[0] = 1e4;
  EXPECT_TRUE(pairs.may_touch(places, fast, 0.01));
  places[0] = std::nan("");
  EXPECT_TRUE(pairs.may_have_touched(places));
}

void add(Simulation& s, const std::string& name, const Model& model) {
  s.add_object(name, model, Method::ela, {}, Integration::implicit);
}

double lowest(const Simulation& s, std::size_t object) {
  double z = HUGE_VAL;
  const std::vector<double> u = test::shape(s, object);
  for (std::size_t i = 0; i < s.model(object).nodes.size(); ++i)
    z = test::smaller(z, s.model(object).nodes[i].position.z + u[3 * i + 2]);
  return z;
}

TEST(SurfacePassing, AWedgeRestsAcrossAnother) {
  Simulation s(one_thread(), {});
  Model below = solid_model(wedge(false), gel(), {});
  for (Node& n : below.nodes)
    n.fixed = fixed_all;
  Model above = solid_model(wedge(true), gel(), {});
  for (Node& n : above.nodes)
    n.fixed = 3; // it slides along z alone
  add(s, "below", below);
  add(s, "above", above);
  s.apply(SetGravity{{0, 0, -9810}});
  s.apply(SetContact{0, 1, 0});
  for (int k = 0; k < 20; ++k)
    s.step(1.0 / 60);
  EXPECT_GE(lowest(s, 1), -0.02);
  Vec3 sum;
  for (const NodeVector& f : s.contact_forces(1))
    sum += f.value;
  EXPECT_GT(sum.z, 0);
  EXPECT_EQ(s.counts().solids.touches.unsolved, 0U);
}

/// So fast that it is beyond the plate in one step: it stays above, or it is told that forces were
/// not found.
TEST(SurfacePassing, AFastBlockDoesNotPassUnsaid) {
  Simulation s(one_thread(), {});
  Model plate = solid_model(test::box_tetrahedra(4, 4, 1, 4), gel(), {});
  for (Node& n : plate.nodes)
    n.fixed = fixed_all;
  SolidModelOptions firm = gel();
  firm.material.materials[0].young = 2e5;
  Model cube = solid_model(test::box_tetrahedra(1, 1, 1, 4), firm, {});
  for (Node& n : cube.nodes)
    n.position += Vec3{6.3, 5.9, 13};
  add(s, "plate", plate);
  add(s, "cube", cube);
  s.apply(SetTimestep{1.0 / 60});
  s.apply(SetGravity{{0, 0, -9810}});
  s.apply(SetContact{0, 1, 0});
  double least = HUGE_VAL;
  for (int k = 0; k < 8; ++k) {
    s.step(1.0 / 60);
    least = test::smaller(least, lowest(s, 1));
  }
  EXPECT_GT(s.counts().solids.touches.problems, 0U);
  EXPECT_TRUE(least >= 4 - 1e-3 * 4 || s.counts().solids.touches.unsolved > 0) << least;
}

/// A bag without anything inside falls on a floor; its walls come to lie on each other.
TEST(SurfacePassing, ALimpBagLiesOnAFloor) {
  Simulation s(one_thread(), {});
  BuildOptions options;
  options.bend = true;
  options.centrals = 0;
  Model bag = build_model(test::ball(1, 10, {8.3, 8.1, 15}), options, Context{}).model;
  Model floor = solid_model(test::box_tetrahedra(4, 4, 1, 4), gel(), {});
  for (Node& n : floor.nodes)
    n.fixed = fixed_all;
  add(s, "floor", floor);
  add(s, "bag", bag);
  s.apply(SetGravity{{0, 0, -9810}});
  s.apply(SetContact{0, 1, 0.3});
  s.apply(SetContact{1, 1, 0.3});
  for (int k = 0; k < 12; ++k)
    s.step(1.0 / 60);
  EXPECT_GE(lowest(s, 1), 4 - 5e-3);
  EXPECT_EQ(s.counts().solids.touches.unsolved, 0U);
  EXPECT_LE(s.counts().solids.rounds, 40 * s.counts().solids.steps) << "250 before";
}

} // namespace
} // namespace gewebe
