#pragma once
// A scene as a value: all that decides how it goes on. A copy costs little, for its large parts are
// shared until one of both is written; going back to it is an assignment. What is kept to be quick
// (factors, columns, running sums) stands beside it: see Statics and Body.

#include "base/copy_on_write.h"
#include "contact/coupling.h"
#include "contact/nodal_contact_force.h"
#include "cutting/cut_stiffness.h"
#include "dynamics/body_motion.h"
#include "dynamics/solid_dynamic.h"
#include "scene/extents.h"
#include "scene/simulation.h"
#include "scene/support.h"
#include "statics/warped_statics.h"

#include <any>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::simulation {

/// Where the nodes of an object have gone.
struct Moves {
  struct To {
    std::size_t object = 0;
    std::uint32_t node = 0;
    double share = 1; // of what the node had
    bool main = true; // of several: which one goes on as that node
  };
  /// A node that stands where none did: it has shares of what others had.
  struct Between {
    std::size_t object = 0;
    std::uint32_t node = 0;
    bool fresh = true; // or one of `all` that has been moved
    std::vector<std::pair<std::uint32_t, double>> of;
  };
  std::vector<std::size_t> objects; // itself, new ones
  std::vector<std::size_t> first;   // by node, and the end
  std::vector<To> all;
  std::vector<Between> between;

  std::span<const To> of(std::uint32_t node) const {
    return {all.data() + first[node], all.data() + first[node + std::size_t{1}]};
  }
  /// \param ways of nodes below `nodes`, in any order; those of a node keep theirs
  void add(std::span<const std::pair<std::uint32_t, To>> ways, std::size_t nodes);
};

/// Warnings that are told once. A step back does not untell them.
struct Told {
  bool stuck = false, unsolved = false, untorn = false;
  std::array<bool, all_features.size()> passed{}; // see feels()
};

/// What an object consists of. What was read stays so when a step is taken back.
struct Matter {
  std::string name;
  ObjectSource source;
  SolidChoice solid;                                                    // how a solid moves
  std::shared_ptr<const Model> model = std::make_shared<const Model>(); // empty until it is known
  bool known = false;
  double shortest_edge = 0;         // mm; 0: not yet known
  double size = 0;                  // mm, longest side of the box at rest; 0: not yet known
  std::optional<Box3> box;          // of the surface at rest, see shown_box
  std::optional<NodeCounts> counts; // of the model, once asked for
  Told told;
};

/// What an elastostatic object keeps to be quick. It depends on the shapes that were asked of it,
/// so it is made anew where one of them is taken back.
struct Statics {
  std::optional<Elastostatic> solver;
  std::optional<TwoStep> two_step;            // over `solver`, made when needed
  std::optional<WarpedStatics> warped;        // in place of both
  std::shared_ptr<ComplianceSource> prepared; // of the cut model, by cut_source
  std::unique_ptr<CutStiffness> stiffness;    // that made them
  ElastostaticCounts spent;                   // of what was renewed
  int slow = 0;                               // updates in a row that took too long for the rate
  bool ahead = false;                         // it has moved on since the scene was saved

  bool made() const { return solver || warped; }
};

/// What moves together: one elastodynamic object, or several that are attached to each other.
struct Body {
  std::vector<std::size_t> parts;     // objects
  std::shared_ptr<const Model> model; // of all parts
  std::unique_ptr<BodyMotion> moving;
  double safe = 0; // largest stable step
  bool changed = true;
  std::map<std::size_t, Extent> rest_extents{}; // by part, while at rest: see Extents
  bool ahead = false;                           // it has moved on since the scene was saved
  bool warned_step = false;
  std::uint64_t taken = 0; // by the last advance
  std::exception_ptr failure;

  struct Snapshot {
    bool changed = true;
    std::map<std::size_t, Extent> rest_extents{};
    std::any motion;
  };
  Snapshot snapshot() const { return {changed, rest_extents, moving->snapshot()}; }
  void restore(const Snapshot& was);
};

/// What two-step says of an object.
struct Stages {
  std::optional<TwoStepOptions> options;
  std::function<std::shared_ptr<ComplianceSource>()> second; // its second stage
  std::shared_ptr<const Model> model, first_model; // of that, now and as it came, if known
  bool warned = false;                             // of a threshold that was not reached
};

/// The shape before cuts that nobody has asked for: it is found when somebody does, from the model
/// of then.
struct DeferredShape {
  std::shared_ptr<const Model> model;
  Load load;
  std::vector<std::shared_ptr<const Moves>> moves; // since, one cut each
};

/// The picture of an object.
struct Shown {
  /// Of all nodes, or of the first ones if a solid's solver has rows for its surface alone; and of
  /// all where that was asked for, else empty.
  CopyOnWrite<std::vector<double>> displacement{}, whole{};
  CopyOnWrite<std::vector<NodeVector>> forces{};
  std::vector<NodalContactForce> contact{}; ///< of an elastodynamic object means over the step
  bool valid = true;  // forces are those of the present state, and of ela the displacement
  bool shaped = true; // of ffe the displacement too, under this load
  bool rough = false; // within SimulationOptions::tolerance: the scene goes on by the exact one
  std::shared_ptr<const DeferredShape>
      deferred{}; // what the displacement is, where it is not shaped
  CopyOnWrite<Load> load{};
  double time = 0;
  bool posed = false;        // what is shown is a shape of ffe
  std::optional<Box3> box{}; // see shown_box; none: nobody has asked for that of this shape
};

