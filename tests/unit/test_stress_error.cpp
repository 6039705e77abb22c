// Estimated errors of linear solids.

#include "fem/stress_error.h"
#include "tests/unit/solid_bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace gewebe::test {

namespace {

fem::StressError error_of(const test::SolidCase& c, const std::vector<double>& u, int threads = 1) {
  Context context;
  context.threads = threads;
  return fem::stress_error(
      c.solid.mesh, c.solid.elements,
      fem::solid_stresses(c.solid.elements,
                          fem::solid_strains(c.solid.mesh, c.solid.materials, c.solid.elements, u)),
      context);
}

double sum(const std::vector<double>& of) {
  return std::accumulate(of.begin(), of.end(), 0.0);
}

double energy(const test::SolidCase& c, const std::vector<double>& u) {
  std::vector<double> force(u.size());
  fem::multiply_solid(c.solid.mesh, c.solid.elements, u, force);
  return std::inner_product(u.begin(), u.end(), force.begin(), 0.0);
}

/// A block between two clamped ends of which one is moved.
test::SolidCase sheared_block(std::uint32_t n, bool quadratic, double poisson) {
  test::SolidCase c{
      {test::box_tetrahedra(2 * n, n, n, 10.0 / n), quadratic, {{1e4, poisson, 1e-3}}}, {}, {}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [](const Vec3& p) { return p.x == 0 || p.x > 20 - 1e-6; });
  c.load.resize(c.solid.fixed.size());
  for (const Vec3& p : c.solid.mesh.points)
    for (const double way : {1.0, 0.5, 0.0})
      c.given.push_back(p.x > 10 ? way : 0);
  return c;
}

} // namespace

TEST(StressError, ConstantStressHasNone) {
  for (const bool quadratic : {false, true}) {
    const test::SolidCase c = test::patch(quadratic, 0.45);
    const std::vector<double> u = displacements(c);
    const fem::StressError error = error_of(c, u);
    EXPECT_LT(sum(error.energy), 1e-20 * energy(c, u));
    EXPECT_EQ(error.at_node.size(), c.solid.mesh.points.size());
  }
}

TEST(StressError, OfClampedBlocksIsWithinAFactorOfTwo) {
  for (const double poisson : {0.3, 0.49}) {
    // Energies of quadratic elements on 4, 8 and 16 cells, extrapolated: 53337 and 56588.
    const double exact = poisson == 0.3 ? 53337 : 56588;
    for (const bool quadratic : {false, true})
      for (const std::uint32_t n : {2U, 4U}) {
        const test::SolidCase c = sheared_block(n, quadratic, poisson);
        const std::vector<double> u = displacements(c);
        const double truth = energy(c, u) - exact; // given displacements: too stiff
        const double estimated = sum(error_of(c, u).energy);
        EXPECT_GT(truth, 0);
        EXPECT_GT(estimated, 0.5 * truth) << poisson << ' ' << quadratic << ' ' << n;
        EXPECT_LT(estimated, 2 * truth) << poisson << ' ' << quadratic << ' ' << n;
      }
  }
}

TEST(StressError, IsLargestAtClampedEdges) {
  const test::SolidCase c = sheared_block(4, true, 0.45);
  const fem::StressError error = error_of(c, displacements(c));
  const auto at = static_cast<std::size_t>(
      std::max_element(error.at_node.begin(), error.at_node.end()) - error.at_node.begin());
  const Vec3& p = c.solid.mesh.points[at];
  EXPECT_LT(test::smaller(p.x, 20 - p.x), 2.6);
}

TEST(StressError, StressesJumpBetweenMaterialsWithoutError) {
  // Two bars side by side under the same tension: strains are equal, stresses are not.
  test::SolidCase c{
      {test::box_tetrahedra(4, 2, 2, 5), true, {{1e4, 0, 1e-3}, {3e4, 0, 1e-3}}}, {}, {}, {}};
  for (const Tetrahedron& t : c.solid.mesh.tetrahedra) {
    double y = 0;
    for (const std::uint32_t corner : t)
      y += c.solid.mesh.points[corner].y / 4;
    c.solid.mesh.material.push_back(y > 5 ? 1 : 0);
  }
  c.solid.elements = fem::solid_elements(c.solid.mesh, c.solid.materials);
  std::vector<double> u;
  for (const Vec3& p : c.solid.mesh.points)
    u.insert(u.end(), {p.x / 100, 0, 0});
  const fem::StressError error = error_of(c, u);
  EXPECT_LT(sum(error.energy), 1e-20 * energy(c, u));
}

TEST(StressError, SameBytesOnAnyThreads) {
  const test::SolidCase c = sheared_block(4, true, 0.45);
  const std::vector<double> u = displacements(c);
  const fem::StressError one = error_of(c, u, 1), two = error_of(c, u, 2);
  EXPECT_EQ(one.energy, two.energy);
  EXPECT_EQ(one.at_node, two.at_node);
}

} // namespace gewebe::test
