// The exact predicates against rational arithmetic.

#include "geometry/exact_predicates.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <random>

namespace {

using gewebe::Vec3;

int rational_turn(const gewebe::Vec3& a, const gewebe::Vec3& b, const gewebe::Vec3& c) {
  const mpq_class ax(a.x), ay(a.y), bx(b.x), by(b.y), cx(c.x), cy(c.y);
  const mpq_class det = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
  return sgn(det);
}

int rational_side(const gewebe::Vec3& a, const gewebe::Vec3& b, const gewebe::Vec3& c,
                  const gewebe::Vec3& q) {
  const mpq_class ax(a.x), ay(a.y), az(a.z);
  const mpq_class ux = mpq_class(b.x) - ax, uy = mpq_class(b.y) - ay, uz = mpq_class(b.z) - az;
  const mpq_class vx = mpq_class(c.x) - ax, vy = mpq_class(c.y) - ay, vz = mpq_class(c.z) - az;
  const mpq_class wx = mpq_class(q.x) - ax, wy = mpq_class(q.y) - ay, wz = mpq_class(q.z) - az;
  const mpq_class det =
      (uy * vz - uz * vy) * wx + (uz * vx - ux * vz) * wy + (ux * vy - uy * vx) * wz;
  return sgn(det);
}

int turn(const gewebe::Vec3& a, const gewebe::Vec3& b, const gewebe::Vec3& c,
         std::uint64_t& exact) {
  return gewebe::turn_sign(a.x, a.y, b.x, b.y, c.x, c.y, exact);
}

/// Coordinates of any magnitude that the predicates take.
double wild(std::mt19937_64& random) {
  std::uniform_real_distribution<double> mantissa(-2, 2);
  std::uniform_int_distribution<int> exponent(-190, 30);
  return std::ldexp(mantissa(random), exponent(random));
}

TEST(Predicates, SimpleCasesAndTies) {
  std::uint64_t exact = 0;
  EXPECT_EQ(turn({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, exact), 1);
  EXPECT_EQ(turn({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, exact), -1);
  EXPECT_EQ(turn({0, 0, 0}, {1, 1, 0}, {3, 3, 0}, exact), 0);
  EXPECT_EQ(gewebe::side_sign({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, exact), 1);
  EXPECT_EQ(gewebe::side_sign({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, exact), -1);
  EXPECT_EQ(gewebe::side_sign({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 7, 0}, exact), 0);
  EXPECT_EQ(gewebe::predicate_coordinate(1e-80), 0.0);
  EXPECT_EQ(gewebe::predicate_coordinate(-1e-50), -1e-50);
}

TEST(Predicates, TurnAgreesWithRationalsNearALine) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::uniform_int_distribution<int> nudge(-2, 2);
  std::uint64_t exact = 0;
  int naive_wrong = 0;
  for (int n = 0; n < 20000; ++n) {
    const double scale = std::ldexp(1.0, static_cast<int>(random() % 25));
    const gewebe::Vec3 a{scale * unit(random), scale * unit(random), 0};
    const gewebe::Vec3 b{scale * unit(random), scale * unit(random), 0};
    const double t = unit(random);
    gewebe::Vec3 c{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), 0};
    for (int s = nudge(random); s > 0; --s)
      c.y = std::nextafter(c.y, 1e30);
    const int expected = rational_turn(a, b, c);
    ASSERT_EQ(turn(a, b, c, exact), expected);
    ASSERT_EQ(turn(b, a, c, exact), -expected);
    const double det = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    naive_wrong += ((det > 0) - (det < 0)) != expected;
  }
  EXPECT_GT(exact, 1000u);
  EXPECT_GT(naive_wrong, 100) << "the inputs are too easy to prove anything";
}

TEST(Predicates, SideAgreesWithRationalsNearAPlane) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::uint64_t exact = 0;
  int zeros = 0, naive_wrong = 0;
  for (int n = 0; n < 10000; ++n) {
    // Integer query points, as the voxelizer has them, close to the triangle's plane.
    const double scale = std::ldexp(1.0, static_cast<int>(random() % 20));
    const auto point = [&] {
      gewebe::Vec3 p{scale * unit(random), scale * unit(random), scale * unit(random)};
      if (n % 3 == 0)
        p = {std::round(p.x), std::round(p.y), std::round(p.z)};
      return p;
    };
    const gewebe::Vec3 a = point(), b = point();
    gewebe::Vec3 c = point();
    const gewebe::Vec3 q{std::round(scale * unit(random)), std::round(scale * unit(random)),
                         std::round(scale * unit(random))};
    const double s = unit(random), t = unit(random);
    c = q + s * (a - q) + t * (b - q);
    if (n % 7 == 0)
      c = a + 2.0 * (q - a);
    const int expected = rational_side(a, b, c, q);
    zeros += expected == 0;
    ASSERT_EQ(gewebe::side_sign(a, b, c, q, exact), expected);
    ASSERT_EQ(gewebe::side_sign(b, a, c, q, exact), -expected);
    const double det = gewebe::dot(gewebe::cross(b - a, c - a), q - a);
    naive_wrong += ((det > 0) - (det < 0)) != expected;
  }
  EXPECT_GT(exact, 1000u);
  EXPECT_GT(zeros, 100);
  EXPECT_GT(naive_wrong, 100);
}

TEST(Predicates, AnyMagnitude) {
  std::mt19937_64 random(3);
  std::uint64_t exact = 0;
  for (int n = 0; n < 5000; ++n) {
    const auto point = [&] { return gewebe::Vec3{wild(random), wild(random), wild(random)}; };
    const gewebe::Vec3 a = point(), b = point(), q = point();
    const gewebe::Vec3 c = n % 2 == 0 ? point() : gewebe::Vec3{a.x + b.x, a.y + b.y, a.z + b.z};
    const auto small = [](const gewebe::Vec3& p) {
      return gewebe::Vec3{gewebe::predicate_coordinate(p.x), gewebe::predicate_coordinate(p.y),
                          gewebe::predicate_coordinate(p.z)};
    };
    const gewebe::Vec3 d = small(c);
    ASSERT_EQ(turn(a, b, d, exact), rational_turn(a, b, d));
    ASSERT_EQ(gewebe::side_sign(a, b, d, q, exact), rational_side(a, b, d, q));
  }
}

} // namespace
