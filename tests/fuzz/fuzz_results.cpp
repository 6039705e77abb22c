// Any bytes as the result of a run: an Error or meshes that are sound, never a crash.

#include "base/error.h"
#include "formats/results/results.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

namespace {

/// A file in memory, for results are read by their names.
class Bytes {
public:
  Bytes(const std::uint8_t* data, std::size_t size) : file_(::memfd_create("fuzz", 0)) {
    for (std::size_t at = 0; at < size;) {
      const ssize_t count = ::write(file_, data + at, size - at);
      if (count <= 0)
        std::abort();
      at += static_cast<std::size_t>(count);
    }
  }
  ~Bytes() { ::close(file_); }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

private:
  int file_;
};

template <class Work>
void attempt(Work&& work) {
  try {
    work();
  } catch (const gewebe::Error&) { // what bad input is for
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  const std::string path = bytes.path();
  attempt([&] {
    const gewebe::formats::ResultIndex index = gewebe::formats::read_result_index(path);
    for (const std::string& object : index.objects)
      for (const std::size_t frame : {std::size_t{0}, index.times.size()}) {
        attempt([&] {
          gewebe::check_mesh(gewebe::formats::read_result_surface(path, object, frame).mesh);
        });
        attempt([&] {
          gewebe::tetrahedra::check_mesh(
              gewebe::formats::read_result_solid(path, object, frame).mesh);
        });
      }
    for (const std::size_t frame : {std::size_t{0}, index.times.size() / 2})
      attempt([&] { (void)gewebe::formats::read_result_instruments(path, frame); });
  });
  return 0;
}
