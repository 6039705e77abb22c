#include "shading/drawing.h"

#include "base/error.h"
#include "base/parallel.h"
#include "shading/endoscope.h"
#include "shading/occlusion.h"
#include "shading/tangents.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

// Based on: report FZKA 7190, 2006, section 3.2.3; Lengyel, Mathematics for 3D Game Programming and
// Computer Graphics, 2003 (emboss bump mapping).

namespace gewebe::shading {
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

/// Normals at rest, which stand still while the points move.
void prepare_rest(DrawingParts& kept, const Surface& surface, const DrawingOptions& options,
                  DrawingChange change) {
  const bool moved = is_moved(surface);
  if (options.rest_normals && !(change == DrawingChange::points && moved && kept.moved))
    kept.rest_normals =
        moved ? area_normals(surface.rest, surface.mesh.triangles) : render_normals(surface.mesh);
  kept.moved = moved;
}

/// Renews what of `kept` `change` leaves no longer true.
void prepare(DrawingParts& kept, const Surface& surface, const DrawingOptions& options,
             DrawingChange change, DrawingCounts& counts, const Context& context) {
  if (change == DrawingChange::view)
    return;
  if (options.rest)
    prepare_rest(kept, surface, options, change);
  const TriangleMesh& mesh = surface.mesh;
  if (options.structure || options.sphere || options.wet || options.shade > 0 ||
      options.occlusion > 0)
    kept.normals = render_normals(mesh);
  counts.frames += options.structure ? 1U : 0U;
  if (change == DrawingChange::points) {
    if (options.structure)
      renew_frames(kept.vertices, mesh, mesh.texcoords, kept.normals, context);
    return;
  }
  counts.splits += options.texcoords ? 1U : 0U;
  kept.vertices = options.texcoords
                      ? split_vertices(mesh, mesh.texcoords,
                                       options.structure ? &kept.normals : nullptr, context)
                      : plain_vertices(mesh);
}

void append(Drawing& drawing, const Surface& surface, const DrawingParts& parts,
            const DrawingOptions& options, const Context& context) {
  const TriangleMesh& mesh = surface.mesh;
  const std::vector<Vec3>& normals = parts.normals;
  const Vec3 fill = fill_direction(options.camera) * options.fill;
  const TexturedVertices& vertices = parts.vertices;
  const std::size_t base = drawing.vertices.size();
  if (base + vertices.point.size() > UINT32_MAX)
    throw Error(std::to_string(base + vertices.point.size()) + " vertices, expected at most " +
                std::to_string(UINT32_MAX));
  drawing.vertices.resize(base + vertices.point.size());
  const bool frames = options.per_pixel && (options.structure || options.sphere || options.wet);
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
      if (options.shade > 0) {
        // The brightest normal has 1, so that nothing is flat for being too bright.
        const double brightest = options.fill > 0 ? std::max(norm(light + fill), 1.0) : 1;
        const double lit = std::max(dot(light, normal), 0.0) + std::max(dot(fill, normal), 0.0);
        out.shade =
            static_cast<float>(1 - options.shade + options.shade * std::min(lit / brightest, 1.0));
      }
      if (options.full_distance > 0)
        out.shade *= static_cast<float>(light_left(options.full_distance, norm(options.light - p)));
      if (!parts.openness.empty())
        out.shade *= static_cast<float>(1 - options.occlusion *
                                                (1 - double{parts.openness[vertices.point[v]]}));
    }
  });
}

/// How open all surfaces are, each hidden by the others too.
void find_openness(std::vector<DrawingParts>& parts, std::span<const Surface> surfaces,
                   const DrawingOptions& options, const Context& context) {
  std::vector<Occluder> occluders;
  for (std::size_t n = 0; n < surfaces.size(); ++n)
    occluders.push_back({surfaces[n].mesh.points, parts[n].normals, surfaces[n].mesh.triangles});
  std::vector<std::vector<float>> found = openness(occluders, options.occlusion_radius, context);
  for (std::size_t n = 0; n < surfaces.size(); ++n)
    parts[n].openness = std::move(found[n]);
}

