// Solids in motion: what mechanics says of them (energy, momentum, rest, order), that they find
// back from any shape, and a measured beam's frequency.

#include "fit/hyperelastic_statics.h"
#include "geometry/vector_at.h"
#include "integrator/motion_limit_internal.h"
#include "integrator/motion_volumes_internal.h"
#include "integrator/solid_motion.h"
#include "linalg/factor.h"
#include "tests/stress/motion_bodies.h"
#include "tests/unit/larger.h"
#include "tests/unit/relative_difference.h"
#include "tests/unit/solid_bodies.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/order.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using Numbers = std::vector<double>;

struct Kind {
  integrator::SolidLaw law;
  bool quadratic;
};
std::string name(const Kind& kind) {
  return std::string(kind.law == integrator::SolidLaw::corotational ? "corotational"
                                                                    : "neo_hookean") +
         (kind.quadratic ? "_quadratic" : "_linear");
}

class SolidMotionOf : public testing::TestWithParam<Kind> {
protected:
  static tetrahedra::TetMesh mesh(tetrahedra::TetMesh of = test::box_tetrahedra(3, 2, 2, 5)) {
    if (GetParam().quadratic)
      tetrahedra::make_quadratic(of);
    return of;
  }
  static integrator::SolidMotion body(const tetrahedra::TetMesh& mesh,
                                      integrator::SolidMotionOptions options = {}) {
    options.law = GetParam().law;
    return {mesh, materials(), options};
  }
  static std::vector<fem::SolidMaterial> materials() { return {{2e4, 0.45, 1e-3}}; }
};

Numbers random_numbers(std::size_t count, double by, std::mt19937& random) {
  std::uniform_real_distribution<double> value(-by, by);
  Numbers numbers(count);
  for (double& n : numbers)
    n = value(random);
  return numbers;
}

std::vector<std::uint8_t> held_end(const tetrahedra::TetMesh& mesh) {
  std::vector<std::uint8_t> held;
  for (const Vec3& p : mesh.points)
    held.insert(held.end(), 3, p.x == 0 ? 1 : 0);
  return held;
}

double energy(const integrator::SolidMotion& body) {
  return body.kinetic_energy() + body.potential_energy();
}

double largest(const Numbers& a) {
  return test::largest_difference(a, Numbers(a.size()));
}

std::array<Vec3, 2> momentum(const integrator::SolidMotion& body) {
  std::array<Vec3, 2> sum{};
  for (std::size_t i = 0; i < body.masses().size(); ++i) {
    const auto x = body.places().subspan(3 * i, 3), v = body.velocity().subspan(3 * i, 3);
    const Vec3 p = body.masses()[i] * Vec3{v[0], v[1], v[2]};
    sum[0] += p;
    sum[1] += cross({x[0], x[1], x[2]}, p);
  }
  return sum;
}

TEST_P(SolidMotionOf, EnergyNeverGrowsWithoutWork) {
  const bool slow = GetParam().law != integrator::SolidLaw::corotational && GetParam().quadratic;
  const tetrahedra::TetMesh m =
      mesh(slow ? test::box_tetrahedra(1, 1, 1, 1) : test::distorted_box());
  std::mt19937 random(1);
  for (const bool held : {false, true})
    for (const double h : {1e-5, 1e-3, 1.0 / 60, 0.1, 1.0}) {
      integrator::SolidMotionOptions options;
      options.max_rounds = 1 + static_cast<int>(random() % 4); // unfinished steps as well
      options.damping = random() % 2 == 0 ? 0 : 1e-3;
      options.drag = random() % 2 == 0 ? 0 : 2;
      integrator::SolidMotion moving = body(m, options);
      const std::size_t axes = 3 * m.points.size();
      if (held)
        moving.hold(held_end(m));
      Numbers load = random_numbers(axes, 50, random);
      if (!held) // a free one would fall and gain all that the load has
        load.assign(axes, 0);
      moving.set_load(load);
      Numbers u = random_numbers(axes, 0.1, random), v = random_numbers(axes, 300, random);
      for (std::size_t axis = 0; held && axis < axes; ++axis)
        if (held_end(m)[axis] != 0)
          u[axis] = v[axis] = 0;
      moving.set_state(u, v);
      double before = energy(moving);
      const double scale = std::abs(before) + moving.kinetic_energy() + moving.elastic_energy();
      for (int n = 0; n < (slow                                                   ? 3
                           : GetParam().law == integrator::SolidLaw::corotational ? 60
                                                                                  : 8);
           ++n) {
        (void)moving.step(h, {});
        const double after = energy(moving);
        ASSERT_LE(after, before + 1e-10 * scale) << "step " << n << " of " << h;
        before = after;
      }
    }
}

