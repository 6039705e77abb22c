#pragma once
// State of a scene as a value: everything that determines its future. A copy costs little, because
// large parts are shared until one of the copies is written. A rollback is an assignment.
//
// Solvers (Statics, Body) are shared by copies, since factors are large. What their results depend
// on beside the model, such as running sums, is part of a snapshot: see Snapshot.

#include "base/copy_on_write.h"
#include "contact/coupling.h"
#include "contact/island.h"
#include "contact/nodal_contact_force.h"
#include "dynamics/body_motion.h"
#include "dynamics/solid_dynamic.h"
#include "dynamics/solid_static.h"
#include "scene/extents.h"
#include "scene/simulation.h"
#include "scene/support.h"
#include "statics/warped_statics.h"
#include "update/cut_stiffness.h"

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

namespace gewebe::scene {

/// Renumbering of an object's nodes by a cut: the new object and number of each node.
struct Moves {
  struct To {
    std::size_t object = 0;
    std::uint32_t node = 0;
    double share = 1; // of the node's mass and loads
    bool main = true; // of several copies: the one that replaces the node
  };
  /// A node at a new position: it gets shares of the quantities of other nodes.
  struct Between {
    std::size_t object = 0;
    std::uint32_t node = 0;
    bool fresh = true; // false: a node of `all` that has been moved
    std::vector<std::pair<std::uint32_t, double>> of;
  };
  std::vector<std::size_t> objects; // the object itself, then new ones
  std::vector<std::size_t> first;   // by node: its first entry in `all`; then the size of `all`
  std::vector<To> all;
  std::vector<Between> between;

  std::span<const To> of(std::uint32_t node) const {
    return {all.data() + first[node], all.data() + first[node + std::size_t{1}]};
  }
  /// \param ways  entries of nodes below `nodes`, in any order; the entries of one node keep their
  /// order
  void add(std::span<const std::pair<std::uint32_t, To>> ways, std::size_t nodes);
};

/// Warnings that were issued. Each is issued once, also if a step is rolled back.
struct Told {
  bool stuck = false, unsolved = false, untorn = false;
  std::array<bool, all_features.size()> passed{}; // see feels()
};

/// Model of an object and data read from it. A rollback keeps it.
struct Matter {
  std::string name;
  ObjectSource source;
  integrator::SolidChoice solid; // how a solid moves
  std::shared_ptr<const model::Model> model =
      std::make_shared<const model::Model>(); // empty until it is read
  bool known = false;                         // `model` has been read
  double shortest_edge = 0;                   // mm; 0: not yet known
  double size = 0;                         // mm, longest side of the box at rest; 0: not yet known
  std::optional<Box3> box;                 // of the surface at rest, see shown_box
  std::optional<model::NodeCounts> counts; // of the model, counted when first needed
  Told told;
};

struct ContactReach;

/// Solvers of an elastostatic object, made when needed.
struct Statics {
  std::shared_ptr<statics::Elastostatic> solver;
  std::shared_ptr<statics::TwoStep> two_step;             // over `solver`
  std::shared_ptr<statics::WarpedStatics> warped;         // in place of both
  std::shared_ptr<dynamics::SolidStatic> strained;        // in place of all
  std::shared_ptr<ContactReach> reach;                    // of `solver`, see contact_reach
  std::shared_ptr<compliance::ComplianceSource> prepared; // of the cut model, by cut_source
  std::shared_ptr<const update::CutStiffness> stiffness;  // source of `prepared`
  statics::ElastostaticCounts spent;                      // by solvers that have been dropped
  int slow = 0; // updates in a row that took too long for the rate

  bool made() const { return solver || warped || strained; }

  /// What later results depend on, to the bit.
  struct Past {
    std::shared_ptr<const statics::Elastostatic::Past> solver{};
    std::shared_ptr<const statics::TwoStep::Past> two_step{};
    std::shared_ptr<const statics::WarpedAnswer> warped{};
    std::shared_ptr<const dynamics::SolidRest> strained{};
  };
  Past past() const;
  /// \pre these solvers were there at that time
  void restore(const Past& past);
};

/// Body with one integrator: one elastodynamic object, or several that are attached to each other.
struct Body {
  std::vector<std::size_t> parts;            // objects
  std::shared_ptr<const model::Model> model; // of all parts
  std::unique_ptr<dynamics::BodyMotion> moving;
  double safe = 0; // largest stable step, s
  bool changed = true;
  std::map<std::size_t, Extent> rest_extents{}; // by part, while at rest: see Extents
  bool warned_step = false;
  std::uint64_t taken = 0; // integration steps of the last advance
  contact::StepParts step_parts{};
  std::exception_ptr failure;

