#pragma once
// The formula of the report, pixel by pixel, with one ray for each: slow, in double, and with
// nothing of the library but the plain data that it is asked about.

#include "base/parallel.h"
#include "geometry/mesh.h"
#include "larger.h"
#include "rest_oracle.h"
#include "shading/camera.h"
#include "texture/image.h"
#include "texture/wet_film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>
#include <vector>

namespace gewebe::test {

struct OracleScene {
  TriangleMesh mesh;                             ///< with texture coordinates
  std::optional<texture::Image> base, structure; ///< the structure is gray
  std::optional<texture::Heights> heights;       ///< a structure of 16 bits instead
  std::optional<texture::Image> detail;          ///< by the mesh's coordinates
  std::optional<texture::Image> reflection;      ///< sphere-mapped
  std::optional<texture::SolidTexture> solid_base, solid_detail, solid_structure;
  texture::RestMapping rest; ///< triplanar: of all but the reflection
  texture::WetFilm film;
  Vec3 background; ///< what it mirrors, of the first scene
  Vec3 color{1, 1, 1}, light;
  double offset = 0, shade = 0;
  double full_distance = 0; ///< of the light; 0: it doesn't fall off
  bool directional = false; ///< `light` is a vector to it
  bool per_pixel = false;   ///< frames for each pixel, not offsets for each vertex
  bool mipmap = false;
  bool clamp_early = false;        ///< what 8-bit blending does: a negative control
  std::vector<OracleScene> others; ///< textures and colours of materials 1, 2, …
};

struct OraclePixel {
  bool hit = false;
  bool interior = false; ///< the picture is continuous here
  std::array<double, 3> value{};
};

class Oracle {
public:
  Oracle(const OracleScene& scene, const shading::Camera& camera, std::uint32_t width,
         std::uint32_t height)
      : scene_(scene), camera_(camera), width_(width), height_(height) {
    find_frames();
    bound();
    add_material(scene);
    for (const OracleScene& other : scene.others)
      add_material(other);
  }

  OraclePixel pixel(double x, double y) const {
    OraclePixel result;
    Sample middle;
    if (!sample(x, y, middle))
      return result;
    result.hit = result.interior = true;
    result.value = middle.value;
    // Continuous: around the pixel's middle the ray hits the same depth and finds the same colour,
    // and solid textures fade alike (footprints are those of triangles).
    constexpr double step = 1.0 / 64;
    for (const auto& [dx, dy] : {std::pair{step, 0.0}, {-step, 0.0}, {0.0, step}, {0.0, -step}}) {
      Sample near;
      if (!sample(x + dx, y + dy, near) ||
          !(std::fabs(near.depth - middle.depth) < 0.01 * middle.depth) ||
          !(std::fabs(near.footprint - middle.footprint) <= 0.01 * middle.footprint)) {
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
    double depth = HUGE_VAL, footprint = 0;
    std::array<double, 3> value{};
  };
  struct Frame {
    Vec3 tangent_sum, normal, tangent;
    double side = 1, ds = 0, dt = 0, shade = 1;
    std::array<double, 2> sphere{};
  };
  /// A level of a texture, rows from the top, values 0 … 1.
  struct Level {
    std::size_t width = 0, height = 0, channels = 0;
    std::vector<double> values;
  };
  using Levels = std::vector<Level>;
  /// What a material looks like.
  struct OwnMaterial {
    const OracleScene* scene;
    Levels base, structure, detail, reflection;
  };
  using Key = std::tuple<std::uint32_t, float, float, bool>;

  void add_material(const OracleScene& scene) {
    OwnMaterial& material = materials_.emplace_back(OwnMaterial{&scene, {}, {}, {}, {}});
    for (const auto& [image, levels] : {std::pair{&scene.base, &material.base},
                                        {&scene.structure, &material.structure},
                                        {&scene.detail, &material.detail},
                                        {&scene.reflection, &material.reflection}})
      if (*image)
        *levels = levels_of(**image, 255, scene_.mipmap);
    if (scene.heights)
      material.structure = levels_of(
          texture::DeepImage{scene.heights->width, scene.heights->height, 1, scene.heights->values},
          65535, scene_.mipmap);
  }

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
      const Vec3 l = to_light(scene_.mesh.points[p]);
      frame.normal = n;
      frame.tangent = tangent;
      frame.side = std::get<3>(where) ? -1 : 1;
      frame.sphere = sphere_map(scene_.mesh.points[p], n);
      frame.ds = scene_.offset * dot(l, tangent);
      frame.dt = scene_.offset * dot(l, bitangent);
      frame.shade = (1 - scene_.shade + scene_.shade * std::max(0.0, dot(l, n))) *
                    left(scene_.mesh.points[p]);
    }
  }

