#pragma once
// Instruments against a surface that moves in explicit steps (solid_contact.h has implicit ones).
// Behind each integration step the pieces of surface that are in one (contact/surface_point.h)
//
//   exchange impulses with it: no point's velocity leads into the instrument, against the
//   instrument's own surface, and what slides along it is braked by up to μ times the push
//   (Coulomb); nodes move by what their velocities change, then out of what is left, the less the
//   heavier they are.
//
// The force on a node is m Δv/h. Blocks of surface that are far from all instruments are looked at
// every few steps only; behind the last step of an advance all that may be near are, so that no
// shape is shown with an instrument in it.

#include "contact/coupling.h"
#include "contact/instrument.h"
#include "contact/surface_point.h"
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
  std::optional<LedInstrument> led{}; ///< the way is a hand's; it gives way to what it touches

  /// Now, at `time`.
  Pose at(double time) const {
    Pose pose = way.at(time);
    if (led)
      pose.place = led->place;
    return pose;
  }
  /// Behind a step of h to `time`, as far as is known before it.
  Pose guess(double time, double h) const {
    Pose pose = way.at(time);
    if (led)
      pose.place = led->guess(pose.place, h);
    return pose;
  }
  /// Whether it was elsewhere before the way that begins at `start`.
  bool jumped(double start) const { return !led && before != way.at(start); }
  /// Whether it moves in the step that ends at `time`.
  bool moves(double time, double h) const {
    return led && !(norm(guess(time, h).place - led->place) <= led_to_rest * shape.radius);
  }
};

/// The instruments in one integration step.
struct ContactMoment {
  struct There {
    std::uint32_t instrument = 0;
    PlacedInstrument placed;                  ///< at the end
    Pose from, to;                            ///< of the step, a jump left out
    Vec3 hand;                                ///< that leads it, at the end
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
  /// Keeps a reference to the layout.
  DynamicContact(const Model& model, const SpringLayout& layout);

  /// Where an instrument pushed in the last step, from which the next one starts to guess.
  struct Guess {
    std::uint32_t instrument = 0;
    CorePart part = CorePart::first_end;
    Facet rows{};
    Vec3 force;
  };
  /// All that changes, to go back to.
  struct State {
    std::vector<std::optional<MovingInstrument>> instruments;
    std::vector<std::uint64_t> next_look; ///< step, by block
    std::vector<NodeTouch> impulses;      ///< row and instrument ascending
    std::vector<Guess> guesses;           ///< ascending
    std::vector<NodeTouch> held;          ///< forces
    double held_time = 0;                 ///< that they acted since the last take
    std::vector<NodeTouch> resting;       ///< impulses of those before
  };
  const State& state() const noexcept { return state_; }
  void restore(const State& state) { state_ = state; }

  /// Instruments during the next advance, by number; an absent one is no element.
  void begin(std::vector<std::optional<MovingInstrument>> instruments);

  /// \param time where step number `step` of `steps` begins, h its length
  ContactMoment moment(std::uint64_t step, std::uint64_t steps, double time, double h) const;

  /// Whether keep_out has to look at anything behind this step. Nothing that it asks changes before
  /// keep_out is called.
  bool due(const ContactMoment& moment) const;
  /// Behind the step of all blocks from `now` to `next`, before the next one. \param traits, now,
  /// next by row
  void keep_out(const ContactMoment& moment, std::span<const NodeTraits> traits,
                std::span<const NodeRow> now, std::span<NodeRow> next);

  /// Whether no instrument moves from `start` on, in steps of h.
  bool still(double start, double h) const;
  /// An instrument that is led, as it is now.
  std::optional<LedInstrument> led(std::size_t instrument) const {
    return instrument < state_.instruments.size() && state_.instruments[instrument]
               ? state_.instruments[instrument]->led
               : std::nullopt;
  }
  /// Whether a piece is inside one, as they stand in the end.
  bool inside(std::span<const NodeTraits> traits, std::span<const NodeRow> rows) const;
  /// What is left of accelerations of nodes at rest by the instruments that they touch, whose
  /// forces on them join `touches`, by ascending node. \param acceleration by row \pre still
  void balance(std::span<const NodeTraits> traits, std::span<const NodeRow> rows,
               std::span<Vec3> acceleration, std::vector<NodeTouch>& touches) const;
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
  struct Near;
  Near near_pieces(std::span<const std::uint32_t> numbers, std::span<const NodeTraits> traits,
                   std::span<const NodeRow> rows) const;
  std::vector<std::uint32_t> pieces_near(const Box3& box, std::span<const NodeRow> rows) const;
  Vec3 place(std::span<const NodeRow> rows, std::uint32_t row) const;
  void look(const ContactMoment& moment, std::span<const NodeRow> next,
            std::vector<std::uint32_t>& numbers);
  void lead(const ContactMoment& moment, std::span<const Vec3> impulses);
  void take_part_pinched(Near& near, const ContactMoment& moment) const;

  const SpringLayout& layout_;
  std::vector<Facet> pieces_;      ///< by rows, block by block
  std::vector<std::size_t> first_; ///< piece of each block, and the end
  std::vector<Vec3> inward_;       ///< at rest, by row
  State state_;
};

} // namespace gewebe
