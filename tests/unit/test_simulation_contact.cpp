#include "base/error.h"
#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "compliance/compliance_source.h"
#include "contact/convex_core.h"
#include "contact/parameters.h"
#include "contact_checks.h"
#include "convex_meshes.h"
#include "fem/model_stiffness.h"
#include "larger.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "stiffness_models.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <string>

namespace gewebe::test {
namespace {

using test::free_nodes, test::organ;

Vec3 moved(const scene::Simulation& s, std::size_t object, std::size_t node) {
  const std::span<const double> u = s.displacement(object);
  return {u[3 * node], u[3 * node + 1], u[3 * node + 2]};
}

Vec3 place(const scene::Simulation& s, std::size_t object, std::size_t node) {
  return s.model(object).nodes[node].position + moved(s, object, node);
}

scene::SetInstrument sphere(double radius, const Vec3& at, double friction = 0) {
  return {0, {radius, {}, friction}, {at, {}}};
}

/// Of the surface in the instrument, over its radius; what no force moves counts for nothing.
double depth(const scene::Simulation& s, std::size_t object, const contact::InstrumentShape& shape,
             const contact::Pose& pose) {
  return test::surface_depth(s.model(object), s.displacement(object), shape, pose);
}

/// Part of its radius by which a surface that touches an instrument may be outside: d_hat without
/// the 0.6 that depth_allowed is of.
constexpr double gap_allowed = 4e-4;

/// Of all forces on nodes, as they are on points of the surface: norms.
double sum_of_sizes(const std::vector<contact::NodeVector>& forces) {
  double sum = 0;
  for (const contact::NodeVector& f : forces)
    sum += norm(f.value);
  return sum;
}

/// Both methods, the elastodynamic one by both of its integrations.
const std::vector<std::pair<scene::Method, scene::Integration>> ways{
    {scene::Method::ffe, scene::Integration::semi_implicit},
    {scene::Method::ela, scene::Integration::semi_implicit},
    {scene::Method::ela, scene::Integration::implicit}};

/// The top of the organ of the tests, which is a ball of radius 20 about this.
const Vec3 middle{100, -50, 30};

/// An organ pressed from above by a sphere, in small steps.
std::unique_ptr<scene::Simulation>
pressed(scene::Method method, double friction, double by, double radius = 8, int rounds = 4,
        int threads = 1, scene::Integration integration = scene::Integration::semi_implicit) {
  Context context;
  context.threads = threads;
  auto s = std::make_unique<scene::Simulation>(context, scene::SimulationOptions{});
  s->add_object("o", organ(rounds), method, {}, integration);
  const Vec3 start = middle + Vec3{0.3, 0.2, 20 + radius};
  s->apply(sphere(radius, start, friction));
  s->apply(scene::MoveInstrument{0, start - Vec3{0, 0, by}, {}, 0.2});
  s->step(0.3);
  return s;
}

TEST(SimulationContact, ASphereOnASheetOfKnownCompliance) {
  // Nodes that hang on three springs each, with no spring between them: u = f / k. Each is the top
  // of a tent whose other corners are held, so that the sphere touches nodes alone.
  model::Model m;
  m.name = "sheet";
  m.materials.resize(1);
  m.materials[0].name = "m";
  const double k = 50;
  constexpr std::uint32_t nodes = 49;
  std::vector<model::Node> held;
  const auto hold = [&](model::Node n, const Vec3& at) {
    n.position = at;
    n.fixed = model::fixed_all;
    held.push_back(n);
    return static_cast<std::uint32_t>(nodes + held.size() - 1);
  };
  for (int y = -3; y <= 3; ++y)
    for (int x = -3; x <= 3; ++x) {
      const auto node = static_cast<std::uint32_t>(m.nodes.size());
      model::Node n;
      n.position = {1.0 * x, 1.0 * y, 0};
      n.mass = 0.01;
      n.drag = 0.5;
      m.nodes.push_back(n);
      for (int a = 0; a < 3; ++a) {
        Vec3 end = n.position;
        end[a] += 1000; // far: the direction does not turn
        m.springs.push_back({node, hold(n, end), model::SpringKind::edge, k, 0, 1000});
      }
      std::array<std::uint32_t, 3> foot{};
      for (std::size_t c = 0; c < 3; ++c)
        foot[c] = hold(n, n.position +
                              Vec3{c == 0 ? 0.3 : -0.15, c == 0 ? 0 : (c == 1 ? 0.26 : -0.26), -1});
      for (std::size_t c = 0; c < 3; ++c)
        m.triangles.push_back({node, foot[c], foot[(c + 1) % 3]});
    }
  m.nodes.insert(m.nodes.end(), held.begin(), held.end());
  model::check_model(m);
  const double radius = 5, down = 0.4;
  // Nodes are pushed by up to 0.6 d_hat less or 0.4 d_hat more than out of the sphere; d_hat is of
  // the slanted edges.
  const double d_hat = 1e-3 * std::hypot(0.3, 1);
  for (const auto& [method, integration] : ways) {
    scene::Simulation s({}, {});
    s.add_object("sheet", m, method, {}, integration);
    s.apply(sphere(radius, {0, 0, radius + 1}));
    s.apply(scene::MoveInstrument{0, {0, 0, radius - down}, {}, 0.5});
    s.step(method == scene::Method::ffe ? 0.5 : 20);
    s.step(0.1); // forces are means over a step
    // Each node alone: out of the sphere by the shortest way, as its compliance is the same all
    // around.
    Vec3 sum;
    std::size_t touched = 0;
    const Vec3 c{0, 0, radius - down};
    // Of k down: the tolerance of forces; what moves still comes to rest, and far springs turn.
    const double exact =
        (method == scene::Method::ffe ? contact::Parameters{}.tolerances.force : 1e-3) * k * down;
    for (std::uint32_t i = 0; i < nodes; ++i) {
      const Vec3 rest = m.nodes[i].position;
      const double inside = radius - norm(rest - c);
      Vec3 force;
      if (inside > 0)
        force = k * inside / norm(rest - c) * (rest - c);
      const std::vector<contact::NodeVector>& forces = s.contact_forces(0);
      const auto f = std::find_if(forces.begin(), forces.end(),
                                  [&](const contact::NodeVector& v) { return v.node == i; });
      EXPECT_EQ(f != forces.end(), inside > 0) << i;
      EXPECT_LT(norm(k * moved(s, 0, i) - force), inside > 0 ? exact + 0.6 * k * d_hat : exact)
          << i;
      if (f == forces.end())
        continue;
      ++touched;
      sum += f->value;
      EXPECT_LT(norm(f->value - k * moved(s, 0, i)), exact) << i;
    }
    EXPECT_EQ(touched, 9U);
    const scene::InstrumentReport tool = s.instrument(0);
    EXPECT_EQ(tool.nodes, touched);
    EXPECT_LT(norm(tool.force + sum), 1e-12 * norm(sum));
    EXPECT_LT(norm(tool.torque), 1e-9 * norm(sum)); // all forces pass through the centre
    EXPECT_GT(tool.force.z, 0);
  }
}

TEST(SimulationContact, FrictionlessForcesAreNormalAndBalance) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    const auto s = pressed(method, 0, 3);
    const scene::InstrumentReport tool = s->instrument(0);
    EXPECT_LT(depth(*s, 0, {8, {}, 0}, tool.pose), test::depth_allowed);
    EXPECT_GT(depth(*s, 0, {8, {}, 0}, tool.pose), -gap_allowed); // touches
    EXPECT_GT(depth(*s, 0, {8.1, {}, 0}, tool.pose), 1e-3); // a larger one would not be kept out
    Vec3 sum;
    const std::vector<contact::NodeVector>& forces = s->contact_forces(0);
    ASSERT_GT(forces.size(), 3U);
    double largest = 0;
    for (const contact::NodeVector& f : forces) {
      const Vec3 n = (place(*s, 0, f.node) - tool.pose.place) / 8;
      EXPECT_GT(dot(f.value, n), 0);
      sum += f.value;
      largest = test::larger(largest, norm(f.value));
    }
    // All forces pass through the centre.
    EXPECT_LT(norm(tool.torque), (method == scene::Method::ffe ? 1e-9 : 3e-2) * 8 * norm(sum));
    EXPECT_LT(norm(tool.force + sum), 1e-12 * norm(sum));
    if (method == scene::Method::ela)
      continue;
    // Reactions of the model's supports balance what the instrument does.
    std::vector<double> f(3 * s->model(0).nodes.size());
    fem::multiply_stiffness(s->model(0), s->displacement(0), f);
    Vec3 supports;
    double wrong = 0;
    for (std::uint32_t i = 0; i < s->model(0).nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        if (contact::is_fixed(s->model(0), i, a)) {
          supports[a] += f[3 * std::size_t{i} + static_cast<std::size_t>(a)];
        } else {
          double outer = 0;
          for (const contact::NodeVector& c : forces)
            if (c.node == i)
              outer = c.value[a];
          wrong = test::larger(
              wrong, std::abs(f[3 * std::size_t{i} + static_cast<std::size_t>(a)] - outer));
        }
    // K u = f, but for what Newton's method leaves: of the largest force on a node.
    const double met = contact::Parameters{}.tolerances.force * largest;
    EXPECT_LT(wrong, met);
    EXPECT_LT(norm(supports + sum), met * std::sqrt(static_cast<double>(forces.size())));
  }
}

TEST(SimulationContact, BothMethodsAgreeAtRest) {
  const auto still = pressed(scene::Method::ffe, 0, 0.1, 8, 3);
  const auto moving = pressed(scene::Method::ela, 0, 0.1, 8, 3);
  moving->step(10);
  moving->step(0.1);
  const Vec3 a = still->instrument(0).force, b = moving->instrument(0).force;
  EXPECT_LT(norm(a - b), 0.15 * norm(a)); // as the linear and the nonlinear organ do
  EXPECT_LT(depth(*moving, 0, {8, {}, 0}, moving->instrument(0).pose), test::depth_allowed);
}

TEST(SimulationContact, ImplicitStepsRestWhereExplicitOnesDo) {
  for (const double friction : {0.0, 0.3}) {
    Vec3 force[2];
    std::vector<double> rest[2];
    for (const int k : {0, 1}) {
      const auto s =
          pressed(scene::Method::ela, friction, 2, 8, 3, 1,
                  k == 0 ? scene::Integration::semi_implicit : scene::Integration::implicit);
      EXPECT_LT(depth(*s, 0, {8, {}, friction}, s->instrument(0).pose), test::depth_allowed)
          << k; // on its way
      s->step(0.5);
      s->step(0.1);
      force[k] = s->instrument(0).force;
      rest[k].assign(s->displacement(0).begin(), s->displacement(0).end());
      EXPECT_LT(depth(*s, 0, {8, {}, friction}, s->instrument(0).pose), test::depth_allowed);
      double push = 0;
      for (const contact::NodeVector& f : s->contact_forces(0)) {
        const Vec3 n = (place(*s, 0, f.node) - s->instrument(0).pose.place) / 8;
        push += dot(f.value, n);
      }
      EXPECT_GT(push, 0);
      EXPECT_LE(norm(s->instrument(0).torque),
                (friction + 1e-6) * 8 * sum_of_sizes(s->contact_forces(0)))
          << k;
    }
    // With friction where it stopped depends on its way, by which it differs a little.
    const double exact = friction > 0 ? 1e-2 : 1e-6;
    EXPECT_LT(norm(force[1] - force[0]), exact * norm(force[0])) << friction;
    double size = 0, error = 0;
    for (std::size_t i = 0; i < rest[0].size(); ++i) {
      size = test::larger(size, std::abs(rest[0][i]));
      error = test::larger(error, std::abs(rest[1][i] - rest[0][i]));
    }
    EXPECT_LT(error, exact * size) << friction;
  }
}

TEST(SimulationContact, ShortImplicitStepsGiveTheForcesOfExplicitOnes) {
  for (const double friction : {0.0, 0.3}) {
    const auto force = [&](scene::Integration integration, double dt) {
      scene::Simulation s(test::one_thread(), {});
      s.add_object("o", organ(2), scene::Method::ela, {}, integration);
      const Vec3 start = middle + Vec3{0.3, 0.2, 28};
      s.apply(scene::SetTimestep{dt});
      s.apply(sphere(8, start, friction));
      s.apply(scene::MoveInstrument{0, start + Vec3{1, 0, -3}, {}, 0.1});
      s.step(0.04);
      s.step(0.02); // over which forces are means
      return s.instrument(0).force;
    };
    const Vec3 exact = force(scene::Integration::semi_implicit, 2e-5);
    const double coarse = norm(force(scene::Integration::implicit, 1e-3) - exact) / norm(exact),
                 fine = norm(force(scene::Integration::implicit, 2.5e-4) - exact) / norm(exact);
    EXPECT_LT(fine, 0.02) << friction;
    EXPECT_LT(fine, 0.5 * coarse) << friction; // of first order
  }
}

TEST(SimulationContact, AnImplicitStepTakenBackLeavesNoTrace) {
  std::vector<double> results[2];
  for (const bool fails : {false, true}) {
    scene::SimulationOptions how;
    how.guard = true;
    scene::Simulation s(test::one_thread(), how);
    s.add_object("o", organ(2), scene::Method::ela, {}, scene::Integration::implicit);
    s.apply(sphere(8, middle + Vec3{0.3, 0.2, 26}, 0.3));
    s.step(0.01);
    if (fails) {
      s.schedule(0.015, scene::CutObject{0, scene::PlaneToCut{{{0, 0, 500}, {0, 0, 1}}, {}}});
      EXPECT_THROW(s.step(0.01), Error);
    }
    for (int k = 0; k < 2; ++k)
      s.step(0.002);
    results[fails ? 1 : 0].assign(s.displacement(0).begin(), s.displacement(0).end());
    const Vec3 f = s.instrument(0).force;
    results[fails ? 1 : 0].insert(results[fails ? 1 : 0].end(), {f.x, f.y, f.z});
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(SimulationContact, FrictionHoldsUpToItsLimit) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela})
    for (const double friction : {0.2, 5.0}) {
      const auto s = pressed(method, friction, 2, 8, 3);
      const Vec3 from = s->instrument(0).pose.place;
      std::vector<Vec3> was;
      for (std::size_t i = 0; i < s->model(0).nodes.size(); ++i)
        was.push_back(moved(*s, 0, i));
      s->apply(scene::MoveInstrument{0, from + Vec3{1.5, 0, 0}, {}, 0.5});
      s->step(0.5);
      const scene::InstrumentReport tool = s->instrument(0);
      EXPECT_LT(depth(*s, 0, {8, {}, 0}, tool.pose), test::depth_allowed);
      Vec3 drag, went;
      double weight = 0;
      for (const contact::NodeVector& f : s->contact_forces(0)) {
        const Vec3 n = (place(*s, 0, f.node) - tool.pose.place) / 8;
        const double fn = dot(f.value, n);
        const Vec3 ft = f.value - fn * n;
        weight += f.value.z;
        went += f.value.z * (moved(*s, 0, f.node) - was[f.node]);
        drag += ft;
      }
      EXPECT_GT(drag.x, 0); // nodes are dragged along, against their slip
      EXPECT_LT(tool.force.x, 0);
      // The torque of friction, about the centre.
      if (method == scene::Method::ffe) {
        EXPECT_LE(norm(tool.torque), friction * 8 * sum_of_sizes(s->contact_forces(0)));
      }
      EXPECT_LT(weight, 0);
      const double gone = went.x / weight;
      if (friction < 1) {
        EXPECT_GT(norm(tool.torque), 0.5 * friction * 8 * norm(tool.force)); // it slips
        EXPECT_LT(gone, 0.2);
      } else if (method == scene::Method::ffe) {
        EXPECT_NEAR(gone, 1.5, 0.05); // sticks
      } else {
        // The net folds, and its pieces roll on the ball.
        EXPECT_GT(gone, 0.4);
        EXPECT_LT(gone, 1.7);
      }
    }
}

