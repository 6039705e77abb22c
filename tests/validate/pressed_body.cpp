#include "tests/validate/pressed_body.h"

#include "contact/instrument_body.h"
#include "statics/static_contact_body.h"
#include "tests/bench/timing.h"

#include <array>

namespace gewebe::validate {

PressedBody::PressedBody(const model::Model& model, statics::Elastostatic& solver,
                         const contact::InstrumentShape& shape, const contact::Pose& start,
                         const contact::Parameters& parameters)
    : model_(model), solver_(solver), shape_(shape), pose_(start), parameters_(parameters),
      body_(contact::model_surface(model)), tool_(contact::instrument_surface(shape)),
      displacement_(3 * model::surface_count(model)) {
  collision::OwnerTable<double> friction(2, -1);
  friction.set(0, 1, shape.friction);
  const std::array<const contact::BodySurface*, 2> surfaces{&body_.surface, &tool_};
  island_ = contact::IslandMotion(surfaces, friction, parameters).island();
  steps_.emplace(island_);
}

bool PressedBody::move(const contact::Pose& to, int halvings) {
  if (step(to))
    return true;
  return halvings > 0 && move(contact::between(pose_, to, 0.5), halvings - 1) &&
         move(to, halvings - 1);
}

bool PressedBody::step(const contact::Pose& to) {
  statics::ElastostaticContactBody body({&model_, &body_, &load_, displacement_, {}, last_},
                                        [this]() -> statics::Elastostatic& { return solver_; });
  contact::InstrumentBody tool(tool_.rest, pose_, to, 0, {});
  island_.table.bodies = {&body, &tool};
  try {
    (void)steps_->solve({0, parameters_}, timing::with_threads(1));
  } catch (const contact::NotSolved&) {
    return false;
  }
  const std::span<const double> u = body.displacement();
  displacement_.assign(u.begin(), u.end());
  pose_ = to;
  last_.clear();
  forces_.clear();
  for (const contact::ContactForce& f : steps_->forces())
    if (f.vertex < body_.node.size()) {
      last_.push_back({f.vertex, f.normal + f.friction});
      forces_.push_back({body_.node[f.vertex], f.normal, f.friction});
    }
  return true;
}

Vec3 PressedBody::force_on_instrument() const {
  Vec3 sum;
  for (const Force& f : forces_)
    sum -= f.normal + f.friction;
  return sum;
}

} // namespace gewebe::validate
