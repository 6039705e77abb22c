// Ambient occlusion: cases that can be written down, and rays counted one by one.

#include "larger.h"
#include "mesh_fixtures.h"
#include "shading/drawing.h"
#include "shading/occlusion.h"
#include "shading/tangents.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace gewebe::test {
namespace {

std::vector<float> openness_of(const TriangleMesh& mesh, const std::vector<Vec3>& normals,
                               double radius, unsigned threads = 0) {
  const std::vector<shading::Occluder> one{{mesh.points, normals, mesh.triangles}};
  Context context;
  context.threads = static_cast<int>(threads);
  return shading::openness(one, radius, context)[0];
}

TEST(Occlusion, NothingHidesAConvexBody) {
  const TriangleMesh ball = test::sphere_mesh(3, 30, {100, -20, 7});
  for (const float open : openness_of(ball, shading::render_normals(ball), 100))
    EXPECT_EQ(open, 1.0F);
}

// From e above the inside of a sphere a ray at the angle a from the normal, cos a = c, runs
// (r - e) c + √(r² - (r - e)² (1 - c²)); with e = 0 and a large radius the openness were 4 r / 3 R.
double inside_a_sphere(double r, double radius) {
  const double below = r - shading::occlusion_lift * radius;
  constexpr int steps = 20000;
  double open = 0;
  for (int n = 0; n < steps; ++n) {
    const double square = (n + 0.5) / steps; // of c, which has the weight 2 c
    const double chord =
        below * std::sqrt(square) + std::sqrt(r * r - below * below * (1 - square));
    open += test::smaller(chord / radius, 1.0) / steps;
  }
  return open;
}

TEST(Occlusion, InsideASphere) {
  const double r = 30;
  const TriangleMesh ball = test::sphere_mesh(4, r, {5, 6, 7});
  std::vector<Vec3> inwards = shading::render_normals(ball);
  for (Vec3& n : inwards)
    n = n * -1.0;
  EXPECT_NEAR(inside_a_sphere(r, 3 * r), 4.0 / 9, 0.02);
  for (const double radius : {r, 2 * r, 5 * r})
    for (const float open : openness_of(ball, inwards, radius))
      EXPECT_NEAR(static_cast<double>(open), inside_a_sphere(r, radius), 0.003);
}

// A sliver that is folded over beside a point hides nothing.
TEST(Occlusion, AFoldHidesNothing) {
  TriangleMesh m;
  m.points = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {-10, -10, 0}, {5, 0.1, 0.05}};
  m.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 4}};
  std::vector<Vec3> up(m.points.size(), Vec3{0, 0, 1});
  EXPECT_EQ(openness_of(m, up, 20)[0], 1.0F);
  for (const Vec3& p : {Vec3{2, -5, 0}, {2, 5, 0}, {2, 0, 6}}) { // a wall
    m.points.push_back(p);
    up.push_back({0, 0, 1});
  }
  m.triangles.push_back({5, 6, 7});
  EXPECT_LT(openness_of(m, up, 20)[0], 0.97F);
}

// A wall without end beside a floor hides what looks towards it.
TEST(Occlusion, FloorBeforeAWall) {
  TriangleMesh m;
  const double far = 1e4, d = 2, radius = 9;
  m.points = {{d, -far, -far}, {d, far, -far}, {d, far, far}, {d, -far, far},
              {0, 0, 0},       {0, 1, 0},      {-1, 0, 0}};
  m.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}};
  const std::vector<Vec3> up(m.points.size(), Vec3{0, 0, 1});
  double hidden = 0;
  constexpr int steps = 1500;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const double sine = std::sqrt((i + 0.5) / steps);
      const double along = sine * std::cos(2 * std::numbers::pi * (j + 0.5) / steps);
      hidden += along > 0 ? std::max(0.0, 1 - d / along / radius) : 0;
    }
  EXPECT_NEAR(static_cast<double>(openness_of(m, up, radius)[4]),
              1 - hidden / (1.0 * steps * steps), 0.01);
}

TriangleMesh scattered(std::size_t count, std::vector<Vec3>& normals) {
  std::mt19937 random(3);
  const auto unit = [&] { return static_cast<double>(random()) / 4294967296.0; };
  TriangleMesh m;
  for (std::uint32_t n = 0; n < count; ++n) {
    const Vec3 at{20 * unit(), 20 * unit(), n % 3 == 0 ? 5.0 : 20 * unit()};
    for (int c = 0; c < 3; ++c) // some of them across an axis
      m.points.push_back(at + Vec3{4 * unit(), 4 * unit(), n % 3 == 0 ? 0 : 4 * unit()});
    m.triangles.push_back({3 * n, 3 * n + 1, 3 * n + 2});
    for (int c = 0; c < 3; ++c) {
      const Vec3 v{unit() - 0.5, unit() - 0.5, unit() - 0.5};
      normals.push_back(n % 5 == 0 ? Vec3{0, 0, n % 2 == 0 ? 1.0 : -1.0} : v / norm(v));
    }
  }
  return m;
}

