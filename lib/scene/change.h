#pragma once
// Changes of a scene. Objects, instruments and nodes are given by number.

#include "compliance/compliance_source.h"
#include "contact/coupling.h"
#include "contact/instrument.h"
#include "contact/load.h"
#include "cutting/cut_select.h"
#include "cutting/tear_solid.h"
#include "statics/two_step.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace gewebe::scene {

enum class Method { ffe, ela }; ///< elastostatic (with stored stiffness), elastodynamic

/// "ffe", "ela".
constexpr const char* method_name(Method method) {
  return method == Method::ffe ? "ffe" : "ela";
}

/// Integration of an elastodynamic net: by explicit steps (dynamics/elastodynamic.h), by the
/// implicit steps of solids (dynamics/solid_dynamic.h), or automatic: implicit if explicit steps
/// would be far too short.
enum class Integration { semi_implicit, implicit, automatic };

/// Sets a force on each of the nodes.
struct SetForce {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  Vec3 force;        ///< on each node, 1e-6 N; 0 removes it
  double period = 0; ///< of a pulse, s; 0: a constant force
};
/// Sets a pressure on the surface around each of the nodes.
struct SetPressure {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  contact::NodePressure pressure; ///< 0 removes it
};
/// Adds a mass to each of the nodes.
struct SetMass {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  double mass = 0; ///< g, of each node beside its own; 0 removes it
};
/// Prescribes a displacement of each of the nodes.
struct SetDisplacement {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  Vec3 displacement;
  double duration = 0; ///< s, time in which the nodes of an elastodynamic object move there
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
struct Release { ///< removes force, pressure, displacement and grasp of the nodes
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
};
/// Puts an instrument at a pose. A present instrument is replaced.
struct SetInstrument {
  std::size_t instrument = 0; ///< instrument_count(): a new one, which exists once this is accepted
  contact::InstrumentShape shape; ///< radius > 0, friction >= 0
  contact::Pose pose;             ///< turn of length 1
  std::string name{};             ///< of a new instrument; unique
};
/// Moves an instrument from its present pose to another one.
struct MoveInstrument {
  std::size_t instrument = 0;
  Vec3 place;
  std::optional<contact::Quaternion> turn; ///< of length 1; empty: unchanged
  double duration = 0;                     ///< of the motion, s
};
/// Lets an instrument grasp nodes: they move with it rigidly from now on.
struct Grasp {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  std::size_t instrument = 0;
};
/// Sets a virtual coupling: a hand moves the instrument through a spring and a damper. Without a
/// coupling the instrument follows its prescribed motion directly.
struct SetCoupling {
  std::size_t instrument = 0;
  std::optional<contact::Coupling> coupling;
};
/// Removes an instrument and releases the nodes that it grasps.
struct Withdraw {
  std::size_t instrument = 0;
};
/// Starts contact between the surfaces of two objects, or of one object with itself.
struct SetContact {
  std::size_t object = 0, other = 0; ///< equal: self-contact
  double friction = 0;               ///< Coulomb's coefficient, >= 0
  bool separate = false;             ///< moves surfaces that overlap apart
};
struct SetGravity {
  Vec3 gravity;
};
struct SetTimestep {
  double dt = 0;
  int order = 1; ///< of implicit steps, 1 or 2
};
/// Starts the two-step method for an elastostatic object.
struct SetTwoStep {
  std::size_t object = 0;
  statics::TwoStepOptions options;
  std::function<std::shared_ptr<compliance::ComplianceSource>()>
      second; ///< called once for an object
  /// Instead of `second`: the object's first model with other stiffnesses. It follows cuts.
  std::shared_ptr<const model::Model> model{};
};
/// Starts large rotations of an elastostatic solid, see statics/warped_statics.h.
struct SetWarp {
  std::size_t object = 0;
};
/// Adds one item to the answers to steps: instruments, forces or surfaces, or shapes if none of
/// these is set.
struct Emit {
  bool forces = false;
  bool instruments = false;
  bool surfaces = false;
};
/// Changes the method of an object. An elastodynamic object starts at the present elastostatic
/// shape with zero velocity. An elastostatic object takes its static shape at once.
struct SetMethod {
  std::size_t object = 0;
  Method method = Method::ela;
};
/// Computes in advance the data that the first contact, or the first cut, of an elastostatic object
/// needs, and the data for contacts at the given nodes.
struct Prepare {
  std::size_t object = 0;
  bool contact = true, cut = true;
  std::vector<std::uint32_t> nodes_ahead{};
};
/// Severs the springs between two sets of nodes.
struct SpringsToCut {
  std::vector<std::uint32_t> from, to;
};
/// Severs everything that a plane intersects, of all nodes or of the given ones.
struct PlaneToCut {
  cutting::CutPlane plane;
  std::optional<std::vector<std::uint32_t>> nodes;
  bool along_faces = false; ///< of a solid: no tetrahedron is cut through
};
/// Cuts an object.
struct CutObject {
  std::size_t object = 0;
  std::variant<SpringsToCut, PlaneToCut> what;
};
/// Starts tearing: springs tear that are strained more than `strain`; 0 ends it. A solid tears
/// where elements bear more than `limit`, or, without a limit, where their strain exceeds `strain`.
struct SetTear {
  std::size_t object = 0;
  double strain = 0;
  cutting::TearLimit limit{}; ///< of a solid
};
/// Restores an object's first model. Parts that have come off stay objects of their own.
struct Restore {
  std::size_t object = 0;
};
using Change =
    std::variant<SetForce, SetPressure, SetMass, SetDisplacement, Attach, Release, SetInstrument,
                 MoveInstrument, SetCoupling, Grasp, Withdraw, SetContact, SetGravity, SetTimestep,
                 SetTwoStep, SetWarp, Emit, SetMethod, Prepare, CutObject, SetTear, Restore>;

/// Columns of a log row that only instruments have. What does not apply stays empty.
struct InstrumentRow {
  std::optional<Vec3> end;                 ///< second end of its axis
  std::optional<contact::Quaternion> turn; ///< rotation from its first orientation
  std::optional<Vec3> force, torque;
  std::optional<std::uint64_t> nodes; ///< number of nodes that it touches or grasps
  std::optional<Vec3> hand;           ///< position of the hand, of a coupled instrument
};

/// Row of a log, for a change. What does not apply stays empty.
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

} // namespace gewebe::scene
