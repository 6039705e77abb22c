// Renumbering of nodes: updates everything that refers to nodes of an object after a cut.

#include "base/disjoint_sets.h"
#include "geometry/vector_at.h"
#include "scene/rules_internal.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe::scene {

void Moves::add(std::span<const std::pair<std::uint32_t, To>> ways, std::size_t nodes) {
  first.assign(nodes + 1, 0);
  for (const auto& [node, to] : ways)
    ++first[node + std::size_t{1}];
  for (std::size_t i = 0; i < nodes; ++i)
    first[i + 1] += first[i];
  all.resize(ways.size());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (const auto& [node, to] : ways)
    all[next[node]++] = to;
}

/// The object that replaces `old`: it has another model, and no data by node.
Object renumbered(const Object& old, std::shared_ptr<const model::Model> model) {
  const auto gravity_of = [](const contact::Load& load) {
    contact::Load alone;
    alone.gravity = load.gravity;
    return alone;
  };
  Object next = old;
  next.matter = std::make_shared<Matter>(*old.matter);
  next.matter->model = std::move(model);
  next.matter->known = true;
  next.matter->size = 0;
  next.matter->counts.reset();
  if (is_solid(old))
    next.matter->shortest_edge = 0; // else it stays: a cut of a net makes none shorter
  next.statics = {};
  next.warped = nullptr;
  next.strained = nullptr;
  next.load = gravity_of(*old.load);
  next.hung = {};
  next.body = nullptr;
  next.offset = 0;
  next.shown = {.displacement = std::vector<double>(3 * next.model().nodes.size(), 0.0),
                .valid = false,
                .load = gravity_of(*old.shown.load),
                .time = old.shown.time,
                .posed = old.shown.posed};
  next.came = {.load = gravity_of(*old.came.load), .duration = old.came.duration};
  next.impulses.clear();
  next.touching.clear();
  next.cut = {.tear = old.cut.tear, .limit = old.cut.limit};
  return next;
}

std::vector<double> moved_field(const Moves& moves, std::size_t object,
                                std::span<const double> field) {
  std::size_t nodes = 0;
  const auto count = [&](const auto& one) {
    if (one.object == object)
      nodes = std::max(nodes, one.node + std::size_t{1});
  };
  std::ranges::for_each(moves.all, count);
  std::ranges::for_each(moves.between, count);
  std::vector<double> moved(3 * nodes, 0.0);
  for (std::uint32_t i = 0; i < field.size() / 3; ++i)
    for (const Moves::To& to : moves.of(i))
      if (to.object == object)
        for (int a = 0; a < 3; ++a)
          moved[axis_of(to.node, a)] = field[axis_of(i, a)];
  for (const Moves::Between& b : moves.between)
    if (b.object == object)
      for (int a = 0; a < 3; ++a) {
        double& at = moved[axis_of(b.node, a)] = 0;
        for (const auto& [node, share] : b.of)
          at += share * field[axis_of(node, a)];
      }
  return moved;
}

namespace {

std::string free_name(const World& w, const std::string& name) {
  for (std::size_t k = 1;; ++k) {
    std::string wish = name + "." + std::to_string(k);
    if (std::none_of(w.now.objects.begin(), w.now.objects.end(),
                     [&](const Object& object) { return object.name() == wish; }))
      return wish;
  }
}

/// The objects that take one's place, by the number of where a node goes.
class Pieces {
public:
  Pieces(const Moves& moves, std::deque<Object>& all) : moves_(moves), all_(all) {}

  Object& operator()(const Moves::To& to) const {
    const auto at = std::find(moves_.objects.begin(), moves_.objects.end(), to.object);
    return all_[static_cast<std::size_t>(at - moves_.objects.begin())];
  }

  /// What nodes have, to the lists that `list_of` names.
  template <class From, class ListOf>
  void follow(const From& from, ListOf&& list_of) const {
    for (const auto& [node, value] : from)
      for (const Moves::To& to : moves_.of(node))
        if (auto& all = list_of((*this)(to)); to.main || !all.contains(to.node))
          all[to.node] = value;
  }

