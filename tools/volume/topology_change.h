#pragma once
// A warning where the voxels or cells of a result are too coarse for the topology of the input.

#include "base/context.h"
#include "geometry/mesh.h"
#include "mesh/components.h"
#include "tools/cli/cli.h"
#include "voxelization/voxelize.h"

#include <optional>
#include <string>

namespace gewebe::cli {

/// Warns where `option` changed the topology; --stats has the topology before. `place` is empty or
/// names the input, `unit` what was too coarse: "voxels" or "cells".
void compare_topology(Run& run, const std::string& tool, const std::string& place,
                      const std::string& option, const mesh::Topology& before,
                      const mesh::Topology& after, const std::string& unit);

/// Topology that the volume of a mesh has on fine voxels. \pre `mesh` has no boundary edges
struct FilledTopology {
  mesh::Topology topology;
  TriangleMesh welded; ///< the mesh, with one point at each position
};
FilledTopology filled_topology(const TriangleMesh& mesh);

/// Whether the volume's surface is the mesh itself: a manifold without self-intersections, and by
/// `rule` no component is filled as a part of another. Costs a multiple of filled_topology.
bool is_surface_of_volume(const Context& context, const FilledTopology& filled,
                          voxelization::VoxelRule rule);

} // namespace gewebe::cli
