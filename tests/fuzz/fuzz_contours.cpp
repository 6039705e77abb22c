// Any text as contours: an Error, or contours of three points or more, all finite.

#include "base/error.h"
#include "formats/volume/contours_file.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    for (const gewebe::labels::Contour& contour : gewebe::formats::read_contours(text, "fuzz")) {
      if (contour.size() < 3)
        std::abort();
      for (const gewebe::Vec3& point : contour)
        if (!gewebe::is_finite(point))
          std::abort();
    }
  } catch (const gewebe::Error&) { // what bad input is for
  }
  return 0;
}
