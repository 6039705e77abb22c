// Slices and projections of volumes against fields whose pictures are known.

#include "base/error.h"
#include "formats/volume/volume_file.h"
#include "formats/volume/volume_plugin.h"
#include "larger.h"
#include "scratch.h"
#include "shading/volume_view.h"
#include "texture/color_ramp.h"
#include "volume/field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace gewebe::test {
namespace {

using Function = std::function<double(const Vec3&)>;

/// `f` at the world's places of the voxels -n … n-1, for n a multiple of 8.
volume::Grid grid_of(const Function& f, int n, const volume::GridTransform& transform,
                     float background = 0) {
  volume::GridInfo info;
  info.transform = transform;
  info.background = background;
  volume::GridBuilder builder(info);
  std::vector<Int3> origins;
  for (int i = -n; i < n; i += 8)
    for (int j = -n; j < n; j += 8)
      for (int k = -n; k < n; k += 8)
        origins.push_back({i, j, k});
  for (const volume::LeafRef& leaf : builder.add_leaves({}, origins))
    for (int v = 0; v < volume::leaf_voxels; ++v) {
      const Vec3 at{double(leaf.origin[0] + (v >> 6)), double(leaf.origin[1] + (v >> 3 & 7)),
                    double(leaf.origin[2] + (v & 7))};
      leaf.values[v] = static_cast<float>(f(transform.to_world(at)));
      leaf.active[v / 64] |= std::uint64_t{1} << (v % 64);
    }
  return builder.finish();
}

volume::GridTransform rotated(double size) {
  const double c = 0.8 * size, s = 0.6 * size;
  volume::GridTransform t;
  t.m = {c, -s, 0, 0.3, s, c, 0, -0.2, 0, 0, size, 0.1};
  return t;
}

shading::VolumeViewOptions options_of(shading::VolumeMode mode, shading::VolumeAxis axis,
                                      std::uint32_t size) {
  shading::VolumeViewOptions options;
  options.mode = mode;
  options.axis = axis;
  options.width = options.height = size;
  options.camera.target = Vec3{0, 0, 0};
  return options;
}

/// Where the middle of a pixel lies, in the plane through the target.
Vec3 place(const shading::VolumeView& view, std::size_t x, std::size_t y) {
  const double right = 2 * (static_cast<double>(x) + 0.5) / view.width - 1;
  const double up = 1 - 2 * (static_cast<double>(y) + 0.5) / view.height;
  return view.camera.target + view.camera.right * (right * view.half_width) +
         view.camera.up * (up * view.half_height);
}

double ball_density(const Vec3& p) {
  return 0.5 + 6 - norm(p);
}

/// Radius of the disc of values above 1/2, by its area.
double disc_radius(const shading::VolumeView& view) {
  const auto inside = std::ranges::count_if(view.values, [](float v) { return v > 0.5F; });
  const double pixel = 4 * view.half_width * view.half_height / view.width / view.height;
  return std::sqrt(static_cast<double>(inside) * pixel / std::numbers::pi);
}

TEST(RenderVolume, SlicesOfABallAreDiscsOfKnownRadius) {
  for (const volume::GridTransform& transform : {volume::uniform_transform(0.5), rotated(0.5)}) {
    const volume::Grid grid = grid_of(ball_density, 24, transform);
    for (const shading::VolumeAxis axis : {shading::VolumeAxis::x, shading::VolumeAxis::y,
                                           shading::VolumeAxis::z, shading::VolumeAxis::view}) {
      shading::VolumeViewOptions options = options_of(shading::VolumeMode::slice, axis, 200);
      options.camera.view = "iso";
      options.camera.distance = 26; // 14 mm across
      for (const double at : {-4.5, 0.0, 2.0}) {
        options.place = at;
        EXPECT_NEAR(disc_radius(shading::view_volume(grid, options, {})), std::sqrt(36 - at * at),
                    0.02);
      }
      options.place = 3.6; // negative control: another place, another radius
      EXPECT_GT(std::abs(disc_radius(shading::view_volume(grid, options, {})) - std::sqrt(32)),
                0.5);
    }
    shading::VolumeViewOptions options =
        options_of(shading::VolumeMode::maximum, shading::VolumeAxis::x, 200);
    options.camera.distance = 26;
    EXPECT_NEAR(disc_radius(shading::view_volume(grid, options, {})), 6, 0.02);
  }
}

// A block of 16 voxels between clear ones: an optical depth of σ times its 16 voxels, as its ramps
// count by half.
TEST(RenderVolume, TranslucentBlockHasItsAnalyticDepth) {
  for (const double size : {0.5, 2.0}) {
    const volume::Grid grid =
        grid_of([](const Vec3&) { return 3.0; }, 8, volume::uniform_transform(size));
    for (const double k : {0.001, 0.05, 3.0}) {
      shading::VolumeViewOptions options =
          options_of(shading::VolumeMode::translucent, shading::VolumeAxis::y, 5);
      options.transfer.ramp.colors = {{51, 102, 204}};
      options.transfer.range = {0, 6};
      options.transfer.extinction = k;
      const shading::VolumeView view = shading::view_volume(grid, options, {});
      const double left = std::exp(-k / 2 * 16 * size);
      const std::array<double, 3> color{0.2, 0.4, 0.8};
      EXPECT_NEAR(static_cast<double>(view.values[12]), left, k > 1 ? 1.0 / 4096 : 1e-6) << k;
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(static_cast<double>(view.colors[36 + c]), (1 - left) * color[c],
                    k > 1 ? 1.0 / 4096 : 1e-6);
      options.transfer.range = {3, 6}; // from the value itself on nothing is seen
      EXPECT_EQ(shading::view_volume(grid, options, {}).values[12], 1.0F);
    }
  }
}

TEST(RenderVolume, TranslucentFieldsAreIntegratedAlongTheRay) {
  const auto f = [](const Vec3& p) { // not symmetric: what is in front counts
    return std::exp(-norm(p - Vec3{2, 1, 0}) / 3) + 0.7 * std::exp(-norm(p + Vec3{3, 2, 2}) / 2);
  };
  const volume::Grid grid = grid_of(f, 16, rotated(0.7));
  shading::VolumeViewOptions options =
      options_of(shading::VolumeMode::translucent, shading::VolumeAxis::view, 12);
  options.camera.view = "iso";
  options.transfer.ramp = texture::color_ramp_from_name("rainbow");
  options.transfer.range = {0.05, 0.9};
  options.transfer.extinction = 0.4;
  const shading::VolumeView view = shading::view_volume(grid, options, {});
  double worst = 0, turned = 0, least = 1;
  for (std::size_t y = 0; y < 12; ++y)
    for (std::size_t x = 0; x < 12; ++x) {
      volume::Field field(grid);
      constexpr double reach = 40, step = 0.004;
      for (const double way : {-1.0, 1.0}) { // from the eye, and the wrong way around
        double depth = 0;
        std::array<double, 3> color{};
        for (double t = -reach; t < reach; t += step) {
          const Vec3 p = place(view, x, y) + view.camera.back * (way * (t + step / 2));
          const double u =
              std::clamp((field.value(grid.info().transform.to_index(p)) - 0.05) / 0.85, 0.0, 1.0);
          const auto c = texture::ramp_color(options.transfer.ramp, u);
          for (std::size_t k = 0; k < 3; ++k)
            color[k] += c[k] / 255 * 0.4 * u * step * std::exp(-depth);
          depth += 0.4 * u * step;
        }
        double error = std::abs(static_cast<double>(view.values[y * 12 + x]) - std::exp(-depth));
        for (std::size_t k = 0; k < 3; ++k)
          error = test::larger(
              error, std::abs(static_cast<double>(view.colors[3 * (y * 12 + x) + k]) - color[k]));
        (way < 0 ? worst : turned) = test::larger(way < 0 ? worst : turned, error);
        least = test::smaller(least, std::exp(-depth));
      }
    }
  EXPECT_LT(worst, 0.002);
  EXPECT_GT(turned, 0.05);
  EXPECT_LT(least, 0.4);
}

TEST(RenderVolume, SlicesAreTheFieldAtThePixels) {
  // Trilinear fields are met exactly but for the values' own rounding.
  const auto f = [](const Vec3& p) { return 10 + p.x - 0.5 * p.y + 0.25 * p.z; };
  const volume::Grid grid = grid_of(f, 16, rotated(1));
  shading::VolumeViewOptions options =
      options_of(shading::VolumeMode::slice, shading::VolumeAxis::view, 64);
  options.camera.view = "iso";
  options.camera.distance = 10; // the picture lies within the volume
  options.place = 1.5;
  const shading::VolumeView view = shading::view_volume(grid, options, {});
  double worst = 0;
  for (std::size_t y = 0; y < 64; ++y)
    for (std::size_t x = 0; x < 64; ++x)
      worst = test::larger(worst, std::abs(static_cast<double>(view.values[y * 64 + x]) -
                                           f(place(view, x, y) - view.camera.back * 1.5)));
  EXPECT_LT(worst, 4e-6);
}

/// Of the trilinear field, by samples where it is smooth: between the planes of the lattice.
double sampled_maximum(const volume::Grid& grid, const Vec3& from, const Vec3& along) {
  volume::Field field(grid);
  const Vec3 p = grid.info().transform.to_index(from);
  const Vec3 d = grid.info().transform.to_index(from + along) - p;
  std::vector<double> planes;
  for (int a = 0; a < 3; ++a)
    for (int n = -10; n <= 10; ++n)
      if (std::abs(d[a]) > 1e-6)
        planes.push_back((n - p[a]) / d[a]);
  std::ranges::sort(planes);
  double best = static_cast<double>(grid.info().background);
  for (std::size_t n = 0; n + 1 < planes.size(); ++n)
    for (int m = 0; m <= 64; ++m)
      best = test::larger(best,
                          field.value(p + d * (planes[n] + (planes[n + 1] - planes[n]) * m / 64)));
  return best;
}

TEST(RenderVolume, MaximaAreThoseOfTheFieldAlongTheRay) {
  // Rough, so that maxima lie inside cells; a part of it below the background.
  const auto rough = [](const Vec3& p) {
    return std::sin(5 * p.x + p.y) + std::sin(7 * p.y - p.z) + std::sin(6 * p.z + 2 * p.x) - 1;
  };
  for (const volume::GridTransform& transform : {volume::uniform_transform(0.5), rotated(0.5)}) {
    const volume::Grid grid = grid_of(rough, 8, transform, -0.5F);
    for (const char* side : {"iso", "front"}) {
      shading::VolumeViewOptions options =
          options_of(shading::VolumeMode::maximum, shading::VolumeAxis::view, 24);
      options.camera.view = side;
      options.camera.azimuth = side == std::string("front") ? 0 : 17;
      const shading::VolumeView view = shading::view_volume(grid, options, {});
      for (std::size_t y = 1; y < 24; y += 4)
        for (std::size_t x = 0; x < 24; x += 3) {
          const auto value = static_cast<double>(view.values[y * 24 + x]);
          const double sampled = sampled_maximum(grid, place(view, x, y), view.camera.back);
          EXPECT_GE(value, sampled - 1e-6);
          EXPECT_LE(value, sampled + 4e-4); // f'' / 2 of a cell over 128 squared
        }
    }
  }
}

TEST(RenderVolume, KnownFieldsHaveKnownProjections) {
  // A ridge along the ray's own direction, and tiles.
  const auto f = [](const Vec3& p) { return 20 - std::abs(p.x) - 2 * std::abs(p.z); };
  const volume::Grid grid = grid_of(f, 16, volume::uniform_transform(1));
  shading::VolumeViewOptions options =
      options_of(shading::VolumeMode::maximum, shading::VolumeAxis::y, 30);
  options.camera.distance = 20;
  shading::VolumeView view = shading::view_volume(grid, options, {});
  const auto trilinear = [&](double a) { return std::abs(a); }; // kinks lie on voxels
  for (std::size_t y = 0; y < 30; ++y)
    for (std::size_t x = 0; x < 30; ++x) {
      const Vec3 p = place(view, x, y);
      EXPECT_NEAR(view.values[y * 30 + x], 20 - trilinear(p.x) - 2 * trilinear(p.z), 1e-5);
    }
  volume::GridBuilder builder(volume::GridInfo{});
  builder.add_tile({{128, 0, -128}, 128, 2.5F, true});
  builder.add_tile({{-8, -8, -8}, 8, 4.0F, true});
  const volume::Grid tiles = builder.finish();
  view = shading::view_volume(
      tiles, options_of(shading::VolumeMode::maximum, shading::VolumeAxis::x, 64), {});
  EXPECT_EQ(view.max, 4.0);
  EXPECT_EQ(std::ranges::max(view.values), 4.0F);
  EXPECT_GT(std::ranges::count(view.values, 2.5F), 100);
  EXPECT_GT(std::ranges::count(view.values, 0.0F), 100);
}

TEST(RenderVolume, PicturesAreTheSameForAnyNumberOfThreads) {
  const volume::Grid grid = grid_of(ball_density, 16, rotated(0.5));
  Context one, many;
  one.threads = 1;
  many.threads = 3;
  for (const shading::VolumeMode mode : {shading::VolumeMode::slice, shading::VolumeMode::maximum,
                                         shading::VolumeMode::translucent}) {
    shading::VolumeViewOptions options = options_of(mode, shading::VolumeAxis::view, 70);
    options.transfer.ramp = texture::color_ramp_from_name("heat");
    options.camera.view = "iso";
    EXPECT_EQ(shading::view_volume(grid, options, one).values,
              shading::view_volume(grid, options, many).values);
    EXPECT_EQ(shading::view_volume(grid, options, one).colors,
              shading::view_volume(grid, options, many).colors);
  }
}

TEST(RenderVolume, EmptyAndFarOnesAreBackground) {
  shading::VolumeViewOptions options =
      options_of(shading::VolumeMode::maximum, shading::VolumeAxis::z, 8);
  for (const shading::VolumeMode mode :
       {shading::VolumeMode::maximum, shading::VolumeMode::slice}) {
    options.mode = mode;
    EXPECT_EQ(std::ranges::max(shading::view_volume(volume::Grid(), options, {}).values), 0.0F);
  }
  options.place = 1e300;
  EXPECT_EQ(
      std::ranges::max(
          shading::view_volume(grid_of(ball_density, 8, volume::uniform_transform(1)), options, {})
              .values),
      0.0F);
}

TEST(RenderVolume, RampsAreLinearAndEndAtTheirEnds) {
  const std::vector<float> values{-1, 0, 1, 2, 3, 9};
  const texture::Image gray =
      texture::colored(values, 3, 2, 0, 3, texture::color_ramp_from_name("gray"));
  EXPECT_EQ(gray.values, (std::vector<std::uint8_t>{0, 0, 0, 0, 0, 0, 85, 85, 85, 170, 170, 170,
                                                    255, 255, 255, 255, 255, 255}));
  const texture::Image heat =
      texture::colored(values, 6, 1, 0, 3, texture::color_ramp_from_name("heat"));
  EXPECT_EQ(std::vector<std::uint8_t>(heat.values.begin() + 6, heat.values.begin() + 15),
            (std::vector<std::uint8_t>{255, 0, 0, 255, 255, 0, 255, 255, 255}));
  EXPECT_THROW((void)texture::color_ramp_from_name("hot"), Error);
  const texture::ColorRamp own = texture::color_ramp_from_image({2, 3, 1, {1, 2, 10, 20, 5, 6}});
  EXPECT_EQ(own.colors, (std::vector<std::array<std::uint8_t, 3>>{{10, 10, 10}, {20, 20, 20}}));
  EXPECT_THROW((void)texture::color_ramp_from_image({}), Error);
}

TEST(RenderVolume, TheLoadedLibrarySeesTheSameAndSaysWhatIsWrong) {
  const volume::Grid grid = grid_of(ball_density, 16, rotated(0.5));
  const ScratchFile file(".vdb");
  formats::Output output(file.path(), {});
  formats::write_volume(output, grid, {});
  output.commit();
  const shading::VolumeViewOptions options =
      options_of(shading::VolumeMode::maximum, shading::VolumeAxis::y, 40);
  std::string bytes = formats::Input(file.path()).read_all();
  EXPECT_EQ(formats::view_volume_bytes(bytes, "a.vdb", options, {}).values,
            shading::view_volume(grid, options, {}).values);
  bytes.resize(bytes.size() / 2);
  try {
    (void)formats::view_volume_bytes(bytes, "a.vdb", options, {});
    FAIL() << "half a volume was read";
  } catch (const Error& error) { // thrown there, caught here
    EXPECT_EQ(error.place().substr(0, 5), "a.vdb");
  }
}

} // namespace
} // namespace gewebe::test
