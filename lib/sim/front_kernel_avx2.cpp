#include "sim/front_kernel_body_internal.h"

namespace gewebe {

const FrontKernel front_kernel_avx2{eliminate, take};

} // namespace gewebe
