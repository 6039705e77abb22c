#include "raster/raster_kernel_rest_lanes_internal.h"
#include "raster/raster_kernel_tile_lanes_internal.h"

namespace gewebe {

std::uint64_t draw_tile_baseline(const KernelScene& scene, const KernelScreen& screen,
                                 const KernelTile& tile) {
  return draw_tile(scene, screen, tile);
}

std::size_t raster_scratch_bytes(int samples) {
  return static_cast<std::size_t>(samples * plane + lanes) *
         (sizeof(float) + sizeof(std::uint32_t));
}

} // namespace gewebe
