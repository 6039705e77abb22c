#include "scene/island_members_internal.h"

#include "geometry/vector_at.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace gewebe::scene {

namespace {

constexpr std::size_t most_parts = 256;
constexpr std::size_t kept_islands = 16;

/// Forces on vertices as forces on nodes, sorted by node and cause.
std::vector<contact::NodalContactForce>
nodal_forces(std::span<const contact::IslandMember::Force> forces,
             std::span<const std::uint32_t> node,
             std::span<const std::uint32_t> instrument_of_piece) {
  std::vector<contact::NodalContactForce> all;
  all.reserve(forces.size());
  for (const contact::IslandMember::Force& f : forces)
    all.push_back({node[f.vertex], instrument_of_piece[f.from], f.force});
  return contact::sums_of(std::move(all));
}

std::vector<contact::VertexForce>
vertex_sums(std::span<const contact::IslandMember::Force> forces) {
  std::vector<contact::VertexForce> all;
  for (const contact::IslandMember::Force& f : forces)
    if (!all.empty() && all.back().vertex == f.vertex)
      all.back().force += f.force;
    else
      all.push_back({f.vertex, f.force});
  return all;
}

} // namespace

std::vector<std::size_t> IslandParts::objects() const {
  std::vector<std::size_t> all = statics;
  for (const auto& body : bodies)
    all.insert(all.end(), body->parts.begin(), body->parts.end());
  std::ranges::sort(all);
  return all;
}

// ---- bodies

contact::ContactBody& BodyMember::begin(const contact::Interval& step, const Context& context) {
  return body_.moving->begin_contact_step(step, context);
}

/// Forces on the nodes of a part, by its own numbers.
std::vector<contact::NodalContactForce>
BodyMember::forces_on(const Object& part, std::span<const contact::NodalContactForce> all) const {
  std::vector<contact::NodalContactForce> own;
  for (contact::NodalContactForce f : all) {
    if (f.node < part.offset || f.node - part.offset >= part.model().nodes.size())
      continue;
    f.node -= static_cast<std::uint32_t>(part.offset);
    own.push_back(f);
  }
  return own;
}

void BodyMember::end(std::span<const Force> forces, const contact::Interval& step,
                     const Context& context) {
  const bool first = step.stage == numeric::Stage::first,
             second = step.stage == numeric::Stage::second;
  body_.moving->end_contact_step(vertex_sums(forces), clearing_, context);
  body_.taken += first ? 0 : 1;
  std::vector<contact::NodalContactForce> all =
      nodal_forces(forces, surface_.node, instrument_of_piece_);
  const double length = step.to - step.from;
  for (const std::size_t part : body_.parts) {
    Object& object = w_.now.objects[part];
    object.touching = forces_on(object, all);
    if (clearing_)
      continue;
    const auto add = [&](std::span<const contact::NodalContactForce> of, double h) {
      for (contact::NodalContactForce f : of) {
        f.force *= h;
        object.impulses.push_back(f);
      }
    };
    add(object.touching, second ? length / numeric::stage_extension : length);
    if (second) // so long the first stage's forces act, beside its own length
      add(forces_on(object, first_), length - length / numeric::stage_extension);
  }
  first_.clear();
  if (first)
    first_ = std::move(all);
}

// ---- elastostatic objects

contact::Load load_between(const contact::Load& from, const contact::Load& to,
                           std::span<const double> shape, double part) {
  if (part == 1)
    return to;
  contact::Load load = to;
  for (auto& [node, f] : load.force)
    f *= part;
  for (const auto& [node, f] : from.force)
    load.force[node] += (1 - part) * f;
  for (auto& [node, u] : load.displacement)
    if (3 * std::size_t{node} < shape.size()) {
      const Vec3 stood = vector_at(shape, node);
      u = stood + part * (u - stood);
    }
  for (auto& [node, p] : load.pressure)
    p.pressure *= part;
  for (const auto& [node, p] : from.pressure)
    load.pressure[node].pressure += (1 - part) * p.pressure;
  load.gravity = from.gravity + part * (to.gravity - from.gravity);
  return load;
}

