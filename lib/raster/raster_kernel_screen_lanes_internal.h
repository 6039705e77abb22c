#pragma once
// What comes before the tiles, eight at a time: vertices on the picture, and which tiles a triangle
// may be seen in. Included like raster_kernel_lanes_internal.h.

#include "raster/raster_kernel_lanes_internal.h"

namespace gewebe::raster {
namespace {

using Longs = std::int64_t __attribute__((vector_size(64)));

inline Ints narrow(Longs mask) {
  return __builtin_convertvector(mask, Ints);
}
inline Doubles splat(double x) {
  return Doubles{x, x, x, x, x, x, x, x};
}

/// The vertices from `begin` to `end`, at most eight.
inline void place_vertices(const KernelView& view, const float* vertices, std::size_t begin,
                           std::size_t end, const KernelPlaces& to) {
  Doubles p[3]{};
  for (std::size_t i = 0; begin + i < end; ++i)
    for (std::size_t a = 0; a < 3; ++a)
      p[a][i] = static_cast<double>(vertices[10 * (begin + i) + a]);
  const auto row = [&](const double(&r)[4]) {
    return splat(r[0]) * p[0] + splat(r[1]) * p[1] + splat(r[2]) * p[2] + splat(r[3]);
  };
  const Doubles x = row(view.x), y = row(view.y), w = row(view.w);
  const Longs behind = w < splat(view.near);
  const Longs sides =
      (behind & 1) | ((x < -w) & 2) | ((x > w) & 4) | ((y < -w) & 8) | ((y > w) & 16);
  const Doubles wide = splat(view.guard_x) * w, high = splat(view.guard_y) * w, zero = splat(0.0);
  const Longs within = (w - splat(view.near) >= zero) & (wide + x >= zero) & (wide - x >= zero) &
                       (high + y >= zero) & (high - y >= zero);
  const Longs cut = (sides != 0) & ~within;
  const auto kept = [&](Doubles v) { return as<Doubles>(as<Longs>(v) & ~cut); };
  const auto fixed = [&](Doubles pixels) {             // to the nearest, without a call
    const Doubles shifter = splat(6755399441055744.0); // 1.5 · 2^52
    return __builtin_convertvector(
        kept((pixels * splat(double{1 << raster_subpixel_bits}) + shifter) - shifter), Ints);
  };
  const Ints on_x = fixed((x / w + splat(1.0)) * splat(view.half_x));
  const Ints on_y = fixed((splat(1.0) - y / w) * splat(view.half_y));
  const Floats nearness = __builtin_convertvector(kept(splat(1.0) / w), Floats);
  const Ints outside = narrow(sides | (cut & 32));
  for (std::size_t i = 0; begin + i < end; ++i) {
    to.x[begin + i] = on_x[i];
    to.y[begin + i] = on_y[i];
    to.nearness[begin + i] = nearness[i];
    to.outside[begin + i] = static_cast<std::uint8_t>(outside[i]);
  }
}

inline void place_all(const KernelView& view, const float* vertices, std::size_t begin,
                      std::size_t end, const KernelPlaces& to) {
  for (; begin + lanes <= end; begin += lanes)
    place_vertices(view, vertices, begin, begin + lanes, to);
  if (begin < end)
    place_vertices(view, vertices, begin, end, to);
}

inline Ints least(Ints a, Ints b) {
  return choose(a < b, a, b);
}
inline Ints greatest(Ints a, Ints b) {
  return choose(a > b, a, b);
}

/// `count` triangles, at most eight, whose corners are given.
inline void sort_some(const KernelSorting& sorting, const std::uint32_t* corners, std::size_t count,
                      std::uint32_t number, KernelSorted& to) {
  Ints x[3]{}, y[3]{}, all = splat(-1), some = splat(0);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = corners[3 * i + k];
      x[k][i] = sorting.x[v];
      y[k][i] = sorting.y[v];
      if (sorting.outside != nullptr) {
        all[i] &= sorting.outside[v];
        some[i] |= sorting.outside[v];
      }
    }
  if (sorting.outside == nullptr)
    all = splat(0);
  const Ints away = (all & 31) != 0, clips = (some & 32) != 0;
  const auto product = [](Ints a, Ints b) { // exact: differences have 26 bits
    return __builtin_convertvector(a, Doubles) * __builtin_convertvector(b, Doubles);
  };
  const Doubles one = product(x[1] - x[0], y[2] - y[0]), other = product(y[1] - y[0], x[2] - x[0]);
  const Ints flat = narrow(one == other), back = narrow(one > other);
  // The centre of pixel p is at (p + 1/2) subpixels; samples are less than half a pixel away.
  constexpr std::int32_t half = 1 << (raster_subpixel_bits - 1);
  const std::int32_t early = sorting.samples == 1 ? half - 1 : 0;
  const std::int32_t late = sorting.samples == 1 ? half : 0;
  const Ints left = (least(least(x[0], x[1]), x[2]) + early) >> raster_subpixel_bits;
  const Ints right = (greatest(greatest(x[0], x[1]), x[2]) - late) >> raster_subpixel_bits;
  const Ints top = (least(least(y[0], y[1]), y[2]) + early) >> raster_subpixel_bits;
  const Ints bottom = (greatest(greatest(y[0], y[1]), y[2]) - late) >> raster_subpixel_bits;
  const Ints none = away | clips | flat | (left > right) | (top > bottom) | (right < 0) |
                    (bottom < 0) | (left >= sorting.width) | (top >= sorting.height);
  const auto tile = [](Ints pixel, std::int32_t size, int shift) {
    return least(greatest(pixel, splat(0)), splat(size - 1)) >> shift;
  };
  const Ints column = tile(left, sorting.width, raster_tile_bits_x);
  const Ints row = tile(top, sorting.height, raster_tile_bits_y);
  const Ints first = 2 * (row * sorting.across + column) + (back & 1);
  const Ints columns = tile(right, sorting.width, raster_tile_bits_x) - column;
  const Ints rows = tile(bottom, sorting.height, raster_tile_bits_y) - row;
  for (std::size_t i = 0; i < count; ++i) { // without a branch: half of them are none
    to.seen[to.seen_count] = {
        number + static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(first[i]),
        static_cast<std::uint16_t>(columns[i]), static_cast<std::uint16_t>(rows[i])};
    to.seen_count += static_cast<std::size_t>(none[i] + 1);
  }
  if (any(clips & ~away))
    for (std::size_t i = 0; i < count; ++i)
      if ((clips[i] & ~away[i]) != 0)
        to.cut[to.cut_count++] = number + static_cast<std::uint32_t>(i);
}

inline void sort_all(const KernelSorting& sorting, const std::uint32_t* corners, std::size_t count,
                     std::uint32_t number, KernelSorted& to) {
  for (; count >= lanes; count -= lanes, corners += std::size_t{3} * lanes, number += lanes)
    sort_some(sorting, corners, lanes, number, to);
  if (count > 0)
    sort_some(sorting, corners, count, number, to);
}

} // namespace
} // namespace gewebe::raster
