#include "base/memory_account.h"

#include "base/bytes.h"
#include "base/error.h"

#include <string>

namespace gewebe {

void MemoryAccount::add(std::uint64_t bytes) {
  if (const std::uint64_t before = used_.fetch_add(bytes);
      bytes <= limit_ && before <= limit_ - bytes)
    return;
  used_ -= bytes;
  throw Error(std::string(what_) + " needs more than the limit of " +
              bytes_text(static_cast<double>(limit_)) + " (--max-memory)");
}

} // namespace gewebe
