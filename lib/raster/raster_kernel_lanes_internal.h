#pragma once
// The rasteriser's inner loops over eight lanes, for inclusion by one unit for each CPU level. The
// lanes are the compilers' own vectors: + - * / and square roots are IEEE's on every level, and
// nothing is contracted, so the bytes are equal.
//
// Based on: Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (edge functions); Olano
// and Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997 (weights without
// clipping); Burns and Hunt, The Visibility Buffer, 2013 (what is seen first, colours afterwards).

#include "raster/raster_kernel_internal.h"

#include <cstring>
#include <immintrin.h>

#pragma GCC diagnostic ignored "-Wpsabi" // no vector crosses a call that is not inlined

namespace gewebe::raster {

constexpr int lanes = 8;
constexpr std::uint32_t nothing = UINT32_MAX;
constexpr int stride = raster_tile_width + lanes; // of a row: lanes may reach beyond the tile
constexpr int plane = stride * raster_tile_height;
constexpr int slot_count = 4 * raster_tile_width + lanes;
// Four samples on a rotated grid, in subpixels from the pixel's centre.
constexpr std::int32_t sample_x[4] = {-32, 96, -96, 32}, sample_y[4] = {-96, -32, 32, 96};

namespace {

using Floats = float __attribute__((vector_size(32)));
using Ints = std::int32_t __attribute__((vector_size(32)));
using Words = std::uint32_t __attribute__((vector_size(32)));
using Doubles = double __attribute__((vector_size(64)));

template <class To, class From>
inline To as(From from) {
  return __builtin_bit_cast(To, from);
}
template <class V>
inline V load(const void* from) {
  V v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
template <class V>
inline void store(void* to, V v) {
  std::memcpy(to, &v, sizeof v);
}
inline Floats splat(float x) {
  return Floats{x, x, x, x, x, x, x, x};
}
inline Ints splat(std::int32_t x) {
  return Ints{x, x, x, x, x, x, x, x};
}
inline Floats ramp() {
  return Floats{0, 1, 2, 3, 4, 5, 6, 7};
}
inline Floats choose(Ints mask, Floats yes, Floats no) {
  return as<Floats>((mask & as<Ints>(yes)) | (~mask & as<Ints>(no)));
}
inline Ints choose(Ints mask, Ints yes, Ints no) {
  return (mask & yes) | (~mask & no);
}
// A NaN gives the second.
inline Floats larger(Floats a, Floats b) {
  return choose(a > b, a, b);
}
inline Floats smaller(Floats a, Floats b) {
  return choose(a < b, a, b);
}

#ifdef __AVX2__
inline bool any(Ints mask) {
  return _mm256_movemask_ps(as<__m256>(mask)) != 0;
}
inline Floats root(Floats x) {
  return as<Floats>(_mm256_sqrt_ps(as<__m256>(x)));
}
#else
struct Halves {
  __m128 low, high;
};
inline bool any(Ints mask) {
  const auto h = as<Halves>(mask);
  return _mm_movemask_ps(_mm_or_ps(h.low, h.high)) != 0;
}
inline Floats root(Floats x) {
  const auto h = as<Halves>(x);
  return as<Floats>(Halves{_mm_sqrt_ps(h.low), _mm_sqrt_ps(h.high)});
}
#endif

inline float larger(float a, float b) {
  return a > b ? a : b;
}

inline Ints to_ints(Floats x) {
  return __builtin_convertvector(x, Ints);
}
inline Floats to_floats(Ints x) {
  return __builtin_convertvector(x, Floats);
}
/// \pre |x| < 2^31
inline Floats floor_of(Floats x) {
  const Floats cut = to_floats(to_ints(x));
  return cut - choose(cut > x, splat(1.0F), splat(0.0F));
}
/// x where it has digits behind the point that count, else 0; 0 for NaN.
inline Floats tame(Floats x) {
  const Ints small = (x < splat(8388608.0F)) & (x > splat(-8388608.0F));
  return choose(small, x, splat(0.0F));
}
inline Floats inverse_or_zero(Floats length) {
  return choose(length > splat(0.0F), splat(1.0F) / length, splat(0.0F));
}

// --- Which triangle is seen
// -----------------------------------------------------------------------------

/// A triangle relative to the tile, inside where all three edge functions are >= 0:
/// e = c + dx · x + dy · y in pixels of the tile.
template <class Number>
struct Edges {
  Number c[3], dx[3], dy[3];
};

struct Nearness { // of the triangle's plane, at pixels of the tile
  double c, dx, dy;
  float min, max;
};

template <class Number>
inline Ints inside(const Number (&e)[3], const Number (&dx)[3], Floats) {
  if constexpr (sizeof(Number) == 4) {
    const Ints lane{0, 1, 2, 3, 4, 5, 6, 7};
    const Ints all = (splat(e[0]) + splat(dx[0]) * lane) | (splat(e[1]) + splat(dx[1]) * lane) |
                     (splat(e[2]) + splat(dx[2]) * lane);
    return all >= 0;
  } else {
    const Doubles lane{0, 1, 2, 3, 4, 5, 6, 7};
    const auto all =
        (e[0] + dx[0] * lane >= 0) & (e[1] + dx[1] * lane >= 0) & (e[2] + dx[2] * lane >= 0);
    return __builtin_convertvector(all, Ints);
  }
}

struct PixelBox { // of the tile, the last ones too
  std::int32_t left, right, top, bottom;
};

template <bool Behind, class Number>
inline void rasterise(const Edges<Number>& edges, const Nearness& near, const PixelBox& box,
                      std::uint32_t number, float* depth, std::uint32_t* seen) {
  const Floats min = splat(near.min), max = splat(near.max);
  const Floats slope = ramp() * splat(static_cast<float>(near.dx));
  const Ints id = splat(static_cast<std::int32_t>(number));
  for (std::int32_t y = box.top; y <= box.bottom; ++y) {
    Number e[3];
    for (int k = 0; k < 3; ++k)
      e[k] = edges.c[k] + edges.dy[k] * static_cast<Number>(y) +
             edges.dx[k] * static_cast<Number>(box.left);
    for (std::int32_t x = box.left; x <= box.right; x += lanes) {
      const Ints covered = inside<Number>(e, edges.dx, slope);
      for (int k = 0; k < 3; ++k)
        e[k] += edges.dx[k] * lanes;
      if (!any(covered))
        continue;
      const std::ptrdiff_t at = std::ptrdiff_t{y} * stride + x;
      const auto start = static_cast<float>(near.c + near.dx * x + near.dy * y);
      const Floats z = smaller(larger(splat(start) + slope, min), max);
      const auto old = load<Floats>(depth + at);
      const auto by = load<Ints>(seen + at);
      Ints wins = covered & (z > old);
      if constexpr (Behind)
        wins |= covered & (z == old) & (id < by);
      store(depth + at, choose(wins, z, old));
      store(seen + at, choose(wins, id, by));
    }
  }
}

/// The same for a box of at most eight columns, by windows that start at multiples of eight: what
/// one triangle has stored there the next one loads without waiting for the cache. `Behind`: some
/// triangles after it in the order may have been drawn.
template <bool Behind>
inline void rasterise_narrow(const Edges<std::int32_t>& edges, const Nearness& near,
                             const PixelBox& box, std::uint32_t number, float* depth,
                             std::uint32_t* seen) {
  const std::int32_t first = box.left & -lanes;
  const Floats min = splat(near.min), max = splat(near.max);
  const Floats step = splat(static_cast<float>(near.dx));
  const Ints id = splat(static_cast<std::int32_t>(number));
  for (std::int32_t y = box.top; y <= box.bottom; ++y) {
    std::int32_t e[3];
    for (int k = 0; k < 3; ++k)
      e[k] = edges.c[k] + edges.dy[k] * y + edges.dx[k] * first;
    const Floats start = splat(static_cast<float>(near.c + near.dx * box.left + near.dy * y));
    for (std::int32_t x = first; x <= box.right; x += lanes) {
      const Ints covered = inside<std::int32_t>(e, edges.dx, step);
      for (int k = 0; k < 3; ++k)
        e[k] += edges.dx[k] * lanes;
      const Floats along = ramp() + splat(static_cast<float>(x - box.left));
      const Floats z = smaller(larger(start + along * step, min), max);
      const std::ptrdiff_t at = std::ptrdiff_t{y} * stride + x;
      const auto old = load<Floats>(depth + at);
      const auto by = load<Ints>(seen + at); // `nothing` is -1 and before all
      Ints wins = covered & (z > old);
      if constexpr (Behind)
        wins |= covered & (z == old) & (id < by);
      store(depth + at, choose(wins, z, old));
      store(seen + at, choose(wins, id, by));
    }
  }
}

/// Whether all that a triangle with this greatest nearness could cover has something nearer.
inline bool hidden(const PixelBox& box, float max, const float* depth) {
  const std::int32_t first = box.left & -lanes;
  const Ints lane{0, 1, 2, 3, 4, 5, 6, 7};
  Ints shows = splat(0);
  for (std::int32_t x = first; x <= box.right; x += lanes) {
    const Ints within = (lane >= box.left - x) & (lane <= box.right - x);
    for (std::int32_t y = box.top; y <= box.bottom; ++y)
      shows |= within & (load<Floats>(depth + std::ptrdiff_t{y} * stride + x) <= splat(max));
  }
  return !any(shows);
}

inline std::int32_t min_of(const std::int32_t (&a)[3]) {
  const std::int32_t m = a[0] < a[1] ? a[0] : a[1];
  return m < a[2] ? m : a[2];
}
inline std::int32_t max_of(const std::int32_t (&a)[3]) {
  const std::int32_t m = a[0] > a[1] ? a[0] : a[1];
  return m > a[2] ? m : a[2];
}

template <bool Behind, class Number>
inline void draw(const Edges<Number>& edges, const Nearness& near, const PixelBox& box,
                 std::uint32_t number, float* depth, std::uint32_t* seen) {
  if constexpr (sizeof(Number) == sizeof(std::int32_t))
    if (box.right - box.left < lanes) {
      rasterise_narrow<Behind>(edges, near, box, number, depth, seen);
      return;
    }
  rasterise<Behind>(edges, near, box, number, depth, seen);
}

template <bool Behind, class Number>
inline void rasterise_samples(const std::int32_t (&x)[3], const std::int32_t (&y)[3],
                              const float (&z)[3], double area, const PixelBox& box, int samples,
                              std::uint32_t number, float* depth, std::uint32_t* seen) {
  Edges<Number> edges;
  Nearness near{0, 0, 0, z[0], z[0]};
  constexpr std::int32_t pixel = 1 << raster_subpixel_bits, half = pixel / 2;
  Number ex[3], ey[3];
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    ex[k] = static_cast<Number>(x[b]) - static_cast<Number>(x[a]);
    ey[k] = static_cast<Number>(y[b]) - static_cast<Number>(y[a]);
    // ex (y - a.y) - ey (x - a.x) at the centres of pixels
    edges.c[k] =
        ex[k] * (half - static_cast<Number>(y[a])) - ey[k] * (half - static_cast<Number>(x[a]));
    edges.dx[k] = -ey[k] * pixel;
    edges.dy[k] = ex[k] * pixel;
    const double weight = static_cast<double>(z[k]) / area;
    near.c += static_cast<double>(edges.c[k]) * weight;
    near.dx += static_cast<double>(edges.dx[k]) * weight;
    near.dy += static_cast<double>(edges.dy[k]) * weight;
    near.min = z[k] < near.min ? z[k] : near.min;
    near.max = z[k] > near.max ? z[k] : near.max;
    // A point on an edge belongs to the triangle if the edge is a top or a left one.
    if (!(ey[k] < 0 || (ey[k] == 0 && ex[k] > 0)))
      edges.c[k] -= 1;
  }
  if (samples == 1) {
    draw<Behind>(edges, near, box, number, depth, seen);
    return;
  }
  for (int s = 0; s < 4; ++s) {
    Edges<Number> moved = edges;
    Nearness there = near;
    for (int k = 0; k < 3; ++k)
      moved.c[k] +=
          ex[k] * static_cast<Number>(sample_y[s]) - ey[k] * static_cast<Number>(sample_x[s]);
    there.c += (near.dx * sample_x[s] + near.dy * sample_y[s]) / pixel;
    draw<Behind>(moved, there, box, number, depth + std::ptrdiff_t{s} * plane,
                 seen + std::ptrdiff_t{s} * plane);
  }
}

/// Of what is as near as another the first in the order is seen. `Behind`: other triangles after it
/// in the order were drawn before it.
template <bool Behind>
inline void rasterise_triangle(const KernelScreen& screen, const KernelTile& tile, std::uint32_t n,
                               float* depth, std::uint32_t* seen) {
  const std::uint32_t* const corner = n < screen.count
                                          ? screen.triangles + std::size_t{3} * n
                                          : screen.pieces + std::size_t{3} * (n - screen.count);
  std::int32_t x[3], y[3];
  float z[3];
  constexpr std::int32_t pixel = 1 << raster_subpixel_bits;
  for (int k = 0; k < 3; ++k) {
    x[k] = screen.x[corner[k]] - tile.left * pixel;
    y[k] = screen.y[corner[k]] - tile.top * pixel;
    z[k] = screen.nearness[corner[k]];
  }
  const std::int32_t low_x = min_of(x), high_x = max_of(x), low_y = min_of(y), high_y = max_of(y);
  // The centre of pixel p is at (p + 1/2) subpixels; samples are less than half a pixel away.
  const std::int32_t early = tile.samples == 1 ? pixel / 2 - 1 : 0;
  const std::int32_t late = tile.samples == 1 ? pixel / 2 : 0;
  PixelBox box{(low_x + early) >> raster_subpixel_bits, (high_x - late) >> raster_subpixel_bits,
               (low_y + early) >> raster_subpixel_bits, (high_y - late) >> raster_subpixel_bits};
  box.left = box.left > 0 ? box.left : 0;
  box.top = box.top > 0 ? box.top : 0;
  box.right = box.right < tile.width ? box.right : tile.width - 1;
  box.bottom = box.bottom < tile.height ? box.bottom : tile.height - 1;
  if (box.left > box.right || box.top > box.bottom)
    return;
  if (Behind && box.right - box.left < lanes) {
    const float max = larger(larger(z[0], z[1]), z[2]);
    bool all = true;
    for (int s = 0; s < tile.samples; ++s)
      all = all && hidden(box, max, depth + std::ptrdiff_t{s} * plane);
    if (all)
      return;
  }
  std::int64_t area =
      std::int64_t{x[1] - x[0]} * (y[2] - y[0]) - std::int64_t{y[1] - y[0]} * (x[2] - x[0]);
  if (area < 0) {
    const std::int32_t sx = x[1], sy = y[1];
    const float sz = z[1];
    x[1] = x[2], y[1] = y[2], z[1] = z[2];
    x[2] = sx, y[2] = sy, z[2] = sz;
    area = -area;
  }
  // Within 96 pixels edge functions fit in 31 bits, over all lanes; else doubles hold them exactly.
  constexpr std::int32_t small = 96 * pixel;
  const auto twice = static_cast<double>(area);
  if (high_x - low_x <= small && high_y - low_y <= small)
    rasterise_samples<Behind, std::int32_t>(x, y, z, twice, box, tile.samples, n, depth, seen);
  else
    rasterise_samples<Behind, double>(x, y, z, twice, box, tile.samples, n, depth, seen);
}

// --- What it looks like
// -----------------------------------------------------------------------------------

/// Some pixels of a row, each with the triangle seen there.
struct Slots {
  alignas(32) float s[slot_count], t[slot_count];   ///< texture coordinates
  alignas(32) float s2[slot_count], t2[slot_count]; ///< shifted towards the light
  alignas(32) float ms[slot_count], mt[slot_count]; ///< of sphere maps
  alignas(32) float shade[slot_count];
  alignas(32) float place[3][slot_count], normal[3][slot_count], tangent[3][slot_count];
  alignas(32) float side[slot_count];
  alignas(32) float change[4][slot_count]; ///< ds/dx, dt/dx, ds/dy, dt/dy
  // Of textures on the shape at rest.
  alignas(32) float rest[3][slot_count], rest_normal[3][slot_count], turn[6][slot_count];
  alignas(32) float rest_change[6][slot_count]; ///< d place/dx, d place/dy
  std::uint8_t pixel[slot_count];
  float weight[slot_count];
  std::size_t count = 0;
};

/// A triangle's corners in pixels times w, so that nothing need be clipped.
struct Corners {
  std::uint32_t shown = nothing;
  double x[3], y[3], w[3];
  const float* vertex[3];
  const float* frame[3];

