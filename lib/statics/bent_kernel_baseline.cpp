#include "statics/bent_kernel_body_internal.h"

namespace gewebe {

const BentKernel bent_kernel_baseline{&factor, &solve, &multiply, &spread, &times, &push, &read};

} // namespace gewebe
