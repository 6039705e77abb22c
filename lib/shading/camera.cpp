#include "shading/camera.h"

#include "base/error.h"
#include "shading/angles.h"

#include <algorithm>
#include <cmath>

namespace gewebe::shading {
namespace {

struct View {
  const char* name;
  Vec3 back; ///< from the target to the eye
  Vec3 up;
};

const std::array<View, 7> views{{{"front", {0, 1, 0}, {0, 0, 1}},
                                 {"back", {0, -1, 0}, {0, 0, 1}},
                                 {"left", {-1, 0, 0}, {0, 0, 1}},
                                 {"right", {1, 0, 0}, {0, 0, 1}},
                                 {"top", {0, 0, 1}, {0, 1, 0}},
                                 {"bottom", {0, 0, -1}, {0, 1, 0}},
                                 {"iso", {1, 1, 1}, {0, 0, 1}}}};

const View& view_of(std::string_view name) {
  for (const View& view : views)
    if (view.name == name)
      return view;
  throw Error("view '" + std::string(name) + "' is unknown");
}

std::array<Vec3, 8> corners(const Box3& box) {
  std::array<Vec3, 8> all;
  for (std::size_t c = 0; c < 8; ++c)
    all[c] = {(c & 1) != 0 ? box.max.x : box.min.x, (c & 2) != 0 ? box.max.y : box.min.y,
              (c & 4) != 0 ? box.max.z : box.min.z};
  return all;
}

void orient(Camera& camera, const Vec3& back, const std::optional<Vec3>& up, const Vec3& usual_up) {
  camera.back = back / norm(back);
  Vec3 right = cross(up.value_or(usual_up), camera.back);
  const bool along = !(norm(right) > 1e-9 * norm(up.value_or(usual_up)));
  if (along && up)
    throw Error("the up vector is along the view, expected another direction");
  if (along)
    right = cross(Vec3{0, 1, 0}, camera.back);
  camera.right = right / norm(right);
  camera.up = cross(camera.back, camera.right);
}

/// Walks around the target: first to the right around `up`, then upwards.
void orbit(Camera& camera, double azimuth, double elevation) {
  const auto turn = [](Vec3& a, Vec3& b, double degrees) { // from a towards b
    const auto [c, s] = cos_sin(degrees);
    const Vec3 rotated = a * c + b * s;
    b = b * c - a * s;
    a = rotated;
  };
  turn(camera.back, camera.right, azimuth);
  turn(camera.back, camera.up, elevation);
}

/// The distance from the target at which the whole box is seen.
double fitting_distance(const Camera& camera, const Box3& box) {
  double distance = 0;
  for (const Vec3& corner : corners(box)) {
    const Vec3 p = corner - camera.target;
    const double side = std::max(std::fabs(dot(p, camera.right)) / camera.tan_x,
                                 std::fabs(dot(p, camera.up)) / camera.tan_y);
    distance = std::max(distance, dot(p, camera.back) + 1.05 * side);
  }
  return distance > 0 ? distance : 1;
}

} // namespace

const std::vector<std::string>& view_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const View& view : views)
      list.emplace_back(view.name);
    return list;
  }();
  return names;
}

Camera make_camera(const CameraOptions& options, const Box3& fit, std::uint32_t width,
                   std::uint32_t height) {
  Camera camera;
  const double t = tangent(options.fov / 2);
  camera.tan_x = width > height ? t * width / height : t;
  camera.tan_y = width > height ? t : t * height / width;

  const Box3 box = fit.empty() ? Box3{{0, 0, 0}, {0, 0, 0}} : fit;
  camera.target = options.target.value_or(box.min * 0.5 + box.max * 0.5);
  const View& view = view_of(options.view);
  const Vec3 back = options.eye ? *options.eye - camera.target : view.back;
  if (!(norm(back) > 0))
    throw Error("eye and target are the same point, expected two");
  orient(camera, back, options.up, options.eye ? Vec3{0, 0, 1} : view.up);
  if (options.azimuth != 0 || options.elevation != 0)
    orbit(camera, options.azimuth, options.elevation);
  const double distance =
      options.eye ? norm(back) : options.distance.value_or(fitting_distance(camera, box));
  camera.eye = camera.target + camera.back * distance;
  if (options.eye && options.azimuth == 0 && options.elevation == 0)
    camera.eye = *options.eye;
  if (!is_finite(camera.eye) || !is_finite(camera.back) || !is_finite(camera.right))
    throw Error("the camera's place is beyond all numbers, expected a smaller object");
  return camera;
}

Vec3 default_light(const Camera& camera) {
  const double distance = norm(camera.eye - camera.target);
  return camera.eye + (camera.up - camera.right) * (0.6 * distance);
}

Projection make_projection(const Camera& camera, const Box3& drawn, const Vec3& origin,
                           double scale) {
  const Vec3 eye = (camera.eye - origin) / scale;
  double nearest = HUGE_VAL, farthest = 0;
  if (!drawn.empty())
    for (const Vec3& corner : corners(drawn)) {
      const double depth = -dot((corner - origin) / scale - eye, camera.back);
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
  if (!(farthest > 0)) // all of it is behind the camera
    nearest = farthest = 1;
  const double far = farthest * 1.001, near = std::max(nearest * 0.999, far * 1e-3);

  Projection projection;
  projection.near = near;
  const auto row = [&](const Vec3& axis, double factor) {
    const Vec3 a = axis * factor;
    return std::array<double, 4>{a.x, a.y, a.z, -dot(a, eye)};
  };
  projection.matrix[0] = row(camera.right, 1 / camera.tan_x);
  projection.matrix[1] = row(camera.up, 1 / camera.tan_y);
  projection.matrix[3] = row(camera.back, -1);
  for (std::size_t c = 0; c < 4; ++c)
    projection.matrix[2][c] = projection.matrix[3][c] * ((far + near) / (far - near));
  projection.matrix[2][3] -= 2 * far * near / (far - near);
  return projection;
}

} // namespace gewebe::shading
