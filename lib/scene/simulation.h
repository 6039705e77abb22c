#pragma once
// A scene in time: objects, what acts on them, events. Elastodynamic objects move from event to
// event, elastostatic ones take their shape when it is asked for, at the end of a step.

#include "base/context.h"
#include "contact/instrument.h"
#include "contact/load.h"
#include "dynamics/elastodynamic.h"
#include "model/cut.h"
#include "model/cut_select.h"
#include "model/model.h"
#include "scene/command.h"
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
struct SetDisplacement {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  Vec3 displacement;
  double over = 0; ///< s that the way there takes an elastodynamic object's nodes
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
/// Puts an instrument there, in place of itself, or moves it from where it is; see
/// add_instrument().
struct SetInstrument {
  std::size_t instrument = 0; ///< instrument_count(): a new one, from when this is accepted
  InstrumentShape shape;      ///< radius > 0, friction >= 0
  Pose pose;                  ///< turn of length 1
  std::string name{};         ///< of a new one
};
struct MoveInstrument {
  std::size_t instrument = 0;
  Vec3 place;
  std::optional<Quaternion> turn; ///< of length 1; none: as it is
  double over = 0;                ///< s that the way takes
};
/// Nodes follow an instrument as parts of it, from where they stand.
struct Grasp {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  std::size_t instrument = 0;
};
/// Takes an instrument away; what it grasped is released.
struct Withdraw {
  std::size_t instrument = 0;
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
  std::function<StiffnessParts()> second; ///< asked once for an object
};
struct Emit {
  bool forces = false;      ///< else shapes
  bool instruments = false; ///< rather
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
/// What a cut severs: springs between sets of nodes, or what a plane passes, of all nodes or some.
struct SpringsToCut {
  std::vector<std::uint32_t> from, to;
};
struct PlaneToCut {
  CutPlane plane;
  std::optional<std::vector<std::uint32_t>> nodes;
};
struct CutObject {
  std::size_t object = 0;
  std::variant<SpringsToCut, PlaneToCut> what;
};
/// Springs that are stretched beyond this tear from now on; 0: none any more.
struct SetTear {
  std::size_t object = 0;
  double strain = 0;
};
/// The model as it came; what has come off stays an object of its own.
struct Restore {
  std::size_t object = 0;
};
using Change = std::variant<SetForce, SetPressure, SetDisplacement, Attach, Release, SetInstrument,
                            MoveInstrument, Grasp, Withdraw, SetGravity, SetTimestep, SetTwoStep,
                            Emit, SetMethod, Renew, CutObject, SetTear, Restore>;

/// Where what an object consists of comes from: asked for when it is first needed, the stiffness
/// again after a Renew. What they throw leaves the call that needed it.
struct ObjectSource {
  std::function<Model()> model;
  std::function<StiffnessParts(const Model&)> stiffness{}; ///< none: K is factorised
};

struct SimulationOptions {
  bool measure_error = false;                     ///< see ElastostaticOptions
  double tolerance = 0;                           ///< as well
  bool shapes = false;                            ///< shapes are wanted of each step, as if emitted
  std::function<void(const std::string&)> warn{}; ///< told of each trouble once per object
  /// Told in its place of shapes that are not to be trusted; without it `warn` is.
  std::function<void(const std::string&)> distrust{};
  /// A step or change that throws leaves the state as it was, which costs a copy of what moves.
  bool guard = false;
  double rate = 0; ///< steps a second that are wanted; 0: any. Too large contact sets are warned of
  /// Told of each change as it takes effect, at time().
  std::function<void(const Change&)> applied{};
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
  double largest_jump = 0;         ///< mm, see MethodJump
  std::uint64_t cuts = 0;          ///< that changed a model
  /// Of elastostatic objects: how their stiffness followed, see CutWay.
  std::uint64_t cut_corrections = 0, cut_renewals = 0, cut_factors = 0;
};

/// An instrument at the end of the last step.
struct InstrumentReport {
  bool present = false;
  Pose pose;
  Vec3 force, torque;    ///< of all objects on it, 1e-6 N, and 1e-9 N m about its place
  std::size_t nodes = 0; ///< that it touches or grasps
};

/// Of the last step.
struct SimulationState {
  double kinetic_energy = 0, elastic_energy = 0; ///< of elastodynamic objects, 1e-9 J
  double strain = 0;                             ///< largest of any spring
  double safe_step = HUGE_VAL;                   ///< least of the elastodynamic objects
};

class CutStiffness;

class Simulation {
public:
  Simulation(const Context& context, SimulationOptions options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// An object at rest, under the present gravity. \param parts for ffe: what is stored of it
  /// \pre check_model(model) passes   \throw Error if there is one of that name, or it can't be
  /// simulated by this method; Cancelled
  void add_object(const std::string& name, Model model, Method method, StiffnessParts parts = {},
                  Integration integration = Integration::semi_implicit);
  /// One of which nothing is read before it is needed: at the latest when something acts on it.
  /// Until then it rests. \throw Error if there is one of that name
  void add_object(const std::string& name, ObjectSource source, Method method,
                  Integration integration = Integration::semi_implicit);

  std::size_t object_count() const noexcept { return objects_.size(); }
  const std::string& name(std::size_t object) const;
  /// Read now if it was not needed before. The first one of an object lives as long as this; a cut
  /// one as long as nothing more is cut. \throw as its source
  const Model& model(std::size_t object) const;
  /// The model as it came. \throw as its source
  const Model& first_model(std::size_t object) const;
  /// By node: the node of the first model that it is, or is a copy of. Empty: all as they came.
  std::span<const std::uint32_t> first_nodes(std::size_t object) const;
  /// By node of the first model: its number now, or CutModel::gone. Empty: all as they came.
  std::span<const std::uint32_t> places(std::size_t object) const;
  /// Whether its model was needed so far.
  bool known(std::size_t object) const;
  Method method(std::size_t object) const;
  /// \throw Error naming those there are
  std::size_t find(const std::string& name) const;

  /// An instrument that is in no place until SetInstrument; its number, the old one where there is
  /// one of that name.
  std::size_t add_instrument(const std::string& name);
  /// The number of the one of that name; instrument_count() where there is none.
  std::size_t instrument_place(const std::string& name) const noexcept;
  std::size_t instrument_count() const noexcept { return instruments_.size(); }
  const std::string& instrument_name(std::size_t instrument) const;
  /// \throw Error naming those there are
  std::size_t find_instrument(const std::string& name) const;
  InstrumentReport instrument(std::size_t instrument) const;

  /// Takes effect now. \pre objects and nodes exist, numbers are finite
  /// \throw Error if a node should move along an axis that the model holds or by more than a
  /// million times the size of its model, an instrument should stand where single precision does
  /// not reach, or objects can't be attached or change their method
  void apply(const Change& change);
  /// Takes effect at `time`, which is now or later, behind what was scheduled for it earlier.
  /// \throw Error as apply, and if the time is past
  void schedule(double time, const Change& change);
  /// Takes effect at every multiple of `period` behind now. \throw Error as apply
  /// \pre period > 0
  void schedule_every(double period, const Change& change);
  /// Events that wait, repeated ones not counted.
  std::size_t pending() const noexcept;

  double time() const noexcept { return time_; }
  /// The integration step asked for by SetTimestep.
  std::optional<double> timestep() const noexcept { return timestep_; }
  bool emits_forces() const noexcept { return emit_forces_; }
  bool emits_shapes() const noexcept { return emit_shapes_; }
  bool emits_instruments() const noexcept { return emit_instruments_; }

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
  const std::vector<NodeVector>& contact_forces(std::size_t object) const;

  /// Since they were last taken: jumps; and objects for which a call that threw (under guard) did
  /// what Renew does.
  const std::vector<MethodJump>& jumps() const noexcept { return jumps_; }
  void take_jumps() noexcept { jumps_.clear(); }
  std::vector<std::size_t> take_renewed();
  /// Since they were last taken, in the order in which they happened.
  const std::vector<Cutting>& cuttings() const noexcept { return cuttings_; }
  void take_cuttings() noexcept { cuttings_.clear(); }
  /// Behind the last step: warns, once per object, where the threshold of the two-step method was
  /// never reached.
  void warn_of_thresholds();

  SimulationCounts counts() const;
  SimulationState state() const;

private:
  struct Object;
  struct Body;
  struct Undo;
  struct Instrument;
  struct Tie {
    std::size_t object = 0, other = 0;
    std::uint32_t node = 0, other_node = 0;
    double stiffness = 0, rest = 0;
  };
  struct Event {
    Change change;
    double origin = 0, period = 0; ///< of a repeated one
    double round = 0;
    bool in_flight = false; ///< takes effect just now
  };
  void insert(std::unique_ptr<Object> object);
  void need_model(Object& object) const;
  void need_body(std::size_t object);
  Elastostatic& still_of(Object& object) const;
  void update_still(Object& object, const Load& load);
  void check(const Change& change) const;
  void apply_now(const Change& change);
  void attach(const Attach& tie);
  void set_method(std::size_t index, Method method);
  void renew(Object& object);
  template <class Work>
  void guarded(Work&& work);
  void open_undo();
  void take_back() noexcept;
  void keep_load(Object& object);
  void keep_body(Body& body);
  void displace(Object& object, const SetDisplacement& set);
  void set_two_step(Object& object, const SetTwoStep& set);
  void update_stages(Object& object, const Load& load) const;
  std::span<const double> still_shape(Object& object) const;
  const std::vector<NodeVector>& still_forces(const Object& object) const;
  [[noreturn]] void raise(const Body& body) const;
  using Motions = std::map<std::size_t, std::vector<NodeMotion>>;
  std::unique_ptr<Body> make_body(std::vector<std::size_t> parts, const Motions* motions = nullptr);
  void move_bodies(double to);
  void advance(double to);
  void take_effect_first();
  void require_few_events(double to) const;
  template <class Work>
  void at_object(const Object& object, Work&& work) const; ///< names object and time in an Error
  void show(Object& object);
  void leave_shown(Object& object);
  bool has_moved(const Object& object) const;
  std::vector<Vec3> shape_velocity(Object& object, bool afresh);
  void shape(Object& object) const;
  double displacement_limit(Object& object) const;
  void require_bounded(Object& object, std::span<const double> displacement) const;
  void require_bounded(Object& object) const;
  void require_bounded_instruments() const;
  void shape_in_step(Object& object);
  bool may_leave_range(Object& object, double most) const;
  void show_motion(Object& object);
  void update_in_time(Object& object);
  void warn_of_range(Object& object) const;
  double integration_step(Body& body);
  void check_instrument(const Change& change) const;
  void require_instrument(const Change& change) const;
  void introduce(const Change& change);
  Instrument& present_instrument(std::size_t instrument) const;
  bool apply_instrument(const Change& change);
  void carry(const Instrument& instrument);
  void drop_grips(std::size_t object, const std::vector<std::uint32_t>& nodes);
  void drop_grips(std::size_t instrument);
  void note_poses();
  void guide(Body& body, double to);
  void need_contact(Object& object);
  void end_guiding(double to);
  bool touched_anew(Object& object);
  std::optional<Pose> pose_at(std::size_t moment, std::size_t instrument) const;
  bool instruments_there() const;
  void follow_instruments(Object& object);
  void take_touches(double duration);
  void gather_impulses(Body& body);
  void add_touches(Object& object);
  struct Moves;
  void cut_now(const CutObject& change);
  void find_late_shape(Object& object) const;
  void restore_now(std::size_t index);
  void carry_out(std::size_t index, CutModel cut);
  CutStiffness* stiffness_of(Object& object) const;
  void announce_cut(std::size_t index);
  void announce_cuts(const Change& change);
  std::optional<StiffnessParts> cut_parts(Object& object, std::shared_ptr<const Model> next,
                                          const CutModel& cut);
  std::unique_ptr<Object> renumbered(const Object& old, std::shared_ptr<Model> model) const;
  void move_all(std::size_t index, const Moves& moves, std::vector<std::unique_ptr<Object>> pieces,
                std::span<const Vec3> velocity = {});
  void move_shown(const Object& old, const Moves& moves,
                  const std::vector<std::unique_ptr<Object>>& pieces) const;
  void move_grips(std::size_t index, const Moves& moves);
  void move_events(std::size_t index, const Moves& moves);
  void move_ties(std::size_t index, const Moves& moves);
  void renew_bodies(const std::vector<std::size_t>& objects, const Motions& motions);
  std::string free_name(const std::string& name) const;
  std::vector<SweptQuad> swept_areas();
  void sweep_blades();
  void tear();
  bool may_cut(Object& object);
  void find_free_motion(std::size_t index);

  Context context_;
  SimulationOptions options_;
  std::vector<std::unique_ptr<Object>> objects_;
  std::vector<std::unique_ptr<Body>> bodies_;
  std::vector<Tie> ties_;
  std::vector<std::unique_ptr<Instrument>> instruments_;
  /// In this step: where the instruments stood, one after the other.
  std::vector<std::vector<std::optional<Pose>>> poses_;
  std::multimap<double, Event> events_;
  Vec3 gravity_;
  std::optional<double> timestep_;
  double time_ = 0;
  double shapes_time_ = 0;    ///< when all objects were last shown
  double sum_ = 0, lost_ = 0; ///< of the steps so far, and what rounding took from it
  bool emit_forces_ = false, emit_shapes_ = false, emit_instruments_ = false;
  SimulationCounts counts_;
  std::vector<MethodJump> jumps_;
  std::vector<std::size_t> renewed_;
  std::vector<Cutting> cuttings_;
  std::unique_ptr<Undo> undo_;
};

} // namespace gewebe
