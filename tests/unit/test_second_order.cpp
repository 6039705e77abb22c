// Steps of second order: closed forms of mechanics, the order that is observed, energy, momentum,
// contact.

#include "geometry/vector_at.h"
#include "integrator/solid_motion.h"
#include "larger.h"
#include "numeric/two_stages.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using Numbers = std::vector<double>;
using integrator::SolidMotion;
using numeric::Stage;

constexpr double gravity = 9810;

/// A step of h s under a load that depends on time.
using LoadAt = std::function<Numbers(double)>;
void step(SolidMotion& body, double from, double h, int order, const LoadAt& load) {
  if (order == 1) {
    body.set_load(load(from + h));
    (void)body.step(h, {});
    return;
  }
  const double part = numeric::stage_length * h;
  body.set_load(load(from + part));
  (void)body.step(part, {}, Stage::first);
  ASSERT_TRUE(body.has_first_stage(part));
  body.set_load(load(from + h));
  (void)body.step(part, {}, Stage::second);
}

/// Nodes of 2 g without elements, and springs between them.
SolidMotion net(const std::vector<Vec3>& nodes, const std::vector<integrator::SolidSpring>& springs,
                double drag = 0) {
  tetrahedra::TetMesh mesh;
  mesh.points = nodes;
  const Numbers masses(nodes.size(), 2), drags(nodes.size(), drag);
  integrator::SolidMotionOptions options;
  options.tolerance = 1e-12;
  options.max_rounds = 200;
  return {mesh, std::vector<fem::SolidMaterial>{}, {springs, masses, drags}, options};
}

/// Errors at half the step are so many times smaller.
void expect_order(double order, double coarse, double fine) {
  EXPECT_NEAR(std::log2(coarse / fine), order, 0.15) << coarse << " and " << fine;
}

TEST(SecondOrder, FreeFlightIsTheParabola) {
  SolidMotion body(box_tetrahedra(2, 1, 1, 5), std::vector<fem::SolidMaterial>{{2e4, 0.45, 1e-3}},
                   {});
  const std::size_t axes = body.places().size();
  Numbers weight(axes), v(axes);
  for (std::size_t i = 0; i < axes / 3; ++i) {
    weight[3 * i + 2] = -gravity * body.masses()[i];
    v[3 * i] = 300;
    v[3 * i + 2] = 500;
  }
  body.set_state(Numbers(axes), v);
  const double h = 1.0 / 60;
  for (int n = 0; n < 12; ++n)
    step(body, n * h, h, 2, [&](double) { return weight; });
  const double t = 12 * h;
  const Numbers u = body.displacement();
  for (std::size_t i = 0; i < axes / 3; ++i) {
    EXPECT_NEAR(u[3 * i], 300 * t, 1e-9);
    EXPECT_NEAR(u[3 * i + 2], 500 * t - gravity * t * t / 2, 1e-9);
    EXPECT_NEAR(body.velocity()[3 * i + 2], 500 - gravity * t, 1e-8);
  }
}

/// A mass on a spring with a damper, along its axis: x'' + 2 a x' + w² x = f/m.
struct Oscillator {
  double stiffness = 8000, damping = 0, drag = 0;
  double pushed = 0; ///< mm/s², times the time

  double rate() const { return damping / 4 + drag / 2; }
  double frequency() const { return std::sqrt(stiffness / 2 - rate() * rate()); }
  /// From 3 mm at rest.
  double at(double t) const {
    const double a = rate(), w = frequency(), all = stiffness / 2;
    const double slope = pushed / all, offset = -slope * 2 * a / all;
    const double x0 = 3 - offset, v0 = -slope;
    return offset + slope * t +
           std::exp(-a * t) * (x0 * std::cos(w * t) + (v0 + a * x0) / w * std::sin(w * t));
  }
  double error(double h, int order) const {
    SolidMotion body = net({{0, 0, 0}, {20, 0, 0}}, {{0, 1, stiffness, damping, 20}}, drag);
    body.hold(std::vector<std::uint8_t>{1, 1, 1, 0, 0, 0});
    body.set_state(Numbers{0, 0, 0, 3, 0, 0}, Numbers(6));
    const double end = 0.24;
    const int count = static_cast<int>(std::lround(end / h));
    for (int n = 0; n < count; ++n)
      step(body, n * h, h, order, [&](double t) { return Numbers{0, 0, 0, 2 * pushed * t, 0, 0}; });
    return std::abs(body.displacement()[3] - at(end));
  }
};

