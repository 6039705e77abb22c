#include "statics/contact_scene_internal.h"

#include "base/vector_at.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

namespace gewebe {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr std::array<Bend, 5> bends{{{1.0, 0}, {1.0, 4}, {0.7, 0}, {0.4, 0}, {0.0, 0}}};

constexpr double same_place = 1e-9; ///< of the radius, and of a normal's length
constexpr double fair_place = 1e-6; ///< that is not worth a warning
/// From where on a turn may be foreseen instead of taken where there is friction: drag turns with
/// the points that wander.
constexpr double sure_place = 1e-7;
constexpr double outside = 1e-9; ///< of the radius: so deep is not inside
constexpr double nearly = 0.03;  ///< from where on each turn comes nearer
constexpr double slow = 0.1;     ///< to come nearer by: in parts no longer, then
constexpr double short_way = 0.1, most_way = 8;
constexpr double spare_side = 1e-6; ///< of where it is
constexpr int max_turns = 100;
constexpr int max_vain = 3; ///< turns whose forces were not found
constexpr int max_sweeps = 200;
constexpr double least_square = 1e-6; ///< of weights of nodes that give way
constexpr double most_parts = 256;    ///< of a way that is looked at
constexpr int max_idle = 40;          ///< turns on end that came no nearer

auto key_of(const TouchPair& p) {
  return std::tuple(p.instrument, p.part, p.piece);
}

/// Corners that a point depends on, ascending and last repeated: the same for pieces that share it.
/// All of them where forces without bounds have left it no place.
Facet support_of(const TouchPair& p) {
  Facet all{};
  std::size_t count = 0;
  for (std::size_t c = 0; c < 3; ++c)
    if (p.point.weights[c] > 0)
      all[count++] = p.piece[c];
  if (count == 0)
    return p.piece;
  std::sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t c = count; c < 3; ++c)
    all[c] = all[count - 1];
  return all;
}

class Turns {
public:
  Turns(const DelassusOperator& delassus, const ContactNodes& nodes, std::span<const Vec3> free,
        std::span<const std::optional<PlacedInstrument>> placed,
        std::span<const std::optional<MovedInstrument>> moved, ContactTurns& turns)
      : scene_{nodes,
               free,
               placed,
               moved,
               {delassus.compliance.data(), static_cast<Index>(3 * nodes.moving),
                static_cast<Index>(3 * nodes.moving)}},
        turns_(turns), parts_(parts_of(nodes, scene_.w)), in_parts_(parts_.size() > 1) {}