TEST(SimulationContact, NothingIsDoneFarAway) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s({}, {});
    s.add_object("o", organ(), method);
    s.apply(sphere(5, middle + Vec3{60, 0, 0}));
    s.step(0.01);
    for (int k = 0; k < 5; ++k) {
      s.apply(scene::MoveInstrument{0, middle + Vec3{60, 1.0 * k, 0}, {}, 0.01});
      s.step(0.01);
    }
    EXPECT_EQ(s.counts().integration, 0U);
    EXPECT_EQ(s.counts().elastostatic.updates, 0U);
    EXPECT_TRUE(s.contact_forces(0).empty());
    EXPECT_EQ(s.instrument(0).force, Vec3{});
    s.apply(scene::MoveInstrument{0, middle + Vec3{22, 0, 0}, {}, 0.01});
    s.step(0.02);
    EXPECT_FALSE(s.contact_forces(0).empty());
    s.apply(scene::Withdraw{0});
    s.step(30);
    EXPECT_TRUE(s.contact_forces(0).empty());
    EXPECT_FALSE(s.instrument(0).present);
    for (const double u : s.displacement(0))
      EXPECT_LT(std::abs(u), 1e-7);
  }
}

TEST(SimulationContact, AContactAtRestCostsNothing) {
  scene::Simulation s({}, {});
  s.add_object("moving", organ(), scene::Method::ela);
  s.add_object("still", organ(), scene::Method::ffe);
  s.apply(sphere(8, middle + Vec3{0.3, 0.2, 27}));
  s.step(50);
  s.step(1); // found at rest
  const std::uint64_t steps = s.counts().integration, updates = s.counts().elastostatic.updates;
  const Vec3 force = s.instrument(0).force;
  EXPECT_GT(force.z, 0);
  s.step(10);
  EXPECT_EQ(s.counts().integration, steps);
  EXPECT_EQ(s.counts().elastostatic.updates, updates);
  // It still holds: the mean over a step, of the same forces.
  EXPECT_LE(norm(s.instrument(0).force - force), 1e-15 * norm(force));
  s.apply(scene::MoveInstrument{0, middle + Vec3{0.3, 0.2, 26.9}, {}, 0.01});
  s.step(0.02);
  EXPECT_GT(s.counts().integration, steps);
  EXPECT_GT(s.instrument(0).force.z, force.z);
}

