// Solids against answers from elsewhere: order of convergence, beams, Cook's membrane, NAFEMS LE10.

#include "fem/assembly.h"
#include "tests/unit/solid_bodies.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::test {
namespace {

double wave_error(std::uint32_t n, bool quadratic, double poisson) {
  return figure(test::waves(n, quadratic, poisson));
}

TEST(SolidValidation, DisplacementsConvergeWithOrders2And3) {
  for (const double poisson : {0.0, 0.3, 0.499}) {
    const double coarse = wave_error(3, true, poisson), fine = wave_error(6, true, poisson);
    const double order = std::log2(coarse / fine);
    EXPECT_GE(order, 2.8) << poisson;
    EXPECT_LE(order, 3.5) << poisson;
  }
  const double coarse = wave_error(4, false, 0.3), fine = wave_error(8, false, 0.3);
  const double order = std::log2(coarse / fine);
  EXPECT_GE(order, 1.8);
  EXPECT_LE(order, 2.5);
}

struct Beam {
  double droop = 0;
  std::size_t unknowns = 0;
};
Beam beam(bool quadratic, double poisson, std::uint32_t across) {
  const test::SolidCase c = test::slender_beam(quadratic, poisson, across);
  return {figure(c), c.solid.unknowns()};
}

TEST(SolidValidation, SlenderBeamDroopsAsTimoshenkosWhereQuadratic) {
  const Beam tissue = beam(true, 0.3, 2), silicone = beam(true, 0.499, 2);
  EXPECT_EQ(tissue.unknowns, 6000U);
  EXPECT_NEAR(tissue.droop, 1, 0.01);
  // Where the end is held it can't thicken either, which Timoshenko leaves out.
  EXPECT_NEAR(silicone.droop, 1, 0.025);
  // With as many linear elements' nodes: too stiff in bending, and locked.
  const Beam linear = beam(false, 0.3, 4), locked = beam(false, 0.499, 4);
  EXPECT_EQ(locked.unknowns, 6000U);
  EXPECT_LT(linear.droop, 0.85);
  EXPECT_GT(linear.droop, 0.5);
  EXPECT_LT(locked.droop, 0.1);
}

double cooks_rise(std::uint32_t n, bool quadratic) {
  return figure(test::cooks_membrane(n, quadratic));
}

TEST(SolidValidation, CooksMembraneDoesNotLock) {
  const double expected = test::cooks_rise;
  EXPECT_NEAR(cooks_rise(8, true), expected, 0.045 * expected);
  EXPECT_NEAR(cooks_rise(28, true), expected, 0.01 * expected);
  EXPECT_LT(cooks_rise(16, false), 0.4 * expected);
}

TEST(SolidValidation, NafemsLe10) {
  const test::SolidCase plate = test::le10(12, 16, 2, true);
  EXPECT_EQ(plate.solid.unknowns(), 11772U);
  EXPECT_NEAR(figure(plate), test::le10_stress, 0.01 * 5.38);
}

// Small strains leave out that the beam turns.
TEST(SolidValidation, ASiliconeBeamDroopsAsMeasured) {
  const auto droops = [&](bool quadratic) {
    const test::SolidCase beam = test::silicone_beam(6, quadratic);
    const std::vector<double> u = displacements(beam);
    std::array<double, 3> result{};
    for (std::size_t n = 0; n < 3; ++n)
      result[n] = -u[3 * beam.solid.node_at(test::silicone_markers[n].place) + 2];
    return result;
  };
  const std::array<double, 3> droop = droops(true), locked = droops(false);
  double mean = 0, measured = 0;
  for (std::size_t n = 0; n < 3; ++n) {
    const double expected = test::silicone_markers[n].droop;
    EXPECT_NEAR(droop[n], expected, 0.08 * expected) << n;
    EXPECT_LT(locked[n], 0.25 * expected) << n;
    mean += droop[n] / 3;
    measured += expected / 3;
  }
  EXPECT_NEAR(mean, measured, 0.04 * measured);
  EXPECT_NEAR(droop[1], 6.75, 0.01 * 6.75); // COMSOL
}

} // namespace
} // namespace gewebe::test
