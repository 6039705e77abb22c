#include "tools/render/solid_surface.h"

#include "base/error.h"
#include "formats/mesh/mesh_file.h"
#include "formats/tetrahedra/tet_file.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/clip.h"

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::cli {
namespace {

double area(const TriangleMesh& mesh, std::span<const Triangle> triangles) {
  double sum = 0;
  for (const auto& [a, b, c] : triangles)
    sum += norm(cross(mesh.points[b] - mesh.points[a], mesh.points[c] - mesh.points[a])) / 2;
  return sum;
}

/// Gives the triangles of the cut points of their own, in place of those that others use too.
void part_cut(tetrahedra::TetClip& clip) {
  TriangleMesh& mesh = clip.mesh;
  std::vector<std::uint32_t> own(mesh.points.size());
  std::iota(own.begin(), own.end(), 0U);
  for (const Triangle& triangle : std::span(mesh.triangles).first(clip.cut_begin))
    for (const std::uint32_t corner : triangle)
      own[corner] = UINT32_MAX;
  for (Triangle& triangle : std::span(mesh.triangles).subspan(clip.cut_begin))
    for (std::uint32_t& corner : triangle) {
      std::uint32_t& number = own[corner];
      if (number == UINT32_MAX) {
        number = static_cast<std::uint32_t>(mesh.points.size());
        mesh.points.push_back(mesh.points[corner]);
        clip.origin.push_back(clip.origin[corner]);
      }
      corner = number;
    }
  mesh.part.assign(clip.cut_begin, 0);
  mesh.part.resize(mesh.triangles.size(), 1);
}

} // namespace

void examine_solid(const tetrahedra::TetMesh& mesh, SolidReport& report) {
  const tetrahedra::TetReport found = tetrahedra::examine_tetrahedra(mesh);
  tetrahedra::require_sound(found);
  report.tetrahedra += found.tetrahedra;
  report.curved_edges += found.curved_edges.count;
}

tetrahedra::TetClip cut_open(const tetrahedra::TetMesh& mesh, const tetrahedra::ClipPlane& plane,
                             SolidReport& report) {
  tetrahedra::TetClip left = tetrahedra::clip_tetrahedra(mesh, plane);
  const auto cut = std::span(left.mesh.triangles).subspan(left.cut_begin);
  report.tetrahedra_cut += left.tetrahedra_cut;
  report.tetrahedra_removed += left.tetrahedra_removed;
  report.cut_triangles += cut.size();
  report.cut_area += area(left.mesh, cut);
  part_cut(left);
  return left;
}

TriangleMesh open_mesh(const tetrahedra::TetMesh& mesh, const tetrahedra::ClipPlane& plane,
                       SolidReport& report) {
  tetrahedra::TetClip left = cut_open(mesh, plane, report);
  if (left.mesh.triangles.empty())
    throw Error(takes_all_away);
  return std::move(left.mesh);
}

shading::Surface read_solid(formats::Input& input, const SurfaceReadOptions& options,
                            SolidReport& report, const Context& context) {
  report = {};
  formats::TetReadOptions reading;
  reading.kind = options.kind;
  reading.max_memory = context.max_memory;
  if (!options.unit.empty())
    reading.scale = formats::millimetres_per(options.unit);
  const tetrahedra::TetMesh mesh = formats::read_tet_mesh(input, reading);
  return at(input.name(), [&] {
    examine_solid(mesh, report);
    shading::Surface surface;
    surface.mesh =
        options.clip ? open_mesh(mesh, *options.clip, report) : tetrahedra::boundary(mesh).mesh;
    return surface;
  });
}

void tell_solid(Run& run, const std::string& name, const SurfaceReadOptions& options,
                const SolidReport& report) {
  if (report.tetrahedra == 0)
    return;
  run.stats().set("tetrahedra", report.tetrahedra);
  if (report.curved_edges > 0)
    run.warn(name + ": " + std::to_string(report.curved_edges) +
             " curved edges are drawn straight");
  if (!options.clip)
    return;
  run.stats().set("tetrahedra_cut", report.tetrahedra_cut);
  run.stats().set("tetrahedra_removed", report.tetrahedra_removed);
  run.stats().set("cut_triangles", report.cut_triangles);
  run.stats().set("cut_area", report.cut_area);
  if (report.tetrahedra_cut + report.tetrahedra_removed == 0)
    run.warn(name + ": --clip takes nothing away");
}

} // namespace gewebe::cli
