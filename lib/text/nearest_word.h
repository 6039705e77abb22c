#pragma once
// Suggestions for mistyped words.

#include <span>
#include <string>
#include <string_view>

namespace gewebe::text {

/// The word of `known` that is nearest to `word`. The distance is the number of letters to insert,
/// remove, replace or swap with their neighbour (optimal string alignment). It may be at most a
/// third of the letters of the longer word. A word that starts with `word` is near too, if `word`
/// has at least three letters. Ties go to the first word. "" if no word is near.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

/// " (did you mean WORD?)", or nothing.
std::string suggestion(std::string_view word, std::span<const std::string> known);

} // namespace gewebe::text
