#pragma once
// The kinds of data that travel between programs, and how they are detected.

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

enum class Kind {
  unknown,
  particles,
  vdb,
  ply,
  ela,
  hdf5,
  nifti,
  obj,
  stl,
  off,
  dxf,
  gltf,
  glb,
  three_ds,
  dae,
  vtu,    ///< VTK's unstructured grids
  vtp,    ///< VTK's surfaces
  msh,    ///< Gmsh, 2.2 where written
  msh4,   ///< Gmsh 4.1, for outputs; inputs are msh
  medit,  ///< .mesh
  tetgen, ///< .node and .ele
  png,
  ppm,
  rgb,
  csv,
  vtkhdf, ///< VTK's unstructured grids over time, in HDF5
  html,   ///< a page with its viewer
  nrrd,
  mha,
  vtk, ///< VTK's legacy files
  inp, ///< Abaqus
  feb, ///< FEBio
  mp4,
  webm,
  svg,
  ascii, ///< a drawing of letters
};

/// The name of `--format` and `--to`: "vdb", "3ds", …
std::string_view kind_name(Kind kind);
/// "ply, vtu", for messages.
std::string kind_list(const std::vector<Kind>& kinds);
/// The kind of that name ("mesh" is ply; the suffix .mesh is medit), or unknown.
Kind kind_from_name(std::string_view name);
/// The kind that a file name's suffix stands for, or unknown. Case does not matter.
Kind kind_from_suffix(std::string_view path);
/// The kind that the first bytes prove (PLY, VDB, HDF5, NIfTI, GLB, PNG, VTK, VTU, VTP, Gmsh;
/// `ela_expl` and Medit's word after blank lines and comments), or unknown.
Kind kind_from_magic(std::string_view first_bytes);
/// Magic, else the name given by --format (may be empty), else the suffix. `peeked` are the first
/// 4096 bytes. \throw UsageError if `format` names no kind
Kind input_kind(std::string_view peeked, std::string_view path, std::string_view format);
/// --to (wins), else the suffix of `path`, else `fallback`.
/// \throw UsageError if the kind is not among `writable`: "cannot write KIND, expected one of …"
Kind output_kind(std::string_view to, std::string_view path, Kind fallback,
                 const std::vector<Kind>& writable);
bool is_binary(Kind kind);

} // namespace gewebe::formats
