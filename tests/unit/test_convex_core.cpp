#include "contact/convex_core.h"

#include "base/error.h"
#include "contact/instrument_surface.h"
#include "contact/surface_parts.h"
#include "convex_meshes.h"
#include "larger.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gewebe {
namespace {

using test::convex_hull_of;

Vec3 random_vector(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> side(-size, size);
  const double x = side(random), y = side(random);
  return {x, y, side(random)};
}

double distance_of_segments(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // The nearest of all candidates: ends, and the lines' points where they are between these.
  const Vec3 u = b - a, v = d - c, r = a - c;
  double least = HUGE_VAL;
  const auto look = [&](double s, double t) {
    s = std::fmin(std::fmax(s, 0), 1);
    t = std::fmin(std::fmax(t, 0), 1);
    least = test::smaller(least, norm(a + s * u - c - t * v));
  };
  for (const double s : {0.0, 1.0})
    look(s, dot(a + s * u - c, v) / dot(v, v));
  for (const double t : {0.0, 1.0})
    look(dot(c + t * v - a, u) / dot(u, u), t);
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), by = uu * vv - uv * uv;
  if (by > 1e-12 * uu * vv)
    look((uv * dot(v, r) - vv * dot(u, r)) / by, (uu * dot(v, r) - uv * dot(u, r)) / by);
  return least;
}

double distance_of_point(const Vec3& p, const std::array<Vec3, 3>& t) {
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  bool over = true;
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &a = t[k], &b = t[(k + 1) % 3];
    over = over && dot(cross(b - a, p - a), n) >= 0;
    const double s = std::fmin(std::fmax(dot(p - a, b - a) / dot(b - a, b - a), 0), 1);
    least = test::smaller(least, norm(p - a - s * (b - a)));
  }
  return over ? std::fabs(dot(n, p - t[0])) / norm(n) : least;
}

/// All features of both against each other.
double distance_by_all(const TriangleMesh& mesh, const std::array<Vec3, 3>& t) {
  double least = HUGE_VAL;
  for (const Triangle& f : mesh.triangles) {
    const std::array<Vec3, 3> s{mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]]};
    for (std::size_t i = 0; i < 3; ++i) {
      least = test::smaller(least, distance_of_point(s[i], t));
      least = test::smaller(least, distance_of_point(t[i], s));
      for (std::size_t j = 0; j < 3; ++j)
        least =
            test::smaller(least, distance_of_segments(s[i], s[(i + 1) % 3], t[j], t[(j + 1) % 3]));
    }
  }
  return least;
}

/// How far the surface of a core is in a triangle, or is inside of it: by cutting it at the planes
/// of the core as the mesh has them, one after the other.
bool overlap_by_all(const TriangleMesh& mesh, const std::array<Vec3, 3>& t) {
  const auto inside = [&](const Vec3& p) {
    for (const Triangle& f : mesh.triangles)
      if (dot(cross(mesh.points[f[1]] - mesh.points[f[0]], mesh.points[f[2]] - mesh.points[f[0]]),
              p - mesh.points[f[0]]) > 0)
        return false;
    return true;
  };
  const auto pierces = [](const Vec3& a, const Vec3& b, const std::array<Vec3, 3>& s) {
    const Vec3 n = cross(s[1] - s[0], s[2] - s[0]);
    const double from = dot(n, a - s[0]), to = dot(n, b - s[0]);
    if (!(from * to < 0))
      return false;
    const Vec3 p = a + from / (from - to) * (b - a);
    for (std::size_t k = 0; k < 3; ++k)
      if (dot(cross(s[(k + 1) % 3] - s[k], p - s[k]), n) < 0)
        return false;
    return true;
  };
  if (inside(t[0]))
    return true;
  for (const Triangle& f : mesh.triangles) {
    const std::array<Vec3, 3> s{mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]]};
    for (std::size_t k = 0; k < 3; ++k)
      if (pierces(t[k], t[(k + 1) % 3], s) || pierces(s[k], s[(k + 1) % 3], t))
        return true;
  }
  return false;
}

