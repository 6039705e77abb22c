// Springs beside elements in motion: ties between solids, and nets that hang on them.

#include "base/error.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "integrator/solid_motion.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "tests/unit/larger.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::one_thread, test::settle;
using Numbers = std::vector<double>;

double largest_difference(std::span<const double> a, std::span<const double> b) {
  double most = a.size() == b.size() ? 0 : HUGE_VAL;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
    most = test::larger(most, std::abs(a[k] - b[k]));
  return most;
}

// ---- the body itself

struct Kind {
  integrator::SolidLaw law;
  bool quadratic;
};

/// A box of tetrahedra and a chain of three nodes that hangs on one of its corners, with a spring
/// between two other corners.
struct Chained {
  tetrahedra::TetMesh mesh;
  std::vector<integrator::SolidSpring> springs;
  Numbers masses, drag;
  std::size_t first = 0; ///< node of the chain

  explicit Chained(bool quadratic) : mesh(test::box_tetrahedra(2, 2, 2, 5)) {
    if (quadratic)
      tetrahedra::make_quadratic(mesh);
    first = mesh.points.size();
    masses.resize(first);
    const auto corner = static_cast<std::uint32_t>(std::ranges::find(mesh.points, Vec3{10, 10, 0}) -
                                                   mesh.points.begin());
    std::uint32_t above = corner;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto node = static_cast<std::uint32_t>(mesh.points.size());
      mesh.points.push_back({10, 10, -3.0 * (k + 1)});
      masses.push_back(0.2 + 0.1 * k);
      springs.push_back({above, node, 4000.0 + 1000 * k, 3, 3});
      above = node;
    }
    springs.push_back({0, 2, 800, 1, 12}); // not at rest
    drag.assign(mesh.points.size(), 0);
  }
  integrator::SolidMotion moving(const integrator::SolidMotionOptions& options) const {
    return {
        mesh, std::vector<fem::SolidMaterial>{{2e4, 0.4, 1e-3}}, {springs, masses, drag}, options};
  }
};

class SolidNetOf : public testing::TestWithParam<Kind> {
protected:
  static integrator::SolidMotionOptions sure() {
    integrator::SolidMotionOptions options;
    options.law = GetParam().law;
    options.tolerance = 1e-8;
    options.max_rounds = 200;
    return options;
  }
};

double energy(const integrator::SolidMotion& body) {
  return body.kinetic_energy() + body.potential_energy();
}

std::array<Vec3, 2> momentum(const integrator::SolidMotion& body) {
  std::array<Vec3, 2> sum{};
  for (std::size_t i = 0; i < body.masses().size(); ++i) {
    const Vec3 p = body.masses()[i] * vector_at(body.velocity(), i);
    sum[0] += p;
    sum[1] += cross(vector_at(body.places(), i), p);
  }
  return sum;
}

/// The tangent of the reference and the constant matrix are different ways to one minimum.
TEST_P(SolidNetOf, TheQuickWayGoesWhereTheReferenceDoes) {
  const Chained body(GetParam().quadratic);
  const auto end = [&](bool reference) {
    integrator::SolidMotionOptions options = sure();
    options.reference = reference;
    options.damping = 1e-4;
    integrator::SolidMotion moving = body.moving(options);
    std::vector<std::uint8_t> held;
    Numbers load;
    for (std::size_t i = 0; i < body.mesh.points.size(); ++i) {
      held.insert(held.end(), 3, body.mesh.points[i].x == 0 ? 1 : 0);
      load.insert(load.end(), {500 * moving.masses()[i], 0, -9810 * moving.masses()[i]});
    }
    moving.hold(held);
    moving.set_load(load);
    for (int n = 0; n < 4; ++n)
      (void)moving.step(0.01, {});
    return moving.displacement();
  };
  const Numbers quick = end(false), reference = end(true);
  double moved = 0;
  for (const double u : reference)
    moved = test::larger(moved, std::abs(u));
  EXPECT_GT(moved, 1);
  EXPECT_LT(largest_difference(quick, reference), 1e-5 * moved);
}

