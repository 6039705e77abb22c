// Textures on the shape at rest: three projections and solid textures, by both backends against
// their formulas, and what must hold for them anywhere.

#include "base/error.h"
#include "formats/mesh/mesh_file.h"
#include "gl/gl_context.h"
#include "gl/gl_renderer.h"
#include "larger.h"
#include "mesh_fixtures.h"
#include "render/picture.h"
#include "render_oracle.h"
#include "render_scenes.h"
#include "shading/tangents.h"
#include "shading/uv.h"
#include "texture/rest.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <iostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::OracleComparison;
using test::OracleScene;
using test::spots;
using test::torus;

// What the program does before EGL starts.
const int float_filter = ::setenv("GALLIVM_PERF", "no_aos_sampling,no_filter_hacks", 0);

struct Case {
  OracleScene scene;
  std::string view = "iso";
  std::uint32_t width = 224, height = 160;
};

texture::SolidTexture solid(const char* text) {
  return texture::solid_texture_from_text(text);
}

TriangleMesh round_body() {
  return test::sphere_mesh(4, 30, {100, -20, 7});
}

Case case_of(TriangleMesh mesh) {
  Case c;
  c.scene.mesh = std::move(mesh);
  c.scene.mesh.texcoords.assign(c.scene.mesh.triangles.size(), {}); // the oracle's, unused
  c.scene.per_pixel = true;
  c.scene.offset = 0.05;
  c.scene.color = {1, 0.6, 0.52}; // no halves of 1/255 where nothing else is
  c.scene.rest = texture::rest_mapping(bounding_box(c.scene.mesh), 17.0);
  return c;
}

Case triplanar(TriangleMesh mesh) {
  Case c = case_of(std::move(mesh));
  c.scene.rest.triplanar = true;
  c.scene.base = spots(45, 37, 3);
  c.scene.detail = spots(20, 31, 3);
  for (std::uint8_t& value : c.scene.detail->values)
    value = static_cast<std::uint8_t>(value / 3);
  c.scene.structure = spots(40, 33, 1);
  return c;
}

Case noisy(TriangleMesh mesh) {
  Case c = case_of(std::move(mesh));
  c.scene.solid_base = solid("noise:scale=9,octaves=5,color=1/0.8/0.7,ground=0.2/0.3/0.1");
  c.scene.solid_detail = solid("veins:scale=12,seed=7,color=0.3/0/0.1,ground=0/0/0,octaves=2");
  c.scene.solid_structure = solid("noise:scale=6,octaves=3,seed=9,roughness=0.7");
  return c;
}

Case veiny(TriangleMesh mesh) {
  Case c = case_of(std::move(mesh));
  c.scene.solid_base = solid("veins:scale=15");
  c.scene.solid_structure = solid("veins:scale=15,width=0.2");
  return c;
}

shading::DrawingOptions drawing_options(const OracleScene& scene, const shading::Camera& camera) {
  shading::DrawingOptions options;
  options.rest = options.rest_normals = true;
  options.rest_light = scene.structure || scene.solid_structure;
  for (const OracleScene& other : scene.others) {
    options.groups.push_back(static_cast<std::int32_t>(options.groups.size()) + 1);
    options.rest_light = options.rest_light || other.structure || other.solid_structure;
  }
  options.per_pixel = true;
  options.light = scene.light;
  options.directional = scene.directional;
  options.offset = {scene.offset, scene.offset};
  options.camera = camera;
  return options;
}

bool has_gl() {
  static const bool there = [] {
    try {
      const gl::GlContext gl;
      return true;
    } catch (const Error&) {
      return false;
    }
  }();
  return there;
}

texture::Image draw(Case& c, render::Backend backend, shading::Camera& camera,
                    CpuLevel cpu = CpuLevel::avx2) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = c.scene.mesh;
  shading::CameraOptions view;
  view.view = c.view;
  camera = shading::make_camera(view, shading::rest_box(surfaces), c.width, c.height);
  if (!c.scene.directional)
    c.scene.light = shading::default_light(camera);
  render::PictureOptions picture;
  picture.backend = backend;
  picture.width = c.width;
  picture.height = c.height;
  Context context;
  context.cpu = test::smaller(context.cpu, cpu);
  return render::make_picture(
      shading::make_drawing(surfaces, drawing_options(c.scene, camera), context), camera,
      test::material_of(c.scene), picture, context);
}

