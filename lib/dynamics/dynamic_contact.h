#pragma once
// Instruments against nodes that move in explicit steps (solid_contact.h has implicit ones).
// Behind each integration step a node inside one
//
//   loses the part of its velocity that leads into the instrument, against the instrument's own
//   surface, and of the part along the surface up to μ times as much (Coulomb); then it moves out
//   along the normal, onto the surface.
//
// The force on it is m Δv/h. Blocks of nodes that are far from all instruments are looked at every
// few steps only; behind the last step of an advance all that may be near are, so that no shape is
// shown with a node inside.

#include "contact/instrument.h"
#include "dynamics/spring_force.h"
#include "dynamics/spring_layout.h"
#include "model/model.h"
#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// An instrument during an advance: at its beginning it may jump, from `before` to its way.
struct MovingInstrument {
  InstrumentShape shape;
  Pose before;
  PoseWay way;
};

/// The instruments in one integration step.
struct ContactMoment {
  struct There {
    std::uint32_t instrument = 0;
    PlacedInstrument placed;                  ///< at the end
    Pose from, to;                            ///< of the step, a jump left out
    std::vector<PlacedInstrument> on_its_way; ///< where it was before, if it is fast
    Box3 box;                                 ///< of all these
    double speed = 0;                         ///< mm/s at most, a jump left out
  };
  std::vector<There> there;
  double h = 0;
  std::uint64_t step = 0;
  bool last = false; ///< of the advance
};

class DynamicContact {
public:
  /// Keeps references to both.
  DynamicContact(const Model& model, const SpringLayout& layout);

  /// All that changes, to go back to.
  struct State {
    std::vector<std::optional<MovingInstrument>> instruments;
    std::vector<std::uint64_t> next_look;         ///< step, by block
    std::vector<std::vector<NodeTouch>> impulses; ///< by block: row and instrument ascending
    std::vector<NodeTouch> held;                  ///< forces
    double held_time = 0;                         ///< that they acted since the last take
    std::vector<NodeTouch> resting;               ///< impulses of those before
  };
  const State& state() const noexcept { return state_; }
  void restore(const State& state) { state_ = state; }

  /// Instruments during the next advance, by number; an absent one is no element.
  void begin(std::vector<std::optional<MovingInstrument>> instruments);

  /// \param time where step number `step` of `steps` begins, h its length
  ContactMoment moment(std::uint64_t step, std::uint64_t steps, double time, double h) const;

  /// Behind the step of a block, before the next one. Safe for different blocks at once.
  void keep_out(std::size_t block, const ContactMoment& moment, const NodeTraits* traits,
                NodeRow* next);

  /// Whether no instrument moves from `start` on.
  bool still(double start) const;
  /// Whether a node is inside one, as they stand in the end.
  bool inside(std::uint32_t node, const Vec3& displacement) const;
  /// What is left of the acceleration of a node at rest by the instruments that it touches, whose
  /// forces on it join `touches`. \pre still
  Vec3 left_of(std::uint32_t node, const Vec3& displacement, const Vec3& inverse_mass,
               const Vec3& acceleration, std::vector<NodeTouch>& touches) const;
  /// From now on these forces, by ascending node, act on nodes at rest; none: they move.
  void hold(std::vector<NodeTouch> touches);
  /// They did so for `duration` s.
  void stay(double duration) { state_.held_time += duration; }
  const std::vector<NodeTouch>& held() const noexcept { return state_.held; }
  /// For how long since the last take, up to now.
  double held_time() const noexcept { return state_.held_time; }
  /// The impulses since the last call, in place of forces, by ascending node and instrument.
  std::vector<NodeTouch> take();

private:
  void push(std::size_t row, const ContactMoment& moment, const NodeTraits& traits, NodeRow& state,
            std::vector<NodeTouch>& impulses) const;
  const Model& model_;
  const SpringLayout& layout_;
  std::size_t surface_ = 0;
  std::vector<Vec3> inward_; ///< at rest, by node
  State state_;
};

} // namespace gewebe
