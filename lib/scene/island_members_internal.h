#pragma once
// Objects and instruments as members of an island (contact/island.h).

#include "contact/held_body.h"
#include "contact/instrument_body.h"
#include "contact/island.h"
#include "contact/nodal_contact_force.h"
#include "scene/world_internal.h"
#include "statics/static_contact_body.h"
#include "statics/surface_tiles.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::scene {

/// Members of an island. Each list ascends.
struct IslandParts {
  std::vector<std::shared_ptr<Body>> bodies;
  std::vector<std::size_t> statics; ///< elastostatic objects
  std::vector<std::size_t> instruments;

  bool empty() const { return bodies.empty() && statics.empty(); }
  std::vector<std::size_t> objects() const;
};

/// A node that an instrument grasps. It has no contact with that instrument.
struct HeldNode {
  std::size_t object = 0;
  std::uint32_t node = 0;
  std::size_t instrument = 0;
  auto operator<=>(const HeldNode&) const = default;
};

/// Where contact of an elastostatic object is found on a part of its surface alone.
struct ContactReach {
  contact::ModelSurface surface;
  statics::SurfaceTiles tiles;
  std::vector<contact::NodeVector> forces{}; ///< of `bounds`, see SurfaceTiles
  std::vector<double> bounds{};

  ContactReach(contact::ModelSurface&& of, const columns::NodeClusters& clusters)
      : surface(std::move(of)), tiles(surface, clusters) {}
  ContactReach(const ContactReach&) = delete;
  ContactReach& operator=(const ContactReach&) = delete;
};
/// That of an object which only instruments touch, whose load does not change and is forces alone,
/// and whose solver finds parts of its shape alone; else null. The same, to the bit, whatever has
/// been read of the scene. \throw as solver_of
std::shared_ptr<ContactReach> contact_reach(World& w, std::size_t index);
/// Bounds of its displacements under some contact forces.
const std::vector<double>& bounds_under(World& w, std::size_t index, ContactReach& reach,
                                        std::span<const contact::NodalContactForce> contact);
/// Box that holds the surface of an elastostatic object, small enough to tell what is near it.
Box3 contact_box(World& w, std::size_t index);
/// Displacement of a node in contact.
Vec3 contact_displacement(const Object& object, std::uint32_t node);

/// An island with a part of an object's surface.
struct PartIsland {
  std::shared_ptr<const ContactReach> reach;
  std::vector<std::uint32_t> tiles;
  statics::SurfacePatch part;
  std::unique_ptr<contact::IslandMotion> motion;
};

/// Cached surfaces of an island. They are valid while the models and instruments stay the same.
struct IslandCache {
  struct Key {
    std::shared_ptr<const model::Model> model;
    std::size_t parts = 1;
    contact::InstrumentShape shape{};
    bool operator==(const Key& other) const {
      return model == other.model && parts == other.parts && shape.radius == other.shape.radius &&
             shape.axis == other.shape.axis && shape.core == other.shape.core;
    }
  };
  std::vector<Key> keys;
  std::vector<double> friction; ///< coefficients of all pairs of surfaces
  std::vector<HeldNode> held;   ///< by instruments
  std::deque<contact::ModelSurface> models;
  std::deque<contact::BodySurface> surfaces;
  std::vector<std::uint32_t> instrument_of_piece; ///< or other_surface
  std::unique_ptr<contact::IslandMotion> motion;
  std::deque<PartIsland> parts; ///< the last ones
  std::uint64_t used = 0;
};

/// Cached island of one elastostatic object's tiles, ascending, and of instruments.
PartIsland& part_island(IslandCache& whole, const std::shared_ptr<const ContactReach>& reach,
                        std::vector<std::uint32_t> tiles);

/// Cached island of these parts. It is created at its first use.
IslandCache& island_of(World& w, const IslandParts& parts);

/// An elastodynamic body in an island.
class BodyMember final : public contact::IslandMember {
public:
  BodyMember(World& w, Body& body, const contact::ModelSurface& surface,
             const std::vector<std::uint32_t>& instrument_of_piece)
      : w_(w), body_(body), surface_(surface), instrument_of_piece_(instrument_of_piece) {}
  contact::ContactBody& begin(const contact::Interval& step, const Context& context) override;
  void end(std::span<const Force> forces, const contact::Interval& step,
           const Context& context) override;
  bool has_first_stage() const override { return body_.moving->has_first_stage(); }
  /// Whether instruments jump in these steps. The velocity that they cause is then removed.
  void set_clearing(bool clearing) { clearing_ = clearing; }

private:
  std::vector<contact::NodalContactForce>
  forces_on(const Object& part, std::span<const contact::NodalContactForce> all) const;

  World& w_;
  Body& body_;
  const contact::ModelSurface& surface_;
  const std::vector<std::uint32_t>& instrument_of_piece_;
  bool clearing_ = false;
  std::vector<contact::NodalContactForce> first_; ///< of the last first stage
};

