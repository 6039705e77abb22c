#include "tests/validate/checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace gewebe::validate {

namespace {

const char* verdict(const Check& c) {
  return c.skipped ? "skipped" : !c.judged ? "shown" : c.passes() ? "passed" : "**failed**";
}

std::string error_of(const Check& c) {
  if (c.skipped || !c.judged)
    return "";
  return !c.error_text.empty() ? c.error_text
         : c.error < 1e-4      ? text_of(c.error, 2)
                               : percent(c.error);
}

std::string bound_of(const Check& c) {
  return c.skipped || !c.judged                    ? ""
         : c.bound < 1e-4 || !c.error_text.empty() ? text_of(c.bound, 2)
                                                   : text_of(100 * c.bound, 3) + " %";
}

/// Columns of a line, those without a number empty.
std::array<std::string, 8> columns(const Check& c) {
  const auto if_any = [](double x, const std::string& text) { return x > 0 ? text : ""; };
  return {c.what,
          c.reference,
          c.figure,
          error_of(c),
          bound_of(c),
          if_any(static_cast<double>(c.cost.unknowns), std::to_string(c.cost.unknowns)),
          if_any(c.cost.factor_mb, text_of(c.cost.factor_mb, 3)),
          if_any(c.cost.total(), text_of(c.cost.total() / 1000, 2))};
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return result;
}

constexpr double panel_width = 460, panel_height = 330, left = 74, top = 40, legend = 240;
constexpr std::array<const char*, 8> colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                             "#e69f00", "#56b4e9", "#000000", "#8c564b"};

/// An axis with whole powers of ten at its ends, or a half of one where that is nearer.
struct Axis {
  double low = HUGE_VAL, high = -HUGE_VAL; ///< decadic logarithms
  double from, length;                     ///< pixels; a negative length goes up

  bool even = false; ///< not logarithmic

  double scaled(double value) const { return even ? value : std::log10(value); }
  void add(double value) {
    low = test::smaller(low, scaled(value));
    high = test::larger(high, scaled(value));
  }
  void round() {
    const double room = 0.04 * (even ? high - low : std::max(high - low, 0.5));
    low -= room;
    high += room;
  }
  double at(double value) const { return from + (scaled(value) - low) / (high - low) * length; }
  /// Powers of ten, with 2 and 5 times them where there are few; multiples of one of these, if
  /// even.
  std::vector<double> ticks() const {
    std::vector<double> result;
    if (even) {
      double step = std::pow(10.0, std::floor(std::log10(high - low)));
      for (const double part : {0.5, 0.4, 0.5}) // 5, 2, 1 of the power below
        if ((high - low) / step < 4)
          step *= part;
      for (double k = std::ceil(low / step); k * step <= high; ++k)
        result.push_back(k == 0 ? 0 : k * step); // no -0
      return result;
    }
    for (const bool fine : {false, true}) {
      result.clear();
      for (int power = static_cast<int>(std::floor(low)); power <= high; ++power)
        for (const double digit : {1.0, 2.0, 5.0}) {
          const double value = digit * std::pow(10.0, power), place = std::log10(value);
          if ((digit == 1 || fine) && place >= low && place <= high)
            result.push_back(value);
        }
      if (result.size() >= 3)
        break;
    }
    return result;
  }
};

std::string mark(std::size_t kind, double x, double y, const std::string& colour) {
  std::ostringstream out;
  switch (kind % 4) {
  case 0:
    out << "<circle cx='" << x << "' cy='" << y << "' r='3.6' fill='" << colour << "'/>";
    break;
  case 1:
    out << "<rect x='" << x - 3.3 << "' y='" << y - 3.3 << "' width='6.6' height='6.6' fill='"
        << colour << "'/>";
    break;
  case 2:
    out << "<path d='M" << x << ',' << y - 4.4 << " l4.2,7.4 h-8.4 z' fill='" << colour << "'/>";
    break;
  default:
    out << "<path d='M" << x << ',' << y - 4.6 << " l4.6,4.6 l-4.6,4.6 l-4.6,-4.6 z' fill='"
        << colour << "'/>";
  }
  return out.str();
}

} // namespace

