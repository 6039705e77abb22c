#include "formats/tetrahedra/tet_file.h"

#include "formats/mesh/mesh_file.h"
#include "formats/mesh/vtk_legacy.h"
#include "formats/tetrahedra/tet_file_internal.h"
#include "tetrahedra/check.h"

#include <algorithm>
#include <cctype>

namespace gewebe::formats {
namespace tet {

tetrahedra::TetMesh Tetrahedra::take_unless_zero() {
  if (std::ranges::all_of(mesh.material, [](std::int32_t m) { return m == 0; }))
    mesh.material = {};
  return std::move(mesh);
}

} // namespace tet

namespace {

bool contains(const std::vector<Kind>& kinds, Kind kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

/// The names of TetGen's two files by that of one.
TetgenFiles tetgen_names(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  std::string suffix = dot == std::string::npos ? "" : name.substr(dot);
  std::ranges::transform(suffix, suffix.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (suffix != ".node" && suffix != ".ele")
    throw Error(name, "TetGen's mesh is two files, expected the name of one, which ends in .node "
                      "or .ele");
  TetgenFiles names{name, name};
  if (suffix == ".node")
    names.ele = name.substr(0, dot) + ".ele";
  else
    names.node = name.substr(0, dot) + ".node";
  return names;
}

tetrahedra::TetMesh read_tetgen(Input& input, std::uint64_t max_memory) {
  const TetgenFiles names = tetgen_names(input.name());
  Input beside(names.node == input.name() ? names.ele : names.node, false);
  TetgenFiles bytes{input.read_all(max_memory), beside.read_all(max_memory)};
  if (names.node != input.name())
    std::swap(bytes.node, bytes.ele);
  return tet_mesh_from_tetgen(bytes, names);
}

void write_tetgen(Output& output, const tetrahedra::TetMesh& mesh, const Output::Options& options) {
  const TetgenFiles names = tetgen_names(output.name());
  const bool nodes = names.node == output.name();
  Output::Options of_beside = options;
  of_beside.beside = true;
  Output beside(nodes ? names.ele : names.node, of_beside);
  const auto to = [](Output& file) {
    return [&file](std::string_view piece) { file.write(piece); };
  };
  tet::write_node(mesh, nodes ? to(output) : to(beside));
  tet::write_ele(mesh, nodes ? to(beside) : to(output));
  // Both are whole before either has its name.
  beside.prepare();
  output.prepare();
  beside.commit();
}

void write_to(const tetrahedra::TetMesh& mesh, Kind kind, const Sink& sink) {
  if (kind == Kind::ply)
    tet::write_ply(mesh, sink);
  else if (kind == Kind::vtu)
    tet::write_vtu(mesh, sink);
  else if (kind == Kind::msh)
    tet::write_msh2(mesh, sink);
  else if (kind == Kind::msh4)
    tet::write_msh4(mesh, sink);
  else if (kind == Kind::medit)
    tet::write_medit(mesh, sink);
  else if (kind == Kind::vtk)
    tet::write_vtk(mesh, sink);
  else if (kind == Kind::inp)
    tet::write_inp(mesh, sink);
  else
    throw UsageError(std::string(kind_name(kind)) + " is not written, expected one of " +
                     kind_list(writable_tet_kinds()));
}

} // namespace

const std::vector<Kind>& readable_tet_kinds() {
  static const std::vector<Kind> kinds{Kind::ply,    Kind::vtu, Kind::msh, Kind::medit,
                                       Kind::tetgen, Kind::vtk, Kind::inp};
  return kinds;
}

const std::vector<Kind>& writable_tet_kinds() {
  static const std::vector<Kind> kinds{Kind::ply,   Kind::vtu,    Kind::msh, Kind::msh4,
                                       Kind::medit, Kind::tetgen, Kind::vtk, Kind::inp};
  return kinds;
}

bool holds_tetrahedra(std::string_view peeked, Kind kind) {
  if (kind == Kind::vtk)
    return vtk::is_legacy_grid(peeked);
  if (kind != Kind::ply)
    return kind == Kind::msh4 || contains(readable_tet_kinds(), kind);
  const std::string_view header = peeked.substr(0, peeked.find("\nend_header"));
  return header.find("\nelement tetrahedron ") != std::string_view::npos;
}

tetrahedra::TetMesh tet_mesh_from_bytes(std::string_view bytes, const std::string& name, Kind kind,
                                        TetReadStats* stats) {
  TetReadStats unused;
  TetReadStats& counts = stats == nullptr ? unused : *stats;
  return gewebe::at(name, [&] {
    tetrahedra::TetMesh mesh;
    if (kind == Kind::ply)
      mesh = tet::read_ply(bytes, name, counts);
    else if (kind == Kind::vtu)
      mesh = tet::read_vtu(bytes, name, counts);
    else if (kind == Kind::msh || kind == Kind::msh4)
      mesh = tet::read_msh(bytes, name, counts);
    else if (kind == Kind::medit)
      mesh = tet::read_medit(bytes, name, counts);
    else if (kind == Kind::vtk)
      mesh = tet::read_vtk(bytes, name, counts);
    else if (kind == Kind::inp)
      mesh = tet::read_inp(bytes, name, counts);
    else
      throw Error((kind == Kind::unknown ? std::string("the format is not known")
                                         : std::string(kind_name(kind)) + " has no tetrahedra") +
                  ", expected one of " + kind_list(readable_tet_kinds()) +
                  " by content, suffix or --format");
    tetrahedra::check_mesh(mesh);
    return mesh;
  });
}

tetrahedra::TetMesh read_tet_mesh(Input& input, const TetReadOptions& options,
                                  TetReadStats* stats) {
  TetReadStats counts;
  tetrahedra::TetMesh mesh;
  if (options.kind == Kind::tetgen)
    mesh = read_tetgen(input, options.max_memory);
  else
    mesh = tet_mesh_from_bytes(input.read_all(options.max_memory), input.name(), options.kind,
                               &counts);
  gewebe::at(input.name(), [&] { scale_points(mesh.points, options.scale); });
  if (options.drop_unused)
    counts.dropped_points = tetrahedra::drop_unused_points(mesh);
  if (stats != nullptr)
    *stats = counts;
  return mesh;
}

std::string tet_mesh_bytes(const tetrahedra::TetMesh& mesh, Kind kind) {
  std::string bytes;
  write_to(mesh, kind, [&](std::string_view piece) { bytes += piece; });
  return bytes;
}

void write_tet_mesh(Output& output, const tetrahedra::TetMesh& mesh, Kind kind,
                    const Output::Options& beside) {
  gewebe::at(output.name(), [&] {
    if (kind == Kind::tetgen)
      write_tetgen(output, mesh, beside);
    else
      write_to(mesh, kind, [&](std::string_view piece) { output.write(piece); });
  });
}

} // namespace gewebe::formats
