#include "fem/corotational_kernel_body_internal.h"

namespace gewebe::fem {

const CorotationalKernel corotational_kernel_baseline{&evaluate<4>, &evaluate<10>, &turn};

} // namespace gewebe::fem
