#pragma once
// The density of what lies within thresholds of a scan's grey values.
//
// A value's depth is how far it lies within the thresholds, d = min(v - low, high - v), less than 0
// outside. The density is ½ + d/2W, clamped to [0, 1], where W is the largest |d| of a voxel that
// has one of the other kind among its 26 neighbours. So wherever the surface passes nothing is
// clamped, and marching cubes at ½ on the file's own lattice finds the same points as on the grey
// values at the thresholds: linear between neighbours. What W is has no influence on the surface.

#include "base/context.h"
#include "labels/grey_volume.h"
#include "volume/grid.h"

#include <cstdint>
#include <limits>
#include <optional>

namespace gewebe::labels {

struct GreyDensityOptions {
  double low = -std::numeric_limits<double>::infinity(); ///< one of both is finite
  double high = std::numeric_limits<double>::infinity();
  std::optional<double> voxel; ///< edge of the result's cubic voxels in mm; the smallest spacing
};

struct GreyDensityReport {
  float min = 0, max = 0;    ///< of the scan
  std::uint64_t voxels = 0;  ///< within the thresholds
  std::uint64_t missing = 0; ///< that are NaN; they count as outside
  double width = 0;          ///< W
  double shear = 0;          ///< mm, from label_lattice
};

/// On label_lattice: cubes along the scan's axes, voxel (0, 0, 0) where that of the scan is. Where
/// the scan has such cubes, the values are those of its voxels, else resample() finds them: linear
/// between finer ones, weighted means of coarser ones. Outside the scan the density is 0, so the
/// surface closes within a voxel beyond its edge.
/// \throw Error if no voxel, or every voxel, lies within the thresholds; for oblique axes as
/// label_lattice, for voxels as resample; if context.max_memory would not do
/// \pre low < high, values.size() is that of the box
volume::Grid grey_density(const Context& context, const GreyVolume& scan,
                          const GreyDensityOptions& options, GreyDensityReport* report = nullptr);

} // namespace gewebe::labels
