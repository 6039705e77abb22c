#include "statics/bent_kernel_body_internal.h"

namespace gewebe {

const BentKernel bent_kernel_avx2{&factor, &solve, &multiply, &spread, &times, &push, &read};

} // namespace gewebe
