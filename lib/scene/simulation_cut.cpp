// Cuts: what they sever when they take effect, what comes off, what it means for the methods.

#include "compliance/cut_stiffness.h"
#include "scene/simulation_internal.h"
#include "solve/condition.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe {

using simulation::number_text;

namespace {

constexpr double largest_turn = 0.1; ///< between two edges of a swept area, about its angle

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

} // namespace

/// The stiffness of an elastostatic object, to follow its cuts; nothing: no solution was asked of
/// it so far, or lately. It goes over to the next object, and is made anew where a cut is taken
/// back.
CutStiffness* Simulation::stiffness_of(Object& object) const {
  if (object.stiffness || (!object.still && !has_moved(object)))
    return object.stiffness.get();
  if (undo_->open)
    undo_->updated.insert(&object);
  const std::shared_ptr<const Model> first = object.first ? object.first : object.held;
  StiffnessParts parts;
  if (object.source.stiffness)
    parts = object.source.stiffness(*first);
  auto stiffness = std::make_unique<CutStiffness>(first, std::move(parts.columns), context_);
  if (object.first)
    (void)stiffness->cut(object.held, object.first_nodes, object.places);
  object.stiffness = std::move(stiffness);
  return object.stiffness.get();
}

/// That the object will be cut, so that its first cut costs no more than others.
void Simulation::announce_cut(std::size_t index) {
  Object& object = *objects_.at(index);
  if (object.method != Method::ffe || object.stages)
    return;
  try {
    if (CutStiffness* const stiffness = stiffness_of(object); stiffness != nullptr)
      stiffness->prepare();
  } catch (const Cancelled&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (...) { // whatever a source throws: told where it is needed
    object.stiffness.reset();
  }
}

void Simulation::announce_cuts(const Change& change) {
  if (const auto* const cut = std::get_if<CutObject>(&change))
    announce_cut(cut->object);
  else if (const auto* const tearing = std::get_if<SetTear>(&change))
    announce_cut(tearing->object);
  else if (const auto* const set = std::get_if<SetInstrument>(&change);
           set != nullptr && set->shape.blade)
    for (std::size_t i = 0; i < objects_.size(); ++i)
      announce_cut(i);
}

/// Of a cut model, from the object as it was before; nothing: K is factorised when it is needed.
/// Nodes of the object may be gone with a part (CutModel::place).
std::optional<StiffnessParts>
Simulation::cut_parts(Object& object, std::shared_ptr<const Model> next, const CutModel& cut) {
  CutStiffness* const stiffness = stiffness_of(object);
  if (stiffness == nullptr)
    return std::nullopt;
  try {
    const CutWork work = stiffness->cut(std::move(next), cut.origin, cut.place);
    ++(work.way == CutWay::correction ? counts_.cut_corrections
       : work.way == CutWay::renewal  ? counts_.cut_renewals
                                      : counts_.cut_factors);
    return stiffness->parts();
  } catch (...) {
    object.stiffness.reset();
    throw;
  }
}

/// Whether it is known and of one stage; who says otherwise is warned once.
bool Simulation::may_cut(Object& object) {
  if (object.stages && !object.warned_cut && options_.warn) {
    object.warned_cut = true;
    options_.warn("object " + object.name + " follows two steps of stiffness: it is not cut");
  }
  return object.known && !object.stages;
}

void Simulation::cut_now(const CutObject& change) {
  Object& object = *objects_.at(change.object);
  need_model(object);
  if (object.stages)
    throw Error("object " + object.name +
                " follows two steps of stiffness, expected one without two-step");
  CutModel cut = of_object(object.name, [&] {
    Cut what;
    if (const auto* const springs = std::get_if<SpringsToCut>(&change.what)) {
      what = springs_between(object.model, springs->from, springs->to);
    } else {
      const auto& plane = std::get<PlaneToCut>(change.what);
      what = plane_cut(object.model, plane.plane,
                       plane.nodes ? std::span<const std::uint32_t>(*plane.nodes)
                                   : std::span<const std::uint32_t>());
    }
    CutModel result = cut_model(object.model, merged(what, object.scored));
    if (!result.changed())
      throw Error("nothing comes apart, expected edges that meet, or springs without a triangle");
    require_held(object.model, result);
    return result;
  });
  carry_out(change.object, std::move(cut));
}

/// \param cut of the object's model
void Simulation::carry_out(std::size_t index, CutModel cut) {
  Object& old = *objects_[index];
  FreeParts free = free_parts(old.model, cut);
  // Where parts start, and what instruments refer to. Without them it may never be asked for.
  const bool late = old.method == Method::ffe && !old.shaped && free.parts.empty() &&
                    instruments_.empty() && old.known && !old.stages;
  if (old.method == Method::ffe && !late)
    shape_in_step(old);
  Moves moves;
  moves.objects = {index};
  for (std::size_t k = 0; k < free.parts.size(); ++k)
    moves.objects.push_back(objects_.size() + k);
  std::vector<std::pair<std::uint32_t, Moves::To>> ways;
  ways.reserve(cut.origin.size());
  const auto add = [&](std::size_t object, std::uint32_t i, std::uint32_t c) {
    const std::uint32_t o = cut.origin[c];
    ways.push_back({o, {object, i, cut.share[c], cut.place[o] == c}});
  };
  const std::size_t stay = free.rest ? free.rest->origin.size() : cut.origin.size();
  for (std::uint32_t i = 0; i < stay; ++i)
    add(index, i, free.rest ? free.rest->origin[i] : i);
  for (std::size_t k = 0; k < free.parts.size(); ++k)
    for (std::uint32_t i = 0; i < free.parts[k].origin.size(); ++i)
      add(moves.objects[k + 1], i, free.parts[k].origin[i]);
  moves.add(ways, old.model.nodes.size());

  std::vector<Vec3> velocity = old.came.velocity;
  if (!free.parts.empty()) // before the stiffness follows the cut
    velocity = shape_velocity(old, false);

  const std::size_t removed = cut.removed, doubled = cut.doubled;
  CutModel rest = without_parts(std::move(cut), std::move(free.rest));
  const auto now = std::make_shared<Model>(std::move(rest.model));
  std::optional<StiffnessParts> prepared;
  bool loose = !old.came.velocity.empty();
  if (old.method == Method::ffe) {
    if (undo_->open && (old.still || old.stiffness))
      undo_->updated.insert(&old);
    try {
      prepared = cut_parts(old, now, rest);
    } catch (const SingularStiffness&) {
      prepared.reset(); // found when the shape is asked for
      loose = true;
      if (velocity.empty()) // the factor may have followed the cut
        velocity = shape_velocity(old, true);
    }
  }
  std::vector<std::unique_ptr<Object>> pieces;
  Object& next = *pieces.emplace_back(renumbered(old, now));
  next.stiffness = std::move(old.stiffness);
  next.first = old.first ? old.first : old.held;
  next.prepared = std::move(prepared);
  if (late) {
    auto shape = std::make_shared<Object::LateShape>();
    if (old.late)
      *shape = *old.late;
    else
      *shape = {old.held, old.shown_load, {}};
    shape->moves.push_back(std::make_shared<const Moves>(moves));
    next.late = std::move(shape);
    next.shaped = false;
  }
  next.scored = std::move(rest.left);
  if (loose && !velocity.empty()) {
    next.came.velocity.resize(next.model.nodes.size());
    for (std::uint32_t i = 0; i < old.model.nodes.size(); ++i)
      for (const Moves::To& to : moves.of(i))
        if (to.object == index)
          next.came.velocity[to.node] = velocity[i];
  }
  next.first_nodes.reserve(rest.origin.size());
  for (const std::uint32_t o : rest.origin)
    next.first_nodes.push_back(old.first_nodes.empty() ? o : old.first_nodes[o]);
  next.places.assign(next.first->nodes.size(), CutModel::gone);
  for (std::uint32_t f = 0; f < next.places.size(); ++f) {
    const std::uint32_t before = old.places.empty() ? f : old.places[f];
    if (before == CutModel::gone)
      continue;
    for (const Moves::To& to : moves.of(before))
      if (to.object == index && (to.main || next.places[f] == CutModel::gone))
        next.places[f] = to.node;
  }
  cuttings_.push_back({.kind = Cutting::Kind::cut,
                       .object = index,
                       .springs = removed,
                       .doubled = doubled,
                       .nodes = next.model.nodes.size(),
                       .time = time_,
                       .text = {}});
  for (std::size_t k = 0; k < free.parts.size(); ++k) {
    auto part = renumbered(old, std::make_shared<Model>(std::move(free.parts[k].model)));
    part->method = Method::ela;
    part->source = {};
    part->first_nodes.clear();
    cuttings_.push_back({.kind = Cutting::Kind::part,
                         .object = index,
                         .part = moves.objects[k + 1],
                         .nodes = part->model.nodes.size(),
                         .time = time_,
                         .text = {}});
    pieces.push_back(std::move(part));
  }
  ++counts_.cuts;
  move_all(index, moves, std::move(pieces), velocity);
}

/// Of an object that was cut before its shape was known.
void Simulation::find_late_shape(Object& object) const {
  const Object::LateShape& late = *object.late;
  Elastostatic still(*late.model, StiffnessParts{}, context_);
  still.update(late.load);
  const std::span<const double> first = still.displacement();
  std::vector<double> shape(first.begin(), first.end());
  for (const auto& moves : late.moves) {
    std::size_t nodes = 0;
    for (const Moves::To& to : moves->all)
      if (to.object == moves->objects[0])
        nodes = std::max<std::size_t>(nodes, to.node + std::size_t{1});
    std::vector<double> moved(3 * nodes, 0.0);
    for (std::uint32_t i = 0; i < shape.size() / 3; ++i)
      for (const Moves::To& to : moves->of(i))
        if (to.object == moves->objects[0])
          std::copy_n(shape.begin() + 3 * static_cast<std::ptrdiff_t>(i), 3,
                      moved.begin() + 3 * static_cast<std::ptrdiff_t>(to.node));
    shape = std::move(moved);
  }
  require_bounded(object, shape);
  object.displacement = std::move(shape);
  object.late.reset();
  object.shaped = true;
}

void Simulation::restore_now(std::size_t index) {
  Object& old = *objects_.at(index);
  if (!old.first)
    throw Error("object " + old.name + " is as it came, expected one that was cut");
  if (old.method == Method::ffe)
    shape_in_step(old);
  Moves moves;
  moves.objects = {index};
  std::vector<std::pair<std::uint32_t, Moves::To>> ways;
  for (std::uint32_t i = 0; i < old.first_nodes.size(); ++i) {
    const std::uint32_t to = old.first_nodes[i];
    ways.push_back({i, {index, to, 1, old.places[to] == i}});
  }
  moves.add(ways, old.model.nodes.size());
  std::vector<std::unique_ptr<Object>> pieces;
  pieces.push_back(renumbered(old, old.first));
  cuttings_.push_back({.kind = Cutting::Kind::restored,
                       .object = index,
                       .nodes = old.first->nodes.size(),
                       .time = time_,
                       .text = {}});
  move_all(index, moves, std::move(pieces));
}

// ---- blades

/// What blades passed since the last step, in pieces that are nearly flat.
std::vector<SweptQuad> Simulation::swept_areas() {
  std::vector<SweptQuad> areas;
  for (const auto& i : instruments_) {
    if (!i->present || !i->shape.blade)
      continue;
    for (std::size_t k = 1; k < i->path.size(); ++k) {
      const Pose &from = i->path[k - 1], &to = i->path[k];
      const double turn = norm(turned(from.turn, i->shape.axis) - turned(to.turn, i->shape.axis)) /
                          std::max(norm(i->shape.axis), 1e-300);
      const auto parts =
          static_cast<std::size_t>(std::clamp(std::ceil(turn / largest_turn), 1.0, 64.0));
      Pose last = from;
      for (std::size_t p = 1; p <= parts; ++p) {
        const Pose next = between(from, to, static_cast<double>(p) / static_cast<double>(parts));
        areas.push_back({last.place, last(i->shape.axis), next(i->shape.axis), next.place});
        last = next;
      }
    }
    if (i->path.size() > 1)
      i->path.erase(i->path.begin(), i->path.end() - 1);
  }
  return areas;
}

void Simulation::sweep_blades() {
  const std::vector<SweptQuad> areas = swept_areas();
  if (areas.empty())
    return;
  const std::uint64_t cuts = counts_.cuts;
  const std::size_t count = objects_.size();
  for (std::size_t index = 0; index < count; ++index) {
    Object& object = *objects_[index];
    need_model(object);
    if (object.method == Method::ffe)
      shape_in_step(object);
    std::vector<double> moved;
    std::span<const double> shape = object.displacement;
    if (object.body != nullptr) {
      for (const NodeMotion& m :
           object.body->moving->motion().subspan(object.offset, object.model.nodes.size()))
        moved.insert(moved.end(), {m.displacement.x, m.displacement.y, m.displacement.z});
      shape = moved;
    }
    const Cut swept = swept_cut(object.model, shape, areas);
    if ((swept.empty() && swept.sides.empty()) || !may_cut(object))
      continue;
    of_object(object.name + " at " + number_text(time_) + " s", [&] {
      CutModel cut = cut_model(object.model, merged(swept, object.scored));
      if (cut.changed()) {
        carry_out(index, std::move(cut));
        return;
      }
      undo_->note([&object, scored = object.scored] { object.scored = scored; });
      object.scored = std::move(cut.left);
    });
  }
  if (counts_.cuts != cuts)
    move_bodies(time_); // that new bodies know their loads
}

// ---- tearing

void Simulation::tear() {
  const std::size_t count = objects_.size();
  for (std::size_t index = 0; index < count; ++index) {
    Object& object = *objects_[index];
    if (!(object.tear > 0) || !may_cut(object))
      continue;
    shape_in_step(object);
    const Cut torn = torn_cut(object.model, object.displacement, object.tear);
    if (torn.empty())
      continue;
    of_object(object.name + " at " + number_text(time_) + " s", [&] {
      CutModel cut = cut_model(object.model, merged(torn, object.scored));
      if (cut.changed())
        carry_out(index, std::move(cut));
    });
  }
}

// ---- what hangs together but can move freely

/// A cut object that an elastostatic shape is asked of may have none: then it goes on
/// elastodynamic.
void Simulation::find_free_motion(std::size_t index) {
  Object& object = *objects_[index];
  if (!object.first || object.method != Method::ffe || object.still ||
      (object.load.empty() && !instruments_there()))
    return;
  try {
    (void)still_of(object);
    return;
  } catch (const SingularStiffness& error) {
    cuttings_.push_back({.kind = Cutting::Kind::loose,
                         .object = index,
                         .nodes = object.model.nodes.size(),
                         .time = time_,
                         .text = error.what()});
  }
  if (options_.warn)
    options_.warn("object " + object.name + " at " + number_text(time_) +
                  " s: it goes on elastodynamic, for behind the cut " + cuttings_.back().text);
  if (object.late)
    shape_in_step(object);
  undo_->note([&object, shown = object.shown] {
    object.method = Method::ffe;
    object.shown = shown;
  });
  const auto contact = std::make_shared<std::unique_ptr<StaticContact>>(std::move(object.contact));
  undo_->note([&object, contact] { object.contact = std::move(*contact); });
  Motions motions;
  std::vector<NodeMotion>& motion = motions[index];
  motion.resize(object.model.nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i) {
    motion[i].displacement = {object.displacement[3 * i], object.displacement[3 * i + 1],
                              object.displacement[3 * i + 2]};
    if (!object.came.velocity.empty())
      motion[i].velocity = object.came.velocity[i];
  }
  object.method = Method::ela;
  object.shown = false;
  renew_bodies({index}, motions);
  move_bodies(time_);
}

} // namespace gewebe
