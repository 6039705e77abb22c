#include "formats/tetrahedra/msh_internal.h"

// Based on: Geuzaine, Remacle, Gmsh reference manual 4.11, MSH file format, version 4.1, and
// legacy version 2.2.

namespace gewebe::formats::tet {

void MshNumbers::read_format() {
  const std::string_view version = words_.word();
  if (version == "2" || version == "2.0" || version == "2.1" || version == "2.2")
    version_ = 2;
  else if (version == "4.1")
    version_ = 4;
  else
    words_.fail("version " + quoted(version) + ", expected 2.2 or 4.1");
  const std::uint64_t type = words_.count("0 for text or 1 for binary");
  if (type > 1)
    words_.fail(std::to_string(type) + ", expected 0 for text or 1 for binary");
  if (words_.count("the size of numbers") != 8)
    words_.fail("numbers of another size, expected 8 bytes");
  binary_ = type == 1;
  if (!binary_)
    return;
  end_of_line();
  const std::int32_t one = raw<std::int32_t>();
  swap_ = one == 0x01000000;
  if (!swap_ && one != 1)
    fail("the integer that shows the byte order is missing, expected 1");
}

void MshNumbers::fail(const std::string& what) const {
  if (binary_)
    throw Error(name_, "byte " + std::to_string(words_.at()) + ": " + what);
  words_.fail(what);
}

void MshNumbers::end_of_line() {
  if (binary_ && !words_.line().empty())
    words_.fail("words behind a section's name, expected the end of the line");
}

double MshNumbers::real(const char* what) {
  if (!binary_)
    return words_.real(what);
  const double number = raw<double>();
  if (!std::isfinite(number))
    fail(std::string(what) + " is not finite, expected a finite number");
  return number;
}

std::int64_t MshNumbers::integer(const char* what) {
  return binary_ ? raw<std::int32_t>() : words_.integer(what);
}

std::uint64_t MshNumbers::count(const char* what) {
  if (!binary_)
    return words_.count(what);
  if (version_ == 4)
    return raw<std::uint64_t>();
  const std::int32_t number = raw<std::int32_t>();
  if (number < 0)
    fail(std::string(what) + " is " + std::to_string(number) + ", expected an integer from 0");
  return static_cast<std::uint64_t>(number);
}

void MshNumbers::require(std::uint64_t count, std::size_t words, std::size_t bytes,
                         const char* what) const {
  if (!binary_)
    words_.require(count, words, what);
  else if (count > words_.left() / bytes || count >= UINT32_MAX)
    fail(std::to_string(count) + " " + what + " in " + std::to_string(words_.left()) +
         " bytes, expected a count that fits");
}

void MshNumbers::skip_to(const std::string& end) {
  const std::size_t at = words_.bytes().find(end, words_.at());
  if (at == std::string_view::npos)
    words_.fail("the file ends here, expected " + end);
  words_.move_to(at + end.size());
}

} // namespace gewebe::formats::tet