std::string svg(const Plot& plot) {
  Axis x{.from = left, .length = panel_width, .even = plot.even},
      y{.from = top + panel_height, .length = -panel_height, .even = plot.even};
  for (const Curve& curve : plot.curves)
    for (const Point& p : curve.points) {
      x.add(p.x);
      y.add(p.y);
    }
  x.round();
  y.round();
  const double width = left + panel_width + legend, height = top + panel_height + 56,
               right = left + panel_width, bottom = top + panel_height;
  std::ostringstream out;
  out.precision(5);
  out << "<svg xmlns='http://www.w3.org/2000/svg' width='" << width << "' height='" << height
      << "' viewBox='0 0 " << width << ' ' << height
      << "' font-family='sans-serif' font-size='12'>\n<rect width='100%' height='100%' "
         "fill='white'/>\n<text x='"
      << left << "' y='24' font-size='14'>" << escaped(plot.title) << "</text>\n";
  for (const double tick : x.ticks())
    out << "<path d='M" << x.at(tick) << ',' << top << " V" << bottom
        << "' stroke='#ddd'/><text text-anchor='middle' x='" << x.at(tick) << "' y='" << bottom + 18
        << "'>" << text_of(tick, 3) << "</text>\n";
  for (const double tick : y.ticks())
    out << "<path d='M" << left << ',' << y.at(tick) << " H" << right
        << "' stroke='#ddd'/><text text-anchor='end' x='" << left - 6 << "' y='" << y.at(tick) + 4
        << "'>" << text_of(tick, 3) << "</text>\n";
  out << "<rect x='" << left << "' y='" << top << "' width='" << panel_width << "' height='"
      << panel_height << "' fill='none' stroke='black'/>\n<text text-anchor='middle' x='"
      << left + panel_width / 2 << "' y='" << bottom + 42 << "'>" << escaped(plot.x)
      << "</text>\n<text text-anchor='middle' transform='translate(18," << top + panel_height / 2
      << ") rotate(-90)'>" << escaped(plot.y) << "</text>\n";
  for (std::size_t k = 0; k < plot.curves.size(); ++k) {
    const Curve& curve = plot.curves[k];
    const std::string colour = colours[k % colours.size()];
    out << "<polyline fill='none' stroke-width='1.6' stroke='" << colour << "' points='";
    for (const Point& p : curve.points)
      out << x.at(p.x) << ',' << y.at(p.y) << ' ';
    out << "'/>\n";
    for (const Point& p : plot.even ? std::vector<Point>{} : curve.points)
      out << mark(k, x.at(p.x), y.at(p.y), colour);
    const double line = top + 14 + 20 * static_cast<double>(k);
    out << "\n<path d='M" << right + 14 << ',' << line << " h24' stroke-width='1.6' stroke='"
        << colour << "'/>" << (plot.even ? "" : mark(k, right + 26, line, colour)) << "<text x='"
        << right + 44 << "' y='" << line + 4 << "'>" << escaped(curve.name) << "</text>\n";
  }
  out << "</svg>\n";
  return out.str();
}

void print(const Section& section) {
  std::printf("%s\n", section.title.c_str());
  for (const Check& c : section.checks) {
    const auto [what, reference, figure, error, bound, unknowns, memory, time] = columns(c);
    std::printf(
        "  %-8s %s: %s (expected %s), error %s, bound %s; %s unknowns, factor %s MB, %s s\n",
        verdict(c), what.c_str(), figure.c_str(), reference.c_str(), error.c_str(), bound.c_str(),
        unknowns.c_str(), memory.c_str(), time.c_str());
  }
  (void)std::fflush(stdout);
}

void write_page(const std::string& folder, const std::vector<Section>& sections) {
  std::filesystem::create_directories(folder);
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream file(std::filesystem::path(folder) / name, std::ios::binary);
    file << text;
    if (!file.flush())
      throw Error(name + " can't be written into " + folder);
  };
  std::ostringstream page;
  page
      << "# Do the finite elements compute what is right?\n\n"
         "`make validate` wrote this page. It compares the finite elements of `lib/fem` with "
         "theory, benchmarks, another program and an experiment. Each line has a bound; the "
         "command fails if one is exceeded. Times are processor times of assembly, factorisation "
         "and solution on one thread; memory is that of the factor. Curves show error over time.\n";
  for (const Section& section : sections) {
    page << "\n## " << section.title << "\n\n" << section.text << "\n";
    if (!section.checks.empty())
      page << "\n| what | reference | Gewebe | error | bound | unknowns | factor, MB | s | |\n"
              "|---|---|---|---|---|---|---|---|---|\n";
    for (const Check& c : section.checks) {
      for (const std::string& text : columns(c))
        page << "| " << text << ' ';
      page << "| " << verdict(c) << " |\n";
    }
    std::vector<std::string> sources;
    for (const Check& c : section.checks)
      if (std::ranges::find(sources, c.source) == sources.end() && !c.source.empty())
        sources.push_back(c.source);
    for (const std::string& source : sources)
      page << (&source == sources.data() ? "\nSources: " : "; ") << source;
    page << (sources.empty() ? "" : ".\n");
    for (const Plot& plot : section.plots) {
      write(plot.file, svg(plot));
      page << "\n![" << plot.title << "](" << plot.file << ")\n";
    }
    if (!section.after.empty())
      page << '\n' << section.after << '\n';
  }
  write("README.md", page.str());
}

} // namespace gewebe::validate
