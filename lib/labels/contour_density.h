#pragma once
// Density of a body whose contours are known in parallel slices, by shape-based interpolation
// (S. P. Raya and J. K. Udupa, Shape-based interpolation of multidimensional objects, IEEE TMI 9,
// 1990).
//
// Each slice k at height z_k has the signed distance d_k(u, v) to its contours, exact, positive
// inside, by even and odd. Between slices
//
//   F(u, v, z) = cubic Hermite interpolation of d_k(u, v) over z,
//
// with the slopes of the parabola through three slices (of the line through two at the ends), as
// G. T. Herman, J. Zheng and C. A. Bucholtz propose (IEEE CG&A 12, 1992). At the heights of the
// slices the surface F = 0 is that of the contours. Beyond the first and the last slice the body
// ends in a half ellipsoid, less high than the distance h to the neighbouring slice:
//
//   F = d - d_max (1 - sqrt(1 - (t / h)²)),  t the distance from the slice, 0 <= t <= h,
//
// because the next slice would show it, if it reached that far. The density is ½ + F/2S, clamped to
// [0, 1], for voxels of edge S.

#include "volume/grid.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::labels {

/// Corners of a closed polygon in a plane across one of the axes, in mm. The last corner is joined
/// to the first.
using Contour = std::vector<Vec3>;

struct ContourDensityReport {
  int axis = 2; ///< across the slices: 0 is x, 1 is y, 2 is z
  std::uint64_t slices = 0, contours = 0, points = 0;
  double least_spacing = 0, greatest_spacing = 0; ///< of neighbouring slices, mm
};

/// Computes the density on voxels of edge `voxel`, whose centres are at multiples of it: background
/// 0, isovalue 0.5. The result has the same bytes for any number of threads.
///
/// Time: pixels of all slices times the few contour edges that may be nearest, and all voxels of
/// the box. Memory: four bytes for each pixel of each slice, beside the result.
/// \pre coordinates are finite, voxel > 0, each contour has three points or more
/// \throw Error if a contour does not lie in a plane across an axis, or not across the axis of the
/// others; if there are fewer than two slices
/// \throw Error if an index would leave ±2^30, or context.max_memory is not enough
volume::Grid contour_density(const Context& context, std::span<const Contour> contours,
                             double voxel, ContourDensityReport* report = nullptr);

} // namespace gewebe::labels
