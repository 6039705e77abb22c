#include "sim/front_kernel_body_internal.h"

namespace gewebe {

const FrontKernel front_kernel_baseline{eliminate, take};

} // namespace gewebe