TEST(SimulationContact, TheForceIsTheMeanOverTheStepWhateverCameBefore) {
  const auto first_force = [](int steps_before, bool refused, bool event) {
    scene::SimulationOptions how;
    how.guard = true;
    scene::Simulation s(test::one_thread(), how);
    s.add_object("o", organ(), scene::Method::ela);
    const std::uint32_t node = free_nodes(s.model(0))[5];
    s.apply(scene::SetForce{0, {node}, {0, 0, 1e-9}}); // that it is awake
    for (int k = 0; k < steps_before; ++k)
      s.step(0.001);
    s.apply(sphere(8, middle + Vec3{0.3, 0.2, 26}));
    if (refused) {
      EXPECT_THROW(s.apply(scene::CutObject{0, scene::PlaneToCut{{{0, 0, 500}, {0, 0, 1}}, {}}}),
                   Error);
    }
    if (event)
      s.schedule(s.time() + 0.0004, scene::SetTear{0, 0});
    s.step(0.001);
    return s.instrument(0).force.z;
  };
  const double force = first_force(1, false, false);
  EXPECT_GT(force, 0);
  for (const int before : {0, 9, 99}) {
    EXPECT_NEAR(first_force(before, false, false), force, 1e-6 * force) << before;
    EXPECT_EQ(first_force(before, true, false), first_force(before, false, false));
  }
  // One of two steps feels it: another one of them is longer.
  EXPECT_NEAR(first_force(1, false, true), force, 0.21 * force);
}

