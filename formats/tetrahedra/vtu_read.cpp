#include "formats/mesh/vtk_xml.h"
#include "formats/tetrahedra/tet_file_internal.h"

#include <algorithm>
// Based on: VTK file formats, docs.vtk.org, "XML file formats"; types of cells: vtkCellType.h.

namespace gewebe::formats::tet {
namespace {

constexpr int linear = vtk_linear, quadratic = vtk_quadratic;

class VtuReader {
public:
  VtuReader(std::string_view bytes, const std::string& name, TetReadStats& stats)
      : name_(name), stats_(stats),
        piece_(bytes, name, "UnstructuredGrid", {"Points", "Cells", "CellData"}) {}

  tetrahedra::TetMesh read() {
    result_.mesh.points = piece_.points();
    read_cells();
    return std::move(result_.mesh);
  }

private:
  /// By our name, or those that meshio gives to Gmsh's and Medit's.
  const vtk::Array* material() const {
    for (const char* const name : {"material", "gmsh:physical", "medit:ref"})
      if (const vtk::Array* const array = piece_.find(std::string("CellData/") + name)) {
        if (array->components != 1)
          throw Error(piece_.place(*array), "materials of " + std::to_string(array->components) +
                                                " components, expected 1");
        return array;
      }
    return nullptr;
  }

  void read_cells() {
    const std::uint64_t count = piece_.count("NumberOfCells");
    const vtk::Array& types_array = piece_.need("Cells/types");
    const std::vector<std::int64_t> types = piece_.integers(types_array, count);
    const vtk::Cells cells = piece_.cells("Cells", count);
    const vtk::Array* const material_array = material();
    std::vector<std::int64_t> materials;
    if (material_array != nullptr)
      materials = piece_.integers(*material_array, count);
    for (std::size_t c = 0; c < count; ++c) {
      if (is_lower_cell(types[c])) {
        ++stats_.skipped_elements;
        continue;
      }
      if (types[c] != linear && types[c] != quadratic)
        throw Error(piece_.place(types_array),
                    refused_cell_name(types[c]) + ", expected tetrahedra of 4 or 10 nodes");
      add(c, cells[c], types[c], materials.empty() ? 0 : materials[c]);
    }
    if (material_array == nullptr)
      result_.mesh.material = {};
  }

  void add(std::size_t cell, std::span<const std::int64_t> nodes, std::int64_t type,
           std::int64_t material) {
    const auto fail = [&](const std::string& what) {
      throw Error(name_, "cell " + std::to_string(cell) + ": " + what);
    };
    const std::size_t size = type == linear ? 4 : 10;
    if (nodes.size() != size)
      fail(std::to_string(nodes.size()) + " nodes, expected " + std::to_string(size));
    std::array<std::uint32_t, 10> numbers{};
    for (std::size_t k = 0; k < size; ++k)
      numbers[k] = vtk::node_number(nodes[k], result_.mesh.points.size(), fail);
    result_.add(std::span(numbers).first(size), material, fail);
  }

  const std::string& name_;
  TetReadStats& stats_;
  vtk::Piece piece_;
  Tetrahedra result_;
};

} // namespace

bool is_lower_cell(std::int64_t type) {
  constexpr std::array<std::int64_t, 18> types{0, 1,  2,  3,  4,  5,  6,  7,  8,
                                               9, 21, 22, 23, 28, 30, 34, 35, 36};
  return std::ranges::find(types, type) != types.end();
}

std::string refused_cell_name(std::int64_t type) {
  switch (type) {
  case 11:
    return "voxels";
  case 12:
  case 25:
  case 29:
  case 33:
  case 72:
  case 79:
    return "hexahedra";
  case 13:
  case 26:
  case 31:
  case 32:
  case 73:
  case 80:
    return "wedges";
  case 14:
  case 27:
  case 37:
  case 74:
  case 81:
    return "pyramids";
  case 42:
    return "polyhedra";
  case 71:
  case 78:
    return "tetrahedra of any order";
  default:
    return "cells of type " + std::to_string(type);
  }
}

tetrahedra::TetMesh read_vtu(std::string_view bytes, const std::string& name, TetReadStats& stats) {
  return VtuReader(bytes, name, stats).read();
}

} // namespace gewebe::formats::tet
