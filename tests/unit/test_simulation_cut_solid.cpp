// Scenes in which solids are cut: shapes are those of what is left, motion is carried on, what acts
// on nodes follows them.

#include "base/error.h"
#include "cut_bars.h"
#include "fem/solid_model.h"
#include "larger.h"
#include "mesh/check.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::bar, test::count, test::error_of_shape, test::expect_sound, test::nodes_where,
    test::notch, test::off, test::one_thread, test::shape;

class SolidCuts : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Orders, SolidCuts, testing::Bool());

TEST_P(SolidCuts, AnElastostaticShapeIsThatOfTheCutModel) {
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", bar(GetParam()), scene::Method::ffe);
  const double mass = model::total_mass(s.model(0));
  contact::Load load;
  load.gravity = {0, 0, -9810};
  s.apply(scene::SetGravity{load.gravity});
  s.step(0.1);
  const std::vector<double> whole = shape(s, 0);
  double lower = 0;
  for (const double x : {5.3, 12.6, 8.9}) {
    s.apply(notch(s.model(0), x));
    ASSERT_EQ(count(s, scene::Cutting::Kind::cut), 1U);
    EXPECT_GT(s.news().cuttings[0].doubled, 3U);
    s.take_news();
    s.step(0.1);
    expect_sound(s.model(0), 2000, mass);
    EXPECT_LT(error_of_shape(s, load), 1e-10);
    const std::vector<double> now = shape(s, 0);
    double lowest = 0, before = 0;
    for (std::size_t i = 2; i < now.size(); i += 3)
      lowest = test::smaller(lowest, now[i]);
    for (std::size_t i = 2; i < whole.size(); i += 3)
      before = test::smaller(before, whole[i]);
    EXPECT_LT(lowest, 1.03 * before); // it hangs lower each time
    EXPECT_LT(lowest, lower);
    lower = lowest;
  }
  EXPECT_EQ(s.object_count(), 1U);
}

TEST_P(SolidCuts, APieceComesOffAndFalls) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", bar(GetParam()), method);
    const double mass = model::total_mass(s.model(0));
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.step(0.02);
    const double hung = shape(s, 0)[3 * nodes_where(s.model(0),
                                                    [](const Vec3& p) {
                                                      return p == Vec3{20, 10, 10};
                                                    })[0] +
                                    2];
    s.schedule(0.03, off(9.7));
    s.step(0.02);
    ASSERT_EQ(s.object_count(), 2U);
    EXPECT_EQ(s.object(1).name, "bar.1");
    EXPECT_EQ(s.object(1).method, scene::Method::ela);
    EXPECT_EQ(count(s, scene::Cutting::Kind::part), 1U);
    EXPECT_NEAR(model::total_mass(s.model(0)) + model::total_mass(s.model(1)), mass, 1e-12 * mass);
    expect_sound(s.model(1), signed_volume(model::surface_mesh(s.model(1))),
                 model::total_mass(s.model(1)));
    EXPECT_NEAR(signed_volume(model::surface_mesh(s.model(0))) +
                    signed_volume(model::surface_mesh(s.model(1))),
                2000, 1e-9);
    const auto height = [&] {
      const std::vector<double> u = shape(s, 1);
      double sum = 0, all = 0;
      for (std::size_t i = 0; i < u.size() / 3; ++i) {
        sum += s.model(1).nodes[i].mass * u[3 * i + 2];
        all += s.model(1).nodes[i].mass;
      }
      return sum / all;
    };
    const double start = height();
    EXPECT_LT(start, 0.2 * hung); // it has its shape still
    s.step(0.1);
    const double fall = height() - start;
    EXPECT_LT(fall, -0.95 * 9810 * 0.1 * 0.1 / 2) << scene::method_name(method);
    EXPECT_GT(fall, -1.9 * 9810 * 0.11 * 0.11 / 2) << scene::method_name(method);
  }
}