  struct Snapshot {
    bool changed = true;
    contact::StepParts step_parts{};
    std::map<std::size_t, Extent> rest_extents{};
    std::any motion;
  };
  Snapshot snapshot() const { return {changed, step_parts, rest_extents, moving->snapshot()}; }
  void restore(const Snapshot& was);
};

/// Settings of the two-step method for an object.
struct Stages {
  std::optional<statics::TwoStepOptions> options;
  std::function<std::shared_ptr<compliance::ComplianceSource>()> second; // its second stage
  std::shared_ptr<const model::Model> model,
      first_model;     // of the second stage: present, and before cuts
  bool warned = false; // a warning of a threshold that was never reached has been issued
};

/// Displacement before the cut, computed lazily from the model of that time.
struct DeferredShape {
  std::shared_ptr<const model::Model> model;
  contact::Load load;
  std::vector<std::shared_ptr<const Moves>> moves; // of the cuts since then
};

/// Output state of an object: displacement and forces.
struct Shown {
  /// `displacement` is that of all nodes, or of the first ones if a solid's solver has rows for its
  /// surface only. `whole` is that of all nodes, or empty while it is not needed.
  CopyOnWrite<std::vector<double>> displacement{}, whole{};
  CopyOnWrite<std::vector<contact::NodeVector>> forces{};
  std::vector<contact::NodalContactForce>
      contact{};      ///< of an elastodynamic object: means over the step
  bool valid = true;  // forces (of ela also the displacement) belong to the present state
  bool shaped = true; // of ffe: the displacement belongs to the present load
  bool rough = false; // accurate to the tolerance only; the scene itself uses the exact one
  std::shared_ptr<const DeferredShape> deferred{}; // source of the displacement while not `shaped`
  CopyOnWrite<contact::Load> load{};
  double time = 0;
  bool posed = false;        // the displacement is a shape of ffe
  std::optional<Box3> box{}; // see shown_box; empty until it is needed for this shape
  /// Displacements of nodes in contact, and the largest one seen (mm), where contact was found
  /// before the shape.
  std::map<std::uint32_t, Vec3> touched{};
  double largest = 0;
};

/// Previous state of an elastostatic object, one step earlier; see shape_velocity.
struct CameFrom {
  CopyOnWrite<contact::Load> load{};
  std::map<std::uint32_t, Vec3> touched{}; // displacements of nodes that instruments touched
  double duration = 0;                     // s from then to now; 0: there is no previous state
  std::vector<Vec3> velocity{};            // of nodes, if a cut left no stiffness to compute it
};

/// Record of the last check of all edges, see warn_of_range.
struct RangeWatch {
  bool warned = false;
  double looked_at = 0; // largest displacement then
  int not_looked = 0;   // shapes since then
};

/// Part of a blade's path through a solid, back to where the wound may still end.
struct BladeTrail {
  std::size_t instrument = 0;
  std::vector<std::array<Vec3, 2>> edges; // positions of the blade's edge in the solid, at rest
  std::array<Vec3, 2> last{};             // present position of the last edge
  /// Of a solid with an embedded surface: points of edges, at rest, since its last cut.
  std::vector<std::vector<Vec3>> rows{};
};

/// Effects of cuts on an object.
struct CutState {
  std::shared_ptr<const model::Model> first{};           // model before all cuts, of a cut object
  CopyOnWrite<std::vector<std::uint32_t>> first_nodes{}; // see ObjectFacts
  CopyOnWrite<std::vector<std::uint32_t>> places{};      // see ObjectFacts
  cutting::Cut scored{};                                 // severed edges that still hang together
  double tear = 0;                                       // largest strain of springs
  cutting::TearLimit limit{};                            // of a solid
  std::vector<BladeTrail> trails{};                      // of blades in a solid
};

/// State of an object. A cut replaces it by another one.
struct Object {
  std::shared_ptr<Matter> matter = std::make_shared<Matter>();
  Statics statics{};
  Method method = Method::ela;
  Integration integration = Integration::semi_implicit; // of a net; automatic: not yet chosen
  CopyOnWrite<contact::Load> load{};
  CopyOnWrite<std::map<std::uint32_t, double>> hung{}; // g by node, beside the model's masses
  Stages stages;
  bool warp = false;  // large rotations
  bool meets = false; // a SetContact names it
  std::shared_ptr<const statics::WarpedAnswer>
      warped; // last result, the start of the next iteration
  std::shared_ptr<const dynamics::SolidRest> strained; // the same under large strains
  std::shared_ptr<Body> body;                          // of an elastodynamic object
  std::size_t offset = 0;                              // of its nodes in the body
  Shown shown;
  CameFrom came;
  RangeWatch range;
  std::vector<contact::NodalContactForce> impulses; // of contact in this step so far, 1e-6 N s
  std::vector<contact::NodalContactForce> touching; // present contact forces
  bool in_motion = false; // of ffe: moving bodies touch it in this step, see islands.cpp
  CutState cut;

