#pragma once
// Text and bytes on their way to a file, collected into large pieces.

#include <array>
#include <charconv>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>

namespace gewebe::formats {

/// Where they go.
using Sink = std::function<void(std::string_view)>;

/// What is left after the last piece goes with flush().
class Pieces {
public:
  explicit Pieces(const Sink& sink) : sink_(sink) {}
  Pieces(const Pieces&) = delete;
  Pieces& operator=(const Pieces&) = delete;

  Pieces& operator<<(std::string_view text) {
    bytes_ += text;
    if (bytes_.size() >= piece)
      flush();
    return *this;
  }
  /// The shortest text that reads back exactly.
  template <class Number>
    requires std::is_arithmetic_v<Number>
  Pieces& operator<<(Number value) {
    std::array<char, 32> text;
    const char* end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    return *this << std::string_view(text.data(), static_cast<std::size_t>(end - text.data()));
  }
  template <class T>
  void put(const T& value) {
    *this << std::string_view(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void flush() {
    sink_(bytes_);
    bytes_.clear();
  }

private:
  static constexpr std::size_t piece = 1 << 18;
  const Sink& sink_;
  std::string bytes_;
};

} // namespace gewebe::formats
