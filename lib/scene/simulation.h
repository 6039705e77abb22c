#pragma once
// Simulation of a scene: objects, loads, instruments, contacts, cuts and timed events.
// Elastodynamic objects are integrated from event to event. The shape of an elastostatic object is
// computed at the end of a step, and only if a caller reads it.

#include "base/context.h"
#include "contact/instrument.h"
#include "contact/load.h"
#include "contact/step.h"
#include "cutting/cut.h"
#include "cutting/cut_select.h"
#include "dynamics/elastodynamic.h"
#include "dynamics/solid_dynamic.h"
#include "model/model.h"
#include "scene/change.h"
#include "statics/elastostatic.h"
#include "statics/two_step.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace gewebe::scene {

/// Functions that load an object's model and stiffness. Each is called when its result is first
/// needed, `stiffness` again where a rollback has dropped a solver. An exception that they throw
/// leaves the call that needed the result.
struct ObjectSource {
  std::function<model::Model()> model;
  std::function<std::shared_ptr<compliance::ComplianceSource>(const model::Model&)>
      stiffness{}; ///< empty: K is factorised
};

struct SimulationOptions {
  bool measure_error = false; ///< see ElastostaticOptions
  bool verify_shapes = false; ///< with measure_error: also of shapes that no caller reads
  double tolerance = 0;       ///< of shapes that are shown, see ElastostaticOptions
  bool shapes = false;        ///< compute the shapes of each step, as if emitted
  std::function<void(const std::string&)> warn{}; ///< called once per kind of warning and object
  /// Called instead of `warn` for shapes that are not trustworthy. Empty: `warn` is called.
  std::function<void(const std::string&)> distrust{};
  /// A step or change that throws leaves the state as it was. This costs a copy of what moves.
  bool guard = false;
  /// Required steps per second; 0: any. Too many displaced nodes for it cause a warning.
  double rate = 0;
  /// Called for each change as it takes effect, at time(); `log` gets the row for a log.
  std::function<void(const Change&)> applied{};
  std::function<void(const ChangeRow&)> log{};
};

/// Jump of an object's shape at its change from elastodynamic to elastostatic.
struct MethodJump {
  std::size_t object = 0;
  double size = 0; ///< mm, largest displacement of a node
};

/// Report of a cut: what it did to an object.
struct Cutting {
  enum class Kind {
    cut,     ///< by a command, a blade or tearing
    part,    ///< a part came off and is an object of its own
    loose,   ///< the object can move freely, so it becomes elastodynamic
    restored ///< the object has its first model again
  };
  Kind kind = Kind::cut;
  std::size_t object = 0;
  std::size_t part = 0;                 ///< the new object
  std::size_t springs = 0, doubled = 0; ///< numbers of severed springs and of copied nodes
  std::size_t nodes = 0; ///< number of nodes of the object (of the part) after the cut
  double time = 0;
  std::string text; ///< for `loose`: what moves
};

/// Work done so far.
struct SimulationCounts {
  std::uint64_t steps = 0;                  ///< of the scene
  std::uint64_t integration = 0;            ///< integration steps of elastodynamic objects
  std::uint64_t resting = 0;                ///< advances skipped because the object was at rest
  std::uint64_t moving = 0;                 ///< advances that moved an object
  statics::ElastostaticCounts elastostatic; ///< of all objects: sums, largest errors
  dynamics::SolidStepCounts solids;         ///< of all elastodynamic solids
  contact::StepReport contact;              ///< of all steps with contact
  double largest_jump = 0;                  ///< mm, see MethodJump
  std::uint64_t cuts = 0;                   ///< cuts that changed a model
  /// How the stiffness of elastostatic objects was updated after cuts, see CutWay.
  std::uint64_t cut_woodbury = 0, cut_refactors = 0, cut_factors = 0;
  std::uint64_t cut_unprepared = 0; ///< of these, updates that first had to factorise
};

