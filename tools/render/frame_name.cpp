#include "tools/render/frame_name.h"

#include "base/error.h"

namespace gewebe::cli {

std::string numbered(const std::string& pattern, std::int64_t number) {
  std::string name;
  bool used = false;
  for (std::size_t at = 0; at < pattern.size(); ++at) {
    if (pattern[at] != '%') {
      name += pattern[at];
      continue;
    }
    const std::size_t end = pattern.find_first_not_of("0123456789", at + 1);
    if (end != std::string::npos && pattern[end] == 'd' && end - at <= 3 && !used) {
      const std::string digits = std::to_string(number);
      const std::size_t width =
          end == at + 1 ? 0 : std::stoul(pattern.substr(at + 1, end - at - 1));
      name += std::string(width > digits.size() ? width - digits.size() : 0, '0') + digits;
      used = true;
    } else if (end == at + 1 && pattern[end] == '%') {
      name += '%';
    } else {
      throw UsageError("-o: '" + pattern +
                       "', expected one %d or %04d for the number of the frame");
    }
    at = end;
  }
  return name;
}

} // namespace gewebe::cli
