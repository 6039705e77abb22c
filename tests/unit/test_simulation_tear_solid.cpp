// Solids that tear: where and under which force, what stays of them, and what goes on.

#include "base/error.h"
#include "contact_checks.h"
#include "cut_bars.h"
#include "cutting/tear_solid.h"
#include "fem/assembly.h"
#include "fem/solid_model.h"
#include "larger.h"
#include "mesh/check.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::count, test::expect_sound, test::nodes_where, test::one_thread, test::shape;

constexpr double length = 32, side = 8;

/// 32 x 8 x 8 mm, of "strong" with "weak" in x = 12 … 16, or all of one; as stiff all over, and not
/// narrower where it is pulled. Held at x = 0.
model::Model pulled_bar(bool quadratic, std::uint32_t cells = 4, bool weak = true) {
  const double cell = side / cells;
  tetrahedra::TetMesh mesh = test::box_tetrahedra(4 * cells, cells, cells, cell);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    double x = 0;
    for (const std::uint32_t corner : t)
      x += mesh.points[corner].x / 4;
    mesh.material.push_back(weak && x > 12 && x < 16 ? 1 : 0);
  }
  fem::SolidModelOptions options;
  options.material.materials = {{"strong", 1e-3, 20000, 1, 0.2, 0.0}};
  options.material.of_part = {0};
  if (weak) {
    options.material.materials.push_back({"weak", 1e-3, 20000, 1, 0.2, 0.0});
    options.material.of_part = {0, 1};
  }
  options.quadratic = quadratic;
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  for (model::Node& node : model.nodes)
    node.fixed = node.position.x == 0 ? model::fixed_all : model::fixed_none;
  model.name = "bar";
  return model;
}

/// f = K u of the bar, and half of u f.
struct Pull {
  double force = 0;  // 1e-6 N, along x, on the nodes that are held
  double energy = 0; // 1e-9 J
};
Pull pull_of(const model::Model& model, const std::vector<double>& u) {
  const tetrahedra::TetMesh mesh = fem::element_mesh(model);
  std::vector<double> f(u.size());
  fem::multiply_solid(mesh, fem::solid_elements(mesh, fem::element_materials(model)), u, f);
  Pull pull;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].fixed == model::fixed_all)
      pull.force -= f[3 * i];
  for (std::size_t a = 0; a < u.size(); ++a)
    pull.energy += u[a] * f[a] / 2;
  return pull;
}

std::vector<std::uint32_t> end_of(const model::Model& model) {
  return nodes_where(model, [](const Vec3& p) { return p.x == length; });
}

class SolidTears : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Orders, SolidTears, testing::Bool());

/// Displaces the end of what holds x = 0 step by step, until it tears. \return the share before
double pull_until_torn(scene::Simulation& s, double stretch, double from, double step, double to) {
  for (double share = from; share < to; share += step) {
    s.apply(scene::SetDisplacement{0, end_of(s.model(0)), {share * stretch, 0, 0}});
    s.step(0.1);
    if (count(s, scene::Cutting::Kind::cut) > 0)
      return share;
  }
  return 0;
}

