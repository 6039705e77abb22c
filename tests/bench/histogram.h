#pragma once
// How often each time came, by bins of equal ratios, as CSV and as a picture.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::timing {

struct Bin {
  double from = 0, to = 0; ///< ms
  std::size_t count = 0;
};

/// The time that this part of all did not exceed. \param sorted not empty
inline double quantile(std::span<const double> sorted, double part) {
  const double rank = std::ceil(part * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

/// Sixteen to a power of two. \param sorted positive, not empty
inline std::vector<Bin> histogram(std::span<const double> sorted) {
  constexpr double parts = 16;
  std::vector<Bin> bins;
  const double first = std::floor(parts * std::log2(sorted.front()));
  const auto edge = [&](std::size_t k) {
    return std::exp2((first + static_cast<double>(k)) / parts);
  };
  for (std::size_t at = 0, k = 0; at < sorted.size(); ++k) {
    Bin bin{edge(k), edge(k + 1), 0};
    for (; at < sorted.size() && sorted[at] < bin.to; ++at)
      ++bin.count;
    bins.push_back(bin);
  }
  return bins;
}

inline void write_csv(std::ostream& out, std::span<const Bin> bins) {
  out << "from_ms,to_ms,answers\n";
  for (const Bin& bin : bins)
    out << bin.from << ',' << bin.to << ',' << bin.count << '\n';
}

/// Bars of counts over times, both logarithmic, with lines at `marks`.
inline void draw(std::ostream& out, std::span<const Bin> bins, const std::string& title,
                 std::span<const std::pair<std::string, double>> marks) {
  constexpr double left = 60, top = 54, width = 560, height = 300;
  const double low = std::floor(std::log10(bins.front().from)),
               high = std::ceil(std::log10(std::max(bins.back().to, 1.0001)));
  const std::size_t highest = std::ranges::max_element(bins, {}, &Bin::count)->count;
  const double decades = std::ceil(std::log10(static_cast<double>(highest) + 1));
  const auto x = [&](double ms) { return left + (std::log10(ms) - low) / (high - low) * width; };
  // One answer is to be seen: counts begin at a half.
  const auto y = [&](double count) {
    const double half = std::log10(0.5);
    return top + height - (std::log10(count) - half) / (decades - half) * height;
  };
  out << "<svg xmlns='http://www.w3.org/2000/svg' width='660' height='420' viewBox='0 0 660 420' "
         "font-family='sans-serif' font-size='12'>\n<rect width='100%' height='100%' "
         "fill='white'/>\n<text x='"
      << left << "' y='20' font-size='14'>" << title << "</text>\n";
  for (double power = low; power <= high; ++power)
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double ms = digit * std::pow(10, power);
      if (ms > std::pow(10, high) * 1.001)
        break;
      out << "<path d='M" << x(ms) << ',' << top << " v" << height
          << "' stroke='#ddd'/><text text-anchor='middle' x='" << x(ms) << "' y='"
          << top + height + 18 << "'>" << ms << "</text>\n";
    }
  for (double power = 0; power <= decades; ++power)
    out << "<path d='M" << left << ',' << y(std::pow(10, power)) << " h" << width
        << "' stroke='#ddd'/><text text-anchor='end' x='" << left - 6 << "' y='"
        << y(std::pow(10, power)) + 4 << "'>" << std::pow(10, power) << "</text>\n";
  for (const Bin& bin : bins)
    if (bin.count > 0)
      out << "<rect x='" << x(bin.from) << "' y='" << y(static_cast<double>(bin.count))
          << "' width='" << x(bin.to) - x(bin.from) << "' height='"
          << top + height - y(static_cast<double>(bin.count)) << "' fill='#0072b2'/>\n";
  double row = 34;
  for (const auto& [name, ms] : marks) {
    out << "<path d='M" << x(ms) << ',' << row + 4 << " V" << top + height
        << "' stroke='#d55e00' stroke-dasharray='4 3'/><text x='" << x(ms) + 3 << "' y='" << row + 8
        << "' fill='#d55e00'>" << name << "</text>\n";
    row += 14;
  }
  out << "<text text-anchor='middle' x='" << left + width / 2 << "' y='" << top + height + 40
      << "'>ms</text>\n</svg>\n";
}

/// MB that a program has in memory by seconds, as a line from 0 up. \param points not empty
inline void draw_memory(std::ostream& out, std::span<const std::pair<double, double>> points,
                        const std::string& title) {
  constexpr double left = 60, top = 40, width = 560, height = 200;
  const double most =
      std::ranges::max_element(points, {}, &std::pair<double, double>::second)->second;
  const double last = std::max(points.back().first, 1e-3);
  out << "<svg xmlns='http://www.w3.org/2000/svg' width='660' height='300' viewBox='0 0 660 300' "
         "font-family='sans-serif' font-size='12'>\n<rect width='100%' height='100%' "
         "fill='white'/>\n<text x='"
      << left << "' y='20' font-size='14'>" << title << "</text>\n";
  for (int part = 0; part <= 4; ++part)
    out << "<path d='M" << left << ',' << top + height * (1 - 0.25 * part) << " h" << width
        << "' stroke='#ddd'/><text text-anchor='end' x='" << left - 6 << "' y='"
        << top + height * (1 - 0.25 * part) + 4 << "'>" << std::round(0.25 * part * most)
        << "</text><text text-anchor='middle' x='" << left + width * 0.25 * part << "' y='"
        << top + height + 18 << "'>" << std::round(0.25 * part * last) << "</text>\n";
  out << "<path fill='none' stroke='#0072b2' stroke-width='2' d='";
  const char* verb = "M";
  for (const auto& [second, megabytes] : points) {
    out << verb << left + width * second / last << ',' << top + height * (1 - megabytes / most);
    verb = " L";
  }
  out << "'/>\n<text text-anchor='middle' x='" << left + width / 2 << "' y='" << top + height + 40
      << "'>s; MB in memory</text>\n</svg>\n";
}

} // namespace gewebe::timing
