// Cuts of models: what must be kept, whatever is cut.

#include "base/error.h"
#include "cutting/cut.h"
#include "cutting/cut_select.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "linalg/stiffness.h"
#include "mesh/check.h"
#include "model/build.h"
#include "model_meshes.h"
#include "sim_models.h"
#include "stiffness_models.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <tuple>

namespace gewebe::test {
namespace {

using namespace gewebe::test;

/// Boundary loops: cycles of edges of one face. Each boundary point must have one edge in and out.
std::size_t boundary_loops(const model::Model& model) {
  std::map<std::uint32_t, std::uint32_t> next;
  std::set<std::pair<std::uint32_t, std::uint32_t>> ways;
  for (const Triangle& t : model.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      ways.emplace(t[k], t[(k + 1) % 3]);
  for (const auto& [a, b] : ways)
    if (!ways.contains({b, a}) && !next.emplace(b, a).second)
      return SIZE_MAX;
  std::size_t loops = 0;
  while (!next.empty()) {
    ++loops;
    for (auto at = next.begin(); at != next.end();) {
      const std::uint32_t to = at->second;
      next.erase(at);
      at = next.find(to);
    }
  }
  return loops;
}

using Key = std::tuple<model::SpringKind, std::uint32_t, std::uint32_t>;
using Sums = std::map<Key, std::pair<double, double>>;

/// Stiffness and damping of the springs between the nodes that copies came from.
Sums folded(const model::Model& model, const std::vector<std::uint32_t>& origin) {
  Sums sums;
  for (const model::Spring& s : model.springs) {
    const std::uint32_t i = origin[s.i], j = origin[s.j];
    auto& sum = sums[{s.kind, std::min(i, j), std::max(i, j)}];
    sum.first += s.stiffness;
    sum.second += s.damping;
  }
  return sums;
}

/// All that a cut must keep.
void expect_kept(const model::Model& before, const cutting::CutModel& cut,
                 double tolerance = 1e-12) {
  const model::Model& after = cut.model;
  EXPECT_NO_THROW(model::check_model(after));
  ASSERT_EQ(cut.origin.size(), after.nodes.size());
  ASSERT_EQ(cut.place.size(), before.nodes.size());
  ASSERT_EQ(after.nodes.size(), before.nodes.size() + cut.doubled);
  EXPECT_EQ(model::surface_count(after), model::surface_count(before) + cut.doubled);
  Vec3 first, second;
  double mass = 0, mass_after = 0;
  for (const model::Node& n : before.nodes) {
    first += n.mass * n.position;
    mass += n.mass;
  }
  for (const model::Node& n : after.nodes) {
    second += n.mass * n.position;
    mass_after += n.mass;
  }
  EXPECT_NEAR(mass_after, mass, tolerance * mass);
  EXPECT_NEAR(model::total_mass(after), model::total_mass(before), tolerance * mass);
  EXPECT_LE(norm(first - second), tolerance * norm(first) + tolerance * mass);
  std::vector<double> share(before.nodes.size());
  for (std::size_t i = 0; i < after.nodes.size(); ++i) {
    share[cut.origin[i]] += cut.share[i];
    const model::Node &a = after.nodes[i], &b = before.nodes[cut.origin[i]];
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.fixed, b.fixed);
    EXPECT_EQ(a.material, b.material);
    EXPECT_EQ(a.central >= 0, b.central >= 0);
    if (b.central >= 0) {
      EXPECT_EQ(cut.origin[static_cast<std::size_t>(a.central)],
                static_cast<std::uint32_t>(b.central));
    }
  }
  for (const double s : share)
    EXPECT_NEAR(s, 1, 1e-12);
  const std::size_t surface = model::surface_count(before);
  for (std::uint32_t i = 0; i < cut.place.size(); ++i) {
    EXPECT_EQ(cut.origin[cut.place[i]], i);
    if (i < surface) {
      EXPECT_EQ(cut.place[i], i);
    }
  }
  // Each spring is there as a whole or not at all.
  std::vector<std::uint32_t> same(before.nodes.size());
  for (std::uint32_t i = 0; i < same.size(); ++i)
    same[i] = i;
  const Sums old = folded(before, same), now = folded(after, cut.origin);
  EXPECT_EQ(old.size() - now.size(), cut.removed);
  for (const auto& [key, sum] : now) {
    const auto at = old.find(key);
    ASSERT_TRUE(at != old.end());
    EXPECT_NEAR(sum.first, at->second.first, tolerance * at->second.first);
    EXPECT_NEAR(sum.second, at->second.second, tolerance * at->second.second);
  }
}

/// f = K u, copies moving as their node and their forces added up, against K without the springs
/// that are gone.
void expect_closed_answers_as_before(const model::Model& before, const cutting::CutModel& cut) {
  model::Model rest = before;
  const Sums now = folded(cut.model, cut.origin);
  std::erase_if(rest.springs, [&](const model::Spring& s) {
    return !now.contains({s.kind, s.i, s.j});
  });
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<double> x(3 * before.nodes.size()), f(x.size()), sum(x.size());
  for (double& value : x)
    value = u(random);
  std::vector<double> y(3 * cut.model.nodes.size()), g(y.size());
  for (std::size_t i = 0; i < y.size(); ++i)
    y[i] = x[3 * std::size_t{cut.origin[i / 3]} + i % 3];
  fem::multiply_stiffness(rest, x, f);
  fem::multiply_stiffness(cut.model, y, g);
  double largest = 0;
  for (std::size_t i = 0; i < y.size(); ++i)
    sum[3 * std::size_t{cut.origin[i / 3]} + i % 3] += g[i];
  for (const double value : f)
    largest = test::larger(largest, std::abs(value));
  for (std::size_t i = 0; i < f.size(); ++i)
    ASSERT_NEAR(sum[i], f[i], 1e-13 * largest);
}

model::Model soft_ball(int rounds, bool bend = true) {
  model::BuildOptions options;
  options.bend = bend;
  options.normals = true;
  return model::build_model(ball(rounds, 20, {100, -50, 30}), options, Context{}).model;
}

/// A path of edges over the surface.
std::vector<std::array<std::uint32_t, 2>> path(const std::vector<std::uint32_t>& nodes) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::size_t k = 1; k < nodes.size(); ++k)
    edges.push_back({std::min(nodes[k - 1], nodes[k]), std::max(nodes[k - 1], nodes[k])});
  std::sort(edges.begin(), edges.end());
  return edges;
}

