#include "dynamics/dynamic_contact.h"

#include "contact/surface_facets.h"
#include "dynamics/contact_impulses_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

namespace gewebe {

namespace {

constexpr double on_surface = 1e-9; ///< of the radius: so deep is not inside
constexpr double at_surface = 1e-6; ///< so far it touches
constexpr double rounding = 1e-14;
constexpr double nothing = 1e-13; ///< of the largest impulse
constexpr std::uint64_t max_unseen = 16;
constexpr std::size_t max_parts = 256;
constexpr int few_sweeps = 20, many_sweeps = 400, sweeps_at_rest = 4000;
constexpr double exact_impulse = 1e-6, exact_at_rest = 1e-13; ///< of the largest

Vec3 vector_of(const double* row) {
  return {row[0], row[1], row[2]};
}

void put(const Vec3& v, double* row) {
  row[0] = v.x;
  row[1] = v.y;
  row[2] = v.z;
}

/// What the node can do of v: nothing along axes without inverse mass.
Vec3 free_part(const Vec3& v, const Vec3& inverse_mass) {
  return {inverse_mass.x > 0 ? v.x : 0, inverse_mass.y > 0 ? v.y : 0, inverse_mass.z > 0 ? v.z : 0};
}

/// From a point inside onto the surface along `way`, a unit vector that leads out.
void leave(const PlacedInstrument& instrument, const Vec3& way, Vec3& p) {
  // The distance is convex along the way, so Newton's steps overshoot once and then come back.
  for (int k = 0; k < 100; ++k) {
    const double d = instrument.distance(p), rate = dot(instrument.normal(p, way), way);
    if (!(std::abs(d) > 1e-12 * instrument.radius) || (d > 0 && !(rate > 0)))
      return;
    p += (rate > 1e-3 ? -d / rate : instrument.radius) * way;
  }
}

auto key_of(const DynamicContact::Guess& g) {
  return std::tuple(g.instrument, g.part, g.rows);
}

/// The part of a force that pushes along n, and what of the rest friction holds.
Vec3 turned(const Vec3& force, const Vec3& n, double friction) {
  const double push = std::max(0.0, dot(force, n));
  Vec3 drag = force - dot(force, n) * n;
  if (const double size = norm(drag); size > friction * push)
    drag *= friction * push / size;
  return push * n + drag;
}

double apart(const Box3& a, const Box3& b) {
  double d = -HUGE_VAL;
  for (int k = 0; k < 3; ++k)
    d = std::max({d, a.min[k] - b.max[k], b.min[k] - a.max[k]});
  return d;
}

} // namespace

/// Pieces near instruments, with the rows of their nodes.
struct DynamicContact::Near {
  std::vector<std::uint32_t> rows; ///< ascending
  MassPoints points;
};

DynamicContact::DynamicContact(const Model& model, const SpringLayout& layout)
    : layout_(layout), inward_(layout.node_of_row.size()) {
  const std::vector<Vec3> inward = inward_directions(model);
  for (std::size_t row = 0; row < inward_.size(); ++row)
    inward_[row] = inward[layout.node_of_row[row]];
  // A piece belongs to the block of its first row, which no other thread has to know of.
  const SurfaceFacets surface(model);
  for (Facet f : surface.facets()) {
    for (std::uint32_t& corner : f)
      corner = layout.row_of_node[corner];
    pieces_.push_back(f);
  }
  const auto first_row = [](const Facet& f) { return std::ranges::min(f); };
  std::ranges::stable_sort(pieces_, {}, first_row);
  std::size_t next = 0;
  for (const SpringBlock& b : layout.blocks) {
    first_.push_back(next);
    while (next < pieces_.size() && first_row(pieces_[next]) < b.first + b.count)
      ++next;
  }
  pieces_.resize(next); // behind the last block nothing moves
  first_.push_back(next);
  state_.next_look.resize(layout.blocks.size());
}

void DynamicContact::begin(std::vector<std::optional<MovingInstrument>> instruments) {
  state_.instruments = std::move(instruments);
  std::fill(state_.next_look.begin(), state_.next_look.end(), 0);
}

ContactMoment DynamicContact::moment(std::uint64_t step, std::uint64_t steps, double time,
                                     double h) const {
  ContactMoment m;
  m.h = h;
  m.step = step;
  m.last = step + 1 == steps;
  for (std::uint32_t k = 0; k < state_.instruments.size(); ++k) {
    if (!state_.instruments[k])
      continue;
    const MovingInstrument& i = *state_.instruments[k];
    ContactMoment::There& t = m.there.emplace_back();
    t.instrument = k;
    t.from = i.at(time);
    t.to = i.guess(time + h, h);
    t.hand = i.way.at(time + h).place;
    t.placed = PlacedInstrument(i.shape, t.to);
    t.box = t.placed.box();
    t.speed = i.way.end > time
                  ? 2 * path_length(i.shape, i.way.from, i.way.to) / (i.way.end - i.way.start)
                  : 0;
    if (i.led)
      t.speed += 4 * norm(t.to.place - t.from.place) / h;
    const auto go = [&](const Pose& from, const Pose& to) {
      const MovedInstrument way{i.shape, from, to};
      const std::size_t parts = parts_of_way({&way, 1}, max_parts);
      for (std::size_t p = 1; p <= parts; ++p) {
        const Pose pose = between(from, to, static_cast<double>(p) / static_cast<double>(parts));
        if (pose == t.to)
          continue;
        t.on_its_way.emplace_back(i.shape, pose);
        const Box3 box = t.on_its_way.back().box();
        t.box.add(box.min);
        t.box.add(box.max);
      }
    };
    if (step == 0 && !i.led && i.before != t.from)
      go(i.before, t.from);
    go(t.from, t.to);
  }
  return m;
}

Vec3 DynamicContact::place(std::span<const NodeRow> rows, std::uint32_t row) const {
  return vector_of(layout_.rest[row].p) + vector_of(rows[row].u);
}

bool DynamicContact::due(const ContactMoment& moment) const {
  return !moment.there.empty() &&
         (moment.last ||
          std::ranges::any_of(
              moment.there,
              [&](const auto& t) { return state_.instruments[t.instrument]->led.has_value(); }) ||
          std::ranges::any_of(state_.next_look,
                              [&](std::uint64_t step) { return moment.step >= step; }));
}

/// The pieces of blocks that may be in an instrument now, and when to look again at the others.
void DynamicContact::look(const ContactMoment& moment, std::span<const NodeRow> next,
                          std::vector<std::uint32_t>& numbers) {
  for (std::size_t block = 0; block + 1 < first_.size(); ++block) {
    if (moment.step < state_.next_look[block] && !moment.last)
      continue;
    Box3 box;
    double fastest = 0;
    for (std::size_t k = first_[block]; k < first_[block + 1]; ++k)
      for (const std::uint32_t row : pieces_[k]) {
        box.add(place(next, row));
        const Vec3 v = vector_of(next[row].v);
        fastest = std::max(fastest, dot(v, v));
      }
    if (box.empty()) {
      state_.next_look[block] = UINT64_MAX;
      continue;
    }
    fastest = std::sqrt(fastest);
    std::uint64_t unseen = max_unseen;
    bool any = false;
    for (const ContactMoment::There& t : moment.there) {
      const double gap = apart(box, t.box);
      if (!(gap > 0)) {
        any = true;
        break;
      }
      const double steps = gap / (moment.h * (4 * fastest + t.speed) + 1e-300);
      if (steps < static_cast<double>(unseen))
        unseen = static_cast<std::uint64_t>(steps);
    }
    state_.next_look[block] = any ? 0 : moment.step + unseen;
    for (std::size_t k = first_[block]; any && k < first_[block + 1]; ++k) {
      Box3 own;
      for (const std::uint32_t row : pieces_[k])
        own.add(place(next, row));
      if (std::ranges::any_of(moment.there, [&](const auto& t) { return near(own, t.box); }))
        numbers.push_back(static_cast<std::uint32_t>(k));
    }
  }
}

DynamicContact::Near DynamicContact::near_pieces(std::span<const std::uint32_t> numbers,
                                                 std::span<const NodeTraits> traits,
                                                 std::span<const NodeRow> rows) const {
  Near near;
  for (const std::uint32_t k : numbers)
    near.rows.insert(near.rows.end(), pieces_[k].begin(), pieces_[k].end());
  std::ranges::sort(near.rows);
  near.rows.erase(std::ranges::unique(near.rows).begin(), near.rows.end());
  for (const std::uint32_t row : near.rows) {
    near.points.place.push_back(place(rows, row));
    near.points.velocity.push_back(vector_of(rows[row].v));
    near.points.inverse_mass.push_back(row < layout_.movable ? vector_of(traits[row].inverse_mass)
                                                             : Vec3{});
    near.points.inward.push_back(inward_[row]);
  }
  for (const std::uint32_t k : numbers) {
    Facet f = pieces_[k];
    for (std::uint32_t& corner : f)
      corner = static_cast<std::uint32_t>(std::ranges::lower_bound(near.rows, corner) -
                                          near.rows.begin());
    near.points.pieces.push_back(f);
  }
  return near;
}

/// Nodes between instruments that leave no room leave them across the line between them.
void DynamicContact::take_part_pinched(Near& near, const ContactMoment& moment) const {
  for (std::size_t i = 0; i < near.rows.size(); ++i) {
    Vec3& p = near.points.place[i];
    const Vec3 &inward = near.points.inward[i], &inverse = near.points.inverse_mass[i];
    const ContactMoment::There *a = nullptr, *b = nullptr;
    for (const ContactMoment::There& t : moment.there)
      if (t.placed.distance(p) < -on_surface * t.placed.radius)
        (a == nullptr ? a : b) = &t;
      else if (b == nullptr && t.placed.distance(p) < 1e-3 * t.placed.radius)
        b = &t;
    if (a == nullptr || inverse == Vec3{})
      continue;
    const Vec3 n = a->placed.normal(p, inward);
    const Vec3 along = b == nullptr ? n : n - b->placed.normal(p, inward);
    Vec3 way = inward - dot(inward, along) / std::max(dot(along, along), 1e-300) * along;
    way = free_part(way, inverse);
    if (!(norm(way) > 1e-6 * norm(inward)))
      way = free_part(std::abs(along.x) < 0.6 * norm(along) ? cross(along, {1, 0, 0})
                                                            : cross(along, {0, 1, 0}),
                      inverse);
    if (!(norm(way) > 0))
      continue;
    for (std::size_t k = 0; k < moment.there.size(); ++k)
      for (const ContactMoment::There& t : moment.there)
        if (t.placed.distance(p) < -on_surface * t.placed.radius)
          leave(t.placed, way / norm(way), p);
  }
}

void DynamicContact::keep_out(const ContactMoment& moment, std::span<const NodeTraits> traits,
                              std::span<const NodeRow> now, std::span<NodeRow> next) {
  std::vector<std::uint32_t> numbers;
  look(moment, next, numbers);
  if (numbers.empty()) {
    state_.guesses.clear();
    lead(moment, {});
    return;
  }
  Near near = near_pieces(numbers, traits, next);
  MassPoints& points = near.points;
  const std::vector<Vec3> place_before = points.place, velocity_before = points.velocity;
  // What is in the way of a jump moves first, and the step's own way goes on from there.
  std::vector<Vec3> from;
  for (const std::uint32_t row : near.rows)
    from.push_back(place(now, row));
  std::vector<MovingCore> cores;
  for (const ContactMoment::There& t : moment.there) {
    MovingCore& core = cores.emplace_back(MovingCore{t.placed, t.from, t.to, moment.h});
    if (const auto& led = state_.instruments[t.instrument]->led) {
      core.gives = CouplingStep(led->coupling, led->lag, moment.h).compliance / moment.h / moment.h;
      core.expected = moment.h * led->force;
    }
  }
  if (std::ranges::any_of(moment.there, [](const auto& t) { return !t.on_its_way.empty(); })) {
    const std::vector<Vec3> begin = from;
    points.place.swap(from);
    for (const ContactMoment::There& t : moment.there)
      for (const PlacedInstrument& on_its_way : t.on_its_way)
        move_out(points, std::array{MovingCore{on_its_way, {}, {}, 0}}, on_surface, few_sweeps);
    points.place.swap(from);
    for (std::size_t i = 0; i < from.size(); ++i)
      points.place[i] += from[i] - begin[i];
  }
  std::vector<PieceTouch> touches = touches_of(points, cores, 0);
  points.place.swap(from);
  for (PieceTouch& t : touches)
    locate(points, cores, t);
  points.place.swap(from);
  const auto rows_of = [&](const Facet& piece) {
    return Facet{near.rows[piece[0]], near.rows[piece[1]], near.rows[piece[2]]};
  };
  for (PieceTouch& t : touches)
    if (const auto known = std::ranges::lower_bound(
            state_.guesses,
            std::tuple(moment.there[t.instrument].instrument, t.part, rows_of(t.piece)), {},
            key_of);
        known != state_.guesses.end() &&
        key_of(*known) ==
            std::tuple(moment.there[t.instrument].instrument, t.part, rows_of(t.piece)))
      t.impulse = moment.h * turned(known->force, t.normal, cores[t.instrument].placed.friction);
  exchange_impulses(points, cores, touches, exact_impulse, many_sweeps);
  std::vector<Vec3> felt(cores.size());
  for (const PieceTouch& t : touches)
    felt[t.instrument] -= t.impulse;
  lead(moment, felt);
  for (std::size_t k = 0; k < cores.size(); ++k)
    if (const auto& led = state_.instruments[moment.there[k].instrument]->led) {
      cores[k].placed.a += led->place - cores[k].to.place;
      cores[k].to.place = led->place;
    }
  state_.guesses.clear();
  for (const PieceTouch& t : touches)
    if (t.impulse != Vec3{})
      state_.guesses.push_back(
          {moment.there[t.instrument].instrument, t.part, rows_of(t.piece), t.impulse / moment.h});
  std::ranges::sort(state_.guesses, {}, key_of);
  for (std::size_t i = 0; i < points.place.size(); ++i)
    points.place[i] += moment.h * (points.velocity[i] - velocity_before[i]);
  if (!move_out(points, cores, rounding, few_sweeps) &&
      !move_out(points, cores, on_surface, moment.last ? many_sweeps : few_sweeps) &&
      moment.there.size() > 1) {
    take_part_pinched(near, moment);
    move_out(points, cores, on_surface, many_sweeps);
  }
  for (std::size_t i = 0; i < near.rows.size(); ++i) {
    NodeRow& row = next[near.rows[i]];
    if (points.place[i] != place_before[i])
      put(points.place[i] - vector_of(layout_.rest[near.rows[i]].p), row.u);
    if (points.velocity[i] != velocity_before[i])
      put(points.velocity[i], row.v);
  }
  double largest = 0;
  for (const PieceTouch& t : touches)
    largest = std::max(largest, norm(t.impulse));
  std::vector<NodeTouch> impulses;
  for (const PieceTouch& t : touches)
    if (norm(t.impulse) > nothing * largest)
      for (std::size_t c = 0; c < 3; ++c)
        if (t.point.weights[c] > 0)
          impulses.push_back({near.rows[t.piece[c]], moment.there[t.instrument].instrument,
                              t.point.weights[c] * t.impulse});
  if (impulses.empty())
    return;
  state_.impulses.insert(state_.impulses.end(), impulses.begin(), impulses.end());
  state_.impulses = sums_of_touches(std::move(state_.impulses));
}

bool DynamicContact::still(double start, double h) const {
  for (const auto& i : state_.instruments)
    if (i && ((start < i->way.end && i->way.from != i->way.to) || i->jumped(start) ||
              i->moves(start + h, h)))
      return false;
  return true;
}

/// Behind a step: where instruments that are led have gone, by what they felt. \param impulses on
/// those that are there; none: nothing
void DynamicContact::lead(const ContactMoment& moment, std::span<const Vec3> impulses) {
  for (std::size_t k = 0; k < moment.there.size(); ++k)
    if (auto& led = state_.instruments[moment.there[k].instrument]->led)
      led->settle(moment.there[k].hand, moment.h,
                  impulses.empty() ? Vec3{} : impulses[k] / moment.h);
}

std::vector<std::uint32_t> DynamicContact::pieces_near(const Box3& box,
                                                       std::span<const NodeRow> rows) const {
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t k = 0; k < pieces_.size(); ++k) {
    Box3 own;
    for (const std::uint32_t row : pieces_[k])
      own.add(place(rows, row));
    if (near(own, box))
      numbers.push_back(k);
  }
  return numbers;
}

