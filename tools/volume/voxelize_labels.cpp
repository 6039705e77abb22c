#include "tools/volume/voxelize_labels.h"

#include "formats/volume/label_volume.h"
#include "formats/volume/volume_file.h"
#include "labels/label_density.h"
#include "tools/cli/report.h"
#include "tools/cli/space_option.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <string_view>

namespace gewebe::cli {

std::vector<formats::LabelRange> labels_from_text(const std::string& text, const char* expected) {
  std::vector<formats::LabelRange> labels;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const std::string_view word = std::string_view(text).substr(begin, comma - begin);
    const char* const end = word.data() + word.size();
    formats::LabelRange& range = labels.emplace_back();
    begin = comma + 1;
    if (!word.empty() && word != "list" &&
        std::string_view("-+.0123456789").find(word[0]) == std::string_view::npos) {
      range.name = word;
      continue;
    }
    std::from_chars_result read = std::from_chars(word.data(), end, range.first);
    range.last = range.first;
    if (read.ec == std::errc{} && read.ptr != end && *read.ptr == '-')
      read = std::from_chars(read.ptr + 1, end, range.last);
    if (read.ec != std::errc{} || read.ptr != end)
      throw UsageError("--label: '" + std::string(word) + "', expected " + expected);
    if (range.last < range.first)
      throw UsageError("--label: '" + std::string(word) + "', expected the smaller number first");
  }
  return labels;
}

void check_labels(const std::string& text, bool voxel, bool own_lattice) {
  if (text != "list")
    (void)labels_from_text(text);
  else if (voxel)
    throw UsageError("--label list makes no volume, expected no --voxel");
  if (own_lattice)
    throw UsageError("--label: the labels give the lattice, expected --voxel or nothing");
}

void list_labels(cli::Run& run, const std::string& path, const VolumeOutput& to) {
  if (!run.to().empty())
    throw UsageError("--to for a list of labels, which is text, expected none");
  if (to.uncompressed)
    throw UsageError("--uncompressed for a list of labels, which is text, expected none");
  formats::Output output(run.output(), run.output_options(false));
  formats::Input input(path);
  const formats::LabelVolume volume =
      run.timed("read", [&] { return formats::read_label_volume(input, {}, run.context()); });
  for (const std::string& warning : volume.warnings)
    run.warn(warning);
  const Vec3 spacing = volume.mask.transform.voxel_size();
  std::string text;
  for (const auto& [label, voxels] : volume.labels) {
    const double mm3 = static_cast<double>(voxels) * spacing.x * spacing.y * spacing.z;
    std::array<char, 32> size{};
    (void)std::snprintf(size.data(), size.size(), "%.6g", mm3);
    text += std::to_string(label) + " " + std::to_string(voxels) + " " + size.data();
    const auto named =
        std::ranges::find(volume.names, label, [](const auto& n) { return n.first; });
    text += named == volume.names.end() ? "\n" : " " + named->second + "\n";
  }
  output.write(text);
  output.commit();
  run.stats().set("format", volume.format);
  run.stats().set("label_values", volume.labels.size());
  run.stats().set("spacing", spacing);
}

void voxelize_labels(cli::Run& run, const std::string& path,
                     const std::vector<formats::LabelRange>& labels, std::optional<double> voxel,
                     const VolumeOutput& to) {
  formats::Output output = open_volume(run);
  formats::Input input(path);
  // What its size rules out is refused before its voxels are unpacked.
  formats::LabelVolume volume = run.timed("read", [&] {
    return formats::read_label_volume(input, labels, run.context(),
                                      [&](const labels::LabelMask& mask) {
                                        labels::check_label_density(run.context(), mask, {voxel});
                                      });
  });
  for (const std::string& warning : volume.warnings)
    run.warn(warning);
  VolumeOutput result = to;
  if (result.space == Space::lps)
    volume.mask.transform = other_space(volume.mask.transform);
  else
    result.space = Space::ras; // as read
  labels::LabelDensityReport report;
  const volume::Grid grid = run.timed("density", [&] {
    return at(input.name(),
              [&] { return labels::label_density(run.context(), volume.mask, {voxel}, &report); });
  });
  write(run, output, grid, result);

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

} // namespace gewebe::cli