TEST_P(SolidTears, ABarTearsInItsWeakestMaterialAtStrengthTimesArea) {
  const double strength = 500, stretch = strength / 20000 * length;
  for (const bool stress : {true, false}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", pulled_bar(GetParam(), GetParam() ? 2 : 4), scene::Method::ffe);
    const double mass = model::total_mass(s.model(0)), volume = length * side * side;
    const double of = stress ? 1 : 1 / 20000.0;
    s.apply(scene::SetTear{0, 0, {stress, {4 * strength * of, strength * of}, 0}});
    const double share = pull_until_torn(s, stretch, 0.855, 0.01, 1.2);
    EXPECT_NEAR(share, 1, 0.011); // a step
    const double force = share * strength * side * side;
    if (s.object_count() == 1) {
      const std::vector<double> kept = shape(s, 0); // the tear is closed still, and bears
      EXPECT_NEAR(pull_of(s.model(0), kept).force, force, 1e-9 * force);
      EXPECT_NEAR(pull_of(s.model(0), kept).energy,
                  share * share * strength * strength / 40000 * volume,
                  1e-6 * strength * strength / 40000 * volume);
    }
    double energy = share * share * strength * strength / 40000 * volume;
    for (int steps = 0; s.object_count() == 1; ++steps) {
      ASSERT_LT(steps, 20);
      expect_sound(s.model(0), volume, mass);
      s.step(0.1);
      if (s.object_count() > 1)
        break;
      const double left = pull_of(s.model(0), shape(s, 0)).energy;
      EXPECT_LT(left, energy); // under held displacements
      energy = left;
    }
    EXPECT_EQ(count(s, scene::Cutting::Kind::part), 1U);
    const std::vector<model::Model> models = test::models_of(s);
    EXPECT_NEAR(signed_volume(model::surface_mesh(models[0])) +
                    signed_volume(model::surface_mesh(models[1])),
                volume, 1e-12 * volume);
    EXPECT_NEAR(model::total_mass(models[0]) + model::total_mass(models[1]), mass, 1e-12 * mass);
    for (const model::Model& model : models)
      expect_sound(model, signed_volume(model::surface_mesh(model)), model::total_mass(model));
    double left = 0, right = length;
    for (const model::Node& node : models[0].nodes)
      left = test::larger(left, node.position.x);
    for (const model::Node& node : models[1].nodes)
      right = test::smaller(right, node.position.x);
    EXPECT_NEAR(left, 14, 2 + 1e-9); // in the weak material, or along it
    EXPECT_NEAR(right, 14, 2 + 1e-9);
  }
}

TEST_P(SolidTears, NothingTearsBelowTheLimit) {
  const double strength = 500, stretch = strength / 20000 * length;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {});
    const model::Model before = pulled_bar(GetParam(), 2);
    s.add_object("bar", model::Model(before), method);
    s.apply(scene::SetTear{0, 0, {true, {strength}, 0}});
    s.apply(scene::SetDisplacement{0, end_of(before), {0.99 * stretch, 0, 0}, 1});
    for (int k = 0; k < 20; ++k)
      s.step(0.1);
    EXPECT_EQ(s.model(0), before) << scene::method_name(method);
    // Materials of 0 do not tear.
    s.apply(scene::SetTear{0, 0, {true, {0, 0}, 0}});
    s.apply(scene::SetDisplacement{0, end_of(before), {3 * stretch, 0, 0}, 0.5});
    for (int k = 0; k < 10; ++k)
      s.step(0.1);
    EXPECT_EQ(s.model(0), before) << scene::method_name(method);
  }
}

TEST_P(SolidTears, AMovingBarTearsAndItsPartGoesOn) {
  const double strength = 500, stretch = strength / 20000 * length;
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", pulled_bar(GetParam(), 2), scene::Method::ela);
  const double mass = model::total_mass(s.model(0)), volume = length * side * side;
  s.apply(scene::SetTear{0, 0, {true, {4 * strength, strength}, 0}});
  s.apply(scene::SetDisplacement{0, end_of(s.model(0)), {2 * stretch, 0, 0}, 4}); // slowly
  int torn = 0;
  for (int k = 0; k < 60 && s.object_count() == 1; ++k) {
    s.step(0.05);
    if (torn == 0 && count(s, scene::Cutting::Kind::cut) > 0)
      torn = k + 1;
    if (s.object_count() == 1)
      expect_sound(s.model(0), volume, mass);
  }
  ASSERT_EQ(s.object_count(), 2U);
  // The way there goes by a smooth ramp: its middle at half of the time.
  EXPECT_NEAR(torn * 0.05, 2, 0.2);
  EXPECT_NEAR(model::total_mass(s.model(0)) + model::total_mass(s.model(1)), mass, 1e-12 * mass);
  s.step(0.05);
  EXPECT_EQ(s.object(1).name, "bar.1");
}

