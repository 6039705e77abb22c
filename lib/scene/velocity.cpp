// How fast elastostatic objects move: as their load does. What a cut frees of one goes on so.

#include "geometry/vector_at.h"
#include "linalg/condition.h"
#include "scene/island_members_internal.h"

#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::scene {

/// To be called before a new output state of an object: the present one becomes the previous state.
void leave_shown(World& w, Object& object) {
  const double now = w.now.clock.time, before = w.now.clock.shown;
  Shown& shown = object.shown;
  const bool posed = object.method == Method::ffe && gap_of(object, Feature::cut) == nullptr;
  if (now == before && shown.time == now) { // in place of what is shown
    object.came.velocity.clear();
    shown.posed = posed;
    return;
  }
  CameFrom came{.load = std::exchange(shown.load, {}),
                .touched = {},
                .duration = shown.posed && posed ? now - before : 0,
                .velocity = {}};
  for (const contact::NodalContactForce& t : shown.contact)
    if (posed)
      came.touched[t.node] = contact_displacement(object, t.node);
  object.came = std::move(came);
  shown.posed = posed;
}

/// Whether it moved in the last step. Between two steps that show it it stands still.
bool has_moved(const World& w, const Object& object) {
  return object.method == Method::ffe && object.came.duration > 0 &&
         object.shown.time == w.now.clock.shown;
}

/// mm/s by node: what the last step changed of its load, over its length; nothing where it stands
/// still. Both shapes are those of the model as it is, so that a wound that has just opened counts
/// for nothing. \param afresh with another factor of its own   \throw Error as Elastostatic
std::vector<Vec3> shape_velocity(World& w, Object& object, bool afresh) {
  if (!object.came.velocity.empty())
    return object.came.velocity;
  if (!has_moved(w, object))
    return {};
  contact::Load load = *object.came.load, now = *object.shown.load;
  // Nodes that instruments push are where they are.
  for (const auto& [node, u] : object.came.touched)
    load.displacement[node] = u;
  for (const contact::NodalContactForce& t : object.shown.contact)
    now.displacement[t.node] = contact_displacement(object, t.node);
  std::vector<Vec3> velocity;
  const auto between = [&](std::span<const double> before, std::span<const double> after) {
    for (std::size_t i = 0; i < object.model().nodes.size(); ++i)
      velocity.push_back((vector_at(after, i) - vector_at(before, i)) / object.came.duration);
  };
  try {
    if (has_law(object)) {
      std::optional<dynamics::SolidStatic> own;
      if (afresh)
        own.emplace(object.model(), *law_of(object), w.context);
      dynamics::SolidStatic& strained = afresh ? *own : strained_of(w, object);
      strained.update(load);
      const std::span<const double> shape = strained.displacement();
      const std::vector<double> before(shape.begin(), shape.end());
      strained.update(now);
      between(before, strained.displacement());
      return velocity;
    }
    if (object.warp) {
      std::optional<statics::WarpedStatics> own;
      if (afresh)
        own.emplace(object.model(), nullptr, w.context);
      statics::WarpedStatics& warped = afresh ? *own : warped_of(w, object);
      warped.update(load);
      const std::span<const double> shape = warped.displacement();
      const std::vector<double> before(shape.begin(), shape.end());
      warped.update(now);
      between(before, warped.displacement());
      return velocity;
    }
    std::optional<statics::Elastostatic> own;
    std::optional<statics::TwoStep> own_stages;
    if (afresh)
      own.emplace(object.model(), nullptr, w.context);
    if (afresh && object.stages.options)
      own_stages.emplace(object.model(), object.stages.second(), w.context, *object.stages.options);
    statics::Elastostatic& solver = afresh ? *own : solver_of(w, object);
    const auto shape_under = [&](const contact::Load& acting) {
      if (!object.stages.options) {
        solver.update(acting);
        return solver.displacement();
      }
      statics::TwoStep& both = afresh ? *own_stages : two_step_of(w, object);
      both.update(solver, acting);
      return both.displacement(solver);
    };
    const std::span<const double> shape = shape_under(load);
    const std::vector<double> before(shape.begin(), shape.end());
    between(before, shape_under(now));
  } catch (const linalg::SingularStiffness&) {
    // The object is free to move, and no shape has been computed since.
  }
  return velocity;
}

} // namespace gewebe::scene
