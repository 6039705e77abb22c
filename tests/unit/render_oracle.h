#pragma once
// The formula of the report, pixel by pixel, with one ray for each: slow, in double, and with
// nothing of lib/render but the plain data that it is asked about.

#include "base/mesh.h"
#include "render/camera.h"
#include "render/image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

namespace gewebe::test {

struct OracleScene {
  TriangleMesh mesh;                    ///< with texture coordinates
  std::optional<Image> base, structure; ///< the structure is gray
  Vec3 color{1, 1, 1}, light;
  double offset = 0, shade = 0;
  bool clamp_early = false; ///< what 8-bit blending does: a negative control
};

struct OraclePixel {
  bool hit = false;
  bool interior = false; ///< the picture is continuous here
  std::array<double, 3> value{};
};

class Oracle {
public:
  Oracle(const OracleScene& scene, const Camera& camera, std::uint32_t width, std::uint32_t height)
      : scene_(scene), camera_(camera), width_(width), height_(height) {
    find_frames();
    bound();
  }

  OraclePixel pixel(double x, double y) const {
    OraclePixel result;
    Sample middle;
    if (!sample(x, y, middle))
      return result;
    result.hit = result.interior = true;
    result.value = middle.value;
    // Continuous: around the pixel's middle the ray hits the same depth and finds the same colour.
    constexpr double step = 1.0 / 64;
    for (const auto& [dx, dy] : {std::pair{step, 0.0}, {-step, 0.0}, {0.0, step}, {0.0, -step}}) {
      Sample near;
      if (!sample(x + dx, y + dy, near) ||
          !(std::fabs(near.depth - middle.depth) < 0.01 * middle.depth)) {
        result.interior = false;
        break;
      }
      for (std::size_t c = 0; c < 3; ++c)
        if (!(std::fabs(near.value[c] - middle.value[c]) < 0.1))
          result.interior = false;
    }
    return result;
  }

private:
  struct Sample {
    double depth = HUGE_VAL;
    std::array<double, 3> value{};
  };
  struct Frame {
    Vec3 tangent_sum;
    double ds = 0, dt = 0, shade = 1;
  };
  using Key = std::tuple<std::uint32_t, float, float, bool>;

  const Vec3& corner(std::size_t t, std::size_t c) const {
    return scene_.mesh.points[scene_.mesh.triangles[t][c]];
  }
  std::array<double, 2> st(std::size_t t, std::size_t c) const {
    return {scene_.mesh.texcoords[t][2 * c], scene_.mesh.texcoords[t][2 * c + 1]};
  }
  double uv_area(std::size_t t) const {
    const auto a = st(t, 0), b = st(t, 1), c = st(t, 2);
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
  }
  Key key(std::size_t t, std::size_t c) const {
    return {scene_.mesh.triangles[t][c], scene_.mesh.texcoords[t][2 * c],
            scene_.mesh.texcoords[t][2 * c + 1], uv_area(t) < 0};
  }

  void find_frames() {
    const std::size_t triangles = scene_.mesh.triangles.size();
    std::vector<Vec3> normals(scene_.mesh.points.size());
    for (std::size_t t = 0; t < triangles; ++t) {
      const Vec3 n = cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
      for (const std::uint32_t p : scene_.mesh.triangles[t])
        normals[p] += n;
      // Solve P(s, t) for its derivative along s, from the corners.
      const double area = uv_area(t);
      Vec3 tangent;
      if (area != 0) {
        const auto a = st(t, 0), b = st(t, 1), c = st(t, 2);
        tangent = ((corner(t, 1) - corner(t, 0)) * (c[1] - a[1]) -
                   (corner(t, 2) - corner(t, 0)) * (b[1] - a[1])) /
                  area;
        tangent = norm(tangent) > 0 ? tangent * (norm(n) / norm(tangent)) : Vec3{};
      }
      for (std::size_t c = 0; c < 3; ++c)
        frames_[key(t, c)].tangent_sum += tangent;
    }
    for (auto& [where, frame] : frames_) {
      const std::uint32_t p = std::get<0>(where);
      const Vec3 n = norm(normals[p]) > 0 ? normals[p] / norm(normals[p]) : Vec3{};
      Vec3 tangent = frame.tangent_sum - n * dot(n, frame.tangent_sum);
      tangent = norm(tangent) > 0 ? tangent / norm(tangent) : Vec3{};
      const Vec3 bitangent = cross(n, tangent) * (std::get<3>(where) ? -1.0 : 1.0);
      const Vec3 to = scene_.light - scene_.mesh.points[p];
      const Vec3 l = norm(to) > 0 ? to / norm(to) : Vec3{};
      frame.ds = scene_.offset * dot(l, tangent);
      frame.dt = scene_.offset * dot(l, bitangent);
      frame.shade = 1 - scene_.shade + scene_.shade * std::max(0.0, dot(l, n));
    }
  }