  template <class LoadOf>
  void follow_load(const contact::Load& from, LoadOf&& load_of) const {
    for (const auto& [node, force] : from.force)
      for (const Moves::To& to : moves_.of(node)) {
        contact::Load& load = load_of((*this)(to));
        load.force[to.node] += to.share * force;
        if (const auto p = from.force_period.find(node); p != from.force_period.end())
          load.force_period[to.node] = p->second;
      }
    follow(from.pressure, [&](Object& o) -> auto& { return load_of(o).pressure; });
    follow(from.displacement, [&](Object& o) -> auto& { return load_of(o).displacement; });
    follow(from.ramp, [&](Object& o) -> auto& { return load_of(o).ramp; });
    for (const Moves::Between& b : moves_.between)
      join_load(from, b, load_of((*this)({.object = b.object, .node = b.node})));
  }

private:
  /// What all nodes have between which one stands.
  template <class Value>
  static std::optional<std::vector<std::pair<Value, double>>>
  shared(const std::map<std::uint32_t, Value>& from, const Moves::Between& b) {
    std::vector<std::pair<Value, double>> all;
    for (const auto& [node, share] : b.of) {
      const auto at = from.find(node);
      if (at == from.end())
        return std::nullopt;
      all.emplace_back(at->second, share);
    }
    return all;
  }

  /// A node among displaced ones is displaced if they go together, one among pressed ones is
  /// pressed.
  static void join_load(const contact::Load& from, const Moves::Between& b, contact::Load& load) {
    if (const auto pressures = shared(from.pressure, b)) {
      contact::NodePressure sum{0, (*pressures)[0].first.period};
      bool alike = true;
      for (const auto& [pressure, share] : *pressures) {
        sum.pressure += share * pressure.pressure;
        alike = alike && pressure.period == sum.period;
      }
      if (alike)
        load.pressure[b.node] = sum;
    }
    const auto displacements = shared(from.displacement, b);
    if (!displacements)
      return;
    const bool on_their_way =
        std::ranges::any_of(b.of, [&](const auto& one) { return from.ramp.contains(one.first); });
    if (on_their_way) {
      const auto ramps = shared(from.ramp, b);
      if (!ramps)
        return;
      contact::Ramp sum = (*ramps)[0].first;
      const auto way_of = [](const contact::Ramp& ramp) {
        return ramp.by ? std::optional<contact::PoseWay>(ramp.by->way) : std::nullopt;
      };
      for (const auto& [ramp, share] : *ramps)
        if (ramp.start != sum.start || ramp.end != sum.end || !(way_of(ramp) == way_of(sum)))
          return;
      sum.from = sum.to = {};
      if (sum.by)
        sum.by->point = sum.by->rest = {};
      for (const auto& [ramp, share] : *ramps) {
        sum.from += share * ramp.from;
        sum.to += share * ramp.to;
        if (sum.by) {
          sum.by->point += share * ramp.by->point;
          sum.by->rest += share * ramp.by->rest;
        }
      }
      load.ramp[b.node] = sum;
    }
    Vec3& at = load.displacement[b.node] = {};
    for (const auto& [displacement, share] : *displacements)
      at += share * displacement;
  }

