#include "raster/raster_cpu.h"

#include "base/error.h"
#include "base/parallel.h"
#include "raster/raster_kernel_internal.h"
#include "raster/raster_rest_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <vector>

// Based on: Sutherland and Hodgman, Reentrant Polygon Clipping, 1974; Molnar, Cox, Ellsworth and
// Fuchs, A Sorting Classification of Parallel Rendering, 1994 (sort-middle). What happens inside a
// tile stands in raster_kernel_lanes_internal.h.

namespace gewebe {
namespace {

// Vertices beyond it from the picture's edges are cut off, so that coordinates on the picture fit
// in 26 bits.
constexpr double guard_pixels = 32768;
constexpr int subpixels = 1 << raster_subpixel_bits;

struct ClipVertex {
  double x = 0, y = 0, w = 0;
};

/// From clip space to the picture.
class Viewport {
public:
  Viewport(const Projection& projection, std::uint32_t width, std::uint32_t height)
      : m_(projection.matrix), near_(projection.near), half_x_(width / 2.0), half_y_(height / 2.0),
        guard_x_(1 + guard_pixels / half_x_), guard_y_(1 + guard_pixels / half_y_) {}

  ClipVertex transform(const DrawVertex& v) const {
    const double x = v.position[0], y = v.position[1], z = v.position[2];
    const auto row = [&](const std::array<double, 4>& r) {
      return r[0] * x + r[1] * y + r[2] * z + r[3];
    };
    return {row(m_[0]), row(m_[1]), row(m_[3])};
  }

  /// How far inside the planes near, left, right, bottom and top of the guard band; negative is
  /// outside.
  std::array<double, 5> guard_distances(const ClipVertex& v) const {
    return {v.w - near_, guard_x_ * v.w + v.x, guard_x_ * v.w - v.x, guard_y_ * v.w + v.y,
            guard_y_ * v.w - v.y};
  }

  /// One bit for each side of the view on whose far side the vertex lies, 32 beyond the guard band.
  std::uint8_t outside(const ClipVertex& v) const {
    unsigned sides = (v.w < near_ ? 1U : 0U) | (v.x < -v.w ? 2U : 0U) | (v.x > v.w ? 4U : 0U) |
                     (v.y < -v.w ? 8U : 0U) | (v.y > v.w ? 16U : 0U);
    if (sides != 0 && !std::ranges::all_of(guard_distances(v), [](double d) { return d >= 0; }))
      sides |= 32U;
    return static_cast<std::uint8_t>(sides);
  }

  double pixel_x(const ClipVertex& v) const { return (v.x / v.w + 1) * half_x_; }
  double pixel_y(const ClipVertex& v) const { return (1 - v.y / v.w) * half_y_; }

  /// Rows x, y, w of the matrix to pixels times w.
  void rows(double (&clip)[3][4]) const {
    for (std::size_t c = 0; c < 4; ++c) {
      clip[0][c] = (m_[0][c] + m_[3][c]) * half_x_;
      clip[1][c] = (m_[3][c] - m_[1][c]) * half_y_;
      clip[2][c] = m_[3][c];
    }
  }

private:
  std::array<std::array<double, 4>, 4> m_;
  double near_, half_x_, half_y_, guard_x_, guard_y_;
};

/// The part of a triangle inside the guard band, as a convex polygon. An edge is always cut from
/// its inner to its outer end, so that neighbours get the same points.
std::vector<ClipVertex> clipped(const Viewport& viewport, std::vector<ClipVertex> polygon) {
  for (std::size_t plane = 0; plane < 5 && polygon.size() >= 3; ++plane) {
    std::vector<ClipVertex> kept;
    for (std::size_t n = 0; n < polygon.size(); ++n) {
      const ClipVertex& a = polygon[n];
      const ClipVertex& b = polygon[(n + 1) % polygon.size()];
      const double da = viewport.guard_distances(a)[plane];
      const double db = viewport.guard_distances(b)[plane];
      if (da >= 0)
        kept.push_back(a);
      if ((da >= 0) == (db >= 0))
        continue;
      const ClipVertex& in = da >= 0 ? a : b;
      const ClipVertex& out = da >= 0 ? b : a;
      const double part = da >= 0 ? da / (da - db) : db / (db - da);
      kept.push_back({in.x + part * (out.x - in.x), in.y + part * (out.y - in.y),
                      in.w + part * (out.w - in.w)});
    }
    polygon = std::move(kept);
  }
  return polygon;
}

/// Vertices on the picture; triangles over them, pieces of clipped ones at the end.
struct Screen {
  std::vector<std::int32_t> x, y; ///< in subpixels, y downwards
  std::vector<float> nearness;    ///< 1 / w
  std::vector<std::uint32_t> corners, shown;
  std::vector<std::uint8_t> outside; ///< of the drawing's vertices

