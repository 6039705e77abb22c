#include "formats/curves/curve_sheet.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gewebe::formats {

namespace {

constexpr double largest_number = 1e300;

/// A unit, and how many of the units of the table it is.
struct Unit {
  std::string name;
  double size = 1;
};

/// The largest unit of its kind in which the largest number is 1 or more.
Unit readable_unit(const std::string& unit, double largest) {
  static const std::array<std::vector<Unit>, 3> kinds{{
      {{"uN", 1}, {"mN", 1e3}, {"N", 1e6}},
      {{"nN m", 1}, {"uN m", 1e3}, {"mN m", 1e6}, {"N m", 1e9}},
      {{"Pa", 1}, {"kPa", 1e3}, {"MPa", 1e6}},
  }};
  for (const std::vector<Unit>& kind : kinds) {
    if (kind.front().name != unit)
      continue;
    Unit best = kind.front();
    for (const Unit& larger : kind)
      if (largest >= larger.size)
        best = larger;
    return best;
  }
  return {unit, 1};
}

void require_numbers(const NumberColumn& column) {
  if (!column.words.empty())
    throw UsageError("column '" + column.name + "' has words: " + column.words +
                     ", expected a column of numbers");
}

std::string axis_title(const std::string& name, const std::string& unit) {
  return name + (unit.empty() ? "" : " [" + unit + "]");
}

/// Smallest and largest number, and the largest absolute value.
struct Extremes {
  double min = HUGE_VAL, max = -HUGE_VAL;
  void add(double v) {
    if (!(std::abs(v) <= largest_number))
      throw Error("a number beyond 1e300, expected smaller ones");
    if (v < min)
      min = v;
    if (v > max)
      max = v;
  }
  double size() const { return std::max(std::abs(min), std::abs(max)); }
};

} // namespace

CurveSheet curve_sheet(const NumberColumn& x, std::span<const NumberColumn* const> ys,
                       const std::string& title) {
  require_numbers(x);
  Extremes in_x, in_y;
  for (const NumberColumn* const y : ys) {
    require_numbers(*y);
    if (y->unit != ys[0]->unit)
      throw UsageError("'" + axis_title(ys[0]->name, ys[0]->unit) + "' and '" +
                       axis_title(y->name, y->unit) +
                       "' have different units, expected columns of one unit");
    bool any = false;
    for (std::size_t row = 0; row < x.values.size(); ++row) {
      if (std::isnan(x.values[row]) || std::isnan(y->values[row]))
        continue;
      in_x.add(x.values[row]);
      in_y.add(y->values[row]);
      any = true;
    }
    if (!any)
      throw Error("no row has numbers of '" + x.name + "' and '" + y->name +
                  "', expected some with both");
  }
  const Unit unit_x = readable_unit(x.unit, in_x.size()),
             unit_y = readable_unit(ys[0]->unit, in_y.size());
  CurveSheet sheet;
  sheet.title = title;
  sheet.x = gewebe::text::round_axis(in_x.min / unit_x.size, in_x.max / unit_x.size, 6);
  sheet.y = gewebe::text::round_axis(in_y.min / unit_y.size, in_y.max / unit_y.size, 5);
  sheet.x.title = axis_title(x.name, unit_x.name);
  for (const NumberColumn* const y : ys) {
    Curve& curve = sheet.curves.emplace_back();
    curve.name = y->name;
    for (std::size_t row = 0; row < x.values.size(); ++row) {
      curve.x.push_back(x.values[row] / unit_x.size);
      curve.y.push_back(y->values[row] / unit_y.size);
    }
  }
  sheet.y.title = ys.size() == 1        ? axis_title(ys[0]->name, unit_y.name)
                  : unit_y.name.empty() ? std::string()
                                        : "[" + unit_y.name + "]";
  return sheet;
}

} // namespace gewebe::formats