/// Both backends against the formula.
void expect_equal(Case c, const std::string& name, double share = 0.85) {
  test::OraclePicture oracle;
  for (const render::Backend backend : {render::Backend::cpu, render::Backend::gl}) {
    if (backend == render::Backend::gl && (!has_gl() || c.scene.mipmap))
      continue; // drivers choose levels in their own ways
    shading::Camera camera;
    const texture::Image image = draw(c, backend, camera);
    if (oracle.empty())
      oracle = oracle_picture(c.scene, camera, c.width, c.height);
    const OracleComparison result = test::compare(image, oracle);
    std::cout << name << (backend == render::Backend::cpu ? " cpu" : " shader") << ": RMS "
              << result.rms_rounded << ", largest " << result.max << ", " << result.interior
              << " of " << result.covered << " pixels\n";
    EXPECT_GT(result.covered, 3000U) << name;
    EXPECT_GT(static_cast<double>(result.interior), share * static_cast<double>(result.covered));
    EXPECT_LE(result.rms_rounded, 0.05) << name;
    EXPECT_LE(result.max, 2) << name;
  }
}

TEST(RenderRest, TriplanarIsTheFormula) {
  expect_equal(triplanar(round_body()), "sphere");
  Case c = triplanar(torus(60, 30, false));
  expect_equal(c, "torus");
  c.scene.rest.sharpness = 7;
  c.scene.directional = true;
  c.scene.light = {-1, 2, 3};
  c.view = "left";
  expect_equal(c, "torus, sharper");
  c.scene.structure.reset();
  c.scene.rest.edge = 0.8;
  c.scene.mipmap = true;
  expect_equal(c, "torus, small", 0.5);
}

TEST(RenderRest, NoiseIsTheFormula) {
  expect_equal(noisy(round_body()), "sphere");
  expect_equal(noisy(torus(60, 30, false)), "torus");
  Case far = noisy(test::sphere_mesh(4, 30, {1e5, -2e4, 7e3}));
  expect_equal(far, "far away");
  far.scene.solid_structure->filtered = far.scene.solid_base->filtered = false;
  expect_equal(far, "not filtered");
}

TEST(RenderRest, VeinsAreTheFormula) {
  expect_equal(veiny(round_body()), "sphere");
  expect_equal(veiny(torus(60, 30, false)), "torus");
}

TEST(RenderRest, RealOrgan) {
  const std::string path = test::shared_folder() + "/data/sofa_liver_smooth.obj";
  if (!std::ifstream(path))
    GTEST_SKIP() << "no data";
  formats::Input input(path);
  const TriangleMesh liver = formats::read_mesh(input, {formats::Kind::obj, "cm", {}, false});
  for (const auto& [make, name] : {std::pair{&triplanar, "liver, triplanar"},
                                   {&noisy, "liver, noise"},
                                   {&veiny, "liver, veins"}}) {
    Case c = make(liver);
    c.view = "front";
    c.width = c.height = 200;
    expect_equal(c, name);
  }
}

// One by three projections; two solid ones, for which OpenGL has one program with other values.
TEST(RenderRest, EachMaterialHasItsOwn) {
  Case c = triplanar(torus(60, 30, false));
  for (std::size_t t = 0; t < c.scene.mesh.triangles.size(); ++t)
    c.scene.mesh.material.push_back(static_cast<std::int32_t>(t / 400 % 3));
  OracleScene second;
  second.solid_base = solid("noise:scale=9,color=1/0.8/0.7,ground=0.2/0.3/0.1");
  second.solid_structure = solid("veins:scale=15,width=0.2");
  OracleScene third = second;
  third.solid_base = solid("noise:scale=5,seed=3,color=0.1/0.4/1,ground=0.5/0.6/0");
  third.solid_structure->seed = 8;
  third.color = {0.7, 0.9, 0.8};
  c.scene.others = {second, third};
  expect_equal(c, "three materials");
  // That it can fail: a picture in which two of them are exchanged.
  Case exchanged = c;
  std::swap(exchanged.scene.others[0], exchanged.scene.others[1]);
  for (const render::Backend backend : {render::Backend::cpu, render::Backend::gl}) {
    if (backend == render::Backend::gl && !has_gl())
      continue;
    shading::Camera camera;
    const texture::Image image = draw(exchanged, backend, camera);
    c.scene.light = exchanged.scene.light;
    EXPECT_GT(test::compare(image, c.scene, camera).rms, 10);
  }
}