  void set(std::size_t v, const Viewport& viewport, const ClipVertex& clip) {
    const auto fixed = [](double pixels) {       // to the nearest, without a call
      const double shifter = 6755399441055744.0; // 1.5 · 2^52
      return static_cast<std::int32_t>((pixels * subpixels + shifter) - shifter);
    };
    x[v] = fixed(viewport.pixel_x(clip));
    y[v] = fixed(viewport.pixel_y(clip));
    nearness[v] = static_cast<float>(1 / clip.w);
  }
};

Screen project(const Drawing& drawing, const Viewport& viewport, const Context& context) {
  constexpr std::size_t grain = 8192;
  Screen screen;
  const std::size_t vertices = drawing.vertices.size(), triangles = drawing.triangles.size();
  screen.x.resize(vertices);
  screen.y.resize(vertices);
  screen.nearness.resize(vertices);
  screen.outside.resize(vertices);
  parallel_blocks(context, vertices, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const ClipVertex clip = viewport.transform(drawing.vertices[v]);
      screen.outside[v] = viewport.outside(clip);
      if ((screen.outside[v] & 32U) == 0)
        screen.set(v, viewport, clip);
    }
  });
  screen.corners.resize(3 * triangles);
  screen.shown.resize(triangles);
  std::vector<std::vector<std::uint32_t>> cut((triangles + grain - 1) / grain);
  parallel_blocks(context, triangles, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Triangle& t = drawing.triangles[n];
      const unsigned a = screen.outside[t[0]], b = screen.outside[t[1]], c = screen.outside[t[2]];
      const bool away = (a & b & c & 31U) != 0, clips = ((a | b | c) & 32U) != 0;
      screen.shown[n] = static_cast<std::uint32_t>(n);
      for (std::size_t k = 0; k < 3; ++k) // a point where nothing is to be drawn
        screen.corners[3 * n + k] = away || clips ? 0 : t[k];
      if (clips && !away)
        cut[begin / grain].push_back(static_cast<std::uint32_t>(n));
    }
  });
  for (const std::vector<std::uint32_t>& some : cut)
    for (const std::uint32_t n : some) {
      const Triangle& t = drawing.triangles[n];
      const std::vector<ClipVertex> polygon =
          clipped(viewport, {viewport.transform(drawing.vertices[t[0]]),
                             viewport.transform(drawing.vertices[t[1]]),
                             viewport.transform(drawing.vertices[t[2]])});
      const auto first = static_cast<std::uint32_t>(screen.x.size());
      screen.x.resize(first + polygon.size());
      screen.y.resize(screen.x.size());
      screen.nearness.resize(screen.x.size());
      for (std::size_t k = 0; k < polygon.size(); ++k)
        screen.set(first + k, viewport, polygon[k]);
      for (std::uint32_t k = 2; k < polygon.size(); ++k) {
        screen.corners.insert(screen.corners.end(), {first, first + k - 1, first + k});
        screen.shown.push_back(n);
      }
    }
  return screen;
}

/// The triangles that may be seen in each tile, in order.
struct Bins {
  std::size_t across = 0, down = 0;
  std::vector<std::uint32_t> start; ///< of each tile, and the end
  std::vector<std::uint32_t> list;
  std::uint64_t triangles = 0; ///< that are in some
};

