#pragma once
// Voxelization by three pairs of depth buffers (FZKA 7190, 3.1.5, after Karabassi, Papaioannou,
// Theoharis 1999). A sample point is inside if, along each of the three axes, it lies between the
// first and the last intersection of the surface with the line through it. This is exact for convex
// bodies. Hollows are filled, and so are cavities that no line along an axis reaches from outside.
// Internal to the voxelizer.

#include "voxelization/triangle_chunks_internal.h"
#include "voxelization/voxelize.h"

namespace gewebe::voxelization {

/// Scans a mesh by this rule. Ties are decided as by the parity rule. Memory beside the result: two
/// int32 for each ray along each axis of the mesh's box. Adds to triangles_skipped, crossings and
/// exact_tests of the report, for all three axes. \pre mesh.samples == 1 \throw Error if the
/// buffers take too much memory
InsideScan depth_buffer_scan(const Context& context, const SampleMesh& mesh,
                             VoxelizeReport& report);

} // namespace gewebe::voxelization
