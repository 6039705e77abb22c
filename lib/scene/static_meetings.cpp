// Meetings of elastostatic objects: those that are near each other have their shapes found
// together (statics/static_meeting.h), and so has one that may touch itself; others cost no more
// than a look at their boxes.

#include "base/vector_at.h"
#include "scene/static_members_internal.h"

#include <algorithm>
#include <array>
#include <utility>

namespace gewebe::simulation {

namespace {

constexpr double near_part = 0.05; ///< of the smaller one's size: so near they are one group
constexpr double far_parts = 3;    ///< of what is near: so far they are two again
/// Over an edge that surfaces move against each other in a step: beyond it the step is halved, and
/// above the shorter one where its forces aren't found.
constexpr double long_way = 0.5, short_way = 0.005;
constexpr double shortest_part = 1.0 / 256;
/// Parts that are taken back for their halves: so many in all, and so many more with each step.
constexpr int max_tries = 24, more_tries = 4;
constexpr int few_turns = 60, many_turns = 200; ///< for forces, where there may be halves and not

bool are_near(World& w, const Meeting& m) {
  if (m.object == m.other)
    return true;
  const Box3 &a = shown_box(w, m.object), &b = shown_box(w, m.other);
  const double margin = near_part * std::min(a.longest_side(), b.longest_side());
  return near(a, b, m.near ? far_parts * margin : margin);
}

/// Those that hang together by near meetings with this one.
std::vector<std::size_t> near_ones(const World& w, std::size_t object) {
  std::vector<std::size_t> all{object};
  for (std::size_t k = 0; k < all.size(); ++k)
    for (const Meeting& m : w.now.meetings) {
      if (!m.near || !is_static(w, m) || (m.object != all[k] && m.other != all[k]))
        continue;
      const std::size_t other = m.object == all[k] ? m.other : m.object;
      if (std::ranges::find(all, other) == all.end())
        all.push_back(other);
    }
  std::ranges::sort(all);
  return all;
}

/// An object of its own again, as it is shown.
void leave_group(Object& object) {
  object.shown.touches = by_instruments(std::move(object.shown.touches));
  object.contact = std::make_shared<StaticContact>(object.model(), *object.shown.displacement,
                                                   object.shown.touches, object.shown.points);
  object.shown.valid = false;
}

std::vector<Object*> objects_of(World& w, const StaticGroup& group) {
  std::vector<Object*> all;
  for (const std::size_t part : group.parts)
    all.push_back(&w.now.objects[part]);
  return all;
}

/// A part of the ways, from one part to another of them.
ShortWay part_of(const ShortWay& way, double from, double to) {
  ShortWay part{way.instruments, way.last && to == 1};
  for (std::optional<MovedInstrument>& i : part.instruments)
    if (i) {
      const Pose before = i->before, now = i->now;
      i->before = between(before, now, from);
      i->now = between(before, now, to);
    }
  return part;
}

StaticMembers members_of(World& w, const StaticGroup& group) {
  return {w, objects_of(w, group)};
}

StaticMeeting& meeting_of(World& w, StaticGroup& group, const StaticMembers& all) {
  if (!group.meeting) {
    std::vector<std::size_t> first;
    auto model = std::make_shared<const Model>(joined_model(w, group.parts, first));
    group.meeting =
        std::make_shared<StaticMeeting>(std::move(model), meetings_of(w, group.parts, first),
                                        all.shape(), by_instruments(all.touches()), all.points());
  }
  return *group.meeting;
}

/// What is shown of its objects from now on. \param known numbers of each one's shape
void show_members(World& w, StaticGroup& group, const StaticMembers& all,
                  std::span<const double> shape, std::span<const std::size_t> known) {
  const StaticMeeting& meeting = *group.meeting;
  for (std::size_t k = 0; k < group.parts.size(); ++k) {
    Object& object = w.now.objects[group.parts[k]];
    Shown& shown = object.shown;
    const std::span<const double> own = shape.subspan(std::size_t{3} * all.first(k), known[k]);
    shown.displacement.replace().assign(own.begin(), own.end());
    shown.touches = touches_of_part(meeting.touches(), all.first(k), all.end(k));
    shown.points.clear();
    for (const PointTouch& p : meeting.points())
      if (all.of(p.nodes[0]) == k)
        shown.points.push_back(shifted(p, 0, all.first(k)));
    shown.shaped = true;
    warn_of_range(w, object);
    if (object.statics->made())
      shown.forces = static_forces(object);
  }
}

} // namespace

bool is_static(const World& w, const Meeting& m) {
  return std::ranges::all_of(std::array{m.object, m.other}, [&](std::size_t object) {
    return w.now.objects[object].method == Method::ffe && w.now.objects[object].beside == nullptr;
  });
}

bool as_one(const World& w, std::size_t object, std::size_t other) {
  if (object == other)
    return true;
  const Body *const body = body_of(w.now.objects[object]), *const other_body =
                                                               body_of(w.now.objects[other]);
  return (body != nullptr && body == other_body) ||
         std::ranges::any_of(w.now.static_groups, [&](const StaticGroup& group) {
           return std::ranges::binary_search(group.parts, object) &&
                  std::ranges::binary_search(group.parts, other);
         });
}

StaticGroup* static_group_of(World& w, std::size_t object) {
  const auto at = std::ranges::find_if(w.now.static_groups, [&](const StaticGroup& group) {
    return std::ranges::binary_search(group.parts, object);
  });
  return at == w.now.static_groups.end() ? nullptr : &*at;
}

const Box3& shown_box(World& w, std::size_t index) {
  Object& object = w.now.objects[index];
  need_model(object);
  shape_in_step(w, object);
  if (object.shown.box)
    return *object.shown.box;
  if (!object.matter->box) {
    Box3& rest = object.matter->box.emplace();
    const std::size_t count = surface_count(object.model());
    for (std::size_t i = 0; i < count; ++i)
      rest.add(object.model().nodes[i].position);
  }
  const Box3 way = object.contact && object.contact->range() ? *object.contact->range()
                                                             : range_of(*object.shown.displacement);
  Box3& box = object.shown.box.emplace(*object.matter->box);
  box.min += way.min;
  box.max += way.max;
  return box;
}

/// The groups by who is near now; those whose objects stay the same stay as they are.
void regroup_statics(World& w) {
  std::vector<StaticGroup> groups;
  for (const Meeting& m : w.now.meetings) {
    if (!m.near || !is_static(w, m) || std::ranges::any_of(groups, [&](const StaticGroup& g) {
          return std::ranges::binary_search(g.parts, m.object);
        }))
      continue;
    StaticGroup group{near_ones(w, m.object), {}, false, max_tries, nullptr};
    const auto same = std::ranges::find(w.now.static_groups, group.parts, &StaticGroup::parts);
    groups.push_back(same != w.now.static_groups.end() ? std::move(*same) : std::move(group));
  }
  const std::vector<StaticGroup> before = std::exchange(w.now.static_groups, std::move(groups));
  for (const StaticGroup& group : before)
    for (const std::size_t part : group.parts)
      if (static_group_of(w, part) == nullptr && w.now.objects[part].beside == nullptr)
        leave_group(w.now.objects[part]);
  for (const StaticGroup& group : w.now.static_groups)
    for (const std::size_t part : group.parts)
      w.now.objects[part].contact = nullptr;
}

void group_statics(World& w) {
  bool changed = false;
  for (Meeting& m : w.now.meetings) {
    if (!is_static(w, m))
      continue;
    const bool now = are_near(w, m);
    changed = changed || now != m.near;
    m.near = now;
  }
  if (changed)
    regroup_statics(w);
}

const Box3& group_box(World& w, StaticGroup& group) {
  return meeting_of(w, group, members_of(w, group)).box();
}

namespace {

/// A group on its way through a step.
class GroupStep {
public:
  GroupStep(World& w, StaticGroup& group)
      : w_(w), group_(group), objects_(objects_of(w, group)), all_(members_of(w, group)),
        meeting_(meeting_of(w, group, all_)), shape_(all_.shape()), touches_(all_.touches()),
        changed_(!group.settled) {
    group.tries = std::min(group.tries + more_tries, max_tries);
    for (Object* const object : objects_) {
      known_.push_back(object->shown.displacement->size());
      object->statics->ahead = true;
      changed_ = changed_ || touched_by_instruments(*object) || acted_anew(*object);
      const Load next = load_at(*object->load, object->model(), w.now.clock.time);
      before_.push_back(load_before(*object, next));
      begin_showing(w, *object);
      object->shown.load = next;
    }
  }

