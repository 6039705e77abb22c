// Any bytes as a tetrahedral mesh of any format: an Error, or a mesh that survives being examined,
// mended, written and read. TetGen's two files stand in one, the second behind a line "# ele".

#include "base/error.h"
#include "formats/tetrahedra/tet_file.h"
#include "tetrahedra/check.h"
#include "tetrahedra/order.h"
#include "tetrahedra/quality.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace {

using namespace gewebe;

TetMesh mesh_of(std::string_view bytes) {
  Kind kind = kind_from_magic(bytes.substr(0, 4096));
  if (kind == Kind::unknown && bytes.starts_with('*')) // no other format begins so
    kind = Kind::inp;
  constexpr std::string_view border = "# ele\n";
  const std::size_t at = bytes.find(border);
  if (kind != Kind::unknown || at == std::string_view::npos)
    return tet_mesh_from_bytes(bytes, "fuzz", kind);
  return tet_mesh_from_tetgen(
      {std::string(bytes.substr(0, at)), std::string(bytes.substr(at + border.size()))},
      {"fuzz.node", "fuzz.ele"});
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    TetMesh mesh = mesh_of({reinterpret_cast<const char*>(data), size});
    check_mesh(mesh);
    for (const Kind kind :
         {Kind::ply, Kind::vtu, Kind::msh, Kind::msh4, Kind::medit, Kind::vtk, Kind::inp}) {
      const std::string bytes = tet_mesh_bytes(mesh, kind);
      if (tet_mesh_bytes(tet_mesh_from_bytes(bytes, "again", kind), kind) != bytes)
        std::abort();
    }
    (void)tet_quality(mesh);
    (void)repair_tetrahedra(mesh);
    const TetReport report = examine_tetrahedra(mesh);
    if (report.inverted.count + report.duplicates.count + report.unused_points.count != 0)
      std::abort();
    if (mesh.middles.empty())
      make_quadratic(mesh);
    (void)order_nodes(mesh);
    check_mesh(mesh);
  } catch (const Error&) { // what bad input is for
  }
  return 0;
}