TEST_P(SolidNetOf, AFreeOneKeepsItsMomentumAndGainsNoEnergy) {
  const Chained body(GetParam().quadratic);
  std::array<double, 2> turned{};
  for (const int half : {0, 1}) {
    const int steps = half == 0 ? 10 : 20;
    integrator::SolidMotion moving = body.moving(sure());
    std::mt19937 random(3);
    std::uniform_real_distribution<double> value(-20, 20);
    Numbers velocity;
    for (const Vec3& p : body.mesh.points) {
      const Vec3 v = cross({3, 5, 8}, p);
      for (int a = 0; a < 3; ++a)
        velocity.push_back(v[a] + value(random));
    }
    moving.set_state(Numbers(velocity.size()), velocity);
    const auto before = momentum(moving);
    double most = energy(moving);
    for (int n = 0; n < steps; ++n) {
      (void)moving.step(0.02 / steps, {});
      EXPECT_LE(energy(moving), most * (1 + 1e-10));
      most = energy(moving);
    }
    const auto after = momentum(moving);
    EXPECT_LT(norm(after[0] - before[0]), 1e-11 * norm(before[0]));
    turned[static_cast<std::size_t>(half)] = norm(after[1] - before[1]) / norm(before[1]);
  }
  EXPECT_LT(turned[0], 0.1);
  EXPECT_NEAR(turned[0] / turned[1], 2, 0.6);
}

/// Each spring of the chain carries what hangs below it.
TEST_P(SolidNetOf, AChainAtRestCarriesItsWeight) {
  Chained body(GetParam().quadratic);
  body.springs.pop_back();
  integrator::SolidMotionOptions options = sure();
  options.damping = 1e-2;
  std::ranges::fill(body.drag, 40.0);
  integrator::SolidMotion moving = body.moving(options);
  std::vector<std::uint8_t> held;
  Numbers load;
  for (std::size_t i = 0; i < body.mesh.points.size(); ++i) {
    held.insert(held.end(), 3, i < body.first && body.mesh.points[i].z > 9 ? 1 : 0);
    load.insert(load.end(), {0, 0, -9810 * moving.masses()[i]});
  }
  moving.hold(held);
  moving.set_load(load);
  for (int n = 0; n < 200; ++n)
    (void)moving.step(0.05, {});
  double below = 0;
  for (std::size_t k = 3; k-- > 0;) {
    below += 9810 * body.masses[body.first + k];
    const integrator::SolidSpring& s = body.springs[k];
    const double length = norm(vector_at(moving.places(), s.j) - vector_at(moving.places(), s.i));
    EXPECT_NEAR(s.stiffness * (length - s.rest), below, 1e-6 * below);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, SolidNetOf,
                         testing::Values(Kind{integrator::SolidLaw::corotational, false},
                                         Kind{integrator::SolidLaw::corotational, true},
                                         Kind{integrator::SolidLaw::hyperelastic, false}),
                         [](const auto& kind) {
                           return std::string(kind.param.law ==
                                                      gewebe::integrator::SolidLaw::corotational
                                                  ? "corotational"
                                                  : "neo_hookean") +
                                  (kind.param.quadratic ? "_quadratic" : "_linear");
                         });

// ---- scenes

constexpr double cell = 4;

/// A bar along x from `begin` to `end` cells, 2 cells wide, held at x = 0; soft from cell 3 on.
model::Model bar(std::uint32_t begin, std::uint32_t end, bool quadratic = true) {
  fem::SolidModelOptions options;
  const model::Material gel{"gel", 1e-3, 2e4, 1, 0.2, 0.4}, soft{"soft", 2e-3, 7e3, 1, 0.2, 0.3};
  options.quadratic = quadratic;
  tetrahedra::TetMesh mesh = test::box_tetrahedra(end - begin, 2, 2, cell);
  for (Vec3& p : mesh.points)
    p.x += begin * cell;
  options.material.materials = {begin < 3 ? gel : soft};
  if (begin < 3 && end > 3) {
    options.material = {{gel, soft}, {0, 1}};
    for (const Tetrahedron& t : mesh.tetrahedra) {
      double x = 0;
      for (const std::uint32_t corner : t)
        x += mesh.points[corner].x / 4;
      mesh.material.push_back(x > 3 * cell ? 1 : 0);
    }
  }
  model::Model model = fem::solid_model(std::move(mesh), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  return model;
}

std::vector<std::uint32_t> nodes_at(const model::Model& model, double x) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (std::abs(model.nodes[i].position.x - x) < 1e-9)
      nodes.push_back(i);
  return nodes;
}

integrator::SolidChoice damped() {
  integrator::SolidChoice choice;
  choice.damping = integrator::damping_per_stiffness(0.5, 20);
  return choice;
}

/// Where the middle of a bar's end hangs.
double droop(const scene::Simulation& s, std::size_t object, const model::Model& model) {
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].position == Vec3{6 * cell, cell, cell})
      return -s.displacement(object)[3 * std::size_t{i} + 2];
  ADD_FAILURE() << "no node in the middle of the end";
  return NAN;
}