StaticMember::StaticMember(World& w, std::size_t object, const contact::ModelSurface& surface,
                           const std::vector<std::uint32_t>& instrument_of_piece)
    : w_(w), object_(object), surface_(surface), instrument_of_piece_(instrument_of_piece) {}

std::vector<double> stood_shape(World& w, Object& object) {
  const std::span<const double> u = *object.shown.displacement;
  const bool inside = std::ranges::any_of(object.load->displacement, [&](const auto& entry) {
    return gewebe::axis_of(entry.first, 0) >= u.size();
  });
  const std::span<const double> shape = inside ? whole_shape_in_step(w, object) : u;
  return {shape.begin(), shape.end()};
}

void StaticMember::take_part(
    const statics::SurfacePatch& part, const contact::Load& begin,
    std::function<void(std::span<const contact::NodalContactForce>)> check) {
  part_ = Part{&part, &begin, std::move(check), {}};
}

void StaticMember::follow_load(double start, double end) {
  Object& object = w_.now.objects[object_];
  if (!object.load->force_period.empty() ||
      std::ranges::any_of(object.load->pressure, [](const auto& p) { return p.second.period > 0; }))
    return;
  way_ = Way{w_.now.clock.shown < start ? acting_at(object, start) : *object.shown.load,
             acting_at(object, end), stood_shape(w_, object), start, end};
}

contact::ContactBody& StaticMember::begin(const contact::Interval& step,
                                          const Context& /*context*/) {
  const double to = step.to;
  Object& object = w_.now.objects[object_];
  if (is_held_altogether(object)) {
    std::vector<Vec3> x;
    for (const std::uint32_t node : surface_.node)
      x.push_back(object.model().nodes[node].position);
    held_ = std::make_unique<contact::HeldBody>(x, x);
    return *held_;
  }
  if (way_)
    load_ = load_between(way_->from, way_->to, way_->stood,
                         (to - way_->start) / (way_->end - way_->start));
  else
    load_ = given_ ? *given_ : acting_at(object, to);
  std::vector<contact::VertexForce> last;
  for (const contact::NodalContactForce& f : object.touching) {
    const auto found = std::ranges::lower_bound(surface_.node, f.node);
    if (found == surface_.node.end() || *found != f.node)
      continue; // its wall of a cut is gone
    const auto vertex = static_cast<std::uint32_t>(found - surface_.node.begin());
    if (!last.empty() && last.back().vertex == vertex)
      last.back().force += f.force;
    else
      last.push_back({vertex, f.force});
  }
  if (has_law(object)) {
    contact::ContactBody* body = nullptr;
    at_object(w_, object, [&] {
      strained_ = &strained_of(w_, object);
      strained_->restore(object.strained);
      body = &strained_->begin_contact(load_, std::move(last),
                                       rest_time(w_, object, given_time_.value_or(to)));
    });
    return *body;
  }
  if (part_) {
    contact::Load begin = *part_->begin;
    for (const contact::NodalContactForce& f : object.touching)
      begin.force[f.node] += f.force;
    std::vector<contact::NodeVector> forces;
    for (const auto& [node, force] : begin.force)
      forces.push_back({node, force});
    const statics::SurfacePatch& part = *part_->part;
    part_->stood = solver_of(w_, object).displacement_of_clusters(part.clusters, forces);
    body_ = std::make_unique<statics::ElastostaticContactBody>(
        statics::StaticContactState{
            &object.model(), &surface_, &load_, part_->stood, part.place, std::move(last),
            [this, &object, &part](std::span<const double> u) {
              at_object(w_, object, [&] { require_bounded(object, u, part.node); });
            }},
        [this, &object]() -> statics::Elastostatic& { return solver_of(w_, object); },
        part.clusters);
    return *body_;
  }
  statics::StaticContactState state{&object.model(),
                                    &surface_,
                                    &load_,
                                    *object.shown.displacement,
                                    {},
                                    std::move(last),
                                    [this, &object](std::span<const double> u) {
                                      at_object(w_, object, [&] { require_bounded(object, u); });
                                    }};
  if (object.warp)
    body_ = std::make_unique<statics::WarpedContactBody>(
        std::move(state),
        [this, &object]() -> statics::WarpedStatics& { return warped_of(w_, object); });
  else if (object.stages.options)
    body_ = std::make_unique<statics::TwoStepContactBody>(
        std::move(state),
        [this, &object]() -> std::pair<statics::Elastostatic&, statics::TwoStep&> {
          statics::Elastostatic& solver = solver_of(w_, object);
          return {solver, two_step_of(w_, object)};
        });
  else
    body_ = std::make_unique<statics::ElastostaticContactBody>(
        std::move(state),
        [this, &object]() -> statics::Elastostatic& { return solver_of(w_, object); });
  return *body_;
}

