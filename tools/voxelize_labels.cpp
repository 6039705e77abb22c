#include "tools/voxelize_labels.h"

#include "formats/label_volume.h"
#include "formats/volume_file.h"
#include "tools/report.h"
#include "volume/label_density.h"

#include <cmath>

namespace gewebe {

std::vector<std::int64_t> labels_from_numbers(const std::vector<double>& numbers) {
  std::vector<std::int64_t> labels;
  for (const double number : numbers) {
    if (!(std::fabs(number) < 0x1p53) || number != std::trunc(number))
      throw UsageError("--label: expected whole numbers");
    labels.push_back(static_cast<std::int64_t>(number));
  }
  return labels;
}

void voxelize_labels(cli::Run& run, const std::string& path,
                     const std::vector<std::int64_t>& labels, std::optional<double> voxel) {
  (void)output_kind(run.to(), run.output(), Kind::vdb, {Kind::vdb});
  Output output(run.output(), run.output_options(true));
  Input input(path);
  const LabelVolume volume =
      run.timed("read", [&] { return read_label_volume(input, labels, run.context()); });
  for (const std::string& warning : volume.warnings)
    run.warn(warning);
  LabelDensityReport report;
  const Grid grid = run.timed("density", [&] {
    return at(input.name(),
              [&] { return label_density(run.context(), volume.mask, {voxel}, &report); });
  });
  run.timed("write", [&] { write_volume(output, grid, run.context()); });
  output.commit();

  cli::Stats& stats = run.stats();
  stats.set("format", volume.format);
  stats.set("label_values", volume.labels.size());
  stats.set("label_voxels", report.voxels);
  stats.set("label_volume", report.volume);
  stats.set("spacing", volume.mask.transform.voxel_size());
  stats.set("shear", report.shear);
  stats.set("levels", report.levels);
  stats.set("steps", report.steps);
  stats.set("last_change", report.last_change);
  stats.set("band_voxels", report.band_voxels);
  stats.set("blocks_skipped", report.leaves_skipped);
  cli::report_volume(run, grid);
}

} // namespace gewebe