Vec3 rotated(const Vec3& p) { // by the quaternion (1; 2, -1, 0.5), about the origin
  const Vec3 v{2, -1, 0.5};
  const double square = 1 + dot(v, v);
  return (p * (1 - dot(v, v)) + 2 * v * dot(v, p) + 2 * cross(v, p)) / square;
}

bool equal_at_rest(const shading::Drawing& a, const shading::Drawing& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0);
  };
  return same(a.vertices, b.vertices) && same(a.rests, b.rests) && same(a.turns, b.turns) &&
         a.rest_origin == b.rest_origin && a.rest_scale == b.rest_scale &&
         a.triangles == b.triangles && a.group_start == b.group_start;
}

// A sequence at rest, moved twice, lit otherwise, and back at rest, next to a surface that rests.
TEST(RenderRest, ASequenceIsTheSameAsDrawingsMadeAnew) {
  for (const double shade : {0.0, 0.5}) {
    std::vector<shading::Surface> surfaces(2);
    surfaces[0].mesh = round_body();
    surfaces[1].mesh = test::sphere_mesh(2, 5, {140, 0, 0});
    surfaces[1].mesh.material.assign(surfaces[1].mesh.triangles.size(), 1);
    for (shading::Surface& surface : surfaces)
      surface.rest = surface.mesh.points;
    shading::DrawingOptions options;
    options.rest = options.rest_normals = options.rest_light = options.per_pixel = true;
    options.shade = shade;
    options.groups = {1};
    options.light = {300, 20, 100};
    shading::DrawingMaker maker;
    const shading::Drawing first = maker.make(surfaces, options, shading::DrawingChange::all, {});
    EXPECT_TRUE(equal_at_rest(first, shading::make_drawing(surfaces, options, {})));
    EXPECT_TRUE(first.turns.empty());
    for (int step = 0; step < 2; ++step) {
      for (Vec3& p : surfaces[0].mesh.points)
        p = rotated(p) * 1.1;
      const shading::Drawing moved =
          maker.make(surfaces, options, shading::DrawingChange::points, {});
      EXPECT_TRUE(equal_at_rest(moved, shading::make_drawing(surfaces, options, {}))) << step;
      EXPECT_EQ(moved.turns.size(), moved.vertices.size());
      EXPECT_EQ(moved.rests[7].place, first.rests[7].place);
    }
    options.light = {-300, 20, 100};
    const shading::Drawing lit = maker.make(surfaces, options, shading::DrawingChange::view, {});
    EXPECT_TRUE(equal_at_rest(lit, shading::make_drawing(surfaces, options, {})));
    EXPECT_FALSE(lit.turns.empty());
    // The other one moves instead.
    surfaces[0].mesh.points = surfaces[0].rest;
    for (Vec3& p : surfaces[1].mesh.points)
      p = rotated(p);
    const shading::Drawing other =
        maker.make(surfaces, options, shading::DrawingChange::points, {});
    EXPECT_TRUE(equal_at_rest(other, shading::make_drawing(surfaces, options, {})));
    surfaces[1].mesh.points = surfaces[1].rest;
    const shading::Drawing back = maker.make(surfaces, options, shading::DrawingChange::points, {});
    EXPECT_TRUE(equal_at_rest(back, shading::make_drawing(surfaces, options, {})));
    EXPECT_TRUE(back.turns.empty());
    // That telling it too little is seen.
    for (Vec3& p : surfaces[0].mesh.points)
      p = rotated(p);
    EXPECT_FALSE(equal_at_rest(maker.make(surfaces, options, shading::DrawingChange::view, {}),
                               shading::make_drawing(surfaces, options, {})));
  }
}

