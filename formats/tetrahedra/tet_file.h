#pragma once
// Tetrahedral meshes from and to any format we know, in millimetres; gewebe_tetmesh(5).

#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "tetrahedra/tet_mesh.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

/// ply, vtu, msh, medit, tetgen, vtk, inp.
const std::vector<Kind>& readable_tet_kinds();
/// ply, vtu, msh (2.2 in text), msh4 (4.1, binary), medit, tetgen, vtk (legacy, binary), inp.
const std::vector<Kind>& writable_tet_kinds();

/// Whether an input of this kind, whose first bytes (up to 4096) are `peeked`, is a tetrahedral
/// mesh: all kinds above are, of PLY those whose header names the element `tetrahedron`, of legacy
/// VTK unstructured grids.
bool holds_tetrahedra(std::string_view peeked, Kind kind);

struct TetReadOptions {
  Kind kind = Kind::unknown;             ///< of input_kind()
  double scale = 1;                      ///< millimetres per unit of the coordinates
  bool drop_unused = false;              ///< remove points that no tetrahedron uses
  std::uint64_t max_memory = UINT64_MAX; ///< a larger input is refused
};

struct TetReadStats {
  std::uint64_t skipped_elements = 0;   ///< points, lines, triangles, quadrangles; PLY: elements
  std::uint64_t skipped_properties = 0; ///< PLY: of vertex and tetrahedron
  std::uint64_t dropped_points = 0;     ///< by drop_unused
};

/// The mesh of `input`, linear or quadratic, tetrahedra, corners and points in their order there,
/// coordinates to the last bit (except `scale`). Materials are those of gewebe_tetmesh(5); of
/// formats that give each tetrahedron one in any case, none if all are 0. Nothing is mended: see
/// tetrahedra/check.h. Of TetGen's two files either may be the input, the other is found beside it.
/// \throw Error with place: anything missing, surplus, out of range, not finite; counts that the
/// file can't hold; hexahedra, prisms, pyramids and elements of third order, by name; tetrahedra of
/// both orders; a kind that is not readable
tetrahedra::TetMesh read_tet_mesh(Input& input, const TetReadOptions& options,
                                  TetReadStats* stats = nullptr);

/// Writes the mesh, given in mm, as `kind`; the caller commits. Reading it gives the same mesh bit
/// for bit, except a material that is 0 everywhere, for which Medit has no other word than none,
/// and coordinates of more than 20 characters in inp, which are rounded to 20. TetGen's other file
/// goes beside the output's, with the options `beside`, and is committed here once both are whole,
/// so that only a rename that fails leaves one without the other. \pre check_mesh(mesh) passes
/// \throw Error with place: TetGen on a pipe, too many points for the format; UsageError if the
/// kind is not writable
void write_tet_mesh(Output& output, const tetrahedra::TetMesh& mesh, Kind kind,
                    const Output::Options& beside = {});

/// The same from and to memory, except TetGen. \throw Error, place `name` or `name:LINE`
tetrahedra::TetMesh tet_mesh_from_bytes(std::string_view bytes, const std::string& name, Kind kind,
                                        TetReadStats* stats = nullptr);
std::string tet_mesh_bytes(const tetrahedra::TetMesh& mesh, Kind kind);

/// TetGen's two files from and to memory.
struct TetgenFiles {
  std::string node, ele;
};
tetrahedra::TetMesh tet_mesh_from_tetgen(const TetgenFiles& bytes, const TetgenFiles& names);
TetgenFiles tetgen_bytes(const tetrahedra::TetMesh& mesh);

} // namespace gewebe::formats
