#pragma once
// Where the picture is taken from, and how the world comes to lie on it.

#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::shading {

/// The words of --view: front, back, left, right, top, bottom, iso.
const std::vector<std::string>& view_names();

struct CameraOptions {
  std::string view = "front"; ///< where `eye` is not given
  std::optional<Vec3> eye;    ///< mm
  double azimuth = 0;   ///< degrees by which `view` or `eye` is turned around up, to the right
  double elevation = 0; ///< degrees by which it is raised, -90 … 90
  std::optional<Vec3> target;     ///< mm, else the centre of the box to fit
  std::optional<Vec3> up;         ///< else +z (+y where the view is along z)
  std::optional<double> distance; ///< of eye and target in mm, else so that the box fits
  double fov = 30; ///< full angle in degrees across the shorter side of the picture, 1 … 170
};

/// Looks along -back. `right`, `up`, `back` are orthonormal and right-handed.
struct Camera {
  Vec3 eye, target;
  Vec3 right, up, back;
  double tan_x = 1, tan_y = 1; ///< half the picture's width and height at distance 1
};

/// The camera for a picture of width × height that shows the box `fit` with a margin of 5 %.
/// World axes are RAS (x to the patient's right, y to the front, z to the head): front looks along
/// -y, left along +x, top along -z with the front up, iso along (-1, -1, -1).
/// \throw Error if eye and target coincide, `up` is along the view, or numbers overflow
Camera make_camera(const CameraOptions& options, const Box3& fit, std::uint32_t width,
                   std::uint32_t height);

/// A place for a light: as far from the target as the eye, roughly, over the left shoulder.
Vec3 default_light(const Camera& camera);

/// clip = matrix · (q, 1) for q = (p - origin) / scale, as OpenGL has it: visible where
/// |x|, |y|, |z| <= w; w is the depth along the view over `scale`. Row by row.
struct Projection {
  std::array<std::array<double, 4>, 4> matrix{};
  double near = 0.5; ///< smallest visible w
};

/// Near and far plane enclose `drawn` as closely as 1 : 1000 allows.
Projection make_projection(const Camera& camera, const Box3& drawn, const Vec3& origin,
                           double scale);

} // namespace gewebe::shading
