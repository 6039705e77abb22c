#include "statics/elastostatic_yielding.h"

#include <utility>

namespace gewebe {

namespace {

std::shared_ptr<const Load> with_touches(const Load& load, std::span<const NodeTouch> touches) {
  auto all = std::make_shared<Load>(load);
  for (const NodeTouch& t : touches)
    all->force[t.node] += t.force;
  return all;
}

} // namespace

ElastostaticYielding::ElastostaticYielding(std::function<Elastostatic&()> solver, const Load& load,
                                           std::span<const NodeTouch> last)
    : solver_(std::move(solver)), load_(load), pushed_(with_touches(load, last)) {}

DelassusOperator ElastostaticYielding::delassus_operator(std::span<const std::uint32_t> nodes) {
  updated_ = false;
  return solver_().delassus_operator(load_, nodes);
}

bool ElastostaticYielding::push(std::span<const NodeTouch> touches, std::span<const Vec3>) {
  before_.reset();
  updated_ = false;
  pushed_ = with_touches(load_, touches);
  return true;
}

std::span<const double> ElastostaticYielding::shape() {
  Elastostatic& solver = solver_();
  if (!std::exchange(updated_, false))
    solver.update(*pushed_);
  return solver.surface_displacement();
}

std::optional<NodeReach> ElastostaticYielding::reach() {
  solver_().update(*pushed_);
  updated_ = true;
  return solver_().surface_reach();
}

void ElastostaticYielding::copy_shape(std::span<const std::uint32_t> nodes, std::span<double> shape,
                                      Moment moment) {
  solver_().copy_surface(moment == Moment::kept ? *kept_ : *acting(), nodes, shape);
}

} // namespace gewebe
