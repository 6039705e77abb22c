#pragma once
// Words and numbers of a text, for readers of meshes as text.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace gewebe::formats::text {

/// Words of a text, apart by blanks and line ends; where `comment` stands at the start of a word,
/// the rest of the line is one. A NUL stands for no comments.
class Words {
public:
  Words(std::string_view bytes, const std::string& name, char comment)
      : bytes_(bytes), name_(name), comment_(comment) {}

  /// Place: the line of the last word.
  [[noreturn]] void fail(const std::string& what) const;

  /// The next one, "" at the end.
  std::string_view word();
  /// The same, but it stays the next.
  std::string_view peek();
  /// The rest of the line, which may be "", without its end.
  std::string_view line();
  double real(const char* what);          ///< \throw Error unless it is a finite number
  std::uint64_t count(const char* what);  ///< \throw Error unless it is an integer from 0
  std::int64_t integer(const char* what); ///< \throw Error unless it is an integer
  /// \throw Error unless `count` things of `words` words each may follow
  void require(std::uint64_t count, std::size_t words, const char* what) const;

  std::size_t at() const { return at_; }
  void move_to(std::size_t at) { at_ = at; }
  std::size_t left() const { return bytes_.size() - at_; }
  std::string_view bytes() const { return bytes_; }

private:
  void skip_blanks();
  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0, last_ = 0;
  char comment_;
};

} // namespace gewebe::formats::text
