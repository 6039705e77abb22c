#pragma once
// What tests/validate found: checks with their bounds, curves of work and error, and the page that
// shows them.

#include "tests/unit/solid_bodies.h"

#include <cstddef>
#include <string>
#include <vector>

namespace gewebe::validate {

/// What an answer took: of the processor, on one thread.
struct Cost {
  std::size_t unknowns = 0;
  double assembly = 0, factor = 0, solve = 0; ///< ms
  double factor_mb = 0;                       ///< of its numbers

  double total() const { return assembly + factor + solve; }
};

/// A line of the table.
struct Check {
  std::string what, source;
  std::string reference, figure; ///< as they are to be read
  double error = 0, bound = 0;   ///< passes if error <= bound, which a NaN is not
  std::string error_text = {};   ///< nothing: the error in per cent, or as it is below 1e-4
  Cost cost = {};
  bool skipped = false; ///< for want of what `figure` says
  bool judged = true;   ///< else the figure is there to compare with

  bool passes() const { return skipped || !judged || error <= bound; }
};

struct Point {
  double x, y;
};
struct Curve {
  std::string name;
  std::vector<Point> points;
};
/// Curves on logarithmic axes, with marks; or on even ones, without.
struct Plot {
  std::string file, title, x, y;
  std::vector<Curve> curves;
  bool even = false;
};

struct Section {
  std::string title;
  std::string text; ///< Markdown, before the table
  std::vector<Check> checks;
  std::vector<Plot> plots;
  std::string after = {}; ///< Markdown, after the plots
};

/// A number as tables have it.
std::string text_of(double number, int digits = 4);
std::string percent(double share);

Check skipped(const std::string& what, const std::string& source, const std::string& why);

/// A plot as SVG: a panel, ticks at powers of ten, a legend beside it.
std::string svg(const Plot& plot);

/// The page, README.md, and its plots in a folder. \throw Error
void write_page(const std::string& folder, const std::vector<Section>& sections);
/// The table of a section on standard output.
void print(const Section& section);

struct Answer {
  std::vector<double> u;
  Cost cost;
};
/// One thread; the processor's time.
Answer solve(const test::SolidCase& c);
/// The figure of a case, and what it took.
struct Figure {
  double value;
  Cost cost;
};
Figure figure_of(const test::SolidCase& c);

// The sections, one file each.
Section constant_strain();
Section manufactured();
Section benchmarks();
Section error_estimates();
Section hertz();
Section contact_potentials();
Section sliding();
Section passivity();
Section hand();
Section peers();
Section strained_peers();
Section silicone();
Section swings();
Section organs();

} // namespace gewebe::validate