/// At what load a notched bar tears, from one shape of it, in shares of that load.
double load_at_tearing(std::uint32_t cells, double over) {
  const model::Model whole = pulled_bar(false, cells, false);
  scene::PlaneToCut half{{{14 - 1e-3, 0, 0}, {1, 0, 0}},
                         nodes_where(whole, [](const Vec3& p) { return p.z >= 4; })};
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", model::Model(whole), scene::Method::ffe);
  s.apply(scene::CutObject{0, half});
  s.apply(scene::SetDisplacement{0, end_of(s.model(0)), {1, 0, 0}});
  s.step(0.1);
  const std::vector<double> u = shape(s, 0);
  const cutting::TearLimit limit{true, {1e-3}, over};
  const std::optional<cutting::SolidTear> tear =
      cutting::find_tear(s.model(0), u, fem::StrainFrames::resting, limit);
  EXPECT_TRUE(tear.has_value());
  EXPECT_NEAR(tear->plane.point.x, 14, 32.0 / (4 * cells));
  EXPECT_GT(std::abs(tear->plane.normal.x), 0.5);
  return 1e6 / tear->share;
}

TEST(SolidTearLoads, MeansOverALengthDependLessOnTheMesh) {
  const double coarse = load_at_tearing(4, 0), fine = load_at_tearing(8, 0);
  EXPECT_LT(fine, 0.8 * coarse); // as the root of a square, if the notch were a crack
  const double coarse_over = load_at_tearing(4, 3), fine_over = load_at_tearing(8, 3);
  EXPECT_NEAR(fine_over, coarse_over, 0.02 * coarse_over);
}

/// Two layers of different stiffness under the same strain: averages must not mix their stresses.
TEST(SolidTearLoads, StressAveragesUseOneMaterial) {
  model::Model model = pulled_bar(false, 4, true);
  model.materials[0].young = 20000;
  model.materials[1].young = 60000;
  for (std::size_t t = 0; t < model.tetrahedra.size(); ++t) {
    double z = 0;
    for (const std::uint32_t corner : model.tetrahedra[t])
      z += model.nodes[corner].position.z / 4;
    model.tetrahedron_material[t] = z < side / 2 ? 0 : 1;
  }
  std::vector<double> u;
  for (const model::Node& node : model.nodes)
    u.insert(u.end(), {0.01 * node.position.x, 0, 0});
  for (const double over : {0.0, 1.0, 3.0, 50.0}) {
    const std::optional<cutting::SolidTear> soft =
        cutting::find_tear(model, u, fem::StrainFrames::resting, {true, {100, 900}, over});
    ASSERT_TRUE(soft.has_value());
    EXPECT_NEAR(soft->share, 2, 1e-9) << over;
    EXPECT_EQ(model.tetrahedron_material[soft->tetrahedron], 0) << over;
    const std::optional<cutting::SolidTear> stiff =
        cutting::find_tear(model, u, fem::StrainFrames::resting, {true, {210, 500}, over});
    ASSERT_TRUE(stiff.has_value());
    EXPECT_NEAR(stiff->share, 1.2, 1e-9) << over;
    EXPECT_EQ(model.tetrahedron_material[stiff->tetrahedron], 1) << over;
    EXPECT_FALSE(
        cutting::find_tear(model, u, fem::StrainFrames::resting, {true, {201, 601}, over}));
  }
}

/// The mean strain along x is what the end has moved by, over the length, however the elements
/// share the volume.
TEST(SolidTearLoads, MeansAreByVolume) {
  model::Model model = pulled_bar(false, 4, false);
  std::vector<double> u;
  for (model::Node& node : model.nodes) {
    double& x = node.position.x;
    x = x * x / length; // short elements at one end
    u.insert(u.end(), {0.001 * x * x, 0, 0});
  }
  const double mean = 0.001 * length;
  const std::optional<cutting::SolidTear> tear =
      cutting::find_tear(model, u, fem::StrainFrames::resting, {false, {0.5 * mean}, 10 * length});
  ASSERT_TRUE(tear.has_value());
  EXPECT_NEAR(tear->share, 2, 0.02);
}

/// A bar that is turned and pulled tears across itself: the plane is that of the body at rest.
TEST(SolidTearLoads, ThePlaneOfATurnedBarIsThatAtRest) {
  for (const bool quadratic : {false, true}) {
    const model::Model model = pulled_bar(quadratic, 2, true);
    std::vector<double> u;
    for (const model::Node& node : model.nodes) { // a quarter turn about z, 10 % longer
      const Vec3 &p = node.position, now{-p.y, 1.1 * p.x, p.z};
      u.insert(u.end(), {now.x - p.x, now.y - p.y, now.z - p.z});
    }
    const std::optional<cutting::SolidTear> tear =
        cutting::find_tear(model, u, fem::StrainFrames::elements, {false, {0.5, 0.05}, 0});
    ASSERT_TRUE(tear.has_value());
    EXPECT_NEAR(tear->share, 2, 1e-6);
    const Vec3 normal = tear->plane.normal / norm(tear->plane.normal);
    EXPECT_NEAR(std::abs(normal.x), 1, 1e-6);
  }
}

