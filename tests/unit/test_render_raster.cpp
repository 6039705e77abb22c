// The rasteriser's rules, which no picture of an organ shows.

#include "base/error.h"
#include "larger.h"
#include "mesh_fixtures.h"
#include "model_meshes.h"
#include "raster/raster_cpu.h"
#include "render/picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <utility>

namespace gewebe::test {
namespace {

/// x, y are pixels from the upper left, w the depth.
shading::Projection pixels(double width, double height) {
  shading::Projection p;
  p.matrix[0] = {2 / width, 0, 0, -1};
  p.matrix[1] = {0, -2 / height, 0, 1};
  p.matrix[2] = {0, 0, 1, 0};
  p.matrix[3] = {0, 0, 0, 1};
  p.near = 0.5;
  return p;
}

shading::DrawVertex vertex(double x, double y) {
  shading::DrawVertex v;
  v.position = {static_cast<float>(x), static_cast<float>(y), 0};
  return v;
}

std::uint64_t count(const shading::Drawing& drawing, std::uint32_t width, std::uint32_t height,
                    std::size_t only = SIZE_MAX) {
  shading::Drawing part = drawing;
  if (only != SIZE_MAX)
    part.triangles = {drawing.triangles[only]};
  raster::RenderReport report;
  (void)raster::render_cpu(part, pixels(width, height), {}, width, height, 1, {}, &report);
  return report.covered;
}

/// A sheet of nx × ny cells over the whole picture whose inner points are shaken; in steps of
/// 1 / grain pixel, so that centres lie on edges and corners too.
shading::Drawing shaken_sheet(std::uint32_t nx, std::uint32_t ny, double size, std::uint32_t seed,
                              double grain) {
  std::mt19937 random(seed);
  shading::Drawing drawing;
  drawing.triangles = test::sheet(nx, ny).triangles;
  for (std::uint32_t y = 0; y <= ny; ++y)
    for (std::uint32_t x = 0; x <= nx; ++x) {
      const auto shake = [&](std::uint32_t k, std::uint32_t n) {
        const double amount = static_cast<double>(random()) / 4294967296.0 - 0.5;
        const double at = (k + (k == 0 || k == n ? 0 : 0.7 * amount)) * size / n;
        return std::floor(at * grain + 0.5) / grain;
      };
      drawing.vertices.push_back(vertex(shake(x, nx), shake(y, ny)));
    }
  return drawing;
}

TEST(RenderRaster, EveryPixelOfASheetIsOwnedByExactlyOneTriangle) {
  for (std::uint32_t seed = 0; seed < 8; ++seed)
    for (const double grain : {2.0, 1000.0}) {
      const shading::Drawing drawing = shaken_sheet(7, 5, 64, seed, grain);
      EXPECT_EQ(count(drawing, 64, 64), 64U * 64U);
      std::uint64_t sum = 0;
      for (std::size_t t = 0; t < drawing.triangles.size(); ++t)
        sum += count(drawing, 64, 64, t);
      EXPECT_EQ(sum, 64U * 64U) << seed << " " << grain;
    }
}

TEST(RenderRaster, TopLeftRuleOnPixelCentres) {
  shading::Drawing drawing;
  drawing.vertices = {vertex(0.5, 0.5), vertex(4.5, 0.5), vertex(4.5, 4.5), vertex(0.5, 4.5)};
  drawing.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(count(drawing, 8, 8), 16U); // rows and columns 0 to 3
  texture::SurfaceMaterial material;
  material.background = {0, 0, 0};
  const texture::Image image = raster::render_cpu(drawing, pixels(8, 8), material, 8, 8, 1, {});
  for (std::size_t y = 0; y < 8; ++y)
    for (std::size_t x = 0; x < 8; ++x)
      EXPECT_EQ(image.values[3 * (8 * y + x)], x < 4 && y < 4 ? 255 : 0) << x << " " << y;
  for (Triangle& t : drawing.triangles)
    std::swap(t[1], t[2]); // seen from behind
  EXPECT_EQ(count(drawing, 8, 8), 16U);
}

TEST(RenderRaster, FirstOfCoincidentAndNearestOfAllIsSeen) {
  shading::Drawing drawing;
  for (const double depth : {1.0, 1.0, 0.9}) {
    for (const auto& [x, y] : {std::pair{-9.0, -9.0}, {40.0, -9.0}, {-9.0, 40.0}})
      drawing.vertices.push_back(vertex(x, y));
    const auto n = static_cast<std::uint32_t>(drawing.vertices.size());
    for (std::uint32_t k = n - 3; k < n; ++k) {
      drawing.vertices[k].position[2] = static_cast<float>(depth - 1);
      drawing.vertices[k].shade = static_cast<float>(n) / 10;
    }
    drawing.triangles.push_back({n - 3, n - 2, n - 1});
  }
  shading::Projection projection = pixels(8, 8);
  const auto seen = [&](std::size_t triangles) {
    shading::Drawing part = drawing;
    part.triangles.resize(triangles);
    return raster::render_cpu(part, projection, {}, 8, 8, 1, {}).values[0];
  };
  EXPECT_EQ(seen(2), 77); // 0.3
  projection.matrix[3] = {0, 0, 1, 1};
  EXPECT_EQ(seen(2), 77);
  EXPECT_NEAR(seen(3), 229.5, 0.5); // 0.9
}

// Triangles that face the viewer are drawn before others, but which is seen goes by depth and order
// alone: small and large ones, clipped ones, and some on the same places, each with its own shade.
TEST(RenderRaster, WhereTrianglesFaceChangesNothing) {
  constexpr std::uint32_t side = 150;
  std::mt19937 random(11);
  const auto below = [&](double end) {
    return end * (static_cast<double>(random()) / 4294967296.0);
  };
  shading::Projection projection = pixels(side, side);
  projection.matrix[3] = {0, 0, 1, 1};
  shading::Drawing drawing;
  const auto add = [&](std::uint32_t a) {
    for (std::uint32_t k = a; k < a + 3; ++k)
      drawing.vertices[k].shade = static_cast<float>(drawing.triangles.size() % 250) / 255;
    drawing.triangles.push_back({a, a + 1, a + 2});
  };
  for (int n = 0; n < 900; ++n) {
    const double size = n % 300 == 7 ? 1e6 : n % 20 == 0 ? 240 : n % 3 == 0 ? 40 : 4;
    const double x = below(side), y = below(side), base = 1 + std::floor(below(4)) / 4;
    const bool tilted = n % 2 == 0 && size < 1e6;
    const auto first = static_cast<std::uint32_t>(drawing.vertices.size());
    for (const int copy : {0, 1}) { // of some, with another shade
      if (copy == 1 && n % 4 != 0)
        break;
      for (std::uint32_t k = 0; k < 3; ++k) {
        if (copy == 1) {
          drawing.vertices.push_back(drawing.vertices[first + k]);
          continue;
        }
        const double w = base + (tilted ? below(1) : 0), half = side / 2.0;
        const double px = x + below(size) - size / 2, py = y + below(size) - size / 2;
        shading::DrawVertex v = vertex(half + w * (px - half), half + w * (py - half));
        v.position[2] = static_cast<float>(w - 1);
        drawing.vertices.push_back(v);
      }
      add(static_cast<std::uint32_t>(drawing.vertices.size()) - 3);
    }
  }
  const auto faces_the_viewer = [&](const Triangle& t) {
    std::array<std::array<double, 2>, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& at = drawing.vertices[t[k]].position;
      const double w = 1.0 + static_cast<double>(at[2]);
      for (std::size_t a = 0; a < 2; ++a)
        p[k][a] = (static_cast<double>(at[a]) - side / 2.0) / w;
    }
    return (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) < (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
  };
  for (Triangle& t : drawing.triangles)
    if (!faces_the_viewer(t))
      std::swap(t[1], t[2]);
  for (const int samples : {1, 4}) {
    const texture::Image all_face =
        raster::render_cpu(drawing, projection, {}, side, side, samples, {});
    for (const double turned : {1.0, 0.5, 0.1})
      for (const CpuLevel level : {CpuLevel::baseline, best_cpu_level()}) {
        shading::Drawing other = drawing;
        for (Triangle& t : other.triangles)
          if (below(1) < turned)
            std::swap(t[1], t[2]);
        Context context;
        context.cpu = level;
        const texture::Image image =
            raster::render_cpu(other, projection, {}, side, side, samples, context);
        EXPECT_EQ(texture::image_digest(image), texture::image_digest(all_face))
            << samples << ' ' << turned;
      }
  }
}

TEST(RenderRaster, ASurfaceAroundTheCameraFillsThePictureWhateverIsClipped) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = test::sphere_mesh(2, 10, {0, 0, 0});
  shading::CameraOptions options;
  for (const double x : {0.0, 9.0, 9.7, -9.3})
    for (const double fov : {20.0, 100.0, 170.0}) {
      options.eye = Vec3{x, 0.1, 0.2};
      options.target = Vec3{x + 0.3, 5, 1};
      options.fov = fov;
      const shading::Camera camera = shading::make_camera(options, {}, 61, 47);
      render::PictureOptions picture;
      picture.width = 61;
      picture.height = 47;
      picture.backend = render::Backend::cpu;
      render::PictureReport report;
      (void)render::make_picture(shading::make_drawing(surfaces, {}, {}), camera, {}, picture, {},
                                 &report);
      EXPECT_EQ(report.covered, 61U * 47U) << x << " " << fov;
    }
}

TEST(RenderRaster, HugeAndTinyTrianglesAreExact) {
  // A triangle that reaches far beyond the guard band covers the picture.
  shading::Drawing drawing;
  drawing.vertices = {vertex(-1e7, -1e7), vertex(3e7, -1e7), vertex(-1e7, 3e7)};
  drawing.triangles = {{0, 1, 2}};
  EXPECT_EQ(count(drawing, 640, 480), 640U * 480U);
  for (shading::DrawVertex& v : drawing.vertices) // and looks like what it is a piece of
    v.shade = 0.6F;
  for (const int samples : {1, 4})
    EXPECT_EQ(std::ranges::count(
                  raster::render_cpu(drawing, pixels(64, 48), {}, 64, 48, samples, {}).values, 153),
              3 * 64 * 48);
  // Slivers and points cover nothing and break nothing.
  drawing.vertices = {vertex(1, 1), vertex(1, 1), vertex(6, 6)};
  EXPECT_EQ(count(drawing, 8, 8), 0U);
  drawing.vertices = {vertex(1.1, 1.1), vertex(1.2, 1.1), vertex(1.1, 1.2)};
  EXPECT_EQ(count(drawing, 8, 8), 0U);
}

TEST(RenderRaster, SameBytesForAnyThreadsAndCpu) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = test::sphere_mesh(5, 10, {0, 0, 0});
  const shading::Camera camera = shading::make_camera({}, bounding_box(surfaces[0].mesh), 301, 203);
  shading::DrawingOptions options;
  options.shade = 0.8;
  options.light = shading::default_light(camera);
  render::PictureOptions picture;
  picture.width = 301;
  picture.height = 203;
  picture.backend = render::Backend::cpu;
  texture::SurfaceMaterial material;
  material.others.resize(1);
  material.others[0].color = {0.8, 0.3, 0.1};
  for (std::size_t t = 0; t < surfaces[0].mesh.triangles.size(); ++t)
    surfaces[0].mesh.material.push_back(static_cast<std::int32_t>(t / 5 % 2));
  for (const int materials : {1, 2})
    for (const int samples : {1, 4}) {
      options.groups.assign(static_cast<std::size_t>(materials - 1), 1);
      picture.samples = samples;
      std::string digest;
      for (const int threads : {1, 2, 7, -1}) {
        Context context;
        context.threads = std::abs(threads);
        if (threads < 0)
          context.cpu = CpuLevel::baseline;
        const texture::Image image = render::make_picture(
            shading::make_drawing(surfaces, options, context), camera, material, picture, context);
        if (digest.empty())
          digest = texture::image_digest(image);
        EXPECT_EQ(texture::image_digest(image), digest)
            << threads << ' ' << materials << ' ' << samples;
      }
    }
}