TEST(SecondOrder, AnOscillatorConvergesToItsClosedForm) {
  for (const Oscillator& one :
       {Oscillator{}, Oscillator{.damping = 12}, Oscillator{.drag = 5}, Oscillator{.pushed = 4e4},
        Oscillator{.damping = 12, .drag = 5, .pushed = 4e4}}) {
    expect_order(2, one.error(0.001, 2), one.error(0.0005, 2));
    EXPECT_LT(5 * one.error(0.001, 2), one.error(0.0005, 1)) << "of equal cost";
  }
}

/// Amplitudes of z' = i w z are multiplied by |R(i w h)|, R(z) = (1 + (1 - 2 g) z)/(1 - g z)².
TEST(SecondOrder, AmplitudesDecayByTheStabilityFunction) {
  const double h = 0.002, w = std::sqrt(4000.0), z = w * h, g = numeric::stage_length;
  SolidMotion body = net({{0, 0, 0}, {20, 0, 0}}, {{0, 1, 8000, 0, 20}});
  body.hold(std::vector<std::uint8_t>{1, 1, 1, 0, 0, 0});
  body.set_state(Numbers{0, 0, 0, 3, 0, 0}, Numbers(6));
  const double before = body.kinetic_energy() + body.elastic_energy();
  for (int n = 0; n < 50; ++n)
    step(body, n * h, h, 2, [](double) { return Numbers(6); });
  const double ratio =
      (1 + (1 - 2 * g) * (1 - 2 * g) * z * z) / ((1 + g * g * z * z) * (1 + g * g * z * z));
  EXPECT_NEAR((body.kinetic_energy() + body.elastic_energy()) / before, std::pow(ratio, 50), 1e-9);
}

/// Two masses at a stiff spring that turn about each other.
TEST(SecondOrder, ATurningRodConverges) {
  const auto turned = [](double h, int order) {
    SolidMotion body = net({{-10, 0, 0}, {10, 0, 0}}, {{0, 1, 2e6, 0, 20 - 8000 / 2e6}});
    body.set_state(Numbers(6), Numbers{0, -200, 0, 0, 200, 0});
    const int count = static_cast<int>(std::lround(0.1 / h));
    for (int n = 0; n < count; ++n)
      step(body, n * h, h, order, [](double) { return Numbers(6); });
    return Vec3{body.places()[3], body.places()[4], body.places()[5]};
  };
  const Vec3 exact = 10 * Vec3{std::cos(2.0), std::sin(2.0), 0};
  const double coarse = norm(turned(0.002, 2) - exact), fine = norm(turned(0.001, 2) - exact);
  EXPECT_GT(coarse / fine, 3.4);
  EXPECT_LT(coarse, 0.1 * norm(turned(0.001, 1) - exact));
}

/// A bar held at an end, let go from a bent shape; by three steps.
class SecondOrderOf : public testing::TestWithParam<integrator::SolidLaw> {};

Numbers bent_bar(double h, int order, integrator::SolidLaw law, bool viscous, double damping) {
  tetrahedra::TetMesh mesh = box_tetrahedra(4, 1, 1, 5);
  static const std::vector<model::PronyTerm> terms{{0.4, 0.02}};
  fem::SolidMaterial gel{2e4, 0.4, 1e-3};
  if (viscous)
    gel.prony = terms;
  integrator::SolidMotionOptions options;
  options.law = law;
  options.damping = damping;
  options.tolerance = 1e-9;
  options.max_rounds = 400;
  SolidMotion body(mesh, std::vector<fem::SolidMaterial>{gel}, options);
  std::vector<std::uint8_t> held;
  Numbers v;
  for (const Vec3& p : mesh.points) {
    held.insert(held.end(), 3, p.x == 0 ? 1 : 0);
    v.insert(v.end(), {0, 0, 0.8 * p.x * p.x});
  }
  body.hold(held);
  body.set_state(Numbers(v.size()), v);
  const int count = static_cast<int>(std::lround(0.032 / h));
  for (int n = 0; n < count; ++n)
    step(body, n * h, h, order, [&](double) { return Numbers(v.size()); });
  return body.displacement();
}

