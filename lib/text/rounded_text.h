#pragma once
// Rounded numbers for messages.

#include "text/number_text.h"

#include <array>
#include <charconv>
#include <string>

namespace gewebe::text {

/// The number with three significant digits.
inline std::string rounded_text(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 3);
  (void)std::from_chars(text.data(), end.ptr, value);
  return number_text(value);
}

} // namespace gewebe::text
