#include "model/prony.h"

#include "base/error.h"
#include "text/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <system_error>

namespace gewebe::model {

namespace {

constexpr std::string_view prefix = "prony:";
constexpr std::size_t most_terms = 8;
constexpr double most_share = 0.99, least_time = 1e-6, most_time = 1e9;

std::string quoted(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + (word.size() > 40 ? "…'" : "'");
}

double number(std::string_view word, const char* what) {
  double value = 0;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (status != std::errc{} || rest != word.data() + word.size() || !std::isfinite(value))
    throw Error(quoted(word) + " is no " + what + " of a Prony series, expected a finite number");
  return value;
}

} // namespace

bool is_prony(std::string_view word) {
  return word.starts_with("prony");
}

std::vector<PronyTerm> parse_prony(std::string_view text) {
  if (!text.starts_with(prefix))
    throw Error(quoted(text) + " is no Prony series, expected prony:G@TAU,G@TAU,...");
  std::vector<PronyTerm> terms;
  for (std::size_t at = prefix.size(); at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string_view word = text.substr(at, end - at);
    at = end + 1;
    const std::size_t sign = word.find('@');
    if (sign == std::string_view::npos)
      throw Error(quoted(word) + " is no term of a Prony series, expected G@TAU such as 0.3@0.5");
    terms.push_back({number(word.substr(0, sign), "share"), number(word.substr(sign + 1), "time")});
  }
  check_prony(terms);
  return terms;
}

std::string prony_text(std::span<const PronyTerm> terms) {
  std::string text(prefix);
  for (std::size_t k = 0; k < terms.size(); ++k)
    text += (k == 0 ? "" : ",") + text::number_text(terms[k].share) + "@" +
            text::number_text(terms[k].time);
  return text;
}

void check_prony(std::span<const PronyTerm> terms) {
  if (terms.size() > most_terms)
    throw Error(std::to_string(terms.size()) + " terms of a Prony series, expected at most " +
                std::to_string(most_terms));
  double sum = 0, before = 0;
  for (const PronyTerm& term : terms) {
    if (!(term.share > 0))
      throw Error("a share of " + text::number_text(term.share) +
                  " in a Prony series, expected one above 0");
    if (!(term.time >= least_time && term.time <= most_time))
      throw Error("a time of " + text::number_text(term.time) + " s in a Prony series, expected " +
                  text::number_text(least_time) + " to " + text::number_text(most_time));
    if (!(term.time > before))
      throw Error("a time of " + text::number_text(term.time) + " s behind " +
                  text::number_text(before) + " s in a Prony series, expected ascending times");
    before = term.time;
    sum += term.share;
  }
  if (!(sum <= most_share))
    throw Error("shares of " + text::number_text(sum) +
                " together in a Prony series, expected at most " + text::number_text(most_share) +
                ": the rest is what stays for ever");
}

} // namespace gewebe::model