TEST_P(SolidCuts, APartGoesOnWithItsMomentum) {
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", bar(GetParam(), false), scene::Method::ela);
  s.apply(scene::SetGravity{{100, 0, 0}});
  s.step(0.5);
  s.apply(scene::SetGravity{{}});
  s.apply(off(9.7));
  ASSERT_EQ(s.object_count(), 2U);
  const auto middle = [&](std::size_t object) {
    Vec3 sum;
    double mass = 0;
    const std::vector<double> u = shape(s, object);
    for (std::size_t i = 0; i < u.size() / 3; ++i) {
      const double m = s.model(object).nodes[i].mass;
      sum += m * Vec3{u[3 * i], u[3 * i + 1], u[3 * i + 2]};
      mass += m;
    }
    return sum / mass;
  };
  s.step(0);
  const Vec3 first = middle(0), part = middle(1);
  s.step(0.2);
  EXPECT_NEAR((middle(0) - first).x, 10, 1e-6); // 50 mm/s each
  EXPECT_NEAR((middle(1) - part).x, 10, 1e-6);
}

TEST_P(SolidCuts, ANodeThatIsPutBetweenOthersStandsWhereTheyDo) {
  // A linear field, which elements of both kinds have exactly, held or let go.
  const auto field = [](const Vec3& p) {
    return Vec3{0.01 * p.y - 0.02 * p.z, 0.03 * p.x, -0.01 * p.x + 0.02 * p.y};
  };
  for (const bool held : {true, false}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", bar(GetParam(), false), scene::Method::ela);
    const std::vector<std::uint32_t> all =
        nodes_where(s.model(0), [](const Vec3&) { return true; });
    for (const std::uint32_t i : all)
      s.apply(scene::SetDisplacement{0, {i}, field(s.model(0).nodes[i].position)});
    s.step(0.01);
    if (!held)
      s.apply(scene::Release{0, all});
    s.apply(off(9.7));
    s.step(0);
    for (const std::size_t object : {0U, 1U}) {
      const model::Model& model = s.model(object);
      const std::vector<double> u = shape(s, object);
      for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        const Vec3 want = field(model.nodes[i].position);
        for (int a = 0; a < 3; ++a)
          EXPECT_NEAR(u[3 * i + static_cast<std::size_t>(a)], want[a], 1e-12) << held;
      }
      EXPECT_EQ(s.contact_forces(object).size(), held ? model.nodes.size() : 0);
    }
  }
}

TEST_P(SolidCuts, LoadsGripsAndEventsFollow) {
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", bar(GetParam()), scene::Method::ela);
  const auto end = nodes_where(s.model(0), [](const Vec3& p) { return p.x == 20; });
  const auto top = nodes_where(s.model(0), [](const Vec3& p) { return p.z == 10; });
  s.apply(scene::SetInstrument{0, {1, {}, 0}, {{20, 5, 20}, {}}, "tongs"});
  s.apply(scene::Grasp{0, end, 0});
  s.apply(scene::SetPressure{0, top, {50, 0}});
  s.apply(scene::SetForce{0, {top[0]}, {0, 0, 5}});
  s.schedule(0.05, scene::Release{0, end});
  s.step(0.01);
  s.apply(
      scene::CutObject{0, scene::PlaneToCut{{{0, 0, 5.2}, {0.05, 0.02, 1}}, {}}}); // along the bar
  s.step(0.01);
  ASSERT_EQ(s.object_count(), 1U);
  const auto ends = nodes_where(s.model(0), [](const Vec3& p) { return p.x == 20; });
  EXPECT_GT(ends.size(), end.size());
  EXPECT_EQ(s.instrument(0).nodes, ends.size());
  s.apply(scene::MoveInstrument{0, {20, 5, 21}, {}, 0});
  s.step(0.01);
  for (const std::uint32_t node : ends)
    EXPECT_NEAR(shape(s, 0)[3 * node + 2], 1, 1e-12);
  s.step(0.05);
  EXPECT_EQ(s.contact_forces(0).size(), 0U);
  EXPECT_EQ(s.instrument(0).nodes, 0U);
}

