#include "collision/distance.h"

#include "collision_pairs.h"
#include "larger.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <gtest/gtest.h>
#include <random>
#include <span>
#include <vector>

namespace gewebe::collision {
namespace {

using test::random_pair;
using test::random_point;

double clamped(double t) {
  return t <= 0 ? 0 : t >= 1 ? 1 : t;
}

double to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 e = b - a;
  const double length = dot(e, e);
  return norm(p - a - (length > 0 ? clamped(dot(p - a, e) / length) : 0) * e);
}

/// By the candidates that a closest pair can be: ends against segments, and the common
/// perpendicular where it meets both.
double to_segment(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  double least = std::min(
      {to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b)});
  const Vec3 u = b - a, v = d - c, n = cross(u, v);
  const double square = dot(n, n);
  if (square > 0) {
    const double s = dot(cross(c - a, v), n) / square, t = dot(cross(c - a, u), n) / square;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
      least = test::smaller(least, norm(a + s * u - c - t * v));
  }
  return least;
}

double to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  double least = std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
  const Vec3 n = cross(b - a, c - a);
  if (dot(cross(b - a, p - a), n) >= 0 && dot(cross(c - b, p - b), n) >= 0 &&
      dot(cross(a - c, p - c), n) >= 0 && dot(n, n) > 0)
    least = test::smaller(least, std::abs(dot(p - a, n)) / norm(n));
  return least;
}