  void run() {
    const std::vector<Vec3> last =
        std::exchange(turns_.at, std::vector<Vec3>(scene_.free.begin(), scene_.free.end()));
    std::ranges::sort(turns_.pairs, {}, key_of);
    join(scene_.nodes.was, 0);
    join(scene_.free, outside);
    join_passed();
    const bool known = last.size() == scene_.free.size(); // of a round before
    const bool near = near_ = !known && go_on();
    const bool smooth =
        std::ranges::all_of(scene_.placed, [](const auto& i) { return !i || !(i->friction > 0); });
    at_ = known ? last : scene_.nodes.was;
    if (near && go_further())
      at_ = turns_.guess;
    turns_.solved = turns_.pairs.empty();
    double before = HUGE_VAL, last_ratio = 0;
    double best = HUGE_VAL;
    int vain = 0, since_best = 0;
    for (turns_.turns = 0; turns_.turns < max_turns && !turns_.pairs.empty(); ++turns_.turns) {
      locate(at_);
      const bool bend = known || near || turns_.turns > 0;
      bool exact = solve(bend, false);
      double change = changed(), part = 1;
      if (turns_.turns > 0 && !(change < nearly && change < before)) {
        part = shorten();
        if (part < short_way) { // it leads up
          exact = solve(bend, true);
          change = changed();
          part = shorten();
        }
      }
      vain += exact ? 0 : 1;
      const bool stopped = stop_before_core();
      const bool joined = join(turns_.at, outside) || stopped;
      turns_.solved = exact && !joined && change <= fair_place;
      turns_.change = change;
      since_best = joined || change < 0.8 * best ? 0 : since_best + 1;
      best = joined ? HUGE_VAL : std::min(best, change);
      if ((!joined && change <= same_place) || vain == max_vain || since_best == max_idle)
        break;
      const bool nearer = !joined && part == 1 && level_ == 0 && before < HUGE_VAL;
      const double ratio = nearer ? change / before : 0;
      // What another turn would change, if it came nearer as fast as the last ones did.
      const double next = change * ratio * (last_ratio > 0 ? std::min(1.0, ratio / last_ratio) : 1);
      if (near && nearer && turns_.solved && (smooth || change <= sure_place) &&
          next <= same_place) {
        locate(turns_.at);
        turns_.change = next;
        ++turns_.turns;
        break;
      }
      if (near_ || last_change_ < nearly) // turned in parts, or might have been
        in_parts_ = in_parts_ && (joined || !(before < HUGE_VAL) || change < slow * before);
      last_ratio = ratio;
      if (level_ < bends.size() && bends[level_].hold > 0 && !(change < before))
        can_hold_ = false;
      before = last_change_ = change;
      at_ = turns_.at;
      forces_ = next_forces_;
    }
    turns_.solved = turns_.solved && !pierced(turns_.at);
    if (!turns_.solved)
      move_out();
  }

private:
  /// Whether a core goes through a piece: no pair leads it out again.
  bool pierced(std::span<const Vec3> at) const {
    for (std::uint32_t k = 0; k < scene_.placed.size(); ++k)
      for (std::size_t p = 0; has_inside(k) && p < scene_.nodes.pieces.size(); ++p)
        if (const Facet& piece = scene_.nodes.pieces[p];
            scene_.nodes.meet(k, p) && corner_count(piece) == 3 &&
            goes_through(*scene_.placed[k], corners_of(piece, at)))
          return true;
    return false;
  }

  /// Whether its core is more than a point.
  bool has_inside(std::size_t instrument) const {
    const auto& placed = scene_.placed[instrument];
    return placed && (placed->core || placed->ab != Vec3{});
  }

  /// Whatever the forces are, nothing stays inside: the nodes around move alike.
  void move_out() {
    for (int sweep = 0; sweep < max_sweeps; ++sweep) {
      bool clear = true;
      for (const TouchPair& p : turns_.pairs) {
        const PlacedInstrument& instrument = *scene_.placed[p.instrument];
        const auto found = nearest_points(instrument, p.part, corners_of(p.piece, turns_.at),
                                          corner_count(p.piece));
        if (!found || !(found->distance < (1 - outside) * instrument.radius))
          continue;
        double square = 0;
        for (std::size_t c = 0; c < 3; ++c)
          if (p.piece[c] < scene_.nodes.moving)
            square += found->weights[c] * found->weights[c];
        if (!(square > least_square))
          continue;
        clear = false;
        const Vec3 n =
            dot(found->normal(p.normal), p.normal) < 0 ? p.normal : found->normal(p.normal);
        for (std::size_t c = 0; c < 3; ++c)
          if (p.piece[c] < scene_.nodes.moving && found->weights[c] > 0)
            turns_.at[p.piece[c]] += (instrument.radius - dot(found->place - found->core, n)) *
                                     found->weights[c] / square * n;
      }
      if (clear)
        return;
    }
  }

  /// The pair of the same part and piece, or null.
  TouchPair* pair_like(const TouchPair& p) {
    const auto there = std::ranges::lower_bound(turns_.pairs, key_of(p), {}, key_of);
    return there != turns_.pairs.end() && key_of(*there) == key_of(p) ? &*there : nullptr;
  }

  /// The first turn begins with the forces that pushed last time. \return whether there are any
  bool go_on() {
    bool any = false;
    for (const TouchPair& p : turns_.last)
      if (TouchPair* const there = pair_like(p)) {
        there->normal = p.normal;
        there->force = p.force;
        any = true;
      }
    return any;
  }

