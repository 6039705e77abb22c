#pragma once
// Objects and instruments as members of an island (contact/island.h).

#include "contact/held_body.h"
#include "contact/instrument_body.h"
#include "contact/island.h"
#include "contact/nodal_contact_force.h"
#include "scene/world_internal.h"
#include "statics/static_contact_body.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::simulation {

/// What an island consists of, ascending each.
struct IslandParts {
  std::vector<std::shared_ptr<Body>> bodies;
  std::vector<std::size_t> statics; ///< elastostatic objects
  std::vector<std::size_t> instruments;

  bool empty() const { return bodies.empty() && statics.empty(); }
  std::vector<std::size_t> objects() const;
};

/// A node that an instrument grasps, which does not touch what has it.
struct HeldNode {
  std::size_t object = 0;
  std::uint32_t node = 0;
  std::size_t instrument = 0;
  auto operator<=>(const HeldNode&) const = default;
};

/// Surfaces of an island, which serve as long as the same models and instruments take part.
struct IslandCache {
  struct Key {
    std::shared_ptr<const Model> model;
    std::size_t parts = 1;
    InstrumentShape shape{};
    bool operator==(const Key& other) const {
      return model == other.model && parts == other.parts && shape.radius == other.shape.radius &&
             shape.axis == other.shape.axis && shape.core == other.shape.core;
    }
  };
  std::vector<Key> keys;
  std::vector<double> friction; ///< of all pairs of pieces
  std::vector<HeldNode> held;   ///< by instruments
  std::deque<contact::ModelSurface> models;
  std::deque<contact::BodySurface> surfaces;
  std::vector<std::uint32_t> instrument_of_piece; ///< or other_surface
  std::unique_ptr<contact::IslandMotion> motion;
  std::uint64_t used = 0;
};

/// The island of these parts, made where it is not known yet.
IslandCache& island_of(World& w, const IslandParts& parts);

class BodyMember final : public contact::IslandMember {
public:
  BodyMember(World& w, Body& body, const contact::ModelSurface& surface,
             const std::vector<std::uint32_t>& instrument_of_piece)
      : w_(w), body_(body), surface_(surface), instrument_of_piece_(instrument_of_piece) {}
  contact::ContactBody& begin(double from, double to, const Context& context) override;
  void end(std::span<const Force> forces, double h, const Context& context) override;
  /// Whether steps are of instruments that jump: nothing is left of their speed.
  void set_clearing(bool clearing) { clearing_ = clearing; }

private:
  World& w_;
  Body& body_;
  const contact::ModelSurface& surface_;
  const std::vector<std::uint32_t>& instrument_of_piece_;
  bool clearing_ = false;
};

class StaticMember final : public contact::IslandMember {
public:
  StaticMember(World& w, std::size_t object, const contact::ModelSurface& surface,
               const std::vector<std::uint32_t>& instrument_of_piece);
  contact::ContactBody& begin(double from, double to, const Context& context) override;
  void end(std::span<const Force> forces, double h, const Context& context) override;
  /// In place of the load at the end of the step.
  void set_load(Load load) { given_ = std::move(load); }
  /// Lets the load go from what is shown to that at the end of a way, unless it pulses: what jumps
  /// between steps of the scene moves others no faster than the way takes.
  void follow_load(double start, double end);

private:
  struct Way {
    Load from, to;
    std::vector<double> stood; ///< displacement at the start
    double start = 0, end = 0;
  };
  World& w_;
  std::size_t object_;
  const contact::ModelSurface& surface_;
  const std::vector<std::uint32_t>& instrument_of_piece_;
  Load load_;
  std::optional<Load> given_;
  std::optional<Way> way_;
  std::unique_ptr<StaticContactBody> body_;
  std::unique_ptr<contact::HeldBody> held_; ///< in its place where the model holds all nodes
};

class InstrumentMember final : public contact::IslandMember {
public:
  /// \param start  where it stands
  InstrumentMember(World& w, std::size_t instrument, const contact::BodySurface& surface,
                   const Pose& start)
      : w_(w), instrument_(instrument), surface_(surface), now_(start) {}
  contact::ContactBody& begin(double from, double to, const Context& context) override;
  void end(std::span<const Force> forces, double h, const Context& context) override;
  /// Goes there in the next step, in place of its way. \param duration  of that, for a coupling
  void set_target(const Pose& target, double duration) {
    given_ = target;
    duration_ = duration;
  }
  void follow_way() { given_.reset(); }
  const Pose& pose() const { return now_; }

private:
  Instrument& instrument() const { return w_.now.instruments[instrument_]; }
  World& w_;
  std::size_t instrument_;
  const contact::BodySurface& surface_;
  Pose now_, target_;
  Vec3 hand_; ///< at the end of the step
  std::optional<Pose> given_;
  double duration_ = 0;
  std::unique_ptr<contact::InstrumentBody> body_;
};

/// All members of an island, in the order of its surfaces.
struct IslandMembers {
  std::deque<BodyMember> bodies;
  std::deque<StaticMember> statics;
  std::deque<InstrumentMember> instruments;
  std::vector<contact::IslandMember*> all;
};
/// \param start  where instruments stand, by number of the parts'
void make_members(World& w, const IslandParts& parts, const IslandCache& island,
                  std::span<const Pose> start, IslandMembers& members);

/// Largest displacement of an instrument's point in one step, over its radius.
inline constexpr double instrument_step = 0.5;

/// Between two loads; of prescribed displacements the way from where nodes stand.
Load load_between(const Load& from, const Load& to, std::span<const double> shape, double part);
/// The shape that is shown, as far as displaced nodes need it: of all nodes if one of them is
/// inside.
std::vector<double> stood_shape(World& w, Object& object);
/// \throw Error that names the island's objects
[[noreturn]] void fail_contact(const World& w, const IslandParts& parts, const Error& error);
void count_contact(World& w, const contact::StepReport& report);
/// What an instrument passes between two poses.
Box3 box_between(const InstrumentShape& shape, const Pose& from, const Pose& to);
/// Parts of a way in which it moves by at most instrument_step.
std::size_t parts_of_way(const InstrumentShape& shape, const Pose& from, const Pose& to);
/// Whether the object may be touched by instruments; told once where not.
bool takes_instruments(World& w, Object& object);
/// A coupled instrument that touches nothing follows its hand.
void follow_hand(Instrument& i, double duration, double to);
/// Box of the surface of an object as it is shown.
const Box3& shown_box(World& w, std::size_t index);

} // namespace gewebe::simulation