TEST_P(SolidMotionOf, FreeBodiesKeepTheirMomentum) {
  const tetrahedra::TetMesh m = mesh();
  const std::size_t axes = 3 * m.points.size();
  std::array<double, 2> turned{};
  for (const int half : {0, 1}) {
    const int steps = half == 0 ? 10 : 20;
    integrator::SolidMotionOptions options;
    options.tolerance = 1e-6;
    options.max_rounds = 60;
    integrator::SolidMotion moving = body(m, options);
    std::mt19937 random(2);
    Numbers v = random_numbers(axes, 1, random);
    for (std::size_t i = 0; i < m.points.size(); ++i) { // and a spin
      const Vec3 spin = cross({3, 5, 8}, m.points[i]);
      for (int k = 0; k < 3; ++k)
        v[3 * i + static_cast<std::size_t>(k)] += spin[k];
    }
    moving.set_state(Numbers(axes), v);
    const auto before = momentum(moving);
    for (int n = 0; n < steps; ++n)
      (void)moving.step(0.02 / steps, {});
    const auto after = momentum(moving);
    EXPECT_LT(norm(after[0] - before[0]), 1e-11 * norm(before[0]));
    turned[static_cast<std::size_t>(half)] = norm(after[1] - before[1]) / norm(before[1]);
  }
  EXPECT_LT(turned[0], 0.05);
  EXPECT_NEAR(turned[0] / turned[1], 2, 0.5);
}

TEST_P(SolidMotionOf, ALoadGivesItsMomentum) {
  const tetrahedra::TetMesh m = mesh();
  integrator::SolidMotion moving = body(m);
  Numbers load(3 * m.points.size());
  load[1] = 1000;
  moving.set_load(load);
  for (int n = 0; n < 50; ++n)
    (void)moving.step(1e-3, {});
  EXPECT_NEAR(momentum(moving)[0].y, 50, 1e-9);
  EXPECT_NEAR(momentum(moving)[0].x, 0, 1e-9);
}

TEST_P(SolidMotionOf, ComesToRestWhereStaticsSays) {
  const tetrahedra::TetMesh m = mesh(test::box_tetrahedra(5, 2, 2, 5));
  const std::vector<fem::SolidElement> elements = fem::solid_elements(m, materials());
  const std::vector<std::uint8_t> held = held_end(m);
  integrator::SolidMotionOptions options;
  options.tolerance = 1e-6;
  options.max_rounds = 100;
  integrator::SolidMotion moving = body(m, options);
  moving.hold(held);
  const auto rest = [&](const Numbers& load) {
    moving.set_load(load);
    for (int n = 0; n < 30; ++n)
      (void)moving.step(1, {});
    return moving.displacement();
  };
  if (GetParam().law == integrator::SolidLaw::hyperelastic) {
    fit::SolidVector load;
    load.axes = Numbers(held.size());
    for (std::size_t axis = 2; axis < load.axes.size(); axis += 3)
      load.axes[axis] = -9810 * moving.masses()[axis / 3];
    const Numbers u = rest(load.axes),
                  expected =
                      fit::hyperelastic_statics(m, elements, held, {}, load).displacement.axes;
    EXPECT_GT(largest(expected), 0.5);
    EXPECT_LT(test::largest_difference(u, expected), 1e-5 * largest(expected));
  }
  Numbers small(held.size());
  for (std::size_t axis = 2; axis < small.size(); axis += 3)
    small[axis] = -1e-3 * moving.masses()[axis / 3];
  const linalg::StiffnessMatrix k = fem::solid_stiffness(m, elements, held);
  Numbers expected(held.size());
  linalg::solve_axes(k, linalg::Factor(k, {}), small, expected);
  EXPECT_LT(test::largest_difference(rest(small), expected), 1e-5 * largest(expected));
  // And what holds it carries the load.
  double carried = 0, weight = 0;
  for (std::size_t axis = 2; axis < small.size(); axis += 3) {
    carried += moving.reactions()[axis];
    weight += held[axis] == 0 ? small[axis] : 0;
    if (held[axis] != 0)
      weight += small[axis];
  }
  EXPECT_NEAR(carried, -weight, 1e-5 * std::abs(weight));
}