  const Moves& moves_;
  std::deque<Object>& all_;
};

/// Shape, forces and loads.
void move_shown(const Object& old, const Moves& moves, std::deque<Object>& pieces) {
  const Pieces piece(moves, pieces);
  piece.follow_load(*old.load, [](Object& o) -> contact::Load& { return o.load.write(); });
  piece.follow_load(*old.shown.load,
                    [](Object& o) -> contact::Load& { return o.shown.load.write(); });
  piece.follow_load(*old.came.load,
                    [](Object& o) -> contact::Load& { return o.came.load.write(); });
  for (const auto& [node, mass] : *old.hung)
    for (const Moves::To& to : moves.of(node))
      if (to.share > 0)
        piece(to).hung.write()[to.node] += to.share * mass;
  piece.follow(old.came.touched, [](Object& o) -> auto& { return o.came.touched; });
  std::map<std::size_t, std::map<std::uint32_t, Vec3>> forces;
  for (const contact::NodeVector& f : *old.shown.forces)
    for (const Moves::To& to : moves.of(f.node))
      forces[to.object][to.node] += to.share * f.value;
  for (const auto& [index, all] : forces)
    for (const auto& [node, value] : all)
      piece({.object = index}).shown.forces.write().push_back({node, value});
  for (const contact::NodalContactForce& t : old.shown.contact)
    for (const Moves::To& to : moves.of(t.node))
      if (to.main)
        piece(to).shown.contact.push_back({to.node, t.instrument, t.force});
  for (const contact::NodalContactForce& t : old.impulses)
    for (const Moves::To& to : moves.of(t.node))
      if (to.main)
        piece(to).impulses.push_back({to.node, t.instrument, t.force});
  for (const contact::NodalContactForce& t : old.touching)
    for (const Moves::To& to : moves.of(t.node))
      if (to.main)
        piece(to).touching.push_back({to.node, t.instrument, t.force});
  const std::span<const double> shape = known_shape(old);
  for (std::uint32_t i = 0; old.shown.shaped && i < old.model().nodes.size(); ++i) {
    const Vec3 u = vector_at(shape, i);
    for (const Moves::To& to : moves.of(i)) {
      if (!to.main && moves.objects.size() == 1 && moves.of(i).size() == 1)
        continue;
      std::vector<double>& moved = piece(to).shown.displacement.write();
      for (int a = 0; a < 3; ++a)
        moved[axis_of(to.node, a)] = u[a];
    }
  }
  for (const Moves::Between& b : moves.between) {
    if (!old.shown.shaped)
      break;
    Vec3 u;
    for (const auto& [node, share] : b.of)
      u += share * vector_at(shape, node);
    std::vector<double>& moved = piece({.object = b.object}).shown.displacement.write();
    for (int a = 0; a < 3; ++a)
      moved[axis_of(b.node, a)] = u[a];
  }
}

void move_grips(World& w, std::size_t index, const Moves& moves) {
  for (Instrument& i : w.now.instruments) {
    std::vector<Instrument::Grip> grips;
    for (const Instrument::Grip& grip : i.grips) {
      if (grip.object != index) {
        grips.push_back(grip);
        continue;
      }
      for (const Moves::To& to : moves.of(grip.node))
        if (std::none_of(grips.begin(), grips.end(), [&](const Instrument::Grip& g) {
              return g.object == to.object && g.node == to.node;
            }))
          grips.push_back({to.object, to.node, grip.point});
    }
    for (const Moves::Between& b : moves.between) { // what stands among grasped nodes
      Vec3 point;
      std::size_t found = 0;
      for (const auto& [node, share] : b.of)
        for (const Instrument::Grip& grip : i.grips)
          if (grip.object == index && grip.node == node) {
            point += share * grip.point;
            ++found;
          }
      if (found != b.of.size())
        continue;
      const auto own = std::ranges::find_if(grips, [&](const Instrument::Grip& g) {
        return g.object == b.object && g.node == b.node;
      });
      if (own != grips.end())
        own->point = point;
      else
        grips.push_back({b.object, b.node, point});
    }
    i.grips = std::move(grips);
  }
}

void move_ties(World& w, std::size_t index, const Moves& moves) {
  const auto follow = [&](std::size_t& object, std::uint32_t& node) {
    if (object != index)
      return;
    const std::span<const Moves::To> ways = moves.of(node);
    const auto main =
        std::find_if(ways.begin(), ways.end(), [](const auto& to) { return to.main; });
    const Moves::To& to = main != ways.end() ? *main : ways[0];
    object = to.object;
    node = to.node;
  };
  for (Tie& tie : w.now.ties) {
    follow(tie.object, tie.node);
    follow(tie.other, tie.other_node);
  }
}

// ---- events that wait

using Nodes = std::vector<std::uint32_t>;

/// Of these nodes, those in an object now; of several copies all, or the main one.
Nodes nodes_in(const Moves& moves, std::size_t object, const Nodes& nodes, bool copies) {
  Nodes now;
  for (const std::uint32_t node : nodes)
    for (const Moves::To& to : moves.of(node))
      if (to.object == object && (copies || to.main))
        now.push_back(to.node);
  const std::set<std::uint32_t> named(nodes.begin(), nodes.end());
  for (const Moves::Between& b : moves.between)
    if (copies && b.fresh && b.object == object &&
        std::ranges::all_of(b.of, [&](const auto& one) { return named.contains(one.first); }))
      now.push_back(b.node);
  std::sort(now.begin(), now.end());
  now.erase(std::unique(now.begin(), now.end()), now.end());
  return now;
}

/// Follows the nodes that a change names, where they are the object's. \return what it becomes:
/// several where what it is about has come apart, none where nothing is left of it
template <class Kind>
std::vector<Change> followed(const Kind& c, std::size_t index, const Moves& moves) {
  if constexpr (requires { c.others; }) {
    Kind moved = c;
    if (c.object == index)
      moved.nodes = nodes_in(moves, index, c.nodes, Rule<Kind>::copies);
    if (c.other == index)
      moved.others = nodes_in(moves, index, c.others, Rule<Kind>::copies);
    if (moved.nodes.empty() || moved.others.empty())
      return {};
    return {moved};
  } else if constexpr (requires { c.nodes; }) {
    if (c.object != index)
      return {c};
    std::vector<Change> all;
    for (const std::size_t object : moves.objects) {
      Kind moved = c;
      moved.object = object;
      moved.nodes = nodes_in(moves, object, c.nodes, Rule<Kind>::copies);
      if (!moved.nodes.empty())
        all.emplace_back(std::move(moved));
    }
    return all;
  } else {
    return {c};
  }
}

/// Empty, nodes would stand for all.
std::vector<Change> followed(const CutObject& c, std::size_t index, const Moves& moves) {
  CutObject moved = c;
  if (c.object != index)
    return {moved};
  if (auto* const springs = std::get_if<SpringsToCut>(&moved.what)) {
    springs->from = nodes_in(moves, index, springs->from, true);
    springs->to = nodes_in(moves, index, springs->to, true);
    if (springs->from.empty() || springs->to.empty())
      return {};
  } else if (auto& plane = std::get<PlaneToCut>(moved.what); plane.nodes) {
    plane.nodes = nodes_in(moves, index, *plane.nodes, true);
    if (plane.nodes->empty())
      return {};
  }
  return {moved};
}

/// Those about nodes are about the same nodes still, wherever they have gone.
void move_events(World& w, std::size_t index, const Moves& moves) {
  std::multimap<double, Event> events;
  for (const auto& [time, event] : *w.now.events) {
    std::vector<Change> changes =
        std::visit([&](const auto& c) { return followed(c, index, moves); }, event.change);
    for (Change& change : changes) {
      Event moved = event;
      moved.change = std::move(change);
      events.emplace_hint(events.end(), time, std::move(moved));
    }
  }
  w.now.events = std::move(events);
}

// ---- motion

/// Motions of the pieces of an object, and of objects that shared its body.
Motions motions_of(const World& w, std::size_t index, const Moves& moves,
                   const std::deque<Object>& pieces, std::span<const Vec3> velocity) {
  const Object& old = w.now.objects[index];
  Motions motions;
  std::vector<dynamics::NodeMotion> motion;
  if (old.body != nullptr) {
    for (const std::size_t part : old.body->parts) {
      const std::span<const dynamics::NodeMotion> all = motion_of(w.now.objects[part]);
      (part != index ? motions[part] : motion).assign(all.begin(), all.end());
    }
  } else if (old.method == Method::ffe && moves.objects.size() > 1) {
    for (std::size_t i = 0; i < old.model().nodes.size(); ++i)
      motion.push_back({vector_at(known_shape(old), i), velocity.empty() ? Vec3{} : velocity[i]});
  }
  if (motion.empty())
    return motions;
  dynamics::NodeMotion mean; // of nodes that were gone
  for (const dynamics::NodeMotion& m : motion) {
    mean.displacement += m.displacement / static_cast<double>(motion.size());
    mean.velocity += m.velocity / static_cast<double>(motion.size());
  }
  for (std::size_t k = old.body != nullptr ? 0 : 1; k < pieces.size(); ++k) {
    const model::Model& model = pieces[k].model();
    std::vector<dynamics::NodeMotion>& to = motions[moves.objects[k]];
    to.resize(model.nodes.size());
    for (std::size_t i = 0; i < to.size(); ++i)
      if (model.nodes[i].fixed == model::fixed_none)
        to[i] = mean;
  }
  for (const bool main : {true, false}) // copies stand where their node does
    for (std::uint32_t i = 0; i < motion.size(); ++i)
      for (const Moves::To& to : moves.of(i))
        if (const auto at = motions.find(to.object);
            at != motions.end() && to.main == main && (main || moves.of(i).size() > 1))
          at->second[to.node] = motion[i];
  for (const Moves::Between& b : moves.between) {
    const auto at = motions.find(b.object);
    if (at == motions.end())
      continue;
    dynamics::NodeMotion sum;
    for (const auto& [node, share] : b.of) {
      sum.displacement += share * motion[node].displacement;
      sum.velocity += share * motion[node].velocity;
    }
    const auto piece = std::ranges::find(moves.objects, b.object) - moves.objects.begin();
    for (int a = 0; a < 3; ++a)
      if (contact::is_fixed(pieces[static_cast<std::size_t>(piece)].model(), b.node, a))
        sum.displacement[a] = sum.velocity[a] = 0;
    at->second[b.node] = sum;
  }
  return motions;
}

} // namespace

