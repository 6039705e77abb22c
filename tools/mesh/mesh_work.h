#pragma once
// What mc-opt does.

#include "tools/cli/cli.h"
#include "tools/mesh/mesh_arguments.h"

namespace gewebe::cli {

/// The isosurface as triangles.
void mesh_surface(cli::Run& run, const MeshArguments& arguments);
/// What lies inside as tetrahedra.
void mesh_solid(cli::Run& run, const MeshArguments& arguments);

} // namespace gewebe::cli
