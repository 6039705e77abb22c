#pragma once
// A volume as a continuous field: what lies between the voxel centres.

#include "volume/grid.h"

#include <array>

namespace gewebe::volume {

/// Trilinear interpolation of a grid; for one thread, fast for neighbouring places.
class Field {
public:
  explicit Field(const Grid& grid);

  /// Value at a place in index space: trilinear between the 8 voxel centres round it.
  double value(const Vec3& index);
  /// Gradient in the world (value per mm) at a place in index space: central differences at the 8
  /// voxel centres round it, trilinear between them, taken to the world by the inverse transposed
  /// transform. Continuous, unlike the gradient of `value`.
  Vec3 gradient(const Vec3& index);

private:
  GridAccessor values_;
  std::array<Vec3, 3> inverse_; // rows of the inverse of the transform's linear part
};

} // namespace gewebe::volume
