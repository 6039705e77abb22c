// In gewebe-volume.so alone.

#include "antialiasing/distance_ramp.h"
#include "base/error.h"
#include "formats/volume/volume_file.h"
#include "formats/volume/volume_plugin_internal.h"
#include "stuffing/materials.h"
#include "stuffing/stuffing.h"
#include "volume/csg.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace gewebe;

namespace {

/// The triangles of one part, or of all parts but some.
TriangleMesh triangles_of(const TriangleMesh& mesh, const std::vector<std::int32_t>& parts,
                          bool among) {
  TriangleMesh some;
  std::vector<std::uint32_t> number(mesh.points.size(), UINT32_MAX);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::int32_t part = mesh.part.empty() ? 0 : mesh.part[t];
    if ((std::ranges::find(parts, part) != parts.end()) != among)
      continue;
    Triangle& triangle = some.triangles.emplace_back(mesh.triangles[t]);
    for (std::uint32_t& corner : triangle) {
      if (number[corner] == UINT32_MAX) {
        number[corner] = static_cast<std::uint32_t>(some.points.size());
        some.points.push_back(mesh.points[corner]);
      }
      corner = number[corner];
    }
  }
  return some;
}

/// A body that is filled.
struct Body {
  std::int32_t material = 0;
  double volume = 0;
  volume::Grid density;
  voxelization::VoxelizeReport found;
};

formats::FilledSurface fill(const TriangleMesh& mesh, const formats::SurfaceFilling& filling,
                            const Context& context) {
  std::vector<Body> bodies;
  const auto add = [&](const TriangleMesh& of, std::size_t material) {
    Body body;
    body.material = static_cast<std::int32_t>(material);
    antialiasing::CoverageReport report;
    body.density =
        antialiasing::jones_density(context, of, volume::uniform_transform(filling.voxel),
                                    filling.on_open, &report, filling.rule);
    body.found = report.mesh;
    // The signed volume of a surface with holes or turned faces says nothing.
    body.volume = filling.rule == voxelization::VoxelRule::parity && report.mesh.boundary_edges == 0
                      ? std::abs(signed_volume(of))
                      : report.volume;
    bodies.push_back(std::move(body));
  };
  for (std::size_t p = 0; p < filling.parts.size(); ++p)
    try {
      add(triangles_of(mesh, {filling.parts[p]}, true), p);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      throw Error("part " + std::to_string(filling.parts[p]) + ": " + error.what());
    }
  if (const TriangleMesh rest = triangles_of(mesh, filling.parts, false); !rest.triangles.empty())
    add(rest, filling.parts.size());
  stuffing::StuffingOptions options{
      .isovalue = {}, .cell = filling.cell, .grade = filling.grade, .refine = filling.refine};
  if (filling.parts.empty()) {
    formats::FilledSurface filled{
        stuffing::stuff(context, bodies[0].density, options), {}, {bodies[0].found}};
    filled.volumes.push_back({bodies[0].volume, tetrahedra::volume(filled.mesh)});
    return filled;
  }
  std::vector<std::size_t> by_volume(bodies.size());
  std::iota(by_volume.begin(), by_volume.end(), std::size_t{0});
  std::ranges::stable_sort(by_volume, {}, [&](std::size_t b) { return bodies[b].volume; });
  std::vector<stuffing::MaterialSource> inside;
  std::vector<volume::CsgOperand> operands;
  for (const std::size_t b : by_volume) {
    inside.push_back(stuffing::inside_source(bodies[b].density));
    operands.push_back({bodies[b].density, "a part"});
  }
  options.follow_interface = true;
  // Where the smooth boundary of all goes a little beyond that of each, the largest one is near.
  options.materials = [&]() -> stuffing::MaterialAt {
    std::vector<stuffing::MaterialAt> holds;
    for (const stuffing::MaterialSource& one : inside)
      holds.push_back(one());
    return [&bodies, &by_volume, holds](const Vec3& place) {
      for (std::size_t k = 0; k < holds.size(); ++k)
        if (holds[k](place) != 0)
          return bodies[by_volume[k]].material;
      return bodies[by_volume.back()].material;
    };
  };
  const volume::Grid all =
      operands.size() == 1 ? bodies[0].density
                           : volume::csg(context, volume::CsgOperation::unite, std::move(operands));
  formats::FilledSurface filled{stuffing::stuff(context, all, options), {}, {}};
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    filled.found.push_back(bodies[b].found);
    tetrahedra::TetMesh in = filled.mesh;
    stuffing::set_materials(context, stuffing::inside_source(bodies[b].density), in);
    formats::FilledSurface::Volume& told = filled.volumes.emplace_back();
    told.of_surface = bodies[b].volume;
    for (std::size_t t = 0; t < in.tetrahedra.size(); ++t)
      if (in.material[t] != 0) {
        const Tetrahedron& c = in.tetrahedra[t];
        told.filled += tetrahedra::tetrahedron_volume(in.points[c[0]], in.points[c[1]],
                                                      in.points[c[2]], in.points[c[3]]);
      }
  }
  return filled;
}

} // namespace

const char* const gewebe_volume_version = GEWEBE_VERSION;

void gewebe_view_volume(std::string* bytes, const std::string* name,
                        const shading::VolumeViewOptions* options, const Context* context,
                        shading::VolumeView* view) {
  const volume::Grid grid = formats::volume_from_bytes(*bytes, *name, *context);
  *view = at(*name, [&] { return shading::view_volume(grid, *options, *context); });
}

void gewebe_fill_surface(const TriangleMesh* mesh, const std::string* name,
                         const formats::SurfaceFilling* filling, const Context* context,
                         formats::FilledSurface* filled) {
  *filled = at(*name, [&] { return fill(*mesh, *filling, *context); });
}
