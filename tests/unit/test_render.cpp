// The parts of rendering: camera, coordinates, tangents, images.

#include "base/error.h"
#include "larger.h"
#include "mesh_fixtures.h"
#include "model_meshes.h"
#include "render/picture.h"
#include "shading/angles.h"
#include "shading/camera.h"
#include "shading/drawing.h"
#include "shading/style.h"
#include "shading/tangents.h"
#include "shading/uv.h"
#include "texture/image.h"
#include "texture/texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gewebe::test {
namespace {

constexpr double pi = 3.14159265358979323846;

TEST(RenderAngles, AgreeWithLibm) {
  for (int n = 0; n < 242; ++n) {
    const double degrees = 0.37 * n;
    EXPECT_NEAR(shading::tangent(degrees), std::tan(degrees * pi / 180),
                1e-13 * (1 + std::tan(degrees * pi / 180)));
  }
  for (int n = 0; n < 628; ++n) {
    const double a = 0.01 * n;
    EXPECT_NEAR(shading::turn(3 * std::cos(a), 3 * std::sin(a)), a / (2 * pi), 1e-15);
  }
  EXPECT_EQ(shading::turn(0, 0), 0);
  EXPECT_EQ(shading::turn(-1, 0), 0.5);
  EXPECT_EQ(shading::turn(0, -1), 0.75);
}

std::array<double, 4> clip_of(const shading::Projection& projection, const Vec3& q) {
  std::array<double, 4> clip{};
  for (std::size_t r = 0; r < 4; ++r) {
    const auto& m = projection.matrix[r];
    clip[r] = m[0] * q.x + m[1] * q.y + m[2] * q.z + m[3];
  }
  return clip;
}

TEST(RenderCamera, EveryViewShowsTheWholeBoxAndFillsThePicture) {
  const Box3 box{{-30, 10, 5}, {50, 40, 125}};
  for (const std::string& view : shading::view_names())
    for (const auto& [w, h] : {std::pair{512U, 512U}, {640U, 200U}, {100U, 900U}}) {
      shading::CameraOptions options;
      options.view = view;
      const shading::Camera camera = shading::make_camera(options, box, w, h);
      EXPECT_NEAR(dot(cross(camera.right, camera.up), camera.back), 1, 1e-12);
      const shading::Projection projection = shading::make_projection(camera, box, {1, 2, 3}, 7);
      double max = 0;
      for (int c = 0; c < 8; ++c) {
        const Vec3 p{(c & 1) != 0 ? box.max.x : box.min.x, (c & 2) != 0 ? box.max.y : box.min.y,
                     (c & 4) != 0 ? box.max.z : box.min.z};
        const auto clip = clip_of(projection, (p - Vec3{1, 2, 3}) / 7);
        EXPECT_GT(clip[3], projection.near);
        EXPECT_LE(std::fabs(clip[2]), clip[3]) << view;
        for (const std::size_t a : {0U, 1U})
          max = test::larger(max, std::fabs(clip[a]) / clip[3]);
      }
      EXPECT_LT(max, 1);
      EXPECT_GT(max, 0.9) << view;
    }
}

TEST(RenderCamera, SidesAreThePatients) {
  const Box3 box{{-1, -1, -1}, {1, 1, 1}};
  const auto camera = [&](const char* view) {
    shading::CameraOptions options;
    options.view = view;
    return shading::make_camera(options, box, 8, 8);
  };
  EXPECT_EQ(camera("front").right, (Vec3{-1, 0, 0})); // the right hand (+x) is at the left
  EXPECT_EQ(camera("front").up, (Vec3{0, 0, 1}));
  EXPECT_GT(camera("front").eye.y, 1);
  EXPECT_LT(camera("left").eye.x, -1);
  EXPECT_GT(camera("right").eye.x, 1);
  EXPECT_EQ(camera("top").up, (Vec3{0, 1, 0}));
  EXPECT_EQ(camera("top").right, (Vec3{1, 0, 0}));
  EXPECT_EQ(camera("bottom").right, (Vec3{-1, 0, 0}));
  const shading::Camera front = camera("front");
  const Vec3 light = shading::default_light(front) - front.target;
  EXPECT_GT(dot(light, front.up), 0);
  EXPECT_LT(dot(light, front.right), 0);
  EXPECT_GT(dot(light, front.back), 0);
}

TEST(RenderCamera, RefusesWhatIsNoView) {
  const Box3 box{{-1, -1, -1}, {1, 1, 1}};
  shading::CameraOptions options;
  options.eye = Vec3{0, 0, 0};
  EXPECT_THROW((void)shading::make_camera(options, box, 8, 8), Error); // eye is target
  options.eye = Vec3{0, 0, 9};
  EXPECT_NO_THROW(
      (void)shading::make_camera(options, box, 8, 8)); // along the usual up: another is taken
  options.up = Vec3{0, 0, -3};
  EXPECT_THROW((void)shading::make_camera(options, box, 8, 8), Error);
  options = {};
  EXPECT_THROW((void)shading::make_camera(options, {{-1e308, -1e308, 0}, {1e308, 1e308, 1}}, 8, 8),
               Error);
  EXPECT_NO_THROW((void)shading::make_camera(options, {}, 8, 8));
  EXPECT_NO_THROW((void)shading::make_camera(options, {{3, 3, 3}, {3, 3, 3}}, 8, 8));
}

TEST(RenderUv, SphereFollowsLongitudeAndLatitudeWithoutATear) {
  const TriangleMesh ball = test::sphere_mesh(4, 5, {1, 2, 3});
  const shading::UvFrame frame{shading::UvMapping::sphere, bounding_box(ball), 1};
  const auto texcoords = shading::make_texcoords(ball.points, ball.triangles, frame, {});
  int across = 0;
  for (std::size_t t = 0; t < texcoords.size(); ++t) {
    double low = 9, high = -9;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 p = ball.points[ball.triangles[t][c]] - Vec3{1, 2, 3};
      const double s = texcoords[t][2 * c];
      low = test::smaller(low, s);
      high = test::larger(high, s);
      if (std::hypot(p.x, p.y) > 1e-6) {
        const double expected = std::atan2(p.y, p.x) / (2 * pi);
        EXPECT_NEAR(std::remainder(s - expected, 1.0), 0, 1e-6);
      }
      EXPECT_NEAR(texcoords[t][2 * c + 1], std::asin(p.z / 5) / pi + 0.5, 1e-6);
    }
    const double height = std::fabs(ball.points[ball.triangles[t][0]].z - 3);
    if (height < 4.5) {
      EXPECT_LT(high - low, 0.2) << t;
    }
    across += high > 1 ? 1 : 0;
  }
  EXPECT_GT(across, 10); // the seam was met
}

