#include "model/hyperelastic_law.h"

#include "base/error.h"
#include "text/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <span>
#include <system_error>
#include <vector>

namespace gewebe::model {

namespace {

constexpr std::array<std::string_view, 5> names{"neo-hookean", "classical-neo-hookean",
                                                "mooney-rivlin", "yeoh", "ogden"};

struct Parameter {
  std::string_view name;
  double least = 0, most = 0; ///< of its absolute value, unless 0
};

constexpr std::array<Parameter, 1> mooney_rivlin_parameters{{{"c01", 0, 10}}};
constexpr std::array<Parameter, 2> yeoh_parameters{{{"c20", 0, 1000}, {"c30", 0, 1000}}};
constexpr std::array<Parameter, 3> ogden_parameters{
    {{"alpha1", 0.1, 50}, {"alpha2", 0.1, 50}, {"mu2", 0, 10}}};

std::span<const Parameter> parameters_of(HyperelasticLaw::Kind kind) {
  switch (kind) {
  case HyperelasticLaw::mooney_rivlin:
    return mooney_rivlin_parameters;
  case HyperelasticLaw::yeoh:
    return yeoh_parameters;
  case HyperelasticLaw::ogden:
    return ogden_parameters;
  default:
    return {};
  }
}

std::string quoted(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + (word.size() > 40 ? "…'" : "'");
}

/// "a, b or c" of words.
template <class Words>
std::string any_of(const Words& words) {
  std::string text;
  for (std::size_t k = 0; k < words.size(); ++k)
    text += (k == 0 ? "" : k + 1 == words.size() ? " or " : ", ") + std::string(words[k]);
  return text;
}

std::string names_of(std::span<const Parameter> parameters) {
  std::vector<std::string_view> words;
  for (const Parameter& p : parameters)
    words.push_back(p.name);
  return any_of(words);
}

double parameter_value(std::string_view name, std::string_view word) {
  double value = 0;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (status != std::errc{} || rest != word.data() + word.size() || !std::isfinite(value))
    throw Error(quoted(word) + " is no " + std::string(name) + ", expected a finite number");
  return value;
}

} // namespace

std::string_view law_name(HyperelasticLaw::Kind kind) {
  return names[kind];
}

HyperelasticLaw parse_law(std::string_view text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const auto found = std::ranges::find(names, text.substr(0, colon));
  if (found == names.end())
    throw Error(quoted(text.substr(0, colon)) + " is no law, expected " + any_of(names));
  HyperelasticLaw law{static_cast<HyperelasticLaw::Kind>(found - names.begin()), {}};
  const std::span<const Parameter> parameters = parameters_of(law.kind);
  std::array<bool, 3> given{};
  for (std::size_t at = colon; at < text.size();) {
    const std::size_t end = std::min(text.find(',', at + 1), text.size());
    const std::string_view word = text.substr(at + 1, end - at - 1);
    at = end;
    const std::size_t sign = std::min(word.find('='), word.size());
    const auto p = std::ranges::find(parameters, word.substr(0, sign), &Parameter::name);
    if (parameters.empty())
      throw Error(quoted(word) + ": " + std::string(*found) + " has no parameters, expected none");
    if (p == parameters.end() || sign == word.size())
      throw Error(quoted(word) + " is no parameter of " + std::string(*found) + ", expected " +
                  names_of(parameters) + ", '=' and a number");
    const auto index = static_cast<std::size_t>(p - parameters.begin());
    if (given[index])
      throw Error("a second " + std::string(p->name) + ", expected one");
    given[index] = true;
    law.parameter[index] = parameter_value(p->name, word.substr(sign + 1));
  }
  check_law(law);
  return law;
}

std::string law_text(const HyperelasticLaw& law) {
  std::string text{law_name(law.kind)};
  char before = ':';
  const std::span<const Parameter> parameters = parameters_of(law.kind);
  for (std::size_t k = 0; k < parameters.size(); ++k)
    if (law.parameter[k] != 0) {
      text += before + std::string(parameters[k].name) + '=' + text::number_text(law.parameter[k]);
      before = ',';
    }
  return text;
}

void check_law(const HyperelasticLaw& law) {
  const std::span<const Parameter> parameters = parameters_of(law.kind);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const Parameter& p = parameters[k];
    const double value = law.parameter[k], size = std::abs(value);
    const std::string most = text::number_text(p.most), least = text::number_text(p.least);
    if (!(size <= p.most && (size >= p.least || size == 0)))
      throw Error(std::string(p.name) + " of " + text::number_text(value) +
                  " is out of range, expected " +
                  (p.least == 0 ? "-" + most + " to " + most
                                : least + " to " + most + " or -" + most + " to -" + least));
  }
  if (law.kind != HyperelasticLaw::ogden)
    return;
  if (law.parameter[0] == 0)
    throw Error("ogden without alpha1, expected ogden:alpha1=NUMBER");
  if ((law.parameter[1] == 0) != (law.parameter[2] == 0))
    throw Error("ogden with only one of alpha2 and mu2, expected both or none");
}

} // namespace gewebe::model
