#pragma once
// What a Simulation holds, and how its units write numbers.

#include "base/error.h"
#include "base/number_text.h"
#include "compliance/cut_stiffness.h"
#include "scene/simulation.h"
#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe {

namespace simulation {

using gewebe::number_text;

/// Of what is told in single precision too, with room for sums.
inline constexpr double largest_number = 1e38;

/// Counts add up, errors are the larger ones.
void add_counts(ElastostaticCounts& sum, const ElastostaticCounts& more);

} // namespace simulation

struct Simulation::Object {
  /// The shape before cuts that nobody has asked for: it is found when somebody does, from the
  /// model of then.
  struct LateShape {
    std::shared_ptr<const Model> model;
    Load load;
    std::vector<std::shared_ptr<const Moves>> moves; // since, one cut each
  };
  /// Where the shape that ffe shows was one step earlier, see shape_velocity.
  struct CameFrom {
    Load load;
    std::map<std::uint32_t, Vec3> touched; // where nodes stood that instruments pushed
    double over = 0;                       // s from then to now; 0: there is none
    std::vector<Vec3> velocity;            // of nodes, where a cut left no stiffness to find it by
  };
  explicit Object(std::shared_ptr<Model> m = std::make_shared<Model>())
      : held(std::move(m)), model(*held) {}
  std::string name;
  ObjectSource source;
  std::shared_ptr<Model> held;
  Model& model; // never moves: the methods refer to it; empty until it is known
  bool known = false;
  Method method = Method::ela;
  Load load;
  Integration integration = Integration::semi_implicit;
  std::optional<Elastostatic> still;
  std::optional<TwoStepOptions> stages;   // what two-step says of it
  std::function<StiffnessParts()> second; // its second stage
  std::optional<TwoStep> two_step;        // over `still`, made when needed
  Body* body = nullptr;                   // of an elastodynamic object
  std::size_t offset = 0;                 // of its nodes in the body

  std::vector<double> displacement;
  std::vector<NodeVector> forces;
  std::vector<double> before; // displacement and forces of the step before the last
  std::vector<NodeVector> forces_before;
  bool shown = true;  // forces are those of the present state, and of ela the displacement
  bool shaped = true; // of ffe the displacement too, under this load
  std::shared_ptr<const LateShape> late; // what the displacement is, where it is not shaped
  Load shown_load;
  double shown_time = 0;
  bool posed = false; // what is shown is a shape of ffe
  CameFrom came;
  bool warned_range = false;
  double shortest_edge = 0; // mm; 0: not yet known
  double size = 0;          // mm, longest side of the box at rest; 0: not yet known
  double looked_at = 0;     // largest displacement when the range was last looked at
  int not_looked = 0;
  int slow = 0;             // updates in a row that took too long for the rate
  ElastostaticCounts spent; // of what was renewed
  bool warned_threshold = false;

  std::unique_ptr<StaticContact> contact; // of an elastostatic object, once there are instruments
  std::vector<NodeTouch> touches;         // as shown
  std::vector<NodeTouch> impulses;        // in this step so far, from bodies it has left: 1e-6 N s
  bool warned_stuck = false, warned_unsolved = false, warned_stages = false;

  // A cut makes another object that takes this one's place.
  std::shared_ptr<Model> first;           // the model as it came, of a cut one
  std::vector<std::uint32_t> first_nodes; // see Simulation
  std::vector<std::uint32_t> places;
  std::optional<StiffnessParts> prepared;  // of the cut model, by cut_parts
  std::unique_ptr<CutStiffness> stiffness; // that made them
  Cut scored;                              // edges that wait to come apart
  double tear = 0;
  bool warned_cut = false;
};

/// Where the nodes of an object have gone.
struct Simulation::Moves {
  struct To {
    std::size_t object = 0;
    std::uint32_t node = 0;
    double share = 1; // of what the node had
    bool main = true; // of several: which one goes on as that node
  };
  std::vector<std::size_t> objects; // itself, new ones
  std::vector<std::size_t> first;   // by node, and the end
  std::vector<To> all;

  std::span<const To> of(std::uint32_t node) const {
    return {all.data() + first[node], all.data() + first[node + std::size_t{1}]};
  }
  /// \param ways of nodes below `nodes`, in any order; those of a node keep theirs
  void add(std::span<const std::pair<std::uint32_t, To>> ways, std::size_t nodes);
};

struct Simulation::Instrument {
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
};

/// What moves together: one elastodynamic object, or several that are attached to each other.
struct Simulation::Body {
  std::vector<std::size_t> parts; // objects
  std::optional<Model> joined;    // of several; else the object's own
  std::optional<Elastodynamic> moving;
  double safe = 0; // largest stable step
  bool changed = true;
  bool warned_step = false;
  bool warned_implicit = false;
  bool touched = false;         // by an instrument, in the last step
  std::optional<Box3> rest_box; // while at rest
  std::uint64_t taken = 0;      // by the last advance
  std::exception_ptr failure;
};

/// What a failed call takes back: every change of what decides how the scene goes on is noted
/// before it is made.
struct Simulation::Undo {
  bool open = false;
  std::vector<std::function<void()>> back; // carried out from the last to the first; must not throw
  std::set<const Body*> kept;              // whose motion was noted
  std::set<const Body*> kept_resting;      // whose rest was
  std::set<Object*> updated;               // whose elastostatic state moved on

  void note(std::function<void()> one) {
    if (open)
      back.push_back(std::move(one));
  }
};

/// Does all of the work or, if it throws under guard, nothing.
template <class Work>
void Simulation::guarded(Work&& work) {
  if (!options_.guard || undo_->open) {
    work();
    return;
  }
  open_undo();
  try {
    work();
  } catch (...) {
    take_back();
    throw;
  }
  *undo_ = {};
}

} // namespace gewebe
