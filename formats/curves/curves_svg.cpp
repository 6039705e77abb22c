#include "formats/curves/curve_sheet.h"

#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace gewebe::formats {

namespace {

// M. Okabe and K. Ito, Color Universal Design, 2008; yellow is left out, which is pale on white.
constexpr std::array<std::string_view, 7> colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                  "#56b4e9", "#e69f00", "#000000"};
constexpr std::array<std::string_view, 4> dashes{"", "8 4", "2 3", "10 3 2 3"};
constexpr double letter = 15, letter_width = 0.58 * letter; // px, of digits in common fonts

/// Pixels with at most two decimals.
std::string pixels(double value) {
  std::array<char, 64> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), std::round(100 * value) / 100 + 0.0);
  return {text.data(), end.ptr};
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text)
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else
      result += c;
  return result;
}

/// With the sign of micro where a unit has the letter u.
std::string shown_title(const std::string& title) {
  const std::size_t at = title.rfind("[u");
  return escaped(
      at == std::string::npos ? title : title.substr(0, at + 1) + "\u00b5" + title.substr(at + 2));
}

/// Characters, for the room of a text.
double letters_of(std::string_view text) {
  std::size_t count = 0;
  for (const char c : text)
    count += (static_cast<unsigned char>(c) & 0xc0U) != 0x80U ? 1 : 0;
  return static_cast<double>(count);
}

std::string text_at(double x, double y, std::string_view anchor, const std::string& text,
                    std::string_view more = "") {
  return "<text x=\"" + pixels(x) + "\" y=\"" + pixels(y) + "\" text-anchor=\"" +
         std::string(anchor) + "\"" + std::string(more) + ">" + text + "</text>\n";
}

std::string line_at(double x1, double y1, double x2, double y2, std::string_view more) {
  return "<path d=\"M" + pixels(x1) + " " + pixels(y1) + "L" + pixels(x2) + " " + pixels(y2) +
         "\" " + std::string(more) + "/>\n";
}

/// How the curve of that number is drawn.
std::string stroke_of(std::size_t k) {
  const std::string_view dash = dashes[k / colours.size() % dashes.size()];
  return "stroke=\"" + std::string(colours[k % colours.size()]) + "\" stroke-width=\"2\"" +
         (dash.empty() ? "" : " stroke-dasharray=\"" + std::string(dash) + "\"");
}

/// The rectangle of the curves, px.
struct Frame {
  double left = 0, right = 0, top = 0, bottom = 0;

  double x(const gewebe::text::RoundAxis& axis, double v) const {
    return left + (right - left) * ((v - axis.min) / (axis.max - axis.min));
  }
  double y(const gewebe::text::RoundAxis& axis, double v) const {
    return bottom - (bottom - top) * ((v - axis.min) / (axis.max - axis.min));
  }
};

/// Lines of the legend: names beside each other as they fit. Places from the left and the top.
struct LegendPlace {
  double x = 0, y = 0;
};
std::vector<LegendPlace> legend_places(const CurveSheet& sheet, double width) {
  std::vector<LegendPlace> places;
  double x = 0, y = 0;
  for (const Curve& curve : sheet.curves) {
    const double room = 50 + letter_width * letters_of(curve.name);
    if (x > 0 && x + room > width) {
      x = 0;
      y += 22;
    }
    places.push_back({x, y});
    x += room;
  }
  return places;
}

/// A curve, without points that add no pixel; a single point between gaps as a dot.
std::string path_of(const CurveSheet& sheet, const Curve& curve, const Frame& frame) {
  std::string path, last;
  bool down = false;
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    if (std::isnan(curve.x[k]) || std::isnan(curve.y[k])) {
      down = false;
      continue;
    }
    const std::string point =
        pixels(frame.x(sheet.x, curve.x[k])) + " " + pixels(frame.y(sheet.y, curve.y[k]));
    if (!down)
      path += "M" + point + "L" + point;
    else if (point != last)
      path += "L" + point;
    last = point;
    down = true;
  }
  return path;
}

std::string axes_of(const CurveSheet& sheet, const Frame& frame, double width, double height) {
  std::string svg;
  for (std::size_t k = 0; k < sheet.x.marks.size(); ++k) {
    const double x = frame.x(sheet.x, sheet.x.marks[k]);
    svg += line_at(x, frame.top, x, frame.bottom, "stroke=\"#dddddd\"");
    svg += line_at(x, frame.bottom, x, frame.bottom + 5, "stroke=\"#333333\"");
    svg += text_at(x, frame.bottom + 22, "middle", sheet.x.texts[k]);
  }
  for (std::size_t k = 0; k < sheet.y.marks.size(); ++k) {
    const double y = frame.y(sheet.y, sheet.y.marks[k]);
    svg += line_at(frame.left, y, frame.right, y, "stroke=\"#dddddd\"");
    svg += line_at(frame.left - 5, y, frame.left, y, "stroke=\"#333333\"");
    svg += text_at(frame.left - 9, y + 5, "end", sheet.y.texts[k]);
  }
  svg += "<path d=\"M" + pixels(frame.left) + " " + pixels(frame.top) + "V" + pixels(frame.bottom) +
         "H" + pixels(frame.right) + "\" fill=\"none\" stroke=\"#333333\"/>\n";
  const double middle = (frame.top + frame.bottom) / 2;
  svg += text_at((frame.left + frame.right) / 2, height - 14, "middle", shown_title(sheet.x.title));
  if (!sheet.y.title.empty())
    svg += text_at(22, middle, "middle", shown_title(sheet.y.title),
                   " transform=\"rotate(-90 22 " + pixels(middle) + ")\"");
  if (!sheet.title.empty())
    svg += text_at(width / 2, 26, "middle", escaped(sheet.title), " font-weight=\"bold\"");
  return svg;
}

} // namespace

std::string curves_svg(const CurveSheet& sheet, double width, double height) {
  double longest = 0;
  for (const std::string& text : sheet.y.texts)
    longest = std::fmax(longest, letters_of(text));
  Frame frame;
  frame.left = 46 + letter_width * longest;
  frame.right = width - 30;
  const bool legend = sheet.curves.size() > 1;
  const std::vector<LegendPlace> places = legend_places(sheet, frame.right - frame.left);
  const double names = sheet.title.empty() ? 24 : 50;
  frame.top = legend ? names + places.back().y + 16 : names - 4;
  frame.bottom = height - 62;
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + pixels(width) +
                    "\" height=\"" + pixels(height) + "\" viewBox=\"0 0 " + pixels(width) + " " +
                    pixels(height) + "\" font-family=\"sans-serif\" font-size=\"" + pixels(letter) +
                    "\" fill=\"#111111\">\n<rect width=\"100%\" height=\"100%\" "
                    "fill=\"white\"/>\n";
  svg += axes_of(sheet, frame, width, height);
  for (std::size_t k = 0; k < sheet.curves.size(); ++k) {
    svg += "<path d=\"" + path_of(sheet, sheet.curves[k], frame) +
           "\" fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\" " + stroke_of(k) +
           "/>\n";
    if (!legend)
      continue;
    const double x = frame.left + places[k].x, y = names + places[k].y;
    svg += line_at(x, y - 5, x + 26, y - 5, stroke_of(k));
    svg += text_at(x + 32, y, "start", escaped(sheet.curves[k].name));
  }
  return svg + "</svg>\n";
}

} // namespace gewebe::formats
