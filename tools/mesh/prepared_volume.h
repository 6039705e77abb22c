#pragma once
// The volume that mc-opt meshes, and reports about its surface.

#include "formats/stream/stream.h"
#include "geometry/space.h"
#include "mesh/components.h"
#include "tools/cli/cli.h"
#include "tools/mesh/mesh_arguments.h"
#include "volume/grid.h"

#include <array>
#include <optional>
#include <vector>

namespace gewebe::cli {

/// The volume as it is meshed, and the topology of its surface as it came where that may change.
struct PreparedVolume {
  volume::Grid grid;
  double isovalue = 0;
  std::optional<mesh::Topology> before;
  Space space = Space::unknown; ///< of the grid, as stated in it
};

PreparedVolume prepare(cli::Run& run, const MeshArguments& arguments, formats::Input& input);

/// Converts the mesh to the space of --space, and reports the space.
void bring_to_space(cli::Run& run, Space from, const MeshArguments& arguments,
                    std::vector<Vec3>& points,
                    std::vector<std::array<float, 3>>* normals = nullptr);

void warn_if_empty(cli::Run& run, bool empty);
void warn_of_components(cli::Run& run, std::uint64_t kept, std::uint64_t dropped);

} // namespace gewebe::cli
