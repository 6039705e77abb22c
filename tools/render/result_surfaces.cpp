#include "tools/render/result_surfaces.h"

#include "base/error.h"
#include "contact/instrument_surface.h"
#include "tetrahedra/order.h"
#include "tools/render/solid_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace gewebe::cli {
namespace {

constexpr std::uint32_t ramp_width = 1024;

struct Frame {
  std::string path;
  std::vector<std::string> objects;
  std::size_t number = 0;
};

Frame frame_of(const formats::Input& input, const std::string& object, std::int64_t frame) {
  const std::string& path = input.name();
  if (path == "-")
    throw Error(path, "a result comes by a pipe, expected the name of its file");
  formats::ResultIndex index = formats::read_result_index(path);
  const auto frames = static_cast<std::int64_t>(index.times.size());
  if (frame < -1 || frame >= frames || frames == 0)
    throw Error(path, "there is no frame " + std::to_string(frame) + ", expected 0 to " +
                          std::to_string(frames - 1));
  return {path, object.empty() ? std::move(index.objects) : std::vector<std::string>{object},
          static_cast<std::size_t>(frame < 0 ? frames - 1 : frame)};
}

/// Texture coordinates of values, one a point.
void lay_on(TriangleMesh& mesh, std::span<const double> values,
            const std::array<double, 2>& range) {
  const auto place = [&](std::uint32_t point) {
    const double share = (values[point] - range[0]) / (range[1] - range[0]);
    return static_cast<float>((std::clamp(share, 0.0, 1.0) * (ramp_width - 1) + 0.5) / ramp_width);
  };
  mesh.texcoords.clear();
  mesh.texcoords.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    mesh.texcoords.push_back({place(a), 0.5F, place(b), 0.5F, place(c), 0.5F});
}

shading::Surface open_solid(const Frame& frame, const std::string& object,
                            const SurfaceReadOptions& options, const std::vector<double>& values,
                            SolidReport& report) {
  formats::ResultSolid read = formats::read_result_solid(frame.path, object, frame.number);
  shading::Surface surface;
  if (!read.there)
    return surface;
  return at(frame.path, [&] {
    tetrahedra::TetMesh mesh = std::move(read.mesh);
    mesh.points.swap(read.rest); // displaced it may have turned tetrahedra
    examine_solid(mesh, report);
    mesh.points.swap(read.rest);
    tetrahedra::TetClip left =
        cut_open(tetrahedra::linear_parts(std::move(mesh)), *options.clip, report);
    surface.mesh = std::move(left.mesh);
    surface.materials = std::move(read.materials);
    surface.rest.reserve(left.origin.size());
    std::vector<double> at_points;
    for (const auto& [a, b, share] : left.origin) {
      surface.rest.push_back(read.rest[a] + (read.rest[b] - read.rest[a]) * share);
      if (!values.empty())
        at_points.push_back(values[a] + (values[b] - values[a]) * share);
    }
    if (!values.empty())
      lay_on(surface.mesh, at_points, *options.field_range);
    return std::move(surface);
  });
}

/// The straight part in pieces of about the thickness, so that a near light falls off along it.
std::size_t pieces_along(double length, double radius) {
  constexpr double most = 32;
  return static_cast<std::size_t>(std::clamp(std::ceil(length / (2 * radius)), 1.0, most));
}

} // namespace

shading::Surface instrument_surface(formats::ResultInstrument of, std::size_t ring) {
  const Vec3 along = of.ends[1] - of.ends[0];
  // Back into its own coordinates.
  const auto& m = of.rotation;
  const Vec3 axis = m[0] * along.x + m[1] * along.y + m[2] * along.z;
  const bool sphere = of.kind == contact::InstrumentKind::sphere,
             blade = of.kind == contact::InstrumentKind::blade;
  const double radius = contact::shown_radius({of.radius, axis, of.friction, blade});
  shading::Surface surface;
  surface.instrument = true;
  const auto rotated = [&](const Vec3& r) {
    return Vec3{dot(m[0], r), dot(m[1], r), dot(m[2], r)};
  };
  if (of.kind == contact::InstrumentKind::mesh) {
    surface.mesh = std::move(of.surface);
    for (std::array<float, 3>& own : surface.mesh.normals) {
      const Vec3 n = rotated({own[0], own[1], own[2]});
      own = {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
    }
    for (const Vec3& p : surface.mesh.points) {
      const Vec3 r = p - of.place;
      surface.rest.push_back(m[0] * r.x + m[1] * r.y + m[2] * r.z);
    }
    return surface;
  }
  if (!(radius > 0))
    return surface;
  contact::InstrumentSurface own =
      sphere ? contact::round_surface(radius, {}, ring)
             : contact::round_surface(radius, axis, ring, pieces_along(norm(axis), radius));
  for (std::size_t i = 0; i < own.points.size(); ++i) {
    surface.mesh.points.push_back(of.place + rotated(own.points[i]));
    const Vec3 n = rotated(own.normals[i]);
    surface.mesh.normals.push_back(
        {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
  }
  surface.mesh.triangles = std::move(own.triangles);
  surface.rest = std::move(own.points);
  return surface;
}

std::vector<shading::Surface> read_result_surfaces(const formats::Input& input,
                                                   const SurfaceReadOptions& options,
                                                   SolidReport& report) {
  const Frame frame = frame_of(input, options.object, options.frame.value_or(-1));
  report = {};
  std::vector<shading::Surface> surfaces;
  for (const std::string& object : frame.objects) {
    std::vector<double> values;
    if (options.field_range)
      values = formats::read_result_values(frame.path, object, frame.number, options.field);
    if (options.clip) {
      shading::Surface left = open_solid(frame, object, options, values, report);
      if (!left.mesh.triangles.empty())
        surfaces.push_back(std::move(left));
      continue;
    }
    // Values are those of nodes, which a skin has none of.
    formats::ResultSurface read =
        formats::read_result_surface(frame.path, object, frame.number, !options.field_range);
    if (!read.there && options.object.empty())
      continue;
    if (read.there && options.field_range)
      lay_on(read.mesh, values, *options.field_range);
    surfaces.push_back({std::move(read.mesh), std::move(read.rest), std::move(read.materials)});
  }
  if (options.clip && surfaces.empty())
    throw Error(frame.path, takes_all_away);
  if (options.ring > 0)
    for (formats::ResultInstrument& instrument :
         formats::read_result_instruments(frame.path, frame.number))
      surfaces.push_back(instrument_surface(std::move(instrument), options.ring));
  return surfaces;
}

std::array<double, 2> result_field_range(const formats::Input& input,
                                         const SurfaceReadOptions& options,
                                         const std::vector<std::int64_t>& frames) {
  std::array<double, 2> range{0, 0};
  bool any = false;
  for (const std::int64_t number : frames) {
    const Frame frame = frame_of(input, options.object, number);
    for (const std::string& object : frame.objects)
      for (const double value :
           formats::read_result_values(frame.path, object, frame.number, options.field)) {
        range = any ? std::array{std::min(range[0], value), std::max(range[1], value)}
                    : std::array{value, value};
        any = true;
      }
  }
  return range;
}

texture::Texture ramp_texture(const texture::ColorRamp& ramp) {
  std::vector<float> values;
  for (std::uint32_t x = 0; x < ramp_width; ++x)
    values.push_back(static_cast<float>(x));
  texture::TextureOptions options;
  options.wrap = texture::TextureWrap::clamp;
  return texture::texture_from(texture::colored(values, ramp_width, 1, 0, ramp_width - 1, ramp),
                               options);
}

} // namespace gewebe::cli