TEST(ConvexCore, PairsOfPartsHaveTheDistanceOfAllFeatures) {
  std::mt19937 random(7);
  int apart = 0, overlapping = 0;
  double worst = 0;
  for (int k = 0; k < 1000; ++k) {
    std::vector<Vec3> points;
    for (int i = 0; i < 4 + k % 9; ++i)
      points.push_back(random_vector(random, 1));
    const TriangleMesh mesh = convex_hull_of(points);
    const auto core = std::make_shared<const ConvexCore>(mesh);
    const Pose pose{random_vector(random, 3), unit({0.3, std::sin(1.0 * k), std::cos(1.7 * k), 1})};
    const double radius = 0.4;
    InstrumentShape shape{radius, {}, 0};
    shape.core = core;
    const PlacedInstrument placed(shape, pose);
    for (int n = 0; n < 100; ++n) {
      const Vec3 middle = random_vector(random, 1.6);
      std::array<Vec3, 3> own, corners;
      for (std::size_t c = 0; c < 3; ++c) {
        own[c] = middle + random_vector(random, n % 2 == 0 ? 0.3 : 2);
        corners[c] = pose(own[c]);
      }
      const bool overlap = overlap_by_all(mesh, own);
      EXPECT_EQ(goes_through(placed, corners), overlap) << k << " " << n;
      const double expected = distance_by_all(mesh, own);
      double least = HUGE_VAL, deepest = HUGE_VAL;
      for_parts(placed, {0, 1, 2}, corners, 9, [&](CorePart part, const Facet& piece) {
        const auto found =
            nearest_points(placed, part, {corners[piece[0]], corners[piece[1]], corners[piece[2]]},
                           corner_count(piece));
        if (!found || found->behind)
          return;
        least = test::smaller(least, found->distance);
        deepest = test::smaller(deepest, found->distance);
        const Vec3 place = found->weights[0] * corners[piece[0]] +
                           found->weights[1] * corners[piece[1]] +
                           found->weights[2] * corners[piece[2]];
        EXPECT_LT(norm(place - found->place), 1e-13);
        EXPECT_LT(norm(found->core + found->distance * found->normal({}) - found->place), 1e-13);
        if (part != CorePart::whole) { // it leads out
          const Vec3 begun = found->core + 0.01 * (found->place - found->core);
          EXPECT_GT(core->nearest(pose.inverse(begun)).distance, -1e-13);
        }
      });
      if (overlap) {
        ++overlapping;
        continue;
      }
      ++apart;
      worst = test::larger(worst, std::fabs(least - expected));
      // Nothing is lost where pairs that are too far apart are left out.
      double near = HUGE_VAL;
      for_parts(placed, {0, 1, 2}, corners, radius, [&](CorePart part, const Facet& piece) {
        const auto found =
            nearest_points(placed, part, {corners[piece[0]], corners[piece[1]], corners[piece[2]]},
                           corner_count(piece));
        if (found && !found->behind)
          near = test::smaller(near, found->distance);
      });
      if (expected < radius) {
        EXPECT_EQ(near, least);
      } else {
        EXPECT_GE(near, radius * (1 - 1e-12));
      }
    }
  }
  EXPECT_LT(worst, 1e-12);
  EXPECT_GT(apart, 20000);
  EXPECT_GT(overlapping, 10000);
}

TEST(ConvexCore, ADistanceFromTheWholeIsSmoothAndItsGradientTheNormal) {
  std::mt19937 random(3);
  std::vector<Vec3> points;
  for (int i = 0; i < 30; ++i)
    points.push_back(random_vector(random, 1));
  const ConvexCore core(convex_hull_of(points));
  int inside = 0;
  for (int k = 0; k < 5000; ++k) {
    const Vec3 p = random_vector(random, 1.5);
    const ConvexCore::Nearest at = core.nearest(p);
    EXPECT_NEAR(norm(at.normal), 1, 1e-14);
    EXPECT_LT(norm(at.point + at.distance * at.normal - p), 1e-14);
    inside += at.distance < 0 ? 1 : 0;
    for (int n = 0; n < 3; ++n) {
      const Vec3 q = p + random_vector(random, 1e-6);
      const ConvexCore::Nearest there = core.nearest(q);
      EXPECT_LE(std::fabs(there.distance - at.distance), norm(q - p) * (1 + 1e-9));
      if (at.distance > 0.05) { // so far outside, normals turn by no more than this
        EXPECT_LT(norm(there.normal - at.normal), 1.01 * norm(q - p) / at.distance);
        EXPECT_NEAR(there.distance - at.distance, dot(at.normal, q - p),
                    2 * dot(q - p, q - p) / at.distance + 1e-15);
      }
    }
  }
  EXPECT_GT(inside, 300);
}

