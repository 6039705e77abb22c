#include "voxelization/solid_angle_kernel_internal.h"

namespace gewebe::voxelization {

std::uint32_t solid_angles_baseline(const SolidAngleTriangles& triangles, const double* point,
                                    double* half_angles) {
  return solid_angles(triangles, point, half_angles);
}

} // namespace gewebe::voxelization