TEST(RenderUv, TrianglesOfUpToHalfATurnGoOnAcrossTheSeam) {
  // A coarse mesh: each triangle spans 0.05 to 0.45 turns, wherever it begins.
  for (const shading::UvMapping mapping :
       {shading::UvMapping::sphere, shading::UvMapping::cylinder})
    for (int begin = 0; begin < 40; ++begin)
      for (int width = 2; width <= 18; ++width)
        for (int middle = 1; middle < width; middle += 3) {
          std::vector<Vec3> points;
          for (const int at : {0, width, middle}) {
            const double angle = 2 * pi * ((begin + at) / 40.0 + 0.003);
            points.push_back({std::cos(angle), std::sin(angle), at == middle ? 0.3 : -0.2});
          }
          const shading::UvFrame frame{mapping, {{-1, -1, -1}, {1, 1, 1}}, 1};
          const std::vector<Triangle> triangles{{0, 1, 2}};
          const auto st = shading::make_texcoords(points, triangles, frame, {}).at(0);
          const auto s = [&](std::size_t corner) { return static_cast<double>(st[2 * corner]); };
          ASSERT_NEAR(s(1) - s(0), width / 40.0, 1e-6) << begin << ' ' << width;
          ASSERT_NEAR(s(2) - s(0), middle / 40.0, 1e-6) << begin << ' ' << width;
        }
}