double distance(const Numbers& a, const Numbers& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

TEST_P(SecondOrderOf, ABarVibratesWithErrorsOfSecondOrder) {
  const bool hyperelastic = GetParam() == integrator::SolidLaw::hyperelastic;
  struct Kind {
    bool viscous;
    double damping;
  };
  for (const auto& [viscous, damping] : {Kind{false, 0}, Kind{false, 1e-3}, Kind{true, 0}}) {
    if (viscous && !hyperelastic)
      continue;
    std::array<Numbers, 3> at;
    double h = 1.25e-4;
    for (Numbers& one : at) {
      one = bent_bar(h, 2, GetParam(), viscous, damping);
      h /= 2;
    }
    const double ratio = distance(at[0], at[1]) / distance(at[1], at[2]);
    EXPECT_NEAR(std::log2(ratio), 2, 0.25) << viscous << " " << damping;
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, SecondOrderOf,
                         testing::Values(integrator::SolidLaw::corotational,
                                         integrator::SolidLaw::hyperelastic));

TEST(SecondOrder, EnergyNeverGrowsAndMomentumStays) {
  for (const bool held : {false, true})
    for (const double h : {1e-4, 2e-3, 1.0 / 60, 0.3}) {
      tetrahedra::TetMesh mesh = distorted_box();
      integrator::SolidMotionOptions options;
      if (held)
        options.max_rounds = 2; // unfinished steps as well
      SolidMotion body(mesh, std::vector<fem::SolidMaterial>{{2e4, 0.45, 1e-3}}, options);
      std::vector<std::uint8_t> axes;
      Numbers v;
      for (const Vec3& p : mesh.points) {
        axes.insert(axes.end(), 3, held && p.x == 0 ? 1 : 0);
        const Vec3 speed{40 * p.y * p.z - 100, 30 * p.x, 200 - 20 * p.x * p.y};
        for (int a = 0; a < 3; ++a)
          v.push_back(axes.back() != 0 ? 0 : speed[a]);
      }
      body.hold(axes);
      body.set_state(Numbers(v.size()), v);
      const auto momentum = [&] {
        Vec3 sum;
        for (std::size_t i = 0; i < body.masses().size(); ++i)
          sum += body.masses()[i] * vector_at(body.velocity(), i);
        return sum;
      };
      const Vec3 first = momentum();
      double before = body.kinetic_energy() + body.elastic_energy();
      const double scale = before;
      for (int n = 0; n < 40; ++n) {
        step(body, n * h, h, 2, [&](double) { return Numbers(v.size()); });
        const double now = body.kinetic_energy() + body.elastic_energy();
        ASSERT_LE(now, before + 1e-10 * scale) << "step " << n << " of " << h;
        before = now;
        if (!held && h < 0.1) {
          ASSERT_LE(norm(momentum() - first), 1e-12 * norm(first)) << n << " of " << h;
        }
      }
    }
}

/// What has been done since is gone when an earlier state comes back.
TEST(SecondOrder, RollbackIsExact) {
  const auto start = [] {
    tetrahedra::TetMesh mesh = distorted_box();
    integrator::SolidMotionOptions options;
    options.damping = 1e-3;
    SolidMotion body(mesh, std::vector<fem::SolidMaterial>{{2e4, 0.45, 1e-3}}, options);
    Numbers v;
    for (const Vec3& p : mesh.points)
      v.insert(v.end(), {40 * p.y, 30 * p.x, -20 * p.x * p.y});
    body.set_state(Numbers(v.size()), v);
    return body;
  };
  SolidMotion one = start(), other = start();
  const auto load = [&](double) { return Numbers(one.places().size()); };
  for (int n = 0; n < 6; ++n)
    for (SolidMotion* const body : {&one, &other})
      step(*body, 0, 0.004, 2, load);
  const auto past = other.past();
  const Numbers places(other.places().begin(), other.places().end()),
      speeds(other.velocity().begin(), other.velocity().end());
  step(other, 0, 0.004, 2, load);
  (void)other.step(numeric::stage_length * 0.004, {}, Stage::first);
  other.restore(places, speeds, std::vector<std::uint8_t>(places.size()), *past, {});
  for (int n = 0; n < 3; ++n)
    for (SolidMotion* const body : {&one, &other})
      step(*body, 0, 0.004, 2, load);
  EXPECT_EQ(Numbers(one.places().begin(), one.places().end()),
            Numbers(other.places().begin(), other.places().end()));
}

// ---- contact

double mass_of(const scene::Simulation& s, std::size_t object) {
  return weight_of(s, object) / gravity;
}

Vec3 centre(const scene::Simulation& s, std::size_t object) {
  Vec3 sum;
  const std::vector<double> u = shape(s, object);
  for (std::size_t i = 0; i < s.model(object).nodes.size(); ++i)
    sum += s.model(object).nodes[i].mass * (s.model(object).nodes[i].position + vector_at(u, i));
  return sum / mass_of(s, object);
}

model::Model without_drag(model::Model model) {
  for (model::Node& n : model.nodes)
    n.drag = 0;
  return model;
}

/// How high a block rebounds over the height that it was dropped from, by the speed of its middle,
/// and the largest growth of energy in a step over its energy.
struct Rebound {
  double height = 0, growth = 0;
};
Rebound dropped(double h, int order, double height, std::uint32_t layers) {
  scene::Simulation s(one_thread(), {});
  add(s, "below", block(3, 3, 1, {-2, -2, -block_edge}, true));
  const model::Model ball = without_drag(block(2, 2, layers, {0.3, 0.2, height}));
  add(s, "ball", ball);
  s.apply(scene::SetContact{0, 1, 0});
  s.apply(scene::SetTimestep{h, order});
  s.apply(scene::SetGravity{{0, 0, -gravity}});
  const double weight = weight_of(s, 1), first = centre(s, 1).z;
  const auto energy = [&] {
    const scene::SimulationState state = s.state();
    return state.kinetic_energy + state.elastic_energy + weight * (centre(s, 1).z - first + height);
  };
  const double all = energy();
  double before = all, last = centre(s, 1).z;
  Rebound found;
  bool touched = false;
  const int count = static_cast<int>(std::lround(0.13 / h));
  for (int n = 0; n < count; ++n) {
    s.step(h);
    const double now = energy(), z = centre(s, 1).z;
    found.growth = larger(found.growth, (now - before) / all);
    before = now;
    touched = touched || norm(sum_of_forces(s, 1)) > 0;
    const double speed = (z - last) / h;
    if (touched && speed > 0)
      found.height = larger(found.height, speed * speed / (2 * gravity * height));
    last = z;
  }
  return found;
}

/// Backward Euler rebounds to 0.02, 0.09, 0.23 and 0.52.
TEST(SecondOrderContact, ADroppedBlockRebounds) {
  for (const double rate : {300.0, 600.0, 1200.0, 4800.0}) {
    const Rebound r = dropped(1 / rate, 2, 20, 4);
    EXPECT_GT(r.height, 0.55) << rate;
    EXPECT_LT(r.height, 0.8) << rate;
    EXPECT_LT(r.growth, 0.005) << rate; // barriers give back what they have stored
  }
  EXPECT_LT(dropped(1.0 / 600, 1, 20, 4).height, 0.15);
}

/// Two free blocks that collide within a step: forces sum to zero, and momentum stays.
TEST(SecondOrderContact, CollidingBlocksKeepTheirMomentum) {
  scene::Simulation s(one_thread(), {});
  const double h = 1.0 / 600, speed = 1500;
  const model::Model above = without_drag(block(2, 2, 2, {1.3, 1.1, 2 * block_edge + 1.5}));
  add(s, "below", without_drag(block(3, 3, 2, {})));
  add(s, "above", above);
  s.apply(scene::SetContact{0, 1, 0.3});
  s.apply(scene::SetTimestep{h, 2});
  for (std::uint32_t i = 0; i < above.nodes.size(); ++i)
    s.apply(scene::SetForce{1, {i}, {100, 0, -speed / h * above.nodes[i].mass}});
  s.step(h);
  s.apply(scene::Release{1, nodes_of(above)});
  double pushed = 0;
  const auto both = [&] { return mass_of(s, 0) * centre(s, 0) + mass_of(s, 1) * centre(s, 1); };
  Vec3 at = both(), way;
  const auto energy = [&] { return s.state().kinetic_energy + s.state().elastic_energy; };
  double before = energy();
  const double scale = before;
  for (int n = 0; n < 30; ++n) {
    s.step(h);
    const Vec3 force = sum_of_forces(s, 1);
    pushed = larger(pushed, norm(force));
    EXPECT_LE(norm(force + sum_of_forces(s, 0)), 1e-12 * pushed) << n;
    EXPECT_GT(least_gap(s, 0, 1), 0) << n;
    EXPECT_LE(energy(), before + 1e-3 * scale) << n;
    before = energy();
    const Vec3 going = way, there = both();
    way = there - at;
    at = there;
    if (n > 0) {
      EXPECT_LE(norm(way - going), 1e-9 * norm(way)) << n;
    }
  }
  EXPECT_GT(pushed, 0);
}

/// A block on a slope, by gravity that is tilted: without friction it slides by g sin/2 t², with
/// enough of it it creeps with no more than the stick speed.
TEST(SecondOrderContact, ABlockOnASlope) {
  for (const double friction : {0.0, 0.8}) {
    scene::Simulation s(one_thread(), {});
    const double h = 1.0 / 600, along = 2000;
    add(s, "below", block(5, 3, 1, {-4, -2, -block_edge}, true));
    add(s, "above", without_drag(block(1, 1, 1, {0.3, 0.2, 0.002})));
    s.apply(scene::SetContact{0, 1, friction});
    s.apply(scene::SetTimestep{h, 2});
    s.apply(scene::SetGravity{{friction > 0 ? along : 0, 0, -gravity}});
    for (int n = 0; n < 90; ++n)
      s.step(h);
    const Vec3 rests = centre(s, 1);
    s.apply(scene::SetGravity{{along, 0, -gravity}});
    for (int n = 0; n < 36; ++n)
      s.step(h);
    const double t = 36 * h, slid = centre(s, 1).x - rests.x;
    if (friction > 0) {
      EXPECT_LE(std::abs(slid), 0.1 * t);
    } else {
      EXPECT_NEAR(slid, along * t * t / 2, 0.02 * along * t * t / 2);
    }
    EXPECT_NEAR(centre(s, 1).z, rests.z, 0.02);
  }
}

/// Explicit steps are refused.
TEST(SecondOrderContact, ExplicitNetsAreRefusedByName) {
  scene::Simulation s(one_thread(), {});
  model::Model model = block(1, 1, 1, {});
  model.tetrahedra.clear();
  model.tetrahedron_material.clear();
  model.springs.push_back({0, 1, model::SpringKind::edge, 100, 0, block_edge});
  s.add_object("net", model, scene::Method::ela, {}, scene::Integration::semi_implicit);
  s.apply(scene::SetTimestep{1e-4, 2});
  s.apply(scene::SetGravity{{0, 0, -gravity}});
  try {
    s.step(1e-3);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("object net: moves by explicit steps"),
              std::string::npos)
        << error.what();
  }
}

} // namespace
} // namespace gewebe::test