TEST(CollisionDistance, IsTheOneOfAllCandidates) {
  std::mt19937 random(1);
  double worst = 0;
  for (int k = 0; k < 40000; ++k) {
    const auto t = random_pair<4>(random);
    const auto e = random_pair<3>(random);
    worst = test::larger(worst, std::abs(std::sqrt(point_triangle_squared_distance(t)) -
                                         to_triangle(t[0], t[1], t[2], t[3])));
    worst = test::larger(worst, std::abs(std::sqrt(edge_edge_squared_distance(t)) -
                                         to_segment(t[0], t[1], t[2], t[3])));
    worst = test::larger(
        worst, std::abs(std::sqrt(point_edge_squared_distance(e)) - to_segment(e[0], e[1], e[2])));
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(CollisionDistance, NearlyParallelEdges) {
  std::mt19937 random(2);
  double worst = 0;
  for (int k = 0; k < 20000; ++k) {
    // Two edges across a gap, turned by a small angle; the crossing is within both.
    const double angle = std::pow(10, -1 - 13 * static_cast<double>(random() % 1000) / 1000),
                 gap = 1e-3;
    const std::array<Vec3, 4> x{{{-5 + random_point(random, 1).x, 0, 0},
                                 {5, 0, 0},
                                 {-5, -5 * angle, gap},
                                 {5 + random_point(random, 1).x, 5 * angle, gap}}};
    worst = test::larger(worst, std::abs(std::sqrt(edge_edge_squared_distance(x)) - gap));
  }
  EXPECT_LT(worst, 1e-12);
}

TEST(CollisionDistance, FeaturesOfEachKind) {
  const auto triangle = [](double px, double py) {
    const std::array<Vec3, 4> x{{{px, py, 1}, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};
    return point_triangle_feature(x);
  };
  using enum DistanceType;
  const auto is = [](DistanceType type, std::uint8_t a, std::uint8_t b, std::uint8_t c = 0,
                     std::uint8_t d = 0) {
    return ClosestFeature{type, {a, b, c, d}};
  };
  EXPECT_EQ(triangle(1, 1), is(point_plane, 0, 1, 2, 3));
  EXPECT_EQ(triangle(-1, -1), is(point_point, 0, 1));
  EXPECT_EQ(triangle(6, 0), is(point_point, 0, 2));
  EXPECT_EQ(triangle(0, 6), is(point_point, 0, 3));
  EXPECT_EQ(triangle(2, -1), is(point_line, 0, 1, 2));
  EXPECT_EQ(triangle(3, 3), is(point_line, 0, 2, 3));
  EXPECT_EQ(triangle(-1, 2), is(point_line, 0, 3, 1));
  const auto edges = [](const Vec3& c, const Vec3& d) {
    const std::array<Vec3, 4> x{{{0, 0, 0}, {4, 0, 0}, c, d}};
    return edge_edge_feature(x);
  };
  EXPECT_EQ(edges({2, -1, 1}, {2, 1, 1}), is(line_line, 0, 1, 2, 3));
  EXPECT_EQ(edges({-2, -1, 1}, {-2, 1, 1}), is(point_line, 0, 2, 3));
  EXPECT_EQ(edges({6, -1, 1}, {6, 1, 1}), is(point_line, 1, 2, 3));
  EXPECT_EQ(edges({2, 1, 1}, {2, 3, 1}), is(point_line, 2, 0, 1));
  EXPECT_EQ(edges({2, -3, 1}, {2, -1, 1}), is(point_line, 3, 0, 1));
  EXPECT_EQ(edges({-1, 1, 1}, {-1, 3, 1}), is(point_point, 0, 2));
  EXPECT_EQ(edges({-1, -3, 1}, {-1, -1, 1}), is(point_point, 0, 3));
  EXPECT_EQ(edges({5, 1, 1}, {5, 3, 1}), is(point_point, 1, 2));
  EXPECT_EQ(edges({5, -3, 1}, {5, -1, 1}), is(point_point, 1, 3));
  // Parallel ones end at a point.
  EXPECT_EQ(edges({6, 0, 1}, {9, 0, 1}), is(point_point, 1, 2));
  EXPECT_EQ(edges({-1, 0, 1}, {9, 0, 1}), is(point_line, 0, 2, 3));
}

TEST(CollisionDistance, DegeneratePrimitives) {
  const Vec3 a{0, 0, 0}, b{2, 0, 0}, c{1, 0, 0}, p{1, 0, 3};
  EXPECT_EQ(point_triangle_squared_distance(std::array{p, a, b, c}), 9); // on a line
  EXPECT_EQ(point_triangle_squared_distance(std::array{p, a, a, a}), 10);
  EXPECT_EQ(edge_edge_squared_distance(std::array{p, p, a, b}), 9);
  EXPECT_EQ(edge_edge_squared_distance(std::array{a, b, p, p}), 9);
  EXPECT_EQ(edge_edge_squared_distance(std::array{p, p, a, a}), 10);
  EXPECT_EQ(edge_edge_squared_distance(std::array{a, b, a, b}), 0);
  EXPECT_EQ(point_edge_squared_distance(std::array{p, b, b}), 10);
}

/// Central differences of f at x, by coordinate.
template <std::size_t n, class F>
std::vector<double> differences(std::array<Vec3, n> x, F&& f) {
  std::vector<double> slope;
  const double h = 1e-5;
  for (Vec3& p : x)
    for (int axis = 0; axis < 3; ++axis) {
      const double old = p[axis];
      p[axis] = old + h;
      const double up = f(x);
      p[axis] = old - h;
      slope.push_back((up - f(x)) / (2 * h));
      p[axis] = old;
    }
  return slope;
}

template <std::size_t n>
void expect_derivatives(const ClosestFeature& feature, const std::array<Vec3, n>& x) {
  const ClosestPoints closest = closest_points(feature, x);
  const auto slope = differences(x, [&](const auto& y) { return squared_distance(feature, y); });
  std::vector<double> hessian(9 * n * n);
  squared_distance_hessian(feature, x, hessian);
  const double scale = 1 + closest.squared_distance;
  Vec3 sum;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 g = squared_distance_gradient(closest, static_cast<int>(i));
    sum += g;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t row = 3 * i + static_cast<std::size_t>(axis);
      EXPECT_NEAR(g[axis], slope[row], 2e-7 * scale);
      const auto second = differences(x, [&](const auto& y) {
        return squared_distance_gradient(closest_points(feature, y), static_cast<int>(i))[axis];
      });
      for (std::size_t column = 0; column < 3 * n; ++column) {
        EXPECT_NEAR(hessian[row * 3 * n + column], second[column], 1e-6 * scale);
        EXPECT_NEAR(hessian[row * 3 * n + column], hessian[column * 3 * n + row], 1e-12 * scale);
      }
    }
  }
  EXPECT_LT(norm(sum), 1e-14 * scale);
}

TEST(CollisionDistance, DerivativesAreThoseOfDifferences) {
  std::mt19937 random(3);
  int seen[4] = {};
  for (int k = 0; k < 300; ++k) {
    std::array<Vec3, 4> x;
    for (Vec3& p : x)
      p = random_point(random, 2);
    const Vec3 n = cross(x[2] - x[1], x[3] - x[1]);
    if (norm(n) < 1 || edge_edge_cross_squared(x) < 1)
      continue;
    for (const ClosestFeature& f : {point_triangle_feature(x), edge_edge_feature(x)}) {
      ++seen[static_cast<int>(f.type)];
      expect_derivatives(f, x);
    }
    const std::array<Vec3, 3> e{x[0], x[1], x[2]};
    if (norm(x[2] - x[1]) > 0.5)
      expect_derivatives(point_edge_feature(e), e);
  }
  for (const int times : seen)
    EXPECT_GT(times, 5);
}

TEST(CollisionDistance, MollifierAndItsDerivatives) {
  std::mt19937 random(4);
  int mollified = 0;
  for (int k = 0; k < 60; ++k) {
    std::array<Vec3, 4> x;
    for (Vec3& p : x)
      p = random_point(random, 2);
    const double eps_x = k % 2 == 0 ? 2 * edge_edge_cross_squared(x) : 20.0;
    std::array<Vec3, 4> gradient, other;
    std::array<double, 144> hessian{};
    const double value = edge_edge_mollifier_hessian(x, eps_x, gradient, hessian);
    EXPECT_EQ(value, edge_edge_mollifier(x, eps_x));
    mollified += value < 1;
    const auto slope = differences(x, [&](const auto& y) { return edge_edge_mollifier(y, eps_x); });
    for (std::size_t row = 0; row < 12; ++row) {
      const int axis = static_cast<int>(row % 3);
      EXPECT_NEAR(gradient[row / 3][axis], slope[row], 1e-6 * (1 + std::abs(slope[row])));
      const auto second = differences(x, [&](const auto& y) {
        edge_edge_mollifier_gradient(y, eps_x, other);
        return other[row / 3][axis];
      });
      for (std::size_t column = 0; column < 12; ++column)
        EXPECT_NEAR(hessian[12 * row + column], second[column],
                    1e-5 * (1 + std::abs(second[column])));
    }
  }
  EXPECT_GT(mollified, 25);
  const std::array<Vec3, 4> rest{{{0, 0, 0}, {2, 0, 0}, {0, 0, 1}, {0, 3, 1}}};
  EXPECT_DOUBLE_EQ(edge_edge_mollifier_threshold(rest), 0.036);
}

} // namespace
} // namespace gewebe::collision
