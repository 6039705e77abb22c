#include "solid/warp_kernel_body_internal.h"

namespace gewebe {

const WarpKernel warp_kernel_avx2{&ask, &turn_middles, &take_back, &combine, &project};

} // namespace gewebe
