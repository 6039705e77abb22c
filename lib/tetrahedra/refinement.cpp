#include "tetrahedra/refinement.h"

#include "base/error.h"
#include "text/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace gewebe::tetrahedra {
namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ')
    text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ')
    text.remove_suffix(1);
  return text;
}

[[noreturn]] void refuse(std::string_view text, const std::string& expected) {
  throw Error("'" + std::string(text) + "', expected " + expected);
}

double number(std::string_view word, std::string_view whole, const std::string& expected) {
  double value = 0;
  const std::string_view digits = text::without_plus(trimmed(word));
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
    refuse(whole, expected);
  return value;
}

std::vector<double> numbers(std::string_view list, std::size_t count, std::string_view whole,
                            const std::string& expected) {
  std::vector<double> result;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t comma = std::min(list.find(',', begin), list.size());
    result.push_back(number(list.substr(begin, comma - begin), whole, expected));
    begin = comma + 1;
  }
  if (result.size() != count)
    refuse(whole, expected);
  return result;
}

void add_term(std::string_view term, RefinedRegion& region) {
  const std::size_t colon = std::min(term.find(':'), term.size());
  const std::string_view name = term.substr(0, colon),
                         rest = term.substr(std::min(colon + 1, term.size()));
  if (term == "surface") {
    region.surface = true;
  } else if (name == "sphere") {
    const std::string expected = "sphere:X,Y,Z,R with a radius above 0";
    const auto n = numbers(rest, 4, term, expected);
    if (!(n[3] > 0))
      refuse(term, expected);
    region.spheres.push_back({{n[0], n[1], n[2]}, n[3]});
  } else if (name == "box") {
    const std::string expected = "box:X0,Y0,Z0,X1,Y1,Z1, the low corner first";
    const auto n = numbers(rest, 6, term, expected);
    if (!(n[0] <= n[3] && n[1] <= n[4] && n[2] <= n[5]))
      refuse(term, expected);
    Box3 box;
    box.add({n[0], n[1], n[2]});
    box.add({n[3], n[4], n[5]});
    region.boxes.push_back(box);
  } else if (name == "label") {
    const std::string expected = "label:N with a whole number N";
    const double label = number(rest, term, expected);
    if (!(label >= 0 && label <= INT32_MAX && label == std::floor(label)))
      refuse(term, expected);
    region.materials.push_back(static_cast<std::int32_t>(label));
  } else
    refuse(term, "sphere:X,Y,Z,R, box:X0,Y0,Z0,X1,Y1,Z1, surface or label:N");
}

RefinedRegion parse_region(std::string_view text) {
  RefinedRegion region;
  region.text = text;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos)
    refuse(text, "SELECTOR:SIZE, such as sphere:0,0,50,8:2");
  const std::string expected = "a size of cells in mm above 0 behind the last colon";
  region.cell = number(text.substr(colon + 1), text, expected);
  if (!(region.cell > 0))
    refuse(text, expected);
  constexpr std::string_view between = " and ";
  const std::string_view terms = text.substr(0, colon);
  for (std::size_t begin = 0; begin <= terms.size();) {
    const std::size_t end = std::min(terms.find(between, begin), terms.size());
    add_term(trimmed(terms.substr(begin, end - begin)), region);
    begin = end + between.size();
  }
  return region;
}

} // namespace

std::vector<RefinedRegion> parse_refinement(std::string_view text) {
  std::vector<RefinedRegion> regions;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    regions.push_back(parse_region(trimmed(text.substr(begin, end - begin))));
    begin = end + 1;
  }
  return regions;
}

} // namespace gewebe::tetrahedra