  static Vec3 unit(const Vec3& v) { return norm(v) > 0 ? v / norm(v) : Vec3{}; }
  double left(const Vec3& p) const {
    const double distance = norm(scene_.light - p);
    return scene_.full_distance == 0 || distance < scene_.full_distance
               ? 1
               : scene_.full_distance / distance;
  }
  Vec3 to_light(const Vec3& p) const {
    return unit(scene_.directional ? scene_.light : scene_.light - p);
  }

  /// OpenGL 2.1 specification, section 2.11.4.
  std::array<double, 2> sphere_map(const Vec3& p, const Vec3& normal) const {
    const Vec3 d = p - camera_.eye;
    const Vec3 u = unit({dot(d, camera_.right), dot(d, camera_.up), dot(d, camera_.back)});
    const Vec3 n{dot(normal, camera_.right), dot(normal, camera_.up), dot(normal, camera_.back)};
    const Vec3 r = u - 2 * n * dot(n, u);
    const double m = 2 * std::sqrt(r.x * r.x + r.y * r.y + (r.z + 1) * (r.z + 1));
    return {r.x / m + 0.5, r.y / m + 0.5};
  }

  /// By area, from the level before, whose values have 8 bits, 16 for gray; halves are rounded up.
  template <class Value>
  static Levels levels_of(const texture::Pixels<Value>& image, double top, bool all) {
    Levels levels{{image.width, image.height, image.channels, {}}};
    for (const Value value : image.values)
      levels[0].values.push_back(value / top);
    const double steps = image.channels == 1 ? 65535 : 255;
    while (all && (levels.back().width > 1 || levels.back().height > 1)) {
      const Level& fine = levels.back();
      Level coarse{std::max<std::size_t>(1, fine.width / 2),
                   std::max<std::size_t>(1, fine.height / 2),
                   fine.channels,
                   {}};
      const double across = static_cast<double>(fine.width) / static_cast<double>(coarse.width);
      const double down = static_cast<double>(fine.height) / static_cast<double>(coarse.height);
      const auto part = [](std::size_t i, double size, std::size_t j) { // of j in output i
        const auto a = static_cast<double>(i), b = static_cast<double>(j);
        return std::max(0.0, std::min((a + 1) * size, b + 1) - std::max(a * size, b));
      };
      // Levels count from the bottom, where an odd row is shared differently: turn them.
      const auto from_bottom = [](std::size_t y, std::size_t n) { return n - 1 - y; };
      for (std::size_t y = 0; y < coarse.height; ++y)
        for (std::size_t x = 0; x < coarse.width; ++x)
          for (std::size_t c = 0; c < coarse.channels; ++c) {
            double sum = 0;
            for (std::size_t v = 0; v < fine.height; ++v) {
              const double wy =
                  part(from_bottom(y, coarse.height), down, from_bottom(v, fine.height));
              for (std::size_t u = 0; wy > 0 && u < fine.width; ++u)
                sum +=
                    wy * part(x, across, u) * fine.values[(v * fine.width + u) * fine.channels + c];
            }
            coarse.values.push_back(std::floor(sum / (across * down) * steps + (0.5 + 1e-9)) /
                                    steps);
          }
      levels.push_back(std::move(coarse));
    }
    return levels;
  }

