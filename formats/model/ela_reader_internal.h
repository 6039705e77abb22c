#pragma once
// Lines, words and numbers of ELA_EXPL, and what is wrong with them.

#include "base/error.h"

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace gewebe::formats {

inline bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// A word as a message may show it: short, printable.
inline std::string shown(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, 24))
    text += c >= 0x20 && c < 0x7f ? c : '?';
  return text + (word.size() > 24 ? "…'" : "'");
}

/// Walks through lines and words; comments and blank lines never show.
class Reader {
public:
  explicit Reader(std::string_view text) : next_(text.data()), end_(text.data() + text.size()) {}

  std::size_t line() const { return line_; }
  /// What comes behind the present line.
  std::string_view rest() const { return {next_, bytes_left()}; }
  /// Goes behind so many bytes of rest(), which hold so many lines.
  void skip(std::size_t bytes, std::size_t lines) {
    next_ += bytes;
    line_ += lines;
  }
  std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - next_); }

  /// Goes to the next line that holds a word; false at the end of the text.
  bool next_line() {
    while (next_ != end_) {
      ++line_;
      const void* const newline = std::memchr(next_, '\n', bytes_left());
      if (newline == nullptr)
        throw Error("the last line has no end, expected a complete file");
      at_ = next_;
      line_end_ = static_cast<const char*>(newline);
      next_ = line_end_ + 1;
      skip_blanks();
      if (at_ != line_end_)
        return true;
    }
    at_ = line_end_ = end_;
    return false;
  }

  /// The next word, empty at the end of the line.
  std::string_view word() {
    const char* const begin = at_;
    while (at_ != line_end_ && !is_blank(*at_) && *at_ != '#')
      ++at_;
    const std::string_view result(begin, static_cast<std::size_t>(at_ - begin));
    skip_blanks();
    return result;
  }

  template <class T>
  T number(const char* what) {
    T value{};
    const auto [rest, status] = std::from_chars(at_, line_end_, value);
    if (status != std::errc{} || !(rest == line_end_ || is_blank(*rest) || *rest == '#'))
      throw Error(bad_number(what));
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value))
        throw Error(bad_number(what));
    at_ = rest;
    skip_blanks();
    return value;
  }

  std::string quoted(const char* what) {
    if (at_ == line_end_ || *at_ != '"')
      throw Error(std::string("no ") + what + ", expected one in quotes");
    const char* const begin = ++at_;
    const auto* const close = static_cast<const char*>(
        std::memchr(begin, '"', static_cast<std::size_t>(line_end_ - begin)));
    if (close == nullptr)
      throw Error(std::string("the ") + what + " has no closing quote, expected one");
    at_ = close + 1;
    if (at_ != line_end_ && !is_blank(*at_) && *at_ != '#')
      throw Error(std::string("no blank behind the ") + what + ", expected one");
    skip_blanks();
    return {begin, close};
  }

  /// \throw Error if the line holds another word
  void end_line(std::size_t words) {
    if (at_ != line_end_)
      throw Error("surplus word " + shown(word()) + ", expected " + std::to_string(words) +
                  " words");
  }

  bool at_end() const { return at_ == line_end_; }
  bool starts_with_letter() const { return *at_ >= 'a' && *at_ <= 'z'; }
  std::string_view peek_word() const {
    Reader copy = *this;
    return copy.word();
  }

private:
  void skip_blanks() {
    while (at_ != line_end_ && is_blank(*at_))
      ++at_;
    if (at_ != line_end_ && *at_ == '#')
      at_ = line_end_;
  }

  std::string bad_number(const char* what) {
    if (at_ == line_end_)
      return std::string("the line ends before ") + what + ", expected more words";
    return shown(word()) + " is no " + what + ", expected a finite number in range";
  }

  const char* next_;
  const char* end_;
  const char* at_ = nullptr;
  const char* line_end_ = nullptr;
  std::size_t line_ = 0;
};

} // namespace gewebe::formats