double droop_of_halves(double stiffness, int count) {
  Context context = one_thread();
  context.threads = count;
  const model::Model left = bar(0, 3), right = bar(3, 6);
  scene::Simulation s(context, {});
  s.add_object("left", left, scene::Method::ela, {}, scene::Integration::semi_implicit, damped());
  s.add_object("right", right, scene::Method::ela, {}, scene::Integration::semi_implicit, damped());
  s.apply(scene::Attach{0, nodes_at(left, 3 * cell), 1, nodes_at(right, 3 * cell), stiffness});
  s.apply(scene::SetGravity{{0, 0, -3000}});
  settle(s);
  return droop(s, 1, right);
}

/// A square cloth of springs that hangs by two corners; beside it, where asked for, a node that is
/// tied to nothing and held along one axis.
struct Cloth {
  static constexpr std::uint32_t side = 7;
  tetrahedra::TetMesh mesh;
  std::vector<integrator::SolidSpring> springs;
  Numbers masses, drag;
  std::vector<std::uint8_t> held;

  explicit Cloth(bool beside) {
    for (std::uint32_t r = 0; r < side; ++r)
      for (std::uint32_t c = 0; c < side; ++c)
        mesh.points.push_back({5.0 * c, 5.0 * r, 0.3 * ((r * 7 + c * 3) % 5)});
    for (std::uint32_t k = 0; k < side * side; ++k)
      for (const std::uint32_t by : {1U, side, side + 1, side - 1}) {
        const std::uint32_t to = k + by;
        if (to >= side * side || norm(mesh.points[to] - mesh.points[k]) > 8)
          continue;
        springs.push_back({k, to, 3000, 4, norm(mesh.points[to] - mesh.points[k])});
      }
    if (beside)
      mesh.points.push_back({0, 0, 99});
    masses.assign(mesh.points.size(), 0.1);
    drag.assign(mesh.points.size(), 5);
    held.resize(3 * mesh.points.size());
    for (const std::uint32_t corner : {side * (side - 1), side * side - 1})
      for (std::uint32_t a = 0; a < 3; ++a)
        held[3 * corner + a] = 1;
    if (beside)
      held.back() = 1;
  }
  integrator::SolidMotion moving(double tolerance) const {
    integrator::SolidMotionOptions options;
    options.tolerance = tolerance;
    options.max_rounds = 200;
    integrator::SolidMotion body(mesh, std::vector<fem::SolidMaterial>{}, {springs, masses, drag},
                                 options);
    body.hold(held);
    Numbers load;
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      load.insert(load.end(), {0, i < side * side ? -980.0 : 0, i < side * side ? 300.0 : 0});
    body.set_load(load);
    return body;
  }
};

/// Where nodes are held as a whole one matrix of nodes serves each axis, else there is one of axes:
/// it is the same matrix.
TEST(SolidNet, OneMatrixServesTheThreeAxesOfANet) {
  std::array<int, 2> rounds{};
  std::array<Numbers, 2> end;
  for (const bool beside : {false, true}) {
    const std::size_t way = beside ? 1 : 0;
    integrator::SolidMotion body = Cloth(beside).moving(1e-6);
    for (int n = 0; n < 20; ++n)
      rounds[way] += body.step(0.02, {}).rounds;
    end[way] = body.displacement();
  }
  end[1].resize(end[0].size());
  EXPECT_LT(largest_difference(end[0], end[1]), 1e-4);
  EXPECT_NEAR(rounds[0], rounds[1], 0.1 * rounds[1]);
}

TEST(SolidNet, NoRoundsAreSpentOnWhatAllButStands) {
  integrator::SolidMotion body = Cloth(false).moving(0.02);
  int still = 0;
  for (int n = 0; n < 400; ++n) {
    const Numbers before = body.displacement();
    const integrator::SolidStep step = body.step(0.05, {});
    const Numbers now = body.displacement(), none(now.size());
    if (!(largest_difference(before, now) < 1e-7 * largest_difference(now, none)))
      continue;
    ++still;
    EXPECT_LE(step.rounds, 3) << n;
  }
  EXPECT_GT(still, 100);
}

/// A bar in two that stiff ties hold together is nearly the whole one.
TEST(SolidNet, TwoHalvesThatAreTiedBendAsOne) {
  const model::Model model = bar(0, 6);
  scene::Simulation whole(one_thread(), {});
  whole.add_object("whole", model, scene::Method::ela, {}, scene::Integration::semi_implicit,
                   damped());
  whole.apply(scene::SetGravity{{0, 0, -3000}});
  settle(whole);
  const double expected = droop(whole, 0, model);
  EXPECT_GT(expected, 0.5);
  EXPECT_NEAR(droop_of_halves(1e7, 1), expected, 0.005 * expected);
  EXPECT_GT(droop_of_halves(3e3, 1), 1.1 * expected); // loose ones
  EXPECT_EQ(droop_of_halves(1e5, 1), droop_of_halves(1e5, 2));
}

