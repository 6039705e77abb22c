#pragma once
// Numbers as text for formats that limit the length of a number.

#include "text/number_text.h"

#include <array>
#include <charconv>
#include <cstddef>
#include <string>

namespace gewebe::text {

/// The shortest text that reads back exactly, or where that is longer than `most` characters the
/// one with the most digits that is not. \pre the value is finite, most >= 8
inline std::string limited_text(double value, std::size_t most) {
  std::string text = number_text(value);
  for (int digits = 17; text.size() > most && digits > 1; --digits) {
    std::array<char, 64> bytes{};
    text.assign(bytes.data(), std::to_chars(bytes.data(), bytes.data() + bytes.size(), value,
                                            std::chars_format::scientific, digits - 1)
                                  .ptr);
  }
  return text;
}

} // namespace gewebe::text