TEST(ConvexCore, FlatPartsBecomeOneFaceHoweverTheyAreDivided) {
  const TriangleMesh box = test::divided_box({2, 3, 4}, 5);
  const ConvexCore core(box);
  EXPECT_EQ(core.faces().size(), 6U);
  EXPECT_EQ(core.edges().size(), 12U);
  EXPECT_EQ(core.corners().size(), 8U);
  EXPECT_NEAR(core.nearest({1, 1.5, 2}).distance, -1, 1e-15);
  EXPECT_NEAR(core.nearest({-3, 1.5, 8}).distance, 5, 1e-15);
  // Whichever way its triangles go round.
  TriangleMesh turned = box;
  for (std::size_t k = 0; k < turned.triangles.size(); k += 3)
    std::swap(turned.triangles[k][0], turned.triangles[k][1]);
  EXPECT_EQ(ConvexCore(turned), core);
}

TEST(ConvexCore, WhatIsNoConvexSolidIsRefusedByName) {
  const auto complaint = [](const TriangleMesh& mesh) -> std::string {
    try {
      ConvexCore core(mesh);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const TriangleMesh box = test::divided_box({2, 3, 4}, 1);
  TriangleMesh open = box;
  open.triangles.pop_back();
  EXPECT_NE(complaint(open).find("has 1 triangle, expected two, of a closed surface"),
            std::string::npos)
      << complaint(open);
  TriangleMesh dented = test::divided_box({2, 3, 4}, 2);
  const double size = norm(Vec3{2, 3, 4});
  for (Vec3& p : dented.points)
    if (p == Vec3{1, 1.5, 4})
      p.z -= 2e-5 * size;
  EXPECT_NE(complaint(dented).find("is not convex at the edge from "), std::string::npos)
      << complaint(dented);
  TriangleMesh nearly = test::divided_box({2, 3, 4}, 2);
  for (Vec3& p : nearly.points)
    if (p == Vec3{1, 1.5, 4})
      p.z -= 2e-6 * size;
  EXPECT_EQ(complaint(nearly), "");
  EXPECT_NE(complaint(test::divided_box({2, 3, 0.003}, 1)).find("is flat, 0.003 mm thick"),
            std::string::npos);
  TriangleMesh two = box;
  for (const Vec3& p : box.points)
    two.points.push_back(p + Vec3{5, 0, 0});
  for (const Triangle& t : box.triangles)
    two.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  EXPECT_NE(complaint(two).find("is not convex"), std::string::npos) << complaint(two);
  EXPECT_NE(complaint({}).find("has no triangle"), std::string::npos);
  TriangleMesh sliver = box;
  sliver.points.push_back(0.5 * (box.points[0] + box.points[1]));
  sliver.triangles.push_back({0, 1, 8});
  EXPECT_NE(complaint(sliver).find("has no area"), std::string::npos) << complaint(sliver);
  TriangleMesh lost = box;
  lost.points[0].x = std::nan("");
  EXPECT_NE(complaint(lost), "");
}

TEST(ConvexCore, ItsShownSurfaceIsClosedRoundAndItsOwn) {
  std::mt19937 random(5);
  std::vector<Vec3> points;
  for (int i = 0; i < 20; ++i)
    points.push_back(random_vector(random, 3));
  for (const TriangleMesh& mesh : {test::divided_box({2, 3, 4}, 2), convex_hull_of(points)}) {
    const ConvexCore core(mesh);
    const double radius = 0.25;
    const InstrumentSurface shown = hull_surface(core, radius);
    TriangleMesh closed;
    closed.points = shown.points;
    closed.triangles = shown.triangles;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (const Triangle& t : shown.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        ++sides[{t[k], t[(k + 1) % 3]}];
    for (const auto& [ends, count] : sides) {
      EXPECT_EQ(count, 1);
      EXPECT_TRUE(sides.contains({ends.second, ends.first}));
    }
    EXPECT_GT(signed_volume(closed), signed_volume(mesh));
    for (std::size_t i = 0; i < shown.points.size(); ++i) {
      EXPECT_NEAR(core.nearest(shown.points[i]).distance, radius, 1e-14);
      EXPECT_LT(norm(core.nearest(shown.points[i]).normal - shown.normals[i]), 1e-13);
    }
  }
}

} // namespace
} // namespace gewebe
