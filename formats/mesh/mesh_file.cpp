#include "formats/mesh/mesh_file.h"

#include "base/error.h"
#include "formats/mesh/assimp_child.h"
#include "formats/mesh/obj_stl.h"
#include "formats/mesh/ply.h"
#include "formats/mesh/vtk_legacy.h"
#include "formats/mesh/vtp.h"

#include <algorithm>
#include <utility>

namespace gewebe::formats {
namespace {

/// Millimetres that the file says its numbers are in; the readers of these formats have scaled by
/// them. 1 for formats that state no unit.
double stated_unit(Kind kind, std::string_view bytes) {
  if (kind == Kind::gltf || kind == Kind::glb)
    return 1000; // metres, by the specification
  return kind == Kind::dae ? 1000 * collada_metres(bytes) : 1;
}

bool has_tetrahedra(Kind kind) {
  return kind == Kind::vtu || kind == Kind::msh || kind == Kind::medit || kind == Kind::tetgen ||
         kind == Kind::inp;
}

std::string list(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : ", ") + word;
  return text;
}

bool contains(const std::vector<Kind>& kinds, Kind kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

void check_readable(const Input& input, const MeshReadOptions& options) {
  if (!contains(readable_mesh_kinds(), options.kind))
    throw Error(input.name(), (options.kind == Kind::unknown
                                   ? std::string("the format is not known")
                                   : std::string(kind_name(options.kind)) +
                                         (has_tetrahedra(options.kind) ? " is a tetrahedral mesh"
                                                                       : " is no mesh")) +
                                  ", expected one of " + kind_list(readable_mesh_kinds()) +
                                  " by content, suffix or --format");
  if (!options.unit.empty())
    millimetres_per(options.unit);
}

// Where side files lie; "" for a pipe.
std::string folder_of(const std::string& name) {
  if (name.empty() || name == "-")
    return "";
  const std::size_t slash = name.rfind('/');
  if (slash == std::string::npos)
    return ".";
  return slash == 0 ? "/" : name.substr(0, slash);
}

TriangleMesh read_unwelded(const std::string& bytes, const Input& input,
                           const MeshReadOptions& options, MeshReadStats& stats) {
  if (options.kind == Kind::ply) {
    PlyStats counts;
    TriangleMesh mesh = read_ply(bytes, input.name(), &counts);
    stats.polygons = counts.polygons;
    stats.skipped_elements = counts.skipped_elements;
    stats.skipped_properties = counts.skipped_properties;
    return mesh;
  }
  if (options.kind == Kind::vtp || options.kind == Kind::vtk) {
    VtpStats counts;
    TriangleMesh mesh = options.kind == Kind::vtp ? read_vtp(bytes, input.name(), &counts)
                                                  : read_vtk_surface(bytes, input.name(), &counts);
    if (mesh.triangles.empty())
      throw Error("no polygon, expected one");
    stats.polygons = counts.polygons;
    stats.skipped_primitives = counts.skipped_primitives;
    return mesh;
  }
  AssimpSource source;
  source.bytes = bytes;
  source.kind = options.kind;
  source.folder = folder_of(input.name());
  AssimpStats counts;
  TriangleMesh mesh = read_by_assimp(source, &counts);
  stats.polygons = counts.polygons;
  stats.skipped_primitives = counts.skipped_primitives;
  stats.part_names = std::move(counts.part_names);
  return mesh;
}

std::uint64_t count_parts(const TriangleMesh& mesh) {
  if (mesh.triangles.empty())
    return 0;
  if (mesh.part.empty())
    return 1;
  std::vector<std::int32_t> parts = mesh.part;
  std::sort(parts.begin(), parts.end());
  return static_cast<std::uint64_t>(std::unique(parts.begin(), parts.end()) - parts.begin());
}

} // namespace

const std::vector<Kind>& readable_mesh_kinds() {
  static const std::vector<Kind> kinds{Kind::ply, Kind::obj,  Kind::stl, Kind::off,
                                       Kind::dxf, Kind::gltf, Kind::glb, Kind::three_ds,
                                       Kind::dae, Kind::vtp,  Kind::vtk};
  return kinds;
}

const std::vector<Kind>& writable_mesh_kinds() {
  static const std::vector<Kind> kinds{Kind::ply, Kind::obj,      Kind::stl,
                                       Kind::glb, Kind::three_ds, Kind::dae};
  return kinds;
}

const std::vector<std::string>& mesh_unit_names() {
  static const std::vector<std::string> names{"m", "cm", "mm"};
  return names;
}

double millimetres_per(std::string_view unit) {
  if (unit == "m")
    return 1000;
  if (unit == "cm")
    return 10;
  if (unit == "mm")
    return 1;
  throw UsageError("unit " + std::string(unit) + ", expected one of " + list(mesh_unit_names()));
}

void scale_points(std::vector<Vec3>& points, double scale) {
  if (scale == 1)
    return;
  for (std::size_t p = 0; p < points.size(); ++p) {
    points[p] *= scale;
    if (!is_finite(points[p]))
      throw Error("point " + std::to_string(p) + " is not finite in mm, expected less");
  }
}

const std::vector<std::string>& weld_names() {
  static const std::vector<std::string> names{"auto", "all", "part", "none"};
  return names;
}

std::optional<repair::Weld> weld_from_name(std::string_view word) {
  if (word.empty() || word == "auto")
    return std::nullopt;
  if (word == "all")
    return repair::Weld::all;
  if (word == "part")
    return repair::Weld::part;
  if (word == "none")
    return repair::Weld::none;
  throw UsageError("welding " + std::string(word) + ", expected one of " + list(weld_names()));
}

TriangleMesh read_mesh(Input& input, const MeshReadOptions& options, MeshReadStats* stats) {
  check_readable(input, options);
  return gewebe::at(input.name(), [&] {
    MeshReadStats counts;
    const std::string bytes = input.read_all(options.max_memory);
    TriangleMesh mesh = read_unwelded(bytes, input, options, counts);
    if (!options.unit.empty())
      scale_points(mesh.points, millimetres_per(options.unit) / stated_unit(options.kind, bytes));
    repair::WeldOptions welding;
    welding.mode = options.weld.value_or(options.kind == Kind::ply ? repair::Weld::none
                                                                   : repair::Weld::borders);
    welding.drop_unused = options.drop_unused;
    counts.weld = repair::weld(mesh, welding);
    counts.parts = count_parts(mesh);
    if (stats != nullptr)
      *stats = std::move(counts);
    return mesh;
  });
}

void write_mesh(Output& output, const TriangleMesh& mesh, Kind kind) {
  if (!contains(writable_mesh_kinds(), kind))
    throw UsageError(output.name(), std::string(kind_name(kind)) +
                                        " is not written, expected one of " +
                                        kind_list(writable_mesh_kinds()));
  const auto sink = [&](std::string_view piece) { output.write(piece); };
  gewebe::at(output.name(), [&] {
    if (kind == Kind::ply)
      write_ply(mesh, sink);
    else if (kind == Kind::obj)
      write_obj(mesh, sink);
    else if (kind == Kind::stl)
      write_stl(mesh, sink);
    else
      sink(write_by_assimp(mesh, kind));
  });
}

} // namespace gewebe::formats