TEST(SimulationContact, ACutWithinAStepLeavesTheForceItsMean) {
  double force[2]{};
  for (const bool cuts : {false, true}) {
    scene::Simulation s(test::one_thread(), {});
    s.add_object("o", organ(), scene::Method::ela);
    s.add_object("far", test::two_masses(), scene::Method::ela);
    s.apply(sphere(8, middle + Vec3{0.3, 0.2, 26}));
    for (int k = 0; k < 20; ++k)
      s.step(0.05);
    // The spring that is cut is of a node on the other side; the contact goes on.
    const std::uint32_t node = free_nodes(s.model(0))[0];
    const auto spring = std::find_if(
        s.model(0).springs.begin(), s.model(0).springs.end(), [&](const model::Spring& one) {
          return one.kind == model::SpringKind::bend && (one.i == node || one.j == node);
        });
    ASSERT_NE(spring, s.model(0).springs.end());
    if (cuts)
      s.schedule(s.time() + 0.04,
                 scene::CutObject{0, scene::SpringsToCut{{spring->i}, {spring->j}}});
    s.step(0.05);
    force[cuts ? 1 : 0] = s.instrument(0).force.z;
  }
  EXPECT_GT(force[0], 0);
  EXPECT_NEAR(force[1], force[0], 0.05 * force[0]);
}

