// Contours in slices: prisms, balls, holes and what is refused.

#include "base/error.h"
#include "formats/volume/contours_file.h"
#include "labels/contour_density.h"
#include "mesh/check.h"
#include "surface/marching_cubes.h"
#include "tests/unit/larger.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

using namespace gewebe;

namespace {

labels::Contour square(double half, double z, const Vec3& shift = {}) {
  labels::Contour contour;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    contour.push_back(Vec3{half * x, half * y, z} + shift);
  return contour;
}

labels::Contour circle(double radius, double z, std::size_t corners = 256) {
  labels::Contour contour;
  for (std::size_t n = 0; n < corners; ++n) {
    const double angle =
        2 * std::numbers::pi * static_cast<double>(n) / static_cast<double>(corners);
    contour.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
  }
  return contour;
}

/// Distance inside a square of half edge `half`.
double square_distance(double x, double y, double half) {
  const double dx = std::fabs(x) - half, dy = std::fabs(y) - half;
  const double outside = std::hypot(test::larger(dx, 0.0), test::larger(dy, 0.0));
  return -(outside + test::smaller(test::larger(dx, dy), 0.0));
}

double density(double f, double voxel) {
  return test::smaller(1.0, test::larger(0.0, 0.5 + 0.5 * f / voxel));
}

double volume_of(const volume::Grid& grid) {
  const TriangleMesh mesh = surface::marching_cubes({}, grid).mesh;
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_TRUE(report.closed() && report.manifold() && report.outward());
  double volume = 0;
  for (const Triangle& t : mesh.triangles)
    volume += dot(mesh.points[t[0]], cross(mesh.points[t[1]], mesh.points[t[2]])) / 6;
  return volume;
}

/// Slices of a ball of radius 20 at uneven heights.
std::vector<labels::Contour> ball() {
  std::vector<labels::Contour> contours;
  for (const double z : {-19.0, -16.5, -12.0, -9.0, -4.0, 0.5, 3.0, 8.0, 11.0, 15.0, 18.0, 19.5})
    contours.push_back(circle(std::sqrt(400 - z * z), z));
  return contours;
}

std::string message_of(const std::vector<labels::Contour>& contours) {
  try {
    (void)labels::contour_density({}, contours, 1);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(ContourDensity, APrismHasTheDistanceToItsSidesAtAnyHeightBetweenTheSlices) {
  std::vector<labels::Contour> contours;
  for (const double z : {3.0, 8.0, 10.0, 19.0, 31.0})
    contours.push_back(square(10.2, z));
  labels::ContourDensityReport report;
  const volume::Grid grid = labels::contour_density({}, contours, 0.75, &report);
  EXPECT_EQ(report.axis, 2);
  EXPECT_EQ(report.slices, 5U);
  EXPECT_EQ(report.points, 20U);
  EXPECT_DOUBLE_EQ(report.least_spacing, 2);
  EXPECT_DOUBLE_EQ(report.greatest_spacing, 12);
  volume::GridAccessor values(grid);
  double worst = 0;
  for (std::int32_t k = 4; k <= 41; ++k) // 3 to 30.75 mm
    for (std::int32_t j = -20; j <= 20; ++j)
      for (std::int32_t i = -20; i <= 20; ++i)
        worst = test::larger(worst,
                             std::fabs(values.value({i, j, k}) -
                                       density(square_distance(0.75 * i, 0.75 * j, 10.2), 0.75)));
  EXPECT_LE(worst, 1e-5);
  for (const std::int32_t k : {0, 57}) // caps end at -2 and at 43 mm
    EXPECT_LE(values.value({14, 14, k}), 0.5);
  EXPECT_GE(values.value({0, 0, 56}), 0.5);
  EXPECT_LE(values.value({0, 0, 58}), 0.5);
}

TEST(ContourDensity, SidesThatAreParabolasOfTheHeightAreExact) {
  const auto half = [](double z) { return 8 + 0.3 * z - 0.01 * z * z; };
  std::vector<labels::Contour> contours;
  for (const double z : {0.0, 5.0, 7.0, 16.0, 25.0})
    contours.push_back(square(half(z), z));
  volume::GridAccessor values(labels::contour_density({}, contours, 1));
  double worst = 0;
  for (std::int32_t k = 5; k <= 16; ++k) // between slices with neighbours on both sides
    for (std::int32_t i = 0; i <= 12; ++i)
      worst = test::larger(worst, std::fabs(values.value({i, 0, k}) - density(half(k) - i, 1)));
  EXPECT_LE(worst, 1e-5);
}

TEST(ContourDensity, ABallOfUnevenSlicesHasItsVolumeAndItsContoursAtTheSlices) {
  const volume::Grid grid = labels::contour_density({}, ball(), 0.5);
  const double exact = 4.0 / 3 * std::numbers::pi * 8000;
  EXPECT_NEAR(volume_of(grid) / exact, 1, 0.01);
  volume::GridAccessor values(grid);
  const double radius = std::sqrt(400 - 64); // at z = 8
  double worst = 0;
  for (std::int32_t j = -50; j <= 50; ++j)
    for (std::int32_t i = -50; i <= 50; ++i)
      worst = test::larger(worst, std::fabs(values.value({i, j, 16}) -
                                            density(radius - std::hypot(0.5 * i, 0.5 * j), 0.5)));
  EXPECT_LE(worst, 0.005); // of the polygon's sagitta
}

TEST(ContourDensity, ContoursWithinContoursAreHoles) {
  std::vector<labels::Contour> contours;
  for (const double z : {0.0, 5.0, 10.0, 15.0, 20.0}) {
    contours.push_back(square(10, z));
    contours.push_back(square(5, z));
    contours.push_back(square(2, z));
  }
  volume::GridAccessor values(labels::contour_density({}, contours, 0.5));
  EXPECT_EQ(values.value({0, 0, 20}), 1);
  EXPECT_EQ(values.value({7, 0, 20}), 0);
  EXPECT_EQ(values.value({15, 0, 20}), 1);
  EXPECT_EQ(values.value({25, 0, 20}), 0);
}

TEST(ContourDensity, SlicesAcrossAnyAxisGiveTheSameValues) {
  const std::vector<labels::Contour> contours = ball();
  const volume::Grid grid = labels::contour_density({}, contours, 1);
  volume::GridAccessor expected(grid);
  for (const int axis : {0, 1}) {
    std::vector<labels::Contour> turned = contours;
    for (labels::Contour& contour : turned)
      for (Vec3& p : contour)
        p = axis == 0 ? Vec3{p.z, p.x, p.y} : Vec3{p.y, p.z, p.x};
    labels::ContourDensityReport report;
    volume::GridAccessor values(labels::contour_density({}, turned, 1, &report));
    EXPECT_EQ(report.axis, axis);
    for (std::int32_t k = -21; k <= 21; ++k)
      for (std::int32_t j = -21; j <= 21; ++j)
        for (std::int32_t i = -21; i <= 21; ++i)
          ASSERT_EQ(values.value(axis == 0 ? Int3{k, i, j} : Int3{j, k, i}),
                    expected.value({i, j, k}));
  }
}

TEST(ContourDensity, TheSameBytesOnAnyNumberOfThreadsAndInAnyOrderOfContours) {
  std::vector<labels::Contour> contours = ball();
  Context one, four;
  one.threads = 1;
  four.threads = 4;
  const std::uint64_t digest = labels::contour_density(one, contours, 0.5).digest();
  EXPECT_EQ(labels::contour_density(four, contours, 0.5).digest(), digest);
  std::reverse(contours.begin(), contours.end());
  EXPECT_EQ(labels::contour_density(four, contours, 0.5).digest(), digest);
}

TEST(ContourDensity, WhatMakesNoBodyIsRefused) {
  EXPECT_EQ(message_of({square(5, 3)}),
            "contours in one slice alone, at z = 3 mm, expected two slices or more");
  EXPECT_EQ(message_of({square(5, 3), {{0, 0, 0}, {4, 0, 1}, {0, 4, 2}}}),
            "contour 2 is not flat, expected one in a plane of constant x, y or z");
  EXPECT_EQ(message_of({square(5, 3), {{0, 0, 0}, {0, 4, 0}, {0, 4, 4}}}),
            "contours lie across different axes, expected parallel slices");
  EXPECT_EQ(message_of({square(5, 3), square(5, 3e9)}),
            "an index of the volume would leave ±2^30, expected a larger voxel");
  Context small;
  small.max_memory = 1000;
  EXPECT_THROW((void)labels::contour_density(small, ball(), 0.5), Error);
}

TEST(ContoursFile, BlankLinesEndContoursAndALastPointMayRepeatTheFirst) {
  const auto contours = formats::read_contours(
      "# spleen\n0 0 1\n4,0,1\n# a comment ends no contour\n4;4;1\n0 0 1\n\n\n1 1 2\n+3 1 2\n3 3 2",
      "c.txt", 10);
  ASSERT_EQ(contours.size(), 2U);
  EXPECT_EQ(contours[0].size(), 3U);
  EXPECT_EQ(contours[1].size(), 3U);
  EXPECT_EQ(contours[1][1].x, 30);
}

TEST(ContoursFile, ErrorsNameTheLine) {
  for (const auto& [text, message] :
       {std::pair{"0 0 0\n1 0 0\n\n", "c:1: a contour of 2 points, expected three or more"},
        {"0 0 0\n1 0\n", "c:2: 2 numbers, expected x y z, or a blank line between contours"},
        {"0 0 zero\n",
         "c:1: 'zero' is no number, expected x y z, or a blank line between contours"},
        {"0 0 0 7\n",
         "c:1: more than three numbers, expected x y z, or a blank line between contours"},
        {"0 0 1e308\n", "c:1: a coordinate is not finite"},
        {"# nothing\n", "c: no contour, expected lines of x y z"}}) {
    try {
      (void)formats::read_contours(text, "c", 1000);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.place() + ": " + error.what(), message);
    }
  }
}