model::Model flat(std::uint32_t nx, std::uint32_t ny, bool bend = true) {
  model::BuildOptions options;
  options.bend = bend;
  options.centrals = 0;
  return model::build_model(sheet(nx, ny), options, Context{}).model;
}

TEST(Cut, APathOfEdgesBecomesOneWound) {
  const model::Model before = flat(6, 4);
  // Along y = 2 from x = 1 to x = 4, in the midst of the sheet.
  const cutting::CutModel cut =
      cutting::cut_model(before, {.springs = {}, .edges = path({15, 16, 17, 18}), .sides = {}});
  EXPECT_EQ(cut.doubled, 2U);
  EXPECT_EQ(cut.split, 3U);
  EXPECT_TRUE(cut.left.empty());
  expect_kept(before, cut);
  expect_closed_answers_as_before(before, cut);
  const mesh::MeshReport report = mesh::examine_mesh(model::surface_mesh(cut.model));
  EXPECT_TRUE(report.manifold());
  EXPECT_TRUE(report.oriented());
  EXPECT_EQ(boundary_loops(before), 1U);
  EXPECT_EQ(boundary_loops(cut.model), 2U);
  EXPECT_EQ(cut.model.triangles.size(), before.triangles.size());
  // The two lips share an edge equally, for so do the areas beside it.
  for (const model::Spring& s : cut.model.springs)
    if (s.kind == model::SpringKind::edge && cut.origin[s.i] == 16 && cut.origin[s.j] == 17) {
      const model::Spring& old =
          *std::find_if(before.springs.begin(), before.springs.end(),
                        [](const model::Spring& b) { return b.i == 16 && b.j == 17; });
      EXPECT_NEAR(s.stiffness, old.stiffness / 2, 1e-12 * old.stiffness);
    }
}

TEST(Cut, AWoundGrowsEdgeByEdgeAsIfCutAtOnce) {
  const model::Model before = flat(6, 4);
  const cutting::CutModel at_once =
      cutting::cut_model(before, {.springs = {}, .edges = path({15, 16, 17, 18}), .sides = {}});
  model::Model model = before;
  cutting::Cut left;
  std::size_t doubled = 0;
  for (const auto& edge : path({15, 16, 17, 18})) {
    const cutting::CutModel step = cutting::cut_model(
        model, cutting::merged(left, {.springs = {}, .edges = {edge}, .sides = {}}));
    if (doubled == 0 && edge[0] == 15) {
      EXPECT_FALSE(step.changed()); // surface all round
      EXPECT_EQ(step.left.edges.size(), 1U);
    }
    doubled += step.doubled;
    left = step.left;
    model = step.model;
  }
  EXPECT_EQ(doubled, 2U);
  EXPECT_EQ(model, at_once.model);
}

