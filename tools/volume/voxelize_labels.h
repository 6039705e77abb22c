#pragma once
// voxelize --label: the density of labels of a radiological volume.

#include "formats/volume/label_volume.h"
#include "tools/cli/cli.h"
#include "tools/volume/volume_output.h"

#include <optional>
#include <string>
#include <vector>

namespace gewebe::cli {

/// The numbers, ranges and names of --label, "3,5-7,liver"; `expected` is the expectation in a
/// message. \throw UsageError if one that begins as a number is no whole number, or a range goes
/// downwards
std::vector<formats::LabelRange>
labels_from_text(const std::string& text, const char* expected = "whole numbers, names, or list");

/// What the command line says about labels. \throw UsageError if it does not fit together
void check_labels(const std::string& text, bool voxel, bool own_lattice);

/// Writes what labels the volume `path` holds: a line each, the label, its voxels, its volume in
/// mm³, and its name if it has one.
void list_labels(cli::Run& run, const std::string& path, const VolumeOutput& to);

/// Reads the label volume `path`, writes the density of `labels` with voxels of edge `voxel`
/// (absent: the smallest spacing), reports.
void voxelize_labels(cli::Run& run, const std::string& path,
                     const std::vector<formats::LabelRange>& labels, std::optional<double> voxel,
                     const VolumeOutput& to);

} // namespace gewebe::cli