void StaticMember::end(std::span<const Force> forces, const contact::Interval& /*step*/,
                       const Context& /*context*/) {
  Object& object = w_.now.objects[object_];
  std::vector<contact::NodalContactForce> touching =
      nodal_forces(forces, surface_.node, instrument_of_piece_);
  if (part_)
    part_->check(touching);
  object.touching = std::move(touching);
  if (held_)
    return;
  if (part_)
    return end_part();
  std::span<const double> u;
  if (strained_ != nullptr) {
    strained_->end_contact();
    object.strained = strained_->answer();
    u = strained_->displacement();
  } else {
    if (forces.empty() && body_->acting().force != load_.force)
      body_->move(0, {}); // without rounding of forces that have gone
    u = body_->displacement();
  }
  object.shown.displacement.replace().assign(u.begin(), u.end());
  object.shown.whole = {};
  object.shown.box.reset();
  if (object.statics.warped)
    object.warped = object.statics.warped->answer();
}

void StaticMember::end_part() {
  Shown& shown = w_.now.objects[object_].shown;
  shown.shaped = false;
  shown.whole = {};
  shown.box.reset();
  shown.touched.clear();
  for (std::uint32_t v = 0; v < surface_.node.size(); ++v) {
    const Vec3 u = body_->displacement_of(v);
    shown.largest = std::max({shown.largest, std::abs(u.x), std::abs(u.y), std::abs(u.z)});
  }
  for (const contact::NodalContactForce& f : w_.now.objects[object_].touching)
    shown.touched[f.node] = body_->displacement_of(static_cast<std::uint32_t>(
        std::ranges::lower_bound(surface_.node, f.node) - surface_.node.begin()));
}

// ---- instruments

contact::ContactBody& InstrumentMember::begin(const contact::Interval& step,
                                              const Context& /*context*/) {
  const Instrument& i = instrument();
  target_ = given_ ? *given_ : i.way.at(step.to);
  double compliance = 0;
  std::vector<contact::VertexForce> last;
  if (i.coupled) {
    hand_ = target_.place;
    Vec3 lag = i.coupled->lag;
    double duration = given_ ? duration_ : step.to - step.from;
    if (step.stage == numeric::Stage::second) {
      duration /= numeric::stage_extension;
      lag = lag_ + numeric::stage_extension * (lag - lag_);
    } else {
      lag_ = lag;
    }
    const contact::CouplingStep coupling(i.coupled->coupling, lag, duration);
    compliance = coupling.compliance;
    target_.place = hand_ - coupling.free;
    last.push_back({0, i.coupled->force});
  }
  body_ = std::make_unique<contact::InstrumentBody>(surface_.rest, now_, target_, compliance,
                                                    std::move(last));
  return *body_;
}

void InstrumentMember::end(std::span<const Force> forces, const contact::Interval& /*step*/,
                           const Context& /*context*/) {
  now_ = target_;
  Instrument& i = instrument();
  if (!i.coupled)
    return;
  Vec3 sum;
  for (const Force& f : forces)
    sum += f.force;
  now_.place += body_->displacement();
  i.coupled->force = sum;
  i.coupled->place = now_.place;
  i.coupled->lag = hand_ - now_.place;
}

// ---- islands

