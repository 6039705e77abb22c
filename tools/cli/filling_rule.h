#pragma once
// --rule and --on-open: what lies inside a surface. Links neither OpenVDB nor the voxelizer.

#include "voxelization/voxelize.h"

#include <string>

namespace gewebe::cli {

/// --rule and --on-open. \pre one of their words
voxelization::VoxelRule voxel_rule_from_text(const std::string& text);
voxelization::OpenMesh open_mesh_from_text(const std::string& text);

/// What is wrong with a mesh that was voxelized, for a warning; "" if nothing.
std::string mesh_defects(const voxelization::VoxelizeReport& mesh,
                         const voxelization::VoxelizeOptions& options);

} // namespace gewebe::cli
