#include "fem/corotational_kernel_body_internal.h"

namespace gewebe {

const CorotationalKernel corotational_kernel_baseline{&evaluate<4>, &evaluate<10>, &turn};

} // namespace gewebe
