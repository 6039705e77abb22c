// Contact on the part of a surface that instruments can reach: what is left out stays apart, and
// forces are those of contact on the whole surface.

#include "columns/compressed_columns.h"
#include "compliance/compliance_source.h"
#include "compressed_source.h"
#include "contact/island.h"
#include "fem/solid_model.h"
#include "geometry/boxes_meet.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "statics/surface_tiles.h"
#include "tet_fixtures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <optional>
#include <random>
#include <set>
#include <vector>

namespace gewebe::test {
namespace {

/// A bar of 120 x 10 x 10 mm, held at x = 0, with compressed columns.
struct StoredBar {
  model::Model model;
  columns::CompressedMade made;

  StoredBar() {
    fem::SolidModelOptions options;
    options.material.materials = {{"gel", 1e-3, 20000, 1, 0.2, 0.4}};
    model = fem::solid_model(test::box_tetrahedra(36, 3, 3, 10.0 / 3), options, {});
    for (model::Node& node : model.nodes)
      node.fixed = node.position.x == 0 ? model::fixed_all : model::fixed_none;
    made = test::compressed_surface(model, 1e-5);
  }
  std::shared_ptr<compliance::ComplianceSource> source() const {
    return test::compressed(model, made);
  }
};

const StoredBar& long_bar() {
  static const StoredBar bar;
  return bar;
}

TEST(ContactParts, SumsAreThoseOfTheWholeAndBoundsHold) {
  const std::shared_ptr<compliance::ComplianceSource> source = long_bar().source();
  const columns::CompressedColumns& columns = *source->columns()->compressed();
  const columns::NodeClusters& clusters = columns.layout().clusters;
  ASSERT_GT(clusters.size(), 5);
  std::mt19937 random(5);
  std::normal_distribution<double> any;
  for (int round = 0; round < 20; ++round) {
    std::set<std::uint32_t> nodes;
    for (int k = 0; k < 1 + round; ++k)
      nodes.insert(static_cast<std::uint32_t>(random() % columns.row_nodes()));
    std::vector<contact::NodeVector> forces;
    for (const std::uint32_t node : nodes)
      forces.push_back({node, {any(random), any(random), any(random)}});
    std::vector<double> whole(3 * columns.row_nodes());
    columns.add(forces, test::one_thread(), whole);
    const std::vector<double> bounds = columns.bounds(forces, test::one_thread());
    for (std::uint32_t c = 0; c < clusters.size(); ++c) {
      const std::vector<double> part = columns.sum_at({&c, 1}, forces, test::one_thread());
      const std::span<const std::uint32_t> of = clusters.nodes(c);
      ASSERT_EQ(part.size(), 3 * of.size());
      for (std::size_t k = 0; k < of.size(); ++k)
        EXPECT_EQ(vector_at(part, k), vector_at(whole, of[k]));
      const double largest = largest_size(part);
      EXPECT_LE(largest, bounds[c] * (1 + 1e-12));
      // One force has no others to be cancelled by.
      if (round == 0) {
        EXPECT_LE(bounds[c], 4 * largest + 1e-3 * largest_size(whole)) << "of no use";
      }
    }
  }
}

TEST(ContactParts, TilesThatMayMeetABoxAreFound) {
  const model::Model& model = long_bar().model;
  const contact::ModelSurface surface = contact::model_surface(model);
  const std::shared_ptr<compliance::ComplianceSource> source = long_bar().source();
  const columns::NodeClusters& clusters = source->columns()->compressed()->layout().clusters;
  const statics::SurfaceTiles tiles(surface, clusters);
  std::vector<std::uint32_t> cluster(clusters.node.size());
  for (std::uint32_t c = 0; c < clusters.size(); ++c)
    for (const std::uint32_t node : clusters.nodes(c))
      cluster[node] = c;
  std::mt19937 random(6);
  std::uniform_real_distribution<double> any(0, 1);
  const auto direction = [&] {
    const Vec3 v{any(random) - 0.5, any(random) - 0.5, any(random) - 0.5};
    return v / norm(v);
  };
  std::vector<std::size_t> sizes;
  for (int round = 0; round < 50; ++round) {
    std::vector<double> bounds(clusters.size());
    for (double& bound : bounds)
      bound = 5 * any(random);
    std::vector<Vec3> x;
    for (std::size_t v = 0; v < surface.node.size(); ++v)
      x.push_back(surface.surface.rest[v] +
                  any(random) * bounds[cluster[surface.node[v]]] * direction());
    const Vec3 at{120 * any(random), 10 * any(random), 10};
    const Box3 box{at, at + Vec3{3, 3, 3}};
    const std::vector<std::uint32_t> near = tiles.near({&box, 1}, bounds);
    const statics::SurfacePatch part = tiles.part(near);
    sizes.push_back(part.surface.node.size());
    // The part is what it says.
    for (std::size_t v = 0; v < part.surface.node.size(); ++v) {
      EXPECT_EQ(part.node[part.place[v]], part.surface.node[v]);
      EXPECT_EQ(part.surface.surface.rest[v], model.nodes[part.surface.node[v]].position);
    }
    std::set<std::array<std::uint32_t, 3>> found;
    for (const auto& [a, b, c] : part.surface.surface.triangles)
      found.insert({part.surface.node[a], part.surface.node[b], part.surface.node[c]});
    std::size_t met = 0;
    for (const auto& [a, b, c] : surface.surface.triangles) {
      Box3 own;
      for (const std::uint32_t v : {a, b, c})
        own.add(x[v]);
      if (!meet(own, box))
        continue;
      ++met;
      EXPECT_TRUE(found.contains({surface.node[a], surface.node[b], surface.node[c]}));
    }
    EXPECT_GT(met, 0);
    const std::uint32_t one = part.surface.node[0];
    const std::vector<std::uint32_t> with = tiles.with({&one, 1});
    ASSERT_EQ(with.size(), 1);
    EXPECT_TRUE(std::ranges::binary_search(tiles.part(with).surface.node, one));
  }
  EXPECT_LT(*std::ranges::min_element(sizes), surface.node.size() / 4);
}

/// A bar in a scene. \param whole  it may touch another object, which is far away: then contact is
/// looked for all over its surface
void add_bar(scene::Simulation& s, bool whole) {
  s.add_object("bar", long_bar().model, scene::Method::ffe, long_bar().source());
  if (!whole)
    return;
  model::Model far = fem::solid_model(test::box_tetrahedra(1, 1, 1, 5), {}, {});
  for (model::Node& node : far.nodes) {
    node.position.x += 1000;
    node.fixed = model::fixed_all;
  }
  s.add_object("far", far, scene::Method::ffe);
  s.apply(scene::SetContact{0, 1, 0});
}

scene::SetInstrument tool(std::size_t number, double radius, const Vec3& at, double friction,
                          const Vec3& axis = {}) {
  scene::SetInstrument set;
  set.instrument = number;
  set.shape.radius = radius;
  set.shape.axis = axis;
  set.shape.friction = friction;
  set.pose.place = at;
  set.name = "tool" + std::to_string(number);
  return set;
}

struct Told {
  std::vector<Vec3> forces, torques;
  std::vector<std::vector<double>> shapes;
  std::uint64_t shapes_made = 0;
};

/// A sphere that rolls along the bar's upper side and a capsule below its end. \param whole  the
/// bar may touch itself, which it does nowhere: then contact is looked for all over its surface
/// \param read  shapes are read in each step
Told rolled(bool whole, bool read) {
  scene::Simulation s(test::one_thread(), {});
  add_bar(s, whole);
  s.apply(scene::SetForce{0, {0, 7}, {10, 20, 5}});
  s.apply(tool(0, 6, {60, 5, 17}, 0.3));
  s.apply(tool(1, 3, {80, -5, -4}, 0, {0, 20, 0}));
  s.step(0.01);
  Told told;
  for (int k = 0; k < 40; ++k) {
    s.apply(scene::MoveInstrument{0, {60 + 0.7 * k, 5, 15.6 - 0.05 * k}, {}, 0.01});
    s.step(0.01);
    for (const std::size_t number : {0U, 1U}) {
      told.forces.push_back(s.instrument(number).force);
      told.torques.push_back(s.instrument(number).torque);
    }
    if (read || k == 39) {
      const std::span<const double> u = s.displacement(0);
      told.shapes.emplace_back(u.begin(), u.end());
    }
  }
  told.shapes_made = s.counts().elastostatic.shapes;
  return told;
}

TEST(ContactParts, ForcesAreThoseOfTheWholeSurface) {
  const Told part = rolled(false, false), whole = rolled(true, false);
  ASSERT_EQ(part.forces.size(), whole.forces.size());
  double most = 0, of_second = 0;
  for (std::size_t k = 0; k < whole.forces.size(); ++k) {
    most = test::larger(most, norm(whole.forces[k]));
    if (k % 2 == 1)
      of_second = test::larger(of_second, norm(whole.forces[k]));
  }
  EXPECT_GT(most, 0);
  EXPECT_GT(of_second, most / 100) << "the bar comes down on the capsule";
  for (std::size_t k = 0; k < whole.forces.size(); ++k) {
    EXPECT_LE(norm(part.forces[k] - whole.forces[k]), 2e-4 * most) << k;
    EXPECT_LE(norm(part.torques[k] - whole.torques[k]), 2e-3 * most) << k;
  }
  const std::vector<double>&a = part.shapes.back(), &b = whole.shapes.back();
  for (std::size_t k = 0; k < a.size(); ++k)
    EXPECT_NEAR(a[k], b[k], 1e-3 * largest_size(b));
  EXPECT_LT(part.shapes_made, whole.shapes_made / 4) << "shapes that are not read cost nothing";
}

// Three tools, one of them held by a spring, anywhere around the bar; one comes and goes.
TEST(ContactParts, WhereverToolsGoForcesAreThoseOfTheWholeSurface) {
  const auto forces = [](bool whole) {
    scene::Simulation s(test::one_thread(), {});
    add_bar(s, whole);
    s.apply(tool(0, 6, {60, 5, 17}, 0));
    s.apply(tool(1, 3, {80, -5, -4}, 0, {0, 20, 0}));
    s.apply(tool(2, 4, {110, 16, 5}, 0));
    s.apply(scene::SetCoupling{0, contact::Coupling{4000, 0}});
    s.step(0.01);
    std::mt19937 random(8);
    std::uniform_real_distribution<double> any(-1, 1);
    std::vector<Vec3> all;
    for (int k = 0; k < 20; ++k) {
      const double x = 70 + 40 * any(random);
      s.apply(scene::MoveInstrument{0, {x, 5 + any(random), 14.5 + any(random)}, {}, 0.01});
      s.apply(scene::MoveInstrument{1, {80 + 6 * any(random), -5, -3 + any(random)}, {}, 0.01});
      if (k % 10 == 6)
        s.apply(scene::Withdraw{2});
      else if (k % 10 == 8)
        s.apply(tool(2, 4, {110 + 5 * any(random), 16, 5}, 0));
      else if (k % 10 != 7)
        s.apply(scene::MoveInstrument{2, {110 + 5 * any(random), 14 + any(random), 5}, {}, 0.01});
      s.step(0.01);
      for (const std::size_t number : {0U, 1U, 2U})
        all.push_back(s.instrument(number).force);
    }
    return all;
  };
  const std::vector<Vec3> part = forces(false), whole = forces(true);
  double most = 0;
  std::array<std::size_t, 3> touched{};
  for (std::size_t k = 0; k < whole.size(); ++k) {
    most = test::larger(most, norm(whole[k]));
    touched[k % 3] += norm(whole[k]) > 0 ? 1 : 0;
  }
  for (const std::size_t count : touched)
    EXPECT_GT(count, 2);
  for (std::size_t k = 0; k < whole.size(); ++k)
    EXPECT_LE(norm(part[k] - whole[k]), 5e-4 * most) << k;
}

// Answers are the same bytes whether shapes are read or not.
TEST(ContactParts, ForcesDoNotDependOnWhatIsRead) {
  const Told one = rolled(false, false), other = rolled(false, true);
  EXPECT_EQ(one.forces, other.forces);
  EXPECT_EQ(one.torques, other.torques);
}

// The end of the bar is pushed down far in one step, so that its middle meets an instrument that
// was out of reach of everything at the beginning.
TEST(ContactParts, WhatOnlyTheEndOfAStepReachesIsInContact) {
  const auto forces = [&](bool whole) {
    scene::Simulation s(test::one_thread(), {});
    add_bar(s, whole);
    s.apply(tool(0, 30, {115, 5, 41}, 0)); // so large that it goes all of its way at once
    s.apply(tool(1, 3, {70, -5, -5}, 0, {0, 20, 0}));
    s.step(0.01);
    EXPECT_EQ(norm(s.instrument(0).force), 0);
    s.apply(scene::MoveInstrument{0, {115, 5, 32}, {}, 0.01});
    s.step(0.01);
    return std::pair(s.instrument(0).force, s.instrument(1).force);
  };
  const auto [pressed, held] = forces(false);
  const auto [pressed_whole, held_whole] = forces(true);
  EXPECT_LT(held.z, 0);
  EXPECT_LE(norm(pressed - pressed_whole), 2e-4 * norm(pressed_whole));
  EXPECT_LE(norm(held - held_whole), 2e-4 * norm(held_whole));
}

// Forces on nodes bend the bar so far in one step that it meets an instrument.
TEST(ContactParts, LoadsPushSurfacesOntoInstruments) {
  for (const bool stored : {true, false}) {
    scene::Simulation s(test::one_thread(), {});
    s.add_object("bar", long_bar().model, scene::Method::ffe,
                 stored ? long_bar().source() : nullptr);
    s.apply(tool(0, 3, {80, -5, -9}, 0, {0, 20, 0}));
    s.step(0.01);
    std::vector<std::uint32_t> end;
    for (std::uint32_t i = 0; i < long_bar().model.nodes.size(); ++i)
      if (long_bar().model.nodes[i].position.x > 119)
        end.push_back(i);
    s.apply(scene::SetForce{0, end, {0, 0, -300}});
    s.step(0.01);
    EXPECT_LT(s.instrument(0).force.z, -100) << stored;
    s.step(0.01);
    EXPECT_LT(s.instrument(0).force.z, -100) << stored;
  }
}

} // namespace
} // namespace gewebe::test