  /// Where a triangle can be seen, to pass over the others quickly.
  void bound() {
    bounds_.resize(scene_.mesh.triangles.size());
    columns_ = static_cast<std::size_t>(width_) / cell + 1;
    cells_.resize(columns_ * (static_cast<std::size_t>(height_) / cell + 1));
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
      const auto cell_of = [](double at, double max) {
        return static_cast<std::size_t>(std::clamp(at, 0.0, max - 1)) / cell;
      };
      for (std::size_t row = cell_of(box.min.y - 1, height_);
           row <= cell_of(box.max.y + 1, height_); ++row)
        for (std::size_t column = cell_of(box.min.x - 1, width_);
             column <= cell_of(box.max.x + 1, width_); ++column)
          cells_[row * columns_ + column].push_back(t);
    }
  }

  bool sample(double x, double y, Sample& nearest) const {
    const Vec3 ray = camera_.right * ((2 * x / width_ - 1) * camera_.tan_x) +
                     camera_.up * ((1 - 2 * y / height_) * camera_.tan_y) - camera_.back;
    std::size_t hit = SIZE_MAX;
    std::array<double, 3> weights{};
    const auto row = static_cast<std::size_t>(std::clamp(y, 0.0, height_ - 1)) / cell;
    const auto column = static_cast<std::size_t>(std::clamp(x, 0.0, width_ - 1)) / cell;
    for (const std::size_t t : cells_[row * columns_ + column]) {
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
    Vec3 place, normal, tangent;
    std::array<double, 2> around{};
    for (std::size_t c = 0; c < 3; ++c) {
      const Frame& frame = frames_.at(key(hit, c));
      s += weights[c] * st(hit, c)[0];
      t += weights[c] * st(hit, c)[1];
      ds += weights[c] * frame.ds;
      dt += weights[c] * frame.dt;
      shade += weights[c] * frame.shade;
      place += weights[c] * corner(hit, c);
      normal += weights[c] * frame.normal;
      tangent += weights[c] * frame.tangent;
      for (std::size_t a = 0; a < 2; ++a)
        around[a] += weights[c] * frame.sphere[a];
    }
    if (scene_.per_pixel) {
      const Vec3 n = unit(normal), along = unit(tangent - n * dot(n, tangent)), l = to_light(place);
      ds = scene_.offset * dot(l, along);
      dt = scene_.offset * frames_.at(key(hit, 0)).side * dot(l, cross(n, along));
      around = sphere_map(place, n);
    }
    const OwnMaterial& material =
        materials_[scene_.mesh.material.empty()
                       ? 0
                       : static_cast<std::size_t>(scene_.mesh.material[hit])];
    const OracleScene& own = *material.scene;
    const RestPoint at_rest = rest_point(own, hit, x, y, place, unit(normal));
    nearest.footprint = at_rest.footprint;
    const auto change = scene_.mipmap ? changes(hit, x, y) : std::array<double, 4>{};
    for (std::size_t c = 0; c < 3; ++c) {
      double base = own.color[static_cast<int>(c)] * shade;
      const auto image = [&](const Levels& levels) {
        return scene_.rest.triplanar ? projected(levels, at_rest, c)
                                     : value(levels, change, s, t, c);
      };
      if (own.base)
        base *= image(material.base);
      if (own.solid_base)
        base *= at_rest.base[c];
      base = test::smaller(base, 1.0);
      if (own.detail)
        base = test::smaller(base + image(material.detail), 1.0);
      if (own.solid_detail)
        base = test::smaller(base + at_rest.detail[c], 1.0);
      if (own.reflection)
        base = test::smaller(base + texel(material.reflection[0], around[0], around[1], c), 1.0);
      double r = 0.5;
      if (own.solid_structure)
        r = at_rest.relief;
      else if (own.structure && scene_.rest.triplanar)
        r = projected_relief(material.structure, at_rest);
      else if (own.structure || own.heights)
        r += 0.5 * (value(material.structure, change, s, t, c) -
                    value(material.structure, change, s + ds, t + dt, c));
      nearest.value[c] =
          scene_.clamp_early ? std::min(1.0, 2 * r) * base : std::min(1.0, 2 * r * base);
      if (own.film.amount > 0)
        nearest.value[c] = wet(own.film, nearest.value[c], scene_.background[static_cast<int>(c)],
                               place, unit(normal), r);
    }
    return true;
  }

  /// Cook and Torrance's product of distribution, shadowing and reflectance, as wet_film.h has it.
  double wet(const texture::WetFilm& film, double color, double around, const Vec3& place, Vec3 n,
             double r) const {
    const Vec3 v = unit(camera_.eye - place), l = to_light(place), h = unit(v + l);
    n = n * std::copysign(1.0, dot(n, v));
    n = unit(n + unit(l - n * dot(l, n)) * (2 * r - 1));
    const double pi = std::numbers::pi, a = film.roughness * film.roughness;
    const auto fresnel = [&](double x) {
      return film.reflectance + (1 - film.reflectance) * std::pow(1 - std::max(x, 0.0), 5);
    };
    const auto shadowing = [&](double x) {
      return 2 / (1 + std::sqrt(1 + a * a * (1 / (x * x) - 1)));
    };
    const double nl = dot(n, l), nv = dot(n, v);
    double mirrored = 0;
    if (nl > 0 && nv > 0) {
      const double tilt = std::pow(dot(n, h), 2);
      const double density = a * a / (pi * std::pow(tilt * (a * a - 1) + 1, 2));
      mirrored =
          pi * density * fresnel(dot(v, h)) * shadowing(nl) * shadowing(nv) / (4 * nl * nv) * nl;
    } else if (nl > 0) { // its limit at the rim
      const double tilt = std::pow(dot(n, h), 2);
      const double density = a * a / (pi * std::pow(tilt * (a * a - 1) + 1, 2));
      mirrored = pi * density * fresnel(dot(v, h)) * shadowing(nl) / (2 * a);
    }
    mirrored *= left(place);
    return test::smaller(color + film.amount * (fresnel(nv) * (around - color) + mirrored), 1.0);
  }

  /// What textures at rest see of a point; for surfaces that rest.
  struct RestPoint {
    Vec3 place, normal, light;
    std::array<Vec3, 2> change; ///< of the place along x and y
    std::array<double, 3> base{}, detail{};
    double relief = 0.5, footprint = 0;
  };

  RestPoint rest_point(const OracleScene& own, std::size_t hit, double x, double y,
                       const Vec3& place, const Vec3& normal) const {
    RestPoint p{place, normal, to_light(place), {}, {}, {}, 0.5, 0};
    const bool solid = own.solid_base || own.solid_detail || own.solid_structure;
    if (!solid && !scene_.rest.triplanar)
      return p;
    const auto in_plane = [&](double px, double py) {
      const Vec3 ray = camera_.right * ((2 * px / width_ - 1) * camera_.tan_x) +
                       camera_.up * ((1 - 2 * py / height_) * camera_.tan_y) - camera_.back;
      const Vec3 n = cross(corner(hit, 1) - corner(hit, 0), corner(hit, 2) - corner(hit, 0));
      return camera_.eye + ray * (dot(corner(hit, 0) - camera_.eye, n) / dot(ray, n));
    };
    constexpr double h = 1e-3;
    p.change = {(in_plane(x + h, y) - in_plane(x - h, y)) / (2 * h),
                (in_plane(x, y + h) - in_plane(x, y - h)) / (2 * h)};
    const double footprint = std::max(norm(p.change[0]), norm(p.change[1]));
    p.footprint = solid ? footprint : 0;
    const auto colors = [&](const std::optional<texture::SolidTexture>& texture,
                            std::array<double, 3>& out) {
      for (int c = 0; texture && c < 3; ++c)
        out[static_cast<std::size_t>(c)] =
            texture->ground[c] +
            solid_oracle(*texture, place, footprint) * (texture->color[c] - texture->ground[c]);
    };
    colors(own.solid_base, p.base);
    colors(own.solid_detail, p.detail);
    if (own.solid_structure) {
      const Vec3 flat = p.light - normal * dot(normal, p.light);
      p.relief +=
          0.5 * (solid_oracle(*own.solid_structure, place, footprint) -
                 solid_oracle(*own.solid_structure,
                              place + flat * (scene_.offset * scene_.rest.edge), footprint));
    }
    return p;
  }

  /// Coordinates along one axis of a point, and of what it changes by, by their table.
  static std::array<double, 2> projection_of(const Vec3& q, const Vec3& normal, int axis) {
    if (axis == 0)
      return {normal.x < 0 ? -q.y : q.y, q.z};
    if (axis == 1)
      return {normal.y < 0 ? q.x : -q.x, q.z};
    return {normal.z < 0 ? -q.x : q.x, q.y};
  }

  template <class Value>
  double blended(const RestPoint& p, const Value& value_along) const {
    std::array<double, 3> weights = triplanar_oracle(p.normal, scene_.rest.sharpness);
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double weight = weights[static_cast<std::size_t>(axis)];
      if (weight > 0)
        sum += weight * value_along(axis);
    }
    return sum;
  }