/// Places and normals at rest of the vertices appended last.
void append_rests(Drawing& drawing, const Surface& surface, const DrawingParts& parts) {
  const std::vector<Vec3>& rest = surface.rest.empty() ? surface.mesh.points : surface.rest;
  const std::vector<std::uint32_t>& point = parts.vertices.point;
  const std::size_t base = drawing.vertices.size() - point.size();
  drawing.rests.resize(drawing.vertices.size());
  for (std::size_t v = 0; v < point.size(); ++v) {
    const std::uint32_t p = point[v];
    texture::DrawRest& out = drawing.rests[base + v];
    out.place = in_floats((rest[p] - drawing.rest_origin) / drawing.rest_scale);
    if (!parts.rest_normals.empty())
      out.normal = in_floats(parts.rest_normals[p]);
  }
}

/// Their turns, none while no surface has moved.
void append_turns(Drawing& drawing, const Surface& surface, const DrawingParts& parts) {
  const TriangleMesh& mesh = surface.mesh;
  const std::vector<std::uint32_t>& point = parts.vertices.point;
  if (parts.moved) {
    const std::vector<texture::DrawTurn> turns =
        texture::rest_turns(surface.rest, parts.rest_normals, mesh.points,
                            area_normals(mesh.points, mesh.triangles), mesh.triangles);
    drawing.turns.resize(drawing.vertices.size() - point.size());
    for (const std::uint32_t p : point)
      drawing.turns.push_back(turns[p]);
  } else if (!drawing.turns.empty()) {
    drawing.turns.resize(drawing.vertices.size());
  }
}

/// Those of the vertices appended last.
void append_triangles(Drawing& drawing, const TexturedVertices& vertices) {
  const auto base = static_cast<std::uint32_t>(drawing.vertices.size() - vertices.point.size());
  for (Triangle t : vertices.triangles) {
    for (std::uint32_t& corner : t)
      corner += base;
    drawing.triangles.push_back(t);
  }
}

/// Sorts the triangles by their groups, within which they keep their order.
void group(Drawing& drawing, std::span<const Surface> surfaces, const DrawingOptions& options) {
  std::vector<std::size_t> group_of;
  group_of.reserve(drawing.triangles.size());
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const TriangleMesh& mesh = surfaces[s].mesh;
    if (surfaces[s].instrument || surfaces[s].inside) {
      const bool behind = surfaces[s].instrument && options.insides;
      group_of.insert(group_of.end(), mesh.triangles.size(),
                      options.groups.size() + (behind ? 2 : 1));
      continue;
    }
    const std::vector<std::int32_t>& numbers =
        options.group_by == GroupBy::part ? mesh.part : mesh.material;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const std::int32_t number = options.group_by == GroupBy::surface
                                      ? static_cast<std::int32_t>(s)
                                  : numbers.empty() ? 0
                                                    : numbers[t];
      const auto found = std::ranges::find(options.groups, number);
      group_of.push_back(found == options.groups.end()
                             ? 0
                             : static_cast<std::size_t>(found - options.groups.begin()) + 1);
    }
  }
  std::vector<std::size_t> next(options.groups.size() + 2 + (options.insides ? 1 : 0) +
                                (options.instruments ? 1 : 0));
  for (const std::size_t g : group_of)
    ++next[g + 1];
  for (std::size_t g = 1; g < next.size(); ++g)
    next[g] += next[g - 1];
  drawing.group_start.assign(next.begin() + 1, next.end() - 1);
  std::vector<Triangle> sorted(drawing.triangles.size());
  for (std::size_t t = 0; t < sorted.size(); ++t)
    sorted[next[group_of[t]]++] = drawing.triangles[t];
  drawing.triangles = std::move(sorted);
}

void set_view(Drawing& drawing, const DrawingOptions& options) {
  drawing.directional = options.directional;
  drawing.light = options.directional ? direction_to(options.light, {})
                                      : (options.light - drawing.origin) / drawing.scale;
  drawing.full_distance = options.full_distance / drawing.scale;
  drawing.offset = options.offset;
  drawing.camera = options.camera;
  drawing.camera.eye = (options.camera.eye - drawing.origin) / drawing.scale;
}

} // namespace

Drawing make_drawing(std::span<const Surface> surfaces, const DrawingOptions& options,
                     const Context& context) {
  DrawingMaker maker;
  (void)maker.make(surfaces, options, DrawingChange::all, context);
  return std::move(maker).drawing();
}

