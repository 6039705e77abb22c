#pragma once
// Elastostatic objects whose surfaces may touch each other or themselves, and instruments among
// them: static_contact.h with what meeting_yielding.h makes of the objects in place of one.

#include "contact/surface_pairs.h"
#include "model/model.h"
#include "statics/meeting_yielding.h"
#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

class StaticMeeting {
public:
  /// \param model of all objects, one behind the other \param shape the present one, of all nodes
  /// \param touches, points of instruments in it
  StaticMeeting(std::shared_ptr<const Model> model, std::vector<SurfaceMeeting> meetings,
                std::span<const double> shape, std::vector<NodeTouch> touches,
                std::vector<PointTouch> points);

  /// As StaticContact::update. Surfaces that can't have come together since somebody looked how
  /// near they are cost little more than none; where that is not sure and none pushes, it is as
  /// without them unless any have come together or passed. \param objects as one, of all nodes
  /// \param pushes of surfaces in the present shape, and then in the new one \param most_turns as
  /// MeetingYielding has it
  void update(Yielding& objects, const std::map<std::uint32_t, Vec3>& displaced,
              std::span<const std::optional<MovedInstrument>> instruments,
              std::vector<double>& shape, std::vector<SurfacePush>& pushes, bool last,
              int most_turns);

  /// From another state: its shape and what instruments touch in it.
  void restart(std::span<const double> shape, std::vector<NodeTouch> touches);
  /// How far surfaces move against each other from one shape to the other, at most, over an edge.
  double way_of(std::span<const double> before, std::span<const double> after) const;

  const Model& model() const noexcept { return *model_; }
  /// Of instruments and of other surfaces, by ascending node and instrument.
  const std::vector<NodeTouch>& touches() const noexcept { return touches_; }
  const std::vector<PointTouch>& points() const noexcept { return contact_.points(); }
  std::optional<NodeTouch> stuck() const { return contact_.stuck(); }
  /// Whether the last forces meet the conditions.
  bool solved() const noexcept { return solved_; }
  /// Whether the next update has nothing to do where nothing moves: forces are found, and nothing
  /// overlaps that comes apart.
  bool settled() const noexcept { return settled_; }
  const Box3& box() const noexcept { return contact_.box(); }
  /// Since the last call.
  TouchCounts take_counts();

private:
  bool free_update(Yielding& objects, const std::map<std::uint32_t, Vec3>& displaced,
                   std::span<const std::optional<MovedInstrument>> instruments,
                   std::vector<double>& shape, bool last);
  bool come_together(std::span<const double> before, std::span<const double> shape);
  std::vector<double> places(std::span<const double> shape) const;

  std::shared_ptr<const Model> model_;
  SurfacePairs pairs_;
  StaticContact contact_;
  std::vector<NodeTouch> touches_;
  bool solved_ = true, settled_ = false;
  TouchCounts met_;
};

} // namespace gewebe
