#pragma once
// What an endoscope sees: the light at its tip, the lens before it, the round field.

#include "geometry/vec3.h"
#include "shading/camera.h"
#include "texture/image.h"

namespace gewebe::shading {

/// Of the light above the lens, mm.
inline constexpr double endoscope_light_height = 3;
/// Default field of view of an endoscope, degrees.
inline constexpr double endoscope_fov = 70;

/// Where the fibre's end stands: above the lens.
Vec3 endoscope_light(const Camera& camera);

/// What a distance from the light leaves of it: min(1, full / distance). Light falls off by the
/// square of the distance; values in files go as its square root, about. The exposure is such that
/// what is nearer than `full` is no brighter. 1 where `full` is 0.
inline double light_left(double full, double distance) {
  return full > 0 && distance > full ? full / distance : 1;
}

/// Multiplies each pixel, at the angle a from the axis and at r = its distance from the picture's
/// middle over half the shorter side, by
///   cos² a · (1 - (1 - rim) s² (3 - 2 s)) · stop,  s = clamp((r - 0.35) / 0.65, 0, 1), rim = 0.5:
/// the lens's fall-off (cos⁴ of the light), the cone of the light, which is 0.5 of its middle at
/// the rim, and the field stop, 1 for r < 1 and 0 beyond it, mixed within one pixel.
/// \pre three channels
void look_through_endoscope(texture::Image& image, const Camera& camera);

} // namespace gewebe::shading
