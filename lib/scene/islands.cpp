// Islands: what may touch in a way of the scene steps together (contact/island.h), bodies that
// move, elastostatic objects and instruments. What is far from everything moves by itself.

#include "base/disjoint_sets.h"
#include "geometry/vector_at.h"
#include "scene/extents.h"
#include "scene/island_members_internal.h"
#include "scene/rules_internal.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace gewebe::scene {

namespace {

constexpr double near_part = 0.05; ///< of the smaller one's size: so near, they may touch

/// Objects, and instruments behind them, as nodes of a graph.
using NodePair = std::pair<std::size_t, std::size_t>;

struct Graph {
  std::size_t objects = 0;
  std::vector<NodePair> pairs; ///< that may touch, first < second or an object with itself
};

/// All that may touch, where something moves.
Graph graph_of(World& w) {
  Graph graph{w.now.objects.size(), {}};
  const auto is_object = [&](std::size_t k) { return w.now.objects[k].matter->known; };
  for (const ContactRule& rule : w.now.contacts)
    if (is_object(rule.object) && is_object(rule.other))
      graph.pairs.emplace_back(std::min(rule.object, rule.other),
                               std::max(rule.object, rule.other));
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k) {
    const Instrument& i = w.now.instruments[k];
    if (!i.present || i.shape.blade)
      continue;
    for (std::size_t o = 0; o < graph.objects; ++o)
      if (is_object(o) && takes_instruments(w, w.now.objects[o]))
        graph.pairs.emplace_back(o, graph.objects + k);
  }
  return graph;
}

/// Where a node of the graph may be on the way, at most, as far as is known.
struct Ways {
  World& w;
  double to;
  Extents& extents;

  double duration() const { return to - w.now.clock.time; }
  Extent of_object(std::size_t index) const {
    return w.now.objects[index].method == Method::ffe ? Extent{shown_box(w, index), 0}
                                                      : extents.of(index);
  }
  Box3 of_instrument(std::size_t k) const {
    const Instrument& i = w.now.instruments[k];
    contact::Pose end = i.way.at(to), begin = i.before;
    Box3 box = box_between(i.shape, begin, end);
    if (i.coupled) {
      const Box3 here = contact::PlacedInstrument(i.shape, i.pose(w.now.clock.time)).box();
      box.add(here.min);
      box.add(here.max);
    }
    return box;
  }
  /// Where an object is at the end of the way: an elastostatic one that no island has moved, under
  /// its load then.
  Box3 arrived(std::size_t index) const {
    Object& object = w.now.objects[index];
    const Shown& shown = object.shown;
    const bool moves = object.method == Method::ffe && !object.in_motion &&
                       !is_held_altogether(object) &&
                       (!shown.valid || object.load->changes_until() > shown.time) &&
                       (object.statics.made() || !object.load->empty());
    if (!moves)
      return of_object(index).box;
    contact::Load load = acting_at(object, to);
    for (const contact::NodalContactForce& f : shown.contact)
      if (!load.displacement.contains(f.node))
        load.force[f.node] += f.force;
    update_solver(w, object, load);
    const std::span<const double> u = static_surface(object);
    Box3 box;
    for (std::size_t i = 0; i < model::surface_count(object.model()); ++i)
      box.add(object.model().nodes[i].position + vector_at(u, i));
    return box;
  }
  bool are_near(const NodePair& pair, std::size_t objects) const {
    const auto& [a, b] = pair;
    if (a == b)
      return true;
    const Extent one = of_object(a);
    const double fall = duration() * duration() * norm(w.now.gravity);
    if (b < objects) {
      const Extent other = of_object(b);
      const double margin = near_part * std::min(one.box.longest_side(), other.box.longest_side()) +
                            2 * duration() * (one.speed + other.speed) + fall;
      return contact::near(one.box, other.box, margin);
    }
    const double margin = near_part * one.box.longest_side() + 2 * duration() * one.speed + fall;
    return contact::near(one.box, of_instrument(b - objects), margin);
  }
};

