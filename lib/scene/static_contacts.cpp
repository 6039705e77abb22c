// Contact of elastostatic objects with each other, with themselves and with instruments: at the end
// of a step of the scene the objects that may touch stand where their loads and contact balance.
// Friction counts from where they stood.

#include "base/disjoint_sets.h"
#include "collision/distance.h"
#include "geometry/vector_at.h"
#include "scene/island_members_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

namespace gewebe::scene {

namespace {

constexpr double near_part = 0.01; ///< of an object's size: so near an instrument takes part
constexpr int max_halvings = 8;    ///< of a part of a way

bool is_static(const Object& object) {
  return object.method == Method::ffe && !object.in_motion;
}

/// Whether an object in this box has something to do with an instrument.
bool near_instrument(const World& w, const Box3& box, std::size_t k) {
  const contact::InstrumentShape& shape = w.now.instruments[k].shape;
  const double margin = near_part * box.longest_side();
  for (std::size_t p = 0; p < w.now.poses.size(); ++p) {
    const std::optional<contact::Pose> now = pose_at(w, p, k);
    if (!now)
      continue;
    const contact::Pose before = p > 0 ? pose_at(w, p - 1, k).value_or(*now) : *now;
    if (contact::near(box_between(shape, before, *now), box, margin))
      return true;
  }
  const Instrument& i = w.now.instruments[k];
  return i.present && !i.shape.blade && i.coupled &&
         contact::near(box_between(shape, {i.coupled->place, i.way.at(w.now.clock.time).turn},
                                   i.way.at(w.now.clock.time)),
                       box, margin);
}

/// Objects whose shapes are found together.
struct Group {
  IslandParts parts;
  bool moves = false; ///< an instrument of it moves, comes or goes
};

bool instrument_moves(const World& w, std::size_t k) {
  for (std::size_t p = 1; p < w.now.poses.size(); ++p)
    if (pose_at(w, p, k) != pose_at(w, p - 1, k))
      return true;
  const Instrument& i = w.now.instruments[k];
  if (!i.coupled || !i.present)
    return false;
  const Instrument::Coupled& c = *i.coupled;
  const contact::CouplingStep step(c.coupling, c.lag, w.now.clock.time - w.now.clock.shown);
  return !(norm(i.way.at(w.now.clock.time).place - step.lag(c.force) - c.place) <=
           contact::led_to_rest * i.shape.radius);
}

bool touched_by(const Object& object, std::size_t instrument) {
  return std::ranges::any_of(object.touching, [&](const contact::NodalContactForce& f) {
    return f.instrument == instrument;
  });
}

using ObjectPair = std::pair<std::size_t, std::size_t>;
/// An object and an instrument.
using ToolPair = std::pair<std::size_t, std::size_t>;

/// Pairs of surfaces that may touch.
struct Pairs {
  std::set<ObjectPair> objects;
  std::set<ToolPair> tools;

