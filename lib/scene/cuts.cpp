// Cuts: what they sever when they take effect, what comes off, what it means for the methods.

#include "cutting/skin_parts.h"
#include "embedding/solid_place.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "linalg/condition.h"
#include "scene/rules_internal.h"
#include "update/cut_stiffness.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe::scene {

namespace {

constexpr double largest_turn = 0.1; ///< between two edges of a swept area, about its angle

/// Stiffness of an elastostatic object that is updated after cuts; null if no solution was needed
/// so far, or lately. The object after the cut takes it over.
const update::CutStiffness* stiffness_of(World& w, Object& object) {
  if (object.statics.stiffness || (!object.statics.made() && !has_moved(w, object)))
    return object.statics.stiffness.get();
  const std::shared_ptr<const model::Model> first =
      object.cut.first ? object.cut.first : object.matter->model;
  std::shared_ptr<compliance::ComplianceSource> source;
  if (object.matter->source.stiffness)
    source = object.matter->source.stiffness(*first);
  auto stiffness = std::make_shared<update::CutStiffness>(first, std::move(source), w.context);
  if (object.cut.first)
    (void)stiffness->cut(object.matter->model, *object.cut.first_nodes, *object.cut.places);
  object.statics.stiffness = std::move(stiffness);
  return object.statics.stiffness.get();
}

/// Of a cut model, from the object as it was before; nothing: K is factorised when it is needed.
/// Nodes of the object may be gone with a part (CutModel::place).
std::shared_ptr<compliance::ComplianceSource> cut_source(World& w, Object& object,
                                                         std::shared_ptr<const model::Model> next,
                                                         const cutting::CutModel& cut) {
  const update::CutStiffness* const before = stiffness_of(w, object);
  if (before == nullptr)
    return nullptr;
  try {
    auto stiffness = std::make_shared<update::CutStiffness>(*before);
    const update::CutWork work = stiffness->cut(std::move(next), cut.origin, cut.place);
    ++(work.way == update::CutWay::woodbury   ? w.now.counts.cut_woodbury
       : work.way == update::CutWay::refactor ? w.now.counts.cut_refactors
                                              : w.now.counts.cut_factors);
    w.now.counts.cut_unprepared += work.unprepared ? 1 : 0;
    object.statics.stiffness = stiffness;
    return stiffness->compliance();
  } catch (...) {
    object.statics.stiffness.reset();
    throw;
  }
}

/// Where all nodes of a cut object go.
Moves moves_of(const World& w, std::size_t index, const cutting::CutModel& cut,
               const cutting::FreeParts& free) {
  Moves moves;
  moves.objects = {index};
  for (std::size_t k = 0; k < free.parts.size(); ++k)
    moves.objects.push_back(w.now.objects.size() + k);
  std::vector<std::pair<std::uint32_t, Moves::To>> ways;
  ways.reserve(cut.origin.size());
  const auto add = [&](std::size_t object, std::uint32_t i, std::uint32_t c) {
    const std::uint32_t o = cut.origin[c];
    const auto at = std::ranges::lower_bound(cut.between, c, {}, &cutting::CutModel::Between::node);
    const bool between = at != cut.between.end() && at->node == c,
               fresh = between && cut.share[c] == 0;
    if (between)
      moves.between.push_back({object, i, fresh, at->of});
    if (!fresh)
      ways.push_back({o, {object, i, cut.share[c], cut.place[o] == c}});
  };
  const std::size_t stay = free.rest ? free.rest->origin.size() : cut.origin.size();
  for (std::uint32_t i = 0; i < stay; ++i)
    add(index, i, free.rest ? free.rest->origin[i] : i);
  for (std::size_t k = 0; k < free.parts.size(); ++k)
    for (std::uint32_t i = 0; i < free.parts[k].origin.size(); ++i)
      add(moves.objects[k + 1], i, free.parts[k].origin[i]);
  moves.add(ways, w.now.objects[index].model().nodes.size());
  return moves;
}

/// What cuts have made of the first model's nodes, with one more cut.
/// \param origin by node: what it was in the object before
CutState cut_again(const Object& old, std::vector<std::uint32_t> origin, const Moves& moves) {
  CutState next{.first = old.cut.first ? old.cut.first : old.matter->model,
                .tear = old.cut.tear,
                .limit = old.cut.limit};
  if (const std::vector<std::uint32_t>& before = *old.cut.first_nodes; !before.empty())
    for (std::uint32_t& o : origin)
      o = before[o];
  next.first_nodes = std::move(origin);
  std::vector<std::uint32_t> places(next.first->nodes.size(), cutting::CutModel::gone);
  for (std::uint32_t f = 0; f < places.size(); ++f) {
    const std::uint32_t before = old.cut.places->empty() ? f : (*old.cut.places)[f];
    if (before == cutting::CutModel::gone)
      continue;
    for (const Moves::To& to : moves.of(before))
      if (to.object == moves.objects[0] && (to.main || places[f] == cutting::CutModel::gone))
        places[f] = to.node;
  }
  next.places = std::move(places);
  return next;
}

/// Defers the shape: it will be computed from the shape before this cut when it is first read.
void defer_shape(const Object& old, const Moves& moves, Object& next) {
  auto shape = std::make_shared<DeferredShape>(
      old.shown.deferred ? *old.shown.deferred
                         : DeferredShape{old.matter->model, *old.shown.load, {}});
  shape->moves.push_back(std::make_shared<const Moves>(moves));
  next.shown.deferred = std::move(shape);
  next.shown.shaped = false;
}

} // namespace