TEST(Cut, FromRimToRimTheSheetFallsInTwo) {
  const model::Model before = flat(6, 4);
  const cutting::CutModel cut = cutting::cut_model(
      before, {.springs = {}, .edges = path({14, 15, 16, 17, 18, 19, 20}), .sides = {}});
  EXPECT_EQ(cut.doubled, 7U);
  expect_kept(before, cut);
  expect_closed_answers_as_before(before, cut);
  EXPECT_EQ(boundary_loops(cut.model), 2U);
  EXPECT_EQ(model::components(cut.model).count, 2U);
  const cutting::FreeParts parts = cutting::free_parts(before, cut);
  ASSERT_EQ(parts.parts.size(), 1U); // nothing is held: one stays
  ASSERT_TRUE(parts.rest.has_value());
  EXPECT_EQ(parts.rest->model.nodes.size() + parts.parts[0].model.nodes.size(),
            cut.model.nodes.size());
  EXPECT_NO_THROW(model::check_model(parts.rest->model));
  EXPECT_NO_THROW(model::check_model(parts.parts[0].model));
  EXPECT_NEAR(model::total_mass(parts.rest->model) + model::total_mass(parts.parts[0].model),
              model::total_mass(before), 1e-12 * model::total_mass(before));
}

TEST(Cut, APlaneThroughABallLeavesTwoHalves) {
  for (const bool bend : {false, true}) {
    const model::Model before = soft_ball(3, bend);
    const cutting::Cut plane = cutting::plane_cut(before, {{100.3, -50, 30}, {1, 0.2, 0.1}}, {});
    EXPECT_FALSE(plane.edges.empty());
    const cutting::CutModel cut = cutting::cut_model(before, plane);
    expect_kept(before, cut);
    expect_closed_answers_as_before(before, cut);
    EXPECT_TRUE(cut.left.empty());
    const mesh::MeshReport report = mesh::examine_mesh(model::surface_mesh(cut.model));
    EXPECT_TRUE(report.manifold());
    EXPECT_TRUE(report.oriented());
    EXPECT_EQ(report.components, 2U);
    EXPECT_EQ(boundary_loops(cut.model), 2U);
    EXPECT_EQ(cut.doubled, plane.edges.size()); // a closed way
    // No triangle, and no spring between surface nodes, joins the sides.
    const model::Components part = model::components(cut.model);
    for (const model::Spring& s : cut.model.springs)
      if (s.kind != model::SpringKind::central) {
        EXPECT_EQ(part.of_node[s.i], part.of_node[s.j]);
      }
    EXPECT_THROW((void)cutting::plane_cut(cut.model, {{100.3, -50, 30}, {1, 0.2, 0.1}}, {}), Error);
  }
}

TEST(Cut, ASweptAreaOpensTheSurfaceWhereItPasses) {
  const model::Model before = soft_ball(4);
  // From above, 25 mm long, 4 mm deep.
  const cutting::SweptQuad area{{{90, -50, 52}, {110, -50, 52}, {110, -50, 44}, {90, -50, 44}}};
  const cutting::Cut swept = cutting::swept_cut(before, {}, std::span(&area, 1));
  const cutting::CutModel cut = cutting::cut_model(before, swept);
  EXPECT_GT(cut.doubled, 5U);
  expect_kept(before, cut);
  expect_closed_answers_as_before(before, cut);
  EXPECT_EQ(boundary_loops(cut.model), 1U);
  EXPECT_TRUE(mesh::examine_mesh(model::surface_mesh(cut.model)).manifold());
  EXPECT_EQ(model::components(cut.model).count, 1U);
  for (const auto& [i, j] : swept.edges)
    for (const std::uint32_t node : {i, j}) {
      EXPECT_LT(std::abs(before.nodes[node].position.y + 50), 3);
      EXPECT_GT(before.nodes[node].position.z, 43);
    }
  // Moved along, the same area misses.
  std::vector<double> far(3 * before.nodes.size(), 100);
  EXPECT_TRUE(cutting::swept_cut(before, far, std::span(&area, 1)).empty());
}