  bool empty() const { return objects.empty() && tools.empty(); }
};

/// Whether two objects, or one and itself, may touch where nothing moves far.
bool are_near(World& w, const ObjectPair& pair) {
  if (pair.first == pair.second)
    return true;
  const Box3 &one = shown_box(w, pair.first), &other = shown_box(w, pair.second);
  return contact::near(one, other, near_part * std::min(one.longest_side(), other.longest_side()));
}

/// \param late  pairs that count as near \param apart  becomes those that are not near
std::vector<Group> groups_of(World& w, const Pairs& late, Pairs& apart) {
  const std::size_t objects = w.now.objects.size(), instruments = w.now.instruments.size();
  DisjointSets sets(objects + instruments);
  const auto join = [&](std::size_t a, std::size_t b) {
    sets.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
  };
  std::vector<std::uint8_t> takes_part(objects);
  for (const ContactRule& rule : w.now.contacts)
    if (is_static(w.now.objects[rule.object]) && is_static(w.now.objects[rule.other])) {
      const ObjectPair pair(rule.object, rule.other);
      if (late.objects.contains(pair) || are_near(w, pair))
        join(rule.object, rule.other);
      else
        apart.objects.insert(pair);
      takes_part[rule.object] = takes_part[rule.other] = 1;
    }
  std::vector<std::pair<std::size_t, std::size_t>> near; // object, instrument
  for (std::size_t o = 0; o < objects; ++o) {
    Object& object = w.now.objects[o];
    if (!is_static(object) || w.now.instruments.empty())
      continue;
    if (object.touching.empty() && !instruments_there(w))
      continue;
    if (!takes_instruments(w, object))
      continue;
    const Box3 box = contact_box(w, o);
    for (std::size_t k = 0; k < instruments; ++k) {
      const Instrument& i = w.now.instruments[k];
      if (i.shape.blade)
        continue;
      if (!touched_by(object, k) && !late.tools.contains({o, k}) && !near_instrument(w, box, k)) {
        if (i.present)
          apart.tools.insert({o, k});
        continue;
      }
      near.emplace_back(o, k);
      takes_part[o] = 1;
      if (i.coupled && !i.stepped)
        join(o, objects + k);
    }
  }
  std::map<std::uint32_t, Group> by_root;
  for (std::size_t o = 0; o < objects; ++o)
    if (takes_part[o] != 0)
      by_root[sets.find(static_cast<std::uint32_t>(o))].parts.statics.push_back(o);
  for (const auto& [o, k] : near) {
    Group& group = by_root[sets.find(static_cast<std::uint32_t>(o))];
    std::vector<std::size_t>& all = group.parts.instruments;
    if (std::ranges::find(all, k) == all.end())
      all.push_back(k);
    group.moves = group.moves || instrument_moves(w, k);
  }
  std::vector<Group> groups;
  for (auto& [root, group] : by_root) {
    std::ranges::sort(group.parts.instruments);
    groups.push_back(std::move(group));
  }
  return groups;
}

bool changes(const World& w, const Object& object) {
  return !object.shown.valid || object.load->changes_until() > object.shown.time ||
         (relaxes(object) && w.now.clock.time > object.shown.time);
}

bool needs_showing(const World& w, const Group& group) {
  return group.moves || std::ranges::any_of(group.parts.statics, [&](std::size_t index) {
           return changes(w, w.now.objects[index]);
         });
}

/// One group on its way through a step.
class GroupStep {
public:
  GroupStep(World& w, const Group& group) : w_(w), group_(group) {
    if (group.parts.statics.size() == 1)
      reach_ = contact_reach(w, group.parts.statics[0]);
    for (const std::size_t index : group.parts.statics) {
      Object& object = w.now.objects[index];
      if (!reach_)
        shape_in_step(w, object);
      before_.push_back(*object.shown.load);
      shape_.push_back(reach_ ? std::vector<double>() : stood_shape(w, object));
      begin_showing(w, object);
      load_shown(w, object);
    }
  }

  void run() {
    const std::size_t moments = std::max<std::size_t>(w_.now.poses.size(), 2) - 1;
    for (std::size_t p = 1; p <= moments; ++p)
      pass(p, static_cast<double>(p - 1) / static_cast<double>(moments),
           static_cast<double>(p) / static_cast<double>(moments));
    for (const std::size_t index : group_.parts.statics) {
      Object& object = w_.now.objects[index];
      Shown& shown = object.shown;
      shown.contact = object.touching;
      if (reach_ && !shown.shaped) {
        warn_of_range(w_, object, shown.largest);
      } else {
        shown.shaped = true;
        warn_of_range(w_, object);
        if (object.statics.made())
          shown.forces = static_forces(object);
      }
      at_object(w_, object, [&] { end_showing(w_, object); });
    }
  }

private:
  /// One instrument on the way between two moments.
  struct Leg {
    contact::Pose from, to;
    double duration = 0; ///< of a coupled one
  };
  /// Instruments reach more of the surface than was looked at.
  struct MorePart {};