TEST_P(SolidTears, ANotchGoesOnFromItsFront) {
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", pulled_bar(GetParam(), 4, false), scene::Method::ffe);
  const double mass = model::total_mass(s.model(0)), volume = length * side * side;
  s.apply(scene::CutObject{
      0, scene::PlaneToCut{{{14.1, 0, 0}, {1, 0, 0}},
                           nodes_where(s.model(0), [](const Vec3& p) { return p.z >= 4; })}});
  s.take_news();
  s.apply(scene::SetTear{0, 0, {true, {500}, 1.5}});
  const double share = pull_until_torn(s, 500 / 20000.0 * length, 0.02, 0.02, 1);
  EXPECT_GT(share, 0.1);
  EXPECT_LT(share, 0.9); // long before the bar without it would
  for (int steps = 0; s.object_count() == 1; ++steps) {
    ASSERT_LT(steps, 60);
    expect_sound(s.model(0), volume, mass);
    const double more = (share + 0.01 * steps) * 500 / 20000 * length; // held, it may stop
    s.apply(scene::SetDisplacement{0, end_of(s.model(0)), {more, 0, 0}});
    s.step(0.1);
  }
  const std::vector<model::Model> models = test::models_of(s);
  double left = 0, right = length;
  for (const model::Node& node : models[0].nodes)
    left = test::larger(left, node.position.x);
  for (const model::Node& node : models[1].nodes)
    right = test::smaller(right, node.position.x);
  EXPECT_NEAR(left, 14, 4.1);
  EXPECT_NEAR(right, 14, 4.1);
}

TEST(SolidTearScenes, AWeakPlaceInsideBecomesACave) {
  model::Model model = pulled_bar(false, 8);
  for (std::size_t t = 0; t < model.tetrahedra.size(); ++t) {
    Vec3 middle;
    for (const std::uint32_t corner : model.tetrahedra[t])
      middle += model.nodes[corner].position / 4;
    const bool inside =
        std::abs(middle.x - 14) < 2 && std::abs(middle.y - 4) < 2 && std::abs(middle.z - 4) < 2;
    model.tetrahedron_material[t] = inside ? 1 : 0;
  }
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", model::Model(model), scene::Method::ffe);
  const double mass = model::total_mass(s.model(0)), volume = length * side * side;
  s.apply(scene::SetTear{0, 0, {true, {0, 500}, 0}});
  s.apply(scene::SetDisplacement{0, end_of(model), {1.05 * 500 / 20000 * length, 0, 0}});
  for (int k = 0; k < 3; ++k) {
    s.step(0.1);
    double volumes = 0, masses = 0;
    for (const model::Model& one : test::models_of(s)) { // what comes off inside lies in the cave
      expect_sound(one, signed_volume(model::surface_mesh(one)), model::total_mass(one));
      volumes += signed_volume(model::surface_mesh(one));
      masses += model::total_mass(one);
    }
    EXPECT_NEAR(volumes, volume, 1e-12 * volume);
    EXPECT_NEAR(masses, mass, 1e-12 * mass);
  }
  EXPECT_GT(count(s, scene::Cutting::Kind::cut), 0U);
  std::size_t shells = 0;
  for (const model::Model& one : test::models_of(s))
    shells += mesh::examine_mesh(model::surface_mesh(one)).components;
  EXPECT_GT(shells, s.object_count()); // its wall is a surface of its own
}

