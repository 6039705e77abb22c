#include "statics/elastostatic_yielding.h"

#include <utility>

namespace gewebe {

ElastostaticYielding::ElastostaticYielding(std::function<Elastostatic&()> solver, const Load& load,
                                           std::span<const NodeTouch> last)
    : solver_(std::move(solver)), load_(load), pushed_(load) {
  for (const NodeTouch& t : last)
    pushed_.force[t.node] += t.force;
}

DelassusOperator ElastostaticYielding::delassus_operator(std::span<const std::uint32_t> nodes) {
  return solver_().delassus_operator(load_, nodes);
}

bool ElastostaticYielding::push(std::span<const NodeTouch> touches, std::span<const Vec3>) {
  pushed_ = load_;
  for (const NodeTouch& t : touches)
    pushed_.force[t.node] += t.force;
  return true;
}

std::span<const double> ElastostaticYielding::shape() {
  solver_().update(pushed_);
  return solver_().surface_displacement();
}

} // namespace gewebe
