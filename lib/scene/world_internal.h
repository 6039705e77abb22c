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
/// For who goes the same way once more, whoever else has saved: what is kept to be quick stays.
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
/// What taking back does to an object whose shapes were asked of meanwhile, and Renew, which stands
/// for it in a record: renew, and contact from what is shown alone.
void begin_anew(World& w, std::size_t number);
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
/// All parts as one model, without what ties them. \param offset becomes the first node of each
Model joined_model(const World& w, std::span<const std::size_t> parts,
                   std::vector<std::size_t>& offset);
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
/// Whether moving objects that aren't near may come to be.
bool may_meet(const World& w, const Meeting& m);
/// One moves, or meets what moves, and the other is elastostatic.
bool is_mixed(const World& w, const Meeting& m);
/// Before a step of the scene: where those are that are mixed and not near.
std::map<std::size_t, Box3> note_mixed(World& w);
/// Behind it: which meetings are of such as have come together.
std::vector<std::size_t> mixed_met_late(World& w, const std::map<std::size_t, Box3>& before);
/// They are near from now on, until end_mixed at least. \pre the scene is as before the step
void join_mixed(World& w, std::span<const std::size_t> late);
void end_mixed(World& w);
void note_extents(const World& w, Extents& extents);
std::set<std::size_t> met_late(const World& w, Extents& before, Extents& after);
void join_late(World& w, const std::set<std::size_t>& objects);
std::vector<SurfaceMeeting> meetings_of(const World& w, std::span<const std::size_t> parts,
                                        std::span<const std::size_t> offset);
void move_meetings(World& w, std::size_t index, const Moves& moves);
/// Objects that may come to move as one with this one, by ties and meetings, itself among them.
std::vector<std::size_t> together(const World& w, std::size_t object);

// beside.cpp: elastostatic objects that may touch what moves
/// Those that are near to these, or to each other and these.
std::vector<std::size_t> near_beside(const World& w, std::span<const std::size_t> parts);
/// They stand beside the body from now on, as they are. \pre nothing stands beside it yet
void stand_beside(World& w, const std::shared_ptr<Body>& body, std::vector<std::size_t> objects);
/// Its objects, and those beside it: the order of nodes where both are one.
std::vector<std::size_t> all_of(const Body& body);
/// It stands beside none any more.
void leave_body(World& w, Object& object);
std::vector<SurfaceMeeting> meetings_of(const World& w, const Body& body);
/// Before a way of a body: wakes it where something else acts on them.
void wake_by_beside(const World& w, Body& body);
void begin_standing(World& w, Body& body, double to);
void end_standing(Body& body);
/// Whether its body has moved in this step.
inline bool has_stood(const Object& object) {
  return object.stood_under != nullptr;
}
void show_standing(World& w, Object& object);
/// What its body's steps meet it in, or move it. Null: none.
inline const Body* body_of(const Object& object) {
  return object.body != nullptr ? object.body.get() : object.beside.get();
}

// static_meetings.cpp: elastostatic objects whose surfaces touch
/// Whether all that it is of is elastostatic, and beside no body.
bool is_static(const World& w, const Meeting& m);
/// The groups by who is near now.
void regroup_statics(World& w);
/// Before objects are shown: those that are near become one group.
void group_statics(World& w);
StaticGroup* static_group_of(World& w, std::size_t object);
/// Whether both go on as one, in one body or one group.
bool as_one(const World& w, std::size_t object, std::size_t other);
/// Where its surface is as it is shown, at most.
const Box3& shown_box(World& w, std::size_t index);
void show_group(World& w, StaticGroup& group);
/// Of the surfaces of all its objects, as they are shown.
const Box3& group_box(World& w, StaticGroup& group);
/// What those need that may yet turn out to have come near each other: to go back to.
struct StaticsBefore {
  struct One {
    std::size_t object = 0;
    Shown shown; ///< without its shape
    CameFrom came;
    Box3 box;
  };
  std::vector<One> all;
  std::vector<std::optional<Pose>> poses;
};
StaticsBefore note_statics(World& w);
/// Behind the showing of all: those that were not near but have come, or passed each other, are
/// shown again as one. \return these
std::vector<std::size_t> show_late_groups(World& w, const StaticsBefore& before);

// time.cpp: steps through events; show.cpp: the picture at their end
void advance(World& w, double to);
void show(World& w, Object& object);
void begin_showing(World& w, Object& object);
void end_showing(World& w, Object& object);
/// What acts on it now will be shown.
void load_shown(const World& w, Object& object);
void warn_of_range(World& w, Object& object);
void shape(World& w, Object& object);
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
void drop_grips(World& w, std::size_t object, const std::vector<std::uint32_t>& nodes);
void note_poses(World& w, std::optional<std::size_t> jumps = {});
bool instruments_there(const World& w);
std::optional<Pose> pose_at(const World& w, std::size_t moment, std::size_t instrument);

// coupled.cpp: instruments that hands lead through a spring
void lead_on(World& w, double to, Extents& extents);
void follow_hands(World& w, double to);
bool gives_way_to(const World& w, const Instrument& instrument, const Object& object);
MovedInstrument led_here(const World& w, const Instrument& instrument, const MovedInstrument& way);
void settle(World& w, std::size_t instrument, std::span<Object* const> objects);
void end_leading(World& w);

// contact.cpp: whom they touch
void guide(World& w, Body& body, double to, Extents& extents);
void end_guiding(World& w, double to);
void take_touches(World& w, double duration);
void gather_impulses(World& w, Body& body);
bool touched_anew(World& w, Object& object);
bool passed_by_instruments(const World& w, const Box3& box, bool first);
void follow_instruments(World& w, Object& object, PartShown* part);
/// Instruments over a short part of their ways since the scene was shown.
struct ShortWay {
  std::vector<std::optional<MovedInstrument>> instruments;
  bool last = false;
};
/// \param objects some that one of them gives way to, maybe
std::vector<ShortWay> short_ways(const World& w, std::span<Object* const> objects);
/// Whether what acts on it beside contact is other than shown. \pre shown.load is that of now
bool acted_anew(const Object& object);
/// Behind an update of their contact.
void settle_led(World& w, std::span<Object* const> objects);
void tell_stuck(World& w, Object& object, const NodeTouch& stuck);
void warn_inexact(World& w, Object& object);
inline bool touched_by_instruments(const Object& object) {
  return std::ranges::any_of(object.shown.touches,
                             [](const NodeTouch& t) { return t.instrument != other_surface; });
}
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