TEST(SolidTearScenes, RestoreMakesItWholeAgain) {
  scene::Simulation s(one_thread(), {});
  const model::Model before = pulled_bar(false, 4);
  s.add_object("bar", model::Model(before), scene::Method::ffe);
  s.apply(scene::SetTear{0, 0, {true, {2000, 500}, 0}});
  s.apply(scene::SetDisplacement{0, end_of(before), {1.05 * 500 / 20000 * length, 0, 0}});
  s.step(0.1);
  ASSERT_EQ(count(s, scene::Cutting::Kind::cut), 1U);
  s.apply(scene::Restore{0});
  EXPECT_EQ(s.model(0), before);
  s.apply(scene::SetTear{0, 0});
  s.step(0.1);
  EXPECT_EQ(s.model(0), before);
}

/// Splinters of skin may come off by themselves.
double closed_skins(const scene::Simulation& s) {
  double volume = 0;
  for (const model::Model& model : test::models_of(s)) {
    model::check_model(model);
    if (model.skin.points.empty())
      continue;
    const mesh::MeshReport report = mesh::examine_mesh(model::shown_mesh(model));
    EXPECT_TRUE(report.closed() && report.oriented() && report.manifold());
    volume += signed_volume(model::shown_mesh(model));
  }
  return volume;
}

TEST(SolidTearScenes, ASkinGoesAlong) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    std::vector<std::string> warnings;
    scene::Simulation s(one_thread(),
                        {.warn = [&](const std::string& t) { warnings.push_back(t); }});
    const model::Model whole = test::skinned_bar(false);
    const double volume = signed_volume(model::shown_mesh(whole));
    s.add_object("bar", model::Model(whole), method);
    s.apply(scene::SetTear{0, 0, {false, {0, 0.04}, 0}});
    const auto end = nodes_where(whole, [](const Vec3& p) { return p.x == 20; });
    s.apply(scene::SetDisplacement{0, end, {2, 0, 0}, method == scene::Method::ela ? 1.0 : 0.0});
    for (int k = 0; k < 60 && s.object_count() == 1; ++k) {
      s.step(0.05);
      EXPECT_NEAR(closed_skins(s), volume, 1e-6 * volume);
    }
    EXPECT_EQ(s.object_count(), 2U) << scene::method_name(method);
    EXPECT_TRUE(std::ranges::any_of(warnings, [](const std::string& text) {
      return text.find("edges that no cut has passed") != std::string::npos;
    })) << scene::method_name(method);
  }
}

TEST(SolidTearScenes, TheSameForAnyNumberOfThreads) {
  std::vector<double> first;
  for (const int threads : {1, 2}) {
    Context context;
    context.threads = threads;
    scene::Simulation s(context, {});
    s.add_object("bar", pulled_bar(true, 2), scene::Method::ela);
    s.apply(scene::SetTear{0, 0, {true, {2000, 500}, 2}});
    s.apply(scene::SetDisplacement{0, end_of(s.model(0)), {2 * 500 / 20000.0 * length, 0, 0}, 0.2});
    for (int k = 0; k < 10; ++k)
      s.step(0.05);
    ASSERT_GT(count(s, scene::Cutting::Kind::cut), 0U);
    std::vector<double> all = shape(s, 0);
    for (std::size_t k = 1; k < s.object_count(); ++k) {
      const std::vector<double> part = shape(s, k);
      all.insert(all.end(), part.begin(), part.end());
    }
    if (threads == 1)
      first = all;
    else
      EXPECT_EQ(all, first);
  }
}

