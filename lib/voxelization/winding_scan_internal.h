#pragma once
// The rule of the generalised winding number: a sample point is inside if |w| > 1/2, w the sum of
// the solid angles of all triangles / 4 pi (Jacobson et al. 2013). Internal to the voxelizer.
//
// Cones over the border close the surface S; with C the chain of the cones w(S) = w(S + C) - w(C).
// The first is a whole number, which an exact scan along k counts with signs; the second is summed
// over the few triangles of C, and only where its magnitude can reach 1/2: elsewhere a sample is
// inside where the first isn't 0. So the work follows the surface, and for a closed one the rule is
// exact: nonzero filling.

#include "voxelization/triangle_chunks_internal.h"
#include "voxelization/voxelize.h"

namespace gewebe::voxelization {

/// `points` gets the tips of the cones. Ties are decided as by the parity rule. Adds to the report
/// what orientation found, triangles_skipped, crossings, exact_tests, and samples_summed.
/// \param keep_windings  fills InsideScan::windings
/// \pre points as SampleMesh requires them; part as orient_surface takes it
InsideScan winding_scan(const Context& context, std::vector<Vec3>& points,
                        std::span<const Triangle> triangles, std::span<const std::int32_t> part,
                        bool keep_windings, VoxelizeReport& report);

} // namespace gewebe::voxelization
