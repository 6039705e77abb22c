#pragma once
// What programs say on standard error.

#include <exception>
#include <string>
#include <string_view>

namespace gewebe::cli {

/// `text` as one line that any terminal takes: blanks for control characters, none of them at the
/// end, and \xNN for each byte that is no part of UTF-8.
std::string one_line(std::string_view text);

/// `tool: text` on standard error, as one line, in place of a progress bar.
void print_message(const std::string& tool, std::string_view text);

/// What an exception means that isn't of ours: texts of libraries tell a user nothing.
std::string foreign_text(const std::exception& error);

} // namespace gewebe::cli