struct TileRange {
  std::uint16_t left = 1, right = 0, top = 0, bottom = 0; // none
};

TileRange tiles_of(const Screen& screen, std::size_t n, std::int32_t width, std::int32_t height,
                   int samples) {
  const std::uint32_t *const c = &screen.corners[3 * n], a = c[0], b = c[1], d = c[2];
  const std::int32_t ax = screen.x[a], bx = screen.x[b], dx = screen.x[d];
  const std::int32_t ay = screen.y[a], by = screen.y[b], dy = screen.y[d];
  const std::int32_t early = samples == 1 ? subpixels / 2 - 1 : 0;
  const std::int32_t late = samples == 1 ? subpixels / 2 : 0;
  const std::int32_t left = (std::min({ax, bx, dx}) + early) >> raster_subpixel_bits;
  const std::int32_t right = (std::max({ax, bx, dx}) - late) >> raster_subpixel_bits;
  const std::int32_t top = (std::min({ay, by, dy}) + early) >> raster_subpixel_bits;
  const std::int32_t bottom = (std::max({ay, by, dy}) - late) >> raster_subpixel_bits;
  if (left > right || top > bottom || right < 0 || bottom < 0 || left >= width || top >= height ||
      std::int64_t{bx - ax} * (dy - ay) == std::int64_t{by - ay} * (dx - ax))
    return {};
  const auto tile = [](std::int32_t pixel, std::int32_t last, std::int32_t size) {
    return static_cast<std::uint16_t>(std::clamp(pixel, 0, last) / size);
  };
  return {tile(left, width - 1, raster_tile_width), tile(right, width - 1, raster_tile_width),
          tile(top, height - 1, raster_tile_height), tile(bottom, height - 1, raster_tile_height)};
}

Bins sorted(const Screen& screen, std::uint32_t width, std::uint32_t height, int samples,
            const Context& context) {
  Bins bins;
  bins.across = (width + raster_tile_width - 1) / raster_tile_width;
  bins.down = (height + raster_tile_height - 1) / raster_tile_height;
  const std::size_t tiles = bins.across * bins.down, count = screen.shown.size();
  // Blocks so that their counters stay within 16 MiB.
  const std::size_t max = std::max<std::size_t>(1, (std::size_t{1} << 22) / tiles);
  const std::size_t grain = std::max<std::size_t>(4096, (count + max - 1) / max);
  const std::size_t blocks = (count + grain - 1) / grain;
  std::vector<TileRange> ranges(count);
  std::vector<std::uint32_t> counters(blocks * tiles);
  std::vector<std::uint64_t> drawn(blocks);
  const auto each = [&](std::size_t n, auto&& use) {
    const TileRange r = ranges[n];
    for (std::size_t y = r.top; y <= r.bottom && r.left <= r.right; ++y)
      for (std::size_t x = r.left; x <= r.right; ++x)
        use(y * bins.across + x);
  };
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    const std::size_t block = begin / grain;
    std::uint32_t* const mine = &counters[block * tiles];
    for (std::size_t n = begin; n < end; ++n) {
      ranges[n] = tiles_of(screen, n, static_cast<std::int32_t>(width),
                           static_cast<std::int32_t>(height), samples);
      drawn[block] += ranges[n].left <= ranges[n].right ? 1U : 0U;
      each(n, [&](std::size_t tile) { ++mine[tile]; });
    }
  });
  bins.start.resize(tiles + 1);
  std::uint32_t sum = 0;
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    bins.start[tile] = sum;
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::uint32_t here = counters[block * tiles + tile];
      counters[block * tiles + tile] = sum;
      sum += here;
    }
  }
  bins.start[tiles] = sum;
  for (const std::uint64_t n : drawn)
    bins.triangles += n;
  bins.list.resize(sum);
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const mine = &counters[begin / grain * tiles];
    for (std::size_t n = begin; n < end; ++n)
      each(n, [&](std::size_t tile) { bins.list[mine[tile]++] = static_cast<std::uint32_t>(n); });
  });
  return bins;
}

void set(float (&to)[3], const Vec3& from) {
  for (int a = 0; a < 3; ++a)
    to[a] = static_cast<float>(from[a]);
}

