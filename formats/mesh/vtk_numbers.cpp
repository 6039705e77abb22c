#include "formats/mesh/vtk_numbers.h"

#include "base/error.h"
#include "formats/mesh/ply_header.h"
#include "formats/mesh/text_words.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>
// Based on: VTK file formats, docs.vtk.org, "XML file formats"; RFC 4648 (base64).

namespace gewebe::formats::vtk {
namespace {

using ply::quoted;

static_assert(std::endian::native == std::endian::little,
              "numbers are copied from little-endian memory");

int digit_of(char c) {
  if (c >= 'A' && c <= 'Z')
    return c - 'A';
  if (c >= 'a' && c <= 'z')
    return c - 'a' + 26;
  if (c >= '0' && c <= '9')
    return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/// Bytes that come forwards, from base64 or as they are.
class Bytes {
public:
  Bytes(std::string_view from, bool base64, const std::string& place)
      : from_(from), place_(place), base64_(base64) {}

  /// An upper bound.
  std::size_t left() const {
    return base64_ ? (from_.size() - at_) / 4 * 3 + 3 : from_.size() - at_;
  }

  void read(char* to, std::size_t count) {
    if (!base64_) {
      if (count > from_.size() - at_)
        short_by(count - (from_.size() - at_));
      std::copy_n(from_.data() + at_, count, to);
      at_ += count;
      return;
    }
    for (std::size_t n = 0; n < count; ++n) {
      if (next_ == ready_ && !decode())
        short_by(count - n);
      to[n] = group_[next_++];
    }
  }

  template <class T>
  T number(bool swap) {
    std::array<char, sizeof(T)> raw{};
    read(raw.data(), raw.size());
    if (swap)
      std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  std::uint64_t size(const Encoding& encoding) {
    return encoding.wide_header ? number<std::uint64_t>(encoding.big_endian)
                                : number<std::uint32_t>(encoding.big_endian);
  }

private:
  [[noreturn]] void short_by(std::size_t count) const {
    throw Error(place_,
                "ends within its numbers, expected " + std::to_string(count) + " more bytes");
  }

  /// The next four digits. Those after padding begin a new run: sizes are often encoded apart.
  bool decode() {
    std::array<int, 4> digits{};
    std::size_t count = 0, padding = 0;
    for (; at_ < from_.size() && count < 4; ++at_) {
      const char c = from_[at_];
      if (c == ' ' || (c >= '\t' && c <= '\r'))
        continue;
      const int digit = digit_of(c);
      if (c == '=')
        ++padding;
      else if (digit < 0 || padding > 0)
        break;
      digits[count++] = std::max(digit, 0);
    }
    if (count < 4 || padding > 2)
      return false;
    const int bits = digits[0] << 18 | digits[1] << 12 | digits[2] << 6 | digits[3];
    group_ = {static_cast<char>(bits >> 16), static_cast<char>(bits >> 8 & 255),
              static_cast<char>(bits & 255)};
    next_ = 0;
    ready_ = 3 - padding;
    return ready_ > 0;
  }

  std::string_view from_;
  const std::string& place_;
  std::size_t at_ = 0;
  bool base64_;
  std::array<char, 3> group_{};
  std::size_t next_ = 0, ready_ = 0;
};

struct NumberType {
  std::string_view name;
  std::size_t size;
};
constexpr std::array<NumberType, 10> number_types{{{"Int8", 1},
                                                   {"UInt8", 1},
                                                   {"Int16", 2},
                                                   {"UInt16", 2},
                                                   {"Int32", 4},
                                                   {"UInt32", 4},
                                                   {"Int64", 8},
                                                   {"UInt64", 8},
                                                   {"Float32", 4},
                                                   {"Float64", 8}}};

std::size_t size_of(const Array& array, const std::string& place) {
  for (const NumberType& type : number_types)
    if (type.name == array.type)
      return type.size;
  throw Error(place, "numbers of type " + quoted(array.type) +
                         ", expected Int8 to UInt64, Float32 "
                         "or Float64");
}

std::string inflated(Bytes& bytes, const Encoding& encoding, std::uint64_t expected,
                     const std::string& place) {
  const std::uint64_t blocks = bytes.size(encoding), block = bytes.size(encoding),
                      last = bytes.size(encoding);
  if (blocks > bytes.left() / (encoding.wide_header ? 8 : 4))
    throw Error(place, std::to_string(blocks) + " blocks, expected a count that fits");
  std::vector<std::uint64_t> packed(blocks);
  std::uint64_t total = 0;
  for (std::uint64_t& size : packed) {
    size = bytes.size(encoding);
    if (size > bytes.left() || total > bytes.left())
      throw Error(place, "a block of " + std::to_string(size) + " bytes, expected one that fits");
    total += size;
  }
  // zlib packs at most 1032 bytes into one.
  if (total > bytes.left() || expected > 1040 * (total + 1))
    throw Error(place, std::to_string(expected) + " bytes in " + std::to_string(total) +
                           " packed ones, expected a count that fits");
  // Full blocks, then one of `last` bytes unless that is 0.
  const std::uint64_t full = blocks == 0 || last == 0 ? blocks : blocks - 1;
  const bool fits = last <= block && (full == 0 || (block > 0 && full <= expected / block)) &&
                    full * block + (blocks == 0 ? 0 : last) == expected;
  if (!fits)
    throw Error(place, std::to_string(blocks) + " blocks of " + std::to_string(block) +
                           " bytes, the last of " + std::to_string(last) + ", expected " +
                           std::to_string(expected) + " bytes");
  std::string result(expected, '\0'), raw;
  std::uint64_t at = 0;
  for (std::size_t n = 0; n < packed.size(); ++n) {
    const std::uint64_t size = n + 1 == packed.size() && last > 0 ? last : block;
    raw.resize(packed[n]);
    bytes.read(raw.data(), raw.size());
    uLongf got = static_cast<uLongf>(size);
    if (uncompress(reinterpret_cast<Bytef*>(result.data() + at), &got,
                   reinterpret_cast<const Bytef*>(raw.data()),
                   static_cast<uLong>(raw.size())) != Z_OK ||
        got != size)
      throw Error(place, "block " + std::to_string(n) + " is damaged, expected zlib's data");
    at += size;
  }
  return result;
}

/// The bytes of a binary array.
std::string bytes_of(const Array& array, const Encoding& encoding, std::uint64_t expected,
                     const std::string& place) {
  const bool appended = array.format == "appended";
  if (appended && array.offset > encoding.appended.size())
    throw Error(place, "offset " + std::to_string(array.offset) + ", expected one within " +
                           std::to_string(encoding.appended.size()) + " appended bytes");
  Bytes bytes(appended ? encoding.appended.substr(array.offset) : array.text,
              !appended || encoding.appended_base64, place);
  if (encoding.zlib)
    return inflated(bytes, encoding, expected, place);
  const std::uint64_t size = bytes.size(encoding);
  if (size != expected)
    throw Error(place, std::to_string(size) + " bytes, expected " + std::to_string(expected));
  if (size > bytes.left())
    throw Error(place, std::to_string(size) + " bytes, expected a count that fits");
  std::string result(size, '\0');
  bytes.read(result.data(), size);
  return result;
}

template <class From, class To>
void convert(const std::string& bytes, bool swap, std::vector<To>& numbers,
             const std::string& place) {
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    std::array<char, sizeof(From)> raw;
    std::memcpy(raw.data(), bytes.data() + n * sizeof(From), sizeof(From));
    if (swap)
      std::reverse(raw.begin(), raw.end());
    const From value = std::bit_cast<From>(raw);
    if constexpr (std::is_floating_point_v<From>) {
      if (!std::isfinite(value))
        throw Error(place, "number " + std::to_string(n) + " is not finite");
      if constexpr (!std::is_floating_point_v<To>)
        if (!(std::fabs(value) <= static_cast<From>(1e15)) || value != std::floor(value))
          throw Error(place, "number " + std::to_string(n) + " is no integer, expected one");
    } else if constexpr (sizeof(From) == 8 && !std::is_signed_v<From>) {
      if (value > static_cast<std::uint64_t>(INT64_MAX))
        throw Error(place, "number " + std::to_string(n) + " is " + std::to_string(value) +
                               ", expected less");
    }
    if constexpr (std::is_same_v<From, std::int8_t>) {
      const int byte = std::bit_cast<std::uint8_t>(value);
      numbers[n] = static_cast<To>(byte < 128 ? byte : byte - 256);
    } else {
      numbers[n] = static_cast<To>(value);
    }
  }
}

template <class To>
std::vector<To> numbers_of(const Array& array, const Encoding& encoding, std::uint64_t count,
                           const std::string& place) {
  const std::size_t size = size_of(array, place);
  if (array.format == "ascii") {
    text::Words words(array.text, place, '\0');
    if (count > (array.text.size() + 1) / 2)
      throw Error(place, std::to_string(count) + " numbers in " +
                             std::to_string(array.text.size()) +
                             " bytes, expected a count that fits");
    std::vector<To> numbers(count);
    try {
      for (To& number : numbers)
        if constexpr (std::is_floating_point_v<To>)
          number = words.real("a number");
        else
          number = words.integer("a number");
    } catch (const Error& error) { // the lines of a tag's text mean nothing
      throw Error(place, error.what());
    }
    if (!words.word().empty())
      throw Error(place, "more than " + std::to_string(count) + " numbers");
    return numbers;
  }
  if (array.format != "binary" && array.format != "appended")
    throw Error(place, "format " + quoted(array.format) + ", expected ascii, binary or appended");
  const std::string bytes = bytes_of(array, encoding, count * size, place);
  std::vector<To> numbers(count);
  const bool swap = encoding.big_endian;
  if (array.type == "Int8")
    convert<std::int8_t>(bytes, swap, numbers, place);
  else if (array.type == "UInt8")
    convert<std::uint8_t>(bytes, swap, numbers, place);
  else if (array.type == "Int16")
    convert<std::int16_t>(bytes, swap, numbers, place);
  else if (array.type == "UInt16")
    convert<std::uint16_t>(bytes, swap, numbers, place);
  else if (array.type == "Int32")
    convert<std::int32_t>(bytes, swap, numbers, place);
  else if (array.type == "UInt32")
    convert<std::uint32_t>(bytes, swap, numbers, place);
  else if (array.type == "Int64")
    convert<std::int64_t>(bytes, swap, numbers, place);
  else if (array.type == "UInt64")
    convert<std::uint64_t>(bytes, swap, numbers, place);
  else if (array.type == "Float32")
    convert<float>(bytes, swap, numbers, place);
  else
    convert<double>(bytes, swap, numbers, place);
  return numbers;
}

} // namespace

std::vector<double> reals(const Array& array, const Encoding& encoding, std::uint64_t count,
                          const std::string& place) {
  return numbers_of<double>(array, encoding, count, place);
}

std::vector<std::int64_t> integers(const Array& array, const Encoding& encoding,
                                   std::uint64_t count, const std::string& place) {
  return numbers_of<std::int64_t>(array, encoding, count, place);
}

} // namespace gewebe::formats::vtk