  /// Where the nodes and forces go on as they came, if that is nearer to where the instruments want
  /// them than where they were.
  bool go_further() {
    if (!(miss(turns_.guess) < miss(scene_.nodes.was)))
      return false;
    for (std::size_t k = 0; k < turns_.last.size(); ++k)
      if (TouchPair* const there = pair_like(turns_.last[k]);
          there != nullptr && dot(there->force + turns_.grown[k], there->normal) > 0)
        there->force += turns_.grown[k];
    return true;
  }
  /// How far what pushes is from its instrument, over the radius, at these places.
  double miss(std::span<const Vec3> at) const {
    double most = 0;
    for (const TouchPair& p : turns_.pairs) {
      if (p.force == Vec3{})
        continue;
      const PlacedInstrument& instrument = *scene_.placed[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, at), corner_count(p.piece));
      const double far = found ? std::abs(found->distance - instrument.radius) : HUGE_VAL;
      most = far / instrument.radius <= most ? most : far / instrument.radius;
    }
    return most;
  }

  bool movable(const TouchPair& p) const {
    return std::ranges::any_of(p.piece, [&](std::uint32_t i) { return i < scene_.nodes.moving; });
  }

  /// Pairs of every piece with whatever it is in.
  bool join(std::span<const Vec3> at, double depth) {
    bool joined = false;
    for (std::uint32_t k = 0; k < scene_.placed.size(); ++k) {
      if (!scene_.placed[k])
        continue;
      find_sides(*scene_.placed[k], at);
      for (std::size_t p = 0; p < scene_.nodes.pieces.size(); ++p) {
        const Facet& piece = scene_.nodes.pieces[p];
        if ((sides_[piece[0]] & sides_[piece[1]] & sides_[piece[2]]) == 0 &&
            scene_.nodes.meet(k, p))
          joined = join(k, piece, at, depth) == Joined::fresh || joined;
      }
    }
    return joined;
  }
  /// The sides of an instrument's box that each node is surely beyond, as bits: a piece whose nodes
  /// share one is not in it.
  void find_sides(const PlacedInstrument& instrument, std::span<const Vec3> at) {
    Box3 box = instrument.box();
    const Vec3 most{std::max(std::abs(box.min.x), std::abs(box.max.x)),
                    std::max(std::abs(box.min.y), std::abs(box.max.y)),
                    std::max(std::abs(box.min.z), std::abs(box.max.z))};
    const double spare =
        spare_side * std::max({instrument.radius, most.x, most.y, most.z}); // of rounding
    box.min -= {spare, spare, spare};
    box.max += {spare, spare, spare};
    sides_.resize(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Vec3& x = at[i];
      sides_[i] = static_cast<std::uint8_t>(
          (x.x < box.min.x ? 1 : 0) | (x.x > box.max.x ? 2 : 0) | (x.y < box.min.y ? 4 : 0) |
          (x.y > box.max.y ? 8 : 0) | (x.z < box.min.z ? 16 : 0) | (x.z > box.max.z ? 32 : 0));
    }
  }

  enum class Joined { none, known, fresh };
  Joined join(std::uint32_t k, const Facet& whole, std::span<const Vec3> at, double depth) {
    const PlacedInstrument& instrument = *scene_.placed[k];
    // A piece can't be moved out while a corner that is held is in.
    const std::optional<Facet> piece = part_of(whole, [&](std::uint32_t i) {
      return i < scene_.nodes.moving ||
             instrument.distance(scene_.free[i]) >= -outside * instrument.radius;
    });
    Joined result = Joined::none;
    if (!piece)
      return result;
    for_parts(instrument, *piece, corners_of(*piece, at), instrument.radius,
              [&](CorePart part, const Facet& corners) {
                const auto found = nearest_points(instrument, part, corners_of(corners, at),
                                                  corner_count(corners));
                if (!found || found->behind || !(found->distance < (1 - depth) * instrument.radius))
                  return;
                TouchPair pair{k, part, corners, *found, {}, {}};
                const auto there = std::ranges::lower_bound(turns_.pairs, key_of(pair), {}, key_of);
                if (there != turns_.pairs.end() && key_of(*there) == key_of(pair)) {
                  result = std::max(result, Joined::known);
                  return;
                }
                if (!movable(pair))
                  return;
                turns_.pairs.insert(there, pair);
                result = Joined::fresh;
              });
    return result;
  }

  /// What pushed last time may now be so far behind an instrument that it is in it neither before
  /// nor then: it joins where it passes.
  void join_passed() {
    std::vector<Vec3> at; // on its way: of the piece that is looked at, else before it
    for (std::uint32_t k = 0; k < scene_.placed.size(); ++k)
      for (std::size_t p = 0; scene_.placed[k] && p < scene_.nodes.pieces.size(); ++p) {
        if (!scene_.nodes.meet(k, p))
          continue;
        const Facet& piece = scene_.nodes.pieces[p];
        const double radius = scene_.placed[k]->radius;
        double far = 0;
        for (const std::uint32_t i : piece)
          far = std::max(far, norm(scene_.free[i] - scene_.nodes.was[i]));
        if (!(far > 2 * radius) || join(k, piece, scene_.nodes.was, 0) != Joined::none ||
            join(k, piece, scene_.free, outside) != Joined::none)
          continue;
        const double parts = std::min(std::ceil(far / radius), most_parts);
        if (at.empty())
          at = scene_.nodes.was;
        for (double n = 1; n < parts; ++n) {
          for (const std::uint32_t i : piece)
            at[i] = scene_.nodes.was[i] + n / parts * (scene_.free[i] - scene_.nodes.was[i]);
          (void)join(k, piece, at, 0);
        }
        for (const std::uint32_t i : piece)
          at[i] = scene_.nodes.was[i];
      }
  }

  Vec3 inward(const TouchPair& p) const {
    Vec3 sum;
    for (std::size_t c = 0; c < 3; ++c)
      sum += p.point.weights[c] * scene_.nodes.inward[p.piece[c]];
    return sum;
  }

  /// The points of all pairs where the nodes are, and which of them count: one of those that are
  /// the same.
  void locate(std::span<const Vec3> at) {
    active_.clear();
    std::vector<std::tuple<std::uint32_t, CorePart, Facet, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < turns_.pairs.size(); ++i) {
      TouchPair& p = turns_.pairs[i];
      const PlacedInstrument& instrument = *scene_.placed[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, at), corner_count(p.piece));
      if (!found) {
        p.force = {};
        continue;
      }
      p.point = *found;
      const Vec3 normal = p.point.has_normal(1e-9 * instrument.radius)
                              ? p.point.normal({})
                              : instrument.normal(p.point.core, inward(p));
      if (dot(normal, p.normal) < 0) { // through: out the way it came
        std::size_t deepest = 0;
        for (std::size_t c = 1; c < 3; ++c)
          if (dot(at[p.piece[c]], p.normal) < dot(at[p.piece[deepest]], p.normal))
            deepest = c;
        p.point.weights = {};
        p.point.weights[deepest] = 1;
        p.point.place = at[p.piece[deepest]];
      } else { // the force turns with the normal
        const double push = dot(p.force, p.normal);
        const Vec3 drag = p.force - push * p.normal;
        p.force = push * normal + (drag - dot(drag, normal) * normal);
        p.normal = normal;
      }
      order.emplace_back(p.instrument, p.part, support_of(p), i);
    }
    std::ranges::sort(order);
    for (std::size_t k = 0; k < order.size(); ++k) {
      const auto& [instrument, part, support, i] = order[k];
      TouchPair& p = turns_.pairs[i];
      if (k > 0 && std::tie(instrument, part, support) == std::tie(std::get<0>(order[k - 1]),
                                                                   std::get<1>(order[k - 1]),
                                                                   std::get<2>(order[k - 1]))) {
        turns_.pairs[active_.back()].force += p.force;
        p.force = {};
      } else {
        active_.push_back(i);
      }
    }
  }

  /// Energy and what violates the conditions, on the way from the last places to the new ones.
  double merit(double part, double weight) const {
    double energy = 0;
    std::vector<Vec3> at(at_);
    for (std::size_t k = 0; k < scene_.nodes.moving; ++k) {
      at[k] += part * (turns_.at[k] - at_[k]);
      for (int a = 0; a < 3; ++a) {
        const auto row = static_cast<Index>(3 * k) + a;
        energy += 0.5 * (forces_[row] + part * (next_forces_[row] - forces_[row])) *
                  (at[k] - scene_.free[k])[a];
      }
    }
    for (const TouchPair& p : turns_.pairs) {
      const PlacedInstrument& instrument = *scene_.placed[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, at), corner_count(p.piece));
      if (found && found->distance < instrument.radius)
        energy += weight * (instrument.radius - found->distance);
      if (found && instrument.friction > 0) {
        const Vec3 drag = p.force - dot(p.force, p.normal) * p.normal;
        energy -= dot(drag, point_of(p, at));
      }
    }
    return energy;
  }

  /// Less of the last way where all of it leads up; more while that leads down, as from a saddle,
  /// where curvature was left out.
  double shorten() {
    double weight = 0;
    for (const TouchPair& p : turns_.pairs)
      weight = std::max(weight, 2 * norm(p.force));
    const double here = merit(0, weight);
    double part = 1, best = HUGE_VAL;
    for (double way = 1; way > 0.01; way /= 2) {
      const double there = merit(way, weight);
      if (there < best) {
        best = there;
        part = way;
      }
      if (there < here)
        break;
    }
    for (double way = 2; level_ > 1 && part >= 1 && way <= most_way; way *= 2) {
      const double there = merit(way, weight);
      if (!(there < best))
        break;
      best = there;
      part = way;
    }
    if (part != 1)
      take(part);
    return part;
  }

  std::vector<Vec3> on_the_way(double part) const {
    std::vector<Vec3> at(turns_.at);
    for (std::size_t k = 0; k < scene_.nodes.moving; ++k)
      at[k] = at_[k] + part * (turns_.at[k] - at_[k]);
    return at;
  }
  /// This part of the last way alone.
  void take(double part) {
    turns_.at = on_the_way(part);
    if (forces_.size() == 0) { // of the first turn: those that hold the nodes where it begins
      const MatrixXd w = scene_.w;
      forces_ = w.ldlt().solve(scene_.rows_of(at_) - scene_.rows_of(scene_.free));
    }
    next_forces_ = forces_ + part * (next_forces_ - forces_);
  }

  /// Less of the last way where it leads into a polyhedron, in which pairs of its edges and corners
  /// don't tell the way out: what comes near on the way joins first. \return whether it does
  bool stop_before_core() {
    double reach = HUGE_VAL; // what is farther may pass all of one
    for (const auto& placed : scene_.placed)
      if (placed && placed->core)
        reach = std::min(reach, placed->radius + 0.05 * placed->core->size());
    if (!(reach < HUGE_VAL) || pierced(at_))
      return false;
    double far = 0;
    for (std::size_t k = 0; k < scene_.nodes.moving; ++k)
      far = std::max(far, norm(turns_.at[k] - at_[k]));
    const double parts = std::ceil(std::clamp(far / reach, 1.0, 16.0));
    double part = 0;
    for (double n = 1; n <= parts && !pierced(on_the_way(n / parts)); ++n)
      part = n / parts;
    if (part == 1)
      return false;
    double step = 0.5 / parts;
    for (; part == 0 && step > 1e-3 && pierced(on_the_way(step)); step /= 2) {
    }
    take(part > 0 ? part : step);
    return true;
  }

  /// Forces of the active pairs, and where the nodes are under them.
  bool solve(bool bend, bool safe) {
    std::vector<Vec3> guess;
    for (const TouchPair& p : turns_.pairs)
      guess.push_back(p.force);
    std::optional<BentParts> bent;
    std::optional<LookedContacts> looked;
    VectorXd held;
    const auto solve_with = [&](bool careful) {
      for (std::size_t i = 0; i < guess.size(); ++i)
        turns_.pairs[i].force = guess[i];
      looked = solve_bent(scene_, turns_.pairs, active_, at_, *bent, held, careful, turns_.stuck);
    };
    for (std::size_t level = safe ? bends.size() - 1 : 0; bend && !looked && level < bends.size();
         ++level) {
      if (bends[level].hold > 0 &&
          (!can_hold_ || !(last_change_ < nearly))) // what pushes may not, and is held then
        continue;
      for (std::size_t i = 0; i < guess.size(); ++i)
        turns_.pairs[i].force = guess[i];
      bent.emplace(bending(
          scene_, turns_.pairs, active_, at_, bends[level],
          level == 0 && in_parts_ && (near_ || last_change_ < nearly) ? &parts_ : nullptr, held));
      solve_with(true);
      level_ = level;
    }
    if (!looked) {
      held = VectorXd::Zero(scene_.rows());
      bent.emplace(scene_.w, std::vector<Turning>(1));
      solve_with(false);
    }
    if (!looked)
      return false;
    // The forces on the nodes that these places mean.
    next_forces_ = held + bent->turning(looked->x - scene_.rows_of(at_));
    for (const std::uint32_t i : looked->pairs) {
      const TouchPair& p = turns_.pairs[i];
      for (std::size_t c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a)
          if (p.piece[c] < scene_.nodes.moving)
            next_forces_[3 * static_cast<Index>(p.piece[c]) + a] += p.point.weights[c] * p.force[a];
    }
    turns_.at = scene_.places_of(looked->x);
    return looked->exact;
  }

  /// How far the pairs' points and normals are from where the nodes now have them: of those that
  /// push.
  double changed() const {
    double most = 0;
    for (const std::uint32_t i : active_) {
      const TouchPair& p = turns_.pairs[i];
      const PlacedInstrument& instrument = *scene_.placed[p.instrument];
      const auto found =
          nearest_points(instrument, p.part, corners_of(p.piece, turns_.at), corner_count(p.piece));
      if (p.force == Vec3{}) { // its plane may have been beside its place now
        if (found && found->distance < (1 - outside) * instrument.radius)
          most = std::max(most, 1 - found->distance / instrument.radius);
        continue;
      }
      if (!found)
        return 1;
      const double change =
          std::max(norm(found->normal(p.normal) - p.normal),
                   norm(found->place - point_of(p, turns_.at)) / instrument.radius);
      most = change <= most ? most : change;
    }
    return most;
  }

  ContactScene scene_;
  ContactTurns& turns_;
  ContactParts parts_;
  bool in_parts_;     ///< may turns be taken
  bool near_ = false; ///< it began with the last forces
  double last_change_ = HUGE_VAL;
  bool can_hold_ = true;              ///< nothing came of it that was worse
  std::size_t level_ = 0;             ///< of looseness
  std::vector<Vec3> at_;              ///< before a turn
  VectorXd forces_, next_forces_;     ///< on the nodes, as the places mean before and behind a turn
  std::vector<std::uint32_t> active_; ///< pairs
  std::vector<std::uint8_t> sides_;   ///< by node
};

} // namespace

