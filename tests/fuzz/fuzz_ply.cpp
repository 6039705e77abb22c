// Any bytes are a mesh or an Error, and a mesh survives being written and read.
#include "base/error.h"
#include "formats/mesh/ply.h"

#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gewebe;
  try {
    const TriangleMesh mesh =
        formats::read_ply({reinterpret_cast<const char*>(data), size}, "fuzz");
    check_mesh(mesh);
    const std::string bytes = formats::write_ply(mesh);
    if (formats::write_ply(formats::read_ply(bytes, "again")) != bytes)
      std::abort();
  } catch (const Error&) {
  }
  return 0;
}