TEST_P(SolidMotionOf, IsOfFirstOrderAndTheQuickWayGoesWhereTheReferenceDoes) {
  const tetrahedra::TetMesh m = mesh();
  const auto end = [&](int steps, bool reference, double tolerance) {
    integrator::SolidMotionOptions options;
    options.reference = reference;
    options.tolerance = tolerance;
    options.max_rounds = 60;
    options.damping = 1e-4;
    integrator::SolidMotion moving = body(m, options);
    moving.hold(held_end(m));
    Numbers load(3 * m.points.size());
    for (std::size_t axis = 2; axis < load.size(); axis += 3)
      load[axis] = -30000 * moving.masses()[axis / 3];
    moving.set_load(load);
    for (int n = 0; n < steps; ++n)
      (void)moving.step(0.004 / steps, {});
    return moving.displacement();
  };
  const Numbers a = end(8, false, 1e-7), b = end(16, false, 1e-7), c = end(32, false, 1e-7);
  EXPECT_NEAR(test::largest_difference(a, b) / test::largest_difference(b, c), 2, 0.3);
  EXPECT_LT(test::largest_difference(a, end(8, true, 0.1)), 1e-5 * largest(a));
  EXPECT_LT(test::largest_difference(a, end(8, false, integrator::SolidMotionOptions().tolerance)),
            0.02 * largest(a));
}

/// A step in parts from afar: each round whose model holds has less energy than the last one, by
/// tangents or the constant matrix, and rounds end where the reference does.
TEST_P(SolidMotionOf, RoundsOfAStepInPartsLowerTheEnergyToItsLeast) {
  const tetrahedra::TetMesh m = mesh();
  const std::size_t axes = 3 * m.points.size();
  const double h = 0.01;
  Numbers load(axes);
  for (std::size_t i = 0; i < m.points.size(); ++i)
    if (m.points[i].x == 15)
      load[3 * i + 2] = -2.5e4; // bends it by more than its height in a step
  const auto made = [&](bool reference) {
    integrator::SolidMotionOptions options;
    options.reference = reference;
    integrator::SolidMotion moving = body(m, options);
    moving.hold(held_end(m));
    moving.set_load(load);
    return moving;
  };
  integrator::SolidMotion reference = made(true);
  (void)reference.step(h, {});
  for (const bool sharp : {false, true}) {
    integrator::SolidMotion moving = made(false);
    moving.begin_step(h, {});
    const auto energy = [&] {
      double sum = 0;
      const std::span<const double> at = moving.iterate();
      integrator::SolidMotion there = made(false);
      Numbers u(at.begin(), at.end());
      for (std::size_t axis = 0; axis < axes; ++axis) {
        u[axis] -= moving.places()[axis];
        sum += moving.masses()[axis / 3] * u[axis] * u[axis] / (2 * h * h);
      }
      there.set_state(u, Numbers(axes));
      return sum + there.potential_energy();
    };
    const Numbers none(axes);
    Numbers step(axes);
    double before = HUGE_VAL, first = 0, change = HUGE_VAL;
    int rounds = 0, rejected = 0;
    for (; rounds < 200 && change > 1e-6; ++rounds) {
      if (sharp)
        moving.sharpen();
      moving.linearise_step(step, none, {});
      moving.move_iterate(0, none, {});
      if (!moving.model_holds(none, {})) {
        moving.move_iterate(1, none, {});
        ++rejected;
        continue;
      }
      const double now = energy();
      first = rounds == rejected ? std::abs(now) : first;
      EXPECT_LE(now, before + 1e-9 * first) << rounds;
      before = now;
      change = largest(step);
    }
    EXPECT_LT(rounds, sharp ? 40 : 200);
    (void)moving.end_step(none, {});
    EXPECT_LT(test::largest_difference(moving.displacement(), reference.displacement()),
              1e-4 * largest(reference.displacement()))
        << sharp << " " << rounds << " rounds, " << rejected << " rejected";
  }
}