/// Where the shape that ffe shows was one step earlier, see shape_velocity.
struct CameFrom {
  CopyOnWrite<Load> load{};
  std::map<std::uint32_t, Vec3> touched{}; // where nodes stood that instruments pushed
  double duration = 0;                     // s from then to now; 0: there is none
  std::vector<Vec3> velocity{};            // of nodes, where a cut left no stiffness to find it by
};

/// When all edges were last looked at, see warn_of_range.
struct RangeWatch {
  bool warned = false;
  double looked_at = 0; // largest displacement then
  int not_looked = 0;
};

/// What a blade has passed of a solid, back to where the wound may still end.
struct BladeTrail {
  std::size_t instrument = 0;
  std::vector<std::array<Vec3, 2>> edges; // where they were in the solid, at rest
  std::array<Vec3, 2> last{};             // the last one where it stands
  /// Of a solid with a skin: points of edges, at rest, since that was cut last.
  std::vector<std::vector<Vec3>> rows{};
};

/// What cuts have done to an object.
struct CutState {
  std::shared_ptr<const Model> first{};                  // the model as it came, of a cut one
  CopyOnWrite<std::vector<std::uint32_t>> first_nodes{}; // see Simulation
  CopyOnWrite<std::vector<std::uint32_t>> places{};
  Cut scored{};                     // edges that wait to come apart
  double tear = 0;                  // strain of springs
  TearLimit limit{};                // of a solid
  std::vector<BladeTrail> trails{}; // of blades in a solid
};

/// An object. A cut makes another one that takes its place.
struct Object {
  std::shared_ptr<Matter> matter = std::make_shared<Matter>();
  std::shared_ptr<Statics> statics = std::make_shared<Statics>();
  Method method = Method::ela;
  Integration integration = Integration::semi_implicit; // of a net; automatic: it has no body yet
  CopyOnWrite<Load> load{};
  CopyOnWrite<std::map<std::uint32_t, double>> hung{}; // g by node, beside the model's masses
  Stages stages;
  bool warp = false;                          // large rotations
  bool meets = false;                         // one of the scene's contacts is of it
  std::shared_ptr<const WarpedAnswer> warped; // the last one, that the next one starts from
  std::shared_ptr<Body> body;                 // of an elastodynamic object
  std::size_t offset = 0;                     // of its nodes in the body
  Shown shown;
  CameFrom came;
  RangeWatch range;
  std::vector<NodalContactForce> impulses; // of contact in this step so far: 1e-6 N s
  std::vector<NodalContactForce> touching; // contact forces now
  bool in_motion = false; // of ffe: bodies that move touch it in this step, see islands.cpp
  CutState cut;

  const Model& model() const { return *matter->model; }
  const std::string& name() const { return matter->name; }
};

struct Tie {
  std::size_t object = 0, other = 0;
  std::uint32_t node = 0, other_node = 0;
  double stiffness = 0, rest = 0;
};

/// Objects that may touch each other, or one that may touch itself.
struct ContactRule {
  std::size_t object = 0, other = 0;
  double friction = 0;
};

struct Instrument {
  struct Grip {
    std::size_t object = 0;
    std::uint32_t node = 0;
    Vec3 point; // on the instrument
  };
  std::string name;
  InstrumentShape shape;
  bool present = false;
  PoseWay way;
  std::vector<Grip> grips;
  std::vector<Pose> path; // of a blade: what it has passed in this step
  Pose before;            // where elastodynamic objects last met it
  bool changed = false;   // since then put or withdrawn
  bool stepped = false;   // in this step an island with what moves has taken it along
  /// Under a virtual coupling: the way is the hand's.
  struct Coupled {
    Coupling coupling;
    Vec3 place; // of the instrument
    Vec3 lag;   // from it to the hand
    Vec3 force; // on it
  };
  std::optional<Coupled> coupled;

  Pose pose(double time) const {
    Pose pose = way.at(time);
    if (coupled)
      pose.place = coupled->place;
    return pose;
  }
};

struct Event {
  Change change;
  double origin = 0, period = 0; // of a repeated one
  double round = 0;
  bool in_flight = false; // takes effect just now
};

struct Clock {
  double time = 0;
  double shown = 0;         // when all objects were last shown
  double sum = 0, lost = 0; // of the steps so far, and what rounding took from it
};

struct Scene {
  std::deque<Object> objects; // references last while others come
  std::vector<std::shared_ptr<Body>> bodies;
  std::vector<Tie> ties;
  std::vector<ContactRule> contacts;
  std::vector<Instrument> instruments;
  /// In this step: where the instruments stood, one after the other.
  std::vector<std::vector<std::optional<Pose>>> poses;
  std::optional<double> jumped{}; // when, if the last of these is of instruments moved at once
  CopyOnWrite<std::multimap<double, Event>> events;
  Vec3 gravity;
  Clock clock;
  SceneSettings settings;
  SimulationCounts counts;
  News news;
};

} // namespace gewebe::simulation
