#pragma once
// Meshes through assimp 5.2: read OBJ, STL, OFF, DXF, glTF 2, GLB, 3DS, Collada; write GLB, 3DS,
// Collada. assimp holds single precision. It runs in a child process with limits on memory and
// time, for broken files crash it; only the importer of the requested kind is registered.

#include "formats/stream/kind.h"
#include "geometry/mesh.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

struct AssimpSource {
  std::string_view bytes;
  Kind kind = Kind::unknown;
  std::string folder; ///< where side files (.mtl, .bin) are looked for; "": nowhere
};

struct AssimpStats {
  std::uint64_t polygons = 0;           ///< faces with more than three corners, cut into triangles
  std::uint64_t skipped_primitives = 0; ///< points, lines and polygons that collapse to them
  std::vector<std::string> part_names;  ///< of each part, "" where it has none; empty: no parts
};

/// The triangles and the points that they use. For OBJ, STL and DXF assimp gives each corner a
/// point of its own; the others keep the file's sharing. Nodes of the scene that hold triangles
/// become parts, in the order of the scene: OBJ objects and groups (equal names are one part), DXF
/// layers, STL solids, glTF, Collada and 3DS nodes. Transforms of nodes are applied, a mirroring
/// one turns the triangles back. Materials are numbered by first use. `part` and `material` are
/// empty where there is only one. The first set of texture coordinates is kept if there is one (0 0
/// where a mesh of the scene has none); normals and colours are dropped. Coordinates are the
/// file's, but in metres for glTF, GLB and Collada; no axes are exchanged, whatever the format
/// calls "up". \throw Error "not readable as OBJ: …, expected …"; also if there is no triangle
TriangleMesh read_by_assimp(const AssimpSource& source, AssimpStats* stats = nullptr);

/// Metres that a Collada file says its unit is: `meter` of <unit> in <asset>, else 1.
double collada_metres(std::string_view bytes);

/// The bytes of the mesh, given in mm, as GLB (metres), 3DS (mm) or Collada (mm, its unit stated),
/// in single precision, without time, host or author. One node for each part, one mesh for each
/// material in it; 3DS meshes are split where they pass 65,535 points. \pre check_mesh(mesh) passes
/// \throw Error if there is no triangle, or a coordinate doesn't fit single precision
std::string write_by_assimp(const TriangleMesh& mesh, Kind kind);

} // namespace gewebe::formats
