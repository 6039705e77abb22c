#include "render/drawing.h"

#include "base/error.h"
#include "base/parallel.h"
#include "render/tangents.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

// Based on: report FZKA 7190, 2006, section 3.2.3; Lengyel, Mathematics for 3D Game Programming and
// Computer Graphics, 2003 (emboss bump mapping).

namespace gewebe {
namespace {

/// One vertex a point, for pictures without textures.
TexturedVertices plain_vertices(const TriangleMesh& mesh) {
  TexturedVertices vertices;
  vertices.point.resize(mesh.points.size());
  std::iota(vertices.point.begin(), vertices.point.end(), 0U);
  vertices.triangles = mesh.triangles;
  return vertices;
}

Vec3 direction_to(const Vec3& light, const Vec3& p) {
  const Vec3 to = light - p;
  const double distance = norm(to);
  return distance > 0 ? to / distance : Vec3{};
}

/// 0 for a vertex at the light.
Vec3 to_light(const DrawingOptions& options, const Vec3& p) {
  return options.directional ? direction_to(options.light, {}) : direction_to(options.light, p);
}

std::array<float, 2> in_sphere_map(const Camera& camera, const Vec3& p, const Vec3& normal) {
  const Vec3 to = direction_to(p, camera.eye);
  const Vec3 mirrored = to - normal * (2 * dot(normal, to));
  const Vec3 v{dot(mirrored, camera.right), dot(mirrored, camera.up),
               dot(mirrored, camera.back) + 1};
  const double m = 2 * norm(v);
  return {static_cast<float>(m > 0 ? v.x / m + 0.5 : 0.5),
          static_cast<float>(m > 0 ? v.y / m + 0.5 : 0.5)};
}

std::array<float, 3> in_floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

bool is_moved(const Surface& surface) {
  return !surface.rest.empty() && surface.rest != surface.mesh.points;
}

void append_rest(Drawing& drawing, const Surface& surface, std::span<const std::uint32_t> point,
                 const DrawingOptions& options) {
  const TriangleMesh& mesh = surface.mesh;
  const std::vector<Vec3>& rest = surface.rest.empty() ? mesh.points : surface.rest;
  std::vector<Vec3> rest_normals, normals;
  if (options.rest_normals)
    rest_normals = is_moved(surface) ? area_normals(rest, mesh.triangles) : render_normals(mesh);
  std::vector<DrawTurn> turns;
  if (options.rest_light && is_moved(surface))
    turns = rest_turns(rest, rest_normals, mesh.points, area_normals(mesh.points, mesh.triangles),
                       mesh.triangles);
  const std::size_t base = drawing.rests.size();
  drawing.rests.resize(base + point.size());
  for (std::size_t v = 0; v < point.size(); ++v) {
    DrawRest& out = drawing.rests[base + v];
    out.place = in_floats((rest[point[v]] - drawing.rest_origin) / drawing.rest_scale);
    if (options.rest_normals)
      out.normal = in_floats(rest_normals[point[v]]);
  }
  if (!turns.empty())
    drawing.turns.resize(base);
  for (std::size_t v = 0; v < point.size() && !turns.empty(); ++v)
    drawing.turns.push_back(turns[point[v]]);
  if (!drawing.turns.empty())
    drawing.turns.resize(drawing.rests.size());
}

void append(Drawing& drawing, const Surface& surface, const DrawingOptions& options,
            const Context& context) {
  const TriangleMesh& mesh = surface.mesh;
  std::vector<Vec3> normals;
  if (options.structure || options.sphere || options.shade > 0)
    normals = render_normals(mesh);
  const TexturedVertices vertices =
      options.texcoords
          ? split_vertices(mesh, mesh.texcoords, options.structure ? &normals : nullptr, context)
          : plain_vertices(mesh);

  const std::size_t base = drawing.vertices.size();
  if (base + vertices.point.size() > UINT32_MAX)
    throw Error(std::to_string(base + vertices.point.size()) + " vertices, expected at most " +
                std::to_string(UINT32_MAX));
  drawing.vertices.resize(base + vertices.point.size());
  const bool frames = options.per_pixel && (options.structure || options.sphere);
  if (frames)
    drawing.frames.resize(drawing.vertices.size());
  parallel_blocks(context, vertices.point.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3& p = mesh.points[vertices.point[v]];
      const Vec3 place = (p - drawing.origin) / drawing.scale;
      DrawVertex& out = drawing.vertices[base + v];
      out.position = in_floats(place);
      const Vec3 light = to_light(options, p);
      const Vec3 normal = normals.empty() ? Vec3{} : normals[vertices.point[v]];
      if (options.texcoords)
        out.st = out.shifted = vertices.st[v];
      if (frames) {
        DrawFrame& frame = drawing.frames[base + v];
        frame.normal = in_floats(normal);
        if (options.structure) {
          frame.tangent = in_floats(vertices.tangent[v]);
          frame.side =
              dot(cross(normal, vertices.tangent[v]), vertices.bitangent[v]) < 0 ? -1.0F : 1.0F;
        }
      } else {
        if (options.structure) {
          const double ds = options.offset[0] * dot(light, vertices.tangent[v]);
          const double dt = options.offset[1] * dot(light, vertices.bitangent[v]);
          out.shifted = {static_cast<float>(out.st[0] + ds), static_cast<float>(out.st[1] + dt)};
        }
        if (options.sphere)
          out.sphere = in_sphere_map(options.camera, p, normal);
      }
      if (options.shade > 0)
        out.shade = static_cast<float>(1 - options.shade +
                                       options.shade * std::clamp(dot(light, normal), 0.0, 1.0));
    }
  });
  if (options.rest)
    append_rest(drawing, surface, vertices.point, options);
  for (Triangle t : vertices.triangles) {
    for (std::uint32_t& corner : t)
      corner += static_cast<std::uint32_t>(base);
    drawing.triangles.push_back(t);
  }
}

} // namespace