TEST(SimulationContact, FrictionHoldsWhatRestsOnItAndNoMore) {
  // A triangle of three masses on a box, weight and a pull along y of three tenths of it.
  const double weight = 5000, total = 6 * weight;
  model::Model m = test::two_masses(2);
  m.nodes.push_back(m.nodes[0]);
  m.nodes[2].position = {0, 2, 0};
  m.triangles = {{0, 1, 2}};
  for (const std::uint32_t node : {0U, 1U})
    m.springs.push_back({node, 2, model::SpringKind::edge, 1, 0, std::sqrt(5.0)});
  TriangleMesh box = test::divided_box({40, 40, 40}, 1);
  for (Vec3& p : box.points)
    p -= {20, 20, 41};
  for (const double friction : {0.2, 0.5}) {
    scene::Simulation s(test::one_thread(), {});
    s.add_object("o", m, scene::Method::ela);
    contact::InstrumentShape shape{1, {}, friction};
    shape.core = std::make_shared<const contact::ConvexCore>(box);
    s.apply(scene::SetInstrument{0, shape, {{0, 0, -3e-3}, {}}});
    s.apply(scene::SetGravity{{0, 0.3 * weight, -weight}});
    s.apply(scene::SetTimestep{1e-4});
    s.step(0.03); // it falls a little and comes to lie
    const double duration = 0.01;
    std::vector<Vec3> at{moved(s, 0, 0)}, force;
    for (int k = 0; k < 2; ++k) {
      s.step(duration);
      at.push_back(moved(s, 0, 0));
      force.push_back(s.instrument(0).force);
      EXPECT_NEAR(force.back().z, -total, 1e-3 * total);
      EXPECT_LT(std::abs(at.back().z - at.front().z), 1e-3); // d_hat
      if (friction > 0.3)                                    // else it slides
        EXPECT_NEAR(force.back().y, 0.3 * total, 1e-3 * total);
      else
        EXPECT_NEAR(force.back().y, friction * total, 1e-3 * total);
    }
    const double first = at[1].y - at[0].y, second = at[2].y - at[1].y;
    if (friction > 0.3) {
      // It creeps with eps_v (1 - sqrt(1 - q)), where it needs the share q of what friction holds.
      const double creep = contact::Parameters{}.lengths.stick_speed *
                           (1 - std::sqrt(1 - 0.3 / friction)) * duration;
      EXPECT_NEAR(first, creep, 0.05 * creep);
      EXPECT_NEAR(second, creep, 0.05 * creep);
    } else {
      const double way = (0.3 - friction) * weight * duration * duration;
      EXPECT_NEAR(second - first, way, 0.02 * way);
    }
  }
}

TEST(SimulationContact, AFastInstrumentDoesNotPassThrough) {
  for (const auto& [method, integration] : ways)
    for (const double over : {0.0, 0.002}) {
      scene::Simulation s({}, {});
      s.add_object("o", organ(integration == scene::Integration::implicit ? 3 : 4), method, {},
                   integration);
      s.apply(sphere(8, middle + Vec3{0.3, 0.2, 28.5}));
      s.step(0.001);
      s.apply(scene::MoveInstrument{0, middle + Vec3{0.3, 0.2, 18}, {}, over});
      s.step(0.01);
      // What was above is now below it, not on the other side.
      EXPECT_GT(s.instrument(0).force.z, 0) << scene::method_name(method) << over;
      EXPECT_LT(depth(s, 0, {8, {}, 0}, s.instrument(0).pose), test::depth_allowed);
      std::uint32_t top = 0;
      for (std::uint32_t i = 0; i < model::surface_count(s.model(0)); ++i)
        if (s.model(0).nodes[i].position.z > s.model(0).nodes[top].position.z)
          top = i;
      EXPECT_LT(place(s, 0, top).z, middle.z + 12);
    }
}