  const model::Model& model() const { return *matter->model; }
  const std::string& name() const { return matter->name; }
};

/// Spring between nodes of two attached objects.
struct Tie {
  std::size_t object = 0, other = 0;
  std::uint32_t node = 0, other_node = 0;
  double stiffness = 0, rest = 0;
};

/// Contact between two objects, or of one object with itself.
struct ContactRule {
  std::size_t object = 0, other = 0;
  double friction = 0;
};

/// State of an instrument.
struct Instrument {
  /// A node that the instrument grasps.
  struct Grip {
    std::size_t object = 0;
    std::uint32_t node = 0;
    Vec3 point; // on the instrument
  };
  std::string name;
  contact::InstrumentShape shape;
  bool present = false;
  contact::PoseWay way;
  std::vector<Grip> grips;
  std::vector<contact::Pose> path; // of a blade: its poses in this step
  contact::Pose before;            // pose at the last advance of elastodynamic objects
  bool changed = false;            // put or withdrawn since `before`
  bool stepped = false;            // an island with moving bodies has moved it in this step
  /// State under a virtual coupling. `way` is then the path of the hand.
  struct Coupled {
    contact::Coupling coupling;
    Vec3 place; // of the instrument
    Vec3 lag;   // from the instrument to the hand
    Vec3 force; // on the instrument
  };
  std::optional<Coupled> coupled;

  contact::Pose pose(double time) const {
    contact::Pose pose = way.at(time);
    if (coupled)
      pose.place = coupled->place;
    return pose;
  }
};

/// A scheduled change.
struct Event {
  Change change;
  double origin = 0, period = 0; // of a repeated event, s
  double round = 0;              // number of its repetition
  bool in_flight = false;        // it is being applied
};

/// Time of the scene, s, by compensated summation.
struct Clock {
  double time = 0;
  double shown = 0;         // time of the last output of all objects
  double changed = 0;       // ... or of an event since then
  double sum = 0, lost = 0; // sum of the steps so far, and its rounding error
};

/// State of the whole scene.
struct Scene {
  std::deque<Object> objects; // a deque, so that references stay valid when objects are added
  std::vector<std::shared_ptr<Body>> bodies;
  std::vector<Tie> ties;
  std::vector<ContactRule> contacts;
  std::vector<Instrument> instruments;
  /// Poses of all instruments at successive moments of this step.
  std::vector<std::vector<std::optional<contact::Pose>>> poses;
  std::optional<double> jumped{}; // time of the last of `poses`, if an instrument jumped there
  CopyOnWrite<std::multimap<double, Event>> events;
  Vec3 gravity;
  Clock clock;
  SceneSettings settings;
  SimulationCounts counts;
  News news;
};

/// A scene with what its solvers depend on.
struct Snapshot {
  Scene scene;
  std::vector<Body::Snapshot> bodies;
  std::vector<Statics::Past> statics; // by object
};

} // namespace gewebe::scene