// What the comparison must see.
TEST(RenderRest, OtherFormulasAreSeen) {
  const auto seen = [](Case c, const std::function<void(OracleScene&)>& change) {
    c.width = 60;
    c.height = 50;
    shading::Camera camera;
    const texture::Image image = draw(c, render::Backend::cpu, camera);
    EXPECT_LE(test::compare(image, c.scene, camera).rms_rounded, 0.1);
    change(c.scene);
    EXPECT_GT(test::compare(image, c.scene, camera).rms_rounded, 0.5);
  };
  seen(triplanar(round_body()), [](OracleScene& s) { s.rest.sharpness = 5; });
  seen(triplanar(round_body()), [](OracleScene& s) { s.offset = -s.offset; });
  seen(triplanar(round_body()), [](OracleScene& s) { s.rest.start.y += 1; });
  seen(noisy(round_body()), [](OracleScene& s) { s.solid_base->seed = 2; });
  seen(noisy(round_body()), [](OracleScene& s) { s.solid_structure->octaves = 1; });
  seen(noisy(round_body()), [](OracleScene& s) { s.offset = -s.offset; });
  seen(veiny(round_body()), [](OracleScene& s) { s.solid_base->width *= 1.5; });
  Case fine = noisy(round_body());
  fine.scene.solid_base->scale = 2;
  seen(fine, [](OracleScene& s) { s.solid_base->filtered = false; });
}

TEST(RenderRest, BytesDoNotDependOnTheProcessor) {
  for (Case c : {triplanar(round_body()), noisy(round_body()), veiny(round_body())}) {
    c.scene.mipmap = true;
    shading::Camera camera;
    EXPECT_EQ(draw(c, render::Backend::cpu, camera, CpuLevel::baseline).values,
              draw(c, render::Backend::cpu, camera).values);
  }
}

// On a plane across an axis one projection is all, that of the box mapping.
TEST(RenderRest, TriplanarOfAPlaneIsTheBoxMapping) {
  for (int axis = 0; axis < 3; ++axis)
    for (const bool flip : {false, true}) {
      Case c = triplanar({});
      for (const auto& [s, t] : {std::pair{0.0, 0.0}, {40.0, 0.0}, {40.0, 30.0}, {0.0, 30.0}}) {
        Vec3 p{3, 3, 3};
        p[(axis + 1) % 3] += s;
        p[(axis + 2) % 3] += t;
        c.scene.mesh.points.push_back(p);
      }
      c.scene.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
      if (flip)
        c.scene.mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
      c.view = axis == 0 ? "right" : axis == 1 ? "front" : "top";
      c.scene.rest = texture::rest_mapping(bounding_box(c.scene.mesh), 17.0);
      c.scene.rest.triplanar = true;
      shading::Camera camera;
      const texture::Image three = draw(c, render::Backend::cpu, camera);
      std::vector<shading::Surface> surfaces(1);
      surfaces[0].mesh = c.scene.mesh;
      surfaces[0].mesh.texcoords.clear();
      shading::add_texcoords(surfaces, {shading::UvMapping::box, 17.0}, {});
      shading::DrawingOptions options = drawing_options(c.scene, camera);
      options.rest = options.rest_normals = options.rest_light = false;
      options.texcoords = options.structure = true;
      texture::SurfaceMaterial material = material_of(c.scene);
      material.rest.triplanar = false;
      render::PictureOptions picture;
      picture.backend = render::Backend::cpu;
      picture.width = c.width;
      picture.height = c.height;
      const texture::Image box = render::make_picture(shading::make_drawing(surfaces, options, {}),
                                                      camera, material, picture, {});
      int max = 0;
      for (std::size_t n = 0; n < box.values.size(); ++n)
        max = test::larger(max, std::abs(box.values[n] - three.values[n]));
      EXPECT_LE(max, 1) << axis << flip;
      EXPECT_GT(*std::max_element(box.values.begin(), box.values.end()), 100);
    }
}