TEST(RenderUv, BoxIsUprightAndUnmirroredSeenFromOutside) {
  const TriangleMesh cube = test::sphere_mesh(3, 10, {0, 0, 0});
  const shading::UvFrame frame{shading::UvMapping::box, bounding_box(cube), 4};
  const auto texcoords = shading::make_texcoords(cube.points, cube.triangles, frame, {});
  for (std::size_t t = 0; t < texcoords.size(); ++t) {
    const auto& st = texcoords[t];
    const double area =
        double{st[2] - st[0]} * (st[5] - st[1]) - double{st[4] - st[0]} * (st[3] - st[1]);
    EXPECT_GT(area, 0) << t; // counter-clockwise outside, counter-clockwise in the texture
    for (const float value : st) {
      EXPECT_GE(value, -5.1);
      EXPECT_LE(value, 5.1);
    }
  }
}

TEST(RenderUv, BoxStaysInPlaceFarAwayAndOnMovedTissue) {
  const TriangleMesh near = test::sphere_mesh(2, 10, {0, 0, 0});
  TriangleMesh far = near;
  for (Vec3& p : far.points)
    p += Vec3{4e6, -8e6, 12e6}; // whole texture edges
  std::vector<shading::Surface> surfaces(2);
  surfaces[0].mesh = near;
  std::vector<shading::Surface> moved(1);
  moved[0].mesh = far;
  shading::UvOptions options;
  options.mapping = shading::UvMapping::box;
  options.edge = 4;
  surfaces.resize(1);
  EXPECT_EQ(shading::add_texcoords(surfaces, options, {}), 1U);
  EXPECT_EQ(shading::add_texcoords(moved, options, {}), 1U);
  for (std::size_t t = 0; t < near.triangles.size(); ++t)
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR(surfaces[0].mesh.texcoords[t][k], moved[0].mesh.texcoords[t][k], 1e-6);
  // The same tissue somewhere else has the coordinates of its rest.
  std::vector<shading::Surface> pulled(1);
  pulled[0].mesh = far;
  pulled[0].rest = near.points;
  (void)shading::add_texcoords(pulled, options, {});
  EXPECT_EQ(pulled[0].mesh.texcoords, surfaces[0].mesh.texcoords);
  // Coordinates of a surface's own stay unless a mapping is asked for.
  EXPECT_EQ(shading::add_texcoords(pulled, {}, {}), 0U);
}

TEST(RenderTangents, OfASphereAreEastAndNorth) {
  TriangleMesh ball = test::sphere_mesh(5, 5, {0, 0, 0});
  const shading::UvFrame frame{shading::UvMapping::sphere, bounding_box(ball), 1};
  ball.texcoords = shading::make_texcoords(ball.points, ball.triangles, frame, {});
  const std::vector<Vec3> normals = shading::render_normals(ball);
  const shading::TexturedVertices v = shading::split_vertices(ball, ball.texcoords, &normals, {});
  int checked = 0;
  for (std::size_t n = 0; n < v.point.size(); ++n) {
    const Vec3 p = ball.points[v.point[n]] / 5;
    if (std::fabs(p.z) > 0.9)
      continue;
    const Vec3 east = cross(Vec3{0, 0, 1}, p) / norm(cross(Vec3{0, 0, 1}, p));
    EXPECT_GT(dot(v.tangent[n], east), 0.995);
    EXPECT_GT(dot(v.bitangent[n], cross(p, east)), 0.995);
    EXPECT_NEAR(dot(v.tangent[n], v.bitangent[n]), 0, 1e-12);
    ++checked;
  }
  EXPECT_GT(checked, 8000);
  for (std::size_t t = 0; t < v.triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(v.point[v.triangles[t][c]], ball.triangles[t][c]);
      EXPECT_EQ(v.st[v.triangles[t][c]][0], ball.texcoords[t][2 * c]);
    }
}

