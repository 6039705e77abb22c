#include "formats/tetrahedra/tet_file_internal.h"
// Based on: VTK file formats, docs.vtk.org, "XML file formats".

namespace gewebe::formats::tet {
namespace {

/// The arrays that follow, with where each begins.
class Appended {
public:
  explicit Appended(Pieces& out) : out_(out) {}

  void declare(const char* type, const char* name, std::uint64_t bytes,
               const char* components = "") {
    out_ << "<DataArray type=\"" << type << "\" Name=\"" << name << "\"" << components
         << " format=\"appended\" offset=\"" << offset_ << "\"/>\n";
    offset_ += sizeof(std::uint64_t) + bytes;
  }

private:
  Pieces& out_;
  std::uint64_t offset_ = 0;
};

/// Puts an integer of 4 bytes if `narrow`, else 8.
void put(Pieces& out, bool narrow, std::uint64_t number) {
  if (narrow)
    out.put(static_cast<std::int32_t>(number));
  else
    out.put(static_cast<std::int64_t>(number));
}

} // namespace

void write_vtu(const tetrahedra::TetMesh& mesh, const Sink& sink) {
  const std::uint64_t points = mesh.points.size(), cells = mesh.tetrahedra.size(),
                      nodes = mesh.middles.empty() ? 4 : 10;
  const bool narrow = points <= INT32_MAX && cells * nodes <= INT32_MAX;
  const char* const integer = narrow ? "Int32" : "Int64";
  const std::uint64_t size = narrow ? 4 : 8;
  Pieces out(sink);
  Appended arrays(out);
  out << "<?xml version=\"1.0\"?>\n<!-- gewebe_tetmesh, millimetres -->\n"
         "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
         "header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\""
      << points << "\" NumberOfCells=\"" << cells << "\">\n<Points>\n";
  arrays.declare("Float64", "Points", 24 * points, " NumberOfComponents=\"3\"");
  out << "</Points>\n<Cells>\n";
  arrays.declare(integer, "connectivity", size * nodes * cells);
  arrays.declare(integer, "offsets", size * cells);
  arrays.declare("UInt8", "types", cells);
  out << "</Cells>\n";
  if (!mesh.material.empty()) {
    out << "<CellData Scalars=\"material\">\n";
    arrays.declare("Int32", "material", 4 * cells);
    out << "</CellData>\n";
  }
  out << "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
  out.put(24 * points);
  for (const Vec3& p : mesh.points)
    out.put(p);
  out.put(size * nodes * cells);
  for (std::size_t t = 0; t < cells; ++t) {
    const TetNodes of_cell(mesh, t);
    for (const std::uint32_t node : of_cell.in_order())
      put(out, narrow, node);
  }
  out.put(size * cells);
  for (std::uint64_t t = 1; t <= cells; ++t)
    put(out, narrow, nodes * t);
  out.put(cells);
  for (std::uint64_t t = 0; t < cells; ++t)
    out.put(static_cast<std::uint8_t>(mesh.middles.empty() ? 10 : 24));
  if (!mesh.material.empty()) {
    out.put(4 * cells);
    for (const std::int32_t material : mesh.material)
      out.put(material);
  }
  out << "\n</AppendedData>\n</VTKFile>\n";
  out.flush();
}

} // namespace gewebe::formats::tet