const Drawing& DrawingMaker::make(std::span<const Surface> surfaces, const DrawingOptions& options,
                                  DrawingChange change, const Context& context) {
  ++counts_.drawings;
  if (change == DrawingChange::view && options.per_pixel && !(options.shade > 0) &&
      !(options.full_distance > 0)) {
    set_view(drawing_, options); // nothing of it stands at vertices
    return drawing_;
  }
  Drawing drawing;
  drawing.version = ++counts_.vertices;
  if (change != DrawingChange::all) {
    drawing.triangles = std::move(drawing_.triangles);
    drawing.group_start = std::move(drawing_.group_start);
  }
  if (change == DrawingChange::view) {
    drawing.rests = std::move(drawing_.rests);
    drawing.turns = std::move(drawing_.turns);
  }
  drawing_ = {};
  for (const Surface& surface : surfaces)
    for (const Vec3& p : surface.mesh.points)
      drawing.box.add(p);
  if (drawing.box.empty()) {
    drawing_ = std::move(drawing);
    return drawing_;
  }
  drawing.origin = drawing.box.min * 0.5 + drawing.box.max * 0.5;
  const double half = drawing.box.longest_side() / 2;
  if (!std::isfinite(half))
    throw Error("the mesh spans more than the largest number, expected less");
  if (half > 1e-300)
    drawing.scale = half;
  set_view(drawing, options);
  if (options.rest) {
    const Box3 rest = rest_box(surfaces);
    drawing.rest_origin = rest.min * 0.5 + rest.max * 0.5;
    const double rest_half = rest.longest_side() / 2;
    if (rest_half > 1e-300)
      drawing.rest_scale = rest_half;
  }
  parts_.resize(surfaces.size());
  const bool sorted = change != DrawingChange::all;
  for (std::size_t n = 0; n < surfaces.size(); ++n)
    prepare(parts_[n], surfaces[n], options, change, counts_, context);
  if (options.occlusion > 0 && change != DrawingChange::view)
    find_openness(parts_, surfaces, options, context);
  for (std::size_t n = 0; n < surfaces.size(); ++n) {
    append(drawing, surfaces[n], parts_[n], options, context);
    if (options.rest && change != DrawingChange::view) {
      append_rests(drawing, surfaces[n], parts_[n]);
      if (options.rest_light)
        append_turns(drawing, surfaces[n], parts_[n]);
    }
    if (!sorted)
      append_triangles(drawing, parts_[n].vertices);
  }
  if (!sorted && (!options.groups.empty() || options.insides || options.instruments))
    group(drawing, surfaces, options);
  drawing_ = std::move(drawing);
  return drawing_;
}

std::span<const Triangle> triangles_of_group(const Drawing& drawing, std::size_t group) {
  const std::span<const Triangle> all = drawing.triangles;
  const std::size_t first = group == 0 ? 0 : drawing.group_start[group - 1];
  const std::size_t end =
      group < drawing.group_start.size() ? drawing.group_start[group] : all.size();
  return all.subspan(first, end - first);
}

const std::vector<std::string>& group_by_names() {
  static const std::vector<std::string> names{"material", "part", "object"};
  return names;
}

GroupBy group_by_from_name(std::string_view name) {
  const auto found = std::ranges::find(group_by_names(), name);
  if (found == group_by_names().end())
    throw Error("'" + std::string(name) + "' does not define groups");
  return static_cast<GroupBy>(found - group_by_names().begin());
}

Vec3 fill_direction(const Camera& camera) {
  return direction_to(camera.back + camera.right * 0.9 - camera.up * 0.3, {});
}

double drawing_bytes(std::span<const Surface> surfaces) {
  const auto triangles = static_cast<double>(triangle_count(surfaces));
  double points = 0;
  for (const Surface& surface : surfaces)
    points += static_cast<double>(surface.mesh.points.size());
  // Worst case three vertices a triangle: while split 88 bytes of its frame, drawn 40 and 28, at
  // rest 48, on the screen 12; corner lists, faces, groups, indices.
  return triangles * (3 * (88.0 + 68 + 48 + 12 + 16) + 32 + 20 + 3 * 12) + points * 160;
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
    if (!surface.instrument)
      for (const Vec3& p : surface.rest.empty() ? surface.mesh.points : surface.rest)
        box.add(p);
  return box;
}

} // namespace gewebe::shading
