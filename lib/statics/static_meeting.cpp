#include "statics/static_meeting.h"

#include "base/vector_at.h"

#include <algorithm>
#include <utility>

namespace gewebe {

StaticMeeting::StaticMeeting(std::shared_ptr<const Model> model,
                             std::vector<SurfaceMeeting> meetings, std::span<const double> shape,
                             std::vector<NodeTouch> touches, std::vector<PointTouch> points)
    : model_(std::move(model)), pairs_(*model_, std::move(meetings)),
      contact_(*model_, shape, std::move(touches), std::move(points)) {}

std::vector<double> StaticMeeting::places(std::span<const double> shape) const {
  std::vector<double> all(shape.begin(), shape.end());
  for (std::size_t i = 0; i < model_->nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      all[axis_of(static_cast<std::uint32_t>(i), a)] += model_->nodes[i].position[a];
  return all;
}

/// Whether any surfaces are in each other, or have passed on their way to a shape.
bool StaticMeeting::come_together(std::span<const double> before, std::span<const double> shape) {
  return !pairs_.find(shape, before, 0).empty() ||
         !pairs_.find_passed(shape, before, surface_depth * pairs_.edge()).empty();
}

/// As if surfaces were not there. \return whether that is right; else nothing has changed
bool StaticMeeting::free_update(Yielding& objects, const std::map<std::uint32_t, Vec3>& displaced,
                                std::span<const std::optional<MovedInstrument>> instruments,
                                std::vector<double>& shape, bool last) {
  const std::vector<double> before = shape, still(shape.size());
  (void)pairs_.may_touch(places(before), still, 0); // looks how near they are, now and then
  const std::vector<NodeTouch> touches = contact_.touches();
  const std::vector<PointTouch> points = contact_.points();
  const TouchCounts counts = contact_.take_counts();
  contact_.update(objects, displaced, instruments, shape, last);
  if (pairs_.may_have_touched(places(shape)) && come_together(before, shape)) {
    (void)contact_.take_counts();
    shape = before;
    contact_.restart(shape, touches, points);
    met_.add(counts);
    return false;
  }
  met_.add(counts);
  touches_ = contact_.touches();
  solved_ = settled_ = contact_.solved();
  return true;
}

void StaticMeeting::update(Yielding& objects, const std::map<std::uint32_t, Vec3>& displaced,
                           std::span<const std::optional<MovedInstrument>> instruments,
                           std::vector<double>& shape, std::vector<SurfacePush>& pushes, bool last,
                           int most_turns) {
  if (pushes.empty() && free_update(objects, displaced, instruments, shape, last))
    return;
  MeetingYielding both(
      objects, pairs_,
      [&](std::uint32_t node) {
        return model_->nodes[node].fixed == fixed_all || displaced.contains(node);
      },
      shape, pushes, most_turns);
  contact_.update(both, displaced, instruments, shape, last);
  const TouchCounts counts = both.counts();
  met_.add(counts);
  pushes = both.kept();
  touches_ = both.touches();
  touches_.insert(touches_.end(), contact_.touches().begin(), contact_.touches().end());
  touches_ = sums_of_touches(std::move(touches_));
  solved_ = contact_.solved() && both.solved();
  settled_ = solved_ && std::ranges::none_of(pushes, [&](const SurfacePush& p) {
               return !p.pair.apart && !(p.pair.gap >= -surface_depth * pairs_.edge());
             });
}

void StaticMeeting::restart(std::span<const double> shape, std::vector<NodeTouch> touches) {
  std::erase_if(touches, [](const NodeTouch& t) { return t.instrument == other_surface; });
  contact_.restart(shape, std::move(touches));
}

double StaticMeeting::way_of(std::span<const double> before, std::span<const double> after) const {
  std::vector<double> moved(before.size());
  for (std::size_t k = 0; k < moved.size(); ++k)
    moved[k] = after[k] - before[k];
  return pairs_.way_of(moved);
}

TouchCounts StaticMeeting::take_counts() {
  TouchCounts all = contact_.take_counts();
  all.add(std::exchange(met_, {}));
  return all;
}

} // namespace gewebe
