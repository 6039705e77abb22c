// When an object's nodes get other numbers, all that names them follows.

#include "base/disjoint_sets.h"
#include "base/vector_at.h"
#include "scene/simulation_internal.h"

#include <algorithm>
#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe {

namespace {

/// Whether a cut between nodes, or through some, names none any more.
bool nothing_left(const CutObject& cut) {
  if (const auto* const springs = std::get_if<SpringsToCut>(&cut.what))
    return springs->from.empty() || springs->to.empty();
  const auto& nodes = std::get<PlaneToCut>(cut.what).nodes;
  return nodes && nodes->empty();
}

} // namespace

void Simulation::Moves::add(std::span<const std::pair<std::uint32_t, To>> ways, std::size_t nodes) {
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

/// An object that goes on in place of the old one, with another model and nothing of its nodes.
std::unique_ptr<Simulation::Object> Simulation::renumbered(const Object& old,
                                                           std::shared_ptr<Model> model) const {
  auto next = std::make_unique<Object>(std::move(model));
  next->name = old.name;
  next->source = old.source;
  next->known = true;
  next->method = old.method;
  next->integration = old.integration;
  next->second = old.second;
  next->displacement.assign(3 * next->model.nodes.size(), 0);
  next->load.gravity = old.load.gravity;
  next->shown = false;
  next->shown_time = old.shown_time;
  next->posed = old.posed;
  next->shown_load.gravity = old.shown_load.gravity;
  next->came.load.gravity = old.came.load.gravity;
  next->came.over = old.came.over;
  next->warned_range = old.warned_range;
  next->shortest_edge = old.shortest_edge; // a cut makes none shorter
  next->looked_at = old.looked_at;
  next->not_looked = old.not_looked;
  next->warned_stuck = old.warned_stuck;
  next->warned_unsolved = old.warned_unsolved;
  next->warned_stages = old.warned_stages;
  next->warned_cut = old.warned_cut;
  next->tear = old.tear;
  return next;
}

std::string Simulation::free_name(const std::string& name) const {
  for (std::size_t k = 1;; ++k) {
    std::string wish = name + "." + std::to_string(k);
    if (std::none_of(objects_.begin(), objects_.end(),
                     [&](const auto& object) { return object->name == wish; }))
      return wish;
  }
}

/// Shape, forces and loads.
void Simulation::move_shown(const Object& old, const Moves& moves,
                            const std::vector<std::unique_ptr<Object>>& pieces) const {
  const auto piece = [&](const Moves::To& to) -> Object& {
    const auto at = std::find(moves.objects.begin(), moves.objects.end(), to.object);
    return *pieces[static_cast<std::size_t>(at - moves.objects.begin())];
  };
  const auto follow = [&](const auto& from, auto&& list_of) {
    for (const auto& [node, value] : from)
      for (const Moves::To& to : moves.of(node))
        if (auto& all = list_of(piece(to)); to.main || !all.contains(to.node))
          all[to.node] = value;
  };
  const auto follow_load = [&](const Load& from, auto&& load_of) {
    for (const auto& [node, force] : from.force)
      for (const Moves::To& to : moves.of(node)) {
        Load& load = load_of(piece(to));
        load.force[to.node] += to.share * force;
        if (const auto p = from.force_period.find(node); p != from.force_period.end())
          load.force_period[to.node] = p->second;
      }
    follow(from.pressure, [&](Object& o) -> auto& { return load_of(o).pressure; });
    follow(from.displacement, [&](Object& o) -> auto& { return load_of(o).displacement; });
    follow(from.travel, [&](Object& o) -> auto& { return load_of(o).travel; });
  };
  follow_load(old.load, [](Object& o) -> Load& { return o.load; });
  follow_load(old.shown_load, [](Object& o) -> Load& { return o.shown_load; });
  follow_load(old.came.load, [](Object& o) -> Load& { return o.came.load; });
  follow(old.came.touched, [](Object& o) -> auto& { return o.came.touched; });
  std::map<std::size_t, std::map<std::uint32_t, Vec3>> forces;
  for (const NodeVector& f : old.forces)
    for (const Moves::To& to : moves.of(f.node))
      forces[to.object][to.node] += to.share * f.value;
  for (const auto& [index, all] : forces)
    for (const auto& [node, value] : all)
      piece({.object = index}).forces.push_back({node, value});
  for (const NodeTouch& t : old.touches)
    for (const Moves::To& to : moves.of(t.node))
      if (to.main)
        piece(to).touches.push_back({to.node, t.instrument, t.force});
  for (const NodeTouch& t : old.impulses)
    for (const Moves::To& to : moves.of(t.node))
      if (to.main)
        piece(to).impulses.push_back({to.node, t.instrument, t.force});
  for (std::uint32_t i = 0; old.shaped && i < old.model.nodes.size(); ++i) {
    const Vec3 u = vector_at(old.displacement, i);
    for (const Moves::To& to : moves.of(i))
      if (Object& object = piece(to); to.main || moves.objects.size() > 1 || moves.of(i).size() > 1)
        for (std::size_t a = 0; a < 3; ++a)
          object.displacement[3 * std::size_t{to.node} + a] = u[static_cast<int>(a)];
  }
}

void Simulation::move_grips(std::size_t index, const Moves& moves) {
  for (const auto& i : instruments_) {
    std::vector<Instrument::Grip> grips;
    for (const Instrument::Grip& grip : i->grips) {
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
    i->grips = std::move(grips);
  }
}

void Simulation::move_ties(std::size_t index, const Moves& moves) {
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
  undo_->note([this, ties = ties_] { ties_ = ties; });
  for (Tie& tie : ties_) {
    follow(tie.object, tie.node);
    follow(tie.other, tie.other_node);
  }
}

/// Events that wait: those about nodes are about the same nodes still, wherever they have gone.
void Simulation::move_events(std::size_t index, const Moves& moves) {
  using Nodes = std::vector<std::uint32_t>;
  // Of these nodes, those in an object now; of several copies all, or the main one.
  const auto in = [&](std::size_t object, const Nodes& nodes, bool copies) {
    Nodes now;
    for (const std::uint32_t node : nodes)
      for (const Moves::To& to : moves.of(node))
        if (to.object == object && (copies || to.main))
          now.push_back(to.node);
    std::sort(now.begin(), now.end());
    now.erase(std::unique(now.begin(), now.end()), now.end());
    return now;
  };
  std::multimap<double, Event> events;
  const auto keep = [&](double time, const Event& event, Change change) {
    Event moved = event;
    moved.change = std::move(change);
    events.emplace_hint(events.end(), time, std::move(moved));
  };
  for (const auto& [time, event] : events_)
    std::visit(
        [&](const auto& change) {
          using Kind = std::decay_t<decltype(change)>;
          constexpr bool of_nodes = std::is_same_v<Kind, SetForce> ||
                                    std::is_same_v<Kind, SetPressure> ||
                                    std::is_same_v<Kind, SetDisplacement> ||
                                    std::is_same_v<Kind, Release> || std::is_same_v<Kind, Grasp>;
          if constexpr (of_nodes) {
            if (change.object != index) {
              keep(time, event, change);
              return;
            }
            for (const std::size_t object : moves.objects) {
              Kind moved = change;
              moved.object = object;
              moved.nodes = in(object, change.nodes, !std::is_same_v<Kind, SetForce>);
              if (!moved.nodes.empty())
                keep(time, event, std::move(moved));
            }
          } else if constexpr (std::is_same_v<Kind, Attach>) {
            Attach moved = change;
            if (change.object == index)
              moved.nodes = in(index, change.nodes, false);
            if (change.other == index)
              moved.others = in(index, change.others, false);
            if (!moved.nodes.empty() && !moved.others.empty())
              keep(time, event, std::move(moved));
          } else if constexpr (std::is_same_v<Kind, CutObject>) {
            CutObject moved = change;
            if (change.object == index) {
              if (auto* const springs = std::get_if<SpringsToCut>(&moved.what)) {
                springs->from = in(index, springs->from, true);
                springs->to = in(index, springs->to, true);
              } else if (auto& plane = std::get<PlaneToCut>(moved.what); plane.nodes) {
                plane.nodes = in(index, *plane.nodes, true);
              }
              if (nothing_left(moved))
                return; // empty, nodes would stand for all
            }
            keep(time, event, std::move(moved));
          } else {
            keep(time, event, change);
          }
        },
        event.change);
  undo_->note([this, before = std::make_shared<std::multimap<double, Event>>(events_)] {
    std::swap(events_, *before);
  });
  events_ = std::move(events);
}

/// Bodies anew for these objects and those tied to them, with the motions given.
/// \pre objects that are in a body have a motion
void Simulation::renew_bodies(const std::vector<std::size_t>& objects, const Motions& motions) {
  DisjointSets sets(objects_.size());
  for (const Tie& tie : ties_)
    sets.join(static_cast<std::uint32_t>(tie.object), static_cast<std::uint32_t>(tie.other));
  std::map<std::uint32_t, std::vector<std::size_t>> groups;
  std::vector<std::size_t> all = objects;
  std::sort(all.begin(), all.end());
  for (const std::size_t object : all)
    groups[sets.find(static_cast<std::uint32_t>(object))].push_back(object);
  for (auto& [name, group] : groups) {
    std::vector<std::pair<std::size_t, std::pair<Body*, std::size_t>>> were;
    for (const std::size_t object : group)
      were.push_back({object, {objects_[object]->body, objects_[object]->offset}});
    undo_->note([this, were] {
      for (const auto& [object, place] : were)
        std::tie(objects_[object]->body, objects_[object]->offset) = place;
    });
    bodies_.push_back(make_body(group, &motions));
    undo_->note([this] { bodies_.pop_back(); });
  }
}

/// The object and what came off it take its place; all that names its nodes follows.
/// \param pieces as moves.objects
/// \param velocity of the nodes of an elastostatic object; none: it stands still
void Simulation::move_all(std::size_t index, const Moves& moves,
                          std::vector<std::unique_ptr<Object>> pieces,
                          std::span<const Vec3> velocity) {
  Object& old = *objects_[index];
  Object& next = *pieces[0];
  simulation::add_counts(next.spent, old.spent);
  if (old.still)
    simulation::add_counts(next.spent, old.still->counts());
  if (old.body != nullptr)
    gather_impulses(*old.body);
  move_shown(old, moves, pieces);

  // How everybody moves who shares the body.
  Motions motions;
  const auto state_of = [&](const Object& object) {
    const std::span<const NodeMotion> motion =
        object.body->moving->motion().subspan(object.offset, object.model.nodes.size());
    return std::vector<NodeMotion>(motion.begin(), motion.end());
  };
  std::vector<NodeMotion> motion;
  if (old.body != nullptr) {
    for (const std::size_t part : old.body->parts)
      if (part != index)
        motions[part] = state_of(*objects_[part]);
    motion = state_of(old);
  } else if (old.method == Method::ffe && moves.objects.size() > 1) {
    for (std::size_t i = 0; i < old.model.nodes.size(); ++i)
      motion.push_back({vector_at(old.displacement, i), velocity.empty() ? Vec3{} : velocity[i]});
  }
  if (!motion.empty())
    for (std::size_t k = old.body != nullptr ? 0 : 1; k < pieces.size(); ++k) {
      NodeMotion mean; // of nodes that were gone
      for (const NodeMotion& m : motion) {
        mean.displacement += m.displacement / static_cast<double>(motion.size());
        mean.velocity += m.velocity / static_cast<double>(motion.size());
      }
      const Model& model = pieces[k]->model;
      std::vector<NodeMotion>& to = motions[moves.objects[k]];
      to.resize(model.nodes.size());
      for (std::size_t i = 0; i < to.size(); ++i)
        if (model.nodes[i].fixed == fixed_none)
          to[i] = mean;
    }
  for (std::uint32_t i = 0; i < motion.size(); ++i)
    for (const Moves::To& to : moves.of(i))
      if (const auto at = motions.find(to.object); at != motions.end() && to.main)
        at->second[to.node] = motion[i];
  for (std::uint32_t i = 0; i < motion.size(); ++i) // copies stand where their node does
    for (const Moves::To& to : moves.of(i))
      if (const auto at = motions.find(to.object);
          at != motions.end() && !to.main && moves.of(i).size() > 1)
        at->second[to.node] = motion[i];

  if (old.body != nullptr) {
    const auto at = std::find_if(bodies_.begin(), bodies_.end(),
                                 [&](const auto& body) { return body.get() == old.body; });
    const auto place = at - bodies_.begin();
    const auto body = std::make_shared<std::unique_ptr<Body>>(std::move(*at));
    bodies_.erase(at);
    for (const std::size_t part : (*body)->parts)
      objects_[part]->body = nullptr;
    // The body's parts have it back when the objects are back.
    std::vector<std::size_t> offsets;
    for (const std::size_t part : (*body)->parts)
      offsets.push_back(objects_[part]->offset);
    undo_->note([this, body, place, offsets] {
      for (std::size_t k = 0; k < offsets.size(); ++k) {
        Object& object = *objects_[(*body)->parts[k]];
        object.body = body->get();
        object.offset = offsets[k];
      }
      bodies_.insert(bodies_.begin() + place, std::move(*body));
    });
  }
  const auto before = std::make_shared<std::unique_ptr<Object>>();
  undo_->note([this, index, before, count = objects_.size()] {
    objects_.resize(count);
    objects_[index] = std::move(*before);
  });
  *before = std::move(objects_[index]);
  objects_[index] = std::move(pieces[0]);
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    pieces[k]->name = free_name(next.name);
    objects_.push_back(std::move(pieces[k]));
  }
  move_grips(index, moves);
  move_ties(index, moves);
  move_events(index, moves);
  if (motions.empty())
    return;
  std::vector<std::size_t> objects;
  for (const auto& [object, one] : motions)
    objects.push_back(object);
  renew_bodies(objects, motions);
}

} // namespace gewebe
