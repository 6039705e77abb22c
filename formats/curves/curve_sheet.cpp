#include "formats/curves/curve_sheet.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace gewebe {

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

/// The number with so many decimals, or with an exponent where it is long; -0 as 0.
std::string mark_text(double value, int decimals, bool exponent) {
  std::array<char, 400> text{};
  const auto end = exponent ? std::to_chars(text.data(), text.data() + text.size(), value,
                                            std::chars_format::general, 6)
                            : std::to_chars(text.data(), text.data() + text.size(), value,
                                            std::chars_format::fixed, decimals);
  return {text.data(), end.ptr};
}

} // namespace

CurveAxis round_axis(double min, double max, std::size_t count) {
  if (!(max - min > 1e-12 * std::max(std::abs(min), std::abs(max)))) {
    const double room = min == 0 ? 1 : std::abs(min) / 2;
    min -= room;
    max += room;
  }
  const double wanted = (max / 2 - min / 2) / static_cast<double>(count) * 2;
  double power = 1;
  int decimals = 0;
  for (; power > wanted && decimals < 320; ++decimals)
    power /= 10;
  for (; power * 10 <= wanted; --decimals)
    power *= 10;
  const double step = wanted > 5 * power   ? 10 * power
                      : wanted > 2 * power ? 5 * power
                      : wanted > power     ? 2 * power
                                           : power;
  if (step >= 10 * power)
    --decimals;
  // A hair is rounding, not another mark.
  const double first = std::floor(min / step + 1e-9), last = std::ceil(max / step - 1e-9);
  CurveAxis axis;
  const bool exponent = decimals > 6 || last * step >= 1e7 || first * step <= -1e7;
  const auto marks = static_cast<std::size_t>(last - first) + 1;
  for (std::size_t k = 0; k < marks; ++k) {
    axis.marks.push_back((first + static_cast<double>(k)) * step + 0.0);
    axis.texts.push_back(mark_text(axis.marks.back(), std::max(decimals, 0), exponent));
  }
  axis.min = axis.marks.front();
  axis.max = axis.marks.back();
  return axis;
}

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
  sheet.x = round_axis(in_x.min / unit_x.size, in_x.max / unit_x.size, 6);
  sheet.y = round_axis(in_y.min / unit_y.size, in_y.max / unit_y.size, 5);
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

} // namespace gewebe