  void take(const KernelScene& scene, std::uint32_t n) {
    if (n == shown)
      return;
    shown = n;
    for (int k = 0; k < 3; ++k) {
      const std::size_t v = scene.triangles[std::size_t{3} * n + static_cast<std::size_t>(k)];
      vertex[k] = scene.vertices + 10 * v;
      frame[k] = scene.frames == nullptr ? nullptr : scene.frames + 7 * v;
      const double px = static_cast<double>(vertex[k][0]), py = static_cast<double>(vertex[k][1]),
                   pz = static_cast<double>(vertex[k][2]);
      const auto row = [&](const double(&m)[4]) {
        return m[0] * px + m[1] * py + m[2] * pz + m[3];
      };
      x[k] = row(scene.clip[0]);
      y[k] = row(scene.clip[1]);
      w[k] = row(scene.clip[2]);
    }
  }
};

inline double floor_of(double x) {
  if (!(x > -1e9 && x < 1e9))
    return 0;
  const auto cut = static_cast<double>(static_cast<std::int64_t>(x));
  return cut > x ? cut - 1 : cut;
}

/// Attributes along a row. With weights e_k that are linear on the picture an attribute is
/// a(i) = sum e_k a_k / sum e_k = a(0) + i g / S(i), S(i) = sum e_k at i over that at 0: found in
/// double at the first pixel, so that single precision does for the small rest.
struct Row {
  double weight[3], step_x[3], step_y[3]; ///< over the sum at 0
  double grow_x, grow_y;
  Floats one_over; ///< 1 / S
  Floats along;    ///< i / S