  std::array<double, 4> changes_along(const RestPoint& p, int axis) const {
    const auto dx = projection_of(p.change[0] / scene_.rest.edge, p.normal, axis);
    const auto dy = projection_of(p.change[1] / scene_.rest.edge, p.normal, axis);
    return {dx[0], dx[1], dy[0], dy[1]};
  }

  double projected(const Levels& levels, const RestPoint& p, std::size_t channel) const {
    return blended(p, [&](int axis) {
      const auto st =
          projection_of((p.place - scene_.rest.start) / scene_.rest.edge, p.normal, axis);
      return value(levels, changes_along(p, axis), st[0], st[1], channel);
    });
  }

  double projected_relief(const Levels& structure, const RestPoint& p) const {
    return blended(p, [&](int axis) {
      const auto st =
          projection_of((p.place - scene_.rest.start) / scene_.rest.edge, p.normal, axis);
      // T is where s grows while t stands still on the surface: across the axis of t.
      const Vec3 up = axis == 2 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
      const Vec3 along = unit(cross(up, p.normal));
      const double ds = scene_.offset * dot(p.light, along);
      const double dt = scene_.offset * dot(p.light, cross(p.normal, along));
      const auto change = changes_along(p, axis);
      return 0.5 + 0.5 * (value(structure, change, st[0], st[1], 0) -
                          value(structure, change, st[0] + ds, st[1] + dt, 0));
    });
  }