/// Components of what is near. Instruments under a coupling join what they may touch.
std::vector<IslandParts> islands_of(World& w, const Graph& graph, std::span<const NodePair> near) {
  DisjointSets disjoint(graph.objects + w.now.instruments.size());
  struct {
    DisjointSets& all;
    void join(std::size_t a, std::size_t b) {
      all.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
    }
    std::size_t root(std::size_t a) { return all.find(static_cast<std::uint32_t>(a)); }
  } sets{disjoint};
  for (const auto& body : w.now.bodies)
    for (const std::size_t part : body->parts)
      sets.join(body->parts[0], part);
  for (const auto& [a, b] : near)
    if (b < graph.objects || w.now.instruments[b - graph.objects].coupled)
      sets.join(a, b);
  std::map<std::size_t, IslandParts> by_root;
  std::set<std::size_t> touching;
  for (const auto& [a, b] : near)
    touching.insert(sets.root(a));
  for (const auto& body : w.now.bodies)
    if (touching.contains(sets.root(body->parts[0])))
      by_root[sets.root(body->parts[0])].bodies.push_back(body);
  for (std::size_t o = 0; o < graph.objects; ++o)
    if (w.now.objects[o].method == Method::ffe && by_root.contains(sets.root(o)))
      by_root[sets.root(o)].statics.push_back(o);
  for (const auto& [a, b] : near) {
    if (b < graph.objects || !by_root.contains(sets.root(a)))
      continue;
    std::vector<std::size_t>& all = by_root[sets.root(a)].instruments;
    if (std::ranges::find(all, b - graph.objects) == all.end())
      all.push_back(b - graph.objects);
  }
  std::vector<IslandParts> islands;
  for (auto& [root, island] : by_root) {
    std::ranges::sort(island.instruments);
    std::ranges::sort(island.bodies, {}, [](const auto& body) { return body->parts[0]; });
    islands.push_back(std::move(island));
  }
  return islands;
}

bool rests(const std::shared_ptr<Body>& body) {
  return body->moving->resting() && !body->changed;
}

/// Whether nothing of an island moves, or is about to.
bool sleeps(const World& w, const IslandParts& island, double to) {
  const auto stands = [&](std::size_t k) {
    const Instrument& i = w.now.instruments[k];
    if (i.changed)
      return false;
    if (!i.coupled)
      return i.before == i.way.at(to);
    const Instrument::Coupled& c = *i.coupled;
    const contact::CouplingStep step(c.coupling, c.lag, to - w.now.clock.time);
    const Vec3 next = i.way.at(to).place - step.lag(c.force);
    return i.before.turn == i.way.at(to).turn &&
           norm(next - c.place) <= contact::led_to_rest * i.shape.radius;
  };
  const auto stays = [&](std::size_t index) {
    const Object& object = w.now.objects[index];
    return object.shown.valid && !(object.load->changes_until() > w.now.clock.time);
  };
  return std::ranges::all_of(island.bodies, rests) &&
         std::ranges::all_of(island.instruments, stands) &&
         std::ranges::all_of(island.statics, stays);
}

/// Whether an island has come to rest at `time` of its step to `to`.
bool has_come_to_rest(const World& w, const IslandParts& island, double time, double to) {
  const auto stands = [&](std::size_t k) {
    const Instrument& i = w.now.instruments[k];
    return !i.coupled && i.way.at(time) == i.way.at(to);
  };
  return island.statics.empty() && std::ranges::all_of(island.bodies, rests) &&
         std::ranges::all_of(island.instruments, stands);
}

/// Contact forces of an island that sleeps act on.
void sleep_on(World& w, const IslandParts& island, double duration) {
  for (const auto& body : island.bodies)
    for (const std::size_t part : body->parts)
      for (contact::NodalContactForce f : w.now.objects[part].touching) {
        f.force *= duration;
        w.now.objects[part].impulses.push_back(f);
      }
}