namespace {

/// Friction of each two pieces; below 0 they do not touch.
std::vector<double> friction_of(World& w, std::span<const std::optional<std::size_t>> object,
                                std::span<const std::uint32_t> instrument) {
  const std::size_t count = object.size();
  std::vector<double> all(count * count, -1);
  const auto set = [&](std::size_t a, std::size_t b, double value) {
    all[a * count + b] = all[b * count + a] = value;
  };
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      if (object[a] && object[b]) {
        for (const ContactRule& rule : w.now.contacts)
          if (std::minmax(rule.object, rule.other) == std::minmax(*object[a], *object[b]))
            set(a, b, rule.friction);
      } else if (object[a] || object[b]) {
        const std::uint32_t k = object[a] ? instrument[b] : instrument[a];
        const std::size_t of = object[a] ? *object[a] : *object[b];
        if (takes_instruments(w, w.now.objects[of]))
          set(a, b, w.now.instruments[k].shape.friction);
      }
    }
  return all;
}

/// What instruments of an island grasp, ascending.
std::vector<HeldNode> held_nodes(const World& w, const IslandParts& parts) {
  std::vector<HeldNode> all;
  for (const std::size_t k : parts.instruments)
    for (const Instrument::Grip& grip : w.now.instruments[k].grips)
      all.push_back({grip.object, grip.node, k});
  std::ranges::sort(all);
  return all;
}

/// Marks the vertices of a surface that instruments grasp.
/// \param offset  of the object's nodes in the surface's model
/// \param first_instrument  number of the surface of the island's first instrument
void hold_vertices(std::span<const HeldNode> held, std::size_t object, std::size_t offset,
                   std::span<const std::size_t> instruments, std::size_t first_instrument,
                   contact::ModelSurface& model) {
  for (const HeldNode& one : held) {
    if (one.object != object)
      continue;
    const auto at = std::ranges::lower_bound(model.node, one.node + offset);
    if (at == model.node.end() || *at != one.node + offset)
      continue;
    const auto k = std::ranges::find(instruments, one.instrument) - instruments.begin();
    model.surface.holder.resize(model.node.size(), collision::no_owner);
    model.surface.holder[static_cast<std::size_t>(at - model.node.begin())] =
        static_cast<std::uint32_t>(first_instrument + static_cast<std::size_t>(k));
  }
}

} // namespace

IslandCache& island_of(World& w, const IslandParts& parts) {
  std::vector<IslandCache::Key> keys;
  std::vector<std::optional<std::size_t>> object;
  std::vector<std::uint32_t> instrument;
  for (const auto& body : parts.bodies) {
    keys.push_back({body->model, body->parts.size(), {}});
    for (const std::size_t part : body->parts) {
      object.emplace_back(part);
      instrument.push_back(contact::other_surface);
    }
  }
  for (const std::size_t index : parts.statics) {
    keys.push_back({w.now.objects[index].matter->model, 1, {}});
    object.emplace_back(index);
    instrument.push_back(contact::other_surface);
  }
  for (const std::size_t k : parts.instruments) {
    keys.push_back({nullptr, 1, w.now.instruments[k].shape});
    object.emplace_back();
    instrument.push_back(static_cast<std::uint32_t>(k));
  }
  std::vector<double> friction = friction_of(w, object, instrument);
  std::vector<HeldNode> held = held_nodes(w, parts);
  const std::size_t first_instrument = object.size() - parts.instruments.size();
  std::uint64_t latest = 0;
  for (const auto& one : w.islands)
    latest = std::max(latest, one->used);
  for (const auto& one : w.islands)
    if (one->keys == keys && one->friction == friction && one->held == held &&
        one->instrument_of_piece == instrument) {
      one->used = latest + 1;
      return *one;
    }
  auto made = std::make_shared<IslandCache>();
  made->keys = std::move(keys);
  made->instrument_of_piece = instrument;
  std::vector<const contact::BodySurface*> surfaces;
  for (const auto& body : parts.bodies) {
    contact::ModelSurface& model = made->models.emplace_back(body->moving->collision_surface());
    model.surface.pieces = static_cast<std::uint32_t>(body->parts.size());
    for (const std::uint32_t node : model.node) {
      std::uint32_t piece = 0;
      while (piece + 1 < body->parts.size() && w.now.objects[body->parts[piece + 1]].offset <= node)
        ++piece;
      model.surface.piece.push_back(piece);
    }
    for (const std::size_t part : body->parts)
      hold_vertices(held, part, w.now.objects[part].offset, parts.instruments, first_instrument,
                    model);
    surfaces.push_back(&model.surface);
  }
  for (const std::size_t index : parts.statics) {
    contact::ModelSurface& model =
        made->models.emplace_back(contact::model_surface(w.now.objects[index].model()));
    hold_vertices(held, index, 0, parts.instruments, first_instrument, model);
    surfaces.push_back(&model.surface);
  }
  for (const std::size_t k : parts.instruments)
    surfaces.push_back(
        &made->surfaces.emplace_back(contact::instrument_surface(w.now.instruments[k].shape)));
  collision::OwnerTable<double> table(object.size(), -1);
  for (std::size_t a = 0; a < object.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b)
      table.set(a, b, friction[a * object.size() + b]);
  made->motion = std::make_unique<contact::IslandMotion>(surfaces, table);
  made->friction = std::move(friction);
  made->held = std::move(held);
  made->used = latest + 1;
  if (w.islands.size() >= kept_islands)
    w.islands.erase(
        std::ranges::min_element(w.islands, {}, [](const auto& one) { return one->used; }));
  w.islands.push_back(std::move(made));
  return *w.islands.back();
}

