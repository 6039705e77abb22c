#pragma once
// A Simulation from within: the scene, what runs it, and the functions that do, by file.

#include "base/error.h"
#include "base/number_text.h"
#include "scene/scene_internal.h"

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

struct World {
  Context context;
  SimulationOptions options;
  Scene now{};
  bool saved = false;                 // under guard: a call that throws goes back
  std::vector<std::size_t> renewed{}; // see Simulation::take_renewed
};

// guard.cpp: a call that fails leaves the scene as it was
struct Saved {
  Scene scene;
  std::vector<Body::Snapshot> bodies;
};
Saved save(World& w);
void take_back(World& w, Saved&& saved) noexcept;

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

/// What is shown of it, or moves it, is no longer right.
inline void touch(Object& object) {
  object.shown.valid = false;
  if (object.body != nullptr)
    object.body->changed = true;
}

/// Names object and time in an Error.
template <class Work>
void at_object(const World& w, const Object& object, Work&& work) {
  try {
    work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error("object " + object.name() + " at " + number_text(w.now.clock.time) +
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
std::vector<NodeVector> static_forces(const Object& object);

// bodies.cpp: what is tied together, or near and may touch, and moves as one
using Motions = std::map<std::size_t, std::vector<NodeMotion>>;
void need_body(World& w, std::size_t object);
std::shared_ptr<Body> make_body(World& w, std::vector<std::size_t> parts,
                                const Motions* motions = nullptr);
void drop_body(World& w, const Body* body);
/// Solids that move as one have elements of one order and are moved alike. \throw Error
void require_like_solids(const World& w, std::span<const std::size_t> objects);
void move_bodies(World& w, double to);
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

// meetings.cpp: whose surfaces touch
void meet(World& w, double to, Extents& extents, bool stay = false);
void note_extents(const World& w, Extents& extents);
std::set<std::size_t> met_late(const World& w, Extents& before, Extents& after);
void join_late(World& w, const std::set<std::size_t>& objects);
std::vector<SurfaceMeeting> meetings_of(const World& w, std::span<const std::size_t> parts,
                                        std::span<const std::size_t> offset);
void move_meetings(World& w, std::size_t index, const Moves& moves);
/// Objects that may come to move as one with this one, by ties and meetings, itself among them.
std::vector<std::size_t> together(const World& w, std::size_t object);

// time.cpp: steps through events; show.cpp: the picture at their end
void advance(World& w, double to);
void show(World& w, Object& object);
void shape(World& w, Object& object);
void shape_in_step(World& w, Object& object);
/// Of all nodes, those inside a solid too.
std::span<const double> whole_shape(World& w, Object& object);
std::span<const double> whole_shape_in_step(World& w, Object& object);
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
void drop_grips(World& w, std::size_t object, const std::vector<std::uint32_t>& nodes);
void note_poses(World& w, std::optional<std::size_t> jumps = {});
bool instruments_there(const World& w);
std::optional<Pose> pose_at(const World& w, std::size_t moment, std::size_t instrument);

// coupled.cpp: instruments that hands lead through a spring
void lead_on(World& w, double to, Extents& extents);
void follow_hands(World& w, double to);
bool gives_way_to(const World& w, const Instrument& instrument, const Object& object);
MovedInstrument led_here(const World& w, const Instrument& instrument, const MovedInstrument& way);
void settle(World& w, std::size_t instrument, const Object& object);
void end_leading(World& w);

// contact.cpp: whom they touch
void guide(World& w, Body& body, double to, Extents& extents);
void end_guiding(World& w, double to);
void take_touches(World& w, double duration);
void gather_impulses(World& w, Body& body);
bool touched_anew(World& w, Object& object);
void follow_instruments(World& w, Object& object);
void add_touches(Object& object);

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
