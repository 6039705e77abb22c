#pragma once
// Numbers as text, as in Gewebe's text formats.

#include <array>
#include <charconv>
#include <string>
#include <string_view>

namespace gewebe::text {

/// The shortest text that reads back exactly.
inline std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

/// Six digits, for messages.
inline std::string six_digits(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value,
                                     std::chars_format::general, 6)
                           .ptr};
}

/// The double whose shortest text is that of the float, so that 0.1f does not become 0.10000000149…
inline double decimal_of(float value) {
  std::array<char, 32> text{};
  const char* const end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double result = 0;
  std::from_chars(text.data(), end, result);
  return result;
}

/// The word without a leading plus sign, which std::from_chars does not accept: "+1" is a number,
/// "+-1" and "++1" are none.
constexpr std::string_view without_plus(std::string_view word) {
  return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}

} // namespace gewebe::text
