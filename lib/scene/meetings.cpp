// Meetings: objects whose surfaces may touch each other or themselves. Those that are near move as
// one body, which knows of them (statics/meeting_yielding.h), elastostatic ones beside it; others
// cost no more than a look at their boxes.

#include "scene/rules_internal.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <utility>

namespace gewebe::simulation {

namespace {

constexpr double near_part = 0.05; ///< of the smaller one's size: so near they move as one
constexpr double far_parts = 3;    ///< of what is near: so far they are two again

bool awake(const Object& object) {
  return object.body != nullptr && (object.body->changed || !object.body->moving->resting());
}

/// What isn't known of an elastostatic one counts as 0: see mixed_met_late.
Extent extent_in(World& w, std::size_t index, Extents& extents) {
  return w.now.objects[index].method == Method::ffe ? Extent{shown_box(w, index), 0}
                                                    : extents.of(index);
}

/// Whether they may come to touch within a time; of such as were near already, with more room.
bool are_near(World& w, const Meeting& m, double duration, Extents& extents) {
  const Extent a = extent_in(w, m.object, extents), b = extent_in(w, m.other, extents);
  const double margin = near_part * std::min(a.box.longest_side(), b.box.longest_side()) +
                        2 * duration * (a.speed + b.speed) +
                        duration * duration * norm(w.now.gravity);
  return near(a.box, b.box, m.near ? far_parts * margin : margin);
}

/// The bodies of these objects anew, by who is near now.
void regroup(World& w, const std::set<std::size_t>& objects) {
  std::set<std::shared_ptr<Body>> bodies;
  for (const std::size_t index : objects) {
    const Object& object = w.now.objects[index];
    if (object.method == Method::ela)
      need_body(w, index);
    if (const auto& body = object.body != nullptr ? object.body : object.beside; body != nullptr)
      bodies.insert(body);
  }
  Motions motions;
  std::set<std::size_t> stood;
  for (const auto& body : bodies) {
    for (const std::size_t part : body->parts) {
      const std::span<const NodeMotion> motion = motion_of(w.now.objects[part]);
      motions[part].assign(motion.begin(), motion.end());
    }
    stood.insert(body->beside.begin(), body->beside.end());
    gather_impulses(w, *body);
    drop_body(w, body.get());
  }
  for (const auto& [part, motion] : motions)
    w.now.objects[part].body = nullptr;
  renew_bodies(w, motions);
  for (const std::size_t index : stood)
    if (bodies.contains(w.now.objects[index].beside))
      leave_body(w, w.now.objects[index]);
  regroup_statics(w);
}

} // namespace

std::vector<SurfaceMeeting> meetings_of(const World& w, std::span<const std::size_t> parts,
                                        std::span<const std::size_t> offset) {
  std::vector<SurfaceMeeting> all;
  const auto range_of = [&](std::size_t object) -> std::optional<NodeRange> {
    const auto at = std::ranges::find(parts, object);
    if (at == parts.end())
      return std::nullopt;
    const auto first =
        static_cast<std::uint32_t>(offset[static_cast<std::size_t>(at - parts.begin())]);
    return NodeRange{
        first, first + static_cast<std::uint32_t>(w.now.objects[object].model().nodes.size())};
  };
  for (const Meeting& m : w.now.meetings)
    if (const auto one = range_of(m.object), other = range_of(m.other); one && other)
      all.push_back({*one, *other, m.friction});
  return all;
}

/// Before objects move: those that may touch by then become one body, others come apart, unless all
/// stay.
void meet(World& w, double to, Extents& extents, bool stay) {
  // Who comes to stand beside a body is near to others then by another measure.
  for (std::size_t round = 0; round <= w.now.meetings.size(); ++round) {
    std::set<std::size_t> changed;
    for (Meeting& m : w.now.meetings) {
      const Object &a = w.now.objects[m.object], &b = w.now.objects[m.other];
      const bool mixed = is_mixed(w, m);
      if (m.object == m.other || is_static(w, m) || (!mixed && !awake(a) && !awake(b)))
        continue;
      const bool now = are_near(w, m, to - w.now.clock.time, extents);
      if (now == m.near || ((stay || m.stays) && m.near))
        continue;
      m.near = now;
      changed.insert({m.object, m.other});
    }
    if (changed.empty())
      return;
    regroup(w, changed);
  }
}

bool may_meet(const World& w, const Meeting& m) {
  return !m.near && m.object != m.other && !is_static(w, m) && !is_mixed(w, m);
}

bool is_mixed(const World& w, const Meeting& m) {
  return (w.now.objects[m.object].method == Method::ffe ||
          w.now.objects[m.other].method == Method::ffe) &&
         !is_static(w, m);
}

namespace {

bool may_be_late(const World& w, const Meeting& m) {
  return !m.near && m.object != m.other && is_mixed(w, m);
}

Box3 box_of(World& w, std::size_t index) {
  Extents extents(w);
  return extent_in(w, index, extents).box;
}

} // namespace

std::map<std::size_t, Box3> note_mixed(World& w) {
  std::map<std::size_t, Box3> all;
  for (const Meeting& m : w.now.meetings)
    if (may_be_late(w, m))
      for (const std::size_t object : {m.object, m.other})
        if (!all.contains(object)) {
          need_model(w.now.objects[object]);
          all[object] = box_of(w, object);
        }
  return all;
}

std::vector<std::size_t> mixed_met_late(World& w, const std::map<std::size_t, Box3>& before) {
  const auto passed = [&](std::size_t object) {
    Box3 box = before.at(object);
    const Box3 now = box_of(w, object);
    box.add(now.min);
    box.add(now.max);
    return box;
  };
  std::vector<std::size_t> late;
  for (std::size_t k = 0; k < w.now.meetings.size(); ++k) {
    const Meeting& m = w.now.meetings[k];
    if (may_be_late(w, m) && before.contains(m.object) && before.contains(m.other) &&
        near(passed(m.object), passed(m.other)))
      late.push_back(k);
  }
  return late;
}

void join_mixed(World& w, std::span<const std::size_t> late) {
  std::set<std::size_t> objects;
  for (const std::size_t k : late) {
    Meeting& m = w.now.meetings[k];
    m.near = m.stays = true;
    objects.insert({m.object, m.other});
  }
  regroup(w, objects);
}

void end_mixed(World& w) {
  for (Meeting& m : w.now.meetings)
    m.stays = false;
}

/// Where those stand that may touch but are not near.
void note_extents(const World& w, Extents& extents) {
  for (const Meeting& m : w.now.meetings)
    if (may_meet(w, m))
      for (const std::size_t object : {m.object, m.other})
        (void)extents.of(object);
}

/// Behind the way of all: those that were not near but have come, by what pulled at them, where the
/// others have been. \param before as noted
std::set<std::size_t> met_late(const World& w, Extents& before, Extents& after) {
  std::set<std::size_t> all;
  const auto passed = [&](std::size_t object) {
    Box3 box = before.of(object).box;
    box.add(after.of(object).box.min);
    box.add(after.of(object).box.max);
    return box;
  };
  for (const Meeting& m : w.now.meetings)
    if (may_meet(w, m) && (awake(w.now.objects[m.object]) || awake(w.now.objects[m.other])) &&
        near(passed(m.object), passed(m.other)))
      all.insert({m.object, m.other});
  return all;
}

/// They are one body from now on, while `meet` lets those that are near stay.
void join_late(World& w, const std::set<std::size_t>& objects) {
  for (Meeting& m : w.now.meetings)
    if (objects.contains(m.object) && objects.contains(m.other))
      m.near = true;
  regroup(w, objects);
}

std::vector<std::size_t> together(const World& w, std::size_t object) {
  std::vector<std::size_t> all{object};
  const auto add = [&](std::size_t from, std::size_t a, std::size_t b) {
    for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)})
      if (one == from && std::ranges::find(all, other) == all.end())
        all.push_back(other);
  };
  for (std::size_t k = 0; k < all.size(); ++k) {
    const std::size_t from = all[k];
    for (const Tie& tie : w.now.ties)
      add(from, tie.object, tie.other);
    for (const Meeting& m : w.now.meetings)
      add(from, m.object, m.other);
  }
  return all;
}

