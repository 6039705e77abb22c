// Corotational elements: by finite differences, against small strains at rest, turned, flat and
// inverted; and the same bytes everywhere.

#include "base/cpu.h"
#include "fem/assembly.h"
#include "fem/corotational.h"
#include "tests/unit/larger.h"
#include "tests/unit/relative_difference.h"
#include "tet_fixtures.h"
#include "tetrahedra/order.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace gewebe::test {
namespace {

struct Body {
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidMaterial> materials{{2500, 0.45, 1e-3}};
  std::vector<fem::SolidElement> elements;
  fem::CorotationalSolid solid;

  explicit Body(bool quadratic, tetrahedra::TetMesh of = test::distorted_box())
      : mesh(made(std::move(of), quadratic)), elements(fem::solid_elements(mesh, materials)),
        solid(mesh, elements) {}
  static tetrahedra::TetMesh made(tetrahedra::TetMesh of, bool quadratic) {
    if (quadratic)
      tetrahedra::make_quadratic(of);
    return of;
  }
  std::vector<double> rest() const {
    std::vector<double> x;
    for (const Vec3& p : mesh.points)
      x.insert(x.end(), {p.x, p.y, p.z});
    return x;
  }
  double energy(const std::vector<double>& x, const fem::CorotationalWeights& weights = {},
                const Context& context = {}) {
    std::vector<double> forces(x.size());
    return solid.evaluate(x, weights, forces, context);
  }
  std::vector<double> forces(const std::vector<double>& x,
                             const fem::CorotationalWeights& weights = {},
                             const Context& context = {}) {
    std::vector<double> result(x.size());
    (void)solid.evaluate(x, weights, result, context);
    return result;
  }
};

std::vector<double> moved(std::vector<double> x, double by, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shift(-by, by);
  for (double& value : x)
    value += shift(random);
  return x;
}

/// Turned about an axis askew.
std::vector<double> turned(std::vector<double> x, double angle) {
  const Vec3 n{2.0 / 7, 3.0 / 7, 6.0 / 7};
  for (std::size_t i = 0; i + 2 < x.size(); i += 3) {
    const Vec3 p{x[i], x[i + 1], x[i + 2]};
    const Vec3 q = p * std::cos(angle) + cross(n, p) * std::sin(angle) +
                   n * (dot(n, p) * (1 - std::cos(angle)));
    x[i] = q.x;
    x[i + 1] = q.y;
    x[i + 2] = q.z;
  }
  return x;
}

double largest(const std::vector<double>& a) {
  double most = 0;
  for (const double value : a)
    most = test::larger(most, std::abs(value));
  return most;
}
class Corotational : public testing::TestWithParam<bool> {};

TEST_P(Corotational, ForcesAreTheDerivativeOfTheEnergy) {
  Body body(GetParam());
  const std::vector<double> x = moved(turned(body.rest(), 0.8), 0.1, 1);
  (void)body.energy(moved(body.rest(), 0.05, 2));
  body.solid.remember();
  const fem::CorotationalWeights weights{0.7, 0.4};
  const std::vector<double> forces = body.forces(x, weights);
  std::mt19937 random(3);
  for (int n = 0; n < 20; ++n) {
    const std::vector<double> direction =
        moved(std::vector<double>(x.size()), 1, static_cast<unsigned>(random()));
    double slope = 0, found = 0;
    for (std::size_t k = 0; k < x.size(); ++k)
      slope -= forces[k] * direction[k];
    const auto at = [&](double s) {
      std::vector<double> there = x;
      for (std::size_t k = 0; k < x.size(); ++k)
        there[k] += s * direction[k];
      return body.energy(there, weights);
    };
    const double h = 1e-4;
    found = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    EXPECT_NEAR(found, slope, 1e-7 * largest(forces) * 10);
  }
}

TEST_P(Corotational, TangentAtRestIsThatOfSmallStrains) {
  Body body(GetParam());
  const std::vector<double> rest = body.rest();
  EXPECT_LT(largest(body.forces(rest)), 1e-11);
  const std::vector<double> u = moved(std::vector<double>(rest.size()), 1, 4);
  std::vector<double> linear(rest.size()), plus = rest, minus = rest;
  fem::multiply_solid(body.mesh, body.elements, u, linear);
  const double h = 1e-5;
  for (std::size_t k = 0; k < rest.size(); ++k) {
    plus[k] += h * u[k];
    minus[k] -= h * u[k];
  }
  std::vector<double> found = body.forces(minus);
  const std::vector<double> other = body.forces(plus);
  for (std::size_t k = 0; k < rest.size(); ++k)
    found[k] = (found[k] - other[k]) / (2 * h);
  EXPECT_LT(test::largest_difference(found, linear), 1e-7 * largest(linear));
}

TEST_P(Corotational, TurnedBodiesFeelNothingAndForcesHaveNoSumOrMoment) {
  Body body(GetParam());
  const std::vector<double> rest = body.rest(), bent = moved(rest, 0.1, 5);
  const double scale = largest(body.forces(bent)), energy = body.energy(bent);
  for (const double angle : {0.1, 1.5, 3.0}) {
    EXPECT_LT(largest(body.forces(turned(rest, angle))), 1e-11 * scale);
    EXPECT_NEAR(body.energy(turned(bent, angle)), energy, 1e-12 * energy);
  }
  body.solid.remember(); // of a turned body: strains, which don't turn
  EXPECT_LT(body.energy(bent, {0, 1}), 1e-20 * energy);
  const std::vector<double> x = moved(turned(bent, 0.4), 0.1, 6), forces = body.forces(x, {1, 3});
  Vec3 sum, moment;
  for (std::size_t i = 0; i + 2 < x.size(); i += 3) {
    const Vec3 f{forces[i], forces[i + 1], forces[i + 2]};
    sum += f;
    moment += cross({x[i], x[i + 1], x[i + 2]}, f);
  }
  EXPECT_LT(norm(sum), 1e-11 * largest(forces));
  EXPECT_LT(norm(moment), 1e-10 * largest(forces));
}

/// The energy of a linear element by another way to R: the stretches of F by their squares, signed.
TEST(CorotationalElement, FlatAndInvertedElementsHaveTheNearestRotation) {
  tetrahedra::TetMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  Body body(false, mesh);
  const auto [lambda, mu] = body.elements[0].material;
  for (const auto& [a, b, c] : {std::array{1.0, 1.0, 1.0},
                                {1.0, 1.0, 0.0},
                                {1.0, 1.0, -0.2},
                                {1.3, 0.8, -0.8},
                                {1.0, 1.0, -1.0},
                                {0.0, 0.0, 0.0},
                                {1.0, 0.0, 0.0},
                                {2.0, 1e-9, -1e-9},
                                {1e-8, 2e-8, 3e-8},
                                {3.0, 0.5, -0.4}}) {
    // F = diag(a, b, c), turned; its signed stretches have |c| the least.
    std::vector<double> x = body.rest();
    x[3] = a;
    x[7] = b;
    x[11] = c;
    x = turned(x, 1.1);
    const double volume = body.elements[0].volume, trace = a + b + c - 3,
                 squares = (a - 1) * (a - 1) + (b - 1) * (b - 1) + (c - 1) * (c - 1),
                 expected = volume * (mu * squares + lambda / 2 * trace * trace);
    const std::vector<double> forces = body.forces(x);
    EXPECT_NEAR(body.energy(x), expected, 1e-9 * volume * mu) << a << " " << b << " " << c;
    EXPECT_LT(largest(forces), 100 * (lambda + mu) * volume);
    const fem::SolidBlock r = body.solid.frame(0).rotation;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        EXPECT_NEAR(r[i] * r[j] + r[3 + i] * r[3 + j] + r[6 + i] * r[6 + j], i == j ? 1 : 0, 1e-9);
    EXPECT_GT(r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                  r[2] * (r[3] * r[7] - r[4] * r[6]),
              0.5);
  }
}

TEST_P(Corotational, SameBytesOnAnyThreadsAndLevel) {
  Body body(GetParam(), test::box_tetrahedra(9, 8, 7, 0.3));
  for (const double by : {0.01, 0.5}) { // the second one scrambles
    const std::vector<double> x = moved(turned(body.rest(), 0.5), by, 8);
    const auto all = [&](int threads, CpuLevel cpu) {
      Context context;
      context.threads = threads;
      context.cpu = cpu;
      std::vector<double> found = body.forces(x, {1, 0.3}, context),
                          rotations(9 * body.mesh.points.size());
      body.solid.node_rotations(rotations, context);
      found.insert(found.end(), rotations.begin(), rotations.end());
      found.push_back(body.energy(x, {1, 0.3}, context));
      return found;
    };
    const std::vector<double> one = all(1, CpuLevel::baseline);
    EXPECT_EQ(one, all(2, CpuLevel::baseline));
    EXPECT_EQ(one, all(1, best_cpu_level()));
    EXPECT_EQ(one, all(2, best_cpu_level()));
  }
}

TEST_P(Corotational, RotationsOfNodesFollowTheBody) {
  Body body(GetParam());
  (void)body.forces(turned(body.rest(), 0.7));
  std::vector<double> r(9 * body.mesh.points.size());
  body.solid.node_rotations(r, {});
  const std::vector<double> x{1, 0, 0, 0, 1, 0, 0, 0, 1}, y = turned(x, 0.7); // columns of R
  for (std::size_t i = 0; i < body.mesh.points.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        EXPECT_NEAR(r[9 * i + 3 * a + b], y[3 * b + a], 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Order, Corotational, testing::Values(false, true),
                         [](const auto& of) { return of.param ? "quadratic" : "linear"; });

} // namespace
} // namespace gewebe::test
