#pragma once
// Internals of Simulation: its state, and the functions that work on it, grouped by source file.

#include "base/error.h"
#include "scene/scene_internal.h"
#include "text/number_text.h"

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

namespace gewebe::scene {

/// Bound for numbers that are written in single precision too, with room for sums.
inline constexpr double largest_number = 1e38;

struct IslandCache;

/// A Simulation's state: the scene, and what a rollback does not restore.
struct World {
  Context context;
  SimulationOptions options;
  Scene now{};
  bool saved = false;                                  // under guard: an outer call rolls back
  std::vector<std::shared_ptr<IslandCache>> islands{}; // surfaces of islands, see islands.cpp
};

// guard.cpp: rollback of the scene after a call that fails
Snapshot snapshot(const World& w);
/// Rolls back: all later results are, to the bit, those that followed the snapshot. May be called
/// within guarded().
void roll_back(World& w, Snapshot&& snapshot) noexcept;

/// Does all of the work or, if it throws under guard, nothing.
template <class Work>
void guarded(World& w, Work&& work) {
  if (!w.options.guard || w.saved) {
    work();
    return;
  }
  Snapshot before = snapshot(w);
  w.saved = true;
  try {
    work();
  } catch (...) {
    roll_back(w, std::move(before));
    w.saved = false;
    throw;
  }
  w.saved = false;
}

// objects.cpp: models of objects
void insert(World& w, Object object);
void need_model(Object& object);

/// Whether the model holds all of its nodes. \pre its model is known
inline bool is_held_altogether(const Object& object) {
  return std::ranges::all_of(
      object.model().nodes, [](const model::Node& node) { return node.fixed == model::fixed_all; });
}

/// Law of large strains that is chosen for an object or, if its model is known, that of a material.
std::optional<integrator::SolidLaw> law_of(const Object& object);
/// Whether its shape at rest is that of large strains, see dynamics/solid_static.h.
inline bool has_law(const Object& object) {
  return law_of(object).has_value();
}

/// Whether it is a viscoelastic solid at rest, whose shape depends on time.
bool relaxes(const Object& object);
/// The time that passes until its shape at `end`. \pre relaxes(object)
dynamics::RestTime rest_time(const World& w, const Object& object, double end);

/// Marks the output state and the body of an object as out of date.
inline void touch(Object& object) {
  object.shown.valid = false;
  if (object.body != nullptr)
    object.body->changed = true;
}

/// Error whose text names the object and the time.
class ObjectError : public Error {
public:
  using Error::Error;
};

/// Runs `work`; adds object and time to an Error that it throws, unless it names the object
/// already.
template <class Work>
void at_object(const World& w, const Object& object, Work&& work) {
  try {
    work();
  } catch (const Cancelled&) {
    throw;
  } catch (const ObjectError&) {
    throw;
  } catch (const Error& error) {
    throw ObjectError("object " + object.name() + " at " + text::number_text(w.now.clock.time) +
                      " s: " + (error.place().empty() ? "" : error.place() + ": ") + error.what());
  }
}

// support.cpp: features that an object's method supports
/// Reason why an object does not support a feature; null: it does.
const Gap* gap_of(const Object& object, Feature feature);
/// \throw Error "object NAME …" if the object does not support the feature
void require_support(const World& w, const Object& object, Feature feature);
/// Whether the object supports the feature. If not, a warning is issued once.
bool feels(const World& w, Object& object, Feature feature);

// statics.cpp: solvers of elastostatic objects, of the one-step and the two-step method
statics::Elastostatic& solver_of(World& w, Object& object);
statics::WarpedStatics& warped_of(World& w, Object& object);
/// \pre it has a law \throw Error if the object is no solid of tetrahedra alone
dynamics::SolidStatic& strained_of(World& w, Object& object);
statics::ElastostaticCounts static_counts(const Object& object);
void make_solver(const World& w, Object& object,
                 std::shared_ptr<compliance::ComplianceSource> source);
void update_solver(World& w, Object& object, const contact::Load& load);
/// Drops the solvers of an object: factors, columns, running sums.
void drop_solvers(Object& object);
/// Adds counts; errors become the larger of both.
void add_counts(statics::ElastostaticCounts& sum, const statics::ElastostaticCounts& more);
void add_counts(dynamics::SolidStepCounts& sum, const dynamics::SolidStepCounts& more);
statics::TwoStep& two_step_of(World& w, Object& object);
void follow_cut(const World& w, const Object& old, std::span<const std::uint32_t> origin,
                Object& next);
void make_whole(const World& w, Object& object);
void update_stages(World& w, Object& object, const contact::Load& load);
/// Displacement of all nodes.
std::span<const double> static_shape(Object& object);
/// Displacement of the nodes that the solver has rows for: at least those of the surface.
std::span<const double> static_surface(Object& object);
/// As static_surface, within the tolerance.
std::span<const double> static_rough_surface(Object& object);
/// Measures the error of a shape that no caller has read.
void verify_shape(Object& object);
std::vector<contact::NodeVector> static_forces(const Object& object);

// bodies.cpp: bodies of one object, or of several that are attached to each other
using Motions = std::map<std::size_t, std::vector<dynamics::NodeMotion>>;
void need_body(World& w, std::size_t object);
/// All parts as one model, without the springs that attach them.
/// \param offset  becomes the first node of each part
model::Model joined_model(const World& w, std::span<const std::size_t> parts,
                          std::vector<std::size_t>& offset);
std::shared_ptr<Body> make_body(World& w, std::vector<std::size_t> parts,
                                const Motions* motions = nullptr);
/// Model of an object, with the masses that SetMass has added.
model::Model weighed_model(const Object& object);
/// Replaces the body of an object after a change of masses. Its motion stays.
void make_body_again(World& w, std::size_t object);
/// Replaces a body by one with implicit steps. Its motion stays.
void make_implicit(World& w, std::shared_ptr<Body>& body);
double integration_step(World& w, Body& body);
/// Hands the loads of all parts to their body.
void load_body(const World& w, Body& body);
/// \throw the failure of the body, with the name of its object
[[noreturn]] void raise(const World& w, const Body& body);
/// Advances bodies without contact to time `to`.
void advance_freely(World& w, std::span<Body* const> bodies, double to);
void drop_body(World& w, const Body* body);
/// Solids that share a body need elements of one order and one integration. \throw Error
void require_like_solids(const World& w, std::span<const std::size_t> objects);
/// Whether the model has tetrahedra. \pre its model is known
inline bool is_solid(const Object& object) {
  return !object.model().tetrahedra.empty();
}
/// Whether its body takes implicit steps, which cache a factor.
inline bool moves_implicitly(const Object& object) {
  return object.integration == Integration::implicit || is_solid(object);
}
/// Positions and velocities of an object's nodes. \pre it has a body
std::span<const dynamics::NodeMotion> motion_of(const Object& object);

// islands.cpp: islands of objects and instruments in contact
/// Advances all bodies to time `to`, with contact.
void advance_bodies(World& w, double to);
/// To be called before a step of the scene.
void begin_contact(World& w);
/// To be called after a step: contact forces on elastodynamic objects become means over its time.
void end_contact(World& w, double duration);
/// Renumbers the contact impulses of an object after a cut.
void move_contacts(World& w, std::size_t index, const Moves& moves);
/// Computes the output state of elastostatic objects that are, or may come, in contact.
/// \return by object, whether its output state was computed here
std::vector<std::uint8_t> show_static_contacts(World& w);
/// Objects that may share an island with this one, by ties and contact, itself included.
std::vector<std::size_t> together(const World& w, std::size_t object);
/// Start pose of an instrument that appears at `pose`: outside of all objects.
contact::Pose entry_pose(World& w, const contact::InstrumentShape& shape,
                         const contact::Pose& pose);
/// Requires that surfaces that may touch do not intersect.
/// \throw Error naming objects and position
void require_apart(World& w, const ContactRule& rule);
/// Requires that no connected part of either surface is inside the other one, where that is closed.
/// \param any  also where that is a net, which is hollow
/// \pre they do not intersect \throw Error naming objects and position
void require_outside(World& w, const ContactRule& rule, bool any);

// time.cpp: steps through events
void advance(World& w, double to);

// show.cpp: output state at the end of a step
/// Computes the output state of an object.
void show(World& w, Object& object);
/// The same for an elastostatic object that shared an island with moving bodies in this step.
void show_in_motion(World& w, Object& object);
void begin_showing(World& w, Object& object);
void end_showing(World& w, Object& object);
/// Load of an object at a time, with the weight of added masses. \pre its model is known
contact::Load acting_at(const Object& object, double time);
/// Copies the present load to the output state.
void load_shown(const World& w, Object& object);
/// Warns, once per object, if a shape leaves the range of linear elasticity.
void warn_of_range(World& w, Object& object);
/// The same where the shape has not been found, but its largest displacement is known, mm.
void warn_of_range(World& w, Object& object, double largest);
/// Computes the displacement for output, within the tolerance.
void shape(World& w, Object& object);
/// Computes the exact displacement, on which the scene depends.
void shape_in_step(World& w, Object& object);
/// Displacement of all nodes, inner ones of a solid included.
std::span<const double> whole_shape(World& w, Object& object);
std::span<const double> whole_shape_in_step(World& w, Object& object);
/// The load that belongs to a displacement, with contact forces.
contact::Load acting_load(const Shown& shown);
/// Displacement as known: of all nodes if that was computed, else of the first ones. \pre shaped
std::span<const double> known_shape(const Object& object);
double displacement_limit(Object& object);
void require_bounded(Object& object, std::span<const double> displacement,
                     std::span<const std::uint32_t> nodes = {});

// velocity.cpp: velocities of elastostatic objects
void leave_shown(World& w, Object& object);
bool has_moved(const World& w, const Object& object);
std::vector<Vec3> shape_velocity(World& w, Object& object, bool afresh);

// instruments.cpp: poses and grasps of instruments
std::size_t instrument_place(const World& w, const std::string& name) noexcept;
std::size_t add_instrument(World& w, const std::string& name);
InstrumentReport report_of(const World& w, std::size_t instrument);
/// Moves instruments that are inside an object whose shape has jumped to their pose from outside.
void let_instruments_enter(World& w);
void drop_grips(World& w, std::size_t object, const std::vector<std::uint32_t>& nodes);
void note_poses(World& w, std::optional<std::size_t> jumps = {});
bool instruments_there(const World& w);
std::optional<contact::Pose> pose_at(const World& w, std::size_t moment, std::size_t instrument);

void add_contact_forces(Object& object);

// cuts.cpp: cuts, and parts that come off
void announce_cut(World& w, std::size_t index);
void find_deferred_shape(World& w, Object& object);
void sweep_blades(World& w);
void find_free_motion(World& w, std::size_t index);
void carry_out(World& w, std::size_t index, cutting::CutModel cut);
bool may_cut(World& w, Object& object, Feature feature);
/// Runs `work`; adds the object's name to an Error that it throws.
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
/// Area swept by a blade since the last step, nearly flat.
struct BladeArea {
  std::size_t instrument = 0;
  cutting::SweptQuad corners{};
};
/// \throw Error if the plane parts nothing
cutting::CutModel plane_through(const World& w, std::size_t index, const PlaneToCut& plane);
/// The same, or empty if the plane parts nothing.
/// \param skin_too  cuts the embedded surface too
std::optional<cutting::CutModel> cut_by_plane(const World& w, std::size_t index,
                                              const PlaneToCut& plane, bool skin_too = true);
void sweep_solid(World& w, std::size_t index, std::span<const BladeArea> areas);

// wound_walls.cpp: walls of cuts in contact
/// \throw Error if surfaces of the contact coincide at nodes that are held. No contact force can
/// separate them
void require_parted_holds(const World& w, const SetContact& c, const Motions& motions);
/// Moves a node but along its fixed axes. \param motions  of bodies' objects; that of an
/// elastodynamic object is added
void move_node(World& w, std::size_t index, std::uint32_t node, Vec3 by, Motions& motions);
/// Separates coincident nodes of these objects' surfaces, so that contact can begin.
/// \param motions  motions of bodies' objects; those of elastodynamic objects that are moved are
/// added \return objects that were moved
std::vector<std::size_t> separate_walls(World& w, std::span<const std::size_t> objects,
                                        Motions& motions);

// separation.cpp: surfaces that overlap
/// Moves vertices of surfaces that intersect or touch as little as possible, in the mean square, so
/// that all pairs of the rules stand apart. \param movable  objects whose vertices may move
/// \param motions  as of separate_walls(), with those of all bodies of movable objects
/// \return objects that were moved
/// \throw Error where they overlap by more than an edge, or held vertices do
std::vector<std::size_t> separate_overlaps(World& w, std::span<const ContactRule> rules,
                                           std::span<const std::size_t> movable, Motions& motions);

// tears.cpp: tearing of overstrained springs and elements at the end of a step
void tear(World& w);

// moves.cpp: renumbering of nodes after a cut
Object renumbered(const Object& old, std::shared_ptr<const model::Model> model);
/// A vector field over the old nodes, renumbered to the nodes of one new object.
std::vector<double> moved_field(const Moves& moves, std::size_t object,
                                std::span<const double> field);
void move_all(World& w, std::size_t index, const Moves& moves, std::deque<Object> pieces,
              std::span<const Vec3> velocity = {});
void renew_bodies(World& w, const Motions& motions);

} // namespace gewebe::scene