std::array<Vec3, 3> corners_of(const Facet& piece, std::span<const Vec3> at) {
  return {at[piece[0]], at[piece[1]], at[piece[2]]};
}

Vec3 point_of(const TouchPair& p, std::span<const Vec3> at) {
  return p.point.weights[0] * at[p.piece[0]] + p.point.weights[1] * at[p.piece[1]] +
         p.point.weights[2] * at[p.piece[2]];
}

std::vector<Vec3> ContactScene::places_of(const VectorXd& x) const {
  std::vector<Vec3> all(free.begin(), free.end());
  for (std::size_t k = 0; k < nodes.moving; ++k)
    all[k] = vector_at({x.data(), static_cast<std::size_t>(x.size())}, k);
  return all;
}

VectorXd ContactScene::rows_of(std::span<const Vec3> places) const {
  VectorXd all(rows());
  for (std::size_t k = 0; k < nodes.moving; ++k)
    for (int a = 0; a < 3; ++a)
      all[3 * static_cast<Index>(k) + a] = places[k][a];
  return all;
}

void take_turns(const DelassusOperator& delassus, const ContactNodes& nodes,
                std::span<const Vec3> free, std::span<const std::optional<PlacedInstrument>> placed,
                std::span<const std::optional<MovedInstrument>> moved, ContactTurns& turns) {
  const auto run = [&] { Turns(delassus, nodes, free, placed, moved, turns).run(); };
  if (turns.last.empty() || !turns.at.empty())
    return run();
  ContactTurns before = turns;
  run();
  if (turns.solved && turns.change <= same_place)
    return;
  // Friction that begins with the last forces may end between two points: without them, then.
  ContactTurns found = std::exchange(turns, std::move(before));
  turns.last.clear();
  run();
  const int taken = turns.turns + found.turns;
  if (found.solved && !(turns.solved && turns.change <= found.change))
    turns = std::move(found);
  turns.turns = taken;
}

} // namespace gewebe