/// Creates new bodies for these objects and those attached to them, with the given motions.
/// \pre objects that are in a body have a motion
void renew_bodies(World& w, const Motions& motions) {
  DisjointSets sets(w.now.objects.size());
  for (const Tie& tie : w.now.ties)
    sets.join(static_cast<std::uint32_t>(tie.object), static_cast<std::uint32_t>(tie.other));
  std::map<std::uint32_t, std::vector<std::size_t>> groups;
  for (const auto& [object, motion] : motions)
    groups[sets.find(static_cast<std::uint32_t>(object))].push_back(object);
  for (const auto& [name, group] : groups)
    w.now.bodies.push_back(make_body(w, group, &motions));
}

/// The object and what came off it take its place; all that names its nodes follows.
/// \param pieces as moves.objects
/// \param velocity of the nodes of an elastostatic object; none: it stands still
void move_all(World& w, std::size_t index, const Moves& moves, std::deque<Object> pieces,
              std::span<const Vec3> velocity) {
  const Object old = w.now.objects[index];
  statics::ElastostaticCounts& spent = pieces[0].statics.spent;
  add_counts(spent, old.statics.spent);
  if (old.statics.solver)
    add_counts(spent, old.statics.solver->counts());
  move_shown(w.now.objects[index], moves, pieces);
  Motions motions = motions_of(w, index, moves, pieces, velocity);
  if (old.body != nullptr) {
    drop_body(w, old.body.get());
    for (const std::size_t part : old.body->parts)
      w.now.objects[part].body = nullptr;
  }
  w.now.objects[index] = std::move(pieces[0]);
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    pieces[k].matter->name = free_name(w, old.name());
    w.now.objects.push_back(std::move(pieces[k]));
  }
  move_grips(w, index, moves);
  move_ties(w, index, moves);
  move_contacts(w, index, moves);
  move_events(w, index, moves);
  if (std::ranges::any_of(w.now.contacts, [&](const ContactRule& rule) {
        return rule.object == index && rule.other == index;
      }))
    separate_walls(w, moves.objects, motions);
  // Walls of wounds in a strained body may pass other surfaces.
  std::vector<ContactRule> rules;
  std::ranges::copy_if(w.now.contacts, std::back_inserter(rules), [&](const ContactRule& rule) {
    return std::ranges::any_of(moves.objects, [&](std::size_t object) {
      return rule.object == object || rule.other == object;
    });
  });
  if (!rules.empty())
    separate_overlaps(w, rules, moves.objects, motions);
  renew_bodies(w, motions);
}

} // namespace gewebe::scene
