#include "tools/mesh/surface_choice.h"

#include "base/error.h"

#include <charconv>
#include <cmath>
#include <string_view>

namespace gewebe::cli {

mesh::ComponentChoice component_choice(const std::string& text) {
  mesh::ComponentChoice choice;
  if (text.empty())
    return choice;
  if (text == "largest") {
    choice.largest = 1;
    return choice;
  }
  const std::string_view volume = "min-volume:";
  const bool by_volume = text.starts_with(volume);
  const char* const begin = text.data() + (by_volume ? volume.size() : 0);
  const char* const end = text.data() + text.size();
  const auto [rest, error] = by_volume ? std::from_chars(begin, end, choice.min_volume)
                                       : std::from_chars(begin, end, choice.largest);
  if (error != std::errc() || rest != end || choice.largest == 0 ||
      !(choice.min_volume >= 0 && choice.min_volume < HUGE_VAL))
    throw UsageError("--components: '" + text +
                     "', expected largest, a number of components or min-volume:V");
  return choice;
}

Box3 box_of(const std::vector<double>& numbers) {
  Box3 box;
  if (numbers.empty())
    return box;
  box.min = {numbers[0], numbers[1], numbers[2]};
  box.max = {numbers[3], numbers[4], numbers[5]};
  for (int a = 0; a < 3; ++a)
    if (!(box.min[a] < box.max[a]))
      throw UsageError("--bbox: the box is empty, expected X0 < X1, Y0 < Y1 and Z0 < Z1");
  return box;
}

} // namespace gewebe::cli
