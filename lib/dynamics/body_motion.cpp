#include "dynamics/body_motion.h"

namespace gewebe::dynamics {

namespace {

[[noreturn]] void refuse() {
  throw Error("moves by explicit steps, expected implicit ones for contact");
}

} // namespace

const contact::ModelSurface& BodyMotion::collision_surface() {
  refuse();
}
contact::ContactBody& BodyMotion::begin_contact_step(const contact::Interval& /*step*/,
                                                     const Context& /*context*/) {
  refuse();
}
void BodyMotion::end_contact_step(std::span<const contact::VertexForce> /*forces*/, bool /*still*/,
                                  const Context& /*context*/) {
  refuse();
}

} // namespace gewebe::dynamics
