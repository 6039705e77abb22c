#include "labels/label_step_kernel_internal.h"

namespace gewebe::labels {

float label_step_baseline(const LabelStep& step, const float* y,
                          const std::array<const float*, 6>& neighbours, const float* target,
                          const float* distance, float* value) {
  return label_step(step, y, neighbours, target, distance, value);
}

} // namespace gewebe::labels