/// Whether the object's model is known and can be cut. If it can't, a warning is issued once.
bool may_cut(World& w, Object& object, Feature feature) {
  const bool feels_it = feels(w, object, feature);
  return object.matter->known && feels_it;
}

/// \param cut of the object's model
void carry_out(World& w, std::size_t index, cutting::CutModel cut) {
  Object& old = w.now.objects[index];
  const bool ffe = old.method == Method::ffe;
  cutting::FreeParts free = cutting::free_parts(old.model(), cut);
  if (const cutting::SkinPartsReport skin = cutting::part_skin(cut.model, free);
      skin.torn > 0 && w.options.warn)
    w.options.warn("object " + old.name() + " at " + text::number_text(w.now.clock.time) +
                   " s: what comes off tears its skin along " + std::to_string(skin.torn) +
                   " edges that no cut has passed");
  // Parts and instruments need the shape before the cut. Without them it may never be read.
  const bool deferred = ffe && !old.shown.shaped && free.parts.empty() &&
                        w.now.instruments.empty() && old.matter->known && !old.stages.options &&
                        !old.warp && !has_law(old) && !old.meets;
  if (ffe && !deferred)
    (void)whole_shape_in_step(w, old);
  const Moves moves = moves_of(w, index, cut, free);
  std::vector<Vec3> velocity = old.came.velocity;
  if (!free.parts.empty()) // before the stiffness follows the cut
    velocity = shape_velocity(w, old, false);

  Cutting told{.kind = Cutting::Kind::cut,
               .object = index,
               .springs = cut.removed,
               .doubled = cut.doubled,
               .time = w.now.clock.time,
               .text = {}};
  cutting::CutModel rest = cutting::without_parts(std::move(cut), std::move(free.rest));
  const auto now = std::make_shared<const model::Model>(std::move(rest.model));
  std::shared_ptr<compliance::ComplianceSource> prepared;
  bool loose = !old.came.velocity.empty();
  if (ffe && !has_law(old)) {
    try {
      prepared = cut_source(w, old, now, rest);
    } catch (const linalg::SingularStiffness&) {
      prepared.reset(); // the solver reports it when the shape is needed
      loose = true;
      if (velocity.empty()) // the factor may have followed the cut
        velocity = shape_velocity(w, old, true);
    }
  }
  std::deque<Object> pieces;
  Object& next = pieces.emplace_back(renumbered(old, now));
  next.statics.stiffness = std::move(old.statics.stiffness);
  next.statics.prepared = std::move(prepared);
  follow_cut(w, old, rest.origin, next);
  next.cut = cut_again(old, rest.origin, moves);
  next.cut.scored = std::move(rest.left);
  next.cut.trails = old.cut.trails;
  if (deferred)
    defer_shape(old, moves, next);
  if (loose && !velocity.empty()) {
    next.came.velocity.resize(now->nodes.size());
    for (std::uint32_t i = 0; i < old.model().nodes.size(); ++i)
      for (const Moves::To& to : moves.of(i))
        if (to.object == index)
          next.came.velocity[to.node] = velocity[i];
    for (const Moves::Between& b : moves.between)
      if (b.object == index) {
        Vec3& at = next.came.velocity[b.node] = {};
        for (const auto& [node, share] : b.of)
          at += share * velocity[node];
      }
  }
  told.nodes = now->nodes.size();
  w.now.news.cuttings.push_back(told);
  for (std::size_t k = 0; k < free.parts.size(); ++k) {
    Object& part = pieces.emplace_back(
        renumbered(old, std::make_shared<const model::Model>(std::move(free.parts[k].model))));
    part.method = Method::ela;
    part.stages = {};
    part.warp = false;
    part.cut.trails = old.cut.trails;
    part.matter->source = {};
    w.now.news.cuttings.push_back({.kind = Cutting::Kind::part,
                                   .object = index,
                                   .part = moves.objects[k + 1],
                                   .nodes = part.model().nodes.size(),
                                   .time = w.now.clock.time,
                                   .text = {}});
  }
  ++w.now.counts.cuts;
  move_all(w, index, moves, std::move(pieces), velocity);
}

