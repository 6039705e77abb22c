#include "formats/curves/curve_sheet.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace gewebe::formats {

namespace {

constexpr std::string_view letters = "*o+x#@%&";

/// A rectangle of letters, from the upper left.
struct Letters {
  std::vector<std::string> lines;

  Letters(std::size_t columns, std::size_t rows) : lines(rows, std::string(columns, ' ')) {}
  /// What lies beyond an edge is left out.
  void put(std::size_t column, std::size_t line, std::string_view text) {
    for (std::size_t k = 0; k < text.size() && column + k < lines[line].size(); ++k)
      lines[line][column + k] = text[k];
  }
};

/// Cell of a value on an axis of so many cells.
std::size_t cell_of(const gewebe::text::RoundAxis& axis, double value, std::size_t cells) {
  return static_cast<std::size_t>(
      std::lround((value - axis.min) / (axis.max - axis.min) * static_cast<double>(cells - 1)));
}

} // namespace

std::string curves_ascii(const CurveSheet& sheet, std::size_t columns, std::size_t lines) {
  std::size_t left = 0;
  for (const std::string& text : sheet.y.texts)
    left = std::max(left, text.size() + 2);
  const std::size_t width = columns - left - 4, height = lines - 4;
  Letters page(columns, height + 2);
  for (std::size_t row = 0; row < height; ++row)
    page.put(left - 1, row, "|");
  for (std::size_t k = 0; k < sheet.y.marks.size(); ++k) {
    const std::size_t row = height - 1 - cell_of(sheet.y, sheet.y.marks[k], height);
    page.put(left - 2 - sheet.y.texts[k].size(), row, sheet.y.texts[k]);
    page.put(left - 1, row, "+");
  }
  page.put(left - 1, height, "+" + std::string(width, '-'));
  std::size_t free = 0; // column from which a text may begin
  for (std::size_t k = 0; k < sheet.x.marks.size(); ++k) {
    const std::size_t column = left + cell_of(sheet.x, sheet.x.marks[k], width);
    const std::string& text = sheet.x.texts[k];
    page.put(column, height, "+");
    const std::size_t start = column - std::min(column, text.size() / 2);
    if (start < free || start + text.size() > columns)
      continue;
    page.put(start, height + 1, text);
    free = start + text.size() + 1;
  }
  for (std::size_t c = 0; c < sheet.curves.size(); ++c)
    for (std::size_t k = 0; k < sheet.curves[c].x.size(); ++k) {
      const double x = sheet.curves[c].x[k], y = sheet.curves[c].y[k];
      if (std::isnan(x) || std::isnan(y))
        continue;
      page.put(left + cell_of(sheet.x, x, width), height - 1 - cell_of(sheet.y, y, height),
               letters.substr(c % letters.size(), 1));
    }
  std::string text = sheet.title.empty() ? "" : sheet.title + "\n";
  if (sheet.curves.size() == 1)
    text += sheet.y.title + "\n";
  else
    for (std::size_t c = 0; c < sheet.curves.size(); ++c)
      text += (c == 0 ? "" : "  ") + std::string(letters.substr(c % letters.size(), 1)) + " " +
              sheet.curves[c].name;
  if (sheet.curves.size() > 1)
    text += (sheet.y.title.empty() ? "" : "  " + sheet.y.title) + "\n";
  for (std::string& line : page.lines) {
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  const std::size_t room =
      left + width > sheet.x.title.size() ? left + width : sheet.x.title.size();
  return text + std::string(room - sheet.x.title.size(), ' ') + sheet.x.title + "\n";
}

} // namespace gewebe::formats
