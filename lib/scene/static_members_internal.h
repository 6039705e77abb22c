#pragma once
// Elastostatic objects as they give way to contact, one behind the other, and the loads by which
// they go on: of those that touch each other alone (static_meetings.cpp), and of those beside a
// body that moves (beside.cpp).

#include "contact/load.h"
#include "scene/world_internal.h"
#include "statics/joined_yielding.h"
#include "statics/two_step_contact.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <vector>

namespace gewebe::simulation {

/// What acted on an object as it is shown, as a load that leads to the one to come: who is let go
/// is held by a force, who will be displaced is where it is.
Load load_before(const Object& object, const Load& next);
/// A load as one that leads to the next one from a shape: who is let go is let go at once.
Load load_from(Load last, std::span<const double> shape, const Load& next);
/// Between two that displace the same nodes.
Load load_between(const Load& from, const Load& to, double part);

/// Without what other surfaces push with.
std::vector<NodeTouch> by_instruments(std::vector<NodeTouch> touches);
/// A point of an object, by its numbers in a whole, or back.
PointTouch shifted(PointTouch point, std::uint32_t up, std::uint32_t down);

class StaticMembers {
public:
  /// Keeps references.
  StaticMembers(World& w, std::vector<Object*> objects);

  std::size_t nodes() const { return nodes_; }
  std::uint32_t first(std::size_t k) const { return first_[k]; }
  std::uint32_t end(std::size_t k) const {
    return k + 1 < first_.size() ? first_[k + 1] : static_cast<std::uint32_t>(nodes_);
  }
  std::size_t of(std::uint32_t node) const;

  std::vector<double> shape() const;
  /// Touches of all that are shown.
  std::vector<NodeTouch> touches() const;
  std::vector<PointTouch> points() const;

  /// What acts on them from now on.
  void set_loads(std::vector<Load> loads) { loads_ = std::move(loads); }
  std::map<std::uint32_t, Vec3> displaced() const;

  /// \param last touches by which they are as they are
  JoinedYielding joined(std::span<const NodeTouch> last);
  /// Whether the last joined ones found all that was asked of them. \pre they live
  bool solved() const;

private:
  World& w_;
  std::vector<Object*> objects_;
  std::vector<std::uint32_t> first_; ///< node of each in the whole
  std::size_t nodes_ = 0;
  std::vector<Load> loads_;
  std::deque<TwoStepYielding::Stages> stages_; // which those of two steps refer to
  std::vector<const TwoStepYielding*> both_;
};

} // namespace gewebe::simulation