TEST(RenderTangents, SeamsSplitAndMirrorsTurn) {
  // Two squares side by side; the right one's texture runs back.
  TriangleMesh m = test::sheet(2, 1);
  const auto coordinate = [&](std::uint32_t p, bool mirror) {
    return std::array{static_cast<float>(mirror ? 2 - m.points[p].x : m.points[p].x),
                      static_cast<float>(m.points[p].y)};
  };
  for (std::size_t t = 0; t < 4; ++t) {
    std::array<float, 6> st{};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto at = coordinate(m.triangles[t][c], t >= 2);
      st[2 * c] = at[0];
      st[2 * c + 1] = at[1];
    }
    m.texcoords.push_back(st);
  }
  const std::vector<Vec3> normals = shading::render_normals(m);
  const shading::TexturedVertices v = shading::split_vertices(m, m.texcoords, &normals, {});
  ASSERT_EQ(v.point.size(), 8U); // 6 points, the two of the mirror line twice
  for (std::size_t t = 0; t < 4; ++t)
    for (const std::uint32_t n : v.triangles[t]) {
      EXPECT_EQ(v.tangent[n], (Vec3{t < 2 ? 1.0 : -1.0, 0, 0}));
      EXPECT_EQ(v.bitangent[n], (Vec3{0, 1, 0}));
    }
  // Without frames mirrored halves may share vertices.
  EXPECT_EQ(shading::split_vertices(m, m.texcoords, nullptr, {}).point.size(), 6U);
}

TEST(RenderTangents, DegenerateTexturesAndTrianglesGiveNone) {
  TriangleMesh m = test::sheet(1, 1);
  m.texcoords = {{0.5, 0.5, 0.5, 0.5, 0.5, 0.5}, {0, 0, 1, 1, 2, 2}};
  std::vector<Vec3> normals = shading::render_normals(m);
  shading::TexturedVertices v = shading::split_vertices(m, m.texcoords, &normals, {});
  for (std::size_t n = 0; n < v.point.size(); ++n) {
    EXPECT_EQ(v.tangent[n], Vec3{});
    EXPECT_EQ(v.bitangent[n], Vec3{});
  }
  // No area in space.
  for (Vec3& p : m.points)
    p = {p.x, 0, 0};
  m.texcoords = {{0, 0, 1, 0, 1, 1}, {0, 0, 1, 1, 0, 1}};
  normals = shading::render_normals(m);
  v = shading::split_vertices(m, m.texcoords, &normals, {});
  for (const Vec3& t : v.tangent)
    EXPECT_EQ(t, Vec3{});
}

TEST(RenderTangents, AFanOfManySeamsIsQuick) {
  TriangleMesh m;
  constexpr std::uint32_t count = 200000;
  m.points.push_back({0, 0, 0});
  for (std::uint32_t n = 0; n <= count; ++n)
    m.points.push_back({1.0 * n, 1, 0});
  for (std::uint32_t n = 0; n < count; ++n) {
    m.triangles.push_back({0, n + 2, n + 1});
    const auto s = static_cast<float>(n);
    m.texcoords.push_back({s, 0, s, 1, s + 1, 1});
  }
  const std::vector<Vec3> normals = shading::render_normals(m);
  EXPECT_EQ(shading::split_vertices(m, m.texcoords, &normals, {}).point.size(), 3 * count);
}

