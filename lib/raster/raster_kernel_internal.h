#pragma once
// The inner loops of our rasteriser, once per CPU level, with the same bytes on each.

#include "shading/solid_plan.h"

#include <cstddef>
#include <cstdint>

namespace gewebe {

constexpr int raster_tile_width = 64, raster_tile_height = 32; // pixels
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
  const SolidPlan* solid;
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

/// What shading needs of the triangles from `first` on; others have another material. Vertices are
/// 10 floats: position, s t, shifted s t, sphere s t, shade; frames 7: normal, tangent, side.
struct KernelScene {
  const float* vertices;
  const float* frames; ///< null: `shifted` and `sphere` of the vertices count
  const std::uint32_t* triangles;
  std::uint32_t first, count; ///< triangles of this material
  const KernelScene* next;    ///< other triangles with their material, or null
  double clip[3][4];          ///< rows x, y, w: to pixels times w, from the upper left
  const KernelTexture *base, *detail, *reflection, *structure; ///< null where absent
  float color[3];
  float offset[2]; ///< of the structure along s and t
  float light[3];  ///< place, or unit direction to it
  bool directional, sphere;
  bool clamped;     ///< some texture neither repeats nor is mirrored: whole numbers count
  bool derivatives; ///< some texture shrinks by mipmaps
  float eye[3], right[3], up[3], back[3];
  const KernelFilm* film;   ///< null: dry. Else there are frames
  const KernelRest* rest;   ///< null where no texture needs it; such ones are absent above
  std::uint32_t background; ///< red, green, blue from the lowest byte
};

/// Vertices on the picture in subpixels, 1 / w, and which of them make triangles.
struct KernelScreen {
  const std::int32_t* x;
  const std::int32_t* y;
  const float* nearness;
  const std::uint32_t* corners; ///< three per triangle
  const std::uint32_t* shown;   ///< what a triangle is a piece of, in KernelScene::triangles
};

struct KernelTile {
  std::int32_t left, top, width, height; ///< pixels
  int samples;                           ///< 1 or 4
  const std::uint32_t* list;             ///< triangles that may reach the tile, in order
  std::size_t count;
  void* scratch;     ///< raster_scratch_bytes(samples), aligned to 64
  std::uint8_t* out; ///< the tile's upper left pixel, three bytes each
  std::size_t row_bytes;
};

/// Draws one tile; returns how many samples are covered.
using TileKernel = std::uint64_t (*)(const KernelScene& scene, const KernelScreen& screen,
                                     const KernelTile& tile);
std::uint64_t draw_tile_baseline(const KernelScene& scene, const KernelScreen& screen,
                                 const KernelTile& tile);
std::uint64_t draw_tile_avx2(const KernelScene& scene, const KernelScreen& screen,
                             const KernelTile& tile);

std::size_t raster_scratch_bytes(int samples);

} // namespace gewebe
