#pragma once
// The rule of three pairs of depth buffers (FZKA 7190, 3.1.5, after Karabassi, Papaioannou,
// Theoharis 1999): a sample point is inside if along each of the three axes it lies between the
// first and the last place where the line through it meets the surface. Exact on convex bodies;
// hollows and what no line of sight along an axis reaches are filled. Internal to the voxelizer.

#include "voxelization/triangle_chunks_internal.h"
#include "voxelization/voxelize.h"

namespace gewebe {

/// Ties are decided as by the parity rule. Memory: two int32 for each ray along each axis of the
/// mesh's box, beside the result. Adds to the report's triangles_skipped, crossings and exact_tests
/// (of all three axes). \pre mesh.samples == 1 \throw Error if the buffers take too much memory
InsideScan depth_buffer_scan(const Context& context, const SampleMesh& mesh,
                             VoxelizeReport& report);

} // namespace gewebe
