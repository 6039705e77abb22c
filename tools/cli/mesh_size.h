#pragma once
// Whether a mesh is as large as an organ.

#include "geometry/mesh.h"
#include "tools/cli/cli.h"

#include <optional>
#include <string>

namespace gewebe::cli {

/// A mesh in m or cm that is read in mm is tiny, one in 0.001 mm huge: warns where the longest side
/// of its box is over 1 m, or below 20 voxels of `voxel` mm, or, without these, below 1 mm.
void warn_of_size(Run& run, const std::string& name, const TriangleMesh& mesh,
                  std::optional<double> voxel);

} // namespace gewebe::cli