/// Instruments that stand elsewhere than where their way begins are moved there first, and leave no
/// speed behind.
void clear_jumps(World& w, const IslandParts& island, contact::IslandMotion& motion,
                 IslandMembers& members, double h) {
  std::size_t parts = 0;
  std::vector<contact::Pose> from, to;
  for (std::size_t n = 0; n < island.instruments.size(); ++n) {
    const Instrument& i = w.now.instruments[island.instruments[n]];
    from.push_back(members.instruments[n].pose());
    to.push_back(i.coupled ? from.back() : i.way.at(w.now.clock.time));
    if (from.back() != to.back())
      parts = std::max(parts, parts_of_way(i.shape, from.back(), to.back()));
  }
  if (parts == 0)
    return;
  const double start = w.now.clock.time;
  for (BodyMember& body : members.bodies)
    body.set_clearing(true);
  for (std::size_t part = 1; part <= parts; ++part) {
    for (std::size_t n = 0; n < from.size(); ++n)
      if (!w.now.instruments[island.instruments[n]].coupled)
        members.instruments[n].set_target(
            contact::between(from[n], to[n],
                             static_cast<double>(part) / static_cast<double>(parts)),
            h);
    motion.advance(members.all, start, start + h, w.context);
  }
  for (BodyMember& body : members.bodies)
    body.set_clearing(false);
  for (InstrumentMember& instrument : members.instruments)
    instrument.follow_way();
}

void advance_island(World& w, IslandParts& island, double to) {
  for (std::shared_ptr<Body>& body : island.bodies)
    if (!body->moving->has_contact_steps())
      make_implicit(w, body);
  for (const auto& body : island.bodies)
    if (body->changed)
      load_body(w, *body);
  const double start = w.now.clock.time, duration = to - start;
  double step = HUGE_VAL;
  for (const auto& body : island.bodies)
    step = std::min(step, integration_step(w, *body));
  IslandCache& cache = island_of(w, island);
  std::vector<contact::Pose> stood;
  for (const std::size_t k : island.instruments) {
    const Instrument& i = w.now.instruments[k];
    stood.push_back(i.coupled ? contact::Pose{i.coupled->place, i.before.turn} : i.before);
  }
  IslandMembers members;
  make_members(w, island, cache, stood, members);
  for (StaticMember& member : members.statics)
    member.follow_load(start, to);
  const double count = std::max(1.0, std::ceil(duration / step * (1 - 1e-12)));
  const double h = duration / count;
  contact::StepParts parts;
  for (const auto& body : island.bodies)
    if (body->step_parts.halvings > parts.halvings)
      parts = body->step_parts;
  try {
    clear_jumps(w, island, *cache.motion, members, h);
    double taken = 0; // steps
    while (taken < count) {
      const double begin = start + taken * h;
      ++taken;
      const double end = taken == count ? to : start + taken * h;
      cache.motion->advance(members.all, begin, end, parts, w.context, w.now.settings.order);
      if (end < to && has_come_to_rest(w, island, end, to)) {
        sleep_on(w, island, to - end);
        break;
      }
    }
  } catch (const contact::NotSolved& error) {
    count_contact(w, cache.motion->take_report());
    fail_contact(w, island, error);
  } catch (const dynamics::MotionError& error) {
    for (const auto& body : island.bodies) {
      body->failure = std::current_exception();
      raise(w, *body);
    }
  }
  for (const auto& body : island.bodies)
    body->step_parts = parts;
  count_contact(w, cache.motion->take_report());
  for (const std::size_t index : island.statics)
    w.now.objects[index].in_motion = true;
}