  /// Where a triangle can be seen, to pass over the others quickly.
  void bound() {
    bounds_.resize(scene_.mesh.triangles.size());
    rows_.resize(static_cast<std::size_t>(height_));
    for (std::size_t t = 0; t < bounds_.size(); ++t) {
      Box3& box = bounds_[t];
      for (std::size_t c = 0; c < 3; ++c) {
        const Vec3 d = corner(t, c) - camera_.eye;
        const double depth = -dot(d, camera_.back);
        if (!(depth > 0)) {
          box = {{-1e9, -1e9, 0}, {1e9, 1e9, 0}};
          break;
        }
        box.add({(dot(d, camera_.right) / depth / camera_.tan_x + 1) / 2 * width_,
                 (1 - dot(d, camera_.up) / depth / camera_.tan_y) / 2 * height_, 0});
      }
      const auto clamped = [&](double row) {
        return static_cast<std::size_t>(std::clamp(row, 0.0, height_ - 1));
      };
      for (std::size_t row = clamped(box.min.y - 1); row <= clamped(box.max.y + 1); ++row)
        rows_[row].push_back(t);
    }
  }

  bool sample(double x, double y, Sample& nearest) const {
    const Vec3 ray = camera_.right * ((2 * x / width_ - 1) * camera_.tan_x) +
                     camera_.up * ((1 - 2 * y / height_) * camera_.tan_y) - camera_.back;
    std::size_t hit = SIZE_MAX;
    std::array<double, 3> weights{};
    const double row = std::clamp(std::floor(y), 0.0, height_ - 1);
    for (const std::size_t t : rows_[static_cast<std::size_t>(row)]) {
      const Box3& box = bounds_[t];
      if (!(x >= box.min.x - 0.01 && x <= box.max.x + 0.01 && y >= box.min.y - 0.01 &&
            y <= box.max.y + 0.01))
        continue;
      // Cramer's rule for eye + depth · ray = a + u e1 + v e2.
      const Vec3 e1 = corner(t, 1) - corner(t, 0), e2 = corner(t, 2) - corner(t, 0);
      const Vec3 to = camera_.eye - corner(t, 0);
      const Vec3 p = cross(ray, e2), q = cross(to, e1);
      const double det = dot(e1, p);
      if (det == 0)
        continue;
      const double u = dot(to, p) / det, v = dot(ray, q) / det, depth = dot(e2, q) / det;
      if (u >= 0 && v >= 0 && u + v <= 1 && depth > 0 && depth < nearest.depth) {
        nearest.depth = depth;
        hit = t;
        weights = {1 - u - v, u, v};
      }
    }
    if (hit == SIZE_MAX)
      return false;
    double s = 0, t = 0, ds = 0, dt = 0, shade = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const Frame& frame = frames_.at(key(hit, c));
      s += weights[c] * st(hit, c)[0];
      t += weights[c] * st(hit, c)[1];
      ds += weights[c] * frame.ds;
      dt += weights[c] * frame.dt;
      shade += weights[c] * frame.shade;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      double base = scene_.color[static_cast<int>(c)] * shade;
      if (scene_.base)
        base *= texel(*scene_.base, s, t, c);
      const double r = scene_.structure ? 0.5 + 0.5 * (texel(*scene_.structure, s, t, c) -
                                                       texel(*scene_.structure, s + ds, t + dt, c))
                                        : 0.5;
      nearest.value[c] = scene_.clamp_early ? std::min(1.0, 2 * r) * base
                                            : std::min(1.0, 2 * r * std::min(1.0, base));
    }
    return true;
  }

  /// Bilinear by its definition: a sum over all four texels of value times two triangle functions.
  static double texel(const Image& image, double s, double t, std::size_t channel) {
    const double x = s * image.width - 0.5, y = (1 - t) * image.height - 0.5;
    double sum = 0;
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i) {
        const double u = std::floor(x) + i, v = std::floor(y) + j;
        const auto wrap = [](double a, double n) {
          return static_cast<std::size_t>(std::fmod(std::fmod(a, n) + n, n));
        };
        const std::size_t at = wrap(v, image.height) * image.width + wrap(u, image.width);
        sum += (1 - std::fabs(x - u)) * (1 - std::fabs(y - v)) / 255 *
               image.values[at * image.channels + (image.channels == 1 ? 0 : channel)];
      }
    return sum;
  }

  const OracleScene& scene_;
  const Camera& camera_;
  double width_, height_;
  std::map<Key, Frame> frames_;
  std::vector<Box3> bounds_;
  std::vector<std::vector<std::size_t>> rows_; // triangles that may be seen in each
};

struct OracleComparison {
  std::uint64_t covered = 0, interior = 0;
  double max = 0, rms = 0; ///< in 1/255, over interior pixels
};

/// Holds `picture` (its background must be none of the object's colours) against the oracle.
inline OracleComparison compare(const Image& picture, const OracleScene& scene,
                                const Camera& camera) {
  const Oracle oracle(scene, camera, picture.width, picture.height);
  OracleComparison result;
  double squares = 0;
  for (std::size_t y = 0; y < picture.height; ++y)
    for (std::size_t x = 0; x < picture.width; ++x) {
      const OraclePixel pixel =
          oracle.pixel(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
      result.covered += pixel.hit ? 1U : 0U;
      if (!pixel.interior)
        continue;
      ++result.interior;
      for (std::size_t c = 0; c < 3; ++c) {
        const double error =
            std::fabs(picture.values[3 * (y * picture.width + x) + c] - 255 * pixel.value[c]);
        result.max = std::max(result.max, error);
        squares += error * error;
      }
    }
  if (result.interior > 0)
    result.rms = std::sqrt(squares / (3 * static_cast<double>(result.interior)));
  return result;
}

} // namespace gewebe::test
