// Any bytes are a surface of VTK or an Error, and a surface survives being written as PLY.
#include "base/error.h"
#include "formats/mesh/ply.h"
#include "formats/mesh/vtp.h"

#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gewebe;
  try {
    const TriangleMesh mesh = read_vtp({reinterpret_cast<const char*>(data), size}, "fuzz");
    check_mesh(mesh);
    const std::string bytes = write_ply(mesh);
    if (write_ply(read_ply(bytes, "again")) != bytes)
      std::abort();
  } catch (const Error&) {
  }
  return 0;
}