/// As long as matrix_version() is the same, unit_responses() are: behind tangents, steps of another
/// length, and steps without contact in which other nodes are held. And the iterate moves by them.
TEST_P(SolidMotionOf, ResponsesAreTheSameUntilTheMatrixIsAnother) {
  const tetrahedra::TetMesh m = mesh();
  const std::size_t axes = 3 * m.points.size();
  integrator::SolidMotion moving = body(m, {});
  moving.hold(held_end(m));
  Numbers load(axes);
  for (std::size_t i = 0; i < m.points.size(); ++i)
    if (m.points[i].x == 15)
      load[3 * i + 2] = -2e3;
  moving.set_load(load);
  const auto node = static_cast<std::uint32_t>(m.points.size() - 1);
  std::map<std::uint64_t, Numbers> known;
  int repeated = 0;
  const auto round = [&](bool sharp) {
    Numbers step(axes), responses(3 * axes), force(axes);
    if (sharp)
      moving.sharpen();
    moving.linearise_step(step, force, {});
    moving.unit_responses({&node, 1}, responses);
    const auto [found, is_new] = known.emplace(moving.matrix_version(), responses);
    repeated += is_new ? 0 : 1;
    const double size = largest(responses);
    EXPECT_LE(test::largest_difference(found->second, responses), 1e-12 * size);
    // At the node alone, in the frame of space.
    const Numbers before(moving.iterate().begin(), moving.iterate().end());
    force[3 * node] = 1;
    moving.move_iterate(1, force, {});
    const std::array<double, 9> frame = moving.frame_of(node);
    for (std::size_t a = 0; a < 3; ++a) {
      double expected = 0;
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          expected += frame[3 * a + k] * responses[c * axes + 3 * node + k] * frame[c];
      EXPECT_NEAR(moving.iterate()[3 * node + a] - before[3 * node + a],
                  moving.relaxation() * expected, 1e-4 * size);
    }
    moving.move_iterate(0, Numbers(axes), {});
  };
  for (const double h : {0.01, 0.01, 0.005, 0.01, 0.01}) {
    moving.begin_step(h, {});
    round(false);
    round(true);
    round(false);
    (void)moving.end_step(Numbers(axes), {});
  }
  moving.hold(std::vector<std::uint8_t>(axes));
  (void)moving.step(0.01, {});
  for (int k = 0; k < 2; ++k) {
    moving.begin_step(0.01, {});
    round(false);
    round(false);
    (void)moving.end_step(Numbers(axes), {});
  }
  EXPECT_GE(repeated, 3);

  // The model stays until the next one is built.
  Numbers step(axes), before(3 * axes), behind(3 * axes);
  moving.begin_step(0.005, {});
  moving.linearise_step(step, Numbers(axes), {});
  moving.unit_responses({&node, 1}, before);
  moving.sharpen();
  moving.unit_responses({&node, 1}, behind);
  EXPECT_EQ(before, behind);
}

/// Nodes anywhere, elements inside out: all of them turn right again, and lose their energy.
TEST_P(SolidMotionOf, ScrambledBodiesFindBack) {
  const tetrahedra::TetMesh m = mesh(test::box_tetrahedra(2, 1, 1, 5));
  const std::size_t axes = 3 * m.points.size();
  std::mt19937 random(7);
  integrator::SolidMotionOptions options;
  options.max_rounds = 20;
  const bool corotational = GetParam().law == integrator::SolidLaw::corotational;
  const int states = GetParam().quadratic ? (corotational ? 12 : 1) : 40;
  int right = 0;
  for (int n = 0; n < states; ++n) {
    integrator::SolidMotion moving = body(m, options);
    Numbers u = random_numbers(axes, 5, random);
    if (n % 3 == 1) // flat
      for (std::size_t axis = 0; axis < axes; axis += 3)
        u[axis] = -m.points[axis / 3].x;
    if (n % 7 == 2) // nearly a point, which itself is in balance
      for (std::size_t axis = 0; axis < axes; ++axis)
        u[axis] = 1e-4 * u[axis] - m.points[axis / 3][static_cast<int>(axis % 3)];
    moving.set_state(u, Numbers(axes));
    const double first = moving.elastic_energy();
    for (int k = 0; k < 60 && !(moving.elastic_energy() <= 1e-10 * first); ++k)
      (void)moving.step(0.05, {});
    EXPECT_LT(moving.elastic_energy(), 0.2 * first) << n;
    right += test::inverted(m, moving.places()) == 0 ? 1 : 0;
  }
  EXPECT_EQ(right, states);
}

TEST_P(SolidMotionOf, ItsElasticEnergyIsThatOfItsPlaces) {
  const tetrahedra::TetMesh m = mesh();
  std::mt19937 random(4);
  integrator::SolidMotionOptions options;
  options.damping = 0.01;
  integrator::SolidMotion moving = body(m, options);
  moving.set_state(random_numbers(3 * m.points.size(), 0.3, random),
                   random_numbers(3 * m.points.size(), 300, random));
  for (int n = 0; n < 3; ++n) {
    (void)moving.step(0.002, {});
    integrator::SolidMotion standing = body(m);
    standing.set_state(moving.displacement(), Numbers(3 * m.points.size()));
    EXPECT_GT(moving.elastic_energy(), 0);
    EXPECT_NEAR(moving.elastic_energy(), standing.elastic_energy(),
                1e-7 * standing.elastic_energy());
  }
}

