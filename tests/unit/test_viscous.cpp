// Viscoelastic solids against the exact response of their Prony series: held and loaded blocks at
// rest and in motion, energy, states taken back; the words that name a series.

#include "base/error.h"
#include "dynamics/solid_law.h"
#include "dynamics/solid_static.h"
#include "fem/assembly.h"
#include "fem/hyperelastic.h"
#include "fem/solid_model.h"
#include "hyperelastic_laws.h"
#include "integrator/solid_motion.h"
#include "larger.h"
#include "model/material_table.h"
#include "model/prony.h"
#include "tests/unit/viscous_block.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

const std::vector<model::PronyTerm> two_terms{{0.3, 0.2}, {0.25, 2}};

/// What is left of a sudden stress.
double left_of(std::span<const model::PronyTerm> terms, double t) {
  double left = 1;
  for (const model::PronyTerm& term : terms)
    left -= term.share * (1 - std::exp(-t / term.time));
  return left;
}

std::vector<model::HyperelasticLaw> laws() {
  return {test::stable_neo_hookean, model::parse_law("mooney-rivlin:c01=0.2"),
          model::parse_law("yeoh:c20=0.1,c30=0.02"),
          model::parse_law("ogden:alpha1=5,alpha2=-2,mu2=0.3")};
}

TEST(ViscousLaw, ForcesAndTangentsAreDerivatives) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const model::HyperelasticLaw& law : laws()) {
    fem::SolidElement e = fem::solid_element(
        {Vec3{0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0}, {0, 0.3, 1.1}}, fem::elasticity(1e3, 0.4));
    e.law = law;
    std::vector<fem::SymmetricTensor> stress(24);
    for (fem::SymmetricTensor& a : stress)
      for (double& value : a)
        value = 100 * any(random);
    e.memory = {0.7, stress};
    std::array<Vec3, 10> u;
    for (Vec3& v : u)
      v = {0.05 * any(random), 0.05 * any(random), 0.05 * any(random)};
    const Vec3 bubble{0.01, -0.02, 0.01};
    fem::HyperelasticResponse here, more, less;
    fem::hyperelastic_response(e, u, bubble, fem::HyperelasticPart::tangent, here);
    constexpr double d = 1e-6;
    double off = 0;
    for (std::size_t a = 0; a < 10; ++a)
      for (int i = 0; i < 3; ++i) {
        std::array<Vec3, 10> v = u;
        v[a][i] += d;
        fem::hyperelastic_response(e, v, bubble, fem::HyperelasticPart::force, more);
        v[a][i] -= 2 * d;
        fem::hyperelastic_response(e, v, bubble, fem::HyperelasticPart::force, less);
        EXPECT_NEAR((less.energy - more.energy) / (2 * d), here.force[a][i], 1e-4);
        for (std::size_t b = 0; b < 11; ++b)
          for (int j = 0; j < 3; ++j)
            off =
                test::larger(off, std::abs((less.force[b][j] - more.force[b][j]) / (2 * d) -
                                           here.tangent[33 * (3 * b + static_cast<std::size_t>(j)) +
                                                        3 * a + static_cast<std::size_t>(i)]));
      }
    EXPECT_LT(off, 1e-3);
  }
}

TEST(ViscousSolid, AHeldStretchRelaxesAsItsSeries) {
  for (const model::HyperelasticLaw& law : laws()) {
    test::ViscousBlock block(two_terms, law, 0.4999);
    block.stretch(1.3);
    (void)block.motion.settle({});
    const double sudden = block.pull();
    double t = 0;
    // Steps of any length: the strain stays.
    for (const double h : {0.05, 0.2, 0.75, 4.0}) {
      block.stretch(1.3);
      const integrator::SolidStep step = block.motion.settle({}, h);
      EXPECT_LT(step.left, 1e-6);
      t += h;
      EXPECT_NEAR(block.pull() / sudden, left_of(two_terms, t), 1e-3) << model::law_text(law) << t;
    }
    block.stretch(1.3);
    (void)block.motion.settle({}, 1e4);
    EXPECT_NEAR(block.pull() / sudden, 0.45, 1e-3);
  }
}

