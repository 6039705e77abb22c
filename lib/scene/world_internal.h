#pragma once
// A Simulation from within: the scene, what runs it, and the functions that do, by file.

#include "base/error.h"
#include "base/number_text.h"
#include "scene/scene_internal.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::simulation {

using gewebe::number_text;

/// Of what is told in single precision too, with room for sums.
inline constexpr double largest_number = 1e38;

struct IslandCache;

struct World {
  Context context;
  SimulationOptions options;
  Scene now{};
  bool saved = false;                                  // under guard: a call that throws goes back
  std::vector<std::size_t> renewed{};                  // see Simulation::take_renewed
  std::vector<std::shared_ptr<IslandCache>> islands{}; // surfaces of islands, see islands.cpp
};

// guard.cpp: a call that fails leaves the scene as it was
struct Saved {
  Scene scene;
  std::vector<Body::Snapshot> bodies;
};
Saved save(World& w);
void take_back(World& w, Saved&& saved) noexcept;
/// Rolls back so that the same step can be repeated. Caches stay valid, even within guarded().
Saved saved_now(const World& w);
void take_back_again(World& w, Saved&& saved) noexcept;

/// Does all of the work or, if it throws under guard, nothing.
template <class Work>
void guarded(World& w, Work&& work) {
  if (!w.options.guard || w.saved) {
    work();
    return;
  }
  Saved before = save(w);
  try {
    work();
  } catch (...) {
    take_back(w, std::move(before));
    throw;
  }
  w.saved = false;
}

// objects.cpp: what they consist of
void insert(World& w, Object object);
void need_model(Object& object);

/// Whether the model holds all of its nodes. \pre its model is known
inline bool is_held_altogether(const Object& object) {
  return std::ranges::all_of(object.model().nodes,
                             [](const Node& node) { return node.fixed == fixed_all; });
}

/// What is shown of it, or moves it, is no longer right.
inline void touch(Object& object) {
  object.shown.valid = false;
  if (object.body != nullptr)
    object.body->changed = true;
}

/// One that names its object and time.
class ObjectError : public Error {
public:
  using Error::Error;
};

/// Names object and time in an Error.
template <class Work>
void at_object(const World& w, const Object& object, Work&& work) {
  try {
    work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw ObjectError("object " + object.name() + " at " + number_text(w.now.clock.time) +
                      " s: " + (error.place().empty() ? "" : error.place() + ": ") + error.what());
  }
}

// support.cpp: which methods go with which features
/// What is in the way; null: it works.
const Gap* gap_of(const Object& object, Feature feature);
/// \throw Error "object NAME …" where it does not
void require_support(const World& w, const Object& object, Feature feature);
/// Whether it works; where not, the object is passed by, which is told once.
bool feels(const World& w, Object& object, Feature feature);

// statics.cpp: solvers of one step and of two
Elastostatic& solver_of(World& w, Object& object);
WarpedStatics& warped_of(World& w, Object& object);
ElastostaticCounts static_counts(const Object& object);
void make_solver(const World& w, Object& object, std::shared_ptr<ComplianceSource> source);
void update_solver(World& w, Object& object, const Load& load);
/// Forgets what is kept to be quick.
void renew(Object& object);
/// Counts add up, errors are the larger ones.
void add_counts(ElastostaticCounts& sum, const ElastostaticCounts& more);
void add_counts(SolidStepCounts& sum, const SolidStepCounts& more);
TwoStep& two_step_of(World& w, Object& object);
void follow_cut(const World& w, const Object& old, std::span<const std::uint32_t> origin,
                Object& next);
void make_whole(const World& w, Object& object);
void update_stages(World& w, Object& object, const Load& load);
/// Whole, or of the nodes alone that the solver has rows for: all of the surface among them.
std::span<const double> static_shape(Object& object);
std::span<const double> static_surface(Object& object);
/// As the surface, within the tolerance.
std::span<const double> static_rough_surface(Object& object);
/// Measures the shape that no caller has asked for.
void verify_shape(Object& object);
std::vector<NodeVector> static_forces(const Object& object);

// bodies.cpp: what is tied together, or near and may touch, and moves as one
using Motions = std::map<std::size_t, std::vector<NodeMotion>>;
void need_body(World& w, std::size_t object);
/// All parts as one model, without what ties them. \param offset becomes the first node of each
Model joined_model(const World& w, std::span<const std::size_t> parts,
                   std::vector<std::size_t>& offset);
std::shared_ptr<Body> make_body(World& w, std::vector<std::size_t> parts,
                                const Motions* motions = nullptr);
/// With what hangs on its nodes.
Model weighed_model(const Object& object);
/// The body of an object goes on with other masses.
void make_body_again(World& w, std::size_t object);
/// The same body by implicit steps.
void make_implicit(World& w, std::shared_ptr<Body>& body);
double integration_step(World& w, Body& body);
/// What acts on all parts, to their body.
void load_body(const World& w, Body& body);
/// \throw what ended its motion, with the name of its object
[[noreturn]] void raise(const World& w, const Body& body);
/// Joint steps without contact.
void advance_freely(World& w, std::span<Body* const> bodies, double to);
void drop_body(World& w, const Body* body);
/// Solids that move as one have elements of one order and are moved alike. \throw Error
void require_like_solids(const World& w, std::span<const std::size_t> objects);
/// Of tetrahedra, or with some. \pre its model is known
inline bool is_solid(const Object& object) {
  return !object.model().tetrahedra.empty();
}
/// By steps that keep a factor.
inline bool moves_implicitly(const Object& object) {
  return object.integration == Integration::implicit || is_solid(object);
}
/// How an object's nodes move. \pre it has a body
std::span<const NodeMotion> motion_of(const Object& object);

