// Any bytes are an image or an Error, by both readers, and an image survives being written and
// read.
#include "base/error.h"
#include "formats/image/png.h"
#include "formats/image/pnm.h"

#include <cstdlib>
#include <string_view>

namespace {

template <class Read>
void survive(Read&& read, std::string_view bytes) {
  using namespace gewebe;
  try {
    const auto image = read(bytes, "fuzz");
    if (image.values.size() != std::size_t{image.width} * image.height * image.channels)
      std::abort();
    if constexpr (sizeof image.values[0] == 1)
      if (image.values.size() < 100000 &&
          formats::read_png(formats::write_png(image), "again") != image)
        std::abort();
  } catch (const Error&) {
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  survive(gewebe::formats::read_png, bytes);
  survive(gewebe::formats::read_pnm, bytes);
  survive(gewebe::formats::read_deep_png, bytes);
  survive(gewebe::formats::read_deep_pnm, bytes);
  return 0;
}
