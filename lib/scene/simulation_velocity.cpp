// How fast elastostatic objects move: as their load does. What a cut frees of one goes on so.

#include "base/vector_at.h"
#include "scene/simulation_internal.h"
#include "solve/condition.h"

#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {

/// Before an object is shown anew: what it shows now is where it comes from.
void Simulation::leave_shown(Object& object) {
  const bool posed = object.method == Method::ffe && !object.stages;
  if (time_ == shapes_time_ && object.shown_time == time_) { // in place of what is shown
    undo_->note([&object, load = object.shown_load, posed = object.posed, came = object.came] {
      object.shown_load = load;
      object.posed = posed;
      object.came = came;
    });
    object.came.velocity.clear();
    object.posed = posed;
    return;
  }
  Object::CameFrom now{.load = std::exchange(object.shown_load, {}),
                       .touched = {},
                       .over = object.posed && posed ? time_ - shapes_time_ : 0,
                       .velocity = {}};
  for (const NodeTouch& t : object.touches)
    if (posed)
      now.touched[t.node] = vector_at(object.before, t.node);
  undo_->note(
      [&object, posed = object.posed, came = std::exchange(object.came, std::move(now))]() mutable {
        object.shown_load = std::move(object.came.load);
        object.posed = posed;
        object.came = std::move(came);
      });
  object.posed = posed;
}

/// Whether it moved in the last step. Between two steps that show it it stands still.
bool Simulation::has_moved(const Object& object) const {
  return object.method == Method::ffe && object.came.over > 0 && object.shown_time == shapes_time_;
}

/// mm/s by node: what the last step changed of its load, over its length; nothing where it stands
/// still. Both shapes are those of the model as it is, so that a wound that has just opened counts
/// for nothing. \param afresh with another factor of its own   \throw Error as Elastostatic
std::vector<Vec3> Simulation::shape_velocity(Object& object, bool afresh) {
  if (!object.came.velocity.empty())
    return object.came.velocity;
  if (!has_moved(object))
    return {};
  if (undo_->open)
    undo_->updated.insert(&object);
  Load load = object.came.load, now = object.shown_load;
  // Nodes that instruments push are where they are.
  for (const auto& [node, u] : object.came.touched)
    load.displacement[node] = u;
  for (const NodeTouch& t : object.touches)
    now.displacement[t.node] = vector_at(object.displacement, t.node);
  std::vector<Vec3> velocity;
  try {
    std::optional<Elastostatic> own;
    if (afresh)
      own.emplace(object.model, StiffnessParts{}, context_);
    Elastostatic& still = afresh ? *own : still_of(object);
    still.update(load);
    const std::span<const double> shape = still.displacement();
    const std::vector<double> before(shape.begin(), shape.end());
    still.update(now);
    const std::span<const double> after = still.displacement();
    for (std::size_t i = 0; i < object.model.nodes.size(); ++i)
      velocity.push_back((vector_at(after, i) - vector_at(before, i)) / object.came.over);
  } catch (const SingularStiffness&) {
    // It hangs loosely, and nobody has asked for a shape since.
  }
  return velocity;
}

} // namespace gewebe
