// Any bytes are a surface of VTK, in XML or legacy, or an Error, and a surface survives being
// written as PLY.
#include "base/error.h"
#include "formats/mesh/ply.h"
#include "formats/mesh/vtk_legacy.h"
#include "formats/mesh/vtp.h"

#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gewebe;
  try {
    const std::string_view input(reinterpret_cast<const char*>(data), size);
    const TriangleMesh mesh = input.starts_with("# vtk")
                                  ? formats::read_vtk_surface(input, "fuzz", nullptr)
                                  : formats::read_vtp(input, "fuzz");
    check_mesh(mesh);
    const std::string bytes = formats::write_ply(mesh);
    if (formats::write_ply(formats::read_ply(bytes, "again")) != bytes)
      std::abort();
  } catch (const Error&) {
  }
  return 0;
}
