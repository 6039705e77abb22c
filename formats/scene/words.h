#pragma once
// The words of a line of text, taken one by one, as scene(5) and gewebe_measurements(5) have them.

#include "geometry/vec3.h"
#include "model/selector.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe::formats {

/// A word as a message may show it: short, printable.
std::string shown(std::string_view word);

/// Takes the words of a line one by one; the complaints name what the command looks like.
class Words {
public:
  Words(std::vector<std::string> words, const char* usage)
      : words_(std::move(words)), usage_(usage) {}

  bool done() const { return at_ == words_.size(); }

  /// \throw Error "no WHAT" if there is none left
  const std::string& word(const char* what);
  /// Takes the next word if it is this one.
  bool take(std::string_view word);
  /// What follows `start` in the next word, which is taken if it starts so and goes on.
  std::optional<std::string> take_after(std::string_view start);
  /// \throw Error if the word is no number, or not finite
  double number(const char* what);
  /// The same of a text that is not a word of its own.
  double number_in(std::string_view text, const char* what) const;
  Vec3 vector(const char* what);
  /// \throw Error unless it is what objects and instruments may be called
  std::string name();
  /// The number behind `word`, which may be absent: 0. \throw Error unless positive
  double time_after(std::string_view word);
  model::Selector nodes();
  /// \throw Error if a word is left
  void end() const;
  [[noreturn]] void fail(const std::string& what) const;
  /// What is left, for a command within the command.
  Words rest(const char* usage) const;

private:
  std::vector<std::string> words_;
  const char* usage_;
  std::size_t at_ = 0;
};

} // namespace gewebe::formats