// Tissue that is turned as a whole keeps its look, when camera and light turn with it.
TEST(RenderRest, ItStaysOnTissueThatMoves) {
  for (const Case& still :
       {triplanar(round_body()), noisy(round_body()), veiny(torus(60, 30, false))}) {
    Case c = still;
    shading::Camera camera;
    const texture::Image at_rest = draw(c, render::Backend::cpu, camera);
    std::vector<shading::Surface> surfaces(1);
    surfaces[0].mesh = c.scene.mesh;
    surfaces[0].rest = c.scene.mesh.points;
    const Vec3 away{300, 20, -50};
    for (Vec3& p : surfaces[0].mesh.points)
      p = rotated(p) + away;
    shading::Camera moved = camera;
    moved.eye = rotated(camera.eye) + away;
    moved.target = rotated(camera.target) + away;
    moved.right = rotated(camera.right);
    moved.up = rotated(camera.up);
    moved.back = rotated(camera.back);
    c.scene.light = rotated(c.scene.light) + away;
    const shading::Drawing drawing =
        shading::make_drawing(surfaces, drawing_options(c.scene, moved), {});
    EXPECT_EQ(drawing.turns.size(), drawing.vertices.size());
    for (const render::Backend backend : {render::Backend::cpu, render::Backend::gl}) {
      if (backend == render::Backend::gl && !has_gl())
        continue;
      render::PictureOptions picture;
      picture.backend = backend;
      picture.width = c.width;
      picture.height = c.height;
      const texture::Image image =
          render::make_picture(drawing, moved, material_of(c.scene), picture, {});
      std::size_t differ = 0, shown = 0;
      for (std::size_t n = 0; n < image.values.size(); ++n) {
        differ += std::abs(image.values[n] - at_rest.values[n]) > 2 ? 1U : 0U;
        shown += at_rest.values[n] > 0 ? 1U : 0U;
      }
      EXPECT_LT(differ, shown / 100); // along outlines
    }
    // That this can fail: the turns forgotten.
    shading::Drawing wrong = drawing;
    wrong.turns.clear();
    render::PictureOptions picture;
    picture.backend = render::Backend::cpu;
    picture.width = c.width;
    picture.height = c.height;
    const texture::Image image =
        render::make_picture(wrong, moved, material_of(c.scene), picture, {});
    std::size_t differ = 0;
    for (std::size_t n = 0; n < image.values.size(); ++n)
      differ += std::abs(image.values[n] - at_rest.values[n]) > 2 ? 1U : 0U;
    EXPECT_GT(differ, 5000U);
  }
}

TEST(RenderRest, TurnsAreTheRotation) {
  const TriangleMesh mesh = round_body();
  std::vector<Vec3> now = mesh.points;
  for (Vec3& p : now)
    p = rotated(p) * 1.5;
  const std::vector<Vec3> n0 = shading::area_normals(mesh.points, mesh.triangles),
                          n1 = shading::area_normals(now, mesh.triangles);
  const Vec3 x = rotated({1, 0, 0}), y = rotated({0, 1, 0});
  for (const texture::DrawTurn& turn :
       texture::rest_turns(mesh.points, n0, now, n1, mesh.triangles))
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(turn.x[a], x[static_cast<int>(a)], 1e-6);
      EXPECT_NEAR(turn.y[a], y[static_cast<int>(a)], 1e-6);
    }
  // Turned over: opposite normals.
  for (std::size_t p = 0; p < now.size(); ++p)
    now[p] = {mesh.points[p].x, -mesh.points[p].y, -mesh.points[p].z};
  const std::vector<texture::DrawTurn> over = texture::rest_turns(
      mesh.points, n0, now, shading::area_normals(now, mesh.triangles), mesh.triangles);
  for (const texture::DrawTurn& turn : over) {
    EXPECT_NEAR(turn.x[0], 1, 1e-6);
    EXPECT_NEAR(turn.y[1], -1, 1e-6);
  }
}