// islands.cpp: whose surfaces touch, and what moves together for it
/// A way of all that moves, through contact.
void advance_bodies(World& w, double to);
/// Before a step of the scene.
void begin_contact(World& w);
/// Behind a step: contact forces on what moves, means over its time.
void end_contact(World& w, double duration);
/// What bodies did to contact forces so far goes to their objects.
void move_contacts(World& w, std::size_t index, const Moves& moves);
/// Elastostatic objects that are in contact, or may come to be: shows those of them that need it.
/// \return by object, whether it was shown here
std::vector<std::uint8_t> show_static_contacts(World& w);
/// Objects that may come to move as one with this one, by ties and contact, itself among them.
std::vector<std::size_t> together(const World& w, std::size_t object);
/// Where an instrument that appears comes from: out of all objects.
Pose entry_pose(World& w, const InstrumentShape& shape, const Pose& pose);
/// \throw Error naming objects and the place where surfaces that may touch pass each other
void require_apart(World& w, const ContactRule& rule);

// time.cpp: steps through events; show.cpp: the picture at their end
void advance(World& w, double to);
void show(World& w, Object& object);
/// Of an elastostatic object that took part in steps of what moves.
void show_in_motion(World& w, Object& object);
void begin_showing(World& w, Object& object);
void end_showing(World& w, Object& object);
/// What acts on it at a time, with the weight of what hangs on it. \pre its model is known
Load acting_at(const Object& object, double time);
/// What acts on it now will be shown.
void load_shown(const World& w, Object& object);
void warn_of_range(World& w, Object& object);
/// To be shown: within the tolerance.
void shape(World& w, Object& object);
/// The same during a step, which may be taken back: the shape is then computed anew.
void shape_to_show(World& w, Object& object);
/// What the scene goes on by: exact.
void shape_in_step(World& w, Object& object);
/// Of all nodes, those inside a solid too.
std::span<const double> whole_shape(World& w, Object& object);
std::span<const double> whole_shape_in_step(World& w, Object& object);
/// What its shape is of: the load, and what touches it.
Load acting_load(const Shown& shown);
/// That which is known: as it is shown, of all nodes if it was asked for. \pre shaped
std::span<const double> known_shape(const Object& object);
double displacement_limit(Object& object);
void require_bounded(Object& object, std::span<const double> displacement);

// velocity.cpp: how fast elastostatic objects move
void leave_shown(World& w, Object& object);
bool has_moved(const World& w, const Object& object);
std::vector<Vec3> shape_velocity(World& w, Object& object, bool afresh);

// instruments.cpp: where they are and what they hold
std::size_t instrument_place(const World& w, const std::string& name) noexcept;
std::size_t add_instrument(World& w, const std::string& name);
InstrumentReport report_of(const World& w, std::size_t instrument);
/// Those that stand in an object whose shape is another one come to where they are from outside.
void let_instruments_enter(World& w);
void drop_grips(World& w, std::size_t object, const std::vector<std::uint32_t>& nodes);
void note_poses(World& w, std::optional<std::size_t> jumps = {});
bool instruments_there(const World& w);
std::optional<Pose> pose_at(const World& w, std::size_t moment, std::size_t instrument);

void add_contact_forces(Object& object);

// cuts.cpp: what they sever and what comes off
void announce_cut(World& w, std::size_t index);
void find_deferred_shape(World& w, Object& object);
void sweep_blades(World& w);
void find_free_motion(World& w, std::size_t index);
void carry_out(World& w, std::size_t index, CutModel cut);
bool may_cut(World& w, Object& object, Feature feature);
/// An Error of a cut, with the object's name.
template <class Work>
auto of_object(const std::string& name, Work&& work) {
  try {
    return work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error("object " + name + ": " + error.what());
  }
}

// solid_cuts.cpp: blades and planes through tetrahedra
/// What a blade passed since the last step, nearly flat.
struct BladeArea {
  std::size_t instrument = 0;
  SweptQuad corners{};
};
CutModel plane_through(const World& w, std::size_t index, const PlaneToCut& plane);
/// The same, or nothing where it parts nothing. \param skin_too else that stays as it is
std::optional<CutModel> cut_by_plane(const World& w, std::size_t index, const PlaneToCut& plane,
                                     bool skin_too = true);
void sweep_solid(World& w, std::size_t index, std::span<const BladeArea> areas);

// wound_walls.cpp: walls of cuts in contact
/// \throw Error where surfaces that are to touch share a place at nodes that are held: no contact
/// force can part them
void require_parted_holds(const World& w, const SetContact& c, const Motions& motions);
/// Moves nodes of these objects' surfaces apart that stand at one place, so that contact can begin.
/// \param motions  of bodies' objects; elastodynamic objects that are moved are among them then
/// \return objects that were moved
std::vector<std::size_t> separate_walls(World& w, std::span<const std::size_t> objects,
                                        Motions& motions);

// tears.cpp: what gives way at the end of a step
void tear(World& w);

// moves.cpp: all that names nodes follows them
Object renumbered(const Object& old, std::shared_ptr<const Model> model);
/// What all nodes had, at those of one of the objects: three numbers each.
std::vector<double> moved_field(const Moves& moves, std::size_t object,
                                std::span<const double> field);
void move_all(World& w, std::size_t index, const Moves& moves, std::deque<Object> pieces,
              std::span<const Vec3> velocity = {});
void renew_bodies(World& w, const Motions& motions);

} // namespace gewebe::simulation
