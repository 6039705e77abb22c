#pragma once
// Shared by parsing and evaluation of selectors.

#include <string>
#include <string_view>

namespace gewebe::model {

/// A selector, or a part of one, as messages have it: in quotes, on one line, not too long.
std::string quoted_selector(std::string_view text);

} // namespace gewebe::model