TEST_P(SolidMotionOf, SameBytesOnAnyThreadsAndLevel) {
  const tetrahedra::TetMesh m = mesh(test::box_tetrahedra(5, 3, 3, 2));
  const auto end = [&](int threads, CpuLevel cpu) {
    Context context;
    context.threads = threads;
    context.cpu = cpu;
    integrator::SolidMotionOptions options;
    options.damping = 1e-3;
    integrator::SolidMotion moving = body(m, options);
    moving.hold(held_end(m));
    std::mt19937 random(3);
    moving.set_load(random_numbers(3 * m.points.size(), 500, random));
    for (int n = 0; n < 3; ++n)
      (void)moving.step(1.0 / 60, context);
    return moving.displacement();
  };
  const Numbers one = end(1, CpuLevel::baseline);
  EXPECT_EQ(one, end(2, best_cpu_level()));
  EXPECT_EQ(one, end(2, CpuLevel::baseline));
}

TEST_P(SolidMotionOf, HeldNodesAreMovedAndPullTheRest) {
  const tetrahedra::TetMesh m = mesh();
  integrator::SolidMotionOptions options;
  options.tolerance = 1e-6;
  options.max_rounds = 60;
  integrator::SolidMotion moving = body(m, options);
  const std::vector<std::uint8_t> held = held_end(m);
  moving.hold(held);
  Numbers target(held.size());
  for (int n = 1; n <= 10; ++n) {
    for (std::size_t axis = 0; axis < held.size(); axis += 3)
      target[axis] = 0.4 * n;
    moving.move_held(target);
    (void)moving.step(0.01, {});
  }
  for (int n = 0; n < 60; ++n)
    (void)moving.step(0.5, {});
  Numbers expected(held.size());
  for (std::size_t axis = 0; axis < held.size(); axis += 3)
    expected[axis] = 4;
  EXPECT_LT(test::largest_difference(moving.displacement(), expected), 1e-6);
}

/// Secants of earlier steps must not influence the steps after set_state().
TEST_P(SolidMotionOf, SetStateDiscardsTheSecants) {
  const tetrahedra::TetMesh m = mesh();
  integrator::SolidMotion fresh = body(m), used = body(m);
  std::mt19937 random(5);
  const Numbers none(3 * m.points.size()), load = random_numbers(none.size(), 3000, random),
                                           u = random_numbers(none.size(), 0.4, random),
                                           v = random_numbers(none.size(), 200, random);
  used.set_load(load);
  for (int n = 0; n < 6; ++n)
    (void)used.step(0.01, {});
  used.set_load(none);
  for (integrator::SolidMotion* moving : {&fresh, &used}) {
    moving->set_state(u, v);
    for (int n = 0; n < 3; ++n)
      (void)moving->step(0.01, {});
  }
  EXPECT_EQ(fresh.displacement(), used.displacement());
  EXPECT_EQ(energy(fresh), energy(used));
}

INSTANTIATE_TEST_SUITE_P(Laws, SolidMotionOf,
                         testing::Values(Kind{integrator::SolidLaw::corotational, false},
                                         Kind{integrator::SolidLaw::corotational, true},
                                         Kind{integrator::SolidLaw::hyperelastic, false},
                                         Kind{integrator::SolidLaw::hyperelastic, true}),
                         [](const auto& of) { return gewebe::test::name(of.param); });

/// Where a body is pressed so that it wants to buckle, its energy falls faster than straight on,
/// and backward Euler gives a motion that way more than that: h²/2 times the (negative) stiffness
/// times its energy a step. What is added must be taken back.
TEST(SolidMotion, EnergyThatBucklingWouldAddIsTakenBack) {
  const tetrahedra::TetMesh m = test::box_tetrahedra(20, 1, 1, 5);
  integrator::SolidMotionOptions options;
  options.tolerance = 1e-8;
  options.max_rounds = 60;
  integrator::SolidMotion moving(m, std::vector<fem::SolidMaterial>{{2e4, 0, 1e-3}}, options);
  std::vector<std::uint8_t> held;
  Numbers u, v;
  for (const Vec3& p : m.points) {
    const bool end = p.x == 0 || p.x == 100;
    held.insert(held.end(), 3, end ? 1 : 0);
    u.insert(u.end(), {-0.3 * p.x, 0, 0});
    v.insert(v.end(), {0, end ? 0 : 2000 * std::pow(std::sin(std::numbers::pi * p.x / 100), 2), 0});
  }
  moving.hold(held);
  moving.set_state(u, v);
  int limited = 0;
  double before = energy(moving);
  for (int n = 0; n < 10; ++n) {
    limited += moving.step(1e-3, {}).limited ? 1 : 0;
    const double after = energy(moving);
    EXPECT_LE(after, before * (1 + 1e-11)) << n;
    before = after;
  }
  EXPECT_GT(limited, 0);
}