TEST(RenderDrawing, SameForAnyThreadsAndOffsetsPointToTheLight) {
  std::vector<shading::Surface> surfaces(2);
  surfaces[0].mesh = test::sphere_mesh(4, 10, {0, 0, 0});
  surfaces[1].mesh = test::sphere_mesh(4, 3, {0, 0, 20});
  (void)shading::add_texcoords(surfaces, {}, {});
  shading::DrawingOptions options;
  options.texcoords = options.structure = true;
  options.light = {0, 0, 0}; // within the first: nothing to shift
  options.offset = {0.1, 0.1};
  options.shade = 0.5;
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const shading::Drawing a = shading::make_drawing(surfaces, options, one),
                         b = shading::make_drawing(surfaces, options, two);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  EXPECT_EQ(a.triangles, b.triangles);
  bool shifted = false;
  for (std::size_t n = 0; n < a.vertices.size(); ++n) {
    const shading::DrawVertex &v = a.vertices[n], &w = b.vertices[n];
    EXPECT_TRUE(v.position == w.position && v.st == w.st && v.shifted == w.shifted &&
                v.shade == w.shade);
    const Vec3 p = a.origin + Vec3{v.position[0], v.position[1], v.position[2]} * a.scale;
    const double moved = std::hypot(v.shifted[0] - v.st[0], v.shifted[1] - v.st[1]);
    if (p.z < 11) {
      EXPECT_LT(moved, 0.002); // light from within: along the normal
      EXPECT_NEAR(v.shade, 0.5, 1e-6);
    }
    shifted = shifted || moved > 0.08;
    for (const float x : v.position)
      EXPECT_LE(std::fabs(x), 1.0001F);
  }
  EXPECT_TRUE(shifted);
}

bool equal(const shading::Drawing& a, const shading::Drawing& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0);
  };
  return same(a.vertices, b.vertices) && same(a.frames, b.frames) && a.triangles == b.triangles &&
         a.group_start == b.group_start && a.light == b.light && a.origin == b.origin &&
         a.camera.eye == b.camera.eye;
}

TEST(RenderDrawing, ASequenceRenewsWhatChangedAndIsTheSameAsDrawingsMadeAnew) {
  for (const bool per_pixel : {true, false}) {
    std::vector<shading::Surface> surfaces(2);
    surfaces[0].mesh = test::sphere_mesh(3, 10, {0, 0, 0});
    surfaces[1].mesh = test::sphere_mesh(2, 3, {0, 0, 20});
    surfaces[1].mesh.material.assign(surfaces[1].mesh.triangles.size(), 1);
    (void)shading::add_texcoords(surfaces, {}, {});
    shading::DrawingOptions options;
    options.texcoords = options.structure = options.sphere = true;
    options.per_pixel = per_pixel;
    options.groups = {1};
    options.light = {30, 20, 10};
    options.camera = shading::make_camera({}, shading::rest_box(surfaces), 64, 64);
    shading::DrawingMaker maker;
    const shading::Drawing first = maker.make(surfaces, options, shading::DrawingChange::all, {});
    EXPECT_TRUE(equal(first, shading::make_drawing(surfaces, options, {})));
    EXPECT_EQ(maker.counts().splits, 2U);
    EXPECT_EQ(maker.counts().frames, 2U);
    // The points move: frames, but no splitting.
    for (Vec3& p : surfaces[0].mesh.points)
      p.x *= 1.5;
    const shading::Drawing moved =
        maker.make(surfaces, options, shading::DrawingChange::points, {});
    EXPECT_TRUE(equal(moved, shading::make_drawing(surfaces, options, {})));
    EXPECT_FALSE(equal(moved, first));
    EXPECT_NE(moved.version, first.version);
    EXPECT_EQ(maker.counts().splits, 2U);
    EXPECT_EQ(maker.counts().frames, 4U);
    // The light moves: neither.
    options.light = {-30, 20, 10};
    options.camera = shading::make_camera({"left", {}, 10, 5, {}, {}, {}, 30},
                                          shading::rest_box(surfaces), 64, 64);
    const shading::Drawing lit = maker.make(surfaces, options, shading::DrawingChange::view, {});
    EXPECT_TRUE(equal(lit, shading::make_drawing(surfaces, options, {})));
    EXPECT_FALSE(equal(lit, moved));
    EXPECT_EQ(lit.version == moved.version, per_pixel); // nothing at vertices knows the light
    EXPECT_EQ(maker.counts().splits, 2U);
    EXPECT_EQ(maker.counts().frames, 4U);
    EXPECT_EQ(maker.counts().vertices, per_pixel ? 2U : 3U);
    EXPECT_EQ(maker.counts().drawings, 3U);
    // That telling it too little is seen.
    for (Vec3& p : surfaces[0].mesh.points)
      p.y *= 1.5;
    EXPECT_FALSE(equal(maker.make(surfaces, options, shading::DrawingChange::view, {}),
                       shading::make_drawing(surfaces, options, {})));
  }
}

