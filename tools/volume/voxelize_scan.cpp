#include "tools/volume/voxelize_scan.h"

#include "formats/volume/grey_volume.h"
#include "formats/volume/volume_file.h"
#include "labels/grey_density.h"
#include "text/number_text.h"
#include "tools/cli/report.h"
#include "tools/cli/space_option.h"

#include <charconv>
#include <cmath>
#include <string_view>

namespace gewebe::cli {
namespace {

double threshold_of(std::string_view word, const std::string& text) {
  const std::string_view digits = text::without_plus(word);
  double value = 0;
  const auto [rest, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (status != std::errc{} || rest != digits.data() + digits.size() || !std::isfinite(value))
    throw UsageError("--threshold: '" + text +
                     "', expected numbers, as LOW, LOW,HIGH, \"LOW,\" or ,HIGH");
  return value;
}

} // namespace

Thresholds thresholds_from_text(const std::string& text) {
  Thresholds t{-HUGE_VAL, HUGE_VAL};
  const std::size_t comma = text.find(',');
  const std::string_view low = std::string_view(text).substr(0, comma);
  if (!low.empty() || comma == std::string::npos)
    t.low = threshold_of(low, text);
  const std::string_view high =
      comma == std::string::npos ? "" : std::string_view(text).substr(comma + 1);
  if (!high.empty() || (comma != std::string::npos && low.empty()))
    t.high = threshold_of(high, text);
  if (!(t.low < t.high))
    throw UsageError("--threshold: '" + text + "', expected the smaller number first");
  return t;
}

void check_thresholds(const std::string& text, bool labels, bool own_lattice) {
  (void)thresholds_from_text(text);
  if (labels)
    throw UsageError("--threshold is for grey values, --label for labels, expected one of both");
  if (own_lattice)
    throw UsageError("--threshold: the scan gives the lattice, expected --voxel or nothing");
}

void voxelize_scan(cli::Run& run, const std::string& path, const Thresholds& thresholds,
                   std::optional<double> voxel, const VolumeOutput& to) {
  formats::Output output = open_volume(run);
  formats::Input input(path);
  formats::GreyScan scan =
      run.timed("read", [&] { return formats::read_grey_volume(input, run.context()); });
  for (const std::string& warning : scan.warnings)
    run.warn(warning);
  VolumeOutput result = to;
  if (result.space == Space::lps)
    scan.volume.transform = other_space(scan.volume.transform);
  else
    result.space = Space::ras; // as read
  labels::GreyDensityReport report;
  const volume::Grid grid = run.timed("density", [&] {
    return at(input.name(), [&] {
      return labels::grey_density(run.context(), scan.volume,
                                  {thresholds.low, thresholds.high, voxel}, &report);
    });
  });
  if (report.missing > 0)
    run.warn(input.name() + ": " + std::to_string(report.missing) +
             " voxels have no value (NaN) and count as outside");
  write(run, output, grid, result);

  cli::Stats& stats = run.stats();
  stats.set("format", scan.format);
  stats.set("grey_min", static_cast<double>(report.min));
  stats.set("grey_max", static_cast<double>(report.max));
  stats.set("voxels_within", report.voxels);
  stats.set("voxels_missing", report.missing);
  stats.set("width", report.width);
  stats.set("spacing", scan.volume.transform.voxel_size());
  stats.set("shear", report.shear);
  cli::report_volume(run, grid);
}

} // namespace gewebe::cli
