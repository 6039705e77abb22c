#pragma once
// The film of water on a surface, by the formula of wet_film.h. Included like
// raster_kernel_lanes_internal.h.

#include "raster/raster_kernel_rest_lanes_internal.h"

namespace gewebe::raster {
namespace {

inline Floats mirrored_share(Floats reflectance, Floats cosine) {
  const Floats rest = splat(1.0F) - smaller(cosine, splat(1.0F)), square = rest * rest;
  return reflectance + (splat(1.0F) - reflectance) * (square * square * rest);
}

inline void wet(const KernelScene& scene, const Slots& slots, std::size_t at, Floats twice_relief,
                Colors& color) {
  const KernelFilm& film = *scene.film;
  const Floats none = splat(0.0F), one = splat(1.0F);
  const Vector place = vector_at(slots.place, at);
  const Vector eye = unit(minus(splat(scene.eye.at), place));
  const Vector light =
      scene.directional ? splat(scene.light) : unit(minus(splat(scene.light), place));
  Vector normal = unit(vector_at(slots.normal, at));
  normal = scaled(normal, choose(dot(normal, eye) < none, splat(-1.0F), one));
  const Vector along = unit(minus(light, scaled(normal, dot(light, normal))));
  normal = unit(plus(normal, scaled(along, twice_relief - one)));
  const Vector half = unit(plus(eye, light));
  const Floats nv = larger(dot(normal, eye), none), nl = larger(dot(normal, light), none),
               nh = larger(dot(normal, half), none), vh = larger(dot(eye, half), none);
  const Floats a2 = splat(film.alpha2), f0 = splat(film.reflectance);
  const auto smith = [&](Floats x) { return x + root(a2 + (one - a2) * x * x); };
  const Floats spread = nh * nh * (a2 - one) + one;
  Floats light_mirrored =
      a2 * mirrored_share(f0, vh) * nl / (spread * spread * smith(nl) * smith(nv));
  if (film.full_distance > 0) {
    const Vector to = minus(splat(scene.light), place);
    light_mirrored *= smaller(splat(film.full_distance) * inverse_or_zero(root(dot(to, to))), one);
  }
  const Floats share = mirrored_share(f0, nv), amount = splat(film.amount);
  for (int n = 0; n < 3; ++n)
    color.c[n] = smaller(
        color.c[n] + amount * (share * (splat(film.mirrored[n]) - color.c[n]) + light_mirrored),
        one);
}

} // namespace
} // namespace gewebe::raster