  /// From one moment of the poses to the next. \param begin, end  shares of the load's way
  void pass(std::size_t moment, double begin, double end) {
    IslandParts parts{{}, group_.parts.statics, {}};
    legs_.clear();
    const double duration = (w_.now.clock.time - w_.now.clock.shown) * (end - begin);
    std::size_t count = 1;
    for (const std::size_t k : group_.parts.instruments) {
      const Instrument& i = w_.now.instruments[k];
      Leg leg;
      if (i.coupled && i.present && !i.stepped) {
        const double t0 = w_.now.clock.shown;
        leg = {i.way.at(t0 + begin * (w_.now.clock.time - t0)),
               i.way.at(t0 + end * (w_.now.clock.time - t0)), duration};
      } else {
        const std::size_t last = std::min(moment, w_.now.poses.size() - 1);
        const std::optional<contact::Pose> now = pose_at(w_, last, k);
        if (!now)
          continue;
        leg = {pose_at(w_, last > 0 ? last - 1 : 0, k).value_or(*now), *now, 0};
        if (last < moment)
          leg.from = leg.to;
      }
      parts.instruments.push_back(k);
      legs_.push_back(leg);
      count = std::max(count, parts_of_way(i.shape, leg.from, leg.to));
    }
    IslandCache& cache = island_of(w_, parts);
    for (std::size_t n = 0; n < count; ++n) {
      const auto at = [&](std::size_t m) {
        return static_cast<double>(m) / static_cast<double>(count);
      };
      go(parts, cache, at(n), at(n + 1), begin, end, max_halvings);
    }
  }

  /// Where instruments are in a part of that way that ends at `to`.
  std::vector<Box3> boxes_of(const IslandParts& parts, std::span<const contact::Pose> start,
                             double to, double room) const {
    std::vector<Box3> boxes;
    for (std::size_t n = 0; n < legs_.size(); ++n)
      boxes.push_back(box_with_room(w_.now.instruments[parts.instruments[n]].shape, start[n],
                                    contact::between(legs_[n].from, legs_[n].to, to), room));
    return boxes;
  }

  static Box3 box_with_room(const contact::InstrumentShape& shape, const contact::Pose& from,
                            const contact::Pose& to, double room) {
    Box3 box = box_between(shape, from, to);
    box.min -= Vec3{room, room, room};
    box.max += Vec3{room, room, room};
    return box;
  }

  /// Tiles of the object that instruments may reach, and those that are in contact.
  std::vector<std::uint32_t> reached(std::span<const Box3> boxes,
                                     std::span<const contact::NodalContactForce> contact) {
    const std::vector<double>& bounds = bounds_under(w_, group_.parts.statics[0], *reach_, contact);
    std::vector<std::uint32_t> nodes;
    for (const contact::NodalContactForce& f : contact)
      nodes.push_back(f.node);
    const std::vector<std::uint32_t> near = reach_->tiles.near(boxes, bounds),
                                     with = reach_->tiles.with(nodes);
    std::vector<std::uint32_t> all;
    std::ranges::set_union(near, with, std::back_inserter(all));
    return all;
  }

  /// As go(), with the part of the object's surface that instruments reach: more of it where they
  /// turn out to reach more.
  void go_on_part(const IslandParts& parts, IslandCache& cache,
                  std::span<const contact::Pose> start, double from, double to) {
    const contact::Parameters parameters;
    const double edge = cache.motion->island().edge, nearest = cache.motion->activation_distance();
    std::vector<std::uint32_t> tiles =
        reached(boxes_of(parts, start, to, nearest + parameters.lengths.margin * edge),
                w_.now.objects[parts.statics[0]].touching);
    for (bool whole = false; !whole;) {
      if (tiles.empty())
        tiles.push_back(0); // an island has some surface
      PartIsland& island = part_island(cache, reach_, tiles);
      IslandMembers members;
      StaticMember& object = members.statics.emplace_back(w_, parts.statics[0], island.part.surface,
                                                          cache.instrument_of_piece);
      members.all.push_back(&object);
      for (std::size_t n = 0; n < legs_.size(); ++n) {
        InstrumentMember& tool =
            members.instruments.emplace_back(w_, parts.instruments[n], cache.surfaces[n], start[n]);
        members.all.push_back(&tool);
        tool.set_target(contact::between(legs_[n].from, legs_[n].to, to),
                        legs_[n].duration * (to - from));
      }
      const contact::Load& load = before_[0]; // it does not change
      object.set_load(load);
      std::vector<std::uint32_t> more;
      object.take_part(island.part, load, [&](std::span<const contact::NodalContactForce> contact) {
        std::vector<Box3> boxes;
        for (std::size_t n = 0; n < legs_.size(); ++n)
          boxes.push_back(box_with_room(w_.now.instruments[parts.instruments[n]].shape, start[n],
                                        members.instruments[n].end_pose(), nearest));
        more = reached(boxes, contact);
        if (!std::ranges::includes(tiles, more))
          throw MorePart();
      });
      try {
        advance_members(*island.motion, members);
        whole = true;
      } catch (const MorePart&) {
        std::vector<std::uint32_t> all;
        std::ranges::set_union(tiles, more, std::back_inserter(all));
        tiles = std::move(all);
      }
    }
  }

