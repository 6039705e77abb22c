#pragma once
// What can be done to a scene: objects and instruments by number, nodes by number.

#include "compliance/compliance_source.h"
#include "contact/coupling.h"
#include "contact/instrument.h"
#include "contact/load.h"
#include "model/cut_select.h"
#include "solid/tear_solid.h"
#include "statics/two_step.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace gewebe {

enum class Method { ffe, ela }; ///< elastostatic (with stored stiffness), elastodynamic

/// "ffe", "ela".
constexpr const char* method_name(Method method) {
  return method == Method::ffe ? "ffe" : "ela";
}

/// How an elastodynamic net moves: by explicit steps (dynamics/elastodynamic.h), by those of solids
/// (dynamics/solid_dynamic.h), or by these where explicit ones are far too short.
enum class Integration { semi_implicit, implicit, automatic };

struct SetForce {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  Vec3 force;        ///< on each; 0 takes it away
  double period = 0; ///< s; 0: it does not pulse
};
struct SetPressure {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  NodePressure pressure; ///< 0 takes it away
};
struct SetMass {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  double mass = 0; ///< g, on each beside its own; 0 takes it away
};
struct SetDisplacement {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  Vec3 displacement;
  double duration = 0; ///< s that the way there takes an elastodynamic object's nodes
};
/// Ties each of the first object's nodes to the nearest of the second's by a spring, at rest as
/// they stand.
struct Attach {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  std::size_t other = 0;
  std::vector<std::uint32_t> others;
  double stiffness = 0; ///< g/s², of each spring
};
struct Release { ///< of force, pressure, displacement and grasp
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
};
/// Puts an instrument there, in place of itself, or moves it from where it is.
struct SetInstrument {
  std::size_t instrument = 0; ///< instrument_count(): a new one, from when this is accepted
  InstrumentShape shape;      ///< radius > 0, friction >= 0
  Pose pose;                  ///< turn of length 1
  std::string name{};         ///< of a new one, which no other has
};
struct MoveInstrument {
  std::size_t instrument = 0;
  Vec3 place;
  std::optional<Quaternion> turn; ///< of length 1; none: as it is
  double duration = 0;            ///< s that the way takes
};
/// Nodes follow an instrument as parts of it, from where they stand.
struct Grasp {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  std::size_t instrument = 0;
};
/// A hand leads the instrument through a spring and a damper from now on, or again at once.
struct SetCoupling {
  std::size_t instrument = 0;
  std::optional<Coupling> coupling;
};
/// Takes an instrument away; what it grasped is released.
struct Withdraw {
  std::size_t instrument = 0;
};
/// Surfaces of two objects, or of one with itself, may touch from now on but not pass.
struct SetContact {
  std::size_t object = 0, other = 0; ///< the same: with itself
  double friction = 0;               ///< Coulomb's coefficient, >= 0
};
struct SetGravity {
  Vec3 gravity;
};
struct SetTimestep {
  double dt = 0;
};
/// The two-step method for an elastostatic object from now on.
struct SetTwoStep {
  std::size_t object = 0;
  TwoStepOptions options;
  std::function<std::shared_ptr<ComplianceSource>()> second; ///< asked once for an object
  /// In place of `second`: the object as it came with other stiffnesses. It follows cuts.
  std::shared_ptr<const Model> model{};
};
/// Large rotations of an elastostatic solid from now on, see statics/warped_statics.h.
struct SetWarp {
  std::size_t object = 0;
};
struct Emit {
  bool forces = false;      ///< else shapes
  bool instruments = false; ///< rather
  bool surfaces = false;    ///< rather
};
/// Goes on by this method: an elastodynamic object starts at the present elastostatic shape, with
/// no velocity; an elastostatic one takes its own shape at once.
struct SetMethod {
  std::size_t object = 0;
  Method method = Method::ela;
};
/// Forgets what is kept to be quick (factors, columns, running sums): the next shape is computed
/// from the load or the state of motion alone.
struct Renew {
  std::size_t object = 0;
};
/// Makes what a first contact, or a first cut, of an elastostatic object needs, and what contacts
/// at these nodes do.
struct Prepare {
  std::size_t object = 0;
  bool contact = true, cut = true;
  std::vector<std::uint32_t> nodes_ahead{};
};
/// What a cut severs: springs between sets of nodes, or what a plane passes, of all nodes or some.
struct SpringsToCut {
  std::vector<std::uint32_t> from, to;
};
struct PlaneToCut {
  CutPlane plane;
  std::optional<std::vector<std::uint32_t>> nodes;
  bool along_faces = false; ///< of a solid: no tetrahedron is cut through
};
struct CutObject {
  std::size_t object = 0;
  std::variant<SpringsToCut, PlaneToCut> what;
};
/// Springs that are stretched beyond this tear from now on; 0: none any more. A solid is parted
/// where elements bear more than its limit, or without one where they are strained more than this.
struct SetTear {
  std::size_t object = 0;
  double strain = 0;
  TearLimit limit{}; ///< of a solid
};
/// The model as it came; what has come off stays an object of its own.
struct Restore {
  std::size_t object = 0;
};
using Change =
    std::variant<SetForce, SetPressure, SetMass, SetDisplacement, Attach, Release, SetInstrument,
                 MoveInstrument, SetCoupling, Grasp, Withdraw, SetContact, SetGravity, SetTimestep,
                 SetTwoStep, SetWarp, Emit, SetMethod, Renew, Prepare, CutObject, SetTear, Restore>;

/// What a log says of an instrument alone; what does not apply stays empty.
struct InstrumentRow {
  std::optional<Vec3> end;        ///< the second one of its axis
  std::optional<Quaternion> turn; ///< from how it came
  std::optional<Vec3> force, torque;
  std::optional<std::uint64_t> nodes; ///< that it touches or grasps
  std::optional<Vec3> hand;           ///< that leads it, of a coupled one
};

/// What a log says of a change; what does not apply stays empty.
struct ChangeRow {
  std::string what, object;
  std::vector<std::uint32_t> nodes{};
  std::optional<Vec3> vector{};
  std::optional<double> value{};
  double duration = 0; ///< s; 0: none
  std::string other{}; ///< object or instrument
  std::vector<std::uint32_t> others{};
  std::string text{};
  InstrumentRow instrument{};
};

} // namespace gewebe
