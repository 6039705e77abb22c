#pragma once
// Pictures of a volume without a surface: slices and maximum projections, in the colours of a
// ramp. Report 4.1 and 4.2, figures 4-1 and 4-5.

#include "base/context.h"
#include "base/vec3.h"
#include "shading/camera.h"
#include "volume/grid.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace gewebe {

enum class VolumeMode { slice, maximum };

/// Across which axis of the world a volume is seen: x from the right, y from the front, z from the
/// top; `view` as the camera's options say.
enum class VolumeAxis { x, y, z, view };

struct VolumeViewOptions {
  VolumeMode mode = VolumeMode::maximum;
  VolumeAxis axis = VolumeAxis::view;
  /// Slice: where on the axis, mm; for `view` how far behind the target. Nothing: the target.
  std::optional<double> place;
  CameraOptions camera;
  std::uint32_t width = 512, height = 512;
};

struct VolumeView {
  std::uint32_t width = 0, height = 0;
  std::vector<float> values;          ///< width · height, rows from the top
  double min = 0, max = 0;            ///< of the volume, background included
  Camera camera;                      ///< direction, axes and target
  double half_width = 0, half_height; ///< of the picture, mm
};

/// Sees `grid`, trilinear between its voxels' centres and its background beyond them, by parallel
/// rays: a slice has the value where the ray meets the plane through the place, a maximum
/// projection the greatest value on the ray. That one is exact but for rounding: between two planes
/// of the lattice the field is a cubic along the ray, whose extrema are found; blocks of 8³ voxels
/// that hold nothing greater than what was met are stepped over. The picture shows the box of the
/// active voxels with a margin of 5 %; where the camera's options place the eye or its distance, as
/// much as the camera sees at the target. \throw Error if the transform is singular, the camera has
/// no place, or memory would not do; Cancelled
VolumeView view_volume(const Grid& grid, const VolumeViewOptions& options, const Context& context);

} // namespace gewebe