/// A cut may double tied nodes but not move them, or ties would no longer be at rest.
TEST_P(SolidCuts, CutsDoNotMoveTiedNodes) {
  const model::Model first = bar(GetParam());
  const auto near = nodes_where(first, [](const Vec3& p) { return std::abs(p.x - 7.8) < 1.5; });
  const scene::CutObject cut{0, scene::PlaneToCut{{{7.8, 0, 0}, {1, 0.02, 0.01}}, {}}};
  const auto moved = [&](const scene::Simulation& s) {
    const std::span<const std::uint32_t> places = s.object(0).places;
    return std::ranges::count_if(near, [&](std::uint32_t node) {
      const std::uint32_t now = places.empty() ? node : places[node];
      return now != cutting::CutModel::gone &&
             !(s.model(0).nodes[now].position == first.nodes[node].position);
    });
  };
  scene::Simulation untied(one_thread(), {});
  untied.add_object("bar", bar(GetParam()), scene::Method::ela);
  untied.apply(cut);
  ASSERT_GT(moved(untied), 0); // else nothing is tested here
  for (const bool other : {false, true}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("a", bar(GetParam()), scene::Method::ela);
    s.add_object("b", bar(GetParam()), scene::Method::ela);
    if (other)
      s.apply(scene::Attach{1, near, 0, near, 100});
    else
      s.apply(scene::Attach{0, near, 1, near, 100});
    s.apply(cut);
    EXPECT_EQ(moved(s), 0) << other;
    EXPECT_EQ(s.object_count(), 3U);
  }
}

/// Nor displaced nodes, nor grasped ones.
TEST_P(SolidCuts, CutsDoNotMoveHeldNodes) {
  const model::Model first = bar(GetParam());
  const auto near =
      nodes_where(first, [](const Vec3& p) { return p.x > 7.8 - 1.5 && p.x < 7.8 + 1.5; });
  const scene::CutObject cut{0, scene::PlaneToCut{{{7.8, 0, 0}, {1, 0.02, 0.01}}, {}}};
  for (const int held : {0, 1, 2}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", first, scene::Method::ela);
    if (held == 1)
      s.apply(scene::SetDisplacement{0, near, {}});
    if (held == 2) {
      contact::InstrumentShape tip;
      tip.radius = 0.1;
      s.apply(scene::SetInstrument{0, tip, {{7.8, 50, 0}, {}}, "tongs"});
      s.apply(scene::Grasp{0, near, 0});
    }
    s.apply(cut);
    const std::span<const std::uint32_t> places = s.object(0).places;
    const auto moved = std::ranges::count_if(near, [&](std::uint32_t node) {
      const std::uint32_t now = places.empty() ? node : places[node];
      return now != cutting::CutModel::gone &&
             !(s.model(0).nodes[now].position == first.nodes[node].position);
    });
    EXPECT_EQ(moved > 0, held == 0) << held << ": " << moved;
  }
}

TEST_P(SolidCuts, ABladeCutsInOneStepAndInMany) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela})
    for (const int steps : {1, 7, 40}) {
      SCOPED_TRACE(std::string(scene::method_name(method)) + " " + std::to_string(steps));
      scene::Simulation s(one_thread(), {});
      s.add_object("bar", bar(GetParam()), method);
      const double mass = model::total_mass(s.model(0));
      contact::InstrumentShape edge;
      edge.radius = 0;
      edge.blade = true;
      edge.axis = {0, 0, 8};
      s.apply(scene::SetInstrument{0, edge, {{9.6, -2, 4}, {}}, "knife"});
      s.step(0);
      s.apply(scene::MoveInstrument{0, {9.9, 12, 4}, {}, 0.1});
      for (int k = 0; k < steps; ++k)
        s.step(0.1 / steps);
      EXPECT_EQ(s.object_count(), 1U);
      expect_sound(s.model(0), 2000, mass);
      // From side to side, down to where it reaches.
      double area = 0, lowest = 10;
      const model::Model& model = s.model(0);
      for (const Triangle& t : model.triangles) {
        const Vec3 &a = model.nodes[t[0]].position, &b = model.nodes[t[1]].position,
                   &c = model.nodes[t[2]].position;
        const auto inside = [](const Vec3& p) { return p.x > 7 && p.x < 12; };
        const Vec3 n = cross(b - a, c - a);
        if (!inside(a) || !inside(b) || !inside(c) || std::abs(n.x) < 0.5 * norm(n))
          continue;
        area += norm(n) / 4; // of either side
        for (const double z : {a.z, b.z, c.z})
          lowest = test::smaller(lowest, z);
      }
      EXPECT_GT(area, 0.5 * 10 * 6);
      EXPECT_LT(area, 1.3 * 10 * 6);
      EXPECT_NEAR(lowest, 4, 2.6);
    }
}

