// What an endoscope sees, and surfaces from within.

#include "larger.h"
#include "mesh_fixtures.h"
#include "render/picture.h"
#include "shading/drawing.h"
#include "shading/endoscope.h"
#include "shading/style.h"
#include "shading/tangents.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace gewebe::test {
namespace {

TEST(Endoscope, LightAboveTheLens) {
  shading::CameraOptions options;
  options.eye = Vec3{10, 200, 30};
  options.target = Vec3{10, 0, 30};
  const shading::Camera camera = shading::make_camera(options, {}, 64, 64);
  EXPECT_NEAR(norm(shading::endoscope_light(camera) - Vec3{10, 200, 33}), 0, 1e-12);
}

TEST(Endoscope, LightThatIsLeft) {
  EXPECT_EQ(shading::light_left(0, 1e9), 1);
  EXPECT_EQ(shading::light_left(50, 20), 1);
  EXPECT_EQ(shading::light_left(50, 50), 1);
  EXPECT_DOUBLE_EQ(shading::light_left(50, 200), 0.25);
}

// By angles, as the contract has it.
TEST(Endoscope, FieldOfItsLens) {
  for (const auto& [width, height] : {std::pair{121U, 81U}, {64U, 100U}}) {
    shading::CameraOptions options;
    options.eye = Vec3{0, 100, 0};
    options.target = Vec3{};
    options.fov = 70;
    const shading::Camera camera = shading::make_camera(options, {}, width, height);
    texture::Image image{width, height, 3, {}};
    image.values.assign(std::size_t{3} * width * height, 240);
    shading::look_through_endoscope(image, camera);
    const double half = std::min(width, height) / 2.0;
    double largest = 0;
    for (std::uint32_t y = 0; y < height; ++y)
      for (std::uint32_t x = 0; x < width; ++x) {
        const double r = std::hypot(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0);
        const double angle = std::atan(
            r / half * std::tan(35 * std::numbers::pi / 180)); // at r = half it is 35 degrees
        const double s = std::clamp((r / half - 0.35) / 0.65, 0.0, 1.0);
        double expected =
            240 * std::pow(std::cos(angle), 2) * (1 - 0.5 * (3 * s * s - 2 * s * s * s));
        if (r > half + 0.5)
          expected = 0;
        else if (r > half - 0.5)
          expected *= half + 0.5 - r;
        for (std::size_t c = 0; c < 3; ++c)
          largest = test::larger(
              largest, std::fabs(image.values[3 * (std::size_t{y} * width + x) + c] - expected));
      }
    EXPECT_LE(largest, 0.5001);
    EXPECT_EQ(image.values[0], 0);
  }
}

TEST(Endoscope, VerticesFarFromItsLightAreDarker) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = test::sphere_mesh(2, 10, {});
  shading::DrawingOptions options;
  options.shade = 0.5;
  options.light = {0, 15, 0};
  options.camera = shading::make_camera({}, shading::rest_box(surfaces), 32, 32);
  const shading::Drawing full = shading::make_drawing(surfaces, options, {});
  options.full_distance = 8;
  const shading::Drawing left = shading::make_drawing(surfaces, options, {});
  double least = 1;
  for (std::size_t v = 0; v < left.vertices.size(); ++v) {
    const double distance = norm(surfaces[0].mesh.points[v] - options.light);
    const double factor = distance < 8 ? 1 : 8 / distance;
    EXPECT_NEAR(static_cast<double>(left.vertices[v].shade),
                static_cast<double>(full.vertices[v].shade) * factor, 1e-6);
    least = test::smaller(least, factor);
  }
  EXPECT_LT(least, 0.33);
}

texture::Image drawn(const std::vector<shading::Surface>& surfaces, const shading::Camera& camera,
                     const Vec3& light) {
  shading::DrawingOptions options;
  options.shade = 0.6;
  options.light = light;
  options.camera = camera;
  options.insides = std::ranges::any_of(surfaces, &shading::Surface::inside);
  texture::SurfaceMaterial material;
  material.color = {0.8, 0.5, 0.4};
  if (options.insides) {
    material.others.emplace_back();
    material.others[0].color = {0.5, 0.1, 0.2};
  }
  render::PictureOptions picture;
  picture.backend = render::Backend::cpu;
  picture.width = picture.height = 128;
  return render::make_picture(shading::make_drawing(surfaces, options, {}), camera, material,
                              picture, {});
}