/// Speeds from which the energy is taken that they would add are not those of the body as a whole.
TEST(SolidMotion, UnfinishedStepsKeepTheMomentumOfFreeBodies) {
  const tetrahedra::TetMesh m = test::box_tetrahedra(3, 2, 2, 5);
  integrator::SolidMotionOptions options;
  options.max_rounds = 1;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    integrator::SolidMotion moving(m, std::vector<fem::SolidMaterial>{{2e4, 0.45, 1e-3}}, options);
    Numbers load = random_numbers(3 * m.points.size(), 3e5 * moving.masses()[20], random);
    moving.set_load(load);
    moving.set_state(random_numbers(load.size(), 0.5, random),
                     random_numbers(load.size(), 300, random));
    for (int n = 0; n < 8; ++n) {
      const double h = n % 2 == 0 ? 0.02 : 0.2;
      Vec3 expected = momentum(moving)[0];
      double size = 0;
      for (std::size_t axis = 0; axis < load.size(); ++axis) {
        expected[static_cast<int>(axis % 3)] += h * load[axis];
        size += h * std::abs(load[axis]);
      }
      (void)moving.step(h, {});
      EXPECT_LT(norm(momentum(moving)[0] - expected), 1e-8 * size) << seed << ' ' << n;
    }
  }
}

/// The moment of what a backward Euler step leaves unbalanced is that of no outer force.
TEST(SolidMotion, UnfinishedStepsKeepTheAngularMomentumOfFreeBodies) {
  const tetrahedra::TetMesh m = test::box_tetrahedra(3, 2, 2, 5);
  integrator::SolidMotionOptions options;
  options.max_rounds = 1;
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    integrator::SolidMotion moving(m, std::vector<fem::SolidMaterial>{{2e4, 0.45, 1e-3}}, options);
    Numbers v = random_numbers(3 * m.points.size(), 100, random);
    const Numbers axis = random_numbers(3, 20, random);
    const Vec3 spin{axis[0], axis[1], axis[2]};
    for (std::size_t i = 0; i < m.points.size(); ++i)
      for (int k = 0; k < 3; ++k)
        v[3 * i + static_cast<std::size_t>(k)] += cross(spin, m.points[i])[k];
    moving.set_state(Numbers(v.size()), v);
    for (int n = 0; n < 10; ++n) {
      const Numbers before(moving.velocity().begin(), moving.velocity().end());
      if (moving.step(0.01, {}).limited)
        continue; // other speeds than those of its way
      Vec3 middle, moment;
      double mass = 0, size = 0;
      for (std::size_t i = 0; i < m.points.size(); ++i) {
        middle += moving.masses()[i] * vector_at(moving.places(), i);
        mass += moving.masses()[i];
      }
      for (std::size_t i = 0; i < m.points.size(); ++i) {
        const Vec3 arm = vector_at(moving.places(), i) - middle / mass;
        const Vec3 change =
            moving.masses()[i] * (vector_at(moving.velocity(), i) - vector_at(before, i));
        moment += cross(arm, change);
        size += norm(arm) * norm(change);
      }
      EXPECT_LT(norm(moment), 1e-8 * size) << seed << ' ' << n;
    }
  }
}

struct Swings {
  double frequency, decay; ///< Hz, 1/s
};
/// Of values that cross `middle` several times, the time h between them; decay by the extremes of
/// half swings.
Swings swings(const Numbers& values, double h, double middle) {
  Numbers crossings, extremes;
  double most = 0;
  for (std::size_t n = 1; n < values.size(); ++n) {
    const double a = values[n - 1] - middle, b = values[n] - middle;
    most = test::larger(most, std::abs(b));
    if ((a < 0) == (b < 0))
      continue;
    crossings.push_back(h * (static_cast<double>(n) - b / (b - a)));
    extremes.push_back(most);
    most = 0;
  }
  const std::size_t halves =
      (crossings.size() - 1) / 2 * 2; // whole swings: the middle matters less
  const double time = crossings.at(halves) - crossings.at(0);
  return {static_cast<double>(halves) / (2 * time),
          std::log(extremes.at(1) / extremes.at(halves)) /
              (time * (static_cast<double>(halves) - 1) / static_cast<double>(halves))};
}