TEST(RenderDrawing, TrianglesAreGroupedByMaterialPartOrSurface) {
  std::vector<shading::Surface> surfaces(2);
  for (shading::Surface& surface : surfaces) {
    surface.mesh = test::sheet(3, 1); // six triangles
    surface.mesh.part = {0, 1, 2, 0, 1, 2};
  }
  surfaces[1].mesh.material = {5, 5, 4, 0, 5, 7};
  shading::DrawingOptions options;
  const shading::Drawing plain = shading::make_drawing(surfaces, options, {});
  EXPECT_EQ(shading::group_count(plain), 1U);
  EXPECT_EQ(shading::triangles_of_group(plain, 0).size(), 12U);
  // Where each group's triangles stand in the plain drawing, in order.
  const auto groups = [&](shading::GroupBy by, std::vector<std::int32_t> numbers) {
    options.group_by = by;
    options.groups = std::move(numbers);
    const shading::Drawing drawing = shading::make_drawing(surfaces, options, {});
    std::vector<std::vector<std::size_t>> found;
    for (std::size_t g = 0; g < shading::group_count(drawing); ++g) {
      found.emplace_back();
      for (const Triangle& t : shading::triangles_of_group(drawing, g))
        found.back().push_back(
            static_cast<std::size_t>(std::find(plain.triangles.begin(), plain.triangles.end(), t) -
                                     plain.triangles.begin()));
    }
    return found;
  };
  using Found = std::vector<std::vector<std::size_t>>;
  EXPECT_EQ(groups(shading::GroupBy::material, {4, 5}),
            (Found{{0, 1, 2, 3, 4, 5, 9, 11}, {8}, {6, 7, 10}}));
  EXPECT_EQ(groups(shading::GroupBy::material, {0}),
            (Found{{6, 7, 8, 10, 11}, {0, 1, 2, 3, 4, 5, 9}}));
  EXPECT_EQ(groups(shading::GroupBy::part, {2, 1, 9}),
            (Found{{0, 3, 6, 9}, {2, 5, 8, 11}, {1, 4, 7, 10}, {}}));
  EXPECT_EQ(groups(shading::GroupBy::surface, {1}),
            (Found{{0, 1, 2, 3, 4, 5}, {6, 7, 8, 9, 10, 11}}));
}

TEST(RenderDrawing, LightOnAVertexAndNothingToDraw) {
  std::vector<shading::Surface> surfaces(1);
  shading::DrawingOptions options;
  options.shade = 1;
  EXPECT_TRUE(shading::make_drawing(surfaces, options, {}).triangles.empty());
  surfaces[0].mesh = test::sheet(1, 1);
  surfaces[0].mesh.texcoords = {{0, 0, 1, 0, 1, 1}, {0, 0, 1, 1, 0, 1}};
  options.light = {0, 0, 0};
  options.texcoords = options.structure = true;
  const shading::Drawing drawing = shading::make_drawing(surfaces, options, {});
  for (const shading::DrawVertex& v : drawing.vertices) {
    EXPECT_TRUE(std::isfinite(v.shifted[0]) && std::isfinite(v.shifted[1]));
    EXPECT_TRUE(std::isfinite(v.shade));
  }
  surfaces[0].mesh.points[0].x = -1.5e308;
  surfaces[0].mesh.points[1].x = 1.5e308;
  EXPECT_THROW((void)shading::make_drawing(surfaces, options, {}), Error);
}