TEST(ViscousSolid, AHeldStretchRelaxesInMotion) {
  for (const double h : {0.02, 0.1}) {
    test::ViscousBlock block(two_terms, model::parse_law("yeoh:c20=0.1"), 0.499);
    block.stretch(1.3);
    (void)block.motion.settle({});
    const double sudden = block.pull();
    const int steps = static_cast<int>(std::lround(0.6 / h));
    double before = block.motion.elastic_energy();
    for (int k = 0; k < steps; ++k) {
      (void)block.motion.step(h, {});
      EXPECT_TRUE(block.motion.fades());
      EXPECT_LT(block.motion.elastic_energy(), before);
      before = block.motion.elastic_energy();
    }
    EXPECT_NEAR(block.pull() / sudden, left_of(two_terms, 0.6), 1e-3) << h;
  }
}

/// Strain of a small load, over the sudden one: the standard linear solid, incompressible.
double crept(const model::PronyTerm& term, double t) {
  const double rest = 1 - term.share;
  return 1 + term.share / rest * (1 - std::exp(-t * rest / term.time));
}

TEST(ViscousSolid, CreepsAtRestAsTheStandardLinearSolid) {
  const model::PronyTerm term{0.6, 0.5};
  const test::ViscousModel block({&term, 1}, test::stable_neo_hookean, 0.4999);
  const contact::Load load = block.pulled(1);
  for (const int parts : {1, 4}) {
    dynamics::SolidStatic solid(block.model, integrator::SolidLaw::hyperelastic, {});
    solid.update(load, {0, 0});
    const double sudden = block.extension(solid.displacement());
    for (int k = 1; k <= parts; ++k) {
      const double t = 3.0 * k / parts;
      solid.update(load, {0, t});
      EXPECT_NEAR(block.extension(solid.displacement()) / (sudden * crept(term, t)), 1, 1e-3) << t;
    }
    // At once and then for the whole time, as a scene has it.
    dynamics::SolidStatic other(block.model, integrator::SolidLaw::hyperelastic, {});
    other.update(load, {0, 3});
    EXPECT_NEAR(block.extension(other.displacement()) / (sudden * crept(term, 3)), 1, 1e-3);
    // Long after, what is left is elastic.
    other.update(load, {0, 1e5});
    EXPECT_NEAR(0.4 * block.extension(other.displacement()) / sudden, 1, 1e-3);
  }
}