/// By many more rays, each held against all triangles by the volumes that it makes with their
/// edges.
double counted(const TriangleMesh& m, std::size_t p, const Vec3& n, double radius) {
  std::mt19937 random(static_cast<std::mt19937::result_type>(p));
  const auto unit = [&] { return static_cast<double>(random()) / 4294967296.0; };
  const Vec3 from = m.points[p] + n * (0.01 * radius);
  double hidden = 0;
  constexpr int rays = 3000;
  for (int k = 0; k < rays; ++k) {
    Vec3 along; // on a sphere that touches the point: distributed as the cosine
    do
      along = {2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1};
    while (!(norm(along) <= 1 && norm(along) > 0.01));
    along = n + along / norm(along);
    along = along / norm(along);
    double nearest = radius;
    for (const auto& [i, j, l] : m.triangles) {
      const Vec3 a = m.points[i] - from, b = m.points[j] - from, c = m.points[l] - from;
      const double u = dot(along, cross(a, b)), v = dot(along, cross(b, c)),
                   w = dot(along, cross(c, a)), sum = u + v + w;
      if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) || sum == 0)
        continue;
      const double t = dot(a, cross(b, c)) / sum;
      if (t > 0)
        nearest = test::smaller(nearest, t);
    }
    hidden += 1 - nearest / radius;
  }
  return 1 - hidden / rays;
}

TEST(Occlusion, AsRaysCountedOneByOne) {
  std::vector<Vec3> normals;
  const TriangleMesh m = scattered(200, normals);
  const double radius = 8;
  const std::vector<float> found = openness_of(m, normals, radius);
  double largest = 0, sum = 0, least = 1;
  for (std::size_t p = 0; p < m.points.size(); p += 5) {
    const double error =
        std::fabs(static_cast<double>(found[p]) - counted(m, p, normals[p], radius));
    largest = test::larger(largest, error);
    sum += error;
    least = test::smaller(least, static_cast<double>(found[p]));
  }
  RecordProperty("largest", std::to_string(largest));
  EXPECT_LE(largest, 0.09);
  EXPECT_LE(sum / 120, 0.02);
  EXPECT_LT(least, 0.6); // that there is something to see
  EXPECT_EQ(found, openness_of(m, normals, radius, 1));
  EXPECT_EQ(found, openness_of(m, normals, radius, 3));
}

TEST(Occlusion, OneSurfaceHidesAnother) {
  const TriangleMesh ball = test::sphere_mesh(3, 10, {});
  const TriangleMesh other = test::sphere_mesh(3, 10, {0, 0, 21});
  const std::vector<Vec3> a = shading::render_normals(ball), b = shading::render_normals(other);
  const std::vector<shading::Occluder> both{{ball.points, a, ball.triangles},
                                            {other.points, b, other.triangles}};
  const auto found = shading::openness(both, 10, {});
  const auto top = std::ranges::max_element(ball.points, {}, [](const Vec3& p) { return p.z; });
  const auto low = std::ranges::min_element(ball.points, {}, [](const Vec3& p) { return p.z; });
  EXPECT_LT(found[0][static_cast<std::size_t>(top - ball.points.begin())], 0.4F);
  EXPECT_EQ(found[0][static_cast<std::size_t>(low - ball.points.begin())], 1.0F);
}

TEST(Occlusion, PointsWithoutNormalOrTriangleAndNoRadius) {
  std::vector<Vec3> normals;
  TriangleMesh m = scattered(50, normals);
  normals[0] = {};
  m.points.push_back(m.points[1]);
  normals.push_back(normals[1]);
  const auto without = static_cast<std::ptrdiff_t>(normals.size() / 2);
  std::vector<Vec3> half = normals; // the second half has none, in the middle of the triangles
  std::fill(half.begin() + without, half.end(), Vec3{});
  const std::vector<float> some = openness_of(m, half, 8);
  EXPECT_TRUE(std::all_of(some.begin() + without, some.end(), [](float o) { return o == 1.0F; }));
  EXPECT_FALSE(
      std::all_of(some.begin(), some.begin() + without, [](float o) { return o == 1.0F; }));
  const std::vector<float> found = openness_of(m, normals, 8);
  EXPECT_EQ(found[0], 1.0F);
  EXPECT_EQ(found.back(), 1.0F);
  EXPECT_LT(found[1], 1.0F);
  for (const float open : openness_of(m, normals, 0))
    EXPECT_EQ(open, 1.0F);
}

// A vertex is darkened by its share, and stays so while the view alone changes.
TEST(Occlusion, DarkensVertices) {
  std::vector<shading::Surface> surfaces(2);
  surfaces[0].mesh = test::sphere_mesh(2, 10, {});
  surfaces[1].mesh = test::sphere_mesh(2, 10, {0, 0, 21});
  shading::DrawingOptions options;
  options.shade = 0.5;
  options.light = {100, 0, 0};
  options.camera = shading::make_camera({}, shading::rest_box(surfaces), 32, 32);
  const shading::Drawing open = shading::make_drawing(surfaces, options, {});
  options.occlusion = 0.8;
  options.occlusion_radius = 10;
  shading::DrawingMaker maker;
  (void)maker.make(surfaces, options, shading::DrawingChange::all, {});
  const shading::Drawing& hidden = maker.make(surfaces, options, shading::DrawingChange::view, {});
  const std::vector<Vec3> a = shading::render_normals(surfaces[0].mesh),
                          b = shading::render_normals(surfaces[1].mesh);
  const std::vector<shading::Occluder> both{
      {surfaces[0].mesh.points, a, surfaces[0].mesh.triangles},
      {surfaces[1].mesh.points, b, surfaces[1].mesh.triangles}};
  const auto found = shading::openness(both, 10, {});
  const std::size_t first = found[0].size();
  ASSERT_EQ(hidden.vertices.size(), open.vertices.size());
  for (std::size_t v = 0; v < hidden.vertices.size(); ++v) {
    const double o = static_cast<double>(v < first ? found[0][v] : found[1][v - first]);
    EXPECT_NEAR(static_cast<double>(hidden.vertices[v].shade),
                static_cast<double>(open.vertices[v].shade) * (1 - 0.8 * (1 - o)), 1e-6);
  }
}

} // namespace
} // namespace gewebe::test