/// That the object will be cut, so that its first cut costs no more than others.
void announce_cut(World& w, std::size_t index) {
  Object& object = w.now.objects.at(index);
  if (object.method != Method::ffe || has_law(object) || gap_of(object, Feature::cut) != nullptr)
    return;
  try {
    if (const update::CutStiffness* const before = stiffness_of(w, object); before != nullptr) {
      auto stiffness = std::make_shared<update::CutStiffness>(*before);
      stiffness->prepare();
      object.statics.stiffness = std::move(stiffness);
    }
  } catch (const Cancelled&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (...) { // a source may throw anything; it throws again where its result is needed
    object.statics.stiffness.reset();
  }
}

/// Of an object that was cut before its shape was known.
void find_deferred_shape(World& w, Object& object) {
  const std::shared_ptr<const DeferredShape> held = object.shown.deferred;
  const DeferredShape& deferred = *held;
  statics::Elastostatic solver(*deferred.model, nullptr, w.context);
  solver.update(deferred.load);
  const std::span<const double> first = solver.displacement();
  std::vector<double> shape(first.begin(), first.end());
  for (const auto& moves : deferred.moves)
    shape = moved_field(*moves, moves->objects[0], shape);
  require_bounded(object, shape);
  object.shown.displacement = std::move(shape);
  object.shown.deferred.reset();
  object.shown.shaped = true;
}

// ---- blades

namespace {

/// What blades passed since the last step, in pieces that are nearly flat.
std::vector<BladeArea> swept_areas(World& w) {
  std::vector<BladeArea> areas;
  for (std::size_t n = 0; n < w.now.instruments.size(); ++n) {
    Instrument& i = w.now.instruments[n];
    if (!i.present || !i.shape.blade)
      continue;
    for (std::size_t k = 1; k < i.path.size(); ++k) {
      const contact::Pose &from = i.path[k - 1], &to = i.path[k];
      const double turn = norm(contact::rotated(from.turn, i.shape.axis) -
                               contact::rotated(to.turn, i.shape.axis)) /
                          std::max(norm(i.shape.axis), 1e-300);
      const auto parts =
          static_cast<std::size_t>(std::clamp(std::ceil(turn / largest_turn), 1.0, 64.0));
      contact::Pose last = from;
      for (std::size_t p = 1; p <= parts; ++p) {
        const contact::Pose next =
            contact::between(from, to, static_cast<double>(p) / static_cast<double>(parts));
        areas.push_back({n, {last.place, last(i.shape.axis), next(i.shape.axis), next.place}});
        last = next;
      }
    }
    if (i.path.size() > 1)
      i.path.erase(i.path.begin(), i.path.end() - 1);
  }
  return areas;
}

} // namespace

void sweep_blades(World& w) {
  const std::vector<BladeArea> areas = swept_areas(w);
  if (areas.empty())
    return;
  std::vector<cutting::SweptQuad> quads;
  for (const BladeArea& area : areas)
    quads.push_back(area.corners);
  const std::uint64_t cuts = w.now.counts.cuts;
  const std::size_t count = w.now.objects.size();
  for (std::size_t index = 0; index < count; ++index) {
    Object& object = w.now.objects[index];
    need_model(object);
    if (is_solid(object)) {
      sweep_solid(w, index, areas);
      continue;
    }
    if (object.method == Method::ffe)
      shape_in_step(w, object);
    std::vector<double> moved;
    std::span<const double> shape = *object.shown.displacement;
    if (object.body != nullptr) {
      for (const dynamics::NodeMotion& m : motion_of(object))
        moved.insert(moved.end(), {m.displacement.x, m.displacement.y, m.displacement.z});
      shape = moved;
    }
    const cutting::Cut swept = cutting::swept_cut(object.model(), shape, quads);
    if ((swept.empty() && swept.sides.empty()) || !may_cut(w, object, Feature::blade))
      continue;
    of_object(object.name() + " at " + text::number_text(w.now.clock.time) + " s", [&] {
      cutting::CutModel cut =
          cutting::cut_model(object.model(), cutting::merged(swept, object.cut.scored));
      if (cut.changed()) {
        carry_out(w, index, std::move(cut));
        return;
      }
      object.cut.scored = std::move(cut.left);
    });
  }
  if (w.now.counts.cuts != cuts)
    advance_bodies(w, w.now.clock.time); // that new bodies know their loads
}

// ---- what hangs together but can move freely

namespace {

/// That what displaces an object with a singular stiffness holds it. \throw SingularStiffness
void require_held(World& w, Object& object) {
  try {
    update_solver(w, object, acting_at(object, w.now.clock.time));
  } catch (const Cancelled&) {
    throw;
  } catch (const linalg::SingularStiffness&) {
    throw;
  } catch (const Error& error) { // of the factor with these nodes held
    throw linalg::SingularStiffness(error.what());
  }
}

} // namespace

/// Makes an elastostatic object elastodynamic if cuts have left it free to move: it has no static
/// shape then.
void find_free_motion(World& w, std::size_t index) {
  Object& object = w.now.objects[index];
  const Statics& statics = object.statics;
  if (!object.cut.first || object.method != Method::ffe ||
      (statics.made() && !(statics.solver && statics.solver->is_free())) ||
      (object.load->empty() && !instruments_there(w)))
    return;
  try {
    if (has_law(object))
      strained_of(w, object).prepare(acting_at(object, w.now.clock.time));
    else if (object.warp)
      (void)warped_of(w, object);
    else if (solver_of(w, object).is_free())
      require_held(w, object);
    return;
  } catch (const linalg::SingularStiffness& error) {
    w.now.news.cuttings.push_back({.kind = Cutting::Kind::loose,
                                   .object = index,
                                   .nodes = object.model().nodes.size(),
                                   .time = w.now.clock.time,
                                   .text = error.what()});
  }
  if (w.options.warn)
    w.options.warn("object " + object.name() + " at " + text::number_text(w.now.clock.time) +
                   " s: it goes on elastodynamic, for behind the cut " +
                   w.now.news.cuttings.back().text);
  if (object.shown.deferred)
    shape_in_step(w, object);
  Motions motions;
  std::vector<dynamics::NodeMotion>& motion = motions[index];
  motion.resize(object.model().nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i) {
    motion[i].displacement = vector_at(*object.shown.displacement, i);
    if (!object.came.velocity.empty())
      motion[i].velocity = object.came.velocity[i];
  }
  object.method = Method::ela;
  object.shown.valid = false;
  renew_bodies(w, motions);
  advance_bodies(w, w.now.clock.time);
}

// ---- changes

void Rule<CutObject>::apply(World& w, const CutObject& c) {
  Object& object = w.now.objects.at(c.object);
  need_model(object);
  require_support(w, object, Feature::cut);
  cutting::CutModel cut = of_object(object.name(), [&] {
    if (is_solid(object)) {
      const auto* const plane = std::get_if<PlaneToCut>(&c.what);
      if (plane == nullptr)
        throw Error("it has tetrahedra and no springs, expected a plane to cut it, or a blade");
      return plane_through(w, c.object, *plane);
    }
    cutting::Cut what;
    if (const auto* const springs = std::get_if<SpringsToCut>(&c.what)) {
      what = cutting::springs_between(object.model(), springs->from, springs->to);
    } else {
      const auto& plane = std::get<PlaneToCut>(c.what);
      if (plane.along_faces)
        throw Error("it has no tetrahedra, expected a solid for along=faces");
      what = cutting::plane_cut(object.model(), plane.plane,
                                plane.nodes ? std::span<const std::uint32_t>(*plane.nodes)
                                            : std::span<const std::uint32_t>());
    }
    cutting::CutModel result =
        cutting::cut_model(object.model(), cutting::merged(what, object.cut.scored));
    if (!result.changed())
      throw Error("nothing comes apart, expected edges that meet, or springs without a triangle");
    cutting::require_held(object.model(), result);
    return result;
  });
  carry_out(w, c.object, std::move(cut));
}

void Rule<CutObject>::log(const World&, const CutObject& c, ChangeRow& row) {
  row.what = "cut";
  if (const auto* const springs = std::get_if<SpringsToCut>(&c.what)) {
    row.nodes = springs->from;
    row.others = springs->to;
    row.text = "springs";
    return;
  }
  const auto& plane = std::get<PlaneToCut>(c.what);
  row.nodes = plane.nodes.value_or(std::vector<std::uint32_t>{});
  row.vector = plane.plane.point;
  const Vec3& n = plane.plane.normal;
  row.text = "plane " + text::number_text(n.x) + " " + text::number_text(n.y) + " " +
             text::number_text(n.z) + (plane.along_faces ? " along=faces" : "");
}

namespace {

/// Where nodes of a solid as it came stand that have been moved since, in what is left of it.
std::vector<Moves::Between> back_between(const Object& old, std::size_t index) {
  constexpr double there = 1e-9; // of an element's size: what of it is still there
  const model::Model &first = *old.cut.first, &now = old.model();
  std::vector<Moves::Between> between;
  std::optional<tetrahedra::TetMesh> mesh;
  for (std::uint32_t f = 0; f < first.nodes.size(); ++f) {
    const std::uint32_t i = (*old.cut.places)[f];
    const Vec3& place = first.nodes[f].position;
    if (i == cutting::CutModel::gone || now.nodes[i].position == place)
      continue;
    if (!mesh)
      mesh = fem::element_mesh(now);
    const embedding::SolidPlace found = embedding::find_place(*mesh, place);
    if (!(found.outside <= there * norm(now.nodes[i].position - place)))
      continue;
    Moves::Between b{index, f, false, {}};
    for (std::size_t k = 0; k < found.count; ++k)
      if (found.weight[k] != 0)
        b.of.emplace_back(found.node[k], found.weight[k]);
    between.push_back(std::move(b));
  }
  return between;
}

} // namespace

void Rule<Restore>::apply(World& w, const Restore& c) {
  Object& old = w.now.objects.at(c.object);
  require_support(w, old, Feature::restore);
  if (old.method == Method::ffe)
    (void)whole_shape_in_step(w, old);
  Moves moves;
  moves.objects = {c.object};
  std::vector<std::pair<std::uint32_t, Moves::To>> ways;
  const std::vector<std::uint32_t>& first_nodes = *old.cut.first_nodes;
  for (std::uint32_t i = 0; i < first_nodes.size(); ++i) {
    const std::uint32_t to = first_nodes[i];
    ways.push_back({i, {c.object, to, 1, (*old.cut.places)[to] == i}});
  }
  moves.add(ways, old.model().nodes.size());
  if (is_solid(old))
    moves.between = back_between(old, c.object);
  std::deque<Object> pieces;
  pieces.push_back(renumbered(old, old.cut.first));
  make_whole(w, pieces[0]);
  w.now.news.cuttings.push_back({.kind = Cutting::Kind::restored,
                                 .object = c.object,
                                 .nodes = old.cut.first->nodes.size(),
                                 .time = w.now.clock.time,
                                 .text = {}});
  move_all(w, c.object, moves, std::move(pieces));
  for (const ContactRule& rule : w.now.contacts) // parts that came off may be where it is whole
    if (rule.object == c.object || rule.other == c.object)
      require_apart(w, rule);
  let_instruments_enter(w);
}

} // namespace gewebe::scene
