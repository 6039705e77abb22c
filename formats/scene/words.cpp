#include "formats/scene/words.h"

#include "base/error.h"
#include "text/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace gewebe::formats {

std::string shown(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, 40))
    text += static_cast<unsigned char>(c) >= 0x20 && c != 0x7f ? c : '?';
  return text + (word.size() > 40 ? "…'" : "'");
}

const std::string& Words::word(const char* what) {
  if (done())
    fail(std::string("no ") + what);
  return words_[at_++];
}

bool Words::take(std::string_view word) {
  const bool same = !done() && words_[at_] == word;
  at_ += same ? 1 : 0;
  return same;
}

std::optional<std::string> Words::take_after(std::string_view start) {
  if (done() || !words_[at_].starts_with(start) || words_[at_].size() == start.size())
    return std::nullopt;
  return words_[at_++].substr(start.size());
}

double Words::number(const char* what) {
  return number_in(word(what), what);
}

double Words::number_in(std::string_view text, const char* what) const {
  const std::string_view digits = gewebe::text::without_plus(text);
  const char* const end = digits.data() + digits.size();
  double value = 0;
  const auto [rest, status] = std::from_chars(digits.data(), end, value);
  if (status != std::errc{} || rest != end)
    fail(shown(text) + " is no " + what);
  if (!std::isfinite(value))
    fail(shown(text) + " is not finite");
  return value;
}

Vec3 Words::vector(const char* what) {
  Vec3 v;
  for (int a = 0; a < 3; ++a)
    v[a] = number(what);
  return v;
}

std::string Words::name() {
  const std::string& text = word("NAME");
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  if (text.empty() || text.size() > 100 || text[0] == '.' ||
      !std::all_of(text.begin(), text.end(), allowed))
    throw Error(shown(text) + " is no name, expected up to 100 letters, digits, '_', '-', '.'");
  return text;
}

double Words::time_after(std::string_view word) {
  if (!take(word))
    return 0;
  const double time = number("time");
  if (!(time > 0))
    fail("a time that is not positive");
  return time;
}

void Words::end() const {
  if (!done())
    fail("surplus word " + shown(words_[at_]));
}

void Words::fail(const std::string& what) const {
  throw Error(what + ", expected " + usage_);
}

Words Words::rest(const char* usage) const {
  return {{words_.begin() + static_cast<std::ptrdiff_t>(at_), words_.end()}, usage};
}

model::Selector Words::nodes() {
  return model::parse_selector(word("NODES"));
}

} // namespace gewebe::formats
