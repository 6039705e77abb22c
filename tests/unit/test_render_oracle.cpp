// Both backends against the formula of the report.

#include "base/error.h"
#include "formats/image/png.h"
#include "formats/mesh/mesh_file.h"
#include "gl/gl_context.h"
#include "gl/gl_renderer.h"
#include "mesh_fixtures.h"
#include "raster/raster_cpu.h"
#include "render/picture.h"
#include "render_oracle.h"
#include "render_scenes.h"
#include "shading/uv.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>

namespace gewebe::test {
namespace {

using test::compare;
using test::OracleComparison;
using test::OracleScene;
using test::spots;
using test::torus;

// What the program does before EGL starts.
const int float_filter = ::setenv("GALLIVM_PERF", "no_aos_sampling,no_filter_hacks", 0);

TriangleMesh quad(double width, double height, float s, float t) {
  TriangleMesh m;
  m.points = {{0, 0, 0}, {width, 0, 0}, {width, height, 0}, {0, height, 0}};
  m.triangles = {{0, 1, 2}, {0, 2, 3}};
  m.texcoords = {{0, 0, s, 0, s, t}, {0, 0, s, t, 0, t}};
  return m;
}

struct Case {
  OracleScene scene;
  shading::CameraOptions camera;
  std::uint32_t width = 224, height = 160;
  int samples = 1;
};

Case textured(TriangleMesh mesh, const std::string& view) {
  Case c;
  c.scene.mesh = std::move(mesh);
  c.scene.base = spots(45, 37, 3);
  c.scene.structure = spots(45, 37, 1); // of one size, for --passes 1
  c.scene.offset = 0.03;
  c.camera.view = view;
  return c;
}

/// A way of drawing, and what it is held to: RMS against the oracle rounded to 8 bits.
struct Mode {
  const char* name;
  render::Backend backend;
  gl::GlMode gl;
  bool wide, per_pixel;
  double rms;
};

constexpr Mode modes[] = {
    {"cpu", render::Backend::cpu, gl::GlMode::shader, true, true, 0.05},
    {"cpu_by_vertex", render::Backend::cpu, gl::GlMode::shader, true, false, 0.05},
    {"shader", render::Backend::gl, gl::GlMode::shader, true, true, 0.05},
    {"shader_by_vertex", render::Backend::gl, gl::GlMode::shader, true, false, 0.05},
    {"passes3", render::Backend::gl, gl::GlMode::passes3, true, false, 0.1},
    {"passes2", render::Backend::gl, gl::GlMode::passes2, true, false, 0.1},
    {"passes1", render::Backend::gl, gl::GlMode::passes1, true, false, 0.5},
    {"passes3_8bit", render::Backend::gl, gl::GlMode::passes3, false, false, 0.9},
    {"passes2_8bit", render::Backend::gl, gl::GlMode::passes2, false, false, 0.9},
    {"passes1_8bit", render::Backend::gl, gl::GlMode::passes1, false, false, 0.5}};

bool is_there(const Mode& mode) {
  static const bool gl_is_there = [] {
    try {
      const gl::GlContext gl;
      return true;
    } catch (const Error&) {
      return false;
    }
  }();
  return mode.backend == render::Backend::cpu || gl_is_there;
}

texture::Image draw(const Case& c, const Mode& mode, shading::Camera& camera, Vec3& light,
                    double sign = 1) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = c.scene.mesh;
  camera = shading::make_camera(c.camera, shading::rest_box(surfaces), c.width, c.height);
  light = c.scene.directional ? c.scene.light : shading::default_light(camera);
  shading::DrawingOptions options;
  options.texcoords = true;
  options.structure = c.scene.structure || c.scene.heights;
  options.sphere = c.scene.reflection.has_value();
  for (const OracleScene& other : c.scene.others) {
    options.groups.push_back(static_cast<std::int32_t>(options.groups.size()) + 1);
    options.structure = options.structure || other.structure;
    options.sphere = options.sphere || other.reflection;
  }
  options.wet = c.scene.film.amount > 0;
  options.per_pixel = mode.per_pixel;
  options.light = light;
  options.directional = c.scene.directional;
  options.offset = {sign * c.scene.offset, sign * c.scene.offset};
  options.shade = c.scene.shade;
  options.full_distance = c.scene.full_distance;
  options.camera = camera;
  render::PictureOptions picture;
  picture.backend = mode.backend;
  picture.gl.mode = mode.gl;
  picture.gl.wide = mode.wide;
  picture.samples = c.samples;
  picture.width = c.width;
  picture.height = c.height;
  return render::make_picture(shading::make_drawing(surfaces, options, {}), camera,
                              test::material_of(c.scene), picture, {});
}

/// `name` names the case within its test: modes share its oracle.
OracleComparison held_against_oracle(Case c, const Mode& mode, const std::string& name = "",
                                     double sign = 1, bool clamp_early = false) {
  shading::Camera camera;
  const texture::Image image = draw(c, mode, camera, c.scene.light, sign);
  c.scene.clamp_early = clamp_early;
  c.scene.per_pixel = mode.per_pixel;
  static std::map<std::string, test::OraclePicture> kept;
  const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
  test::OraclePicture& oracle =
      kept[test.substr(0, test.find('/')) + " " + name + (mode.per_pixel ? " pixel" : " vertex") +
           (clamp_early ? " clamped" : "")];
  if (oracle.empty())
    oracle = oracle_picture(c.scene, camera, image.width, image.height);
  return compare(image, oracle);
}

class RenderOracle : public testing::TestWithParam<Mode> {
protected:
  void SetUp() override {
    if (!is_there(GetParam()))
      GTEST_SKIP() << "no OpenGL";
  }