  void go() {
    std::vector<ShortWay> ways = short_ways(w_, objects_);
    if (ways.empty())
      ways.push_back({{}, true});
    const auto count = static_cast<double>(ways.size());
    for (std::size_t k = 0; k < ways.size(); ++k) {
      const auto loaded = [&](double part) {
        return k + 1 == ways.size() && part == 1 ? 1 : (static_cast<double>(k) + part) / count;
      };
      for (double at = 0, size = 1; at < 1;) {
        const double to = std::min(at + size, 1.0);
        const bool whole = size == 1;
        if (!part(whole ? ways[k] : part_of(ways[k], at, to), loaded(to), whole,
                  size > shortest_part && group_.tries > 0)) {
          size /= 2;
          continue;
        }
        at = to;
        size = whole ? 1 : std::min(2 * size, 1 - at);
      }
    }
  }

  /// What is shown from now on.
  void end() {
    group_.settled = solved_ && meeting_.settled();
    show_members(w_, group_, all_, shape_, known_);
    settle_led(w_, objects_);
    if (const auto stuck = meeting_.stuck()) {
      const std::size_t k = all_.of(stuck->node);
      tell_stuck(w_, *objects_[k], {stuck->node - all_.first(k), stuck->instrument, {}});
    }
    if (!solved_)
      warn_inexact(w_, *objects_[0]);
    for (Object* const object : objects_)
      at_object(w_, *object, [&] { end_showing(w_, *object); });
  }

private:
  /// \param loaded part of the way that loads go \return whether it is taken, not its halves
  bool part(const ShortWay& way, double loaded, bool whole, bool may_halve) {
    std::vector<Load> loads;
    for (std::size_t k = 0; k < objects_.size(); ++k)
      loads.push_back(load_between(before_[k], *objects_[k]->shown.load, loaded));
    all_.set_loads(std::move(loads));
    const std::vector<double> shape = shape_;
    const std::vector<SurfacePush> pushes = group_.pushes;
    std::vector<std::size_t> known = known_;
    bool solved = true;
    const bool last = changed_ && (way.last || !whole);
    const auto update = [&](std::span<const NodeTouch> pushed) {
      JoinedYielding joined = all_.joined(pushed);
      meeting_.update(joined, all_.displaced(), way.instruments, shape_, group_.pushes, last,
                      may_halve ? few_turns : many_turns);
      solved = meeting_.solved() && all_.solved();
      for (std::size_t k = 0; k < known.size(); ++k)
        known[k] = std::max(known[k], joined.known(k));
    };
    update(touches_);
    if (last && meeting_.touches().empty() && !touches_.empty()) {
      // All let go: once more without what they pushed with, which nothing has taken back yet.
      shape_ = shape;
      group_.pushes.clear();
      meeting_.restart(shape_, {});
      update({});
    }
    const TouchCounts counts = meeting_.take_counts();
    const bool free = solved && pushes.empty() && group_.pushes.empty();
    if (may_halve && !free &&
        !(meeting_.way_of(shape, shape_) <= (solved ? long_way : short_way))) {
      --group_.tries;
      shape_ = shape;
      group_.pushes = pushes;
      meeting_.restart(shape_, touches_);
      return false;
    }
    w_.now.counts.touches.add(counts);
    solved_ = solved_ && solved;
    touches_ = meeting_.touches();
    known_ = known;
    return true;
  }

