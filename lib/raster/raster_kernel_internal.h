#pragma once
// The inner loops of our rasteriser, once per CPU level, with the same bytes on each.

#include "texture/solid_plan.h"

#include <cstddef>
#include <cstdint>

namespace gewebe::raster {

constexpr int raster_tile_bits_x = 6, raster_tile_bits_y = 5;
constexpr int raster_tile_width = 1 << raster_tile_bits_x; // pixels
constexpr int raster_tile_height = 1 << raster_tile_bits_y;
constexpr int raster_subpixel_bits = 8;

struct KernelLevel {
  std::int32_t width, height, first;
};

/// See Texture.
struct KernelTexture {
  const KernelLevel* levels;
  const std::uint32_t* texels;
  std::int32_t count; ///< of levels
  bool gray, nearest, sphere;
  int wrap; ///< 0 repeat, 1 clamp, 2 mirror
};

/// A texture on the shape at rest: an image by three projections, or a solid one, or neither.
struct KernelRestLayer {
  const KernelTexture* image;
  const texture::SolidPlan* solid;
};

/// What textures on the shape at rest need (see rest.h). Vertices at rest are 6 floats: place,
/// normal; their turns 6: where the axes x and y went.
struct KernelRest {
  const float* vertices;
  const float* turns; ///< null: nothing moved
  KernelRestLayer base, detail, reflection, structure;
  bool normals;         ///< some image or a structure is there
  bool derivatives;     ///< some texture fades or shrinks
  float scale, part[3]; ///< q = scale · place + part: coordinates of images
  int sharpness;
  float shift; ///< of a solid structure towards the light, in the unit of places
};

/// A film of water, see wet_film.h.
struct KernelFilm {
  float amount, alpha2, reflectance; ///< w, a², F0
  float mirrored[3];                 ///< b
  float full_distance;               ///< of the light, see light_left(); 0: it doesn't fall off
};

struct KernelTextures {
  const KernelTexture *base, *detail, *reflection, *structure; ///< null where absent
};

/// The eye's place, and the directions of its view.
struct KernelEye {
  float at[3], right[3], up[3], back[3];
};

/// What shading needs of the triangles from `first` on; others have another material. Vertices are
/// 10 floats: position, s t, shifted s t, sphere s t, shade; frames 7: normal, tangent, side.
struct KernelScene {
  const float* vertices;
  const float* frames; ///< null: `shifted` and `sphere` of the vertices count
  const std::uint32_t* triangles;
  std::uint32_t first, count; ///< triangles of this material
  const KernelScene* next;    ///< other triangles with their material, or null
  double clip[3][4];          ///< rows x, y, w: to pixels times w, from the upper left
  KernelTextures textures;
  float color[3];
  float offset[2]; ///< of the structure along s and t
  float light[3];  ///< place, or unit direction to it
  bool directional, sphere;
  bool clamped;     ///< some texture neither repeats nor is mirrored: whole numbers count
  bool derivatives; ///< some texture shrinks by mipmaps
  KernelEye eye;
  const KernelFilm* film;   ///< null: dry. Else there are frames
  const KernelRest* rest;   ///< null where no texture needs it; such ones are absent above
  std::uint32_t background; ///< red, green, blue from the lowest byte
};

/// From places to the picture.
struct KernelView {
  double x[4], y[4], w[4]; ///< rows of the matrix to clip space
  double near, half_x, half_y;
  double guard_x, guard_y; ///< of the band in which coordinates fit, times w
};

/// Where vertices are on the picture.
struct KernelPlaces {
  std::int32_t *x, *y; ///< in subpixels, y downwards; 0 where the vertex has bit 32
  float* nearness;     ///< 1 / w; 0 likewise
  /// One bit for each side of the view on whose far side the vertex lies, 32 beyond the guard band.
  std::uint8_t* outside;
};

/// A triangle that may be seen: in (columns + 1)(rows + 1) tiles.
struct KernelSeen {
  std::uint32_t number;
  std::uint32_t bin; ///< of the first tile; a tile has two: those that face the viewer, and others
  std::uint16_t columns, rows;
};

/// How triangles are sorted into tiles.
struct KernelSorting {
  const std::int32_t *x, *y;
  const std::uint8_t* outside;         ///< null: all corners are on the picture
  std::int32_t width, height, samples; ///< of the picture
  std::int32_t across;                 ///< tiles in a row
};

/// Room for as many as are sorted, and how many there are.
struct KernelSorted {
  KernelSeen* seen;
  std::uint32_t* cut; ///< those that must be clipped first
  std::size_t seen_count, cut_count;
};

/// Vertices on the picture in subpixels, 1 / w, and which of them make triangles.
struct KernelScreen {
  const std::int32_t* x;
  const std::int32_t* y;
  const float* nearness;
  const std::uint32_t* triangles; ///< three corners each
  std::uint32_t count;            ///< of them
  const std::uint32_t* pieces;    ///< of clipped ones, likewise; their numbers follow
  const std::uint32_t* whole;     ///< the triangle of each piece
};

struct KernelTile {
  std::int32_t left, top, width, height; ///< pixels
  int samples;                           ///< 1 or 4
  /// Triangles that may reach the tile: first those that face the viewer, then others, in order.
  const std::uint32_t* list;
  std::size_t facing, count;
  void* scratch;     ///< raster_scratch_bytes(samples), aligned to 64
  std::uint8_t* out; ///< the tile's upper left pixel, three bytes each
  std::size_t row_bytes;
};

struct RasterKernels {
  /// Vertices of 10 floats from `begin` to `end`.
  void (*place)(const KernelView& view, const float* vertices, std::size_t begin, std::size_t end,
                const KernelPlaces& to);
  /// Adds those of `count` triangles that may be visible; the first one has the given number.
  void (*sort)(const KernelSorting& sorting, const std::uint32_t* corners, std::size_t count,
               std::uint32_t number, KernelSorted& to);
  /// Draws one tile; returns how many samples are covered.
  std::uint64_t (*draw_tile)(const KernelScene& scene, const KernelScreen& screen,
                             const KernelTile& tile);
};
extern const RasterKernels raster_kernels_baseline, raster_kernels_avx2;

std::size_t raster_scratch_bytes(int samples);

} // namespace gewebe::raster
