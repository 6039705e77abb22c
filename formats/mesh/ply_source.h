#pragma once
// Where the numbers of a PLY body come from.

#include "base/error.h"
#include "formats/mesh/ply_header.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

namespace gewebe::formats::ply {

static_assert(std::endian::native == std::endian::little, "the codec copies little-endian memory");

// Both sources give the numbers of the body one after the other as double, which holds every type
// exactly.

class BinarySource {
public:
  BinarySource(std::string_view bytes, const std::string& name, std::size_t at, bool swap)
      : bytes_(bytes), name_(name), at_(at), swap_(swap) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_, "byte " + std::to_string(at_) + ": " + what);
  }

  /// The least room that one value of the type takes.
  static std::size_t min_size(Type type) { return size_of(type); }
  std::size_t left() const { return bytes_.size() - at_; }
  void begin_record(const Element&) {}
  void end_record() {}

  double value(Type type) {
    switch (type) {
    case Type::int8:
      return take<std::int8_t>();
    case Type::uint8:
      return take<std::uint8_t>();
    case Type::int16:
      return take<std::int16_t>();
    case Type::uint16:
      return take<std::uint16_t>();
    case Type::int32:
      return take<std::int32_t>();
    case Type::uint32:
      return take<std::uint32_t>();
    case Type::float32:
      return static_cast<double>(take<float>());
    case Type::float64:
      break;
    }
    return take<double>();
  }

  void skip(Type type, std::size_t count) {
    require(count * size_of(type));
    at_ += count * size_of(type);
  }

  void finish() {
    if (left() != 0)
      fail(std::to_string(left()) + " bytes after the last element, expected the end");
  }

private:
  void require(std::size_t size) const {
    if (left() < size)
      fail("the file ends here, expected " + std::to_string(size - left()) + " more bytes");
  }

  template <class T>
  T take() {
    require(sizeof(T));
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
    if (swap_)
      std::reverse(raw.begin(), raw.end());
    at_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_;
  bool swap_;
};

class AsciiSource {
public:
  AsciiSource(std::string_view bytes, const std::string& name, std::size_t at, std::size_t lines)
      : bytes_(bytes), name_(name), at_(at), line_(lines) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(line_), what);
  }

  // A digit and the blank or line end behind it; the very last may lack that.
  static std::size_t min_size(Type) { return 2; }
  std::size_t left() const { return bytes_.size() - at_ + 1 + rest_.size(); }

  /// An element is one line; blank lines between are passed over.
  void begin_record(const Element& element) {
    if (element.properties.empty())
      return;
    do {
      if (!next_line())
        fail("the file ends here, expected another " + element.name);
    } while (rest_.empty());
  }
  void end_record() {
    if (!rest_.empty())
      fail(quoted(rest_) + " is left on the line, expected its end");
  }

  double value(Type) {
    if (rest_.empty())
      fail("the line ends here, expected another number");
    std::size_t size = 0;
    while (size < rest_.size() && !is_blank(rest_[size]))
      ++size;
    const std::string_view word = rest_.substr(0, size), digits = gewebe::text::without_plus(word);
    const char* const end = digits.data() + digits.size();
    double number = 0;
    const auto [stop, error] = std::from_chars(digits.data(), end, number);
    if (error != std::errc() || stop != end)
      fail(quoted(word) + ", expected a number");
    rest_.remove_prefix(size);
    trim();
    return number;
  }

  void skip(Type type, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      value(type);
  }

  void finish() {
    while (next_line())
      if (!rest_.empty())
        fail(quoted(rest_) + " after the last element, expected the end");
  }

private:
  static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
  }
  void trim() {
    while (!rest_.empty() && is_blank(rest_.front()))
      rest_.remove_prefix(1);
  }
  bool next_line() {
    ++line_;
    rest_ = {};
    if (at_ == bytes_.size())
      return false;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    rest_ = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    trim();
    return true;
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_, line_;
  std::string_view rest_; // of the line, from a word on
};

// What both readers, of surfaces and of tetrahedra, do with the numbers.

/// The size of a list, which the bytes left can hold. \pre property.count_type
template <class Source>
std::size_t list_size(Source& source, const Property& property) {
  const double count = source.value(*property.count_type);
  if (!(count >= 0 && count <= UINT32_MAX && count == std::floor(count)))
    source.fail("a list of " + gewebe::text::number_text(count) +
                " values, expected a count from 0");
  const std::size_t size = static_cast<std::size_t>(count);
  if (size > source.left() / Source::min_size(property.type))
    source.fail("a list of " + std::to_string(size) + " values in " +
                std::to_string(source.left()) + " bytes, expected a count that fits");
  return size;
}

template <class Source>
void skip_property(Source& source, const Property& property) {
  source.skip(property.type, property.count_type ? list_size(source, property) : 1);
}

template <class Source>
void skip_element(Source& source, const Element& element) {
  if (element.properties.empty())
    return;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    source.begin_record(element);
    for (const Property& property : element.properties)
      skip_property(source, property);
    source.end_record();
  }
}

} // namespace gewebe::formats::ply