// A sheet over the picture whose coordinates run from -2 to 3, seen pixel by pixel.
TEST(RenderRaster, WrapsAndFiltersAreThoseOfTheTexture) {
  texture::Image image{5, 4, 3, {}};
  for (unsigned n = 0; n < 60; ++n)
    image.values.push_back(static_cast<std::uint8_t>((n * 89) % 256));
  shading::Drawing drawing;
  drawing.vertices = {vertex(0, 0), vertex(200, 0), vertex(200, 200), vertex(0, 200)};
  const std::array<std::array<float, 2>, 4> st{{{-2, 3}, {3, 3}, {3, -2}, {-2, -2}}};
  for (std::size_t n = 0; n < 4; ++n)
    drawing.vertices[n].st = st[n];
  drawing.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const texture::TextureWrap wrap :
       {texture::TextureWrap::repeat, texture::TextureWrap::clamp, texture::TextureWrap::mirror})
    for (const texture::TextureFilter filter :
         {texture::TextureFilter::linear, texture::TextureFilter::nearest}) {
      texture::SurfaceMaterial material;
      material.base = texture::texture_from(image, {filter, wrap, false});
      for (const CpuLevel level : {CpuLevel::baseline, best_cpu_level()}) {
        Context context;
        context.cpu = level;
        const texture::Image picture =
            raster::render_cpu(drawing, pixels(200, 200), material, 200, 200, 1, context);
        double max = 0;
        for (std::uint32_t y = 0; y < 200; ++y)
          for (std::uint32_t x = 0; x < 200; ++x) {
            const double s = -2 + 5 * (x + 0.5) / 200, t = 3 - 5 * (y + 0.5) / 200;
            std::array<double, 3> wanted = texture::sample(*material.base, s, t);
            if (filter == texture::TextureFilter::nearest) {
              const auto inside = [&](double at) {
                if (wrap == texture::TextureWrap::clamp)
                  return std::clamp(at, 0.0, 0.999999);
                const double part = at - std::floor(at);
                const bool back =
                    wrap == texture::TextureWrap::mirror && std::fmod(std::floor(at), 2) != 0;
                return back ? 1 - part : part;
              };
              wanted = texture::texel(*material.base, 0, static_cast<std::uint32_t>(5 * inside(s)),
                                      static_cast<std::uint32_t>(4 * inside(t)));
            }
            for (std::size_t c = 0; c < 3; ++c)
              max = test::larger(max, std::fabs(picture.values[3 * (std::size_t{200} * y + x) + c] -
                                                255 * wanted[c]));
          }
        EXPECT_LE(max, 0.502) << static_cast<int>(wrap) << static_cast<int>(filter);
      }
    }
}