/// Parts that came off an object touch whom it touched, and each other if it touched itself.
void move_meetings(World& w, std::size_t index, const Moves& moves) {
  std::vector<Meeting> all;
  const auto pieces_of = [&](std::size_t object) {
    return object == index ? moves.objects : std::vector<std::size_t>{object};
  };
  for (const Meeting& m : w.now.meetings)
    for (const std::size_t one : pieces_of(m.object))
      for (const std::size_t other : pieces_of(m.other))
        if (m.object != m.other || one <= other)
          all.push_back({one, other, m.friction, m.near || (m.object == m.other && one != other)});
  w.now.meetings = std::move(all);
}

// ---- changes

void Rule<SetContact>::check(World& w, const SetContact& c) {
  const bool itself = c.object == c.other;
  for (const std::size_t index : {c.object, c.other}) {
    Object& object = w.now.objects.at(index);
    need_model(object);
    require_support(w, object, itself ? Feature::self_contact : Feature::contact);
    if (object.model().triangles.empty())
      throw Error("object " + object.name() + " has no triangles, expected a surface for contact");
  }
  std::vector<std::size_t> all = together(w, c.object);
  const std::vector<std::size_t> others = together(w, c.other);
  all.insert(all.end(), others.begin(), others.end());
  require_like_solids(w, all);
}

/// Who is free to choose moves implicitly.
void Rule<SetContact>::enter(World& w, const SetContact& c) {
  for (const std::size_t index : {c.object, c.other})
    if (Integration& way = w.now.objects.at(index).integration; way == Integration::automatic)
      way = Integration::implicit;
}

void Rule<SetContact>::apply(World& w, const SetContact& c) {
  const auto known = std::ranges::find_if(w.now.meetings, [&](const Meeting& m) {
    return std::minmax(m.object, m.other) == std::minmax(c.object, c.other);
  });
  if (known != w.now.meetings.end())
    known->friction = c.friction;
  else
    w.now.meetings.push_back({c.object, c.other, c.friction, false});
  for (const std::size_t index : {c.object, c.other}) {
    Object& object = w.now.objects[index];
    object.meets = true;
    if (StaticGroup* const group = static_group_of(w, index)) {
      group->meeting = nullptr;
      group->settled = false;
    }
    const std::shared_ptr<Body>& body = object.body != nullptr ? object.body : object.beside;
    if (body == nullptr)
      continue;
    body->ahead = true;
    body->moving->set_meetings(meetings_of(w, *body));
    body->moving->wake();
  }
}

void Rule<SetContact>::log(const World& w, const SetContact& c, ChangeRow& row) {
  row.what = "contact";
  row.other = w.now.objects.at(c.other).name();
  row.value = c.friction;
}

} // namespace gewebe::simulation
