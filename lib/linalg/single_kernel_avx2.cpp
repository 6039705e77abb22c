#include "linalg/single_kernel_body_internal.h"

namespace gewebe::linalg {

const SingleKernel single_kernel_avx2{&forward, &backward};

} // namespace gewebe::linalg