TEST(SimulationContact, GraspedNodesFollowExactly) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s({}, {});
    s.add_object("o", organ(), method);
    s.apply(scene::SetInstrument{0, {3, {10, 0, 0}, 0}, {middle + Vec3{0, 0, 22}, {}}});
    const std::vector<std::uint32_t> nodes{free_nodes(s.model(0))[3], free_nodes(s.model(0))[8]};
    s.apply(scene::Grasp{0, nodes, 0});
    const contact::Pose start{middle + Vec3{0, 0, 22}, {}};
    const contact::Pose end{middle + Vec3{1, 2, 23}, contact::turn_about({1, 2, 3}, 25)};
    s.apply(scene::MoveInstrument{0, end.place, end.turn, 0.1});
    const contact::PoseWay way{start, end, 0, 0.1};
    for (int k = 1; k <= 5; ++k) {
      s.step(0.025);
      const contact::Pose now = way.at(s.time());
      EXPECT_EQ(s.instrument(0).pose, now);
      for (const std::uint32_t node : nodes)
        EXPECT_LT(norm(place(s, 0, node) - now(start.inverse(s.model(0).nodes[node].position))),
                  1e-12);
    }
    EXPECT_EQ(s.instrument(0).nodes, 2U);
    const Vec3 held = s.contact_forces(0)[0].value + s.contact_forces(0)[1].value;
    EXPECT_GT(norm(held), 0);
    EXPECT_LT(norm(s.instrument(0).force + held), 1e-12 * norm(held));
    s.apply(scene::Release{0, {nodes[0]}});
    EXPECT_EQ(s.instrument(0).nodes, 1U);
    s.apply(scene::MoveInstrument{0, end.place + Vec3{5, 0, 0}, {}, 0});
    s.step(0.01);
    EXPECT_LT(norm(place(s, 0, nodes[1]) -
                   (end(start.inverse(s.model(0).nodes[nodes[1]].position)) + Vec3{5, 0, 0})),
              1e-12);
    EXPECT_GT(norm(place(s, 0, nodes[0]) -
                   (end(start.inverse(s.model(0).nodes[nodes[0]].position)) + Vec3{5, 0, 0})),
              1);
    s.apply(scene::Withdraw{0});
    s.step(0.01);
    EXPECT_TRUE(s.contact_forces(0).empty());
    EXPECT_THROW(s.apply(scene::MoveInstrument{0, {}, {}, 0}), Error);
    std::uint32_t fixed = 0;
    while (s.model(0).nodes[fixed].fixed == model::fixed_none)
      ++fixed;
    s.apply(scene::SetInstrument{0, {3, {}, 0}, {middle + Vec3{0, 0, 30}, {}}});
    EXPECT_THROW(s.apply(scene::Grasp{0, {fixed}, 0}), Error);
  }
}

TEST(SimulationContact, TheSameBytesForAnyNumberOfThreads) {
  std::vector<std::vector<double>> results;
  for (const int threads : {1, 2, 3}) {
    std::vector<double>& r = results.emplace_back();
    for (const auto& [method, integration] : ways) {
      const int rounds =
          integration == scene::Integration::implicit ? 3 : 4; // for the sake of its time
      const auto s = pressed(method, 0.3, 2, 8, rounds, threads, integration);
      r.insert(r.end(), s->displacement(0).begin(), s->displacement(0).end());
      for (const contact::NodeVector& f : s->contact_forces(0))
        r.insert(r.end(), {1.0 * f.node, f.value.x, f.value.y, f.value.z});
    }
    ASSERT_EQ(r.size(), results[0].size());
    EXPECT_EQ(0, std::memcmp(r.data(), results[0].data(), r.size() * sizeof(double)));
  }
}

/// As large as a liver, and rounder.
model::Model liver() {
  TriangleMesh mesh = test::ball(3, 1);
  for (Vec3& p : mesh.points)
    p = {60 * p.x, 40 * p.y, 25 * p.z};
  return test::model_of(mesh);
}

TEST(SimulationContact, DrawnAlongALiver) {
  const model::Model model = liver();
  Box3 box;
  for (std::size_t i = 0; i < model::surface_count(model); ++i)
    box.add(model.nodes[i].position);
  const Vec3 c = 0.5 * (box.min + box.max), size = box.size();
  const double radius = 0.15 * box.longest_side();
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela})
    for (const double friction : {0.0, 0.3}) {
      if (method == scene::Method::ela && friction == 0)
        continue; // it takes its time
      std::vector<std::string> warnings;
      scene::Simulation s({}, {.warn = [&](const std::string& w) { warnings.push_back(w); }});
      s.add_object("liver", model, method);
      const Vec3 start{c.x - 0.2 * size.x, c.y, box.max.z + radius};
      s.apply(sphere(radius, start, friction));
      std::size_t touched = 0;
      double deepest = -HUGE_VAL;
      for (int k = 1; k <= 16; ++k) {
        const double x = k / 16.0;
        const Vec3 to{c.x + (0.4 * x - 0.2) * size.x, c.y + 0.1 * size.y * std::sin(6 * x),
                      box.max.z + radius - std::min(1.0, 4 * x) * 0.25 * size.z};
        s.apply(scene::MoveInstrument{0, to, {}, 0.02});
        s.step(0.02);
        deepest = test::larger(deepest, depth(s, 0, {radius, {}, 0}, {to, {}}));
        for (const contact::NodeVector& f : s.contact_forces(0)) {
          ++touched;
          const Vec3 n = (place(s, 0, f.node) - to) / radius;
          EXPECT_GE(dot(f.value, n), method == scene::Method::ffe ? 0 : -1e-2 * norm(f.value));
        }
      }
      EXPECT_LT(deepest, 6.01e-4 * radius); // as depth_allowed
      EXPECT_GT(touched, 50U);
      for (const std::string& w : warnings)
        EXPECT_EQ(w.find("not exact"), std::string::npos) << w;
    }
}