/// A material's textures as kernels see them.
class Textures {
public:
  explicit Textures(const SurfaceMaterial& material) {
    take(material.base, 0);
    take(material.detail, 1);
    take(material.reflection, 2);
    take(material.structure, 3);
  }
  const KernelTexture* at(std::size_t n) const { return there_[n] ? &textures_[n] : nullptr; }

private:
  void take(const std::optional<Texture>& texture, std::size_t n) {
    if (!texture)
      return;
    there_[n] = true;
    for (const TextureLevel& level : texture->levels)
      levels_[n].push_back({static_cast<std::int32_t>(level.width),
                            static_cast<std::int32_t>(level.height),
                            static_cast<std::int32_t>(level.first)});
    textures_[n] = {levels_[n].data(),
                    texture->texels->data(),
                    static_cast<std::int32_t>(levels_[n].size()),
                    texture->channels == 1,
                    texture->options.filter == TextureFilter::nearest,
                    texture->options.sphere,
                    static_cast<int>(texture->options.wrap)};
  }
  std::array<bool, 4> there_{};
  std::array<KernelTexture, 4> textures_{};
  std::array<std::vector<KernelLevel>, 4> levels_;
};

KernelScene scene_of(const Drawing& drawing, const Viewport& viewport,
                     const SurfaceMaterial& material, const Textures& textures,
                     std::optional<RasterRest>& rest) {
  static_assert(sizeof(DrawVertex) == 10 * sizeof(float) && sizeof(DrawFrame) == 7 * sizeof(float));
  static_assert(sizeof(Triangle) == 3 * sizeof(std::uint32_t));
  KernelScene scene{};
  scene.vertices = reinterpret_cast<const float*>(drawing.vertices.data());
  if (!drawing.frames.empty())
    scene.frames = reinterpret_cast<const float*>(drawing.frames.data());
  scene.triangles = reinterpret_cast<const std::uint32_t*>(drawing.triangles.data());
  viewport.rows(scene.clip);
  scene.base = textures.at(0);
  scene.detail = textures.at(1);
  scene.reflection = textures.at(2);
  scene.structure = textures.at(3);
  rest.emplace(drawing, material, scene);
  for (const KernelTexture* texture : {scene.base, scene.detail, scene.reflection, scene.structure})
    if (texture != nullptr) {
      scene.sphere = scene.sphere || texture->sphere;
      scene.clamped = scene.clamped || texture->wrap == 1;
      scene.derivatives = scene.derivatives || (texture->count > 1 && !texture->sphere);
    }
  set(scene.color, material.color);
  set(scene.light, drawing.light);
  set(scene.eye, drawing.camera.eye);
  set(scene.right, drawing.camera.right);
  set(scene.up, drawing.camera.up);
  set(scene.back, drawing.camera.back);
  for (std::size_t a = 0; a < 2; ++a)
    scene.offset[a] = static_cast<float>(drawing.offset[a]);
  scene.directional = drawing.directional;
  return scene;
}

std::uint32_t background_of(const SurfaceMaterial& material) {
  const std::array<std::uint8_t, 3> background = stored(material.background);
  return background[0] | static_cast<std::uint32_t>(background[1]) << 8 |
         static_cast<std::uint32_t>(background[2]) << 16;
}

/// The scene of some triangles, linked to that of the next ones.
struct MaterialScene {
  MaterialScene(const Drawing& drawing, const Viewport& viewport, const SurfaceMaterial& material)
      : textures(material), scene(scene_of(drawing, viewport, material, textures, rest)) {}
  /// What the film of its triangles mirrors.
  void cover(const WetFilm& of, const Vec3& surroundings, double full_distance) {
    if (!(of.amount > 0))
      return;
    if (scene.frames == nullptr)
      throw Error("a wet film on a drawing without frames, expected them at each vertex");
    const double alpha = of.roughness * of.roughness;
    film.amount = static_cast<float>(of.amount);
    film.alpha2 = static_cast<float>(alpha * alpha);
    film.reflectance = static_cast<float>(of.reflectance);
    set(film.mirrored, surroundings);
    film.full_distance = static_cast<float>(full_distance);
    scene.film = &film;
  }
  Textures textures;
  std::optional<RasterRest> rest;
  KernelFilm film{};
  KernelScene scene;
};

