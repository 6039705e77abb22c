#pragma once
// Characters of UTF-8.

#include <cstddef>
#include <string_view>

namespace gewebe::text {

/// Bytes of the UTF-8 character that a text begins with; 0 if it begins with none.
inline std::size_t utf8_size(std::string_view text) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
  const unsigned first = byte(0);
  const std::size_t size = first < 0x80                     ? 1
                           : first >= 0xc2 && first <= 0xdf ? 2
                           : first >= 0xe0 && first <= 0xef ? 3
                           : first >= 0xf0 && first <= 0xf4 ? 4
                                                            : 0;
  if (size > text.size())
    return 0;
  for (std::size_t k = 1; k < size; ++k)
    if ((byte(k) & 0xc0U) != 0x80)
      return 0;
  const bool surrogate = first == 0xed && byte(1) >= 0xa0,
             overlong = (first == 0xe0 && byte(1) < 0xa0) || (first == 0xf0 && byte(1) < 0x90),
             beyond = first == 0xf4 && byte(1) > 0x8f;
  return surrogate || overlong || beyond ? 0 : size;
}

} // namespace gewebe::text
