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

void append(Drawing& drawing, const Surface& surface, const DrawingOptions& options,
            const Context& context) {
  const TriangleMesh& mesh = surface.mesh;
  std::vector<Vec3> normals;
  if (options.structure || options.shade > 0)
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
  parallel_blocks(context, vertices.point.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3& p = mesh.points[vertices.point[v]];
      const Vec3 place = (p - drawing.origin) / drawing.scale;
      DrawVertex& out = drawing.vertices[base + v];
      for (int a = 0; a < 3; ++a)
        out.position[static_cast<std::size_t>(a)] = static_cast<float>(place[a]);
      const Vec3 to_light = direction_to(options.light, p);
      if (options.texcoords)
        out.st = out.shifted = vertices.st[v];
      if (options.structure) {
        const double ds = options.offset * dot(to_light, vertices.tangent[v]);
        const double dt = options.offset * dot(to_light, vertices.bitangent[v]);
        out.shifted = {static_cast<float>(out.st[0] + ds), static_cast<float>(out.st[1] + dt)};
      }
      if (options.shade > 0)
        out.shade = static_cast<float>(
            1 - options.shade +
            options.shade * std::clamp(dot(to_light, normals[vertices.point[v]]), 0.0, 1.0));
    }
  });
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
  for (const Surface& surface : surfaces)
    append(drawing, surface, options, context);
  return drawing;
}

double drawing_bytes(std::span<const Surface> surfaces) {
  const auto triangles = static_cast<double>(triangle_count(surfaces));
  double points = 0;
  for (const Surface& surface : surfaces)
    points += static_cast<double>(surface.mesh.points.size());
  // Worst case three vertices a triangle: while split 88 bytes of its frame, drawn 32, on the
  // screen 48; corner lists, faces, indices.
  return triangles * (3 * (88.0 + 32 + 48 + 16) + 32 + 3 * 12) + points * 64;
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
