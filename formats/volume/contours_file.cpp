#include "formats/volume/contours_file.h"

#include "base/error.h"
#include "text/number_text.h"

#include <array>
#include <charconv>
#include <cmath>

namespace gewebe::formats {
namespace {

constexpr std::string_view separators = " \t\r\f\v,;";
constexpr const char* expected = ", expected x y z, or a blank line between contours";

/// Numbers of a line; an empty optional for a blank one.
bool parse_point(std::string_view line, const std::string& place, double unit, Vec3& point) {
  std::size_t count = 0;
  for (std::size_t begin = line.find_first_not_of(separators); begin != std::string_view::npos;
       begin = line.find_first_not_of(separators)) {
    line.remove_prefix(begin);
    const std::string_view word = line.substr(0, line.find_first_of(separators));
    line.remove_prefix(word.size());
    if (count == 3)
      throw Error(place, std::string("more than three numbers") + expected);
    const std::string_view digits = gewebe::text::without_plus(word);
    double value = 0;
    const auto [rest, status] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (status != std::errc{} || rest != digits.data() + digits.size())
      throw Error(place, "'" + std::string(word.substr(0, 40)) + "' is no number" + expected);
    point[static_cast<int>(count++)] = value * unit;
  }
  if (count == 0)
    return false;
  if (count < 3)
    throw Error(place, std::to_string(count) + (count == 1 ? " number" : " numbers") + expected);
  if (!is_finite(point))
    throw Error(place, "a coordinate is not finite");
  return true;
}

} // namespace

std::vector<labels::Contour> read_contours(std::string_view text, const std::string& name,
                                           double unit) {
  std::vector<labels::Contour> contours;
  labels::Contour contour;
  std::size_t number = 0, first = 0;
  const auto end_contour = [&] {
    if (contour.empty())
      return;
    const Vec3 gap = contour.back() - contour.front();
    if (contour.size() > 1 && dot(gap, gap) == 0)
      contour.pop_back();
    if (contour.size() < 3)
      throw Error(name + ":" + std::to_string(first),
                  "a contour of " + std::to_string(contour.size()) +
                      (contour.size() == 1 ? " point" : " points") + ", expected three or more");
    contours.push_back(std::move(contour));
    contour = {};
  };
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    const std::size_t comment = line.find('#');
    line = line.substr(0, comment);
    Vec3 point;
    if (parse_point(line, name + ":" + std::to_string(number), unit, point)) {
      if (contour.empty())
        first = number;
      contour.push_back(point);
    } else if (comment == std::string_view::npos)
      end_contour();
  }
  end_contour();
  if (contours.empty())
    throw Error(name, "no contour, expected lines of x y z");
  return contours;
}

} // namespace gewebe::formats
