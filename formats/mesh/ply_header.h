#pragma once
// The header of a PLY file.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats::ply {

enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

constexpr std::size_t size_of(Type type) {
  switch (type) {
  case Type::int8:
  case Type::uint8:
    return 1;
  case Type::int16:
  case Type::uint16:
    return 2;
  case Type::int32:
  case Type::uint32:
  case Type::float32:
    return 4;
  case Type::float64:
    break;
  }
  return 8;
}

// What a property is to us.
enum class Use : std::uint8_t { skip, x, y, z, nx, ny, nz, indices, texcoord, part, material };

struct Property {
  std::string name;
  Type type = Type::float64;
  std::optional<Type> count_type; // of a list
  Use use = Use::skip;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
  std::size_t line = 0; // where the header states it
};

enum class Encoding { ascii, little, big };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t bytes = 0; // up to and with the end of the line end_header
  std::size_t lines = 0;
};

/// A word as messages show it.
std::string quoted(std::string_view text);

/// The header that `bytes` begin with. \throw Error, place "name:LINE"
Header read_header(std::string_view bytes, const std::string& name);

} // namespace gewebe::formats::ply