  /// \param share  of the load's way, at the end
  void go_on_whole(const IslandParts& parts, IslandCache& cache,
                   std::span<const contact::Pose> start, double from, double to, double share) {
    IslandMembers members;
    make_members(w_, parts, cache, start, members);
    for (std::size_t n = 0; n < legs_.size(); ++n)
      members.instruments[n].set_target(contact::between(legs_[n].from, legs_[n].to, to),
                                        legs_[n].duration * (to - from));
    for (std::size_t k = 0; k < parts.statics.size(); ++k) {
      members.statics[k].set_time(w_.now.clock.shown +
                                  share * (w_.now.clock.time - w_.now.clock.shown));
      members.statics[k].set_load(
          load_between(before_[k], *w_.now.objects[parts.statics[k]].shown.load, shape_[k], share));
    }
    advance_members(*cache.motion, members);
  }

  void advance_members(contact::IslandMotion& motion, const IslandMembers& members) {
    const double now = w_.now.clock.time;
    try {
      motion.advance(members.all, now, now, w_.context);
    } catch (...) {
      count_contact(w_, motion.take_report());
      throw;
    }
    count_contact(w_, motion.take_report());
  }

  /// A part of that way, in halves where contact is not solved.
  void go(const IslandParts& parts, IslandCache& cache, double from, double to, double begin,
          double end, int halvings) {
    std::vector<contact::Pose> start;
    for (std::size_t n = 0; n < legs_.size(); ++n) {
      const Instrument& i = w_.now.instruments[parts.instruments[n]];
      const contact::Pose pose = contact::between(legs_[n].from, legs_[n].to, from);
      start.push_back(i.coupled && !i.stepped ? contact::Pose{i.coupled->place, pose.turn} : pose);
    }
    try {
      if (reach_)
        go_on_part(parts, cache, start, from, to);
      else
        go_on_whole(parts, cache, start, from, to, begin + to * (end - begin));
      return;
    } catch (const contact::NotSolved& error) {
      if (halvings == 0 || dynamic_cast<const contact::IntersectsAtStart*>(&error) != nullptr)
        fail_contact(w_, parts, error);
    }
    ++w_.now.counts.contact.halvings;
    const double middle = from + (to - from) / 2;
    go(parts, cache, from, middle, begin, end, halvings - 1);
    go(parts, cache, middle, to, begin, end, halvings - 1);
  }

