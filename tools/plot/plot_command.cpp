#include "tools/plot/plot_command.h"

#include "base/error.h"
#include "formats/curves/curve_sheet.h"
#include "formats/curves/number_table.h"
#include "formats/stream/stream.h"
#include "tools/cli/cli.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>

namespace gewebe::cli {

namespace {

struct PlotArguments {
  std::string table = "-", x, y, title;
  std::vector<double> size;
};

/// Words between commas.
std::vector<std::string> names_in(std::string_view list) {
  std::vector<std::string> names;
  for (std::size_t start = 0; start <= list.size();) {
    const std::size_t end = std::min(list.find(',', start), list.size());
    names.emplace_back(list.substr(start, end - start));
    start = end + 1;
  }
  return names;
}

/// Size of the drawing: that of --size, or the default of its kind. \throw UsageError
std::vector<double> drawing_size(const PlotArguments& in, formats::Kind kind) {
  const bool ascii = kind == formats::Kind::ascii;
  const std::array<std::int64_t, 2> smallest =
      ascii ? std::array<std::int64_t, 2>{40, 10} : std::array<std::int64_t, 2>{200, 150};
  const std::int64_t largest = ascii ? 1000 : 10000;
  if (in.size.empty())
    return ascii ? std::vector<double>{78, 24} : std::vector<double>{800, 500};
  for (std::size_t k = 0; k < 2; ++k)
    if (!(in.size[k] >= static_cast<double>(smallest[k]) &&
          in.size[k] <= static_cast<double>(largest)) ||
        in.size[k] != static_cast<double>(static_cast<std::int64_t>(in.size[k])))
      throw UsageError("--size: expected two whole numbers of " + std::to_string(smallest[0]) +
                       "," + std::to_string(smallest[1]) + " to " + std::to_string(largest) + "," +
                       std::to_string(largest));
  return in.size;
}

void work(cli::Run& run, const PlotArguments& in) {
  const bool terminal = run.output() == "-" && ::isatty(1) != 0;
  const formats::Kind kind = formats::output_kind(
      run.to(), run.output(), terminal ? formats::Kind::ascii : formats::Kind::svg,
      {formats::Kind::svg, formats::Kind::ascii});
  const std::vector<double> size = drawing_size(in, kind);
  formats::Output output(run.output(), run.output_options(false));
  formats::Input input(in.table, false);
  const formats::NumberTable table = formats::read_number_table(input.read_all(), input.name());
  if (in.y.empty())
    throw UsageError("--y is required, expected some of " + formats::column_list(table));
  const formats::NumberColumn& x =
      in.x.empty() ? table.columns.front() : formats::find_column(table, in.x);
  std::vector<const formats::NumberColumn*> ys;
  for (const std::string& name : names_in(in.y))
    ys.push_back(&formats::find_column(table, name));
  const formats::CurveSheet sheet =
      at(input.name(), [&] { return formats::curve_sheet(x, ys, in.title); });
  run.stats().set("rows", static_cast<std::uint64_t>(x.values.size()));
  run.stats().set("curves", static_cast<std::uint64_t>(ys.size()));
  output.write(kind == formats::Kind::svg
                   ? formats::curves_svg(sheet, size[0], size[1])
                   : formats::curves_ascii(sheet, static_cast<std::size_t>(size[0]),
                                           static_cast<std::size_t>(size[1])));
  output.commit();
}

} // namespace

int run_plot(int argc, char** argv) {
  cli::Program p("gewebe plot", "Draws columns of a table against each other, as curves.");
  PlotArguments in;
  p.option("--x", in.x, "NAME", "column along the horizontal axis; default: the first one");
  p.option("--y", in.y, "NAME,...", "columns along the vertical axis, of one unit");
  p.option("--title", in.title, "TEXT", "text above the curves");
  p.option("--size", in.size, "W,H",
           "size in pixels, or in letters for ascii; default: 800,500 or 78,24")
      .count(2);
  p.output_kinds({formats::Kind::svg, formats::Kind::ascii});
  p.operand("TABLE", in.table, "CSV with names in its first line, - for standard input");
  return p.run(argc, argv, [&](cli::Run& run) { work(run, in); });
}

} // namespace gewebe::cli
