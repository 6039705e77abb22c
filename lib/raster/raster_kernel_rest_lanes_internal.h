#pragma once
// Textures on the shape at rest, over eight lanes: images by three projections (rest.h) and solid
// textures (solid_texture.h). For the units that include raster_kernel_lanes_internal.h.

#include "raster/raster_kernel_lanes_internal.h"

namespace gewebe::raster {
namespace {

// --- Attributes
// -------------------------------------------------------------------------------------------

inline void interpolate_rest(const KernelScene& scene, const Corners& c, const Row& row,
                             Slots& slots, std::size_t at) {
  const KernelRest& rest = *scene.rest;
  const std::uint32_t* const corner = scene.triangles + std::size_t{3} * c.shown;
  const auto attribute = [&](const float* from, std::size_t width, std::size_t n, float* to) {
    double a[3];
    for (int k = 0; k < 3; ++k)
      a[k] = static_cast<double>(from[width * corner[k] + n]);
    const double first = row.start(a);
    const Floats slope = splat(static_cast<float>(row.slope_x(a, first)));
    const Floats change = row.along * slope;
    store(to + at, splat(static_cast<float>(first)) + change);
    if (from != rest.vertices || n >= 3 || !rest.derivatives)
      return;
    store(slots.rest_change[n] + at, slope * row.one_over * row.one_over);
    store(slots.rest_change[3 + n] + at, (splat(static_cast<float>(row.slope_y(a, first))) -
                                          change * splat(static_cast<float>(row.grow_y))) *
                                             row.one_over);
  };
  for (std::size_t n = 0; n < 3; ++n)
    attribute(rest.vertices, 6, n, slots.rest[n]);
  for (std::size_t n = 0; rest.normals && n < 3; ++n)
    attribute(rest.vertices, 6, 3 + n, slots.rest_normal[n]);
  if (!rest_has(scene, &KernelRest::structure))
    return;
  for (std::size_t n = 0; rest.turns != nullptr && n < 6; ++n)
    attribute(rest.turns, 6, n, slots.turn[n]);
  for (std::size_t n = 0; n < 3; ++n)
    attribute(scene.vertices, 10, n, slots.place[n]);
}

inline Vector plus(const Vector& a, const Vector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector crossed(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Floats magnitude(Floats x) {
  return as<Floats>(as<Ints>(x) & 0x7fffffff);
}
inline Floats part_of(Floats x) { // 0 … 1
  return larger(smaller(x, splat(1.0F)), splat(0.0F));
}

/// The unit vector to the light, rotated to the shape at rest.
inline Vector light_at_rest(const KernelScene& scene, const Slots& slots, std::size_t at) {
  Vector light = splat(scene.light);
  if (!scene.directional)
    light = unit(minus(light, vector_at(slots.place, at)));
  if (scene.rest->turns == nullptr)
    return light;
  const auto turn = [&](std::size_t n) {
    return Vector{load<Floats>(slots.turn[n] + at), load<Floats>(slots.turn[n + 1] + at),
                  load<Floats>(slots.turn[n + 2] + at)};
  };
  const Vector x = unit(turn(0)), raw = turn(3);
  const Vector y = unit(minus(raw, scaled(x, dot(x, raw))));
  return {dot(light, x), dot(light, y), dot(light, crossed(x, y))};
}

// --- Solid textures
// -------------------------------------------------------------------------------------------

inline Floats either(Ints mask, Floats yes, Floats no) {
  return mask ? yes : no;
}

inline Words scrambled(Words h) {
  h ^= h >> 16;
  h *= 0x7feb352dU;
  h ^= h >> 15;
  h *= 0x846ca68bU;
  return h ^ h >> 16;
}

/// gradient · d: no branch, since each gradient has two parts that are ±1.
inline Floats along_gradient(Words h, Floats x, Floats y, Floats z) {
  constexpr std::int32_t sixth = 715827882;
  const Ints word = as<Ints>(h);
  const Floats first = either(word < -sixth, y, x);
  const Floats second = either(word > sixth, y, z);
  return as<Floats>(as<Words>(first) ^ h << 31) + as<Floats>(as<Words>(second) ^ (h & 2U) << 30);
}

inline Floats fade(Floats t) {
  return t * t * t * (t * (t * splat(6.0F) - splat(15.0F)) + splat(10.0F));
}

inline Floats gradient_noise(const texture::SolidPlan& plan, const Vector& y, int k) {
  const Floats power = splat(static_cast<float>(1 << k));
  const Floats x[3] = {tame(y.x * power + splat(plan.shift[k][0])),
                       tame(y.y * power + splat(plan.shift[k][1])),
                       tame(y.z * power + splat(plan.shift[k][2]))};
  constexpr std::uint32_t factor[3] = {0x8da6b343U, 0xd8163841U, 0xcb1ab31fU};
  Words low[3], high[3];
  Floats d[3], u[3];
  for (int a = 0; a < 3; ++a) {
    const Floats cell = floor_of(x[a]);
    d[a] = x[a] - cell;
    u[a] = fade(d[a]);
    low[a] = (as<Words>(to_ints(cell)) + (plan.whole[a] << k)) * factor[a];
    high[a] = low[a] + factor[a];
  }
  low[2] ^= plan.seed[k];
  high[2] ^= plan.seed[k];
  const Floats one = splat(1.0F);
  const auto edge = [&](Words hyz, Floats dy, Floats dz) { // along x
    return mix(along_gradient(scrambled(low[0] ^ hyz), d[0], dy, dz),
               along_gradient(scrambled(high[0] ^ hyz), d[0] - one, dy, dz), u[0]);
  };
  const auto face = [&](Words hz, Floats dz) {
    return mix(edge(low[1] ^ hz, d[1], dz), edge(high[1] ^ hz, d[1] - one, dz), u[1]);
  };
  return mix(face(low[2], d[2]), face(high[2], d[2] - one), u[2]);
}

/// a_k for a footprint in cells of octave 0.
inline Floats share_of_octave(const texture::SolidPlan& plan, Floats footprint, int k) {
  return plan.filtered ? part_of(splat(1.5F) - splat(static_cast<float>(2 << k)) * footprint)
                       : splat(1.0F);
}

inline Floats noise_value(const texture::SolidPlan& plan, const Vector& y, Floats footprint) {
  Floats sum = splat(0.5F);
  for (int k = 0; k < plan.octaves; ++k) {
    const Floats share = share_of_octave(plan, footprint, k);
    if (!any(share > splat(0.0F)))
      break;
    sum += share * splat(plan.gain[k]) * gradient_noise(plan, y, k);
  }
  return part_of(sum);
}

inline Floats veins_value(const texture::SolidPlan& plan, const Vector& y, Floats footprint) {
  const Floats none = splat(0.0F), one = splat(1.0F), width = splat(plan.width);
  Floats clear = one, reach = one;
  Floats share = share_of_octave(plan, footprint, 0);
  Floats next = any(share > none) ? gradient_noise(plan, y, 0) : none;
  for (int k = 0; k < plan.octaves; ++k) {
    const Floats faded = splat(plan.faded[k]);
    if (!any(share > none)) {
      clear *= one - faded;
      continue;
    }
    const Floats finer = share_of_octave(plan, footprint, k + 1);
    Floats m = next;
    if (any(finer > none)) {
      next = gradient_noise(plan, y, k + 1);
      m += splat(plan.roughness) * finer * next;
    }
    const Floats cells = splat(static_cast<float>(1 << k)) * footprint;
    const Floats square = width * width + (plan.filtered ? cells * cells : none);
    const Floats bump = larger(one - m * m / square, none);
    const Floats line = bump * bump * (width / root(square));
    clear *= one - (share * reach * line + (one - share) * faded);
    reach *= larger(one - m * m * splat(1 / (texture::vein_reach * texture::vein_reach)), none);
    share = finer;
  }
  return one - clear;
}

/// f at a place, for a footprint in the place's unit.
inline void solid_value(const texture::SolidPlan& plan, const Vector& place,
                        const Floats& footprint, Floats& value) {
  const auto row = [&](int a) {
    return splat(plan.rows[a][0]) * place.x + splat(plan.rows[a][1]) * place.y +
           splat(plan.rows[a][2]) * place.z + splat(plan.part[a]);
  };
  const Vector y{row(0), row(1), row(2)};
  const Floats cells = larger(smaller(footprint * splat(plan.cells), splat(1e9F)), splat(0.0F));
  value = plan.kind == texture::SolidKind::noise ? noise_value(plan, y, cells)
                                                 : veins_value(plan, y, cells);
}

inline void solid_colors(const texture::SolidPlan* plan, const Vector& place, Floats footprint,
                         Floats (&colors)[3]) {
  if (plan == nullptr)
    return;
  Floats f;
  solid_value(*plan, place, footprint, f);
  for (int n = 0; n < 3; ++n)
    colors[n] = splat(plan->ground[n]) + f * splat(plan->span[n]);
}

// --- Three projections
// -------------------------------------------------------------------------------------------

/// |n_a| / max |n_b| to a power, less what need not be drawn.
inline Floats weight_of(Floats ratio, int sharpness) {
  Floats weight = splat(1.0F);
  for (int rest = sharpness; rest > 0; rest >>= 1) {
    if ((rest & 1) != 0)
      weight *= ratio;
    ratio *= ratio;
  }
  return larger(weight - splat(1.0F / 256), splat(0.0F));
}

/// One projection: coordinates, and the squares of what they change by along x and y.
struct Projected {
  Floats s, t, ds[2], dt[2];
};

inline Colors sample_projected(const KernelTexture& texture, const Projected& p, Floats s,
                               Floats t) {
  if (texture.count == 1)
    return sample_level(texture, first_level(texture), s, t);
  const Floats width = splat(static_cast<float>(texture.levels[0].width)),
               height = splat(static_cast<float>(texture.levels[0].height));
  const auto square = [&](int a) {
    const Floats u = p.ds[a] * width, v = p.dt[a] * height;
    return u * u + v * v;
  };
  return sample_levels(texture, larger(square(0), square(1)), s, t);
}

inline void project_images(const KernelScene& scene, const Slots& slots, std::size_t at,
                           const Vector& place, const Vector& normal, const Vector& light,
                           RestColors& colors) {
  const KernelRest& rest = *scene.rest;
  const Floats none = splat(0.0F), n[3] = {normal.x, normal.y, normal.z};
  const Floats largest = larger(larger(magnitude(n[0]), magnitude(n[1])), magnitude(n[2]));
  Floats weight[3];
  for (int a = 0; a < 3; ++a)
    weight[a] = weight_of(magnitude(n[a]) * inverse_or_zero(largest), rest.sharpness);
  weight[2] = largest > none ? weight[2] : splat(1.0F);
  const Floats over = splat(1.0F) / (weight[0] + weight[1] + weight[2]);
  const Floats scale = splat(rest.scale);
  const Floats q[3] = {place.x * scale + splat(rest.part[0]), place.y * scale + splat(rest.part[1]),
                       place.z * scale + splat(rest.part[2])};
  const auto clear = [&](const KernelTexture* image, Floats(&sum)[3]) {
    for (int c = 0; image != nullptr && c < 3; ++c)
      sum[c] = none;
  };
  clear(rest.base.image, colors.base);
  clear(rest.detail.image, colors.detail);
  clear(rest.reflection.image, colors.reflection);
  if (rest.structure.image != nullptr)
    colors.relief = none;
  for (int a = 0; a < 3; ++a) {
    if (!any(weight[a] > none))
      continue;
    const Floats w = weight[a] * over;
    const std::size_t across = a == 0 ? 1 : 0, up = a == 2 ? 1 : 2;
    // Which way s runs, so that the image is not mirrored.
    const Floats sign =
        either(n[a] < none, splat(a == 1 ? 1.0F : -1.0F), splat(a == 1 ? -1.0F : 1.0F));
    Projected p{sign * q[across], q[up], {none, none}, {none, none}};
    for (std::size_t d = 0; rest.derivatives && d < 2; ++d) {
      p.ds[d] = load<Floats>(slots.rest_change[3 * d + across] + at) * scale;
      p.dt[d] = load<Floats>(slots.rest_change[3 * d + up] + at) * scale;
    }
    const auto add = [&](const KernelTexture* image, Floats(&sum)[3]) {
      if (image == nullptr)
        return;
      const Colors more = sample_projected(*image, p, p.s, p.t);
      for (int c = 0; c < 3; ++c)
        sum[c] += w * more.c[c];
    };
    add(rest.base.image, colors.base);
    add(rest.detail.image, colors.detail);
    add(rest.reflection.image, colors.reflection);
    if (rest.structure.image == nullptr)
      continue;
    const Vector upward{none, splat(a == 2 ? 1.0F : 0.0F), splat(a == 2 ? 0.0F : 1.0F)};
    const Vector tangent = unit(crossed(upward, normal));
    const Floats ds = dot(light, tangent) * splat(scene.offset[0]);
    const Floats dt = dot(light, crossed(normal, tangent)) * splat(scene.offset[1]);
    const KernelTexture& f = *rest.structure.image;
    colors.relief +=
        w * (splat(0.5F) + splat(0.5F) * (sample_projected(f, p, p.s, p.t).c[0] -
                                          sample_projected(f, p, p.s + ds, p.t + dt).c[0]));
  }
}

inline void shade_rest(const KernelScene& scene, const Slots& slots, std::size_t at,
                       RestColors& colors) {
  const KernelRest& rest = *scene.rest;
  const Vector place = vector_at(slots.rest, at);
  Vector normal{}, light{};
  if (rest.normals)
    normal = unit(vector_at(slots.rest_normal, at));
  if (rest_has(scene, &KernelRest::structure))
    light = light_at_rest(scene, slots, at);
  if (rest.base.image != nullptr || rest.detail.image != nullptr ||
      rest.reflection.image != nullptr || rest.structure.image != nullptr)
    project_images(scene, slots, at, place, normal, light, colors);
  Floats footprint = splat(0.0F);
  if (rest.derivatives) {
    const auto change = [&](std::size_t d) {
      const Vector v{load<Floats>(slots.rest_change[3 * d] + at),
                     load<Floats>(slots.rest_change[3 * d + 1] + at),
                     load<Floats>(slots.rest_change[3 * d + 2] + at)};
      return dot(v, v);
    };
    footprint = root(larger(change(0), change(1)));
  }
  solid_colors(rest.base.solid, place, footprint, colors.base);
  solid_colors(rest.detail.solid, place, footprint, colors.detail);
  if (rest.structure.solid == nullptr)
    return;
  const Vector flat = minus(light, scaled(normal, dot(normal, light)));
  Floats here, there;
  solid_value(*rest.structure.solid, place, footprint, here);
  solid_value(*rest.structure.solid, plus(place, scaled(flat, splat(rest.shift))), footprint,
              there);
  colors.relief = splat(0.5F) + splat(0.5F) * (here - there);
}

} // namespace
} // namespace gewebe::raster