  static void expect_equal(const Case& c, const char* name) {
    const OracleComparison result = held_against_oracle(c, GetParam(), name);
    RecordProperty(std::string(name) + ".rms", std::to_string(result.rms_rounded));
    EXPECT_GT(result.covered, 3000U);
    EXPECT_GT(static_cast<double>(result.interior), 0.85 * static_cast<double>(result.covered));
    EXPECT_LE(result.max, GetParam().wide ? 2 : 4) << name;
    EXPECT_LE(result.rms_rounded, GetParam().rms) << name;
  }
};

TEST_P(RenderOracle, Sphere) {
  TriangleMesh ball = test::sphere_mesh(4, 30, {100, -20, 7});
  shading::UvFrame frame{shading::UvMapping::sphere, bounding_box(ball), 1};
  ball.texcoords = shading::make_texcoords(ball.points, ball.triangles, frame, {});
  expect_equal(textured(ball, "iso"), "sphere");
}

TEST_P(RenderOracle, BoxMappedSphereFarAway) {
  TriangleMesh ball = test::sphere_mesh(3, 30, {1e5, -20, 7});
  shading::UvFrame frame{shading::UvMapping::box, bounding_box(ball), 25};
  ball.texcoords = shading::make_texcoords(ball.points, ball.triangles, frame, {});
  for (const char* view : {"front", "left", "right", "bottom"})
    expect_equal(textured(ball, view), view);
}

TEST_P(RenderOracle, Torus) {
  expect_equal(textured(torus(60, 30, false), "top"), "torus");
}

TEST_P(RenderOracle, MirroredTorus) {
  expect_equal(textured(torus(60, 30, true), "iso"), "mirrored torus");
}

TEST_P(RenderOracle, ShadedAndColored) {
  Case c = textured(torus(40, 20, false), "iso");
  c.scene.shade = 0.6;
  c.scene.color = {1, 0.5, 0.8};
  expect_equal(c, "shaded");
  c.scene.base.reset();
  expect_equal(c, "without base");
  c.scene.structure.reset();
  expect_equal(c, "without any texture");
  c.scene.base = spots(31, 8, 1);
  expect_equal(c, "without structure");
}

TEST_P(RenderOracle, CameraInsideTheSurface) {
  Case c = textured(torus(40, 20, false), "top");
  c.camera.eye = Vec3{20, 1, 0.5};
  c.camera.target = Vec3{0, 20, 2};
  c.camera.fov = 75;
  expect_equal(c, "from inside");
}

TEST_P(RenderOracle, StrongPerspective) {
  Case c = textured(quad(200, 30, 20, 3), "top");
  c.camera.eye = Vec3{-4, 15, 6};
  c.camera.target = Vec3{60, 15, 0};
  c.camera.fov = 70;
  expect_equal(c, "plain to the horizon");
}

TEST_P(RenderOracle, DetailReflectionAndLightFarAway) {
  Case c = textured(torus(60, 30, false), "iso");
  c.scene.color = {0.5, 0.4, 0.3};
  c.scene.detail = spots(20, 31, 3);
  for (std::uint8_t& value : c.scene.detail->values)
    value = static_cast<std::uint8_t>(value / 3);
  c.scene.reflection = spots(33, 40, 3);
  for (std::uint8_t& value : c.scene.reflection->values)
    value = static_cast<std::uint8_t>(value / 2);
  c.scene.directional = true;
  c.scene.light = {3, 1, 2};
  const OracleComparison result = held_against_oracle(c, GetParam());
  EXPECT_LE(result.rms_rounded, GetParam().wide ? GetParam().rms : 1.5);
  c.scene.structure.reset();
  EXPECT_LE(held_against_oracle(c, GetParam(), "flat").rms_rounded, 0.1);
}

TEST_P(RenderOracle, TexturesThatShrink) {
  if (GetParam().backend != render::Backend::cpu)
    GTEST_SKIP() << "drivers choose levels in their own ways";
  Case c = textured(quad(200, 30, 200, 30), "top");
  c.camera.eye = Vec3{-4, 15, 6};
  c.camera.target = Vec3{60, 15, 0};
  c.camera.fov = 70;
  c.scene.mipmap = true;
  c.scene.base = spots(45, 37, 3);
  c.scene.structure = spots(64, 51, 1);
  expect_equal(c, "mipmaps");
}

// Three materials on one torus: all textures, others without structure, none but a structure.
Case three_materials() {
  Case c = textured(torus(60, 30, true), "iso");
  c.scene.shade = 0.3;
  for (std::size_t t = 0; t < c.scene.mesh.triangles.size(); ++t)
    c.scene.mesh.material.push_back(static_cast<std::int32_t>(t / 77 % 3));
  OracleScene second, third;
  second.base = spots(19, 64, 3);
  second.detail = spots(20, 31, 3);
  second.reflection = spots(33, 40, 3);
  for (texture::Image* image : {&*second.detail, &*second.reflection})
    for (std::uint8_t& value : image->values)
      value = static_cast<std::uint8_t>(value / 3);
  third.structure = spots(50, 20, 1);
  third.color = {0.9, 0.3, 0.1};
  c.scene.others = {second, third};
  return c;
}

TEST_P(RenderOracle, EachMaterialHasItsOwnTextures) {
  Case c = three_materials();
  expect_equal(c, "three materials");
  // That it can fail: a picture in which two of them are exchanged.
  Case exchanged = c;
  std::swap(exchanged.scene.others[0], exchanged.scene.others[1]);
  shading::Camera camera;
  const texture::Image image = draw(exchanged, GetParam(), camera, c.scene.light);
  c.scene.per_pixel = GetParam().per_pixel;
  EXPECT_GT(compare(image, c.scene, camera).rms, 20);
}

// Groups that look alike are one: the same bytes, with four samples too.
TEST_P(RenderOracle, EqualMaterialsAreDrawnAsOne) {
  for (const int samples : {1, 4}) {
    Case c = three_materials();
    c.samples = samples;
    c.width = 112;
    c.height = 80;
    c.scene.detail = spots(20, 31, 3);
    c.scene.others.clear();
    shading::Camera camera;
    Vec3 light;
    const texture::Image one = draw(c, GetParam(), camera, light);
    c.scene.others = {c.scene, c.scene};
    const texture::Image grouped = draw(c, GetParam(), camera, light);
    EXPECT_TRUE(grouped == one) << samples;
    c.scene.others[1].color = {0.4, 0.4, 0.4};
    EXPECT_FALSE(draw(c, GetParam(), camera, light) == one);
  }
}

// More passes than the stencil of OpenGL can count.
TEST_P(RenderOracle, SixtyMaterials) {
  Case c = textured(torus(30, 20, false), "iso");
  c.width = 112;
  c.height = 80;
  for (std::size_t t = 0; t < c.scene.mesh.triangles.size(); ++t)
    c.scene.mesh.material.push_back(static_cast<std::int32_t>(t / 2 % 60));
  for (int n = 1; n < 60; ++n) {
    OracleScene& other = c.scene.others.emplace_back();
    other.structure = c.scene.structure;
    if (n % 3 == 0)
      other.detail = spots(8, 8, 3);
    other.color = {n / 60.0, 0.5, 1 - n / 60.0};
  }
  const OracleComparison result = held_against_oracle(c, GetParam());
  EXPECT_GT(result.interior, 1000U);
  EXPECT_LE(result.max, 2);
  EXPECT_LE(result.rms_rounded, GetParam().rms);
}

// Heights of 16 bits that change by a twelfth over the whole texture: in 8 bits they are 21 steps.
TEST_P(RenderOracle, ShallowHeightsAreSmoothIn16BitsAndStepsIn8) {
  Case c;
  c.scene.mesh = quad(100, 70, 1, 1);
  c.camera.view = "top";
  c.scene.offset = 0.2;
  c.scene.color = {1, 0.9, 0.8};
  texture::Heights heights{96, 64, {}};
  texture::Image steps{96, 64, 1, {}};
  for (unsigned y = 0; y < 64; ++y)
    for (unsigned x = 0; x < 96; ++x) {
      const double f = 0.5 + 0.04 * std::sin(x / 96.0 * 6.2831853) * std::cos(y / 64.0 * 6.2831853);
      heights.values.push_back(static_cast<std::uint16_t>(f * 65535));
      steps.values.push_back(static_cast<std::uint8_t>(f * 255));
    }
  c.scene.heights = heights;
  expect_equal(c, "smooth");
  // Drawn of the steps, and held against the smooth ones.
  Case coarse = c;
  coarse.scene.heights.reset();
  coarse.scene.structure = steps;
  shading::Camera camera;
  const texture::Image image = draw(coarse, GetParam(), camera, c.scene.light);
  c.scene.per_pixel = GetParam().per_pixel;
  const OracleComparison stepped = compare(image, c.scene, camera);
  RecordProperty("stepped.rms", std::to_string(stepped.rms_rounded));
  EXPECT_GT(stepped.rms_rounded, 0.35);
}

Case wet_torus() {
  Case c = textured(torus(60, 30, false), "iso");
  c.scene.shade = 0.6;
  c.scene.color = {0.7, 0.4, 0.3};
  c.scene.film = {0.8, 0.4, texture::water_reflectance};
  c.scene.background = {0.2, 0.3, 0.6};
  return c;
}

TEST_P(RenderOracle, WetFilm) {
  Case c = wet_torus();
  if (!GetParam().per_pixel) {
    EXPECT_THROW(held_against_oracle(c, GetParam()), Error);
    return;
  }
  expect_equal(c, "wet");
  c.scene.full_distance = 70;
  expect_equal(c, "light that falls off");
  c.scene.full_distance = 0;
  c.scene.directional = true;
  c.scene.light = {3, 1, 2};
  expect_equal(c, "light far away");
  c.scene.structure.reset();
  c.scene.film.reflectance = texture::steel_reflectance;
  expect_equal(c, "smooth steel");
  // That it can fail: another film, relief the other way around.
  for (const double roughness : {0.4, 0.5}) {
    Case other = wet_torus();
    other.scene.film.roughness = roughness;
    shading::Camera camera;
    const texture::Image image =
        draw(other, GetParam(), camera, c.scene.light, roughness > 0.4 ? 1 : -1);
    other.scene.film.roughness = 0.4;
    other.scene.light = c.scene.light;
    other.scene.per_pixel = true;
    EXPECT_GT(compare(image, other.scene, camera).rms, 1) << roughness;
  }
}

// Light and eye along the normal: H = F0 / (4 a²), and b is seen by F0 of it.
TEST_P(RenderOracle, WetFilmSeenFromTheLight) {
  if (!GetParam().per_pixel)
    return; // none without frames for each pixel, as above
  Case c;
  c.scene.mesh = quad(100, 100, 1, 1);
  c.camera.view = "top";
  c.width = c.height = 101;
  c.scene.directional = true;
  c.scene.light = {0, 0, 1};
  c.scene.color = {0.5, 0.25, 0.125};
  c.scene.background = {0, 1, 0.5};
  for (const double roughness : {0.1, 0.35, 1.0}) {
    c.scene.film = {0.7, roughness, texture::water_reflectance};
    shading::Camera camera;
    Vec3 light;
    const texture::Image image = draw(c, GetParam(), camera, light);
    const double h = texture::water_reflectance / (4 * std::pow(roughness, 4));
    for (int n = 0; n < 3; ++n) {
      const double own = c.scene.color[n];
      EXPECT_NEAR(image.values[3 * (101 * 50 + 50) + static_cast<std::size_t>(n)],
                  255 * std::min(1.0, own + 0.7 * (texture::water_reflectance *
                                                       (c.scene.background[n] - own) +
                                                   h)),
                  0.51)
          << roughness << n;
    }
  }
}

// What the comparison must see.
TEST_P(RenderOracle, WrongSignOfTheOffsetIsSeen) {
  const Case c = textured(torus(60, 30, false), "top");
  EXPECT_LE(held_against_oracle(c, GetParam()).max, GetParam().wide ? 2 : 4);
  const OracleComparison wrong = held_against_oracle(c, GetParam(), "", -1);
  EXPECT_GT(wrong.max, 20);
  EXPECT_GT(wrong.rms, 5);
}

TEST_P(RenderOracle, EarlyClampIsSeen) {
  const OracleComparison wrong =
      held_against_oracle(textured(torus(60, 30, false), "top"), GetParam(), "", 1, true);
  EXPECT_GT(wrong.max, 20);
}

// A ramp has the same slope everywhere, so the relief is a number that can be written down.
TEST_P(RenderOracle, FlatRampHasItsAnalyticValue) {
  for (const bool to_right : {true, false}) {
    Case c;
    c.scene.mesh = quad(100, 100, 1, 1);
    c.camera.view = "top";
    texture::Image ramp{256, 1, 1, {}};
    for (unsigned x = 0; x < 256; ++x)
      ramp.values.push_back(static_cast<std::uint8_t>(x));
    c.scene.structure = ramp;
    c.scene.color = {0.5, 0.25, 1};
    std::vector<shading::Surface> surfaces(1);
    surfaces[0].mesh = c.scene.mesh;
    const shading::Camera camera =
        shading::make_camera(c.camera, shading::rest_box(surfaces), 64, 64);
    shading::DrawingOptions options;
    options.texcoords = options.structure = true;
    options.offset = {0.2, 0.2};
    options.per_pixel = GetParam().per_pixel;
    // 30 degrees above the plane, so far that it is the same at every vertex.
    options.light = Vec3{(to_right ? 1 : -1) * std::sqrt(0.75), 0, 0.5} * 1e9;
    texture::SurfaceMaterial material;
    material.structure = texture::texture_from(ramp);
    material.color = c.scene.color;
    render::PictureOptions picture;
    picture.width = picture.height = 64;
    picture.backend = GetParam().backend;
    picture.gl.mode = GetParam().gl;
    picture.gl.wide = GetParam().wide;
    const texture::Image image = render::make_picture(shading::make_drawing(surfaces, options, {}),
                                                      camera, material, picture, {});
    const double ds = (to_right ? 1 : -1) * 0.2 * std::sqrt(0.75);
    const double r = 0.5 - 0.5 * ds * 256 / 255;
    constexpr std::size_t middle = std::size_t{3} * 64 * 32 + 96;
    for (std::size_t n = 0; n < 3; ++n)
      EXPECT_NEAR(image.values[middle + n],
                  255 * std::min(1.0, 2 * r * c.scene.color[static_cast<int>(n)]),
                  GetParam().wide ? 0.51 : 2)
          << to_right << n;
    // A height that grows to the right is lit from the left.
    EXPECT_EQ(image.values[middle] > 128, !to_right);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, RenderOracle,
                         testing::ValuesIn(std::begin(modes), std::begin(modes) + 7),
                         [](const auto& parameter) { return parameter.param.name; });

// The figures of the man page, at 512 x 512: every mode on four shapes.
class RenderOracleLarge : public testing::Test {
protected:
  static void hold(Case c, const char* name) {
    c.width = c.height = 512;
    for (const bool per_pixel : {true, false}) {
      c.scene.per_pixel = per_pixel;
      test::OraclePicture oracle;
      for (const Mode& mode : modes) {
        if (mode.per_pixel != per_pixel || !is_there(mode))
          continue;
        shading::Camera camera;
        const texture::Image image = draw(c, mode, camera, c.scene.light);
        if (oracle.empty())
          oracle = oracle_picture(c.scene, camera, c.width, c.height);
        const OracleComparison result = compare(image, oracle);
        RecordProperty(mode.name, std::to_string(result.rms_rounded));
        std::cout << name << ' ' << mode.name << ": RMS " << result.rms_rounded << " of "
                  << mode.rms << " (before rounding " << result.rms << "), largest " << result.max
                  << ", " << result.interior << " of " << result.covered << " pixels\n";
        EXPECT_LE(result.rms_rounded, mode.rms) << name << ' ' << mode.name;
        EXPECT_GT(result.interior, 20000U);
        EXPECT_GT(static_cast<double>(result.interior), 0.85 * static_cast<double>(result.covered));
      }
    }
  }
  static texture::Image liver_texture() {
    const std::string path = test::shared_folder() + "/data/sofa_liver_texture_square.png";
    std::ifstream png(path, std::ios::binary);
    if (!png)
      return {};
    return formats::read_png(std::string((std::istreambuf_iterator<char>(png)), {}), path);
  }
};

TEST_F(RenderOracleLarge, Sphere) {
  TriangleMesh ball = test::sphere_mesh(4, 30, {100, -20, 7});
  shading::UvFrame frame{shading::UvMapping::sphere, bounding_box(ball), 1};
  ball.texcoords = shading::make_texcoords(ball.points, ball.triangles, frame, {});
  hold(textured(ball, "iso"), "sphere");
}

TEST_F(RenderOracleLarge, Torus) {
  hold(textured(torus(60, 30, true), "iso"), "torus");
}

TEST_F(RenderOracleLarge, SpleenWithItsOwnCoordinates) {
  const texture::Image texture = liver_texture();
  if (texture.width == 0)
    GTEST_SKIP() << "no data";
  formats::Input input(test::shared_folder() + "/data/hubmap_F_spleen_uv.obj");
  Case c = textured(formats::read_mesh(input, {formats::Kind::obj, "m", {}, false}), "front");
  ASSERT_FALSE(c.scene.mesh.texcoords.empty());
  c.scene.base = texture;
  c.scene.structure = texture::luminance(texture);
  c.scene.offset = 0.005;
  hold(c, "spleen");
}

TEST_F(RenderOracleLarge, Liver) {
  const texture::Image texture = liver_texture();
  if (texture.width == 0)
    GTEST_SKIP() << "no data";
  formats::Input input(test::shared_folder() + "/data/sofa_liver_smooth.obj");
  TriangleMesh liver = formats::read_mesh(input, {formats::Kind::obj, "cm", {}, false});
  shading::UvFrame frame{shading::UvMapping::sphere, bounding_box(liver), 1};
  liver.texcoords = shading::make_texcoords(liver.points, liver.triangles, frame, {});
  Case c = textured(liver, "front");
  c.scene.base = texture;
  c.scene.structure = texture::luminance(texture);
  c.scene.offset = 0.005;
  hold(c, "liver");
}

} // namespace
} // namespace gewebe::test
