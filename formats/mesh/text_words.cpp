#include "formats/mesh/text_words.h"

#include "base/error.h"
#include "formats/mesh/ply_header.h"
#include "text/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace gewebe::formats::text {

using ply::quoted;

void Words::fail(const std::string& what) const {
  const std::string_view before = bytes_.substr(0, std::min(last_, bytes_.size()));
  throw Error(name_ + ":" + std::to_string(1 + std::ranges::count(before, '\n')), what);
}

namespace {
bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}
} // namespace

void Words::skip_blanks() {
  while (at_ < bytes_.size()) {
    if (bytes_[at_] == comment_ && comment_ != '\0')
      at_ = std::min(bytes_.find('\n', at_), bytes_.size());
    else if (is_blank(bytes_[at_]))
      ++at_;
    else
      break;
  }
}

std::string_view Words::word() {
  skip_blanks();
  last_ = at_;
  while (at_ < bytes_.size() && !is_blank(bytes_[at_]))
    ++at_;
  return bytes_.substr(last_, at_ - last_);
}

std::string_view Words::peek() {
  const std::string_view next = word();
  at_ = last_;
  return next;
}

std::string_view Words::line() {
  last_ = at_;
  const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
  at_ = std::min(end + 1, bytes_.size());
  std::string_view text = bytes_.substr(last_, end - last_);
  if (text.ends_with('\r'))
    text.remove_suffix(1);
  return text;
}

namespace {
template <class Number>
bool parse(std::string_view word, Number& number) {
  word = gewebe::text::without_plus(word);
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc() && stop == word.data() + word.size();
}
} // namespace

double Words::real(const char* what) {
  const std::string_view text = word();
  double number = 0;
  if (!parse(text, number) || !std::isfinite(number))
    fail(text.empty() ? std::string("the file ends here, expected ") + what
                      : quoted(text) + ", expected " + what + ", a finite number");
  return number;
}

std::uint64_t Words::count(const char* what) {
  const std::string_view text = word();
  std::uint64_t number = 0;
  if (!parse(text, number))
    fail(text.empty() ? std::string("the file ends here, expected ") + what
                      : quoted(text) + ", expected " + what + ", an integer from 0");
  return number;
}

std::int64_t Words::integer(const char* what) {
  const std::string_view text = word();
  std::int64_t number = 0;
  if (!parse(text, number))
    fail(text.empty() ? std::string("the file ends here, expected ") + what
                      : quoted(text) + ", expected " + what + ", an integer");
  return number;
}

void Words::require(std::uint64_t count, std::size_t words, const char* what) const {
  // A word takes a digit and a blank; the last of the file may lack that.
  if (count > (left() + 1) / (2 * words))
    fail(std::to_string(count) + " " + what + " in " + std::to_string(left()) +
         " bytes, expected a count that fits");
  if (count >= UINT32_MAX)
    fail(std::to_string(count) + " " + what + ", expected fewer than " +
         std::to_string(UINT32_MAX));
}

} // namespace gewebe::formats::text
