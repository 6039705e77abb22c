#pragma once
// Numbers as our text formats hold them.

#include <array>
#include <charconv>
#include <string>

namespace gewebe {

/// The shortest text that reads back exactly.
inline std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

} // namespace gewebe
