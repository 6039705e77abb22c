#include "fem/hyperelastic_kernel_body_internal.h"

namespace gewebe::fem {

void add_tangent_baseline(const TangentPoint& point, std::size_t count, TangentSums& sums) {
  add_tangent(point, count, sums);
}

void evaluate_group_baseline(const HyperelasticPoints& points, bool own, HyperelasticGroup& group,
                             HyperelasticGroupResult& result) {
  evaluate_group(points, own, group, result);
}

} // namespace gewebe::fem
