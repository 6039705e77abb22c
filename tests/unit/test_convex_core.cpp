#include "contact/convex_core.h"

#include "contact/instrument_surface.h"
#include "convex_meshes.h"
#include "larger.h"
#include "tests/unit/complaint.h"

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

namespace gewebe::test {
namespace {

using test::convex_hull_of;

Vec3 random_vector(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> side(-size, size);
  const double x = side(random), y = side(random);
  return {x, y, side(random)};
}

TEST(ConvexCore, ADistanceFromTheWholeIsSmoothAndItsGradientTheNormal) {
  std::mt19937 random(3);
  std::vector<Vec3> points;
  for (int i = 0; i < 30; ++i)
    points.push_back(random_vector(random, 1));
  const contact::ConvexCore core(convex_hull_of(points));
  int inside = 0;
  for (int k = 0; k < 5000; ++k) {
    const Vec3 p = random_vector(random, 1.5);
    const contact::ConvexCore::Nearest at = core.nearest(p);
    EXPECT_NEAR(norm(at.normal), 1, 1e-14);
    EXPECT_LT(norm(at.point + at.distance * at.normal - p), 1e-14);
    inside += at.distance < 0 ? 1 : 0;
    for (int n = 0; n < 3; ++n) {
      const Vec3 q = p + random_vector(random, 1e-6);
      const contact::ConvexCore::Nearest there = core.nearest(q);
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
  const contact::ConvexCore core(box);
  EXPECT_EQ(core.faces().size(), 6U);
  EXPECT_EQ(core.edges().size(), 12U);
  EXPECT_EQ(core.corners().size(), 8U);
  EXPECT_NEAR(core.nearest({1, 1.5, 2}).distance, -1, 1e-15);
  EXPECT_NEAR(core.nearest({-3, 1.5, 8}).distance, 5, 1e-15);
  // Whichever way its triangles go round.
  TriangleMesh turned = box;
  for (std::size_t k = 0; k < turned.triangles.size(); k += 3)
    std::swap(turned.triangles[k][0], turned.triangles[k][1]);
  EXPECT_EQ(contact::ConvexCore(turned), core);
}

TEST(ConvexCore, WhatIsNoConvexSolidIsRefusedByName) {
  const auto complaint = [](const TriangleMesh& mesh) {
    return test::complaint([&] { return contact::ConvexCore(mesh); });
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
    const contact::ConvexCore core(mesh);
    const double radius = 0.25;
    const contact::InstrumentSurface shown = contact::hull_surface(core, radius);
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
} // namespace gewebe::test