  World& w_;
  const Group& group_;
  std::shared_ptr<ContactReach> reach_; ///< of the only object, if contact is found on a part of it
  std::vector<contact::Load> before_;
  std::vector<std::vector<double>> shape_;
  std::vector<Leg> legs_;
};

} // namespace

const Box3& shown_box(World& w, std::size_t index) {
  Object& object = w.now.objects[index];
  need_model(object);
  shape_in_step(w, object);
  if (object.shown.box)
    return *object.shown.box;
  Box3& box = object.shown.box.emplace();
  const std::size_t count = model::surface_count(object.model());
  const std::span<const double> u = *object.shown.displacement;
  for (std::size_t i = 0; i < count; ++i)
    box.add(object.model().nodes[i].position + vector_at(u, i));
  return box;
}

namespace {

/// What may have passed something unseen in a step: by the boxes where it was and is.
Pairs met_unseen(World& w, const Pairs& apart, const std::map<std::size_t, Box3>& before) {
  std::map<std::size_t, Box3> swept;
  for (const auto& [index, box] : before) {
    const Box3 now = contact_box(w, index);
    Box3& all = swept.emplace(index, box).first->second;
    all.add(now.min);
    all.add(now.max);
  }
  Pairs met;
  for (const ObjectPair& pair : apart.objects)
    if (contact::near(swept.at(pair.first), swept.at(pair.second)))
      met.objects.insert(pair);
  for (const ToolPair& pair : apart.tools)
    if (near_instrument(w, swept.at(pair.first), pair.second))
      met.tools.insert(pair);
  return met;
}

/// Shows objects in contact where pairs are near, or late. A step that lets others meet has no
/// effect. \param shown, followed  by object and instrument: become 1 \return pairs that have met
/// unseen
Pairs show_groups(World& w, const Pairs& late, std::vector<std::uint8_t>& shown,
                  std::vector<std::uint8_t>& followed) {
  Pairs apart;
  const std::vector<Group> groups = groups_of(w, late, apart);
  for (const Group& group : groups) {
    for (const std::size_t index : group.parts.statics)
      shown[index] = 1;
    for (const std::size_t k : group.parts.instruments)
      followed[k] = 1;
  }
  // Objects that no instrument is near may move to one.
  std::set<std::size_t> alone;
  for (const auto& [object, k] : apart.tools)
    if (shown[object] == 0 && changes(w, w.now.objects[object]))
      alone.insert(object);
  if (alone.empty() &&
      std::ranges::none_of(groups, [&](const Group& group) { return needs_showing(w, group); }))
    return {};
  std::optional<Snapshot> saved;
  std::map<std::size_t, Box3> before;
  if (!apart.empty())
    saved = snapshot(w);
  for (const auto& [a, b] : apart.objects)
    for (const std::size_t index : {a, b})
      before[index] = contact_box(w, index);
  for (const auto& [object, k] : apart.tools)
    before[object] = contact_box(w, object);
  for (const Group& group : groups)
    if (needs_showing(w, group)) {
      GroupStep step(w, group);
      step.run();
    }
  for (const std::size_t index : alone) {
    at_object(w, w.now.objects[index], [&] { show(w, w.now.objects[index]); });
    shown[index] = 1;
  }
  Pairs met = met_unseen(w, apart, before);
  if (!met.empty())
    roll_back(w, std::move(*saved));
  return met;
}

} // namespace

std::vector<std::uint8_t> show_static_contacts(World& w) {
  std::vector<std::uint8_t> shown(w.now.objects.size());
  std::vector<std::uint8_t> followed(w.now.instruments.size());
  Pairs late;
  while (!w.now.contacts.empty() || !w.now.instruments.empty()) {
    const Pairs met = show_groups(w, late, shown, followed);
    if (met.empty())
      break;
    late.objects.insert(met.objects.begin(), met.objects.end());
    late.tools.insert(met.tools.begin(), met.tools.end());
  }
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k) {
    Instrument& i = w.now.instruments[k];
    if (i.coupled && i.present && !i.stepped && followed[k] == 0)
      follow_hand(i, w.now.clock.time - w.now.clock.shown, w.now.clock.time);
    i.before = i.pose(w.now.clock.time);
    i.changed = false;
  }
  return shown;
}

// ---- where surfaces are to begin with