// One edge through the middle of pixels: four samples see a part of them, and sums are those of
// areas.
TEST(RenderRaster, FourSamplesSmoothOutlinesAndNothingElse) {
  shading::Drawing drawing;
  drawing.vertices = {vertex(-50, -50), vertex(30.5, -50), vertex(30.5, 90), vertex(-50, 90)};
  drawing.triangles = {{0, 1, 2}, {0, 2, 3}};
  texture::SurfaceMaterial material;
  material.background = {0, 0, 0};
  const texture::Image image = raster::render_cpu(drawing, pixels(64, 40), material, 64, 40, 4, {});
  for (std::size_t y = 0; y < 40; ++y)
    for (std::size_t x = 0; x < 64; ++x)
      EXPECT_EQ(image.values[3 * (64 * y + x)], x < 30 ? 255 : x == 30 ? 128 : 0) << x << " " << y;
}

// Two surfaces cross along a line through the middle of a row, or of a column, of pixels: of four
// samples there two see the one and two the other.
TEST(RenderRaster, EachOfFourSamplesHasItsOwnDepth) {
  shading::Projection projection = pixels(40, 40);
  projection.matrix[3] = {0, 0, 1, 1};
  for (const bool rows : {false, true}) {
    shading::Drawing drawing;
    const auto add = [&](double x, double y, double nearness, float shade) {
      const double w = 1 / nearness;
      shading::DrawVertex v = vertex(20 * (w * (x / 20 - 1) + 1), 20 - 20 * w * (1 - y / 20));
      v.position[2] = static_cast<float>(w - 1);
      v.shade = shade;
      drawing.vertices.push_back(v);
    };
    for (const auto& [x, y] : {std::pair{-10.0, -10.0}, {60.0, -10.0}, {60.0, 60.0}, {-10.0, 60.0}})
      add(x, y, 1, 0.2F);
    for (const auto& [x, y] : {std::pair{-10.0, -10.0}, {60.0, -10.0}, {60.0, 60.0}, {-10.0, 60.0}})
      add(x, y, 1 + 0.005 * ((rows ? y : x) - 20.5), 0.8F);
    drawing.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
    for (const CpuLevel level : {CpuLevel::baseline, best_cpu_level()}) {
      Context context;
      context.cpu = level;
      const texture::Image image = raster::render_cpu(drawing, projection, {}, 40, 40, 4, context);
      for (std::size_t y = 0; y < 40; ++y)
        for (std::size_t x = 0; x < 40; ++x) {
          const std::size_t at = rows ? y : x;
          const double wanted = at < 20 ? 51 : at == 20 ? 127.5 : 204;
          EXPECT_NEAR(image.values[3 * (40 * y + x)], wanted, 0.6) << x << ' ' << y;
        }
    }
  }
}

TEST(RenderPicture, BackgroundAloneAndLimits) {
  render::PictureOptions options;
  options.width = 5;
  options.height = 3;
  options.supersample = 2;
  options.backend = render::Backend::cpu;
  texture::SurfaceMaterial material;
  material.background = {1, 0.5, 0};
  const shading::Camera camera = shading::make_camera({}, {}, 5, 3);
  const texture::Image image = render::make_picture({}, camera, material, options, {});
  ASSERT_EQ(image.values.size(), 45U);
  EXPECT_EQ(image.values[0], 255);
  EXPECT_EQ(image.values[1], 128);
  EXPECT_EQ(image.values[44], 0);
  options.width = 32768;
  options.supersample = 3;
  EXPECT_THROW((void)render::make_picture({}, camera, material, options, {}), Error);
  options.supersample = 1;
  options.height = 32768;
  Context small;
  small.max_memory = 1 << 20;
  EXPECT_THROW((void)render::make_picture({}, camera, material, options, small), Error);
  Context stopped;
  stopped.cancelled = [] { return true; };
  options = {};
  EXPECT_THROW((void)render::make_picture({}, camera, material, options, stopped), Cancelled);
}

} // namespace
} // namespace gewebe::test
