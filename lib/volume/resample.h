#pragma once
// The same volume on another lattice.

#include "base/context.h"
#include "volume/grid.h"

namespace gewebe::volume {

/// Samples `grid` on the lattice of `target`: at each new centre the mean of the old values,
/// weighted with a tent about that centre, separable along the old axes, of half-width max(S, s),
/// the weights divided by their sum. s is an old voxel edge and S the distance of the new centres
/// along it. So a finer or equal lattice gets the trilinear interpolation, a coarser one is
/// prefiltered; constant regions keep their value exactly, and so does everything where new centres
/// meet old ones at S <= s (to 1e-9 voxels).
///
/// Isovalue, background, name and class are kept; a new voxel is active where its value differs
/// from the background (in a level set where its magnitude is below it). Work follows the old
/// leaves and the faces of the old tiles. The result does not depend on the number of threads.
///
/// \throw Error if the grid is exact only near one isovalue (band_isovalue); if a transform is
/// singular; if S > 64 s; if an index would leave ±2^30; if context.max_memory would not do
Grid resample(const Context& context, const Grid& grid, const GridTransform& target);

} // namespace gewebe::volume