TEST(SolidCutScenes, ABladeCutsWhereTheSolidIs) {
  // The bar flies at 400 mm/s, the blade beside it: in the bar it moves straight down at x = 11,
  // though in space each step's area leans by 2 mm.
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", bar(false, false), scene::Method::ela);
  s.apply(scene::SetGravity{{800, 0, 0}});
  s.step(0.5);
  s.apply(scene::SetGravity{{}});
  s.step(0);
  const double away = shape(s, 0)[0];
  EXPECT_GT(away, 90);
  contact::InstrumentShape edge;
  edge.radius = 0;
  edge.blade = true;
  edge.axis = {0, 30, 0};
  const double speed = 400, step = 0.005;
  const auto place = [&](int k) { return Vec3{away + 11 + speed * step * k, -10, 12 - 1.4 * k}; };
  s.apply(scene::SetInstrument{0, edge, {place(0), {}}, "knife"});
  for (int k = 1; k <= 10; ++k) {
    s.apply(scene::MoveInstrument{0, place(k), {}, 0});
    s.step(step);
  }
  ASSERT_EQ(s.object_count(), 2U);
  for (const std::size_t object : {0U, 1U}) {
    Box3 box;
    for (const model::Node& node : s.model(object).nodes)
      box.add(node.position);
    EXPECT_NEAR(box.min.x == 0 ? box.max.x : box.min.x, 11, 0.7);
  }
}

TEST_P(SolidCuts, RestoreMakesItWholeAgain) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {}), never(one_thread(), {});
    for (scene::Simulation* one : {&s, &never}) {
      one->add_object("bar", bar(GetParam()), method);
      one->apply(scene::SetForce{0, {1}, {0, 0, 500}});
      one->step(0.05);
    }
    s.apply(notch(s.model(0), 8.1));
    s.apply(scene::Restore{0});
    EXPECT_EQ(s.model(0), never.model(0));
    s.step(0);
    const std::vector<double> a = shape(s, 0), b = shape(never, 0);
    double largest = 0;
    for (const double value : b)
      largest = test::larger(largest, std::abs(value));
    // A node that was moved comes back through another element, so elements' bends are lost.
    for (std::size_t i = 0; i < a.size(); ++i)
      ASSERT_NEAR(a[i], b[i], (method == scene::Method::ffe ? 1e-10 : 0.02) * largest) << i;
    EXPECT_THROW(s.apply(scene::Restore{0}), Error);
    s.apply(off(9.7)); // and what has come off stays
    s.step(0.01);
    s.apply(scene::Restore{0});
    EXPECT_EQ(s.model(0), never.model(0));
    EXPECT_EQ(s.object_count(), 2U);
    s.step(0.01);
    for (const double u : shape(s, 0))
      EXPECT_TRUE(std::isfinite(u));
  }
}