/// Stretch of an incompressible bar of `mu` under a dead stress at time t: W = mu/2 (I1 - 3), one
/// term; the integral by its definition in small steps.
double crept_stretch(double mu, double stress, const model::PronyTerm& term, double end) {
  constexpr int steps = 4000;
  const double h = end / steps;
  const auto deviatoric = [&](double s) {
    const double i = s * s + 2 / s;
    return std::array<double, 2>{mu * (1 - i / (3 * s * s)), mu * (1 - i * s / 3)};
  };
  std::array<double, 2> history{}, before{};
  double stretch = 1;
  for (int k = 0; k <= steps; ++k) {
    const double fade = k == 0 ? 1 : std::exp(-h / term.time),
                 half = k == 0 ? 1 : std::exp(-h / 2 / term.time);
    const auto off = [&](double s) {
      const std::array<double, 2> d = deviatoric(s);
      std::array<double, 2> all{};
      for (std::size_t a = 0; a < 2; ++a)
        all[a] =
            (1 - term.share) * d[a] + fade * history[a] + term.share * half * (d[a] - before[a]);
      return s * all[0] - all[1] / (s * s) - stress;
    };
    double low = 0.5, high = 6;
    for (int n = 0; n < 60; ++n)
      (off((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
    stretch = low;
    const std::array<double, 2> d = deviatoric(stretch);
    for (std::size_t a = 0; a < 2; ++a)
      history[a] = fade * history[a] + term.share * half * (d[a] - before[a]);
    before = d;
  }
  return stretch;
}

TEST(ViscousSolid, CreepsAtRestUnderLargeStrains) {
  const model::PronyTerm term{0.4, 0.5};
  const test::ViscousModel block({&term, 1}, model::parse_law("yeoh"), 0.4999);
  const double mu = test::viscous_young / (2 * 1.4999), stress = 0.8 * mu;
  dynamics::SolidStatic solid(block.model, integrator::SolidLaw::hyperelastic, {});
  const contact::Load load = block.pulled(stress);
  for (const double t : {0.25, 1.0, 4.0}) {
    solid.update(load, {0, t});
    const double expected = crept_stretch(mu, stress, term, t) - 1;
    EXPECT_NEAR(block.extension(solid.displacement()) / expected, 1, 1e-3) << t;
  }
}

TEST(ViscousSolid, CreepsInMotionAtSeveralSteps) {
  const model::PronyTerm term{0.6, 0.5};
  for (const double h : {1.0 / 800, 1.0 / 1600}) {
    test::ViscousBlock block({{term}}, test::stable_neo_hookean, 0.499, 1e-6);
    const std::vector<double> forces = block.of.forces(1);
    block.motion.set_load(forces);
    block.motion.hold(block.of.rollers());
    const double elastic = 1 / test::viscous_young;
    const int steps = static_cast<int>(std::lround(0.5 / h));
    for (int k = 0; k < steps; ++k)
      (void)block.motion.step(h, {});
    EXPECT_NEAR(block.of.extension(block.motion.displacement()) / elastic, crept(term, 0.5), 1e-3)
        << h;
  }
}

TEST(ViscousSolid, AGradualLoadIsFollowed) {
  const model::PronyTerm term{0.6, 0.5};
  const test::ViscousModel block({&term, 1}, test::stable_neo_hookean, 0.4999);
  dynamics::SolidStatic sudden(block.model, integrator::SolidLaw::hyperelastic, {}),
      gradual(block.model, integrator::SolidLaw::hyperelastic, {});
  const contact::Load load = block.pulled(1);
  gradual.update(load, {0, 1, true});
  sudden.update(load, {0, 1});
  const double elastic = 1 / test::viscous_young, rest = 1 - term.share, slow = term.time / rest;
  // The integral of what a sudden load has crept to.
  const double mean = 1 + term.share / rest * (1 - slow * (1 - std::exp(-1 / slow)));
  EXPECT_NEAR(block.extension(gradual.displacement()) / elastic, mean, 2e-3);
  EXPECT_GT(block.extension(sudden.displacement()), block.extension(gradual.displacement()));
}

TEST(ViscousSolid, EnergyOnlyFalls) {
  for (const int order : {1, 2}) {
    tetrahedra::TetMesh mesh = test::box_tetrahedra(6, 1, 1, 5);
    if (order == 2)
      tetrahedra::make_quadratic(mesh);
    const model::PronyTerm term{0.5, 0.05};
    const std::vector<fem::SolidMaterial> materials{
        {1e4, 0.45, 1e-3, test::stable_neo_hookean, {&term, 1}}};
    integrator::SolidMotionOptions options;
    options.law = integrator::SolidLaw::hyperelastic;
    options.tolerance = 1e-6;
    integrator::SolidMotion motion(mesh, materials, options);
    std::vector<std::uint8_t> held(3 * mesh.points.size());
    std::vector<double> velocity(held.size());
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      for (std::size_t a = 0; a < 3; ++a)
        held[3 * i + a] = mesh.points[i].x == 0 ? 1 : 0;
      velocity[3 * i + 2] = 10 * mesh.points[i].x;
    }
    motion.hold(held);
    motion.set_state(std::vector<double>(held.size()), velocity);
    const double first = motion.kinetic_energy();
    double before = first;
    for (int k = 0; k < 40; ++k) {
      (void)motion.step(0.004, {});
      const double now = motion.kinetic_energy() + motion.elastic_energy();
      EXPECT_LT(now, before + 1e-9 * first) << k;
      before = now;
    }
    EXPECT_LT(before, 0.9 * first);
  }
}

TEST(ViscousSolid, GoesBackToTheBit) {
  test::ViscousBlock block(two_terms, model::parse_law("yeoh:c20=0.1"), 0.45, 1e-3);
  block.motion.hold(block.of.rollers());
  block.motion.set_load(block.of.forces(2000));
  const auto run = [&] {
    for (int k = 0; k < 4; ++k)
      (void)block.motion.step(0.01, {});
    return std::vector<double>(block.motion.places().begin(), block.motion.places().end());
  };
  (void)run();
  const std::vector<double> places(block.motion.places().begin(), block.motion.places().end()),
      velocity(block.motion.velocity().begin(), block.motion.velocity().end());
  const auto past = block.motion.past();
  const double energy = block.motion.elastic_energy();
  const std::vector<double> first = run();
  block.motion.restore(places, velocity, block.of.rollers(), *past, {});
  EXPECT_EQ(block.motion.elastic_energy(), energy);
  EXPECT_EQ(run(), first);
  // Without what it remembers it goes elsewhere.
  block.motion.restore(places, velocity, block.of.rollers(), *past, {});
  block.motion.set_memory({});
  EXPECT_NE(run(), first);
}

TEST(ViscousSolid, AnAnswerGoesBackToTheBit) {
  const test::ViscousModel block(two_terms, model::parse_law("yeoh"), 0.45);
  dynamics::SolidStatic solid(block.model, integrator::SolidLaw::hyperelastic, {});
  const contact::Load load = block.pulled(2000);
  solid.update(load, {0, 0.5});
  const auto answer = solid.answer();
  const auto later = [&] {
    solid.update(load, {0, 2});
    return std::vector<double>(solid.displacement().begin(), solid.displacement().end());
  };
  const std::vector<double> first = later();
  solid.restore(answer);
  EXPECT_EQ(later(), first);
}

TEST(Prony, WordsAreReadAndWritten) {
  const std::vector<model::PronyTerm> terms = model::parse_prony("prony:0.3@0.5,0.2@10");
  EXPECT_EQ(terms, (std::vector<model::PronyTerm>{{0.3, 0.5}, {0.2, 10}}));
  EXPECT_EQ(model::prony_text(terms), "prony:0.3@0.5,0.2@10");
  const std::array<const char*, 9> wrong{
      "prony",         "prony:",    "prony:0.3",         "prony:0.3@",
      "prony:x@1",     "prony:0@1", "prony:0.6@1,0.5@2", "prony:0.1@2,0.1@1",
      "prony:0.1@1e-9"};
  for (const char* word : wrong)
    EXPECT_THROW((void)model::parse_prony(word), Error) << word;
  const auto table = model::parse_material_table("a 1 1 1 1 0.4 yeoh prony:0.5@1\nb 1 1 1 1 0.4 "
                                                 "prony:0.5@1\nc 1 1 1 1 0.4 yeoh\n",
                                                 "t");
  EXPECT_EQ(table[0].prony.size(), 1U);
  EXPECT_TRUE(table[0].law.has_value());
  EXPECT_EQ(table[1].prony.size(), 1U);
  EXPECT_FALSE(table[1].law.has_value());
  EXPECT_TRUE(table[2].prony.empty());
  EXPECT_THROW((void)model::parse_material_table("a 1 1 1 1 0.4 prony:0.5@1 yeoh", "t"), Error);
}

TEST(Prony, LawsOfSmallStrainsAreRefused) {
  const test::ViscousModel block(two_terms, test::stable_neo_hookean, 0.45);
  EXPECT_EQ(dynamics::law_of(block.model, std::nullopt), integrator::SolidLaw::hyperelastic);
  EXPECT_THROW((void)dynamics::law_of(block.model, integrator::SolidLaw::corotational), Error);
}

} // namespace
} // namespace gewebe::test