TEST(TwoSided, TrianglesArePartedByWhereTheyFace) {
  std::vector<shading::Surface> surfaces(2);
  surfaces[0].mesh = test::sphere_mesh(3, 10, {1, 2, 3});
  surfaces[1].mesh = test::sphere_mesh(1, 2, {20, 2, 3});
  surfaces[1].instrument = true;
  for (std::size_t t = 0; t < surfaces[0].mesh.triangles.size(); ++t)
    surfaces[0].mesh.material.push_back(static_cast<std::int32_t>(t));
  const Vec3 eye{30, 50, 20};
  const std::vector<shading::Surface> both = shading::two_sided(surfaces, eye);
  ASSERT_EQ(both.size(), 3U);
  EXPECT_TRUE(both[1].instrument && both[1].mesh.triangles == surfaces[1].mesh.triangles);
  EXPECT_TRUE(both[2].inside);
  const TriangleMesh &front = both[0].mesh, &back = both[2].mesh;
  EXPECT_EQ(front.triangles.size() + back.triangles.size(), surfaces[0].mesh.triangles.size());
  EXPECT_GT(back.triangles.size(), 600U);
  for (const TriangleMesh* mesh : {&front, &back})
    for (const auto& [a, b, c] : mesh->triangles) {
      const Vec3& p = mesh->points[a];
      EXPECT_GE(dot(cross(mesh->points[b] - p, mesh->points[c] - p), eye - p), 0);
    }
  for (std::size_t t = 0; t < front.triangles.size(); ++t)
    EXPECT_EQ(front.triangles[t],
              surfaces[0].mesh.triangles[static_cast<std::size_t>(front.material[t])]);
  const std::vector<Vec3> whole = shading::render_normals(surfaces[0].mesh);
  for (std::size_t p = 0; p < whole.size(); ++p)
    for (int a = 0; a < 3; ++a) {
      EXPECT_EQ(front.normals[p][static_cast<std::size_t>(a)], static_cast<float>(whole[p][a]));
      EXPECT_EQ(back.normals[p][static_cast<std::size_t>(a)], static_cast<float>(-whole[p][a]));
    }
}

TEST(TwoSided, AClosedBodyLooksAsItDid) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = test::sphere_mesh(3, 10, {1, 2, 3});
  const shading::Camera camera = shading::make_camera({}, shading::rest_box(surfaces), 128, 128);
  const texture::Image one = drawn(surfaces, camera, {100, 100, 100});
  const texture::Image both =
      drawn(shading::two_sided(surfaces, camera.eye), camera, {100, 100, 100});
  for (std::size_t n = 0; n < one.values.size(); ++n)
    ASSERT_LE(std::abs(one.values[n] - both.values[n]), 1) << n;
}

// The far half of a sphere, seen and lit from its middle axis: the inside's colour, bright where
// its normal, turned around, faces the light.
TEST(TwoSided, ABowlHasTheColourOfItsInside) {
  std::vector<shading::Surface> surfaces(1);
  TriangleMesh& mesh = surfaces[0].mesh;
  mesh = test::sphere_mesh(4, 10, {});
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return std::ranges::any_of(t, [&](std::uint32_t p) { return mesh.points[p].y > 0; });
  });
  shading::CameraOptions options;
  options.eye = Vec3{0, 80, 0};
  options.target = Vec3{};
  const shading::Camera camera = shading::make_camera(options, {}, 128, 128);
  const Vec3 light{0, 1e7, 0};
  const texture::Image image = drawn(shading::two_sided(surfaces, camera.eye), camera, light);
  for (int x = 44; x < 84; ++x) {                              // on a line across the middle
    const double across = ((x + 0.5) / 64 - 1) * camera.tan_x; // over the distance
    // The ray from the eye meets the sphere's far side.
    const double b = 80 / (1 + across * across), c = (6400 - 100.0) / (1 + across * across);
    const double t = b + std::sqrt(b * b - c), at = 80 - t;
    const double lit = -at / 10;
    if (!(lit > 0.2))
      continue;
    const std::size_t pixel = 3 * (std::size_t{128} * 64 + static_cast<std::size_t>(x));
    const std::array<double, 3> inside{0.5, 0.1, 0.2};
    for (std::size_t n = 0; n < 3; ++n) {
      const double expected = 255 * inside[n] * (0.4 + 0.6 * lit);
      EXPECT_NEAR(image.values[pixel + n], expected, 1.5) << x;
    }
  }
  // Without two sides the normals look away from the light.
  EXPECT_NEAR(drawn(surfaces, camera, light).values[3 * (128 * 64 + 64)], 255 * 0.8 * 0.4, 1);
}

} // namespace
} // namespace gewebe::test
