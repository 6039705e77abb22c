#include "tools/cli/messages.h"

#include "tools/cli/progress_bar.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <ios>
#include <new>
#include <stdexcept>
#include <system_error>

namespace gewebe::cli {
namespace {

/// Bytes of the character that `text` begins with, by table 3-7 of the Unicode standard; 0 if it
/// is none.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t n) -> unsigned {
    return n < text.size() ? static_cast<unsigned char>(text[n]) : 0;
  };
  const unsigned lead = byte(0);
  if (lead < 0x80)
    return 1;
  const std::size_t length = lead < 0xc2 || lead > 0xf4 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
  // The second byte keeps out what a shorter form says, surrogates, and what lies past the last.
  const unsigned low = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;
  const unsigned high = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;
  for (std::size_t n = 1; n < length; ++n)
    if (byte(n) < (n == 1 ? low : 0x80) || byte(n) > (n == 1 ? high : 0xbf))
      return 0;
  return length;
}

} // namespace

std::string one_line(std::string_view text) {
  std::string line;
  for (std::size_t length = 0; !text.empty();
       text.remove_prefix(std::max<std::size_t>(length, 1))) {
    length = character_length(text);
    const auto first = static_cast<unsigned char>(text[0]);
    const bool control =
        length == 1 ? first < 0x20 || first == 0x7f
                    : length == 2 && first == 0xc2 && static_cast<unsigned char>(text[1]) < 0xa0;
    std::array<char, 8> escaped{};
    (void)std::snprintf(escaped.data(), escaped.size(), "\\x%02x", first);
    line += length == 0 ? escaped.data() : control ? " " : text.substr(0, length);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

void print_message(const std::string& tool, std::string_view text) {
  const std::string line = progress_eraser() + tool + ": " + one_line(text) + "\n";
  (void)std::fwrite(line.data(), 1, line.size(), stderr);
}

std::string foreign_text(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
      dynamic_cast<const std::length_error*>(&error) != nullptr)
    return "out of memory";
  if (const auto* const system = dynamic_cast<const std::system_error*>(&error))
    if (system->code().category() == std::system_category() ||
        system->code() == std::errc::resource_unavailable_try_again)
      return system->code() == std::errc::resource_unavailable_try_again
                 ? "no thread can be started, expected room for more (ulimit -u, ulimit -v)"
                 : "the system refuses: " + system->code().message();
  if (dynamic_cast<const std::ios_base::failure*>(&error) != nullptr)
    return "cannot read or write";
  return std::string("a fault of this program, please report it: ") + error.what();
}

} // namespace gewebe::cli