/// An elastostatic object in an island.
class StaticMember final : public contact::IslandMember {
public:
  StaticMember(World& w, std::size_t object, const contact::ModelSurface& surface,
               const std::vector<std::uint32_t>& instrument_of_piece);
  contact::ContactBody& begin(const contact::Interval& step, const Context& context) override;
  void end(std::span<const Force> forces, const contact::Interval& step,
           const Context& context) override;
  /// Replaces the load at the end of the step.
  void set_load(contact::Load load) { given_ = std::move(load); }
  /// Replaces the time at that end, for what relaxes.
  void set_time(double time) { given_time_ = time; }
  /// Finds contact on a part of the surface: that of the constructor. \param begin  load at the
  /// beginning of the step \param check  called with the contact forces before the step ends
  void take_part(const statics::SurfacePatch& part, const contact::Load& begin,
                 std::function<void(std::span<const contact::NodalContactForce>)> check);
  /// Interpolates the load between `start` and `end`, from that of the output state to that at
  /// `end`, unless it pulses. A jump of the load between steps of the scene then moves other
  /// objects no faster than this interval allows.
  void follow_load(double start, double end);

private:
  struct Way {
    contact::Load from, to;
    std::vector<double> stood; ///< displacement at `start`
    double start = 0, end = 0;
  };
  World& w_;
  std::size_t object_;
  const contact::ModelSurface& surface_;
  const std::vector<std::uint32_t>& instrument_of_piece_;
  void end_part();
  struct Part {
    const statics::SurfacePatch* part = nullptr;
    const contact::Load* begin = nullptr;
    std::function<void(std::span<const contact::NodalContactForce>)> check;
    std::vector<double> stood; ///< displacement of its clusters
  };
  contact::Load load_;
  std::optional<Part> part_;
  std::optional<contact::Load> given_;
  std::optional<double> given_time_;
  std::optional<Way> way_;
  std::unique_ptr<statics::StaticContactBody> body_;
  dynamics::SolidStatic* strained_ = nullptr; ///< instead of body_ if the object has a law
  std::unique_ptr<contact::HeldBody> held_;   ///< instead of body_ if the model holds all nodes
};

/// An instrument in an island.
class InstrumentMember final : public contact::IslandMember {
public:
  /// \param start  its present pose
  InstrumentMember(World& w, std::size_t instrument, const contact::BodySurface& surface,
                   const contact::Pose& start)
      : w_(w), instrument_(instrument), surface_(surface), now_(start) {}
  contact::ContactBody& begin(const contact::Interval& step, const Context& context) override;
  void end(std::span<const Force> forces, const contact::Interval& step,
           const Context& context) override;
  /// Sets the pose at the end of the next step, instead of that of the instrument's path.
  /// \param duration  of the step, for a coupling
  void set_target(const contact::Pose& target, double duration) {
    given_ = target;
    duration_ = duration;
  }
  void follow_way() { given_.reset(); }
  const contact::Pose& pose() const { return now_; }
  /// Pose at the end of the step that has been begun. \pre it is solved
  contact::Pose end_pose() const {
    return {target_.place + (instrument().coupled ? body_->displacement() : Vec3{}), target_.turn};
  }

private:
  Instrument& instrument() const { return w_.now.instruments[instrument_]; }
  World& w_;
  std::size_t instrument_;
  const contact::BodySurface& surface_;
  contact::Pose now_, target_;
  Vec3 hand_; ///< at the end of the step
  Vec3 lag_;  ///< of a coupling where a first stage began
  std::optional<contact::Pose> given_;
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
/// \param start  poses of the instruments, in the order of parts.instruments
void make_members(World& w, const IslandParts& parts, const IslandCache& island,
                  std::span<const contact::Pose> start, IslandMembers& members);

/// Largest displacement of an instrument's point in one step, over its radius.
inline constexpr double instrument_step = 0.5;

/// Interpolates between two loads. Prescribed displacements start at the present ones of their
/// nodes. \param shape  displacement at the start \param part  0: `from`, 1: `to`
contact::Load load_between(const contact::Load& from, const contact::Load& to,
                           std::span<const double> shape, double part);
/// Displacement of the output state: of all nodes if a displaced node is inside the solid, else of
/// the surface.
std::vector<double> stood_shape(World& w, Object& object);
/// \throw Error that names the island's objects
[[noreturn]] void fail_contact(const World& w, const IslandParts& parts, const Error& error);
void count_contact(World& w, const contact::StepReport& report);
/// Bounding box of an instrument between two poses.
Box3 box_between(const contact::InstrumentShape& shape, const contact::Pose& from,
                 const contact::Pose& to);
/// Number of steps between two poses such that each moves by at most instrument_step.
std::size_t parts_of_way(const contact::InstrumentShape& shape, const contact::Pose& from,
                         const contact::Pose& to);
/// Whether instruments may touch the object. If not, a warning is issued once.
bool takes_instruments(World& w, Object& object);
/// Lets a coupled instrument that touches nothing follow its hand.
void follow_hand(Instrument& i, double duration, double to);
/// Bounding box of an object's surface in its output state.
const Box3& shown_box(World& w, std::size_t index);

} // namespace gewebe::scene