TEST(Cut, AnAreaInPartsOpensWhatItOpensAsAWhole) {
  const model::Model before = soft_ball(4);
  const auto at = [](double x) { return Vec3{x, -50, 52}; };
  const auto below = [](double x) { return Vec3{x, -50, 44}; };
  const cutting::SweptQuad whole{at(90), at(110), below(110), below(90)};
  const cutting::CutModel at_once =
      cutting::cut_model(before, cutting::swept_cut(before, {}, std::span(&whole, 1)));
  model::Model model = before;
  cutting::Cut left;
  for (int k = 0; k < 40; ++k) {
    const cutting::SweptQuad part{at(90 + k / 2.0), at(90.5 + k / 2.0), below(90.5 + k / 2.0),
                                  below(90 + k / 2.0)};
    const cutting::CutModel step = cutting::cut_model(
        model, cutting::merged(left, cutting::swept_cut(model, {}, std::span(&part, 1))));
    left = step.left;
    model = step.model;
  }
  EXPECT_EQ(model.nodes.size(), at_once.model.nodes.size());
  EXPECT_EQ(boundary_loops(model), 1U);
  EXPECT_TRUE(mesh::examine_mesh(model::surface_mesh(model)).manifold());
}

TEST(Cut, SpringsThatAreGoneTakeTheirTrianglesAlong) {
  const model::Model before = soft_ball(3);
  std::vector<std::uint32_t> a, b;
  for (std::uint32_t i = 0; i < model::surface_count(before); ++i)
    (before.nodes[i].position.x < 100 ? a : b).push_back(i);
  const cutting::Cut between = cutting::springs_between(before, a, b);
  const cutting::CutModel cut = cutting::cut_model(before, between);
  expect_kept(before, cut);
  expect_closed_answers_as_before(before, cut);
  EXPECT_GE(cut.removed, between.springs.size());
  for (const Triangle& t : cut.model.triangles) {
    const auto left = [&](std::uint32_t i) { return cut.model.nodes[i].position.x < 100; };
    EXPECT_TRUE(left(t[0]) == left(t[1]) && left(t[1]) == left(t[2]));
  }
  EXPECT_TRUE(mesh::examine_mesh(model::surface_mesh(cut.model)).manifold());
  EXPECT_THROW((void)cutting::springs_between(cut.model, a, b), Error); // nothing is left
}

TEST(Cut, AHundredRandomCutsInARow) {
  std::mt19937 random(11);
  model::Model model = soft_ball(3);
  for (int k = 0; k < 100; ++k) {
    const auto below = [&](std::size_t n) {
      return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
    };
    cutting::Cut cut;
    if (k % 3 == 0) {
      std::set<std::size_t> springs;
      for (int s = 0; s < 3; ++s)
        springs.insert(below(model.springs.size()));
      cut.springs.assign(springs.begin(), springs.end());
    } else {
      std::set<std::array<std::uint32_t, 2>> edges;
      for (int walk = 0; walk < 6; ++walk) {
        const Triangle& t = model.triangles[below(model.triangles.size())];
        edges.insert({std::min(t[0], t[1]), std::max(t[0], t[1])});
        edges.insert({std::min(t[0], t[2]), std::max(t[0], t[2])});
      }
      cut.edges.assign(edges.begin(), edges.end());
    }
    const cutting::CutModel next = cutting::cut_model(model, cut);
    expect_kept(model, next);
    expect_closed_answers_as_before(model, next);
    ASSERT_TRUE(mesh::examine_mesh(model::surface_mesh(next.model)).manifold()) << k;
    ASSERT_TRUE(mesh::examine_mesh(model::surface_mesh(next.model)).oriented()) << k;
    const cutting::CutModel again = cutting::cut_model(model, cut);
    ASSERT_EQ(again.model, next.model);
    model = next.model;
    if (HasFailure())
      return;
  }
}

TEST(Cut, ACheckThatWouldFailSeesIt) {
  // The negative control of expect_kept: a lost share shows.
  const model::Model before = flat(6, 4);
  cutting::CutModel cut =
      cutting::cut_model(before, {.springs = {}, .edges = path({15, 16, 17, 18}), .sides = {}});
  cut.model.springs[0].stiffness *= 1.001;
  const Sums now = folded(cut.model, cut.origin);
  std::vector<std::uint32_t> same(before.nodes.size());
  for (std::uint32_t i = 0; i < same.size(); ++i)
    same[i] = i;
  const Sums old = folded(before, same);
  const auto& key = now.begin()->first;
  EXPECT_GT(std::abs(now.at(key).first / old.at(key).first - 1), 1e-4);
}

