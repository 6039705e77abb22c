#pragma once
// A scene in time: objects, what acts on them, events. Elastodynamic objects move from event to
// event, elastostatic ones take their shape when it is asked for, at the end of a step.

#include "base/context.h"
#include "contact/instrument.h"
#include "contact/load.h"
#include "contact/step.h"
#include "dynamics/elastodynamic.h"
#include "dynamics/solid_dynamic.h"
#include "model/cut.h"
#include "model/cut_select.h"
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

namespace gewebe {

/// Where what an object consists of comes from: asked for when it is first needed, the stiffness
/// again after a Renew. What they throw leaves the call that needed it.
struct ObjectSource {
  std::function<Model()> model;
  std::function<std::shared_ptr<ComplianceSource>(const Model&)>
      stiffness{}; ///< none: K is factorised
};

struct SimulationOptions {
  bool measure_error = false; ///< see ElastostaticOptions
  bool verify_shapes = false; ///< with it: also of shapes that no caller asks for
  double tolerance = 0;       ///< of shapes that are shown, as there
  bool shapes = false;        ///< shapes are wanted of each step, as if emitted
  std::function<void(const std::string&)> warn{}; ///< told of each trouble once per object
  /// Told in its place of shapes that are not to be trusted; without it `warn` is.
  std::function<void(const std::string&)> distrust{};
  /// A step or change that throws leaves the state as it was, which costs a copy of what moves.
  bool guard = false;
  double rate = 0; ///< steps a second that are wanted; 0: any. Too large contact sets are warned of
  /// Told of each change as it takes effect, at time(); and what a log says of it.
  std::function<void(const Change&)> applied{};
  std::function<void(const ChangeRow&)> log{};
};

/// How far the shape of an object jumped when it became elastostatic.
struct MethodJump {
  std::size_t object = 0;
  double size = 0; ///< mm, of the node that moved most
};

/// What cutting did to an object.
struct Cutting {
  enum class Kind {
    cut,     ///< by a command, a blade or tearing
    part,    ///< came off as an object of its own
    loose,   ///< what hangs together can move freely: it goes on elastodynamic
    restored ///< its model is whole again
  };
  Kind kind = Kind::cut;
  std::size_t object = 0;
  std::size_t part = 0;                 ///< the new object
  std::size_t springs = 0, doubled = 0; ///< that are gone; copies of nodes
  std::size_t nodes = 0;                ///< of the object (of the part), now
  double time = 0;
  std::string text; ///< of loose: what moves
};

struct SimulationCounts {
  std::uint64_t steps = 0;         ///< of the scene
  std::uint64_t integration = 0;   ///< integration steps of elastodynamic objects
  std::uint64_t resting = 0;       ///< advances that an object at rest did not need
  std::uint64_t moving = 0;        ///< advances that moved one
  ElastostaticCounts elastostatic; ///< of all objects: sums, largest errors
  SolidStepCounts solids;          ///< of all that move
  contact::StepReport contact;     ///< of all steps with contact
  double largest_jump = 0;         ///< mm, see MethodJump
  std::uint64_t cuts = 0;          ///< that changed a model
  /// Of elastostatic objects: how their stiffness followed, see CutWay.
  std::uint64_t cut_woodbury = 0, cut_refactors = 0, cut_factors = 0;
  std::uint64_t cut_unprepared = 0; ///< of these, how many had to factorise before
};

/// What is known of an object without reading it.
struct ObjectFacts {
  const std::string& name;
  Method method = Method::ela;
  bool known = false;                    ///< its model was needed so far
  bool shaped = false;                   ///< and displacement() costs little, changes nothing
  bool awake = false;                    ///< elastodynamic, and not at rest
  bool staged = false;                   ///< that of its second stage is known
  bool warp = false;                     ///< with large rotations
  bool moving_solid = false;             ///< of tetrahedra, and elastodynamic
  SolidLaw law = SolidLaw::corotational; ///< of these
  /// By node: the node of the first model that it is, or is a copy of. Empty: all as they came.
  std::span<const std::uint32_t> first_nodes;
  /// By node of the first model: its number now, or CutModel::gone. Empty: all as they came.
  std::span<const std::uint32_t> places;
};

/// What has happened, each in its order.
struct News {
  std::vector<MethodJump> jumps;
  std::vector<Cutting> cuttings;
  std::vector<std::size_t> unfinished; ///< objects: rounds of a step of their solids ran out
};

/// An instrument at the end of the last step.
struct InstrumentReport {
  std::string name{};
  bool present = false;
  InstrumentShape shape;
  Pose pose;
  std::optional<Vec3> hand{}; ///< that leads it through a coupling
  Coupling coupling{};
  Vec3 force, torque;    ///< of all objects on it, 1e-6 N, and 1e-9 N m about its place
  std::size_t nodes = 0; ///< that it touches or grasps
};

/// What the answer to a step tells.
struct Emits {
  bool forces = false, shapes = false, instruments = false;
  bool surfaces = false; ///< shapes, of solids those of the surface; `shapes` has all nodes
  bool any_shapes() const noexcept { return shapes || surfaces; }
};

/// What changes have set for the scene as a whole.
struct SceneSettings {
  std::optional<double> timestep; ///< the integration step asked for, s
  Emits emits;
};

/// Of the last step.
struct SimulationState {
  double kinetic_energy = 0, elastic_energy = 0; ///< of elastodynamic objects, 1e-9 J
  double strain = 0;                             ///< largest of any spring
  double safe_step = HUGE_VAL;                   ///< least of the elastodynamic objects
};

namespace simulation {
struct World;
}

class Simulation {
public:
  Simulation(const Context& context, SimulationOptions options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// An object at rest, under the present gravity. \param source for ffe: of its compliance
  /// \param integration of a net \param solid of a solid
  /// \pre check_model(model) passes   \throw Error if there is one of that name, or it can't be
  /// simulated by this method; Cancelled
  void add_object(const std::string& name, Model model, Method method,
                  std::shared_ptr<ComplianceSource> source = {},
                  Integration integration = Integration::semi_implicit,
                  const SolidChoice& solid = {});
  /// One of which nothing is read before it is needed: at the latest when something acts on it.
  /// Until then it rests. \throw Error if there is one of that name
  void add_object(const std::string& name, ObjectSource source, Method method,
                  Integration integration = Integration::semi_implicit,
                  const SolidChoice& solid = {});

  std::size_t object_count() const noexcept;
  /// Read now if it was not needed before. The first one of an object lives as long as this; a cut
  /// one as long as nothing more is cut. \throw as its source
  const Model& model(std::size_t object) const;
  /// The model as it came. \throw as its source
  const Model& first_model(std::size_t object) const;
  /// The model as it is now, with the masses that hang on it. \throw as its source
  Model weighed_model(std::size_t object) const;
  /// Valid until something is cut.
  ObjectFacts object(std::size_t object) const;

  /// Of those that a SetInstrument was accepted for.
  std::size_t instrument_count() const noexcept;
  InstrumentReport instrument(std::size_t instrument) const;

  /// Takes effect now. \pre objects and nodes exist, numbers are finite
  /// \throw Error if a node should move along an axis that the model holds or by more than a
  /// million times the size of its model, an instrument should stand where single precision does
  /// not reach, or objects can't be attached or change their method
  void apply(const Change& change);
  /// Takes effect at `time`, which is now or later, behind what was scheduled for it earlier; where
  /// there is a period, at each multiple of it behind `time` instead.
  /// \throw Error as apply, and if the time is past or the period below 1e-9 s
  void schedule(double time, const Change& change, std::optional<double> period = {});
  /// Events that wait, repeated ones not counted.
  std::size_t pending() const noexcept;

  double time() const noexcept;
  const SceneSettings& settings() const noexcept;

  /// Goes on by dt >= 0, or to `time` (now or later), through the events up to and at its end.
  /// Times add up without the rounding of each sum. \throw Error "object NAME at T s: …", among
  /// others where a node is displaced by more than a million times the size of its model, or a
  /// force leaves single precision; if there would be over a million repeated events; Cancelled
  void step(double dt);
  void step_to(double time);

  /// Of the last step: 3 n numbers, mm, and what holds the displaced nodes and pushes those that
  /// instruments touch, by ascending node. Of an object whose model was not needed: none. The shape
  /// of an elastostatic object is computed when it is first asked for; instruments' forces on an
  /// elastodynamic one are means over the last step. \throw Error as step
  std::span<const double> displacement(std::size_t object) const;
  /// Displacements of all nodes whose small strains are those of the shape: displacement(), but of
  /// an elastostatic object with large rotations those in frames that turn with it. Valid until the
  /// next call of anything that isn't const.
  std::span<const double> local_displacement(std::size_t object) const;
  /// As displacement, of the first nodes: at least those of the surface. Where stored columns of a
  /// solid have rows for these alone, it takes nothing of what is inside.
  std::span<const double> surface_displacement(std::size_t object) const;
  /// The same where it is known already, else nothing.
  std::span<const double> known_surface(std::size_t object) const;
  /// surface_count of its model where that has tetrahedra, else all nodes.
  std::size_t surface_nodes(std::size_t object) const;
  /// Of its model, counted once.
  const NodeCounts& node_counts(std::size_t object) const;
  const std::vector<NodeVector>& contact_forces(std::size_t object) const;

  /// From now on shapes are made within each step, as SimulationOptions::shapes asks for, so that
  /// one that can't be made fails its step.
  void want_shapes() noexcept;

  /// Since it was last taken.
  const News& news() const noexcept;
  void take_news() noexcept;
  /// Objects for which a call that threw (under guard) did what Renew does, since they were last
  /// taken.
  std::vector<std::size_t> take_renewed();
  /// Behind the last step: warns, once per object, where the threshold of the two-step method was
  /// never reached.
  void warn_of_thresholds();

  SimulationCounts counts() const;
  SimulationState state() const;

private:
  std::unique_ptr<simulation::World> world_;
};

/// The number of the one of that name. \throw Error naming those there are
std::size_t find_object(const Simulation& simulation, const std::string& name);
std::size_t find_instrument(const Simulation& simulation, const std::string& name);
/// As find_instrument; where there is none, the number of the next: instrument_count().
std::size_t instrument_place(const Simulation& simulation, const std::string& name);

} // namespace gewebe
