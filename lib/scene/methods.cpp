// Objects that change their method while the scene runs.

#include "scene/rules_internal.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::scene {

namespace {

/// The elastostatic shape under what acts now; empty: nothing ever touched the object.
std::span<const double> shape_now(World& w, Object& object) {
  std::span<const double> u;
  if (object.statics.made() || (!object.load->empty() && !is_held_altogether(object))) {
    update_solver(w, object, acting_at(object, w.now.clock.time));
    u = static_shape(object);
    require_bounded(object, u);
  }
  if (!object.shown.contact.empty() && object.method == Method::ffe)
    u = whole_shape(w, object); // where contact has it
  return u;
}

/// Instruments that touch the object go from where they stood when it was shown.
void stand_back(World& w, const Object& object) {
  for (const contact::NodalContactForce& f : object.shown.contact)
    if (f.instrument < w.now.instruments.size())
      if (const std::optional<contact::Pose> stood = pose_at(w, 0, f.instrument))
        w.now.instruments[f.instrument].before = *stood;
}

Vec3 at(std::span<const double> shape, std::size_t i) {
  return {shape[3 * i], shape[3 * i + 1], shape[3 * i + 2]};
}

/// Goes on from a shape, at rest; empty: from where it is.
void set_going(World& w, std::size_t index, std::span<const double> u) {
  if (u.empty())
    return;
  need_body(w, index);
  Object& object = w.now.objects[index];
  std::vector<dynamics::NodeMotion> motion(object.model().nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i)
    motion[i].displacement = at(u, i);
  object.body->moving->set_motion(motion);
  object.body->changed = true;
}

/// Takes its shape at once. \return mm, by which it jumps
double stop(World& w, Object& object, std::span<const double> u) {
  double jump = 0;
  if (object.body == nullptr)
    return jump;
  const std::span<const dynamics::NodeMotion> motion = object.body->moving->motion();
  for (std::size_t i = 0; i < motion.size(); ++i)
    jump = std::max(jump, norm((u.empty() ? Vec3{} : at(u, i)) - motion[i].displacement));
  drop_body(w, object.body.get());
  object.body = nullptr;
  return jump;
}

} // namespace

void Rule<SetMethod>::apply(World& w, const SetMethod& c) {
  Object& object = w.now.objects[c.object];
  if (object.method == c.method)
    return;
  require_support(w, object, Feature::method);
  const std::span<const double> u = shape_now(w, object);
  object.touching.clear();
  if (c.method == Method::ela) {
    set_going(w, c.object, u);
    stand_back(w, object);
  } else {
    const double jump = stop(w, object, u);
    w.now.news.jumps.push_back({c.object, jump});
    w.now.counts.largest_jump = std::max(w.now.counts.largest_jump, jump);
  }
  object.method = c.method;
  object.shown.valid = false;
  let_instruments_enter(w); // those that were placed since the last step
}

void Rule<SetMethod>::log(const World& w, const SetMethod& c, ChangeRow& row) {
  row.what = "method";
  row.text = method_name(c.method);
  const std::vector<MethodJump>& jumps = w.now.news.jumps;
  if (c.method == Method::ffe && !jumps.empty() && jumps.back().object == c.object)
    row.value = jumps.back().size;
}

} // namespace gewebe::scene