TEST(RenderDrawing, NormalsThatAreNoNumbersAreReplaced) {
  TriangleMesh mesh = test::sheet(1, 1);
  mesh.normals.assign(mesh.points.size(), {NAN, 0, 1});
  mesh.normals[0] = {0, 0, 0};
  mesh.normals[1] = {0, 1, 0};
  const std::vector<Vec3> normals = shading::render_normals(mesh);
  const std::vector<Vec3> own = shading::area_normals(mesh.points, mesh.triangles);
  EXPECT_EQ(normals[0], own[0]);
  EXPECT_EQ(normals[1], (Vec3{0, 1, 0}));
  EXPECT_EQ(normals[2], own[2]);
}

TEST(RenderDrawing, SphereMapsSeeTheMiddleWhereTheSurfaceFacesTheEye) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = test::sphere_mesh(4, 10, {0, 0, 0});
  shading::DrawingOptions options;
  options.sphere = true;
  options.camera = shading::make_camera({}, bounding_box(surfaces[0].mesh), 64, 64); // from +y
  const shading::Drawing drawing = shading::make_drawing(surfaces, options, {});
  for (const shading::DrawVertex& v : drawing.vertices) {
    const double x = v.sphere[0] - 0.5, y = v.sphere[1] - 0.5;
    EXPECT_LE(std::sqrt(x * x + y * y), 0.5 + 1e-6);
    if (v.position[1] > 0.999F) {
      EXPECT_LT(std::sqrt(x * x + y * y), 0.03);
    }
    if (v.position[1] > 0.5F && v.position[2] > 0.3F) { // what lies above is mirrored
      EXPECT_GT(y, 0.1);
    }
  }
}

TEST(RenderStyle, FacetsHaveTheirOwnPointsAndEdgesAreDrawnOnce) {
  shading::Surface surface;
  surface.mesh = test::sphere_mesh(2, 10, {0, 0, 0});
  const shading::Surface facets = shading::faceted(surface);
  EXPECT_EQ(facets.mesh.points.size(), 3 * surface.mesh.triangles.size());
  EXPECT_EQ(surface_area(facets.mesh), surface_area(surface.mesh));
  const shading::Camera camera = shading::make_camera({}, bounding_box(surface.mesh), 100, 100);
  const shading::Surface edges = shading::wireframe(surface, camera, 2, 100);
  EXPECT_EQ(edges.mesh.triangles.size(), 2 * surface.mesh.triangles.size() * 3 / 2);
  for (std::size_t n = 0; n < edges.mesh.points.size(); n += 2) { // two pixels wide
    const Vec3 p = edges.mesh.points[n], q = edges.mesh.points[n + 1];
    const double depth = -dot((p + q) / 2 - camera.eye, camera.back);
    EXPECT_NEAR(norm(p - q) / depth / (2 * camera.tan_y) * 100, 2, 1e-9);
  }
}