namespace {

/// Positions of a surface's vertices as an object is shown.
std::vector<Vec3> shown_positions(World& w, std::size_t index, const contact::ModelSurface& of) {
  Object& object = w.now.objects[index];
  std::vector<Vec3> x;
  x.reserve(of.node.size());
  if (object.body != nullptr) {
    const std::span<const dynamics::NodeMotion> motion = motion_of(object);
    for (const std::uint32_t node : of.node)
      x.push_back(object.model().nodes[node].position + motion[node].displacement);
    return x;
  }
  shape_in_step(w, object);
  const std::span<const double> u = *object.shown.displacement;
  for (const std::uint32_t node : of.node)
    x.push_back(object.model().nodes[node].position + vector_at(u, node));
  return x;
}

/// Solid angle of a closed surface seen from p, over 4 pi: 1 inside, 0 outside (A. van Oosterom,
/// J. Strackee, IEEE Trans. Biomed. Eng. 30(2), 1983).
double winding(const contact::ModelSurface& surface, std::span<const Vec3> x, const Vec3& p) {
  double sum = 0;
  for (const auto& t : surface.surface.triangles) {
    const Vec3 a = x[t[0]] - p, b = x[t[1]] - p, c = x[t[2]] - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    sum += std::atan2(dot(a, cross(b, c)),
                      la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

/// Whether an instrument is inside of a surface or passes it.
bool is_inside(const contact::InstrumentShape& shape, const contact::Pose& pose,
               const contact::ModelSurface& surface, std::span<const Vec3> x) {
  const contact::BodySurface own = contact::instrument_surface(shape);
  std::vector<Vec3> y;
  Box3 box;
  for (const Vec3& r : own.rest) {
    y.push_back(pose(r));
    box.add(y.back());
  }
  const double reach = shape.radius;
  const auto close = [&](std::span<const std::uint32_t> of) {
    Box3 other;
    for (const std::uint32_t v : of)
      other.add(x[v]);
    return contact::near(box, other, reach);
  };
  std::vector<std::array<std::uint32_t, 2>> edges = own.edges;
  for (const auto& t : own.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] < t[(k + 1) % 3])
        edges.push_back({t[k], t[(k + 1) % 3]});
  for (const auto& t : surface.surface.triangles) {
    if (!close(t))
      continue;
    for (const Vec3& p : y)
      if (!(collision::point_triangle_squared_distance(std::array{p, x[t[0]], x[t[1]], x[t[2]]}) >
            reach * reach))
        return true;
    for (const auto& [a, b] : edges)
      for (std::size_t k = 0; k < 3; ++k)
        if (!(collision::edge_edge_squared_distance(
                  std::array{y[a], y[b], x[t[k]], x[t[(k + 1) % 3]]}) > reach * reach))
          return true;
    for (const auto& o : own.triangles)
      for (const std::uint32_t v : t)
        if (!(collision::point_triangle_squared_distance(
                  std::array{x[v], y[o[0]], y[o[1]], y[o[2]]}) > reach * reach))
          return true;
  }
  return winding(surface, x, y[0]) > 0.5;
}

} // namespace

contact::Pose entry_pose(World& w, const contact::InstrumentShape& shape,
                         const contact::Pose& pose) {
  contact::Pose start = pose;
  if (shape.blade)
    return start;
  for (std::size_t o = 0; o < w.now.objects.size(); ++o) {
    Object& object = w.now.objects[o];
    if (!object.matter->known && object.load->empty())
      need_model(object);
    if (!takes_instruments(w, object))
      continue;
    const contact::ModelSurface surface = contact::model_surface(object.model());
    const std::vector<Vec3> x = shown_positions(w, o, surface);
    Box3 box;
    for (const Vec3& p : x)
      box.add(p);
    if (!contact::near(box, contact::PlacedInstrument(shape, start).box()) ||
        !is_inside(shape, start, surface, x))
      continue;
    // Out along its own axis, or by the nearest point of the surface.
    Vec3 way = norm(shape.axis) > 0 ? contact::rotated(start.turn, shape.axis) : Vec3{};
    if (way == Vec3{}) {
      double best = HUGE_VAL;
      for (const Vec3& p : x)
        if (const double d = norm(p - start.place); d < best) {
          best = d;
          way = p - start.place;
        }
      if (!(winding(surface, x, start.place) > 0.5))
        way = -way;
      if (!(norm(way) > 0))
        way = {0, 0, 1};
    }
    const double size = norm(box.size()) + 2 * (shape.radius + contact::reach_of(shape));
    way = way / norm(way);
    double inside = 0, outside = size;
    while (is_inside(shape, {start.place + outside * way, start.turn}, surface, x) &&
           outside < 16 * size)
      outside *= 2;
    for (int k = 0; k < 12; ++k) {
      const double middle = (inside + outside) / 2;
      (is_inside(shape, {start.place + middle * way, start.turn}, surface, x) ? inside : outside) =
          middle;
    }
    start.place += (outside + 1e-3 * shape.radius) * way;
  }
  return start;
}

void require_apart(World& w, const ContactRule& rule) {
  std::vector<std::size_t> objects{rule.object};
  if (rule.other != rule.object)
    objects.push_back(rule.other);
  std::deque<contact::ModelSurface> models;
  std::vector<const contact::BodySurface*> surfaces;
  std::vector<Vec3> x;
  for (const std::size_t index : objects) {
    models.push_back(contact::model_surface(w.now.objects[index].model()));
    surfaces.push_back(&models.back().surface);
    const std::vector<Vec3> own = shown_positions(w, index, models.back());
    x.insert(x.end(), own.begin(), own.end());
  }
  collision::OwnerTable<double> table(objects.size(), -1);
  table.set(0, objects.size() - 1, 0);
  const contact::IslandMotion motion(surfaces, table);
  const std::optional<Vec3> found = motion.find_intersection(x);
  if (!found)
    return;
  const Vec3& at = *found;
  const std::string& one = w.now.objects[rule.object].name();
  throw Error(
      (rule.object == rule.other ? "the surface of object " + one + " passes itself"
                                 : "surfaces of objects " + one + " and " +
                                       w.now.objects[rule.other].name() + " pass each other") +
      " near " + text::number_text(at.x) + " " + text::number_text(at.y) + " " +
      text::number_text(at.z) + ", expected surfaces that stand apart, or contact " + one +
      (rule.object == rule.other ? " self" : " " + w.now.objects[rule.other].name()) + " separate");
}

namespace {

bool is_closed(const contact::BodySurface& surface) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> triangles_of_edge;
  for (const auto& t : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      ++triangles_of_edge[std::minmax(t[k], t[(k + 1) % 3])];
  return std::ranges::all_of(triangles_of_edge, [](const auto& edge) { return edge.second == 2; });
}

/// A vertex of each connected component.
std::vector<std::uint32_t> vertices_of_components(const contact::BodySurface& surface) {
  DisjointSets sets(surface.rest.size());
  for (const auto& t : surface.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  std::vector<std::uint32_t> all;
  for (std::uint32_t v = 0; v < surface.rest.size(); ++v)
    if (sets.find(v) == v)
      all.push_back(v);
  return all;
}

} // namespace

void require_outside(World& w, const ContactRule& rule, bool any) {
  if (rule.object == rule.other)
    return;
  for (const auto& [inner, outer] :
       {std::pair(rule.object, rule.other), std::pair(rule.other, rule.object)}) {
    if (!any && !is_solid(w.now.objects[outer]))
      continue;
    const contact::ModelSurface of_inner = contact::model_surface(w.now.objects[inner].model());
    const contact::ModelSurface of_outer = contact::model_surface(w.now.objects[outer].model());
    if (!is_closed(of_outer.surface))
      continue;
    const std::vector<Vec3> x = shown_positions(w, inner, of_inner);
    const std::vector<Vec3> y = shown_positions(w, outer, of_outer);
    for (const std::uint32_t v : vertices_of_components(of_inner.surface))
      if (winding(of_outer, y, x[v]) > 0.5)
        throw Error("the surface of object " + w.now.objects[inner].name() + " is inside object " +
                    w.now.objects[outer].name() + " near " + text::number_text(x[v].x) + " " +
                    text::number_text(x[v].y) + " " + text::number_text(x[v].z) +
                    ", expected surfaces that can be moved apart");
  }
}

} // namespace gewebe::scene
