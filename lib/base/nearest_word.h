#pragma once
// What a mistyped word may have meant.

#include <span>
#include <string>
#include <string_view>

namespace gewebe {

/// The word of `known` that is nearest to `word`: the fewest letters to insert, take away, replace
/// or swap with their neighbour (optimal string alignment), at most one in three of the longer
/// word's; or the one that `word` begins, three letters at least. Of equals the first. "" if none
/// is near.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

/// " (did you mean WORD?)", or nothing.
std::string suggestion(std::string_view word, std::span<const std::string> known);

} // namespace gewebe
