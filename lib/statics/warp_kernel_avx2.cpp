#include "statics/warp_kernel_body_internal.h"

namespace gewebe::statics {

const WarpKernel warp_kernel_avx2{&find_rotations, &ask,     &turn_middles, &find_moments,
                                  &take_back,      &combine, &project};

} // namespace gewebe::statics