TEST(SimulationContact, StrangeScenes) {
  struct Strange {
    const char* name;
    double radius;
    Vec3 at;
    bool held = false; ///< it would have to pass fixed nodes
  };
  const model::Model model = organ();
  const std::uint32_t node = free_nodes(model)[5];
  const Vec3 at = model.nodes[node].position;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela})
    for (const Strange& strange :
         {Strange{"tiny, its centre at a node", 1e-4, at}, Strange{"its centre at a node", 4, at},
          Strange{"huge", 1e5, middle + Vec3{0, 0, 1e5 + 19}},
          Strange{"around all of it", 50, middle, true}, Strange{"in the middle", 10, middle},
          Strange{"on fixed nodes", 6, middle - Vec3{0, 0, 21}, true}}) {
      std::vector<std::string> warnings;
      scene::Simulation s({}, {.warn = [&](const std::string& w) { warnings.push_back(w); }});
      s.add_object("o", model, method);
      s.apply(sphere(strange.radius, strange.at));
      std::string failure;
      try {
        for (int k = 0; k < 3; ++k)
          s.step(0.001);
      } catch (const Error& e) {
        failure = e.what();
      }
      EXPECT_EQ(failure.find("a prescribed motion meets fixed nodes") != std::string::npos,
                strange.held)
          << strange.name << failure;
      if (!failure.empty())
        continue;
      for (const double u : s.displacement(0))
        ASSERT_TRUE(std::isfinite(u)) << strange.name;
      EXPECT_LT(depth(s, 0, {strange.radius, {}, 0}, {strange.at, {}}), test::depth_allowed)
          << strange.name << " " << scene::method_name(method);
      for (const contact::NodeVector& f : s.contact_forces(0))
        EXPECT_GE(dot(f.value, place(s, 0, f.node) - strange.at), 0) << strange.name;
    }
}

TEST(SimulationContact, TwoInstrumentsAtOneNode) {
  const model::Model model = organ();
  const Vec3 top = middle + Vec3{0, 0, 20};
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela})
    for (const double apart : {7.0, 3.0, 1e-3}) { // pinched, overlapping
      scene::Simulation s({}, {});
      s.add_object("o", model, method);
      for (const std::size_t k : {0U, 1U}) {
        const Vec3 at = top + Vec3{k == 0 ? -apart : apart, 0, 2};
        s.apply(scene::SetInstrument{k, {6, {}, 0.1}, {at, {}}, k == 0 ? "left" : "right"});
      }
      for (int k = 0; k < 3; ++k)
        s.step(0.001);
      for (const std::size_t k : {0U, 1U}) {
        EXPECT_LT(depth(s, 0, {6, {}, 0}, s.instrument(k).pose), test::depth_allowed)
            << scene::method_name(method) << apart;
      }
      EXPECT_FALSE(s.contact_forces(0).empty());
    }
}

// As a driver does that leads several hands: their order says nothing, and one problem is solved.
TEST(SimulationContact, InstrumentsMovedAtOnceGoTogether) {
  const auto led = [](bool other_first) {
    scene::Simulation s(test::one_thread(), {});
    s.add_object("organ", organ(3), scene::Method::ffe);
    const Vec3 left = middle + Vec3{-3, 0, 24.5}, right = middle + Vec3{4, 1, 24.5};
    s.apply(scene::SetInstrument{0, {5, {}, 0.4}, {left, {}}, "left"});
    s.apply(scene::SetInstrument{1, {5, {}, 0.4}, {right, {}}, "right"});
    s.step(0.001);
    const std::uint64_t before = s.counts().contact.steps;
    for (std::size_t k = 0; k < 2; ++k) {
      const std::size_t i = other_first ? 1 - k : k;
      s.apply(scene::MoveInstrument{i, (i == 0 ? left : right) - Vec3{0.3, 0, 0.5}, {}, 0});
    }
    s.step(0.001);
    EXPECT_EQ(s.counts().contact.steps - before, 1);
    return std::pair(s.instrument(0).force, s.instrument(1).force);
  };
  const auto one = led(false);
  EXPECT_GT(norm(one.first), 0);
  EXPECT_EQ(one, led(true));
}

/// A sphere that is put beside an organ, pressed in and led aside.
struct PreparedContact {
  std::vector<double> answers; ///< shapes and forces, one behind the other
  std::uint64_t solves = 0;    ///< behind the preparation
};

PreparedContact contact_with(const std::optional<scene::Prepare>& prepare) {
  scene::Simulation s(test::one_thread(), {});
  s.add_object("organ", organ(3), scene::Method::ffe);
  if (prepare)
    s.apply(*prepare);
  const std::uint64_t before = s.counts().elastostatic.solves;
  PreparedContact all;
  s.apply(sphere(5, middle + Vec3{0, 0, 26}, 0.3));
  for (int k = 0; k < 8; ++k) {
    s.apply(scene::MoveInstrument{0, middle + Vec3{0.5 * k, 0.1, 24.3}, {}, 0.001});
    s.step(0.001);
    const std::span<const double> u = s.displacement(0);
    all.answers.insert(all.answers.end(), u.begin(), u.end());
    for (const contact::NodeVector& f : s.contact_forces(0))
      all.answers.insert(all.answers.end(), {f.value.x, f.value.y, f.value.z});
  }
  all.solves = s.counts().elastostatic.solves - before;
  return all;
}

