#pragma once
// What the readers and writers of Gmsh's meshes share.

#include "formats/tetrahedra/tet_file_internal.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace gewebe::formats::tet {

/// How the physical group of material 0 is called: none may have the number 0.
constexpr std::string_view name_of_0 = "material 0";

/// Numbers of a file, in text or binary as its $MeshFormat says.
class MshNumbers {
public:
  MshNumbers(std::string_view bytes, const std::string& name)
      : words_(bytes, name, '\0'), name_(name) {}

  /// Behind the word $MeshFormat. \throw Error unless it is version 2.0 to 2.2 or 4.1
  void read_format();
  int version() const { return version_; } ///< 2 or 4; 0 before read_format
  bool binary() const { return binary_; }
  /// Sections' names, and what is text always.
  Words& words() { return words_; }
  const std::string& name() const { return name_; }

  /// Place: the line of text, or the byte.
  [[noreturn]] void fail(const std::string& what) const;
  /// Behind the name of a section whose bytes follow.
  void end_of_line();
  template <class T>
  T raw() {
    if (words_.left() < sizeof(T))
      fail("the file ends here, expected " + std::to_string(sizeof(T)) + " bytes");
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), words_.bytes().data() + words_.at(), sizeof(T));
    if (swap_)
      std::reverse(bytes.begin(), bytes.end());
    words_.move_to(words_.at() + sizeof(T));
    return std::bit_cast<T>(bytes);
  }
  double real(const char* what);
  std::int64_t integer(const char* what);
  /// Of 32 bits in binary files of version 2, 64 in those of 4.
  std::uint64_t count(const char* what);
  /// Refuses counts that the file can't hold: each takes `words` words, or `bytes` bytes.
  void require(std::uint64_t count, std::size_t words, std::size_t bytes, const char* what) const;
  void skip_to(const std::string& end);

private:
  Words words_;
  const std::string& name_;
  int version_ = 0;
  bool binary_ = false, swap_ = false;
};

} // namespace gewebe::formats::tet
