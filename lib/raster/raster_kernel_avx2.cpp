#include "raster/raster_kernel_rest_lanes_internal.h"
#include "raster/raster_kernel_screen_lanes_internal.h"
#include "raster/raster_kernel_tile_lanes_internal.h"

namespace gewebe::raster {

const RasterKernels raster_kernels_avx2{place_all, sort_all, draw_tile};

} // namespace gewebe::raster
