#pragma once
// A tile of the rasteriser: what is seen in each row, gathered and shaded. Included like
// raster_kernel_lanes_internal.h, from which all that happens in its lanes comes.

#include "raster/raster_kernel_film_lanes_internal.h"

#include <cstring>

namespace gewebe::raster {
namespace {

inline void to_bytes(const float (&rgb)[3], std::uint8_t* out) {
  for (int n = 0; n < 3; ++n) // as the lanes round
    out[n] =
        static_cast<std::uint8_t>(rgb[n] * 255.0F + 0.5F); // NOLINT(bugprone-incorrect-roundings)
}

/// Lists the row's pixels in which the scene's triangles are seen, in runs of one triangle.
template <bool Rest>
inline void gather(const KernelScene& scene, const KernelTile& tile, std::int32_t row,
                   const std::uint32_t* seen, Corners& corners, Slots& slots) {
  slots.count = 0;
  const std::uint32_t* const first = seen + std::ptrdiff_t{row} * stride;
  const float weight = tile.samples == 1 ? 1.0F : 0.25F;
  for (std::int32_t x = 0; x < tile.width;) {
    const std::uint32_t n = first[x];
    bool simple = true; // all samples alike
    const auto alike = [&](std::int32_t at) {
      for (int s = 1; s < tile.samples; ++s)
        if (first[s * plane + at] != first[at])
          return false;
      return true;
    };
    simple = alike(x);
    if (simple) {
      std::int32_t end = x + 1;
      while (end < tile.width && end < x + lanes && first[end] == n && alike(end))
        ++end;
      if (n - scene.first < scene.count) {
        corners.take(scene, n);
        interpolate<Rest>(scene, corners, tile.left + x, tile.top + row, slots, slots.count);
        for (std::int32_t at = x; at < end; ++at, ++slots.count) {
          slots.pixel[slots.count] = static_cast<std::uint8_t>(at);
          slots.weight[slots.count] = 1;
        }
      }
      x = end;
      continue;
    }
    for (int s = 0; s < tile.samples; ++s) {
      const std::uint32_t here = first[s * plane + x];
      bool earlier = here - scene.first >= scene.count;
      for (int other = 0; other < s; ++other)
        earlier = earlier || first[other * plane + x] == here;
      if (earlier)
        continue;
      float sum = 0;
      for (int other = s; other < tile.samples; ++other)
        sum += first[other * plane + x] == here ? weight : 0;
      corners.take(scene, here);
      interpolate<Rest>(scene, corners, tile.left + x, tile.top + row, slots, slots.count);
      slots.pixel[slots.count] = static_cast<std::uint8_t>(x);
      slots.weight[slots.count++] = sum;
    }
    ++x;
  }
}

using Means = float[raster_tile_width][3]; ///< of a pixel's samples

/// Adds what is seen of one scene: to `mean` with several samples, else to the picture.
template <bool Rest>
inline void draw_scene(const KernelScene& scene, const KernelTile& tile, std::int32_t row,
                       const std::uint32_t* seen, Corners& corners, Slots& slots, Means& mean) {
  std::uint8_t* const out = tile.out + static_cast<std::size_t>(row) * tile.row_bytes;
  gather<Rest>(scene, tile, row, seen, corners, slots);
  for (std::size_t at = 0; at < slots.count; at += lanes) {
    const Colors colors = shade<Rest>(scene, slots, at);
    const std::size_t end = slots.count - at < lanes ? slots.count - at : lanes;
    if (tile.samples == 1) {
      Ints bytes[3];
      for (int n = 0; n < 3; ++n)
        bytes[n] = to_ints(colors.c[n] * splat(255.0F) + splat(0.5F));
      const Ints packed = bytes[0] | bytes[1] << 8 | bytes[2] << 16;
      for (std::size_t i = 0; i < end; ++i) {
        std::uint8_t* const to = out + std::size_t{3} * slots.pixel[at + i];
        const auto value = static_cast<std::uint32_t>(packed[i]);
        to[0] = static_cast<std::uint8_t>(value);
        to[1] = static_cast<std::uint8_t>(value >> 8);
        to[2] = static_cast<std::uint8_t>(value >> 16);
      }
      continue;
    }
    for (std::size_t i = 0; i < end; ++i)
      for (int n = 0; n < 3; ++n)
        mean[slots.pixel[at + i]][n] += slots.weight[at + i] * colors.c[n][i];
  }
}

inline void draw_row(const KernelScene& scene, const KernelTile& tile, std::int32_t row,
                     const std::uint32_t* seen, Corners& corners, Slots& slots) {
  std::uint8_t* const out = tile.out + static_cast<std::size_t>(row) * tile.row_bytes;
  Means mean;
  if (tile.samples > 1)
    for (std::int32_t x = 0; x < tile.width; ++x)
      for (int n = 0; n < 3; ++n) {
        int empty = 0;
        for (int s = 0; s < tile.samples; ++s)
          empty += seen[s * plane + row * stride + x] == nothing ? 1 : 0;
        mean[x][n] =
            0.25F * static_cast<float>(empty) * (static_cast<float>(out[3 * x + n]) * (1.0F / 255));
      }
  for (const KernelScene* each = &scene; each != nullptr; each = each->next) {
    const auto draw = each->rest != nullptr ? draw_scene<true> : draw_scene<false>;
    draw(*each, tile, row, seen, corners, slots, mean);
  }
  if (tile.samples > 1)
    for (std::int32_t x = 0; x < tile.width; ++x)
      to_bytes(mean[x], out + std::size_t{3} * static_cast<std::size_t>(x));
}

/// Where pieces of clipped triangles are seen, names these.
inline void name_pieces(const KernelScreen& screen, const KernelTile& tile, std::uint32_t* seen) {
  const auto some = [&](std::size_t end) { // they are the last ones of each part
    return end > 0 && tile.list[end - 1] >= screen.count;
  };
  if (some(tile.facing) || some(tile.count))
    for (std::ptrdiff_t at = 0; at < std::ptrdiff_t{tile.samples} * plane; ++at)
      if (seen[at] != nothing && seen[at] >= screen.count)
        seen[at] = screen.whole[seen[at] - screen.count];
}

inline std::uint64_t draw_tile(const KernelScene& scene, const KernelScreen& screen,
                               const KernelTile& tile) {
  float* const depth = static_cast<float*>(tile.scratch);
  const int planes = tile.samples * plane + lanes;
  auto* const seen = reinterpret_cast<std::uint32_t*>(depth + planes);
  if (tile.count > 0) {
    std::memset(depth, 0, static_cast<std::size_t>(planes) * sizeof *depth);
    std::memset(seen, 0xff, static_cast<std::size_t>(planes) * sizeof *seen);
  }
  for (std::size_t n = 0; n < tile.facing; ++n)
    rasterise_triangle<false>(screen, tile, tile.list[n], depth, seen);
  for (std::size_t n = tile.facing; n < tile.count; ++n)
    rasterise_triangle<true>(screen, tile, tile.list[n], depth, seen);
  name_pieces(screen, tile, seen);
  std::uint64_t covered = 0;
  Corners corners;
  Slots slots;
  std::uint8_t blank[3 * raster_tile_width];
  for (std::size_t x = 0; x < sizeof blank; ++x)
    blank[x] = static_cast<std::uint8_t>(scene.background >> (8 * (x % 3)));
  for (std::int32_t row = 0; row < tile.height; ++row) {
    std::memcpy(tile.out + static_cast<std::size_t>(row) * tile.row_bytes, blank,
                std::size_t{3} * static_cast<std::size_t>(tile.width));
    if (tile.count == 0)
      continue;
    draw_row(scene, tile, row, seen, corners, slots);
    for (int s = 0; s < tile.samples; ++s)
      for (std::int32_t x = 0; x < tile.width; ++x)
        covered += seen[s * plane + row * stride + x] != nothing ? 1U : 0U;
  }
  return covered;
}

} // namespace
} // namespace gewebe::raster
