#include "base/error.h"
#include "text/nearest_word.h"
#include "text/number_text.h"
#include "tools/cli/cli.h"
#include "tools/cli/options_internal.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <type_traits>

namespace gewebe::cli {
namespace {

template <class Number>
Number parse_number(const std::string& name, std::string_view word) {
  Number value{};
  const std::string_view digits = text::without_plus(word);
  const char* const end = digits.data() + digits.size();
  const auto [rest, status] = std::from_chars(digits.data(), end, value);
  if (status != std::errc{} || rest != end)
    throw UsageError(name + ": '" + std::string(word) + "' is no " +
                     (std::is_integral_v<Number> ? "whole number" : "number"));
  if constexpr (std::is_floating_point_v<Number>)
    if (!std::isfinite(value))
      throw UsageError(name + ": '" + std::string(word) + "' is not finite");
  return value;
}

/// N of "N=VALUE".
std::optional<std::int32_t> number_before_value(std::string_view word) {
  std::int32_t number = 0;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (status != std::errc{} || rest == word.data() + word.size() || *rest != '=' || word[0] == '-')
    return std::nullopt;
  return number;
}

} // namespace

// ---- Spec

bool Spec::is_named(std::string_view name) const {
  return name == long_name() || (names[1] != '-' && name == std::string_view(names).substr(0, 2));
}

void Spec::check(double value) const {
  if (must_be_positive && !(value > 0))
    throw UsageError(long_name() + ": expected more than 0, not " + text::number_text(value));
  if (min && !(value >= *min && value <= *max))
    throw UsageError(long_name() + ": expected " + text::number_text(*min) + " to " +
                     text::number_text(*max) + ", not " + text::number_text(value));
}

void Spec::read(std::string_view word, double& value) const {
  value = parse_number<double>(long_name(), word);
  check(value);
}

void Spec::read(std::string_view word, std::int64_t& value) const {
  value = parse_number<std::int64_t>(long_name(), word);
  check(static_cast<double>(value));
}

void Spec::read(std::string_view word, std::string& value) const {
  if (!choices.empty() && std::ranges::find(choices, word) == choices.end()) {
    std::string list;
    for (const std::string& choice : choices)
      list += (list.empty() ? "" : ", ") + choice;
    throw UsageError(long_name() + ": '" + std::string(word) + "', expected one of " + list);
  }
  value = word;
}

void Spec::read(std::string_view word, std::vector<double>& value) const {
  value.clear();
  for (std::size_t begin = 0; begin <= word.size();) {
    const std::size_t comma = std::min(word.find(',', begin), word.size());
    read(word.substr(begin, comma - begin), value.emplace_back());
    begin = comma + 1;
  }
  if (list_count != 0 && value.size() != list_count)
    throw UsageError(long_name() + ": expected " + std::to_string(list_count) + " numbers, not " +
                     std::to_string(value.size()));
}

void Spec::read(std::string_view word, Vec3& value) const {
  std::vector<double> values;
  read(word, values);
  value = {values[0], values[1], values[2]};
}

void Spec::set_all() const {
  std::vector<std::optional<std::int32_t>> numbers;
  for (const std::string_view word : words) {
    const auto number = set_numbered ? number_before_value(word) : std::nullopt;
    if (std::ranges::find(numbers, number) != numbers.end())
      throw UsageError(long_name() + (number ? " " + std::to_string(*number) + "=" : "") +
                       ": given more than once");
    numbers.push_back(number);
    if (number && word.back() == '=')
      throw UsageError(long_name() + " " + std::string(word) + ": expected " + metavar);
    if (number)
      set_numbered(*number, word.substr(word.find('=') + 1));
    else
      set(word);
  }
}

// ---- CommandLine

void CommandLine::refuse(const std::string& text) const {
  throw UsageError(text + ", see " + tool + " --help");
}

Spec* CommandLine::find(std::string_view name) const {
  const auto found =
      std::ranges::find_if(specs, [&](const auto& spec) { return spec->is_named(name); });
  return found == specs.end() ? nullptr : found->get();
}

std::vector<std::string> CommandLine::long_names() const {
  std::vector<std::string> names;
  for (const auto& spec : specs)
    names.push_back(spec->long_name());
  return names;
}

void CommandLine::take_value(Spec& spec, const std::optional<std::string>& value) {
  if (!spec.set)
    refuse(spec.long_name() + ": takes no value");
  if (!value)
    refuse(spec.long_name() + ": expected " + spec.metavar);
  spec.words.push_back(*value);
}

void CommandLine::take_operand(const std::string& word) {
  for (Operand& operand : operands) {
    if (operand.value != nullptr && operand.count > 0)
      continue;
    ++operand.count;
    if (operand.value != nullptr)
      *operand.value = word;
    else
      operand.values->push_back(word);
    return;
  }
  unexpected_.push_back(word);
}

/// -qv, -j4, -j 4.
void CommandLine::take_short(std::string word, const NextWord& next) {
  while (word.size() > 1) {
    Spec* const spec = find(word.substr(0, 2));
    if (spec == nullptr)
      return unexpected_.push_back(word);
    word.erase(1, 1);
    if (spec->flag == nullptr)
      return take_value(*spec, word == "-" ? next() : word.substr(word[1] == '=' ? 2 : 1));
    *spec->flag = true;
  }
}

/// --quiet, --voxel 3, --voxel=3.
void CommandLine::take_long(const std::string& word, const NextWord& next) {
  const std::size_t equals = std::min(word.find('='), word.size());
  Spec* const spec = find(std::string_view(word).substr(0, equals));
  if (spec == nullptr)
    unexpected_.push_back(word);
  else if (equals + 1 < word.size())
    take_value(*spec, word.substr(equals + 1));
  else if (equals < word.size())
    take_value(*spec, std::nullopt);
  else if (spec->flag != nullptr)
    *spec->flag = true;
  else
    take_value(*spec, next());
}

void CommandLine::take(const std::vector<std::string>& words) {
  const std::vector<std::string> known = long_names();
  std::size_t n = 0;
  const NextWord next = [&] {
    return n + 1 < words.size() ? std::optional(words[++n]) : std::nullopt;
  };
  bool only_operands = false;
  for (; n < words.size(); ++n) {
    const std::string& word = words[n];
    if (only_operands || word.size() < 2 || word[0] != '-' || (word[1] >= '0' && word[1] <= '9'))
      take_operand(word);
    else if (word == "--")
      only_operands = true;
    else if (std::ranges::find(known, "-" + word) != known.end()) // -voxel is not -v -o xel
      refuse("unexpected argument '" + word + "' (did you mean -" + word + "?)");
    else if (word[1] == '-')
      take_long(word, next);
    else
      take_short(word, next);
  }
}

void CommandLine::check_complete() const {
  for (const Operand& operand : operands)
    if (operand.count == 0 && operand.min_count > 0)
      refuse(operand.name + " is required");
  if (!unexpected_.empty()) {
    const std::string& wrong = unexpected_.front();
    refuse("unexpected argument '" + wrong + "'" +
           text::suggestion(wrong.substr(0, wrong.find('=')), long_names()));
  }
  for (const Operand& operand : operands)
    if (operand.count < operand.min_count)
      refuse("expected at least " + std::to_string(operand.min_count) + " " + operand.name);
}

// ---- OptionRef

namespace {
Spec& spec_of(void* spec) {
  return *static_cast<Spec*>(spec);
}
} // namespace

OptionRef& OptionRef::positive() {
  spec_of(spec_).must_be_positive = true;
  return *this;
}
OptionRef& OptionRef::range(double min, double max) {
  spec_of(spec_).min = min;
  spec_of(spec_).max = max;
  return *this;
}
OptionRef& OptionRef::one_of(std::vector<std::string> words) {
  spec_of(spec_).choices = std::move(words);
  return *this;
}
OptionRef& OptionRef::such_as(std::vector<std::string> words) {
  spec_of(spec_).proposals = std::move(words);
  return *this;
}
OptionRef& OptionRef::count(std::size_t n) {
  spec_of(spec_).list_count = n;
  return *this;
}

OptionRef& OptionRef::numbered(std::function<std::string&(std::int32_t)> value_of) {
  spec_of(spec_).set_numbered = [value_of = std::move(value_of)](
                                    std::int32_t n, std::string_view word) { value_of(n) = word; };
  return *this;
}

namespace {
template <class Value>
void read_numbered(Spec& spec, std::function<std::optional<Value>&(std::int32_t)> value_of) {
  spec.set_numbered = [&spec, value_of = std::move(value_of)](
                          std::int32_t n, std::string_view word) { spec.read(word, value_of(n)); };
}
} // namespace

OptionRef& OptionRef::numbered(std::function<std::optional<Vec3>&(std::int32_t)> value_of) {
  read_numbered(spec_of(spec_), std::move(value_of));
  return *this;
}
OptionRef& OptionRef::numbered(std::function<std::optional<double>&(std::int32_t)> value_of) {
  read_numbered(spec_of(spec_), std::move(value_of));
  return *this;
}

} // namespace gewebe::cli