/// One for each group of triangles, one at least.
std::list<MaterialScene> scenes_of(const Drawing& drawing, const Viewport& viewport,
                                   const SurfaceMaterial& material) {
  std::list<MaterialScene> scenes;
  for (std::size_t g = 0; g < group_count(drawing); ++g) {
    const std::span<const Triangle> group = triangles_of_group(drawing, g);
    if (group.empty() && g > 0)
      continue;
    KernelScene* const last = scenes.empty() ? nullptr : &scenes.back().scene;
    const SurfaceMaterial& own = material_of_group(material, g);
    MaterialScene& made = scenes.emplace_back(drawing, viewport, own);
    if (!group.empty())
      made.cover(own.film, material.background, drawing.full_distance);
    KernelScene& scene = made.scene;
    scene.first = static_cast<std::uint32_t>(group.data() - drawing.triangles.data());
    scene.count = static_cast<std::uint32_t>(group.size());
    scene.background = background_of(material);
    if (last != nullptr)
      last->next = &scene;
  }
  return scenes;
}

} // namespace

Image render_cpu(const Drawing& drawing, const Projection& projection,
                 const SurfaceMaterial& material, std::uint32_t width, std::uint32_t height,
                 int samples, const Context& context, RenderReport* report) {
  const Viewport viewport(projection, width, height);
  const Screen screen = project(drawing, viewport, context);
  const Bins bins = sorted(screen, width, height, samples, context);
  const std::list<MaterialScene> scenes = scenes_of(drawing, viewport, material);
  const KernelScreen kernel_screen{screen.x.data(), screen.y.data(), screen.nearness.data(),
                                   screen.corners.data(), screen.shown.data()};
  const TileKernel draw_tile =
      context.cpu == CpuLevel::baseline ? draw_tile_baseline : draw_tile_avx2;
  Image image{width, height, 3, {}};
  image.values.resize(std::size_t{3} * width * height);
  const std::size_t tiles = bins.across * bins.down;
  std::vector<std::uint64_t> covered(tiles);
  parallel_blocks(context, tiles, 1, [&](std::size_t t, std::size_t) {
    const std::unique_ptr<std::byte[]> scratch(new std::byte[raster_scratch_bytes(samples)]);
    const auto left = static_cast<std::uint32_t>(t % bins.across * raster_tile_width);
    const auto top = static_cast<std::uint32_t>(t / bins.across * raster_tile_height);
    KernelTile tile{};
    tile.left = static_cast<std::int32_t>(left);
    tile.top = static_cast<std::int32_t>(top);
    tile.width = std::min<std::int32_t>(raster_tile_width, static_cast<std::int32_t>(width - left));
    tile.height =
        std::min<std::int32_t>(raster_tile_height, static_cast<std::int32_t>(height - top));
    tile.samples = samples;
    tile.list = bins.list.data() + bins.start[t];
    tile.count = bins.start[t + 1] - bins.start[t];
    tile.scratch = scratch.get();
    tile.row_bytes = std::size_t{3} * width;
    tile.out = &image.values[tile.row_bytes * top + std::size_t{3} * left];
    covered[t] = draw_tile(scenes.front().scene, kernel_screen, tile);
  });
  if (report != nullptr) {
    report->triangles = bins.triangles;
    report->covered = 0;
    for (const std::uint64_t count : covered)
      report->covered += count;
  }
  return image;
}

double render_cpu_bytes(std::uint32_t width, std::uint32_t height, int samples,
                        const Context& context) {
  const double tiles =
      (width / double{raster_tile_width} + 1) * (height / double{raster_tile_height} + 1);
  return 3.0 * width * height + 12 * tiles + 4.0 * (1 << 22) +
         static_cast<double>(raster_scratch_bytes(samples)) * thread_count(context);
}

} // namespace gewebe
