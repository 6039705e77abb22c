#include "raster/raster_kernel_rest_lanes_internal.h"
#include "raster/raster_kernel_tile_lanes_internal.h"

namespace gewebe {

std::uint64_t draw_tile_avx2(const KernelScene& scene, const KernelScreen& screen,
                             const KernelTile& tile) {
  return draw_tile(scene, screen, tile);
}

} // namespace gewebe