TEST(RenderRest, NoiseHasTheMomentsThatAreStated) {
  double sum = 0, squares = 0, max = 0, veins = 0, mean = 0;
  std::mt19937 random(3);
  const auto place = [&] {
    const auto one = [&] { return static_cast<double>(random()) / 4294967296.0 * 400 - 200; };
    return Vec3{one(), one(), one()};
  };
  texture::SolidTexture sharp = solid("veins:scale=1,octaves=1"), faded = sharp;
  constexpr int count = 40000;
  for (int n = 0; n < count; ++n) {
    const Vec3 p = place();
    const double value = test::noise_oracle(p, 2, 5);
    sum += value;
    squares += value * value;
    max = test::larger(max, std::fabs(value));
    veins += test::solid_oracle(sharp, p, 0) / count;
    mean += test::solid_oracle(faded, p, 5) / count;
  }
  EXPECT_NEAR(sum / count, 0, 0.01);
  EXPECT_NEAR(std::sqrt(squares / count), 0.27, 0.01);
  EXPECT_LT(max, 1);
  EXPECT_NEAR(veins, mean, 0.1 * mean); // what fades keeps its mean
}

TEST(RenderRest, FixedFunctionsRefuseAndAutomaticDraws) {
  if (!has_gl())
    GTEST_SKIP() << "no OpenGL";
  Case c = noisy(round_body());
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = c.scene.mesh;
  const shading::Camera camera = shading::make_camera({}, shading::rest_box(surfaces), 60, 40);
  const shading::Drawing drawing =
      shading::make_drawing(surfaces, drawing_options(c.scene, camera), {});
  render::PictureOptions picture;
  picture.width = 60;
  picture.height = 40;
  for (const gl::GlMode mode : {gl::GlMode::passes3, gl::GlMode::passes2, gl::GlMode::passes1}) {
    picture.gl.mode = mode;
    picture.backend = render::Backend::gl;
    EXPECT_THROW(render::make_picture(drawing, camera, material_of(c.scene), picture, {}), Error);
    picture.backend = render::Backend::automatic;
    render::PictureReport report;
    render::make_picture(drawing, camera, material_of(c.scene), picture, {}, &report);
    EXPECT_EQ(report.backend, render::Backend::cpu);
    EXPECT_FALSE(report.gl_failure.empty());
  }
}

TEST(SolidTexture, WrongTextsAreErrors) {
  EXPECT_TRUE(texture::is_solid_texture("noise"));
  EXPECT_TRUE(texture::is_solid_texture("veins:x"));
  EXPECT_FALSE(texture::is_solid_texture("noise.png"));
  EXPECT_FALSE(texture::is_solid_texture("./noise"));
  const texture::SolidTexture all =
      solid("veins:scale=2.5,octaves=12,seed=4294967295,roughness=1,width=0.2,"
            "ground=0/0.5/1,color=1/1/0");
  EXPECT_EQ(all.scale, 2.5);
  EXPECT_EQ(all.octaves, 12);
  EXPECT_EQ(all.seed, 4294967295U);
  EXPECT_EQ(all.ground, (Vec3{0, 0.5, 1}));
  for (const char* wrong : {"stone",
                            "noise:",
                            "noise:scale",
                            "noise:scale=",
                            "noise:scale=0",
                            "noise:scale=nan",
                            "noise:scale=1x",
                            "noise:octaves=0",
                            "noise:octaves=13",
                            "noise:octaves=1.5",
                            "noise:seed=-1",
                            "noise:seed=4294967296",
                            "noise:roughness=1.1",
                            "noise:width=0.1",
                            "veins:contrast=1",
                            "noise:color=1/1",
                            "noise:color=1/1/1/1",
                            "noise:color=2/0/0",
                            "noise:scale=1,",
                            "noise:scale=1,scale=2",
                            "noise:Scale=1"})
    EXPECT_THROW(solid(wrong), Error) << wrong;
}

} // namespace
} // namespace gewebe::test