TEST_P(SolidMotionOf, SwingsDecayByTheDampingRatio) {
  tetrahedra::TetMesh flat =
      test::box_tetrahedra(4, 1, 1, 5); // so that it swings up and down alone
  for (Vec3& p : flat.points)
    p.y *= 2;
  const tetrahedra::TetMesh m = mesh(flat);
  Numbers load(3 * m.points.size());
  std::size_t tip = 0;
  for (std::size_t i = 0; i < m.points.size(); ++i)
    if (norm(m.points[i] - Vec3{20, 10, 5}) < 1e-9)
      tip = i;
  const auto swing = [&](double damping, double drag, double h) {
    integrator::SolidMotionOptions options;
    options.tolerance = 1e-6;
    options.max_rounds = 40;
    options.damping = damping;
    options.drag = drag;
    integrator::SolidMotion moving = body(m, options);
    moving.hold(held_end(m));
    for (std::size_t axis = 2; axis < load.size(); axis += 3)
      load[axis] = 500 * moving.masses()[axis / 3];
    moving.set_load(load);
    for (int n = 0; n < 8; ++n)
      (void)moving.step(10, {});
    moving.set_state(moving.displacement(), Numbers(load.size()));
    moving.set_load(Numbers(load.size()));
    Numbers height;
    for (int n = 0; n < 260; ++n) {
      (void)moving.step(h, {});
      height.push_back(moving.displacement()[3 * tip + 2]);
    }
    return swings(height, h, 0);
  };
  const double h = 1e-3;
  const Swings alone = swing(0, 0, h); // decays as the integration makes it
  const double omega = 2 * std::numbers::pi * alone.frequency, ratio = 0.05;
  EXPECT_NEAR(alone.decay, omega * omega * h / 2, 0.1 * omega * omega * h / 2);
  EXPECT_NEAR(swing(integrator::damping_per_stiffness(ratio, alone.frequency), 0, h).decay -
                  alone.decay,
              ratio * omega, 0.1 * ratio * omega);
  EXPECT_NEAR(swing(0, 2 * ratio * omega, h).decay - alone.decay, ratio * omega,
              0.1 * ratio * omega);
}

/// The height of a node of a silicone beam that is let go, straight, and falls.
Swings falling_beam(const test::Solid& beam, const Numbers& load, double measured, double middle,
                    double h, int steps) {
  integrator::SolidMotionOptions options;
  options.damping = integrator::damping_per_stiffness(0.02, measured);
  integrator::SolidMotion moving(beam.mesh, beam.materials, options);
  moving.hold(beam.fixed);
  moving.set_load(load);
  const std::size_t node = beam.node_at({100, 0, 30});
  Numbers height;
  for (int n = 0; n < steps; ++n) {
    (void)moving.step(h, {});
    height.push_back(moving.places()[3 * node + 2] - 30);
  }
  return swings(height, h, middle);
}

TEST(SolidMotion, ASiliconeBeamHasItsMeasuredFrequency) {
  const test::SolidCase beam = test::silicone_beam(3, true);
  EXPECT_NEAR(falling_beam(beam.solid, beam.load, 7.76, -6.5, 1.0 / 400, 160).frequency, 7.76,
              0.05 * 7.76);
}

/// The same beam with 52 g on the upper edge of its free end (as test::silicone_beam): there the
/// last elements, of 3 mm, are so much heavier.
TEST(SolidMotion, ALoadedSiliconeBeamHasItsMeasuredFrequency) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(10, 3, 3, 10);
  for (Vec3& p : mesh.points)
    p.x = p.x == 90 ? 97 : p.x;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    double least = HUGE_VAL, up = 0;
    for (const std::uint32_t k : t) {
      least = test::smaller(least, mesh.points[k].x);
      up += mesh.points[k].z / 4;
    }
    mesh.material.push_back(least >= 97 && up > 20 ? 1 : 0);
  }
  const double silicone = 1.07e-3, heavy = silicone + 52 / (3.0 * 30 * 10);
  test::Solid beam{mesh, true, {{263824, 0.499, silicone}, {263824, 0.499, heavy}}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    beam.hold(axis, [](const Vec3& p) { return p.x == 0; });
  const Numbers load =
      fem::gravity_load(beam.mesh, beam.materials, beam.elements, {0, 0, -9807.09});
  EXPECT_NEAR(falling_beam(beam, load, 4.37, -17.3, 1.0 / 300, 190).frequency, 4.37, 0.05 * 4.37);
}

