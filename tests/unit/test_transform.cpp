// Affine maps, anatomical spaces, and --transform of meshes, tetrahedra and models.

#include "base/error.h"
#include "formats/model/ela.h"
#include "geometry/affine.h"
#include "geometry/space.h"
#include "tests/unit/complaint.h"
#include "tools/cli/transform_option.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace gewebe::test {
namespace {

std::string complaint(const std::string& text) {
  return test::complaint([&] { return parse_affine(text); });
}

void expect_near(const Vec3& a, const Vec3& b, double tolerance = 1e-12) {
  EXPECT_LE(norm(a - b), tolerance) << a.x << " " << a.y << " " << a.z;
}

TEST(Transform, QuartersAreExact) {
  const Vec3 p{1, 2, 3};
  EXPECT_EQ(parse_affine("rotate z 90")(p), (Vec3{-2, 1, 3}));
  EXPECT_EQ(parse_affine("rotate z -90")(p), (Vec3{2, -1, 3}));
  EXPECT_EQ(parse_affine("rotate z 180")(p), (Vec3{-1, -2, 3}));
  EXPECT_EQ(parse_affine("rotate z -180")(p), (Vec3{-1, -2, 3}));
  EXPECT_EQ(parse_affine("rotate z 270")(p), (Vec3{2, -1, 3}));
  EXPECT_EQ(parse_affine("rotate z 720")(p), p);
  EXPECT_EQ(parse_affine("rotate x 90")(p), (Vec3{1, -3, 2}));
  EXPECT_EQ(parse_affine("rotate y 90")(p), (Vec3{3, 2, -1}));
}

TEST(Transform, AnglesAreThoseOfTheSine) {
  for (double degrees = -400; degrees < 400; degrees += 7.3) {
    const double a = degrees * M_PI / 180;
    expect_near(parse_affine("rotate z " + std::to_string(degrees))({1, 0, 5}),
                {std::cos(a), std::sin(a), 5}, 1e-7); // six digits of the text
    EXPECT_TRUE(parse_affine("rotate y " + std::to_string(degrees)).is_rigid());
  }
  expect_near(parse_affine("rotate z 30")({2, 0, 0}), {std::sqrt(3.0), 1, 0});
}

TEST(Transform, StepsAreTakenInOrder) {
  expect_near(parse_affine("translate 0 0 5; rotate x 90; scale 10; mirror x")({1, 2, 3}),
              {-10, -80, 20});
  expect_near(parse_affine(" scale 1 2,3 ;; translate +1 0 0 ;")({1, 1, 1}), {2, 2, 3});
  EXPECT_EQ(parse_affine("mirror y").determinant(), -1);
  EXPECT_TRUE(parse_affine("mirror y").is_rigid());
  EXPECT_FALSE(parse_affine("scale 1.001").is_rigid());
}

TEST(Transform, WrongStepsSayWhatWasExpected) {
  EXPECT_EQ(complaint("turn z 9"),
            "'turn' is no transform, expected translate, rotate, scale or mirror");
  EXPECT_EQ(complaint("translate 1 2"), "'translate' of 2 words, expected translate X Y Z");
  EXPECT_EQ(complaint("rotate w 3"), "'w' is no axis, expected x, y or z");
  EXPECT_EQ(complaint("rotate x inf"), "'inf' is no number");
  EXPECT_EQ(complaint("scale 0"), "scale by 0, expected another number");
  EXPECT_NE(complaint(" ; "), "");
}

TEST(Transform, MatricesAreRowByRow) {
  expect_near(parse_affine_matrix("0 -1 0 5 # turned\n1 0 0 6\n0 0 1 7\n0 0 0 1\n")({1, 2, 3}),
              {3, 7, 10});
  EXPECT_NO_THROW(parse_affine_matrix("0 0 1 0  1 0 0 0  0 1 0 0  0 0 0 1")); // zeros in front
  EXPECT_THROW(parse_affine_matrix("1 0 0 0 0 1 0 0 0 0 1 0"), Error);
  EXPECT_THROW(parse_affine_matrix("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1"), Error);
  EXPECT_THROW(parse_affine_matrix("1 2 3 0 2 4 6 0 0 0 1 0 0 0 0 1"), Error);
}

TEST(Transform, SpacesAreHalfATurnApart) {
  EXPECT_EQ(other_space({1, 2, 3}), parse_affine("rotate z 180")({1, 2, 3}));
  EXPECT_EQ(space_from_name("lps"), Space::lps);
  EXPECT_EQ(space_from_name("RAS"), Space::ras);
  EXPECT_EQ(space_from_name("LAS"), Space::unknown);
  EXPECT_FALSE(spaces_differ(Space::unknown, Space::lps));
}

TEST(Transform, AMirroredSurfaceKeepsItsOutside) {
  TriangleMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  mesh.normals = {{-0.6F, -0.8F, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.texcoords = {{1, 2, 3, 4, 5, 6}, {}, {}, {}};
  ASSERT_GT(signed_volume(mesh), 0);
  TriangleMesh moved = mesh;
  cli::apply(parse_affine("mirror x; scale 2; translate 9 9 9"), moved);
  EXPECT_NEAR(signed_volume(moved), 8 * signed_volume(mesh), 1e-9);
  EXPECT_EQ(moved.triangles[0], (Triangle{0, 1, 2}));
  EXPECT_EQ(moved.texcoords[0][2], 5);
  EXPECT_EQ(moved.texcoords[0][5], 4);
  EXPECT_NEAR(moved.normals[0][0], 0.6F, 1e-6);
  EXPECT_NEAR(moved.normals[0][1], -0.8F, 1e-6);
  // Normals of a stretched surface stay across it.
  cli::apply(parse_affine("scale 4 1 1"), mesh);
  EXPECT_NEAR(mesh.normals[0][0] / mesh.normals[0][1], 0.6 / 4 / 0.8, 1e-6);
  EXPECT_THROW(cli::apply(parse_affine("scale 1e308"), mesh), Error);
}

TEST(Transform, MirroredTetrahedraKeepTheirMiddles) {
  tetrahedra::TetMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  EdgeMiddles middles{};
  for (std::size_t e = 0; e < 6; ++e) {
    middles[e] = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.push_back((mesh.points[tetrahedra::tetrahedron_edges[e][0]] +
                           mesh.points[tetrahedra::tetrahedron_edges[e][1]]) /
                          2);
  }
  mesh.middles = {middles};
  cli::apply(parse_affine("mirror z; rotate y 20"), mesh);
  EXPECT_NEAR(tetrahedra::volume(mesh), 1, 1e-12);
  for (std::size_t e = 0; e < 6; ++e) {
    const auto& [a, b] = tetrahedra::tetrahedron_edges[e];
    expect_near(mesh.points[mesh.middles[0][e]],
                (mesh.points[mesh.tetrahedra[0][a]] + mesh.points[mesh.tetrahedra[0][b]]) / 2);
  }
}

/// A triangle, one of whose nodes is held along x.
constexpr const char* triangle =
    "ela_expl 1\nname \"m\"\nspace LPS\nmaterials 1\n0 \"generic\" 0.001 1000 1 0\nnodes 3\n"
    "0 0 0 1 0 x -1 0\n1 0 0 1 0 - -1 0\n0 1 0 1 0 xyz -1 0\nsprings 3\n"
    "0 1 e 1 0 1\n0 2 e 1 0 1\n1 2 e 1 0 1.4142135623730951\ntriangles 1\n0 1 2\nend\n";

TEST(Transform, ModelsTurnWithTheirAxes) {
  Space space = Space::unknown;
  const model::Model model = formats::parse_ela(triangle, "M", {}, &space);
  EXPECT_EQ(space, Space::lps);
  model::Model turned = model;
  cli::apply(parse_affine("rotate z 90; translate 5 0 0"), turned);
  EXPECT_EQ(turned.nodes[1].position, (Vec3{5, 1, 0}));
  EXPECT_EQ(turned.nodes[0].fixed, 2); // along y
  EXPECT_EQ(turned.nodes[2].fixed, 7);
  EXPECT_THROW(cli::apply(parse_affine("rotate z 45"), turned), Error);
  EXPECT_THROW(cli::apply(parse_affine("scale 2"), turned), Error);
}

TEST(Transform, SpacesOfModels) {
  Space space = Space::ras;
  std::string text = triangle;
  text.erase(text.find("space"), 10);
  (void)formats::parse_ela(text, "M", {}, &space);
  EXPECT_EQ(space, Space::unknown);
  text = triangle;
  text.replace(text.find("LPS"), 3, "LAS");
  try {
    (void)formats::parse_ela(text, "M");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.place() + ": " + error.what(), "M:3: 'LAS' is no space, expected RAS or LPS");
  }
}

} // namespace
} // namespace gewebe::test
