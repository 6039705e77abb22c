#pragma once
// What reader and writer of ELA_EXPL share.

#include <string_view>

namespace gewebe::formats {

/// Of each kind of spring.
constexpr std::string_view kind_letters = "ebc";

} // namespace gewebe::formats
