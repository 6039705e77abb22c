#include "base/context.h"

#include "base/bytes.h"
#include "base/error.h"

namespace gewebe {

void require_memory(const Context& context, double bytes, const char* what) {
  if (bytes <= static_cast<double>(context.max_memory))
    return;
  throw Error(std::string(what) + " needs " + bytes_text(bytes) + ", the limit is " +
              bytes_text(static_cast<double>(context.max_memory)) + " (--max-memory)");
}

} // namespace gewebe
