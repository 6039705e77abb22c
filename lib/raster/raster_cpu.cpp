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

namespace gewebe::raster {
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
  Viewport(const shading::Projection& projection, std::uint32_t width, std::uint32_t height)
      : m_(projection.matrix), near_(projection.near), half_x_(width / 2.0), half_y_(height / 2.0),
        guard_x_(1 + guard_pixels / half_x_), guard_y_(1 + guard_pixels / half_y_) {}

  ClipVertex transform(const shading::DrawVertex& v) const {
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

  double pixel_x(const ClipVertex& v) const { return (v.x / v.w + 1) * half_x_; }
  double pixel_y(const ClipVertex& v) const { return (1 - v.y / v.w) * half_y_; }

  KernelView kernel_view() const {
    KernelView view{{}, {}, {}, near_, half_x_, half_y_, guard_x_, guard_y_};
    for (std::size_t c = 0; c < 4; ++c) {
      view.x[c] = m_[0][c];
      view.y[c] = m_[1][c];
      view.w[c] = m_[3][c];
    }
    return view;
  }

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

/// Vertices on the picture, those of clipped triangles at the end.
struct Screen {
  std::vector<std::int32_t> x, y; ///< in subpixels, y downwards
  std::vector<float> nearness;    ///< 1 / w
  std::vector<std::uint8_t> outside;
  std::vector<std::uint32_t> pieces, whole; ///< see KernelScreen

  void add(const Viewport& viewport, const ClipVertex& clip) {
    const auto fixed = [](double pixels) {       // as kernels round
      const double shifter = 6755399441055744.0; // 1.5 · 2^52
      return static_cast<std::int32_t>((pixels * subpixels + shifter) - shifter);
    };
    x.push_back(fixed(viewport.pixel_x(clip)));
    y.push_back(fixed(viewport.pixel_y(clip)));
    nearness.push_back(static_cast<float>(1 / clip.w));
  }
};

Screen project(const shading::Drawing& drawing, const Viewport& viewport,
               const RasterKernels& kernels, const Context& context) {
  constexpr std::size_t grain = 4096;
  Screen screen;
  const std::size_t vertices = drawing.vertices.size();
  screen.x.resize(vertices);
  screen.y.resize(vertices);
  screen.nearness.resize(vertices);
  screen.outside.resize(vertices);
  const KernelView view = viewport.kernel_view();
  const KernelPlaces places{screen.x.data(), screen.y.data(), screen.nearness.data(),
                            screen.outside.data()};
  parallel_blocks(context, vertices, grain, [&](std::size_t begin, std::size_t end) {
    kernels.place(view, reinterpret_cast<const float*>(drawing.vertices.data()), begin, end,
                  places);
  });
  return screen;
}

/// Adds the pieces inside the guard band of a triangle that reaches beyond it.
void clip(const shading::Drawing& drawing, const Viewport& viewport, std::uint32_t n,
          Screen& screen) {
  const Triangle& t = drawing.triangles[n];
  const std::vector<ClipVertex> polygon =
      clipped(viewport, {viewport.transform(drawing.vertices[t[0]]),
                         viewport.transform(drawing.vertices[t[1]]),
                         viewport.transform(drawing.vertices[t[2]])});
  const auto first = static_cast<std::uint32_t>(screen.x.size());
  for (const ClipVertex& vertex : polygon)
    screen.add(viewport, vertex);
  for (std::uint32_t k = 2; k < polygon.size(); ++k) {
    screen.pieces.insert(screen.pieces.end(), {first, first + k - 1, first + k});
    screen.whole.push_back(n);
  }
}

/// The triangles that may be seen in each tile: those that face the viewer, then others, in order.
struct Bins {
  std::size_t across = 0, down = 0;
  std::vector<std::uint32_t> start; ///< of each of the tiles' two bins, and the end
  std::vector<std::uint32_t> list;
  std::uint64_t triangles = 0; ///< that are in some
};

/// Some triangles one after the other, and what there is of them.
struct SortedBlock {
  std::vector<KernelSeen> seen;
  std::vector<std::uint32_t> cut;
  std::vector<std::uint32_t> counters; ///< of bins: triangles, then the place of the next one
};

template <class Use>
void each_bin(const KernelSeen& seen, std::size_t across, Use&& use) {
  for (std::size_t y = 0; y <= seen.rows; ++y)
    for (std::size_t x = 0; x <= seen.columns; ++x)
      use(seen.bin + 2 * (y * across + x));
}

/// Clips triangles that must be, and sorts all.
Bins sorted(const shading::Drawing& drawing, const Viewport& viewport, const RasterKernels& kernels,
            std::uint32_t width, std::uint32_t height, int samples, const Context& context,
            Screen& screen) {
  Bins bins;
  bins.across = (width + raster_tile_width - 1) / raster_tile_width;
  bins.down = (height + raster_tile_height - 1) / raster_tile_height;
  const std::size_t bin_count = 2 * bins.across * bins.down, count = drawing.triangles.size();
  // Blocks so that their counters stay within 16 MiB.
  const std::size_t max = std::max<std::size_t>(1, (std::size_t{1} << 22) / bin_count);
  const std::size_t grain = std::max<std::size_t>(4096, (count + max - 1) / max);
  std::vector<SortedBlock> blocks((count + grain - 1) / grain);
  KernelSorting sorting{screen.x.data(),
                        screen.y.data(),
                        screen.outside.data(),
                        static_cast<std::int32_t>(width),
                        static_cast<std::int32_t>(height),
                        samples,
                        static_cast<std::int32_t>(bins.across)};
  const auto sort = [&](const std::uint32_t* corners, std::size_t some, std::size_t number,
                        SortedBlock& block) {
    block.seen.resize(some);
    block.cut.resize(some);
    KernelSorted to{block.seen.data(), block.cut.data(), 0, 0};
    kernels.sort(sorting, corners, some, static_cast<std::uint32_t>(number), to);
    block.seen.resize(to.seen_count);
    block.cut.resize(to.cut_count);
    block.counters.resize(bin_count);
    for (const KernelSeen& seen : block.seen)
      each_bin(seen, bins.across, [&](std::size_t bin) { ++block.counters[bin]; });
  };
  const auto* const corners = reinterpret_cast<const std::uint32_t*>(drawing.triangles.data());
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    sort(corners + 3 * begin, end - begin, begin, blocks[begin / grain]);
  });
  for (const SortedBlock& block : blocks)
    for (const std::uint32_t n : block.cut)
      clip(drawing, viewport, n, screen);
  if (!screen.whole.empty()) {
    sorting.x = screen.x.data();
    sorting.y = screen.y.data();
    sorting.outside = nullptr;
    sort(screen.pieces.data(), screen.whole.size(), count, blocks.emplace_back());
  }
  bins.start.resize(bin_count + 1);
  std::uint32_t sum = 0;
  for (std::size_t bin = 0; bin < bin_count; ++bin) {
    bins.start[bin] = sum;
    for (SortedBlock& block : blocks) {
      const std::uint32_t here = block.counters[bin];
      block.counters[bin] = sum;
      sum += here;
    }
  }
  bins.start[bin_count] = sum;
  for (const SortedBlock& block : blocks)
    bins.triangles += block.seen.size();
  bins.list.resize(sum);
  parallel_blocks(context, blocks.size(), 1, [&](std::size_t b, std::size_t) {
    for (const KernelSeen& seen : blocks[b].seen)
      each_bin(seen, bins.across,
               [&](std::size_t bin) { bins.list[blocks[b].counters[bin]++] = seen.number; });
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
  explicit Textures(const texture::SurfaceMaterial& material) {
    take(material.base, 0);
    take(material.detail, 1);
    take(material.reflection, 2);
    take(material.structure, 3);
  }
  const KernelTexture* at(std::size_t n) const { return there_[n] ? &textures_[n] : nullptr; }

private:
  void take(const std::optional<texture::Texture>& texture, std::size_t n) {
    if (!texture)
      return;
    there_[n] = true;
    for (const texture::TextureLevel& level : texture->levels)
      levels_[n].push_back({static_cast<std::int32_t>(level.width),
                            static_cast<std::int32_t>(level.height),
                            static_cast<std::int32_t>(level.first)});
    textures_[n] = {levels_[n].data(),
                    texture->texels->data(),
                    static_cast<std::int32_t>(levels_[n].size()),
                    texture->channels == 1,
                    texture->options.filter == texture::TextureFilter::nearest,
                    texture->options.sphere,
                    static_cast<int>(texture->options.wrap)};
  }
  std::array<bool, 4> there_{};
  std::array<KernelTexture, 4> textures_{};
  std::array<std::vector<KernelLevel>, 4> levels_;
};

KernelScene scene_of(const shading::Drawing& drawing, const Viewport& viewport,
                     const texture::SurfaceMaterial& material, const Textures& textures,
                     std::optional<RasterRest>& rest) {
  static_assert(sizeof(shading::DrawVertex) == 10 * sizeof(float) &&
                sizeof(shading::DrawFrame) == 7 * sizeof(float));
  static_assert(sizeof(Triangle) == 3 * sizeof(std::uint32_t));
  KernelScene scene{};
  scene.vertices = reinterpret_cast<const float*>(drawing.vertices.data());
  if (!drawing.frames.empty())
    scene.frames = reinterpret_cast<const float*>(drawing.frames.data());
  scene.triangles = reinterpret_cast<const std::uint32_t*>(drawing.triangles.data());
  viewport.rows(scene.clip);
  scene.textures.base = textures.at(0);
  scene.textures.detail = textures.at(1);
  scene.textures.reflection = textures.at(2);
  scene.textures.structure = textures.at(3);
  rest.emplace(drawing, material, scene);
  for (const KernelTexture* texture : {scene.textures.base, scene.textures.detail,
                                       scene.textures.reflection, scene.textures.structure})
    if (texture != nullptr) {
      scene.sphere = scene.sphere || texture->sphere;
      scene.clamped = scene.clamped || texture->wrap == 1;
      scene.derivatives = scene.derivatives || (texture->count > 1 && !texture->sphere);
    }
  set(scene.color, material.color);
  set(scene.light, drawing.light);
  set(scene.eye.at, drawing.camera.eye);
  set(scene.eye.right, drawing.camera.right);
  set(scene.eye.up, drawing.camera.up);
  set(scene.eye.back, drawing.camera.back);
  for (std::size_t a = 0; a < 2; ++a)
    scene.offset[a] = static_cast<float>(drawing.offset[a]);
  scene.directional = drawing.directional;
  return scene;
}

std::uint32_t background_of(const texture::SurfaceMaterial& material) {
  const std::array<std::uint8_t, 3> background = texture::stored(material.background);
  return background[0] | static_cast<std::uint32_t>(background[1]) << 8 |
         static_cast<std::uint32_t>(background[2]) << 16;
}

/// The scene of some triangles, linked to that of the next ones.
struct MaterialScene {
  MaterialScene(const shading::Drawing& drawing, const Viewport& viewport,
                const texture::SurfaceMaterial& material)
      : textures(material), scene(scene_of(drawing, viewport, material, textures, rest)) {}
  /// What the film of its triangles mirrors.
  void cover(const texture::WetFilm& of, const Vec3& surroundings, double full_distance) {
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
std::list<MaterialScene> scenes_of(const shading::Drawing& drawing, const Viewport& viewport,
                                   const texture::SurfaceMaterial& material) {
  std::list<MaterialScene> scenes;
  for (std::size_t g = 0; g < shading::group_count(drawing); ++g) {
    const std::span<const Triangle> group = shading::triangles_of_group(drawing, g);
    if (group.empty() && g > 0)
      continue;
    KernelScene* const last = scenes.empty() ? nullptr : &scenes.back().scene;
    const texture::SurfaceMaterial& own = texture::material_of_group(material, g);
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

struct alignas(64) CacheLine {
  std::byte bytes[64];
};

} // namespace

texture::Image render_cpu(const shading::Drawing& drawing, const shading::Projection& projection,
                          const texture::SurfaceMaterial& material, std::uint32_t width,
                          std::uint32_t height, int samples, const Context& context,
                          RenderReport* report) {
  const Viewport viewport(projection, width, height);
  const RasterKernels& kernels =
      context.cpu == CpuLevel::baseline ? raster_kernels_baseline : raster_kernels_avx2;
  Screen screen = project(drawing, viewport, kernels, context);
  const Bins bins = sorted(drawing, viewport, kernels, width, height, samples, context, screen);
  const std::list<MaterialScene> scenes = scenes_of(drawing, viewport, material);
  const KernelScreen kernel_screen{screen.x.data(),
                                   screen.y.data(),
                                   screen.nearness.data(),
                                   scenes.front().scene.triangles,
                                   static_cast<std::uint32_t>(drawing.triangles.size()),
                                   screen.pieces.data(),
                                   screen.whole.data()};
  texture::Image image{width, height, 3, {}};
  image.values.resize(std::size_t{3} * width * height);
  const std::size_t tiles = bins.across * bins.down;
  std::vector<std::uint64_t> covered(tiles);
  parallel_blocks(context, tiles, 1, [&](std::size_t t, std::size_t) {
    const auto scratch =
        std::make_unique_for_overwrite<CacheLine[]>(raster_scratch_bytes(samples) / 64 + 1);
    const auto left = static_cast<std::uint32_t>(t % bins.across * raster_tile_width);
    const auto top = static_cast<std::uint32_t>(t / bins.across * raster_tile_height);
    KernelTile tile{};
    tile.left = static_cast<std::int32_t>(left);
    tile.top = static_cast<std::int32_t>(top);
    tile.width = std::min<std::int32_t>(raster_tile_width, static_cast<std::int32_t>(width - left));
    tile.height =
        std::min<std::int32_t>(raster_tile_height, static_cast<std::int32_t>(height - top));
    tile.samples = samples;
    tile.list = bins.list.data() + bins.start[2 * t];
    tile.facing = bins.start[2 * t + 1] - bins.start[2 * t];
    tile.count = bins.start[2 * t + 2] - bins.start[2 * t];
    tile.scratch = scratch.get();
    tile.row_bytes = std::size_t{3} * width;
    tile.out = &image.values[tile.row_bytes * top + std::size_t{3} * left];
    covered[t] = kernels.draw_tile(scenes.front().scene, kernel_screen, tile);
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
  return 3.0 * width * height + 16 * tiles + 4.0 * (1 << 22) +
         static_cast<double>(raster_scratch_bytes(samples)) * thread_count(context);
}

} // namespace gewebe::raster