TEST(SolidTearScenes, AWoundUnderAnInstrumentHasWallsForIt) {
  const double strength = 500, stretch = strength / 20000 * length, radius = 1.2;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", pulled_bar(false, 4), method);
    s.apply(scene::SetTear{0, 0, {true, {4 * strength, strength}, 0}});
    const contact::InstrumentShape ball{radius, {}, 0.2};
    Vec3 place{14, 4, side + radius + 0.5};
    s.apply(scene::SetInstrument{0, ball, {place, {}}});
    double pulled = 0, on_wall = 0;
    const auto step = [&](const Vec3& to, double pull) {
      place = to;
      pulled = pull;
      for (std::size_t k = 0; k < s.object_count(); ++k)
        if (const auto end = end_of(s.model(k)); !end.empty())
          s.apply(scene::SetDisplacement{k, end, {pulled, 0, 0}, 0.05});
      s.apply(scene::MoveInstrument{0, place, {}, 0.05});
      s.step(0.05);
      const scene::InstrumentReport tool = s.instrument(0);
      EXPECT_TRUE(std::isfinite(norm(tool.force)) && std::isfinite(norm(tool.torque)));
      for (std::size_t k = 0; k < s.object_count(); ++k) {
        const model::Model model = s.model(k);
        const std::vector<double> u = shape(s, k);
        for (const double one : u)
          ASSERT_TRUE(std::isfinite(one));
        EXPECT_LT(test::surface_depth(model, u, ball, tool.pose), test::depth_allowed);
        for (const contact::NodeVector& f : s.contact_forces(k)) {
          EXPECT_TRUE(std::isfinite(norm(f.value)));
          const Vec3& rest = model.nodes[f.node].position;
          const auto inside = [](double at) { return at > 1e-6 && at < side - 1e-6; };
          if (inside(rest.y) && inside(rest.z) && rest.x < length)
            on_wall = test::larger(on_wall, norm(f.value));
        }
      }
    };
    while (norm(s.instrument(0).force) == 0 && place.z > side)
      step(place - Vec3{0, 0, 0.1}, 0);
    // Chips may come off before the ends do.
    const auto severed = [&] {
      for (std::size_t k = 0; k < s.object_count(); ++k)
        if (const model::Model& m = s.model(k);
            !end_of(m).empty() && std::ranges::any_of(m.nodes, [](const model::Node& n) {
              return n.fixed == model::fixed_all;
            }))
          return false;
      return true;
    };
    double pressed = 0; // when it tears
    for (int k = 1; k <= 60 && !severed(); ++k) {
      if (count(s, scene::Cutting::Kind::cut) == 0)
        pressed = s.instrument(0).force.z;
      step(place, (0.6 + 0.02 * k) * stretch);
    }
    EXPECT_GT(pressed, 0) << scene::method_name(method);
    ASSERT_TRUE(severed()) << scene::method_name(method);
    for (std::size_t k = 0; k < s.object_count(); ++k)
      s.apply(scene::SetTear{k, 0}); // the ball would tear off more
    EXPECT_EQ(on_wall, 0) << scene::method_name(method);
    for (int k = 0; k < 16; ++k)
      step(place, pulled + 0.5); // the wound opens
    double wall = 0;             // how far what is left at the fixed end reaches
    for (std::size_t k = 0; k < s.object_count(); ++k)
      if (end_of(s.model(k)).empty())
        for (std::size_t i = 0; i < s.model(k).nodes.size(); ++i)
          wall = test::larger(wall, s.model(k).nodes[i].position.x + shape(s, k)[3 * i]);
    for (const Vec3& way : {Vec3{0, 0, side + 2 * radius - place.z},
                            Vec3{wall + radius + 0.5 - place.x, 0, 0}, Vec3{0, 0, -side}})
      for (int k = 0; k < 10; ++k)
        step(place + 0.1 * way, pulled);
    for (int k = 0; k < 20 && on_wall == 0; ++k)
      step(place - Vec3{0.4, 0, 0}, pulled);
    EXPECT_TRUE(place.z > 0 && place.z < side); // where nothing but a wall is
    EXPECT_GT(s.instrument(0).force.x, 0) << scene::method_name(method); // it is pushed back
    if (method == scene::Method::ffe) { // what moves may give way until it is at the wall's rim
      EXPECT_GT(on_wall, 0);
    }
  }
}

TEST(SolidTearScenes, BadLimitsAreRefused) {
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", pulled_bar(false, 2), scene::Method::ffe);
  const auto refusal = [&](const scene::Change& change) -> std::string {
    try {
      s.apply(change);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(scene::SetTear{0, 0, {true, {1, 2, 3}, 0}}),
            "object bar: 3 limits to tear at, expected one or those of its 2 materials");
  s.apply(scene::SetTwoStep{
      0, {.threshold = 1e4}, {}, std::make_shared<const model::Model>(pulled_bar(false, 2))});
  EXPECT_EQ(refusal(scene::SetTear{0, 0, {true, {1}, 0}}),
            "object bar has a second stage, so that its stress is that of no one material, "
            "expected no two-step to tear by stress");
  EXPECT_EQ(refusal(scene::SetTear{0, 0, {false, {1}, 0}}), "");
}

} // namespace
} // namespace gewebe::test
