// Objects that change their method while the scene runs.

#include "scene/simulation_internal.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

namespace gewebe {

void Simulation::set_method(std::size_t index, Method method) {
  Object& object = *objects_[index];
  if (object.method == method)
    return;
  if (object.body != nullptr && object.body->parts.size() > 1) {
    const std::vector<std::size_t>& parts = object.body->parts;
    throw Error("object " + object.name + " is attached to " +
                objects_[parts[parts[0] == index ? 1 : 0]]->name +
                " and moves with it, expected one that is attached to none");
  }
  undo_->note([&object, old = object.method, shown = object.shown] {
    object.method = old;
    object.shown = shown;
  });
  // The elastostatic shape under what acts now; an object that nothing ever touched has none.
  std::span<const double> still;
  if (object.still || !object.load.empty()) {
    update_still(object, load_at(object.load, object.model, time_));
    still = still_shape(object);
    require_bounded(object, still);
  }
  if (!object.touches.empty() && object.method == Method::ffe && object.shown && object.shaped)
    still = object.displacement; // instruments among what acts
  // Shared, for what can be called can be copied.
  const auto contact = std::make_shared<std::unique_ptr<StaticContact>>(std::move(object.contact));
  undo_->note([&object, contact] { object.contact = std::move(*contact); });
  if (method == Method::ela) {
    if (!still.empty()) {
      need_body(index);
      std::vector<NodeMotion> motion(object.model.nodes.size());
      for (std::size_t i = 0; i < motion.size(); ++i)
        motion[i].displacement = {still[3 * i], still[3 * i + 1], still[3 * i + 2]};
      object.body->moving->set_motion(motion);
      object.body->changed = true;
    }
  } else {
    double jump = 0;
    if (object.body != nullptr) {
      gather_impulses(*object.body);
      const std::span<const NodeMotion> motion = object.body->moving->motion();
      for (std::size_t i = 0; i < motion.size(); ++i) {
        const Vec3 to =
            still.empty() ? Vec3{} : Vec3{still[3 * i], still[3 * i + 1], still[3 * i + 2]};
        jump = std::max(jump, norm(to - motion[i].displacement));
      }
      const auto at = std::find_if(bodies_.begin(), bodies_.end(),
                                   [&](const auto& b) { return b.get() == object.body; });
      const auto place = at - bodies_.begin();
      const auto body = std::make_shared<std::unique_ptr<Body>>(std::move(*at));
      bodies_.erase(at);
      object.body = nullptr;
      undo_->note([this, &object, body, place] {
        object.body = body->get();
        bodies_.insert(bodies_.begin() + place, std::move(*body));
      });
    }
    jumps_.push_back({index, jump});
    counts_.largest_jump = std::max(counts_.largest_jump, jump);
  }
  object.method = method;
  object.shown = false;
}

void Simulation::renew(Object& object) {
  if (object.still) {
    simulation::add_counts(object.spent, object.still->counts());
    object.still.reset();
  }
  if (object.two_step) {
    ElastostaticCounts second = object.two_step->second_counts();
    second.updates = second.unchanged = 0; // those of the first stage count
    simulation::add_counts(object.spent, second);
    object.two_step.reset();
  }
  object.stiffness.reset();
  object.prepared.reset();
  if (object.body != nullptr && object.integration == Integration::implicit)
    object.body->moving->renew();
  object.shown = false;
}

} // namespace gewebe