TEST(SolidCutScenes, BadCutsAreRefusedAndChangeNothing) {
  scene::SimulationOptions how;
  how.guard = true;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), how);
    s.add_object("bar", bar(false), method);
    s.apply(scene::SetForce{0, {5}, {0, 1, 5}});
    s.step(0.01);
    const model::Model before = s.model(0);
    const std::vector<double> u = shape(s, 0);
    const std::pair<scene::CutObject, const char*> bad[]{
        {{0, scene::PlaneToCut{{{0, 0, 500}, {0, 0, 1}}, {}}}, "parts no tetrahedra, expected"},
        {{0, scene::PlaneToCut{{{0, 0, 5}, {0, 0, 1}}, std::vector<std::uint32_t>{3}}},
         "parts no tetrahedra of these nodes, expected"},
        {{0, scene::PlaneToCut{{{1e200, 0, 5}, {1, 0, 1}}, {}}}, "expected"},
        {{0, scene::SpringsToCut{{0}, {1}}}, "no springs, expected a plane"},
    };
    for (const auto& [cut, words] : bad) {
      try {
        s.apply(cut);
        ADD_FAILURE() << "no error";
      } catch (const Error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("object bar: ")) << error.what();
      }
      EXPECT_EQ(s.model(0), before);
    }
    EXPECT_TRUE(s.news().cuttings.empty());
    EXPECT_EQ(shape(s, 0), u);
  }
}

TEST(SolidCutScenes, AStepThatFailsTakesACutBack) {
  scene::SimulationOptions how;
  how.guard = true;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), how), calm(one_thread(), how);
    for (scene::Simulation* one : {&s, &calm}) {
      one->add_object("bar", bar(false), method);
      one->apply(scene::SetGravity{{0, 0, -1000}});
      one->step(0.01);
    }
    s.schedule(0.015, off(9.7));
    s.schedule(0.018,
               scene::CutObject{0, scene::PlaneToCut{{{0, 0, 500}, {0, 0, 1}}, {}}}); // misses
    EXPECT_THROW(s.step(0.01), Error);
    EXPECT_EQ(s.object_count(), 1U);
    EXPECT_EQ(s.model(0), calm.model(0));
    EXPECT_EQ(shape(s, 0), shape(calm, 0));
    s.step_to(0.014);
    calm.step_to(0.014);
    EXPECT_EQ(shape(s, 0), shape(calm, 0));
  }
}

/// Of held nodes, against those of an object that comes as it is now.
double error_of_forces(const scene::Simulation& s, const contact::Load& load) {
  const model::Model model = s.model(0);
  statics::Elastostatic fresh(model, {}, one_thread());
  fresh.update(load);
  const std::vector<contact::NodeVector>& want = fresh.contact_forces();
  const std::span<const contact::NodeVector> is = s.contact_forces(0);
  EXPECT_EQ(is.size(), want.size());
  double largest = 0, worst = 0;
  for (std::size_t k = 0; k < std::min(want.size(), is.size()); ++k) {
    EXPECT_EQ(is[k].node, want[k].node);
    largest = test::larger(largest, norm(want[k].value));
    worst = test::larger(worst, norm(want[k].value - is[k].value));
  }
  EXPECT_GT(largest, 0);
  return worst / largest;
}

TEST_P(SolidCuts, ForcesOnHeldNodesAreThoseOfTheCutModel) {
  // Weight and forces are carried along from cut to cut, and change between them.
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", bar(GetParam()), scene::Method::ffe);
  contact::Load load;
  const auto step = [&](const char* what) {
    load.displacement.clear();
    load.force.clear();
    const auto end = nodes_where(s.model(0), [](const Vec3& p) { return p.x == 20 && p.z == 10; });
    for (const std::uint32_t i : end)
      load.displacement[i] = {0.1, 0, 0.2};
    const auto pulled = nodes_where(s.model(0), [](const Vec3& p) { return p == Vec3{10, 0, 10}; });
    if (load.gravity.x != 0)
      load.force[pulled.at(0)] = {0, -3e5, 0};
    s.apply(scene::SetGravity{load.gravity});
    s.apply(scene::SetDisplacement{0, end, {0.1, 0, 0.2}});
    for (const auto& [node, force] : load.force)
      s.apply(scene::SetForce{0, {node}, force});
    s.step(0.1);
    EXPECT_LT(error_of_forces(s, load), 1e-10) << what;
  };
  load.gravity = {0, 0, -9810};
  step("whole");
  for (const double x : {5.3, 12.6, 8.9}) {
    s.apply(notch(s.model(0), x));
    ASSERT_EQ(count(s, scene::Cutting::Kind::cut), 1U);
    s.take_news();
    step("cut");
    load.gravity = {1000 * x, 0, -9810};
    step("another weight");
    load.gravity.x = 0;
    s.apply(scene::Release{0, nodes_where(s.model(0), [](const Vec3&) { return true; })});
    step("as it was");
  }
  ASSERT_EQ(s.object_count(), 1U);
}