  Row(const Corners& c, std::int32_t px, std::int32_t py) {
    double x[3], y[3];
    for (int k = 0; k < 3; ++k) {
      x[k] = c.x[k] - (px + 0.5) * c.w[k];
      y[k] = c.y[k] - (py + 0.5) * c.w[k];
    }
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      weight[k] = x[i] * y[j] - x[j] * y[i];
      step_x[k] = c.w[j] * y[i] - c.w[i] * y[j];
      step_y[k] = x[j] * c.w[i] - x[i] * c.w[j];
    }
    const double sum = weight[0] + weight[1] + weight[2];
    const double inverse = sum != 0 ? 1 / sum : 0;
    for (int k = 0; k < 3; ++k) {
      weight[k] *= inverse;
      step_x[k] *= inverse;
      step_y[k] *= inverse;
    }
    grow_x = step_x[0] + step_x[1] + step_x[2];
    grow_y = step_y[0] + step_y[1] + step_y[2];
    one_over = splat(1.0F) / (splat(1.0F) + ramp() * splat(static_cast<float>(grow_x)));
    along = ramp() * one_over;
  }
  double start(const double (&a)[3]) const {
    return weight[0] * a[0] + weight[1] * a[1] + weight[2] * a[2];
  }
  double slope_x(const double (&a)[3], double at) const {
    return step_x[0] * a[0] + step_x[1] * a[1] + step_x[2] * a[2] - at * grow_x;
  }
  double slope_y(const double (&a)[3], double at) const {
    return step_y[0] * a[0] + step_y[1] * a[1] + step_y[2] * a[2] - at * grow_y;
  }
};

// In raster_kernel_rest_lanes_internal.h.
struct RestColors;
inline void interpolate_rest(const KernelScene& scene, const Corners& c, const Row& row,
                             Slots& slots, std::size_t at);
inline void shade_rest(const KernelScene& scene, const Slots& slots, std::size_t at,
                       RestColors& colors);

inline bool rest_has(const KernelScene& scene, KernelRestLayer KernelRest::*layer) {
  return (scene.rest->*layer).image != nullptr || (scene.rest->*layer).solid != nullptr;
}

/// What textures on the shape at rest say about eight pixels.
struct RestColors {
  Floats base[3], detail[3], reflection[3];
  Floats relief;
};

// Below, `Rest` is whether there are such textures: without, not even a test is left.

/// Fills eight slots for the pixels from (px, py) to the right; the caller keeps some.
template <bool Rest>
inline void interpolate(const KernelScene& scene, const Corners& c, std::int32_t px,
                        std::int32_t py, Slots& slots, std::size_t at) {
  const Row row(c, px, py);
  const auto attribute = [&](const float* const(&corner)[3], int n, double less, float* to) {
    const double a[3] = {static_cast<double>(corner[0][n]), static_cast<double>(corner[1][n]),
                         static_cast<double>(corner[2][n])};
    const double first = row.start(a);
    store(to + at, splat(static_cast<float>(first - less)) +
                       row.along * splat(static_cast<float>(row.slope_x(a, first))));
  };
  double whole[2] = {0, 0}; // of s and t, which no texture sees
  for (int axis = 0; axis < 2; ++axis) {
    const double a[3] = {static_cast<double>(c.vertex[0][3 + axis]),
                         static_cast<double>(c.vertex[1][3 + axis]),
                         static_cast<double>(c.vertex[2][3 + axis])};
    const double first = row.start(a);
    if (!scene.clamped)
      whole[axis] = 2 * floor_of(first / 2);
    const Floats slope = splat(static_cast<float>(row.slope_x(a, first)));
    const Floats change = row.along * slope;
    store((axis == 0 ? slots.s : slots.t) + at,
          splat(static_cast<float>(first - whole[axis])) + change);
    if (scene.derivatives) {
      store(slots.change[axis] + at, slope * row.one_over * row.one_over);
      store(slots.change[2 + axis] + at, (splat(static_cast<float>(row.slope_y(a, first))) -
                                          change * splat(static_cast<float>(row.grow_y))) *
                                             row.one_over);
    }
  }
  attribute(c.vertex, 9, 0, slots.shade);
  if constexpr (Rest)
    interpolate_rest(scene, c, row, slots, at);
  if (scene.frames == nullptr) {
    if (scene.textures.structure != nullptr) {
      attribute(c.vertex, 5, whole[0], slots.s2);
      attribute(c.vertex, 6, whole[1], slots.t2);
    }
    if (scene.sphere) {
      attribute(c.vertex, 7, 0, slots.ms);
      attribute(c.vertex, 8, 0, slots.mt);
    }
    return;
  }
  for (int axis = 0; axis < 3; ++axis) {
    attribute(c.vertex, axis, 0, slots.place[axis]);
    attribute(c.frame, axis, 0, slots.normal[axis]);
    if (scene.textures.structure != nullptr)
      attribute(c.frame, 3 + axis, 0, slots.tangent[axis]);
  }
  store(slots.side + at, splat(c.frame[0][6]));
}

struct Vector {
  Floats x, y, z;
};
inline Floats dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vector scaled(const Vector& a, Floats s) {
  return {a.x * s, a.y * s, a.z * s};
}
inline Vector unit(const Vector& a) {
  return scaled(a, inverse_or_zero(root(dot(a, a))));
}
inline Vector minus(const Vector& a, const Vector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector vector_at(const float (&values)[3][slot_count], std::size_t at) {
  return {load<Floats>(values[0] + at), load<Floats>(values[1] + at), load<Floats>(values[2] + at)};
}
inline Vector splat(const float (&v)[3]) {
  return {splat(v[0]), splat(v[1]), splat(v[2])};
}

/// The light's direction in the surface's own frame, per pixel (report eq. 3.2), and the place in
/// sphere maps (OpenGL's GL_SPHERE_MAP).
inline void look_around(const KernelScene& scene, Slots& slots, std::size_t at) {
  const Vector place = vector_at(slots.place, at);
  const Vector normal = unit(vector_at(slots.normal, at));
  if (scene.textures.structure != nullptr) {
    const Vector raw = vector_at(slots.tangent, at);
    const Vector tangent = unit(minus(raw, scaled(normal, dot(normal, raw))));
    const Vector across{normal.y * tangent.z - normal.z * tangent.y,
                        normal.z * tangent.x - normal.x * tangent.z,
                        normal.x * tangent.y - normal.y * tangent.x};
    const Vector light =
        scene.directional ? splat(scene.light) : unit(minus(splat(scene.light), place));
    const Floats side = load<Floats>(slots.side + at);
    store(slots.s2 + at, dot(light, tangent) * splat(scene.offset[0]));
    store(slots.t2 + at, side * dot(light, across) * splat(scene.offset[1]));
  }
  if (scene.sphere) {
    const Vector to = unit(minus(place, splat(scene.eye.at)));
    const Floats twice = dot(normal, to) * splat(2.0F);
    const Vector back = minus(to, scaled(normal, twice));
    const Floats x = dot(back, splat(scene.eye.right)), y = dot(back, splat(scene.eye.up)),
                 z = dot(back, splat(scene.eye.back)) + splat(1.0F);
    const Floats m = splat(0.5F) * inverse_or_zero(root(x * x + y * y + z * z));
    store(slots.ms + at, x * m + splat(0.5F));
    store(slots.mt + at, y * m + splat(0.5F));
  }
}

struct Colors {
  Floats c[3];
};

/// A level of a texture, lane by lane.
struct Level {
  Floats width, height;
  Ints columns, rows, first;
};

inline Level level_at(const KernelTexture& texture, Ints which) {
  Level level{};
  for (int i = 0; i < lanes; ++i) {
    const KernelLevel& l = texture.levels[which[i]];
    level.columns[i] = l.width;
    level.rows[i] = l.height;
    level.first[i] = l.first;
  }
  level.width = to_floats(level.columns);
  level.height = to_floats(level.rows);
  return level;
}
inline Level first_level(const KernelTexture& texture) {
  const KernelLevel& l = texture.levels[0];
  return {splat(static_cast<float>(l.width)), splat(static_cast<float>(l.height)), splat(l.width),
          splat(l.height), splat(l.first)};
}

/// A coordinate in texels, where its texel's centre is a whole number: -1/2 … n - 1/2 where the
/// texture repeats (`whole` is the period), 0 … n - 1 elsewhere.
inline Floats wrapped(Floats x, Floats count, int wrap) {
  x = tame(x);
  if (wrap == 0)
    return (x - floor_of(x)) * count - splat(0.5F);
  if (wrap == 2) {
    x -= splat(2.0F) * floor_of(x * splat(0.5F));
    x = choose(x > splat(1.0F), splat(2.0F) - x, x);
  }
  x = larger(smaller(x, splat(2.0F)), splat(-1.0F)) * count - splat(0.5F);
  return larger(smaller(x, count - splat(1.0F)), splat(0.0F));
}

struct Taps {
  Ints a, b; ///< the two neighbours
  Floats part;
};
inline Taps taps(Floats x, Floats count, Ints n, int wrap) {
  Floats at = wrapped(x, count, wrap);
  if (wrap == 0)
    at = choose(at < splat(0.0F), at + count, at);
  Ints a = to_ints(at);
  a = choose(a > n - 1, n - 1, a); // at may round to count
  a = choose(a < 0, splat(0), a);
  const Floats part = at - to_floats(a);
  Ints b = a + 1;
  b = choose(b < n, b, wrap == 0 ? splat(0) : n - 1);
  return {a, b, part};
}

inline Words fetch(const KernelTexture& texture, Ints at) {
  Words w{};
  for (int i = 0; i < lanes; ++i)
    w[i] = texture.texels[at[i]];
  return w;
}
inline Floats low_half(Words w) {
  return to_floats(as<Ints>(w & 0xffffU));
}
inline Floats high_half(Words w) {
  return to_floats(as<Ints>(w >> 16));
}
inline Floats byte_of(Words w, int n) {
  return to_floats(as<Ints>((w >> (8 * n)) & 0xffU));
}
inline Floats mix(Floats a, Floats b, Floats part) {
  return a + part * (b - a);
}

inline Colors sample_level(const KernelTexture& texture, const Level& level, Floats s, Floats t) {
  Colors result;
  if (texture.nearest) {
    Taps x = taps(s + splat(0.5F) / level.width, level.width, level.columns, texture.wrap);
    Taps y = taps(t + splat(0.5F) / level.height, level.height, level.rows, texture.wrap);
    if (texture.wrap != 0) { // clamped at the last centre, not at its far edge
      x = taps(s, level.width, level.columns, texture.wrap);
      y = taps(t, level.height, level.rows, texture.wrap);
      x.a = choose(x.part < splat(0.5F), x.a, x.b);
      y.a = choose(y.part < splat(0.5F), y.a, y.b);
    }
    const Words w = fetch(texture, level.first + y.a * level.columns + x.a);
    for (int n = 0; n < 3; ++n)
      result.c[n] = texture.gray ? low_half(w) : byte_of(w, n);
  } else {
    const Taps x = taps(s, level.width, level.columns, texture.wrap);
    const Taps y = taps(t, level.height, level.rows, texture.wrap);
    const Ints row0 = level.first + y.a * level.columns, row1 = level.first + y.b * level.columns;
    const Words w00 = fetch(texture, row0 + x.a), w01 = fetch(texture, row1 + x.a);
    if (texture.gray) {
      result.c[0] = mix(mix(low_half(w00), high_half(w00), x.part),
                        mix(low_half(w01), high_half(w01), x.part), y.part);
      result.c[1] = result.c[2] = result.c[0];
    } else {
      const Words w10 = fetch(texture, row0 + x.b), w11 = fetch(texture, row1 + x.b);
      for (int n = 0; n < 3; ++n)
        result.c[n] = mix(mix(byte_of(w00, n), byte_of(w10, n), x.part),
                          mix(byte_of(w01, n), byte_of(w11, n), x.part), y.part);
    }
  }
  const Floats scale = splat(texture.gray ? 1.0F / 65535 : 1.0F / 255);
  for (Floats& c : result.c)
    c *= scale;
  return result;
}

/// Between level k and k + 1 for a pixel that covers 2^k (1 + part) texels; `largest` is their
/// square.
inline Colors sample_levels(const KernelTexture& texture, Floats largest, Floats s, Floats t) {
  if (!any(largest > splat(1.0F)))
    return sample_level(texture, first_level(texture), s, t);
  const Floats texels = larger(smaller(root(largest), splat(1e9F)), splat(1.0F));
  const Ints bits = as<Ints>(texels);
  Ints k = (bits >> 23) - 127;
  Floats part = as<Floats>((bits & 0x7fffff) | (127 << 23)) - splat(1.0F);
  const Ints last = splat(texture.count - 1);
  part = choose(k >= last, splat(0.0F), part);
  k = choose(k > last, last, k);
  const Ints next = choose(k < last, k + 1, last);
  const Colors fine = sample_level(texture, level_at(texture, k), s, t);
  const Colors coarse = sample_level(texture, level_at(texture, next), s, t);
  Colors result;
  for (int n = 0; n < 3; ++n)
    result.c[n] = mix(fine.c[n], coarse.c[n], part);
  return result;
}

/// By the longer direction of the two along x and y.
inline Colors sample(const KernelTexture& texture, const Slots& slots, std::size_t at, Floats s,
                     Floats t) {
  if (texture.count == 1 || texture.sphere)
    return sample_level(texture, first_level(texture), s, t);
  const KernelLevel& l = texture.levels[0];
  Floats largest = splat(0.0F);
  for (std::size_t a = 0; a < 2; ++a) {
    const Floats u = load<Floats>(slots.change[2 * a] + at) * splat(static_cast<float>(l.width));
    const Floats v =
        load<Floats>(slots.change[2 * a + 1] + at) * splat(static_cast<float>(l.height));
    largest = larger(u * u + v * v, largest);
  }
  return sample_levels(texture, largest, s, t);
}

inline Colors sample_layer(const KernelTexture& texture, const Slots& slots, std::size_t at) {
  return texture.sphere
             ? sample(texture, slots, at, load<Floats>(slots.ms + at), load<Floats>(slots.mt + at))
             : sample(texture, slots, at, load<Floats>(slots.s + at), load<Floats>(slots.t + at));
}

inline Floats relief(const KernelScene& scene, const Slots& slots, std::size_t at) {
  const KernelTexture& structure = *scene.textures.structure;
  const Floats s = load<Floats>((structure.sphere ? slots.ms : slots.s) + at);
  const Floats t = load<Floats>((structure.sphere ? slots.mt : slots.t) + at);
  Floats s2 = load<Floats>(slots.s2 + at), t2 = load<Floats>(slots.t2 + at);
  if (scene.frames != nullptr) { // offsets stand there
    s2 += s;
    t2 += t;
  } else if (structure.sphere) {
    s2 += s - load<Floats>(slots.s + at);
    t2 += t - load<Floats>(slots.t + at);
  }
  return splat(0.5F) + splat(0.5F) * (sample(structure, slots, at, s, t).c[0] -
                                      sample(structure, slots, at, s2, t2).c[0]);
}

// In raster_kernel_film_lanes_internal.h.
inline void wet(const KernelScene& scene, const Slots& slots, std::size_t at, Floats twice_relief,
                Colors& color);

/// min(1, 2 r min(1, min(1, base + detail) + reflection)), 0 … 1, and the film upon it.
template <bool Rest>
inline Colors shade(const KernelScene& scene, Slots& slots, std::size_t at) {
  if (scene.frames != nullptr)
    look_around(scene, slots, at);
  const Floats one = splat(1.0F);
  RestColors rest;
  if constexpr (Rest)
    shade_rest(scene, slots, at, rest);
  Colors color;
  for (int n = 0; n < 3; ++n)
    color.c[n] = splat(scene.color[n]) * load<Floats>(slots.shade + at);
  if (scene.textures.base != nullptr) {
    const Colors base = sample_layer(*scene.textures.base, slots, at);
    for (int n = 0; n < 3; ++n)
      color.c[n] *= base.c[n];
  } else if (Rest && rest_has(scene, &KernelRest::base)) {
    for (int n = 0; n < 3; ++n)
      color.c[n] *= rest.base[n];
  }
  const auto add = [&](const KernelTexture* texture, KernelRestLayer KernelRest::*layer,
                       const Floats(&more_at_rest)[3]) {
    if (texture != nullptr) {
      const Colors more = sample_layer(*texture, slots, at);
      for (int n = 0; n < 3; ++n)
        color.c[n] = smaller(color.c[n] + more.c[n], one);
    } else if (Rest && rest_has(scene, layer)) {
      for (int n = 0; n < 3; ++n)
        color.c[n] = smaller(color.c[n] + more_at_rest[n], one);
    }
  };
  add(scene.textures.detail, &KernelRest::detail, rest.detail);
  add(scene.textures.reflection, &KernelRest::reflection, rest.reflection);
  const bool rest_relief = Rest && rest_has(scene, &KernelRest::structure);
  Floats twice_relief = one;
  if (scene.textures.structure != nullptr || rest_relief) {
    twice_relief = splat(2.0F) * (rest_relief ? rest.relief : relief(scene, slots, at));
    for (Floats& c : color.c)
      c = smaller(c * twice_relief, one);
  }
  for (Floats& c : color.c)
    c = larger(c, splat(0.0F));
  if (scene.film != nullptr)
    wet(scene, slots, at, twice_relief, color);
  return color;
}

} // namespace
} // namespace gewebe::raster
