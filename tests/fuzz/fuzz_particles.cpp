// Any text as particles: an Error, or particles that are written and read back exactly.

#include "base/error.h"
#include "formats/mesh/particles_file.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const gewebe::Particles particles = gewebe::formats::read_particles(
        std::string_view(reinterpret_cast<const char*>(data), size), "fuzz");
    const gewebe::Particles again =
        gewebe::formats::read_particles(gewebe::formats::write_particles(particles), "again");
    if (again.size() != particles.size())
      std::abort();
    for (std::size_t n = 0; n < again.size(); ++n)
      if (again[n].center != particles[n].center || again[n].weight != particles[n].weight)
        std::abort();
  } catch (const gewebe::Error&) { // what bad input is for
  }
  return 0;
}
