#include "cholesky/front_kernel_body_internal.h"

namespace gewebe::cholesky {

const FrontKernel front_kernel_avx2{strip_rows, square_size, add, eliminate, solve, update};

} // namespace gewebe::cholesky