/// The energy of bodies that move as one is told once.
TEST(SolidNet, TiedBodiesThatFallHaveTheirEnergyOnce) {
  model::Model left = bar(0, 3), right = bar(3, 6);
  double mass = 0;
  for (model::Model* const model : {&left, &right})
    for (model::Node& node : model->nodes) {
      node.fixed = 0;
      node.drag = 0;
      mass += node.mass;
    }
  scene::Simulation s(one_thread(), {});
  s.add_object("left", left, scene::Method::ela);
  s.add_object("right", right, scene::Method::ela);
  s.apply(scene::Attach{0, nodes_at(left, 3 * cell), 1, nodes_at(right, 3 * cell), 1e5});
  s.apply(scene::SetGravity{{0, 0, -1000}});
  s.step(0.1);
  const double expected = mass * 100 * 100 / 2;
  EXPECT_NEAR(s.state().kinetic_energy, expected, 1e-6 * expected);
  EXPECT_LT(s.state().elastic_energy, 1e-4 * expected); // weight is not by lumped masses
}

/// A net that hangs on a solid by ties: they carry its weight.
TEST(SolidNet, ANetHangsOnASolid) {
  const model::Model beam = bar(0, 6);
  model::Model net = test::organ(2);
  double weight = 0;
  Vec3 top{0, 0, -HUGE_VAL};
  for (model::Node& node : net.nodes) {
    node.fixed = 0;
    weight += node.mass * 100;
    if (node.position.z > top.z)
      top = node.position;
  }
  for (model::Node& node : net.nodes)
    node.position += Vec3{6 * cell, cell, -1} - top;
  std::vector<std::uint32_t> upper;
  for (std::uint32_t i = 0; i < model::surface_count(net); ++i)
    if (net.nodes[i].position.z > -8)
      upper.push_back(i);
  scene::Simulation s(one_thread(), {});
  s.add_object("beam", beam, scene::Method::ela, {}, scene::Integration::semi_implicit, damped());
  s.add_object("net", net, scene::Method::ela, {}, scene::Integration::implicit);
  s.apply(scene::SetGravity{{0, 0, -100}});
  s.apply(scene::Attach{1, upper, 0, nodes_at(beam, 6 * cell), 2000});
  settle(s);
  const double loaded = droop(s, 0, beam);
  scene::Simulation alone(one_thread(), {});
  alone.add_object("beam", beam, scene::Method::ela, {}, scene::Integration::semi_implicit,
                   damped());
  alone.apply(scene::SetGravity{{0, 0, -100}});
  // The same weight, put on its end by hand.
  const auto end = nodes_at(beam, 6 * cell);
  alone.apply(scene::SetForce{0, end, {0, 0, -weight / static_cast<double>(end.size())}});
  settle(alone);
  EXPECT_GT(loaded, 0.05);
  EXPECT_NEAR(loaded, droop(alone, 0, beam), 0.1 * loaded);
}

std::string refusal(const model::Model& other, scene::Integration integration,
                    const integrator::SolidChoice& choice) {
  scene::Simulation s(one_thread(), {});
  s.add_object("a", bar(0, 3), scene::Method::ela, {}, scene::Integration::semi_implicit, damped());
  s.add_object("b", other, scene::Method::ela, {}, integration, choice);
  try {
    s.apply(scene::Attach{0, {nodes_at(s.model(0), 3 * cell)[0]}, 1, {0}, 10});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(SolidNet, RefusesWhatCantMoveAsOne) {
  EXPECT_EQ(refusal(bar(3, 6), scene::Integration::semi_implicit, damped()), "");
  EXPECT_EQ(refusal(test::organ(2), scene::Integration::implicit, {}), "");
  EXPECT_EQ(refusal(test::organ(2), scene::Integration::semi_implicit, {}),
            "one of a and b is implicit and the other is not, expected both alike");
  EXPECT_EQ(refusal(bar(3, 6, false), scene::Integration::semi_implicit, damped()),
            "one of a and b is linear and the other quadratic, expected both alike");
  EXPECT_EQ(refusal(bar(3, 6), scene::Integration::semi_implicit, {}),
            "law=, damping= and tolerance= of a and b differ, expected both alike");
}

} // namespace
} // namespace gewebe::test
