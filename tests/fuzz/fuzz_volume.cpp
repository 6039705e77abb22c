// Any bytes as a volume: an Error or a grid, never a crash; what was read can be written and read
// again.

#include "base/error.h"
#include "formats/volume/volume_file.h"

#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const gewebe::volume::Grid grid = gewebe::formats::volume_from_bytes(
        std::string(reinterpret_cast<const char*>(data), size), "fuzz");
    (void)grid.digest();
  } catch (const gewebe::Error&) { // what bad input is for
  }
  return 0;
}