/// \param late pairs that count as near \return pairs that have come near, of what moved apart
std::vector<NodePair> advance_once(World& w, double to, const std::set<NodePair>& late) {
  const double duration = to - w.now.clock.time;
  Extents extents(w);
  const Ways ways{w, to, extents};
  Graph graph;
  std::vector<NodePair> near, apart;
  if (duration > 0 && !w.now.bodies.empty())
    graph = graph_of(w);
  graph.objects = w.now.objects.size();
  for (const NodePair& pair : graph.pairs)
    (late.contains(pair) || ways.are_near(pair, graph.objects) ? near : apart).push_back(pair);
  std::vector<IslandParts> islands = islands_of(w, graph, near);
  for (const auto& body : w.now.bodies) {
    body->taken = 0;
    if (body->changed) {
      load_body(w, *body);
      for (const std::size_t part : body->parts)
        extents.forget(part);
    }
  }
  if (!(duration > 0))
    return {};
  std::map<std::size_t, Box3> boxes; // of what is apart
  for (const auto& [a, b] : apart)
    for (const std::size_t node : {a, b})
      if (node < graph.objects && !boxes.contains(node))
        boxes[node] = ways.of_object(node).box;
  std::set<const Body*> in_island;
  std::set<std::size_t> coupled;
  for (IslandParts& island : islands) {
    const bool asleep = sleeps(w, island, to);
    if (asleep)
      sleep_on(w, island, duration);
    else
      advance_island(w, island, to);
    for (const auto& body : island.bodies)
      in_island.insert(body.get());
    for (const std::size_t k : island.instruments) {
      coupled.insert(k);
      w.now.instruments[k].stepped = true;
    }
  }
  std::vector<Body*> free;
  for (const auto& body : w.now.bodies)
    if (!in_island.contains(body.get())) {
      if (std::ranges::any_of(
              body->parts, [&](std::size_t part) { return !w.now.objects[part].touching.empty(); }))
        body->moving->wake(); // what touched it has gone
      body->moving->clear_contact();
      for (const std::size_t part : body->parts)
        w.now.objects[part].touching.clear();
      free.push_back(body.get());
    }
  advance_freely(w, free, to);
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k) {
    Instrument& i = w.now.instruments[k];
    const bool with_statics =
        i.coupled && !i.stepped && std::ranges::any_of(w.now.objects, [](const Object& object) {
          return object.method == Method::ffe;
        });
    if (i.coupled && !coupled.contains(k) && !with_statics)
      follow_hand(i, duration, to);
    if (!with_statics) {
      i.before = i.pose(to);
      i.changed = false;
    }
  }
  // Behind the way of all.
  std::vector<NodePair> met;
  Extents after(w);
  const Ways arrived{w, to, after};
  const auto passed = [&](std::size_t node) {
    if (node >= graph.objects)
      return ways.of_instrument(node - graph.objects);
    Box3 box = boxes.at(node);
    const Box3 now = arrived.arrived(node);
    box.add(now.min);
    box.add(now.max);
    return box;
  };
  for (const NodePair& pair : apart)
    if (gewebe::contact::near(passed(pair.first), passed(pair.second)))
      met.push_back(pair);
  return met;
}

} // namespace

void follow_hand(Instrument& i, double duration, double to) {
  Instrument::Coupled& c = *i.coupled;
  const Vec3 hand = i.way.at(to).place;
  const contact::CouplingStep step(c.coupling, c.lag, duration);
  const Vec3 place = hand - step.lag({});
  c.force = {};
  c.lag = hand - place;
  c.place = place;
}

void begin_contact(World& w) {
  for (Instrument& i : w.now.instruments)
    i.stepped = false;
  for (Object& object : w.now.objects)
    object.in_motion = false;
}

void advance_bodies(World& w, double to) {
  for (std::size_t i = 0; i < w.now.objects.size(); ++i)
    if (w.now.objects[i].method == Method::ela &&
        (!w.now.objects[i].load->empty() || instruments_there(w) || w.now.objects[i].meets))
      need_body(w, i);
  const bool may_be_late = !w.now.bodies.empty() &&
                           (!w.now.contacts.empty() || instruments_there(w)) &&
                           to > w.now.clock.time;
  std::set<NodePair> late;
  for (;;) {
    std::optional<Snapshot> saved;
    if (may_be_late)
      saved = snapshot(w);
    const std::vector<NodePair> met = advance_once(w, to, late);
    if (met.empty())
      break;
    roll_back(w, std::move(*saved));
    late.insert(met.begin(), met.end());
  }
  SimulationCounts& counts = w.now.counts;
  for (const auto& body : w.now.bodies) {
    const dynamics::SolidStepCounts took = body->moving->take_counts();
    add_counts(counts.solids, took);
    if (took.unfinished > 0)
      w.now.news.unfinished.insert(w.now.news.unfinished.end(), body->parts.begin(),
                                   body->parts.end());
  }
  if (!(to > w.now.clock.time))
    return;
  for (const Object& object : w.now.objects)
    counts.resting += object.method == Method::ela && object.body == nullptr ? 1 : 0;
  for (const auto& body : w.now.bodies)
    for (const std::size_t part : body->parts) {
      counts.integration += body->taken;
      counts.resting += body->taken == 0 ? 1 : 0;
      counts.moving += body->taken == 0 ? 0 : 1;
      Shown& shown = w.now.objects[part].shown;
      shown.valid = shown.valid && body->taken == 0;
    }
}

