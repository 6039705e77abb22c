#pragma once
// Curves y(x) on one sheet, drawn as SVG or as letters.

#include "formats/curves/number_table.h"
#include "text/round_axis.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace gewebe::formats {

struct Curve {
  std::string name;
  std::vector<double> x, y; ///< of equal length; NaN: a gap
};

struct CurveSheet {
  std::string title;
  gewebe::text::RoundAxis x, y;
  std::vector<Curve> curves;
};

/// Columns against one column. Large numbers get a larger unit: 23000 uN is 23 mN.
/// \throw UsageError if a column holds words, or the units of `ys` differ
/// \throw Error if no row has numbers in both, or a number is beyond 1e300
CurveSheet curve_sheet(const NumberColumn& x, std::span<const NumberColumn* const> ys,
                       const std::string& title);

/// SVG 1.1 of that size in pixels, from 200 x 150. Text is text, in the viewer's sans-serif font;
/// colours are those of Okabe and Ito, which colour-blind people can tell apart, with dashes
/// beyond.
std::string curves_svg(const CurveSheet& sheet, double width, double height);

/// Letters in lines of that many columns, from 40 x 10.
std::string curves_ascii(const CurveSheet& sheet, std::size_t columns, std::size_t lines);

} // namespace gewebe::formats
