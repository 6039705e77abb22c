#pragma once
// A program's options and operands as declared, and its command line read by them. For cli.cpp.

#include "geometry/vec3.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::cli {

/// One option or flag.
struct Spec {
  std::string names, metavar, help; ///< "-s,--long" or "--long"
  std::string default_text;
  std::string
      value_type;       ///< "number", "whole number", "numbers" (with commas) or "text"; flags: ""
  bool* flag = nullptr; ///< what the name without a value sets
  std::function<void(std::string_view)> set; ///< parses and checks a word; none: takes no value
  std::function<void(std::int32_t, std::string_view)> set_numbered; ///< of N=WORD
  bool must_be_positive = false;
  std::optional<double> min, max;
  std::vector<std::string> choices;
  std::vector<std::string> proposals; ///< beside `choices`: examples
  std::size_t list_count = 0;         ///< 0: any
  std::vector<std::string> words;     ///< as typed

  std::string long_name() const { return names.substr(names.find("--")); }
  bool is_named(std::string_view name) const;
  /// Gives the words to `set` and `set_numbered`. \throw UsageError
  void set_all() const;

  // A word of the option's kind. \throw UsageError where it is none, or out of range
  void read(std::string_view word, double& value) const;
  void read(std::string_view word, std::int64_t& value) const;
  void read(std::string_view word, std::string& value) const;
  void read(std::string_view word, std::vector<double>& value) const;
  void read(std::string_view word, Vec3& value) const;
  template <class T>
  void read(std::string_view word, std::optional<T>& value) const {
    read(word, value.emplace());
  }

private:
  void check(double value) const;
};

struct Operand {
  std::string name, help;
  std::vector<std::string> words;             ///< what a shell proposes, or nothing: files
  std::string* value = nullptr;               ///< one, or
  std::vector<std::string>* values = nullptr; ///< all that remain
  std::size_t min_count = 0;
  std::size_t count = 0; ///< given
};

/// The command line of `tool`.
struct CommandLine {
  std::string tool;
  std::vector<std::unique_ptr<Spec>> specs; ///< the first ones are --help and --version
  std::vector<Operand> operands;

  /// Takes words as getopt_long(3) does, without abbreviations: sets flags and operands, keeps the
  /// words of options for set_all(). A value may stand in the next word, whatever it looks like, or
  /// after `=`. A negative number is an operand.
  /// \throw UsageError for a value that is missing or too much, a long option behind one dash
  void take(const std::vector<std::string>& words);
  Spec* find(std::string_view name) const; ///< or nullptr
  /// \throw UsageError for words that are unknown, operands that are missing
  void check_complete() const;
  /// The text of --help: usage, operands, options, examples, exit statuses.
  std::string help(const std::string& description) const;
  /// The text of --help-json: one JSON object. gewebe(7) lists its members.
  std::string help_json(const std::string& description) const;
  /// The same for programs: a line for the tool, each option and each operand, of words between
  /// tabs: what it is (`program`, `flag`, `option`, `operand`, `operands`), its names, its value's
  /// name, what that may be (words between blanks, or nothing), the help.
  std::string describe(const std::string& description) const;

private:
  using NextWord = std::function<std::optional<std::string>()>;
  void take_value(Spec& spec, const std::optional<std::string>& value);
  void take_short(std::string word, const NextWord& next);
  void take_long(const std::string& word, const NextWord& next);
  void take_operand(const std::string& word);
  std::vector<std::string> long_names() const;
  [[noreturn]] void refuse(const std::string& text) const;
  std::vector<std::string> unexpected_;
};

} // namespace gewebe::cli