void end_contact(World& w, double duration) {
  if (!(duration > 0))
    return;
  for (Object& object : w.now.objects) {
    if (object.method != Method::ela)
      continue;
    std::vector<contact::NodalContactForce> means =
        contact::sums_of(std::exchange(object.impulses, {}));
    for (contact::NodalContactForce& f : means)
      f.force = f.force / duration;
    object.shown.valid = object.shown.valid && object.shown.contact == means;
    object.shown.contact = std::move(means);
  }
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
  }
  return all;
}

/// Parts that came off an object touch what it touched, and each other if it touched itself.
void move_contacts(World& w, std::size_t index, const Moves& moves) {
  std::vector<ContactRule> all;
  const auto pieces_of = [&](std::size_t object) {
    return object == index ? moves.objects : std::vector<std::size_t>{object};
  };
  for (const ContactRule& rule : w.now.contacts)
    for (const std::size_t one : pieces_of(rule.object))
      for (const std::size_t other : pieces_of(rule.other))
        if (rule.object != rule.other || one <= other)
          all.push_back({one, other, rule.friction});
  w.now.contacts = std::move(all);
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
}

namespace {

/// Separates the walls of cuts that were made before the contact was set, and overlaps.
void separate(World& w, const SetContact& c) {
  Motions motions;
  for (const std::size_t index : {c.object, c.other})
    if (const auto& body = w.now.objects[index].body)
      for (const std::size_t part : body->parts) {
        const std::span<const dynamics::NodeMotion> all = motion_of(w.now.objects[part]);
        motions[part].assign(all.begin(), all.end());
      }
  require_parted_holds(w, c, motions);
  std::vector<std::size_t> objects{c.object, c.other};
  objects.resize(c.object == c.other ? 1 : 2);
  std::vector<std::size_t> moved = separate_walls(w, objects, motions);
  if (c.separate) {
    std::vector<ContactRule> rules{{c.object, c.other, c.friction}};
    std::ranges::copy_if(w.now.contacts, std::back_inserter(rules), [&](const ContactRule& rule) {
      return std::ranges::any_of(
          objects, [&](std::size_t index) { return rule.object == index || rule.other == index; });
    });
    const std::vector<std::size_t> more = separate_overlaps(w, rules, objects, motions);
    moved.insert(moved.end(), more.begin(), more.end());
  }
  if (std::ranges::none_of(
          moved, [&](std::size_t index) { return w.now.objects[index].method == Method::ela; }))
    return;
  for (const auto& [index, motion] : motions)
    if (const std::shared_ptr<Body> body = w.now.objects[index].body) {
      drop_body(w, body.get());
      for (const std::size_t part : body->parts)
        w.now.objects[part].body = nullptr;
    }
  renew_bodies(w, motions);
}

} // namespace

void Rule<SetContact>::apply(World& w, const SetContact& c) {
  const ContactRule rule{c.object, c.other, c.friction};
  if (!c.separate)
    require_apart(w, rule);
  separate(w, c);
  require_outside(w, rule, c.separate);
  if (c.separate)
    let_instruments_enter(w);
  const auto known = std::ranges::find_if(w.now.contacts, [&](const ContactRule& other) {
    return std::minmax(other.object, other.other) == std::minmax(c.object, c.other);
  });
  if (known != w.now.contacts.end())
    known->friction = c.friction;
  else
    w.now.contacts.push_back(rule);
  for (const std::size_t index : {c.object, c.other}) {
    Object& object = w.now.objects[index];
    object.meets = true;
    object.shown.valid = object.shown.valid && object.method == Method::ela;
    if (object.body != nullptr)
      object.body->moving->wake();
  }
}

void Rule<SetContact>::log(const World& w, const SetContact& c, ChangeRow& row) {
  row.what = "contact";
  row.other = w.now.objects.at(c.other).name();
  row.value = c.friction;
  row.text = c.separate ? "separate" : "";
}

} // namespace gewebe::scene
