#include "solid/warp_kernel_body_internal.h"

namespace gewebe {

const WarpKernel warp_kernel_baseline{&ask, &turn_middles, &take_back, &combine, &project};

} // namespace gewebe
