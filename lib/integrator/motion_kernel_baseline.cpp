#include "integrator/motion_kernel_body_internal.h"

namespace gewebe::integrator {

const MotionKernel motion_kernel_baseline{&pull, &product, &increase};

} // namespace gewebe::integrator
