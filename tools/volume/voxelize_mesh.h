#pragma once
// What voxelize makes of a closed mesh.

#include "tools/cli/cli.h"
#include "tools/volume/antialias.h"
#include "tools/volume/volume_output.h"
#include "voxelization/voxelize.h"

#include <cstdint>
#include <optional>
#include <string>

namespace gewebe::cli {

struct MeshToVoxelize {
  std::string name = "-"; ///< of the mesh's file
  std::string unit;       ///< of its numbers; empty: mm
  std::string weld = "auto";
  std::optional<double> voxel;     ///< mm
  std::optional<std::int64_t> dim; ///< voxels along the longest side
  std::string transform;           ///< of the mesh, as in transform_option.h
  std::string like;                ///< volume whose lattice is taken
  std::string antialias = "jones";
  AntialiasChoice choice; ///< what that text stands for
  voxelization::VoxelizeOptions options;
  VolumeOutput output;
};

/// Reads, fills and writes it. \pre one of voxel, dim and like is given
void voxelize_mesh(cli::Run& run, const MeshToVoxelize& a);

} // namespace gewebe::cli
