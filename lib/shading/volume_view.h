#pragma once
// Pictures of a volume without a surface: slices and maximum projections, in the colours of a
// ramp, and translucent ones. Report 4.1 and 4.2, figures 4-1 and 4-5.

#include "base/context.h"
#include "geometry/vec3.h"
#include "shading/camera.h"
#include "texture/color_ramp.h"
#include "volume/grid.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace gewebe::shading {

enum class VolumeMode { slice, maximum, translucent };

/// Across which axis of the world a volume is seen: x from the right, y from the front, z from the
/// top; `view` as the camera's options say.
enum class VolumeAxis { x, y, z, view };

/// What a translucent volume of value v shines with and hides: for u = clamp((v - range[0]) /
/// (range[1] - range[0]), 0, 1) colour c(u) of the ramp, and the extinction σ = extinction · u.
struct TransferFunction {
  texture::ColorRamp ramp;                    ///< one colour at least
  std::optional<std::array<double, 2>> range; ///< increasing; nothing: least and greatest value
  std::optional<double> extinction;           ///< 1/mm; nothing: 8 / longest side of the box
};

struct VolumeViewOptions {
  VolumeMode mode = VolumeMode::maximum;
  VolumeAxis axis = VolumeAxis::view;
  /// Slice: where on the axis, mm; for `view` how far behind the target. Nothing: the target.
  std::optional<double> place;
  CameraOptions camera;
  std::uint32_t width = 512, height = 512;
  TransferFunction transfer; ///< of translucent
};

struct VolumeView {
  std::uint32_t width = 0, height = 0;
  std::vector<float> values;          ///< width · height, rows from the top
  std::vector<float> colors;          ///< translucent: three each, 0 … 1
  std::array<double, 2> range{};      ///< translucent: of the transfer function
  double extinction = 0;              ///< likewise, 1/mm
  double min = 0, max = 0;            ///< of the volume, background included
  Camera camera;                      ///< direction, axes and target
  double half_width = 0, half_height; ///< of the picture, mm
};

/// Sees `grid`, trilinear between its voxels' centres and its background beyond them, by parallel
/// rays: a slice has the value where the ray meets the plane through the place, a maximum
/// projection the greatest value on the ray. It is exact to rounding: between two planes
/// of the lattice the field is a cubic along the ray, whose extrema are found; blocks of 8³ voxels
/// that hold nothing greater than what was met are stepped over. A translucent picture has emission
/// and absorption (Max, Optical Models for Direct Volume Rendering, 1995): colors are the integral
/// of c σ exp(-∫ σ) along the ray, values what is left of what lies behind, exp(-∫ σ), each cell in
/// 4 steps of constant σ and c, one where the field is constant; what lies beyond the volume's
/// blocks is clear, and a ray ends where less than 1/4096 is left. The picture shows the box of the
/// active voxels with a margin of 5 %; where the camera's options place the eye or its distance, as
/// much as the camera sees at the target. \throw Error if the transform is singular, the camera has
/// no place, or memory would not do; Cancelled
VolumeView view_volume(const volume::Grid& grid, const VolumeViewOptions& options,
                       const Context& context);

} // namespace gewebe::shading
