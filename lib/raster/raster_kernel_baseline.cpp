#include "raster/raster_kernel_rest_lanes_internal.h"
#include "raster/raster_kernel_screen_lanes_internal.h"
#include "raster/raster_kernel_tile_lanes_internal.h"

namespace gewebe::raster {

const RasterKernels raster_kernels_baseline{place_all, sort_all, draw_tile};

std::size_t raster_scratch_bytes(int samples) {
  return static_cast<std::size_t>(samples * plane + lanes) *
         (sizeof(float) + sizeof(std::uint32_t));
}

} // namespace gewebe::raster
