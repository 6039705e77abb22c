#include "base/error.h"
#include "dynamics/elastodynamic.h"
#include "larger.h"
#include "model/build.h"
#include "model/figures.h"
#include "model/primitive.h"
#include "sim_models.h"

#include <cmath>
#include <gtest/gtest.h>
#include <map>

namespace gewebe::test {
namespace {

std::map<std::string, std::uint64_t> counts(const char* text) {
  model::BuildOptions options;
  options.centrals = 0;
  const model::Model model =
      model::build_model(model::primitive_mesh(model::parse_primitive(text, "")), options,
                         Context{})
          .model;
  std::map<std::string, std::uint64_t> result;
  for (const auto& [key, count] : model::model_counts(model, Context{}))
    result[key] = count;
  return result;
}

TEST(Primitive, HasTheRegularSpringsOfItsMatrix) {
  for (const std::uint64_t m : {3U, 4U, 17U})
    for (const std::uint64_t n : {2U, 5U}) {
      const std::string size = std::to_string(m) + "x" + std::to_string(n);
      auto plane = counts(("plane:" + size).c_str());
      EXPECT_EQ(plane["nodes"], m * n);
      EXPECT_EQ(plane["springs_e"], (m - 1) * n + m * (n - 1) + (m - 1) * (n - 1));
      EXPECT_EQ(plane["boundary_edges"], 2 * (m - 1) + 2 * (n - 1));
      auto tube = counts(("tube:" + size).c_str());
      EXPECT_EQ(tube["nodes"], m * n);
      EXPECT_EQ(tube["springs_e"], m * n + 2 * m * (n - 1));
      EXPECT_EQ(tube["boundary_edges"], 2 * m);
      auto sphere = counts(("sphere:" + size).c_str());
      EXPECT_EQ(sphere["nodes"], m * n + 2);
      EXPECT_EQ(sphere["springs_e"], 3 * (sphere["nodes"] - 2)); // Euler
      EXPECT_EQ(sphere["boundary_edges"], 0U);
    }
}

/// Sum over the triangles of the volume towards the origin.
double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    sum += dot(mesh.points[t[0]], cross(mesh.points[t[1]], mesh.points[t[2]])) / 6;
  return sum;
}

TEST(Primitive, StandsWhereItShouldSeenFromOutside) {
  const TriangleMesh sphere = model::primitive_mesh(model::parse_primitive("sphere:64x63", "7"));
  double error = 0;
  for (const Vec3& p : sphere.points)
    error = test::larger(error, std::abs(norm(p) - 7));
  EXPECT_LT(error, 1e-14);
  EXPECT_NEAR(volume(sphere) / (4 * M_PI / 3 * 343), 1, 0.01);
  const TriangleMesh tube = model::primitive_mesh(model::parse_primitive("tube:48x9", "3,20"));
  error = 0;
  for (std::size_t i = 0; i < 48; ++i)
    error = test::larger(error,
                         norm(tube.points[i] - Vec3{3 * std::cos(2 * M_PI / 48 * double(i)),
                                                    3 * std::sin(2 * M_PI / 48 * double(i)), 0}));
  EXPECT_LT(error, 1e-14);
  EXPECT_EQ(tube.points.back().z, 20);
  for (const Triangle& t : tube.triangles) {
    const Vec3 &a = tube.points[t[0]], &b = tube.points[t[1]], &c = tube.points[t[2]];
    const Vec3 out = cross(b - a, c - a);
    EXPECT_GT(out.x * a.x + out.y * a.y, 0);
  }
  const TriangleMesh plane = model::primitive_mesh(model::parse_primitive("plane:4x3", "30"));
  EXPECT_EQ(plane.points.back(), (Vec3{30, 30, 0}));
  for (const Triangle& t : plane.triangles)
    EXPECT_GT(
        cross(plane.points[t[1]] - plane.points[t[0]], plane.points[t[2]] - plane.points[t[0]]).z,
        0);
}

TEST(Primitive, RefusesWhatItIsNot) {
  for (const char* text :
       {"", "plane", "plane:", "plane:3", "plane:3x", "cube:3x3", "plane:1x5", "tube:2x5",
        "sphere:3x0", "plane:3x3x3", "plane:-3x3", "plane:100000x100000"})
    EXPECT_THROW((void)model::parse_primitive(text, ""), Error) << text;
  for (const char* size : {"0", "-1", "nan", "1,", "1,2,3", "a"})
    EXPECT_THROW((void)model::parse_primitive("plane:3x3", size), Error) << size;
  EXPECT_THROW((void)model::parse_primitive("sphere:3x3", "1,2"), Error);
}

TEST(ModelMasses, AreScaledJustSoThatAStepIsSafe) {
  model::Model model = test::organ();
  const double before = model::safe_step(model), mass = model::total_mass(model);
  EXPECT_EQ(model::scale_masses(model, 0.5 * before), 0U);
  EXPECT_EQ(model::total_mass(model), mass);
  EXPECT_GT(model::scale_masses(model, 3 * before), 0U);
  EXPECT_GE(model::safe_step(model), 3 * before);
  EXPECT_LT(model::safe_step(model), 3 * before * (1 + 1e-12));
  EXPECT_GT(model::total_mass(model), mass);
  dynamics::Elastodynamic object(model);
  object.set_load({.gravity = {0, 0, -9810}});
  EXPECT_NO_THROW((void)object.advance(9000 * before, 3 * before, Context{}));
}

} // namespace
} // namespace gewebe::test
