#pragma once
// voxelize --label: the density of labels of a radiological volume.

#include "tools/shared/cli.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe {

/// The numbers of --label. \throw UsageError if one is no whole number
std::vector<std::int64_t> labels_from_text(const std::string& text);

/// Writes what labels the volume `path` holds: a line each, the label, its voxels, its volume in
/// mm³.
void list_labels(cli::Run& run, const std::string& path);

/// Reads the label volume `path`, writes the density of `labels` with voxels of edge `voxel`
/// (absent: the smallest spacing), reports.
void voxelize_labels(cli::Run& run, const std::string& path,
                     const std::vector<std::int64_t>& labels, std::optional<double> voxel);

} // namespace gewebe