Drawing make_drawing(std::span<const Surface> surfaces, const DrawingOptions& options,
                     const Context& context) {
  Drawing drawing;
  for (const Surface& surface : surfaces)
    for (const Vec3& p : surface.mesh.points)
      drawing.box.add(p);
  if (drawing.box.empty())
    return drawing;
  drawing.origin = drawing.box.min * 0.5 + drawing.box.max * 0.5;
  const double half = drawing.box.longest_side() / 2;
  if (!std::isfinite(half))
    throw Error("the mesh spans more than the largest number, expected less");
  if (half > 1e-300)
    drawing.scale = half;
  drawing.directional = options.directional;
  drawing.light = options.directional ? direction_to(options.light, {})
                                      : (options.light - drawing.origin) / drawing.scale;
  drawing.offset = options.offset;
  drawing.camera = options.camera;
  drawing.camera.eye = (options.camera.eye - drawing.origin) / drawing.scale;
  if (options.rest) {
    const Box3 box = rest_box(surfaces);
    drawing.rest_origin = box.min * 0.5 + box.max * 0.5;
    const double rest_half = box.longest_side() / 2;
    if (rest_half > 1e-300)
      drawing.rest_scale = rest_half;
  }
  for (const Surface& surface : surfaces)
    append(drawing, surface, options, context);
  return drawing;
}

double drawing_bytes(std::span<const Surface> surfaces) {
  const auto triangles = static_cast<double>(triangle_count(surfaces));
  double points = 0;
  for (const Surface& surface : surfaces)
    points += static_cast<double>(surface.mesh.points.size());
  // Worst case three vertices a triangle: while split 88 bytes of its frame, drawn 40 and 28, at
  // rest 48, on the screen 12; corner lists, faces, indices.
  return triangles * (3 * (88.0 + 68 + 48 + 12 + 16) + 32 + 3 * 12) + points * 160;
}

std::uint64_t triangle_count(std::span<const Surface> surfaces) {
  std::uint64_t count = 0;
  for (const Surface& surface : surfaces)
    count += surface.mesh.triangles.size();
  return count;
}

Box3 rest_box(std::span<const Surface> surfaces) {
  Box3 box;
  for (const Surface& surface : surfaces)
    for (const Vec3& p : surface.rest.empty() ? surface.mesh.points : surface.rest)
      box.add(p);
  return box;
}

} // namespace gewebe
