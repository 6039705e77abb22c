#pragma once
// The numbers of one DataArray of a file of VTK in XML, however they are stored.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats::vtk {

/// How the file stores arrays.
struct Encoding {
  bool big_endian = false;
  bool wide_header = false; ///< sizes before data have 8 bytes, else 4
  bool zlib = false;
  bool appended_base64 = false;
  std::string_view appended; ///< what follows the underscore, to the end of the file
};

struct Array {
  std::string name, type, format; ///< attributes
  std::uint64_t components = 1, offset = 0;
  std::string_view text; ///< inline: between the tags
  std::size_t at = 0;    ///< where the tag stands in the file
};

/// The numbers of the array. `place` begins messages.
/// \throw Error unless there are exactly `count`, all of them finite, \pre count < 2^36
std::vector<double> reals(const Array& array, const Encoding& encoding, std::uint64_t count,
                          const std::string& place);
/// \throw Error also if one is no integer
std::vector<std::int64_t> integers(const Array& array, const Encoding& encoding,
                                   std::uint64_t count, const std::string& place);

} // namespace gewebe::formats::vtk