TEST(RenderStyle, CreasesPartNormalsAndNothingElse) {
  shading::Surface surface;
  surface.mesh = test::box_mesh({0, 0, 0}, {1, 2, 3});
  const shading::Surface sharp = shading::creased(surface, 60);
  EXPECT_EQ(sharp.mesh.points.size(), 24U); // three at each corner
  EXPECT_EQ(signed_volume(sharp.mesh), 6);
  for (std::size_t t = 0; t < sharp.mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(sharp.mesh.points[sharp.mesh.triangles[t][k]],
                surface.mesh.points[surface.mesh.triangles[t][k]]);
  std::size_t along = 0;
  for (const Vec3& n : shading::render_normals(sharp.mesh))
    along += std::abs(n.x) + std::abs(n.y) + std::abs(n.z) == 1 ? 1 : 0;
  EXPECT_EQ(along, 24U);
  EXPECT_EQ(shading::creased(surface, 91).mesh.points.size(), 8U);
  // By what it was at rest: it may fold as it likes.
  surface.rest = surface.mesh.points;
  for (Vec3& p : surface.mesh.points)
    p.z = 0;
  EXPECT_EQ(shading::creased(surface, 60).mesh.points.size(), 24U);
  EXPECT_EQ(shading::creased(surface, 60).rest.size(), 24U);
}

TEST(RenderCamera, OrbitsAroundItsTarget) {
  const Box3 box{{-1, -1, -1}, {1, 1, 1}};
  shading::CameraOptions options;
  options.distance = 10;
  options.azimuth = 90; // from the front (+y) to the camera's right (-x)
  EXPECT_LT(norm(shading::make_camera(options, box, 9, 9).eye - Vec3{-10, 0, 0}), 1e-12);
  options.azimuth = -450;
  EXPECT_LT(norm(shading::make_camera(options, box, 9, 9).eye - Vec3{10, 0, 0}), 1e-12);
  options.azimuth = 0;
  options.elevation = 30;
  const shading::Camera raised = shading::make_camera(options, box, 9, 9);
  EXPECT_LT(norm(raised.eye - Vec3{0, 10 * std::sqrt(0.75), 5}), 1e-12);
  EXPECT_NEAR(dot(cross(raised.right, raised.up), raised.back), 1, 1e-12);
}

TEST(RenderImage, LuminanceAndShrinking) {
  const texture::Image gray{2, 1, 1, {3, 9}};
  EXPECT_EQ(texture::luminance(gray), gray);
  const texture::Image colors{4, 1, 3, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}};
  EXPECT_EQ(texture::luminance(colors), (texture::Image{4, 1, 1, {54, 182, 18, 255}}));
  const texture::Image large{4, 2, 1, {0, 1, 10, 20, 2, 3, 30, 40}};
  EXPECT_EQ(texture::shrunk(large, 2), (texture::Image{2, 1, 1, {2, 25}}));
  EXPECT_EQ(texture::shrunk(large, 1), large);
  EXPECT_NE(texture::image_digest(large), texture::image_digest(gray));
}

TEST(RenderTexture, BilinearRepeatedAndFromBelow) {
  const texture::Texture texture =
      texture::texture_from({2, 2, 1, {200, 100, 0, 50}}); // 200 100 above 0 50
  const auto at = [&](double s, double t) { return 255 * texture::sample(texture, s, t)[2]; };
  EXPECT_NEAR(at(0.25, 0.25), 0, 1e-12);
  EXPECT_NEAR(at(0.75, 0.25), 50, 1e-12);
  EXPECT_NEAR(at(0.25, 0.75), 200, 1e-12);
  EXPECT_NEAR(at(0.5, 0.5), 87.5, 1e-12);
  EXPECT_NEAR(at(0, 0.25), 25, 1e-12); // across the edge
  for (const double shift : {-3.0, 1.0, 1000.0})
    EXPECT_NEAR(at(0.3 + shift, 0.9 - shift), at(0.3, 0.9), 1e-9);
  for (const double huge : {1e30, -1e30, -1e-30, 3.4e38})
    EXPECT_GE(at(huge, huge), 0);
  EXPECT_THROW((void)texture::texture_from({0, 0, 1, {}}), Error);
}

TEST(RenderPicture, SizesAsWords) {
  EXPECT_EQ(render::picture_size_from_text("640x480"), std::pair(640U, 480U));
  EXPECT_EQ(render::picture_size_from_text("640,480"), std::pair(640U, 480U));
  EXPECT_EQ(render::picture_size_from_text("32768"), std::pair(32768U, 32768U));
  for (const char* bad : {"", "0", "x", "5x", "x5", "5x5x5", "-1", "32769", "1e3", " 5", "5.0"})
    EXPECT_THROW((void)render::picture_size_from_text(bad), Error) << bad;
}

} // namespace
} // namespace gewebe::test