  /// ds/dx, dt/dx, ds/dy, dt/dy in the plane of a triangle, by differences.
  std::array<double, 4> changes(std::size_t hit, double x, double y) const {
    const auto at = [&](double px, double py) {
      const Vec3 ray = camera_.right * ((2 * px / width_ - 1) * camera_.tan_x) +
                       camera_.up * ((1 - 2 * py / height_) * camera_.tan_y) - camera_.back;
      const Vec3 e1 = corner(hit, 1) - corner(hit, 0), e2 = corner(hit, 2) - corner(hit, 0);
      const Vec3 to = camera_.eye - corner(hit, 0);
      const double det = dot(e1, cross(ray, e2));
      const double u = dot(to, cross(ray, e2)) / det, v = dot(ray, cross(to, e1)) / det;
      std::array<double, 2> result{};
      for (std::size_t a = 0; a < 2; ++a)
        result[a] = (1 - u - v) * st(hit, 0)[a] + u * st(hit, 1)[a] + v * st(hit, 2)[a];
      return result;
    };
    constexpr double h = 1e-4;
    const auto left = at(x - h, y), right = at(x + h, y), up = at(x, y - h), down = at(x, y + h);
    return {(right[0] - left[0]) / (2 * h), (right[1] - left[1]) / (2 * h),
            (down[0] - up[0]) / (2 * h), (down[1] - up[1]) / (2 * h)};
  }