TEST(SimulationContact, PreparedContactsAreTheSameAndSolveNothing) {
  const PreparedContact plain = contact_with(std::nullopt);
  EXPECT_GT(plain.solves, 0);
  scene::Prepare prepare{.object = 0, .contact = true, .cut = false, .nodes_ahead = {}};
  const PreparedContact factor = contact_with(prepare);
  EXPECT_EQ(factor.solves, plain.solves);
  const model::Model model = organ(3);
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    prepare.nodes_ahead.push_back(i);
  const PreparedContact columns = contact_with(prepare);
  EXPECT_EQ(columns.solves, 0);
  ASSERT_FALSE(plain.answers.empty());
  for (const PreparedContact* const other : {&factor, &columns}) {
    ASSERT_EQ(other->answers.size(), plain.answers.size());
    EXPECT_EQ(std::memcmp(other->answers.data(), plain.answers.data(),
                          plain.answers.size() * sizeof(double)),
              0);
  }
}

TEST(SimulationContact, PreparedContactsReadNoCompressedColumns) {
  const model::Model model = organ(3);
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const linalg::Factor factor(k, {});
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    positions.push_back(model.nodes[i].position);
    if (i < model::surface_count(model))
      nodes.push_back(i);
  }
  const columns::CompressedMade made = columns::compress_columns(
      positions, nodes, 1e-6,
      [&](std::span<const std::uint32_t> of, columns::ColumnSink& sink) {
        return columns::compliance_columns(k, factor, linalg::stiffness_norm(k), of, {}, sink,
                                           positions.size());
      },
      {});
  const std::size_t chunks = made.layout.with_columns;
  ASSERT_GT(chunks, 3);
  std::vector<std::vector<double>> answers;
  for (const bool prepared : {false, true}) {
    std::size_t reads = 0;
    scene::Simulation s(test::one_thread(), {});
    s.add_object("organ", model, scene::Method::ffe,
                 compliance::compliance_of_store(
                     {std::make_unique<columns::CompressedColumns>(made.layout, model.nodes.size(),
                                                                   [&](std::size_t chunk) {
                                                                     ++reads;
                                                                     return made.chunks[chunk];
                                                                   }),
                      [&] { return linalg::Factor(k, Context{}); }}));
    if (prepared)
      s.apply(scene::Prepare{.object = 0, .contact = true, .cut = false, .nodes_ahead = {}});
    const std::size_t before = reads;
    EXPECT_EQ(before, prepared ? chunks : 0);
    s.apply(sphere(5, middle + Vec3{0, 0, 26}));
    std::vector<double>& all = answers.emplace_back();
    for (int step = 0; step < 6; ++step) {
      s.apply(scene::MoveInstrument{0, middle + Vec3{0.5 * step, 0.1, 24.3}, {}, 0.001});
      s.step(0.001);
      for (const contact::NodeVector& f : s.contact_forces(0))
        all.insert(all.end(), {f.value.x, f.value.y, f.value.z});
    }
    EXPECT_EQ(prepared, reads == before);
  }
  ASSERT_FALSE(answers[0].empty());
  EXPECT_EQ(answers[0], answers[1]);
}

TEST(SimulationContact, ColumnsThatDoNotFitAreNotPrepared) {
  Context context = test::one_thread();
  const model::Model model = organ(3);
  context.max_memory = 64 * 9 * sizeof(double) * model.nodes.size(); // 16 nodes' columns
  scene::Simulation s(context, {});
  s.add_object("organ", model, scene::Method::ffe);
  scene::Prepare prepare{.object = 0, .contact = true, .cut = false, .nodes_ahead = {}};
  for (std::uint32_t i = 0; i < 17; ++i)
    prepare.nodes_ahead.push_back(i);
  EXPECT_THROW(s.apply(prepare), Error);
  prepare.nodes_ahead.pop_back();
  s.apply(prepare);
}

// Steps in which forces are not found, since springs bend too far in them for their rounds, throw a
// net about no more than an instrument pushes it: they are taken in halves.
TEST(SimulationContact, LongStepsOfANetWinNoEnergy) {
  model::Model model = organ(3);
  for (model::Spring& spring : model.springs)
    spring.damping = 0;
  for (model::Node& node : model.nodes)
    node.drag = 0;
  const double step = 0.02;
  scene::Simulation s(test::one_thread(), {});
  s.add_object("o", std::move(model), scene::Method::ela, {}, scene::Integration::implicit);
  s.apply(scene::SetTimestep{step});
  const auto place = [](double deep) { return Vec3{100, -49.5, 30 + 25.2 - deep}; };
  s.apply(scene::SetInstrument{0, {5, {}, 0}, {place(0), {}}, "probe"});
  s.step(0);
  double work = 0, given = 0, most = 0;
  Vec3 last = place(0);
  for (int k = 1; k <= 60; ++k) {
    const Vec3 to = place(2.5 * std::sin(k * 3.14159265358979323846 / 60)); // down and up again
    s.apply(scene::MoveInstrument{0, to, {}, step});
    s.step(step);
    work -= dot(s.instrument(0).force, to - last);
    last = to;
    given = test::larger(given, work);
    const scene::SimulationState state = s.state();
    most = test::larger(most, state.kinetic_energy + state.elastic_energy);
  }
  const scene::SimulationState state = s.state();
  EXPECT_GT(given, 0);
  EXPECT_LT(most, 1.5 * given); // else over 100 times that
  EXPECT_LT(state.kinetic_energy + state.elastic_energy, 0.3 * given);
}

} // namespace
} // namespace gewebe::test
