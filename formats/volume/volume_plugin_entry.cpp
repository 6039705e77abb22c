// In gewebe-volume.so alone.

#include "base/error.h"
#include "formats/volume/volume_file.h"
#include "formats/volume/volume_plugin_internal.h"
#include "stuffing/stuffing.h"
#include "voxelize/distance_ramp.h"

#include <utility>

using namespace gewebe;

const char* const gewebe_volume_version = GEWEBE_VERSION;

void gewebe_view_volume(std::string* bytes, const std::string* name,
                        const VolumeViewOptions* options, const Context* context,
                        VolumeView* view) {
  const Grid grid = volume_from_bytes(std::move(*bytes), *name, *context);
  *view = at(*name, [&] { return view_volume(grid, *options, *context); });
}

void gewebe_fill_surface(const TriangleMesh* mesh, const std::string* name,
                         const SurfaceFilling* filling, const Context* context, TetMesh* filled) {
  *filled = at(*name, [&] {
    const Grid grid = jones_density(*context, *mesh, uniform_transform(filling->voxel),
                                    OpenMesh::refuse, nullptr, VoxelRule::parity);
    return stuff(*context, grid, {.isovalue = {}, .cell = filling->cell, .grade = filling->grade});
  });
}