  static double value(const Levels& levels, const std::array<double, 4>& change, double s, double t,
                      std::size_t channel) {
    const auto w = static_cast<double>(levels[0].width), h = static_cast<double>(levels[0].height);
    const double covered = std::max(std::hypot(change[0] * w, change[1] * h),
                                    std::hypot(change[2] * w, change[3] * h));
    std::size_t k = 0;
    double power = 1;
    while (covered >= 2 * power) {
      power *= 2;
      ++k;
    }
    if (covered <= 1 || levels.size() == 1)
      return texel(levels[0], s, t, channel);
    if (k + 1 >= levels.size())
      return texel(levels.back(), s, t, channel);
    const double part = covered / power - 1;
    return (1 - part) * texel(levels[k], s, t, channel) +
           part * texel(levels[k + 1], s, t, channel);
  }

  /// Bilinear by its definition: a sum over all four texels of value times two triangle functions.
  static double texel(const Level& image, double s, double t, std::size_t channel) {
    const auto width = static_cast<double>(image.width), height = static_cast<double>(image.height);
    const double x = s * width - 0.5, y = (1 - t) * height - 0.5;
    double sum = 0;
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i) {
        const double u = std::floor(x) + i, v = std::floor(y) + j;
        const auto wrap = [](double a, double n) {
          return static_cast<std::size_t>(std::fmod(std::fmod(a, n) + n, n));
        };
        const std::size_t at = wrap(v, height) * image.width + wrap(u, width);
        sum += (1 - std::fabs(x - u)) * (1 - std::fabs(y - v)) *
               image.values[at * image.channels + (image.channels == 1 ? 0 : channel)];
      }
    return sum;
  }

  const OracleScene& scene_;
  const shading::Camera& camera_;
  double width_, height_;
  std::map<Key, Frame> frames_;
  std::vector<Box3> bounds_;
  static constexpr std::size_t cell = 8; // pixels
  std::size_t columns_ = 0;
  std::vector<std::vector<std::size_t>> cells_; // triangles that may be seen in each
  std::vector<OwnMaterial> materials_;          ///< by material
};

using OraclePicture = std::vector<OraclePixel>;

inline OraclePicture oracle_picture(const OracleScene& scene, const shading::Camera& camera,
                                    std::uint32_t width, std::uint32_t height) {
  const Oracle oracle(scene, camera, width, height);
  OraclePicture picture(std::size_t{width} * height);
  parallel_blocks({}, height, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y)
      for (std::size_t x = 0; x < width; ++x)
        picture[y * width + x] =
            oracle.pixel(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
  });
  return picture;
}

struct OracleComparison {
  std::uint64_t covered = 0, interior = 0;
  double max = 0, rms = 0; ///< in 1/255, over interior pixels, of the oracle's real numbers
  double rms_rounded = 0;  ///< of the oracle rounded to 8 bits, as a picture is
};

/// Holds `picture` against the oracle's.
inline OracleComparison compare(const texture::Image& picture, const OraclePicture& oracle) {
  OracleComparison result;
  double squares = 0, rounded = 0;
  for (std::size_t at = 0; at < oracle.size(); ++at) {
    result.covered += oracle[at].hit ? 1U : 0U;
    if (!oracle[at].interior)
      continue;
    ++result.interior;
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = 255 * oracle[at].value[c];
      const double error = std::fabs(picture.values[3 * at + c] - value);
      const double steps = picture.values[3 * at + c] - std::floor(value + 0.5);
      result.max = test::larger(result.max, error);
      squares += error * error;
      rounded += steps * steps;
    }
  }
  if (result.interior > 0) {
    result.rms = std::sqrt(squares / (3 * static_cast<double>(result.interior)));
    result.rms_rounded = std::sqrt(rounded / (3 * static_cast<double>(result.interior)));
  }
  return result;
}

inline OracleComparison compare(const texture::Image& picture, const OracleScene& scene,
                                const shading::Camera& camera) {
  return compare(picture, oracle_picture(scene, camera, picture.width, picture.height));
}

} // namespace gewebe::test
