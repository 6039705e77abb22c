#include "tools/volume/voxelize_contours.h"

#include "formats/mesh/particles_file.h"
#include "formats/volume/contours_file.h"
#include "formats/volume/volume_file.h"
#include "labels/contour_density.h"
#include "tools/cli/report.h"

namespace gewebe::cli {

void voxelize_contours(cli::Run& run, const std::string& path, const std::string& unit,
                       double voxel, const VolumeOutput& to) {
  formats::Output output = open_volume(run);
  formats::Input input(path);
  const double scale = unit.empty() ? 1 : formats::unit_in_mm(unit);
  const std::vector<labels::Contour> contours = run.timed("read", [&] {
    return formats::read_contours(input.read_all(run.context().max_memory), input.name(), scale);
  });
  labels::ContourDensityReport report;
  const volume::Grid grid = run.timed("density", [&] {
    return at(input.name(),
              [&] { return labels::contour_density(run.context(), contours, voxel, &report); });
  });
  write(run, output, grid, to);

  cli::Stats& stats = run.stats();
  stats.set("axis", std::string(1, "xyz"[report.axis]));
  stats.set("slices", report.slices);
  stats.set("contours", report.contours);
  stats.set("points", report.points);
  stats.set("least_spacing", report.least_spacing);
  stats.set("greatest_spacing", report.greatest_spacing);
  cli::report_volume(run, grid);
}

} // namespace gewebe::cli