TEST(Cut, APartWithoutAHeldNodeComesOff) {
  model::Model before = organ(3);
  const std::size_t surface = model::surface_count(before);
  for (std::size_t i = surface; i < before.nodes.size(); ++i)
    before.nodes[i].fixed = model::fixed_none;
  const cutting::CutModel cut =
      cutting::cut_model(before, cutting::plane_cut(before, {{100, -50, 41}, {0, 0, 1}}, {}));
  cutting::FreeParts parts = cutting::free_parts(before, cut);
  ASSERT_EQ(parts.parts.size(), 1U);
  ASSERT_TRUE(parts.rest.has_value());
  const cutting::ModelPart& lobe = parts.parts[0];
  EXPECT_NO_THROW(model::check_model(lobe.model));
  EXPECT_NO_THROW(model::check_model(parts.rest->model));
  for (const model::Node& n : lobe.model.nodes)
    EXPECT_EQ(n.fixed, model::fixed_none);
  for (std::size_t i = 0; i < model::surface_count(lobe.model); ++i)
    EXPECT_GT(lobe.model.nodes[i].position.z, 36);
  EXPECT_NEAR(model::total_mass(parts.rest->model) + model::total_mass(lobe.model),
              model::total_mass(before), 1e-12 * model::total_mass(before));
  EXPECT_EQ(boundary_loops(lobe.model), 1U);
  EXPECT_EQ(boundary_loops(parts.rest->model), 1U);
  const std::size_t nodes = parts.rest->model.nodes.size();
  const cutting::CutModel rest = cutting::without_parts(cut, std::move(parts.rest));
  ASSERT_EQ(rest.model.nodes.size(), nodes);
  for (std::uint32_t i = 0; i < rest.place.size(); ++i)
    if (rest.place[i] != cutting::CutModel::gone) {
      EXPECT_EQ(rest.model.nodes[rest.place[i]].position, before.nodes[i].position);
    }
}

TEST(Cut, AHeldNodeThatLosesItsLastSpringIsFound) {
  model::Model before = flat(2, 2, false);
  before.nodes[0].fixed = model::fixed_all;
  cutting::Cut cut;
  for (std::size_t s = 0; s < before.springs.size(); ++s)
    if (before.springs[s].i == 0)
      cut.springs.push_back(s);
  EXPECT_THROW(cutting::require_held(before, cutting::cut_model(before, cut)), Error);
  cut.springs.pop_back();
  EXPECT_NO_THROW(cutting::require_held(before, cutting::cut_model(before, cut)));
}

TEST(Cut, WhatDoesNotExistIsRefused) {
  const model::Model before = flat(2, 2);
  EXPECT_THROW((void)cutting::cut_model(
                   before, {.springs = {before.springs.size()}, .edges = {}, .sides = {}}),
               Error);
  EXPECT_THROW((void)cutting::cut_model(before, {.springs = {}, .edges = {{0, 8}}, .sides = {}}),
               Error);
  EXPECT_THROW((void)cutting::plane_cut(before, {{0, 0, 5}, {0, 0, 1}}, {}), Error);
  const std::vector<std::uint32_t> lone{8};
  EXPECT_THROW((void)cutting::springs_between(before, lone, lone), Error);
}

TEST(Cut, StretchedSpringsTearTheSurfaceAcross) {
  const model::Model before = flat(8, 6);
  std::vector<double> shape(3 * before.nodes.size());
  for (std::size_t i = 0; i < before.nodes.size(); ++i)
    if (before.nodes[i].position.x > 4.5)
      shape[3 * i] = 0.6; // a column of edges is 60 % longer
  EXPECT_TRUE(cutting::torn_cut(before, shape, 0.7).empty());
  const cutting::CutModel cut = cutting::cut_model(before, cutting::torn_cut(before, shape, 0.5));
  EXPECT_GT(cut.doubled, 3U);
  expect_kept(before, cut);
  EXPECT_TRUE(mesh::examine_mesh(model::surface_mesh(cut.model)).manifold());
}

TEST(Cut, OfAnOrganFromAnImage) {
  for (const auto& [file, unit] : {std::pair("sofa_liver_smooth.obj", "cm"),
                                   std::pair("gca90_large_intestine_20k.stl", "mm")}) {
    const std::string path = shared_file(file);
    if (path.empty())
      GTEST_SKIP() << "no shared data";
    const model::Model before = model_of_file(path, unit);
    Box3 box;
    for (const model::Node& n : before.nodes)
      box.add(n.position);
    const Vec3 middle = 0.5 * (box.min + box.max);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 normal;
      normal[axis] = 1;
      const cutting::CutModel cut =
          cutting::cut_model(before, cutting::plane_cut(before, {middle, normal}, {}));
      expect_kept(before, cut, 1e-11);
      EXPECT_TRUE(mesh::examine_mesh(model::surface_mesh(cut.model)).manifold() ==
                  mesh::examine_mesh(model::surface_mesh(before)).manifold());
      EXPECT_NE(boundary_loops(cut.model), SIZE_MAX);
      EXPECT_GE(boundary_loops(cut.model), boundary_loops(before) + 2);
    }
  }
}

} // namespace
} // namespace gewebe::test