bool DynamicContact::inside(std::span<const NodeTraits> traits,
                            std::span<const NodeRow> rows) const {
  for (const auto& i : state_.instruments) {
    if (!i)
      continue;
    const PlacedInstrument placed(i->shape, i->at(HUGE_VAL));
    const Near near = near_pieces(pieces_near(placed.box(), rows), traits, rows);
    if (!touches_of(near.points, std::array{MovingCore{placed, {}, {}, 0}}, -2 * on_surface)
             .empty())
      return true;
  }
  return false;
}

void DynamicContact::balance(std::span<const NodeTraits> traits, std::span<const NodeRow> rows,
                             std::span<Vec3> acceleration, std::vector<NodeTouch>& touches) const {
  std::vector<MovingCore> cores;
  std::vector<std::uint32_t> instrument, numbers;
  for (std::uint32_t k = 0; k < state_.instruments.size(); ++k) {
    if (!state_.instruments[k])
      continue;
    const MovingInstrument& i = *state_.instruments[k];
    cores.push_back({PlacedInstrument(i.shape, i.at(HUGE_VAL)), {}, {}, 0});
    instrument.push_back(k);
    const double more = 2 * at_surface * i.shape.radius;
    Box3 box = cores.back().placed.box();
    box.min -= {more, more, more};
    box.max += {more, more, more};
    const std::vector<std::uint32_t> some = pieces_near(box, rows);
    numbers.insert(numbers.end(), some.begin(), some.end());
  }
  std::ranges::sort(numbers);
  numbers.erase(std::ranges::unique(numbers).begin(), numbers.end());
  Near near = near_pieces(numbers, traits, rows);
  for (std::size_t i = 0; i < near.rows.size(); ++i)
    near.points.velocity[i] =
        near.rows[i] < acceleration.size() ? acceleration[near.rows[i]] : Vec3{};
  std::vector<PieceTouch> found = touches_of(near.points, cores, at_surface);
  exchange_impulses(near.points, cores, found, exact_at_rest, sweeps_at_rest);
  for (std::size_t i = 0; i < near.rows.size(); ++i)
    if (near.rows[i] < acceleration.size())
      acceleration[near.rows[i]] = near.points.velocity[i];
  for (const PieceTouch& t : found)
    if (t.impulse != Vec3{})
      for (std::size_t c = 0; c < 3; ++c)
        if (t.point.weights[c] > 0)
          touches.push_back({layout_.node_of_row[near.rows[t.piece[c]]], instrument[t.instrument],
                             t.point.weights[c] * t.impulse});
  touches = sums_of_touches(std::move(touches));
}

void DynamicContact::hold(std::vector<NodeTouch> touches) {
  for (NodeTouch t : state_.held) {
    t.force *= state_.held_time;
    state_.resting.push_back(t);
  }
  state_.held_time = 0;
  state_.held = std::move(touches);
}

std::vector<NodeTouch> DynamicContact::take() {
  hold(std::vector<NodeTouch>(state_.held)); // that it counts
  std::vector<NodeTouch> all = std::exchange(state_.resting, {});
  for (NodeTouch t : std::exchange(state_.impulses, {})) {
    t.node = layout_.node_of_row[t.node];
    all.push_back(t);
  }
  return sums_of_touches(std::move(all));
}

} // namespace gewebe
