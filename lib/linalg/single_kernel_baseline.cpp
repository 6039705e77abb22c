#include "linalg/single_kernel_body_internal.h"

namespace gewebe::linalg {

const SingleKernel single_kernel_baseline{&forward, &backward};

} // namespace gewebe::linalg
