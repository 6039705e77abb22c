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

tetrahedra::TetMesh mesh_of(std::string_view bytes) {
  formats::Kind kind = formats::kind_from_magic(bytes.substr(0, 4096));
  if (kind == formats::Kind::unknown && bytes.starts_with('*')) // no other format begins so
    kind = formats::Kind::inp;
  constexpr std::string_view border = "# ele\n";
  const std::size_t at = bytes.find(border);
  if (kind != formats::Kind::unknown || at == std::string_view::npos)
    return formats::tet_mesh_from_bytes(bytes, "fuzz", kind);
  return formats::tet_mesh_from_tetgen(
      {std::string(bytes.substr(0, at)), std::string(bytes.substr(at + border.size()))},
      {"fuzz.node", "fuzz.ele"});
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    tetrahedra::TetMesh mesh = mesh_of({reinterpret_cast<const char*>(data), size});
    tetrahedra::check_mesh(mesh);
    for (const formats::Kind kind :
         {formats::Kind::ply, formats::Kind::vtu, formats::Kind::msh, formats::Kind::msh4,
          formats::Kind::medit, formats::Kind::vtk, formats::Kind::inp}) {
      const std::string bytes = formats::tet_mesh_bytes(mesh, kind);
      if (formats::tet_mesh_bytes(formats::tet_mesh_from_bytes(bytes, "again", kind), kind) !=
          bytes)
        std::abort();
    }
    (void)tetrahedra::tet_quality(mesh);
    (void)tetrahedra::repair_tetrahedra(mesh);
    const tetrahedra::TetReport report = tetrahedra::examine_tetrahedra(mesh);
    if (report.inverted.count + report.duplicates.count + report.unused_points.count != 0)
      std::abort();
    if (mesh.middles.empty())
      tetrahedra::make_quadratic(mesh);
    (void)tetrahedra::order_nodes(mesh);
    tetrahedra::check_mesh(mesh);
  } catch (const Error&) { // what bad input is for
  }
  return 0;
}
