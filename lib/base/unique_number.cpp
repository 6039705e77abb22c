#include "base/unique_number.h"

#include <atomic>

namespace gewebe {

std::uint64_t unique_number() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

} // namespace gewebe