/// The energy is K (V - V₀)²/(2 |V₀|), and the forces are its negative gradient.
TEST(SolidMotion, ForcesOfEnclosedVolumesAreTheEnergyGradient) {
  const TriangleMesh cube = tetrahedra::boundary(test::box_tetrahedra(1, 1, 1, 3)).mesh;
  Numbers rest;
  for (const Vec3& p : cube.points)
    rest.insert(rest.end(), {p.x, p.y, p.z});
  constexpr double bulk = 700;
  integrator::MotionVolumes volumes(cube.triangles, rest, bulk);
  const auto at = [&](const Numbers& places) {
    Numbers forces(places.size());
    return std::pair(volumes.evaluate(places, forces), forces);
  };
  EXPECT_EQ(at(rest).first, 0);
  Numbers wider = rest;
  for (double& x : wider)
    x *= 1.1;
  const double more = 27 * (1.331 - 1);
  EXPECT_NEAR(at(wider).first, bulk * more * more / (2 * 27), 1e-9 * bulk);
  std::mt19937 random(3);
  integrator::add(wider, 1, random_numbers(rest.size(), 0.2, random));
  const Numbers forces = at(wider).second;
  for (std::size_t axis = 0; axis < rest.size(); ++axis) {
    constexpr double step = 1e-5;
    Numbers up = wider, down = wider;
    up[axis] += step;
    down[axis] -= step;
    EXPECT_NEAR(forces[axis], (at(down).first - at(up).first) / (2 * step), 1e-6 * largest(forces));
  }
}

/// The order in which the limiter reduces speeds.
TEST(SolidMotion, EnergyLimitTakesDeformationThenRotationThenTranslation) {
  integrator::MotionBody body;
  const std::vector<Vec3> corners{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  for (const Vec3& p : corners) {
    body.rest.insert(body.rest.end(), {p.x, p.y, p.z});
    body.masses.push_back(2);
    body.drag.push_back(0);
    body.in_elements.push_back(1);
  }
  const Numbers none(body.axes());
  integrator::MotionState state{body.rest, none, none, std::vector<std::uint8_t>(body.axes())};
  Numbers moving = none, turning = none, inner = none;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    moving[3 * i + 2] = 3;              // m/2 v² of all: 36
    turning[3 * i] = -4 * corners[i].y; // about z: 64
    turning[3 * i + 1] = 4 * corners[i].x;
    inner[3 * i] = corners[i].x; // outwards along x: 2
  }
  const auto speeds = [&](double of_inner, double of_turning, double of_moving) {
    Numbers all = none;
    integrator::add(all, of_inner, inner);
    integrator::add(all, of_turning, turning);
    integrator::add(all, of_moving, moving);
    return all;
  };
  const auto limited = [&](double most) {
    state.velocity = speeds(1, 1, 1);
    EXPECT_TRUE(integrator::limit_energy(body, state, 0, most, 0));
    return state.velocity;
  };
  EXPECT_NEAR(integrator::motion_energy(body, speeds(1, 1, 1)), 102, 1e-12);
  EXPECT_LT(test::largest_difference(limited(101), speeds(std::sqrt(0.5), 1, 1)), 1e-12);
  EXPECT_LT(test::largest_difference(limited(84), speeds(0, 0.5 * std::sqrt(3.0), 1)), 1e-12);
  EXPECT_NEAR(integrator::motion_energy(body, state.velocity), 84, 1e-12);
  EXPECT_LT(test::largest_difference(limited(9), speeds(0, 0, 0.5)), 1e-12);
  state.velocity = speeds(1, 1, 1);
  EXPECT_FALSE(integrator::limit_energy(body, state, 0, 102, 1e-9));
  EXPECT_EQ(state.velocity, speeds(1, 1, 1));
}

TEST(SolidMotion, RefusesWhatItCantDo) {
  tetrahedra::TetMesh m = test::box_tetrahedra(1, 1, 1);
  const std::vector<fem::SolidMaterial> materials{{2e4, 0.45, 1e-3}};
  integrator::SolidMotionOptions options;
  options.damping = std::nan("");
  EXPECT_THROW(integrator::SolidMotion(m, materials, options), Error);
  options.damping = 0;
  options.tolerance = 0;
  EXPECT_THROW(integrator::SolidMotion(m, materials, options), Error);
  m.points.push_back({9, 9, 9});
  EXPECT_THROW(integrator::SolidMotion(m, materials, {}), Error);
}

} // namespace
} // namespace gewebe::test
