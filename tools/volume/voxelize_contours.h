#pragma once
// voxelize --contours: the density of a body whose contours are drawn in parallel slices.

#include "tools/cli/cli.h"
#include "tools/volume/volume_output.h"

#include <string>

namespace gewebe::cli {

/// Reads contours from `path`, coordinates in `unit` (m, cm, mm; empty: mm), writes the density
/// with voxels of edge `voxel` in mm, and reports.
void voxelize_contours(cli::Run& run, const std::string& path, const std::string& unit,
                       double voxel, const VolumeOutput& to);

} // namespace gewebe::cli
