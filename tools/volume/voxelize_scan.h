#pragma once
// voxelize --threshold: the density of what lies within thresholds of a scan's grey values.

#include "tools/cli/cli.h"
#include "tools/volume/volume_output.h"

#include <optional>
#include <string>

namespace gewebe::cli {

struct Thresholds {
  double low, high; ///< one of them may be infinite
};

/// "150", "-50,300", ",-700". \throw UsageError if one is no number, both are absent, or low is not
/// below high
Thresholds thresholds_from_text(const std::string& text);

/// What the command line says about thresholds. \throw UsageError if it does not fit together
void check_thresholds(const std::string& text, bool labels, bool own_lattice);

/// Reads the scan `path`, writes the density with voxels of edge `voxel` (absent: the smallest
/// spacing), reports.
void voxelize_scan(cli::Run& run, const std::string& path, const Thresholds& thresholds,
                   std::optional<double> voxel, const VolumeOutput& to);

} // namespace gewebe::cli