/// Facts about an object that need no read of its model.
struct ObjectFacts {
  const std::string& name;
  Method method = Method::ela;
  bool known = false;  ///< its model has been read
  bool shaped = false; ///< and displacement() costs little, changes nothing
  bool awake = false;  ///< elastodynamic, and not at rest
  bool staged = false; ///< the model of its second stage has been read
  bool warp = false;   ///< with large rotations
  /// With tetrahedra, and elastodynamic or with large strains: strains are those in the frames of
  /// its elements.
  bool element_frames = false;
  integrator::SolidLaw law = integrator::SolidLaw::corotational; ///< of such a solid
  /// By node: its node in the first model, or the node that it is a copy of. Empty: unchanged.
  std::span<const std::uint32_t> first_nodes;
  /// By node of the first model: its present number, or CutModel::gone. Empty: unchanged.
  std::span<const std::uint32_t> places;
};

/// Events since take_news(), each list in order of time.
struct News {
  std::vector<MethodJump> jumps;
  std::vector<Cutting> cuttings;
  std::vector<std::size_t> unfinished; ///< objects whose solids ran out of iterations in a step
};

/// State of an instrument at the end of the last step.
struct InstrumentReport {
  std::string name{};
  bool present = false;
  contact::InstrumentShape shape;
  contact::Pose pose;
  std::optional<Vec3> hand{}; ///< position of the hand, if a virtual coupling moves the instrument
  contact::Coupling coupling{};
  Vec3 force, torque;    ///< from all objects: 1e-6 N, and 1e-9 N m about its position
  std::size_t nodes = 0; ///< number of nodes that it touches or grasps
};

/// Springs that attach one object to another, at the end of the last step.
struct AttachmentReport {
  std::size_t object = 0, other = 0;
  std::size_t springs = 0;
  Vec3 force; ///< of all springs on `object`, 1e-6 N
};

/// Contents of the answer to a step.
struct Emits {
  bool forces = false, shapes = false, instruments = false;
  bool surfaces = false; ///< shapes, for solids of the surface nodes only; `shapes` has all nodes
  bool any_shapes() const noexcept { return shapes || surfaces; }
};

/// Settings of the scene as a whole, made by changes.
struct SceneSettings {
  std::optional<double> timestep; ///< requested integration step, s
  int order = 1;                  ///< of implicit steps
  Emits emits;
};

/// Energies and limits at the end of the last step.
struct SimulationState {
  double kinetic_energy = 0, elastic_energy = 0; ///< of elastodynamic objects, 1e-9 J
  double strain = 0;                             ///< largest strain of a spring
  double safe_step = HUGE_VAL; ///< s, smallest stable step of an elastodynamic object
};

struct World;