TEST(SolidCutScenes, TheSameForAnyNumberOfThreads) {
  std::vector<double> first;
  for (const int threads : {1, 2}) {
    Context context;
    context.threads = threads;
    scene::Simulation s(context, {});
    s.add_object("bar", bar(true), scene::Method::ffe);
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.step(0.01);
    s.apply(notch(s.model(0), 5.3));
    s.step(0.01);
    s.apply(off(9.7));
    s.step(0.05);
    std::vector<double> all = shape(s, 0);
    const std::vector<double> part = shape(s, 1);
    all.insert(all.end(), part.begin(), part.end());
    if (threads == 1)
      first = all;
    else
      EXPECT_EQ(all, first);
  }
}

TEST(SolidCutScenes, AlongFacesNoTetrahedronIsCutThrough) {
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", bar(false), scene::Method::ela);
  const model::Model before = s.model(0);
  scene::PlaneToCut plane{{{9.1, 5, 5}, {1, 0.3, 0.2}}, {}};
  plane.along_faces = true;
  s.apply(scene::CutObject{0, plane});
  ASSERT_EQ(s.object_count(), 2U);
  EXPECT_EQ(s.model(0).tetrahedra.size() + s.model(1).tetrahedra.size(), before.tetrahedra.size());
  for (const std::size_t object : {0U, 1U})
    for (const model::Node& node : s.model(object).nodes)
      EXPECT_TRUE(std::ranges::any_of(
          before.nodes, [&](const model::Node& was) { return was.position == node.position; }));
}

TEST(SolidCutScenes, LargeRotationsAndTwoStepsFollow) {
  for (const bool warp : {true, false}) {
    scene::Simulation s(one_thread(), {}), after(one_thread(), {});
    s.add_object("bar", bar(false), scene::Method::ffe);
    model::Model stiff = bar(false);
    stiff.materials[0].young *= 4;
    stiff.materials[1].young *= 3;
    if (warp)
      s.apply(scene::SetWarp{0});
    else
      s.apply(scene::SetTwoStep{
          0, {.threshold = 1e4}, {}, std::make_shared<const model::Model>(stiff)});
    s.apply(scene::SetGravity{{0, 0, -20000}});
    s.step(0.1);
    s.apply(notch(s.model(0), 7.7));
    s.step(0.1);
    const std::vector<double> is = shape(s, 0);
    // The same of the cut model, as it comes.
    after.add_object("bar", s.model(0), scene::Method::ffe);
    if (warp) {
      after.apply(scene::SetWarp{0});
    } else {
      model::Model both = s.model(0);
      both.materials = stiff.materials;
      after.apply(
          scene::SetTwoStep{0, {.threshold = 1e4}, {}, std::make_shared<const model::Model>(both)});
    }
    after.apply(scene::SetGravity{{0, 0, -20000}});
    after.step(0.1);
    const std::vector<double> want = shape(after, 0);
    ASSERT_EQ(is.size(), want.size());
    double largest = 0, worst = 0;
    for (std::size_t i = 0; i < want.size(); ++i) {
      largest = test::larger(largest, std::abs(want[i]));
      worst = test::larger(worst, std::abs(want[i] - is[i]));
    }
    EXPECT_LT(worst, (warp ? 1e-5 : 1e-10) * largest);
    s.apply(off(9.7)); // with the velocity of such an object
    s.step(0.01);
    EXPECT_EQ(s.object_count(), 2U);
  }
}

} // namespace
} // namespace gewebe::test
