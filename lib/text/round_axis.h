#pragma once
// Axes and scales with round numbers.

#include <cstddef>
#include <string>
#include <vector>

namespace gewebe::text {

/// Range of an axis, from one round number to another, and the numbers at its marks.
struct RoundAxis {
  double min = 0, max = 1;
  std::vector<double> marks;      ///< ascending, at least two
  std::vector<std::string> texts; ///< of the marks, all with the same number of decimals
  std::string title;              ///< with unit
};

/// Round numbers (1, 2 or 5 times a power of ten apart) that enclose min and max, about `count`.
/// \pre finite, min <= max
RoundAxis round_axis(double min, double max, std::size_t count);

/// The longest round length (1, 2 or 5 times a power of ten) of up to `most`; 0 where that is not
/// positive.
double round_length(double most);

} // namespace gewebe::text