/// A simulated scene. The caller owns it; objects live as long as it does.
class Simulation {
public:
  Simulation(const Context& context, SimulationOptions options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Adds an object at rest, under the present gravity.
  /// \param source  of its compliance, for Method::ffe
  /// \param integration  how a net moves
  /// \param solid  how a solid moves
  /// \pre check_model(model) passes
  /// \throw Error if the name is taken, or the method can't simulate the model; Cancelled
  void add_object(const std::string& name, model::Model model, Method method,
                  std::shared_ptr<compliance::ComplianceSource> source = {},
                  Integration integration = Integration::semi_implicit,
                  const integrator::SolidChoice& solid = {});
  /// Adds an object that is read when it is first needed, at the latest when something acts on it.
  /// Until then it rests. \throw Error if the name is taken
  void add_object(const std::string& name, ObjectSource source, Method method,
                  Integration integration = Integration::semi_implicit,
                  const integrator::SolidChoice& solid = {});

  std::size_t object_count() const noexcept;
  /// Present model of an object; reads it if it was not needed before. The reference to a first
  /// model is valid as long as the Simulation, that to a cut model until the next cut.
  /// \throw as its source
  const model::Model& model(std::size_t object) const;
  /// Model before all cuts. \throw as its source
  const model::Model& first_model(std::size_t object) const;
  /// Present model, with the masses that SetMass has added. \throw as its source
  model::Model weighed_model(std::size_t object) const;
  /// Facts about an object. Valid until the next cut.
  ObjectFacts object(std::size_t object) const;

  /// Number of instruments for which a SetInstrument was accepted.
  std::size_t instrument_count() const noexcept;
  InstrumentReport instrument(std::size_t instrument) const;

  /// Attachments in the order in which they were made, one for each pair of objects.
  std::vector<AttachmentReport> attachments() const;

  /// Applies a change now. \pre objects and nodes exist, numbers are finite
  /// \throw Error if a node should move along an axis that the model holds; if a node should move
  /// by more than a million times the size of its model; if an instrument's position leaves single
  /// precision; if objects can't be attached or change their method
  void apply(const Change& change);
  /// Schedules a change for `time`, which is now or later. Changes for one time take effect in the
  /// order in which they were scheduled. With a period, the change takes effect at `time` plus each
  /// multiple of the period instead.
  /// \throw Error as apply, and if the time is past or the period below 1e-9 s
  void schedule(double time, const Change& change, std::optional<double> period = {});
  /// Number of scheduled events, repeated ones not counted.
  std::size_t pending() const noexcept;

  double time() const noexcept;
  const SceneSettings& settings() const noexcept;

  /// Simulates the next dt >= 0 seconds, or until `time` (now or later), with all events up to and
  /// including the end. Times add up without the rounding of each sum.
  /// \throw Error "object NAME at T s: …", for example if a node is displaced by more than a
  /// million times the size of its model, or if a force leaves single precision \throw Error if the
  /// step has over a million repeated events \throw Cancelled
  void step(double dt);
  void step_to(double time);

  /// Displacement of each node at the end of the last step: 3 n numbers, mm. Empty if the object's
  /// model was not needed. The shape of an elastostatic object is computed by the first call.
  /// \throw Error as step
  std::span<const double> displacement(std::size_t object) const;
  /// Displacements of all nodes whose small strains are those of the shape. This is displacement(),
  /// except for an elastostatic object with large rotations: its displacements are measured in
  /// frames that rotate with it. Valid until the next call of a member that isn't const.
  std::span<const double> local_displacement(std::size_t object) const;
  /// As displacement, of the first nodes: at least those of the surface. It needs no inner nodes
  /// where the stored columns of a solid have rows for the surface only.
  std::span<const double> surface_displacement(std::size_t object) const;
  /// surface_displacement if it is known already, else empty.
  std::span<const double> known_surface(std::size_t object) const;
  /// surface_count of its model if that has tetrahedra, else the number of all nodes.
  std::size_t surface_nodes(std::size_t object) const;
  /// Node counts of its model. They are counted once.
  const model::NodeCounts& node_counts(std::size_t object) const;
  /// Reactions of the displaced nodes and forces of instruments on nodes, by ascending node. Forces
  /// of instruments on an elastodynamic object are means over the last step. \throw Error as step
  const std::vector<contact::NodeVector>& contact_forces(std::size_t object) const;

  /// Sets SimulationOptions::shapes: from now on each step computes the shapes, so that a step
  /// fails if a shape can't be computed.
  void want_shapes() noexcept;

  /// Events since the last call of take_news.
  const News& news() const noexcept;
  void take_news() noexcept;
  /// To be called after the last step. Warns, once per object, if the threshold of the two-step
  /// method was never reached.
  void warn_of_thresholds();

  SimulationCounts counts() const;
  SimulationState state() const;

private:
  std::unique_ptr<World> world_;
};

/// Number of the object of that name. \throw Error that lists the existing names
std::size_t find_object(const Simulation& simulation, const std::string& name);
/// Number of the instrument of that name. \throw Error that lists the existing names
std::size_t find_instrument(const Simulation& simulation, const std::string& name);
/// As find_instrument, but instrument_count() if no instrument has that name.
std::size_t instrument_place(const Simulation& simulation, const std::string& name);

} // namespace gewebe::scene