void make_members(World& w, const IslandParts& parts, const IslandCache& island,
                  std::span<const contact::Pose> start, IslandMembers& members) {
  std::size_t model = 0;
  for (const auto& body : parts.bodies)
    members.all.push_back(
        &members.bodies.emplace_back(w, *body, island.models[model++], island.instrument_of_piece));
  for (const std::size_t index : parts.statics)
    members.all.push_back(&members.statics.emplace_back(w, index, island.models[model++],
                                                        island.instrument_of_piece));
  for (std::size_t k = 0; k < parts.instruments.size(); ++k)
    members.all.push_back(
        &members.instruments.emplace_back(w, parts.instruments[k], island.surfaces[k], start[k]));
}

void fail_contact(const World& w, const IslandParts& parts, const Error& error) {
  std::string names;
  for (const std::size_t index : parts.objects())
    names += (names.empty() ? "" : " ") + w.now.objects[index].name();
  for (const std::size_t k : parts.instruments)
    names += " " + w.now.instruments[k].name;
  throw Error("contact of " + names + " at " + text::number_text(w.now.clock.time) +
              " s is not solved: " + error.what() +
              (dynamic_cast<const contact::IntersectsAtStart*>(&error) != nullptr
                   ? ", expected surfaces that stand apart"
                   : ", expected a smaller timestep or slower ways"));
}

void count_contact(World& w, const contact::StepReport& report) {
  w.now.counts.contact.add(report);
}

Box3 box_between(const contact::InstrumentShape& shape, const contact::Pose& from,
                 const contact::Pose& to) {
  Box3 box = contact::PlacedInstrument(shape, from).box();
  const Box3 there = contact::PlacedInstrument(shape, to).box();
  box.add(there.min);
  box.add(there.max);
  if (from.turn == to.turn)
    return box;
  const double reach = contact::reach_of(shape); // an end turns about the place
  box.min -= Vec3{reach, reach, reach};
  box.max += Vec3{reach, reach, reach};
  return box;
}

std::size_t parts_of_way(const contact::InstrumentShape& shape, const contact::Pose& from,
                         const contact::Pose& to) {
  const double parts = contact::path_length(shape, from, to) / (instrument_step * shape.radius);
  return parts > 1
             ? static_cast<std::size_t>(std::min(std::ceil(parts), static_cast<double>(most_parts)))
             : 1;
}

bool takes_instruments(World& w, Object& object) {
  need_model(object);
  return !object.model().triangles.empty() && feels(w, object, Feature::touch);
}

} // namespace gewebe::scene