  World& w_;
  StaticGroup& group_;
  std::vector<Object*> objects_;
  StaticMembers all_;
  StaticMeeting& meeting_;
  std::vector<double> shape_;
  std::vector<NodeTouch> touches_;
  std::vector<std::size_t> known_; ///< numbers of each one's shape
  std::vector<Load> before_;
  bool changed_ = false, solved_ = true;
};

} // namespace

void show_group(World& w, StaticGroup& group) {
  for (const std::size_t part : group.parts) {
    need_model(w.now.objects[part]);
    shape_in_step(w, w.now.objects[part]); // that it comes from
  }
  GroupStep step(w, group);
  step.go();
  step.end();
}

StaticsBefore note_statics(World& w) {
  StaticsBefore before;
  const auto add = [&](std::size_t index) {
    if (std::ranges::find(before.all, index, &StaticsBefore::One::object) != before.all.end())
      return;
    const Object& object = w.now.objects[index];
    before.all.push_back({index, object.shown, object.came, shown_box(w, index)});
    before.all.back().shown.displacement = {};
  };
  for (const Meeting& m : w.now.meetings)
    if (is_static(w, m) && !m.near)
      for (const std::size_t object : {m.object, m.other}) {
        add(object);
        if (const StaticGroup* const group = static_group_of(w, object))
          std::ranges::for_each(group->parts, add);
      }
  if (!before.all.empty() && !w.now.poses.empty())
    before.poses = w.now.poses.back();
  return before;
}

namespace {

/// As it was shown before this step: its shape by what acted then.
void show_before(World& w, const StaticsBefore::One& was) {
  Object& object = w.now.objects[was.object];
  const std::size_t count = object.shown.displacement->size();
  const Load load = acting_load(was.shown);
  std::vector<double> shape(count);
  at_object(w, object, [&] {
    if (load.empty())
      return;
    update_solver(w, object, load);
    const std::span<const double> u = static_surface(object);
    shape.assign(u.begin(), u.end());
  });
  object.shown = was.shown;
  object.shown.displacement = std::move(shape);
  object.shown.valid = false;
  object.came = was.came;
}

} // namespace

std::vector<std::size_t> show_late_groups(World& w, const StaticsBefore& before) {
  std::vector<std::size_t> late;
  const auto passed = [&](std::size_t object) {
    Box3 box = std::ranges::find(before.all, object, &StaticsBefore::One::object)->box;
    box.add(shown_box(w, object).min);
    box.add(shown_box(w, object).max);
    return box;
  };
  for (Meeting& m : w.now.meetings)
    if (is_static(w, m) && !m.near && near(passed(m.object), passed(m.other))) {
      m.near = true;
      late.insert(late.end(), {m.object, m.other});
    }
  if (late.empty())
    return late;
  regroup_statics(w);
  if (!before.poses.empty())
    w.now.poses.back() = before.poses;
  std::vector<std::size_t> again;
  for (StaticGroup& group : w.now.static_groups) {
    if (std::ranges::none_of(late, [&](std::size_t object) {
          return std::ranges::binary_search(group.parts, object);
        }))
      continue;
    for (const std::size_t part : group.parts)
      show_before(w, *std::ranges::find(before.all, part, &StaticsBefore::One::object));
    show_group(w, group);
    again.insert(again.end(), group.parts.begin(), group.parts.end());
  }
  return again;
}

} // namespace gewebe::simulation
