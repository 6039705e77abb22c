#include "formats/mesh/vtk_legacy.h"
#include "formats/mesh/vtk_xml.h"
#include "formats/tetrahedra/tet_file_internal.h"

#include <algorithm>
// Based on: VTK file formats, docs.vtk.org, "Simple legacy formats".

namespace gewebe::formats::tet {
namespace {

/// Puts a number as big-endian bytes.
template <class T>
void put_turned(Pieces& out, T value) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  std::ranges::reverse(bytes);
  out << std::string_view(bytes.data(), bytes.size());
}

void put_integer(Pieces& out, std::uint64_t value) {
  put_turned(out, static_cast<std::int32_t>(value));
}

} // namespace

tetrahedra::TetMesh read_vtk(std::string_view bytes, const std::string& name, TetReadStats& stats) {
  vtk::Legacy legacy = vtk::read_legacy(bytes, name);
  if (!legacy.grid)
    throw Error(name, "PolyData, expected an unstructured grid of tetrahedra");
  Tetrahedra result;
  result.mesh.points = std::move(legacy.points);
  for (std::size_t c = 0; c < legacy.cells.size(); ++c) {
    const auto fail = [&](const std::string& what) {
      throw Error(name, "cell " + std::to_string(c) + ": " + what);
    };
    const std::int64_t type = legacy.types[c];
    if (is_lower_cell(type)) {
      ++stats.skipped_elements;
      continue;
    }
    if (type != vtk_linear && type != vtk_quadratic)
      fail(refused_cell_name(type) + ", expected tetrahedra of 4 or 10 nodes");
    const auto nodes = legacy.cells[c];
    const std::size_t size = type == vtk_linear ? 4 : 10;
    if (nodes.size() != size)
      fail(std::to_string(nodes.size()) + " nodes, expected " + std::to_string(size));
    std::array<std::uint32_t, 10> numbers{};
    for (std::size_t k = 0; k < size; ++k)
      numbers[k] = vtk::node_number(nodes[k], result.mesh.points.size(), fail);
    result.add(std::span(numbers).first(size), legacy.material.empty() ? 0 : legacy.material[c],
               fail);
  }
  if (legacy.material.empty())
    result.mesh.material = {};
  return std::move(result.mesh);
}

void write_vtk(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  const std::uint64_t points = mesh.points.size(), cells = mesh.tetrahedra.size(),
                      nodes = mesh.middles.empty() ? 4 : 10;
  if (points > INT32_MAX || cells * (nodes + 1) > INT32_MAX)
    throw Error("more points or cells than legacy files of VTK number, expected vtu");
  Pieces out(sink);
  out << "# vtk DataFile Version 3.0\ngewebe_tetmesh, millimetres\nBINARY\n"
         "DATASET UNSTRUCTURED_GRID\nPOINTS "
      << points << " double\n";
  for (const Vec3& p : mesh.points)
    for (int axis = 0; axis < 3; ++axis)
      put_turned(out, p[axis]);
  out << "\nCELLS " << cells << " " << cells * (nodes + 1) << "\n";
  for (std::size_t t = 0; t < cells; ++t) {
    put_integer(out, nodes);
    const TetNodes of(mesh, t);
    for (const std::uint32_t node : of.in_order())
      put_integer(out, node);
  }
  out << "\nCELL_TYPES " << cells << "\n";
  for (std::size_t t = 0; t < cells; ++t)
    put_integer(out, nodes == 4 ? vtk_linear : vtk_quadratic);
  out << "\n";
  if (!mesh.material.empty()) {
    out << "CELL_DATA " << cells << "\nSCALARS material int 1\nLOOKUP_TABLE default\n";
    for (const std::int32_t material : mesh.material)
      put_turned(out, material);
    out << "\n";
  }
  out.flush();
}

} // namespace gewebe::formats::tet
