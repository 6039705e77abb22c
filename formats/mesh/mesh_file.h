#pragma once
// Meshes from and to any format we know, in millimetres; gewebe_mesh(5).

#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "geometry/mesh.h"
#include "repair/weld.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

/// ply, obj, stl, off, dxf, gltf, glb, 3ds, dae, vtp, vtk.
const std::vector<Kind>& readable_mesh_kinds();
/// ply, obj, stl, glb, 3ds, dae.
const std::vector<Kind>& writable_mesh_kinds();

/// The words of --unit: "m", "cm", "mm"; and the millimetres that each stands for.
const std::vector<std::string>& mesh_unit_names();
/// \throw UsageError if `unit` is none of them
double millimetres_per(std::string_view unit);

/// \throw Error, naming the point, if a coordinate is not finite afterwards
void scale_points(std::vector<Vec3>& points, double scale);

/// The words of --weld: "auto", "all", "part", "none". Nothing for "auto" and "".
/// \throw UsageError if `word` is none of them
std::optional<repair::Weld> weld_from_name(std::string_view word);
const std::vector<std::string>& weld_names();

struct MeshReadOptions {
  Kind kind = Kind::unknown; ///< of input_kind()
  std::string unit;          ///< of the coordinates; "": mm, or what glTF, GLB and Collada state
  std::optional<repair::Weld>
      weld; ///< nothing: Weld::none for PLY, whose indices count; Weld::borders else
  bool drop_unused = false;              ///< remove points that no triangle uses
  std::uint64_t max_memory = UINT64_MAX; ///< a larger input is refused
};

struct MeshReadStats {
  std::uint64_t polygons = 0;           ///< faces with more than three corners, cut into triangles
  std::uint64_t skipped_primitives = 0; ///< points, lines, collapsed polygons
  std::uint64_t skipped_elements = 0;   ///< of a PLY header
  std::uint64_t skipped_properties = 0; ///< of a PLY header
  std::uint64_t parts = 0; ///< different part numbers; 1 if the mesh has none, 0 if it is empty
  /// Names of parts by their numbers, as the file has them (DXF layers, OBJ groups); "": none.
  std::vector<std::string> part_names;
  repair::WeldResult weld;
};

/// The mesh of `input`, converted to mm and welded; triangles with two equal corners are removed.
/// Side files (.mtl, .bin) are looked for in the folder of the input's path, unless it is a pipe. A
/// mesh without triangle comes from PLY alone. \throw Error with place; UsageError if the kind is
/// not readable (naming --format)
TriangleMesh read_mesh(Input& input, const MeshReadOptions& options,
                       MeshReadStats* stats = nullptr);

/// Writes the mesh, given in mm, as `kind`; the caller commits. PLY and OBJ keep every digit, the
/// others single precision; GLB is in metres. \pre check_mesh(mesh) passes \throw Error with place;
/// UsageError if the kind is not writable
void write_mesh(Output& output, const TriangleMesh& mesh, Kind kind);

} // namespace gewebe::formats
