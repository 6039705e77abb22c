#include "statics/static_contact.h"

#include "base/vector_at.h"
#include "statics/contact_turns_internal.h"
#include "statics/elastostatic_yielding.h"
#include "statics/giving_contact_internal.h"

#include <algorithm>
#include <cmath>
#include <map>

// Based on: B. Marks, G. Wright, A general inner approximation algorithm for nonconvex mathematical
// programs, 1978; D. Anderson, Iterative procedures for nonlinear integral equations, 1965.

namespace gewebe {

namespace {

constexpr std::size_t max_new = 256; ///< pieces that join at once, the deepest
constexpr double outside = 1e-9;     ///< of the radius: so deep is not inside
constexpr double deep = 1e-6;
constexpr int max_rounds = 300;    ///< until an object agrees
constexpr double short_way = 0.05; ///< of the radius: the last forces tell how the next ones turn
/// Rounds whose forces were not found, in all: what comes of such is not exact anyway.
constexpr std::size_t max_vain_pairs = 256;

/// Of a piece from an instrument's core, the least.
double distance_of(const PlacedInstrument& instrument, const Facet& piece,
                   const std::array<Vec3, 3>& corners) {
  const bool through = corner_count(piece) == 3 && goes_through(instrument, corners);
  if (through && !instrument.core)
    return 0;
  double least = through ? 0 : HUGE_VAL; // below 0 a corner of it is in a polyhedron
  for_parts(instrument,
            {0, piece[1] == piece[0] ? 0U : 1U,
             piece[1] == piece[0]   ? 0U
             : piece[2] == piece[1] ? 1U
                                    : 2U},
            corners, instrument.radius, [&](CorePart part, const Facet& some) {
              const auto found = nearest_points(
                  instrument, part, {corners[some[0]], corners[some[1]], corners[some[2]]},
                  corner_count(some));
              if (found && !found->behind && !(found->distance >= least))
                least = found->distance;
            });
  return least;
}

/// Whether all corners are on one side of the box, by more than `gap`.
bool beside(const std::array<Vec3, 3>& corners, const Box3& box, double gap) {
  for (int a = 0; a < 3; ++a) {
    const double low = box.min[a] - gap, high = box.max[a] + gap;
    if ((corners[0][a] < low && corners[1][a] < low && corners[2][a] < low) ||
        (corners[0][a] > high && corners[1][a] > high && corners[2][a] > high))
      return true;
  }
  return false;
}

bool short_ways(std::span<const std::optional<MovedInstrument>> instruments) {
  return std::ranges::all_of(instruments, [](const auto& i) {
    return !i || path_length(i->shape, i->before, i->now) <= short_way * i->shape.radius;
  });
}

std::vector<Box3> boxes_of(std::span<const std::optional<PlacedInstrument>> instruments) {
  std::vector<Box3> boxes;
  for (const auto& instrument : instruments)
    if (instrument)
      boxes.push_back(instrument->box());
  return boxes;
}

/// These nodes, where they are not known yet.
void know(Yielding& object, Yielding::Moment moment, std::vector<std::uint32_t> nodes,
          std::vector<double>& shape, std::vector<std::uint8_t>& known) {
  std::erase_if(
      nodes, [&](std::uint32_t node) { return std::exchange(known[node], std::uint8_t{1}) != 0; });
  object.copy_shape(nodes, shape, moment);
}

/// What pushed these nodes to where they were, and how that goes on.
void set_last(std::span<const PointTouch> points, const ContactNodes& all, ContactTurns& turns) {
  turns.guess = all.was;
  for (const PointTouch& t : points) {
    TouchPair pair{t.instrument, t.part, {}, {}, t.normal, t.force};
    const bool known = std::ranges::all_of(std::array{0U, 1U, 2U}, [&](std::size_t c) {
      const auto moving = std::span(all.node).first(all.moving),
                 held = std::span(all.node).subspan(all.moving);
      for (const auto& some : {moving, held})
        if (const auto there = std::ranges::lower_bound(some, t.nodes[c]);
            there != some.end() && *there == t.nodes[c]) {
          pair.piece[c] = static_cast<std::uint32_t>(&*there - all.node.data());
          return true;
        }
      return false;
    });
    if (!known)
      continue;
    turns.last.push_back(pair);
    turns.grown.push_back(t.grown);
    for (std::size_t c = 0; c < 3; ++c)
      turns.guess[pair.piece[c]] = all.was[pair.piece[c]] + t.moved[c];
  }
}

/// How much more it pushes than when it pushed last.
Vec3 grown_from(std::span<const PointTouch> last, const PointTouch& now) {
  const auto same = std::ranges::find_if(last, [&](const PointTouch& t) {
    return t.instrument == now.instrument && t.part == now.part && t.nodes == now.nodes;
  });
  return same == last.end() ? Vec3{} : now.force - same->force;
}

} // namespace

void TouchCounts::add(const TouchCounts& more) {
  problems += more.problems;
  turns += more.turns;
  most_turns = std::max(most_turns, more.most_turns);
  unsolved += more.unsolved;
  change = more.change <= change ? change : more.change;
}

std::vector<NodeTouch> sums_of_touches(std::vector<NodeTouch> touches) {
  std::stable_sort(touches.begin(), touches.end(), [](const NodeTouch& a, const NodeTouch& b) {
    return a.node != b.node ? a.node < b.node : a.instrument < b.instrument;
  });
  std::size_t count = 0;
  for (const NodeTouch& t : touches)
    if (count > 0 && touches[count - 1].node == t.node &&
        touches[count - 1].instrument == t.instrument)
      touches[count - 1].force += t.force;
    else
      touches[count++] = t;
  touches.resize(count);
  return touches;
}

std::size_t parts_of_way(std::span<const MovedInstrument> instruments, std::size_t max) {
  double parts = 1;
  for (const MovedInstrument& i : instruments)
    parts = std::max(parts, std::ceil(2 * path_length(i.shape, i.before, i.now) / i.shape.radius));
  return parts < static_cast<double>(max) ? static_cast<std::size_t>(parts) : max;
}

StaticContact::StaticContact(const Model& model, std::span<const double> shape,
                             std::vector<NodeTouch> touches, std::vector<PointTouch> points,
                             const PartOfShape& part)
    : model_(model), facets_(model), inward_(inward_directions(model)),
      touches_(std::move(touches)), points_(std::move(points)) {
  if (part.known.empty())
    facets_.set_shape(model, shape);
  else
    set_part(shape, part);
}

void StaticContact::set_part(std::span<const double> shape, const PartOfShape& part) {
  facets_.set_reach(part.reach);
  std::vector<std::uint32_t> known;
  for (std::uint32_t node = 0; node < part.known.size(); ++node)
    if (part.known[node] != 0)
      known.push_back(node);
  facets_.add_places(model_, shape, known);
}

/// Nodes of pieces deeper in an instrument than `depth` of its radius join `inside`, which stays
/// ascending; of new pieces the deepest if they are many.
void StaticContact::find(const Placed& placed, const std::map<std::uint32_t, Vec3>& displaced,
                         std::span<const double> shape, double depth,
                         std::vector<std::uint32_t>& inside) {
  std::vector<std::pair<double, std::uint32_t>> found;
  const auto held = [&](std::uint32_t node) {
    return model_.nodes[node].fixed == fixed_all || displaced.contains(node);
  };
  for (std::uint32_t k = 0; k < placed.size(); ++k) {
    if (!placed[k])
      continue;
    const PlacedInstrument& instrument = *placed[k];
    const Box3 box = instrument.box();
    facets_.visit_near(box, [&](std::uint32_t number) {
      const Facet& f = facets_.facets()[number];
      const std::array<Vec3, 3> corners{rest(f[0]) + vector_at(shape, f[0]),
                                        rest(f[1]) + vector_at(shape, f[1]),
                                        rest(f[2]) + vector_at(shape, f[2])};
      if (beside(corners, box, outside * instrument.radius))
        return;
      const bool joins =
          !std::ranges::all_of(f, held) && !std::ranges::all_of(f, [&](std::uint32_t node) {
            return held(node) || std::ranges::binary_search(inside, node);
          });
      if (!joins && std::ranges::none_of(f, held)) // whose place is told by others
        return;
      const double d = distance_of(instrument, f, corners) - instrument.radius;
      if (!(d < -depth * instrument.radius))
        return;
      for (const std::uint32_t node : f)
        if (!stuck_ && held(node) && !displaced.contains(node) &&
            instrument.distance(rest(node) + vector_at(shape, node)) < -deep * instrument.radius)
          stuck_ = NodeTouch{node, k, {}};
      if (joins)
        found.emplace_back(d / instrument.radius, number);
    });
  }
  std::sort(found.begin(), found.end());
  for (std::size_t k = 0; k < found.size() && k < max_new; ++k)
    for (const std::uint32_t node : facets_.facets()[found[k].second])
      if (const auto where = std::ranges::lower_bound(inside, node);
          !held(node) && (where == inside.end() || *where != node))
        inside.insert(where, node);
}

/// The pieces between these nodes and such as don't give way.
ContactNodes StaticContact::around(std::span<const std::uint32_t> nodes,
                                   const std::map<std::uint32_t, Vec3>& displaced,
                                   std::span<const double> before) const {
  ContactNodes all;
  all.node.assign(nodes.begin(), nodes.end());
  all.moving = nodes.size();
  std::vector<std::uint32_t> numbers, held;
  for (const std::uint32_t node : nodes)
    for (const std::uint32_t number : facets_.at_node(node)) {
      const Facet& f = facets_.facets()[number];
      if (!std::ranges::all_of(f, [&](std::uint32_t i) {
            return model_.nodes[i].fixed == fixed_all || displaced.contains(i) ||
                   std::ranges::binary_search(nodes, i);
          }))
        continue;
      numbers.push_back(number);
      for (const std::uint32_t i : f)
        if (!std::ranges::binary_search(nodes, i))
          held.push_back(i);
    }
  std::ranges::sort(numbers);
  numbers.erase(std::ranges::unique(numbers).begin(), numbers.end());
  std::ranges::sort(held);
  held.erase(std::ranges::unique(held).begin(), held.end());
  all.node.insert(all.node.end(), held.begin(), held.end());
  for (const std::uint32_t node : all.node) {
    all.was.push_back(rest(node) + vector_at(before, node));
    all.inward.push_back(inward_[node]);
  }
  const auto number_of = [&](std::uint32_t node) {
    const auto there = std::ranges::lower_bound(nodes, node);
    if (there != nodes.end() && *there == node)
      return static_cast<std::uint32_t>(there - nodes.begin());
    return static_cast<std::uint32_t>(
        nodes.size() +
        static_cast<std::size_t>(std::ranges::lower_bound(held, node) - held.begin()));
  };
  for (const std::uint32_t number : numbers) {
    const Facet& f = facets_.facets()[number];
    all.pieces.push_back({number_of(f[0]), number_of(f[1]), number_of(f[2])});
  }
  return all;
}

void StaticContact::restart(std::span<const double> shape, std::vector<NodeTouch> touches,
                            std::vector<PointTouch> points) {
  touches_ = std::move(touches);
  points_ = std::move(points);
  facets_.set_shape(model_, shape);
}

/// Forces at these nodes, and where they then stand. \return whether the object agrees
bool StaticContact::solve_all(Yielding& object, std::span<const std::uint32_t> nodes,
                              const std::map<std::uint32_t, Vec3>& displaced, const Placed& placed,
                              std::span<const std::optional<MovedInstrument>> moved,
                              std::span<const double> before, std::span<const PointTouch> last,
                              std::size_t& vain_pairs, std::vector<Vec3>& at) {
  const ContactNodes all = around(nodes, displaced, before);
  std::optional<GivingContact> giving;
  if (!gave_.empty())
    giving.emplace(all, moved, gave_);
  const auto node_of = [&](std::uint32_t i) { return all.node[giving ? giving->node(i) : i]; };
  ContactTurns turns;
  if (!giving)
    set_last(last, all, turns);
  for (int round = 0; round < max_rounds; ++round) {
    touches_.clear();
    points_.clear();
    at.clear();
    if (!nodes.empty()) {
      const DelassusOperator delassus = object.delassus_operator(nodes);
      std::vector<Vec3> free;
      for (std::size_t k = 0; k < all.node.size(); ++k) {
        const std::uint32_t node = all.node[k];
        const auto given = displaced.find(node);
        free.push_back(rest(node) + (k < all.moving             ? vector_at(delassus.free, k)
                                     : given != displaced.end() ? given->second
                                                                : vector_at(before, node)));
      }
      if (giving)
        take_turns(giving->delassus(delassus), giving->nodes(), giving->free(free), placed, moved,
                   turns);
      else
        take_turns(delassus, all, free, placed, moved, turns);
      if (!turns.pairs.empty()) {
        const auto taken = static_cast<std::uint64_t>(turns.turns);
        counts_.add({1, taken, taken, turns.solved ? 0U : 1U, turns.solved ? turns.change : 0});
      }
      solved_ = turns.solved;
      if (turns.stuck && !stuck_) {
        const std::array<double, 3>& weights = turns.stuck->point.weights;
        const auto most = std::ranges::max_element(weights) - weights.begin();
        stuck_ = NodeTouch{node_of(turns.stuck->piece[static_cast<std::size_t>(most)]),
                           turns.stuck->instrument,
                           {}};
      }
      for (const TouchPair& pair : turns.pairs) {
        if (pair.force == Vec3{})
          continue;
        const Facet& f = pair.piece;
        PointTouch point{{node_of(f[0]), node_of(f[1]), node_of(f[2])},
                         pair.point.weights,
                         pair.instrument,
                         pair.part,
                         pair.normal,
                         pair.force};
        if (!giving)
          for (std::size_t c = 0; c < 3; ++c)
            point.moved[c] = turns.at[f[c]] - all.was[f[c]];
        point.grown = grown_from(last, point);
        points_.push_back(point);
        for (std::size_t c = 0; c < 3; ++c)
          if (pair.point.weights[c] > 0)
            touches_.push_back(
                {node_of(f[c]), pair.instrument, pair.point.weights[c] * pair.force});
      }
      touches_ = sums_of_touches(std::move(touches_));
      if (giving) {
        gave_ = giving->gave(turns.pairs);
        at = giving->places(turns.at, gave_, delassus, free, turns.pairs);
      } else {
        at.assign(turns.at.begin(), turns.at.begin() + static_cast<std::ptrdiff_t>(all.moving));
      }
    }
    if (object.push(touches_, at))
      return true;
    vain_pairs += solved_ ? 0 : turns.pairs.size();
    if (vain_pairs > max_vain_pairs)
      return false;
  }
  return false;
}

/// Of the surface, some of them repeatedly.
std::vector<std::uint32_t> StaticContact::nodes_of(std::span<const std::size_t> blocks) const {
  std::vector<std::uint32_t> nodes;
  for (const std::size_t block : blocks)
    nodes.insert(nodes.end(), facets_.nodes_of(block).begin(), facets_.nodes_of(block).end());
  return nodes;
}

/// The shape as the contacts have it, whatever is left out of the rest of it.
void StaticContact::place(std::span<const std::uint32_t> nodes, std::span<const Vec3> at) {
  for (std::size_t k = 0; k < nodes.size(); ++k)
    for (int a = 0; a < 3; ++a)
      next_[axis_of(nodes[k], a)] = (at[k] - rest(nodes[k]))[a];
}

void StaticContact::take_whole(Yielding& object, std::span<const std::uint32_t> nodes,
                               std::span<const Vec3> at, std::span<const Box3> places) {
  const std::span<const double> u = object.shape();
  next_.assign(u.begin(), u.end());
  next_part_.known.clear();
  place(nodes, at);
  if (touches_.empty())
    facets_.set_shape(model_, next_);
  else // whose box nobody asks for
    facets_.set_shape_near(model_, next_, places);
}

/// Near these places alone. \return whether that is possible
bool StaticContact::take_part(Yielding& object, std::span<const std::uint32_t> nodes,
                              std::span<const Vec3> at, std::span<const Box3> places) {
  std::optional<NodeReach> reach;
  if (!touches_.empty())
    reach = object.reach();
  if (!reach)
    return false;
  next_part_.reach = std::move(*reach);
  next_part_.known.assign(next_part_.reach.group->size(), 0);
  next_.resize(3 * next_part_.known.size());
  place(nodes, at);
  for (const std::uint32_t node : nodes)
    next_part_.known[node] = 1;
  facets_.set_reach(next_part_.reach);
  facets_.add_places(model_, next_, nodes); // which may be wherever they were put
  const std::vector<std::size_t> near = facets_.blocks_near(places);
  know(object, Yielding::Moment::now, nodes_of(near), next_, next_part_.known);
  facets_.set_boxes(model_, next_, near);
  return true;
}

void StaticContact::update(Yielding& object, const std::map<std::uint32_t, Vec3>& displaced,
                           std::span<const std::optional<MovedInstrument>> instruments,
                           std::vector<double>& shape, bool last, PartOfShape* part) {
  Placed placed;
  for (const auto& i : instruments)
    placed.push_back(i ? std::optional(PlacedInstrument(i->shape, i->now)) : std::nullopt);
  gave_.assign(any_gives(instruments) ? instruments.size() : 0, Vec3{});
  std::erase_if(touches_, [&](const NodeTouch& t) {
    return t.instrument >= placed.size() || !placed[t.instrument] || displaced.contains(t.node) ||
           model_.nodes[t.node].fixed == fixed_all;
  });
  std::vector<std::uint32_t> nodes;
  for (const NodeTouch& t : touches_)
    if (nodes.empty() || nodes.back() != t.node)
      nodes.push_back(t.node);
  stuck_.reset();
  const bool in_part = part != nullptr && !part->known.empty();
  if (in_part) {
    object.keep_shape();
    know(object, Yielding::Moment::kept, nodes_of(facets_.blocks_near(boxes_of(placed))), shape,
         part->known);
  }
  find(placed, displaced, shape, 0, nodes);
  if (nodes.empty() && !last && gave_.empty())
    return;
  for (std::size_t k = 0; nodes.empty() && k < gave_.size(); ++k) // nothing pushes it
    gave_[k] = instruments[k] ? -instruments[k]->compliance * instruments[k]->pushed : Vec3{};
  const std::vector<PointTouch> pushed =
      short_ways(instruments) ? points_ : std::vector<PointTouch>{};
  solved_ = true;
  std::size_t vain_pairs = 0;
  for (;;) {
    std::vector<Vec3> at;
    const bool agreed =
        solve_all(object, nodes, displaced, placed, instruments, shape, pushed, vain_pairs, at);
    solved_ = solved_ && agreed;
    const std::size_t known = nodes.size();
    Placed there = placed;
    for (std::size_t k = 0; k < gave_.size(); ++k)
      if (there[k])
        there[k]->a += gave_[k];
    const std::vector<Box3> places = boxes_of(there);
    if (part == nullptr || !take_part(object, nodes, at, places))
      take_whole(object, nodes, at, places);
    find(there, displaced, next_, outside, nodes);
    if (nodes.size() == known) {
      shape.swap(next_);
      if (part != nullptr)
        std::swap(*part, next_part_);
      return;
    }
    if (in_part) // where they were
      know(object, Yielding::Moment::kept, nodes, shape, part->known);
  }
}

void StaticContact::update(const std::function<Elastostatic&()>& solver, const Load& load,
                           std::span<const std::optional<MovedInstrument>> instruments,
                           std::vector<double>& shape, bool last) {
  ElastostaticYielding object(solver, load);
  update(object, load.displacement, instruments, shape, last);
}

} // namespace gewebe
