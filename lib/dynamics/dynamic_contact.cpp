#include "dynamics/dynamic_contact.h"

#include <algorithm>
#include <cmath>
#include <utility>

// Based on: J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988
// (contact by velocities).

namespace gewebe {

namespace {

constexpr double on_surface = 1e-9; ///< of the radius
constexpr std::uint64_t max_unseen = 16;
constexpr std::size_t max_parts = 256;
constexpr int max_passes = 32; ///< between instruments that touch one node

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

/// m v, 0 along axes without inverse mass.
Vec3 over(const Vec3& v, const Vec3& inverse_mass) {
  return {v.x != 0 ? v.x / inverse_mass.x : 0, v.y != 0 ? v.y / inverse_mass.y : 0,
          v.z != 0 ? v.z / inverse_mass.z : 0};
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

/// Moves p out along the normal, or what the node's axes leave of it.
void out(const PlacedInstrument& instrument, const Vec3& inward, const Vec3& inverse_mass,
         Vec3& p) {
  const Vec3 n = instrument.normal(p, inward), way = free_part(n, inverse_mass);
  if (way == n) {
    p -= instrument.distance(p) * n;
  } else if (norm(way) > 1e-3) {
    leave(instrument, way / norm(way), p);
  }
}

/// What contact leaves of the velocity v.
Vec3 after_contact(const Vec3& v, const Vec3& velocity, const Vec3& n, double friction) {
  const Vec3 against = v - velocity;
  const double into = -dot(against, n);
  if (!(into > 0))
    return v;
  const Vec3 along = against + into * n;
  const double size = norm(along);
  const double left = size > friction * into ? 1 - friction * into / size : 0;
  return velocity + left * along;
}

double apart(const Box3& a, const Box3& b) {
  double d = -HUGE_VAL;
  for (int k = 0; k < 3; ++k)
    d = std::max({d, a.min[k] - b.max[k], b.min[k] - a.max[k]});
  return d;
}

} // namespace

DynamicContact::DynamicContact(const Model& model, const SpringLayout& layout)
    : model_(model), layout_(layout), surface_(surface_count(model)),
      inward_(inward_directions(model)) {
  state_.next_look.resize(layout.blocks.size());
  state_.impulses.resize(layout.blocks.size());
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
    t.from = i.way.at(time);
    t.to = i.way.at(time + h);
    t.placed = PlacedInstrument(i.shape, t.to);
    t.box = t.placed.box();
    t.speed = i.way.end > time
                  ? 2 * path_length(i.shape, i.way.from, i.way.to) / (i.way.end - i.way.start)
                  : 0;
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
    if (step == 0 && i.before != t.from)
      go(i.before, t.from);
    go(t.from, t.to);
  }
  return m;
}

void DynamicContact::keep_out(std::size_t block, const ContactMoment& moment,
                              const NodeTraits* traits, NodeRow* next) {
  if (moment.there.empty() || (moment.step < state_.next_look[block] && !moment.last))
    return;
  const SpringBlock& b = layout_.blocks[block];
  Box3 box;
  double fastest = 0;
  for (std::size_t row = b.first; row < b.first + b.count; ++row) {
    if (layout_.node_of_row[row] >= surface_)
      continue;
    box.add(vector_of(layout_.rest[row].p) + vector_of(next[row].u));
    const Vec3 v = vector_of(next[row].v);
    fastest = std::max(fastest, dot(v, v));
  }
  if (box.empty())
    return;
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
  if (!any)
    return;
  for (std::size_t row = b.first; row < b.first + b.count; ++row)
    if (layout_.node_of_row[row] < surface_)
      push(row, moment, traits[row], next[row], state_.impulses[block]);
}

void DynamicContact::push(std::size_t row, const ContactMoment& moment, const NodeTraits& traits,
                          NodeRow& state, std::vector<NodeTouch>& impulses) const {
  const Vec3 inverse = vector_of(traits.inverse_mass);
  const Vec3 rest = vector_of(layout_.rest[row].p), before = rest + vector_of(state.u);
  const auto inside = [](const PlacedInstrument& i, const Vec3& p) {
    return i.distance(p) < -on_surface * i.radius;
  };
  Vec3 p = before, v = vector_of(state.v);
  const Vec3& inward = inward_[layout_.node_of_row[row]];
  bool moved = false;
  for (const ContactMoment::There& t : moment.there) {
    const auto in_box = [&] {
      return p.x >= t.box.min.x && p.x <= t.box.max.x && p.y >= t.box.min.y && p.y <= t.box.max.y &&
             p.z >= t.box.min.z && p.z <= t.box.max.z;
    };
    if (inverse == Vec3{} || !in_box())
      continue;
    for (const PlacedInstrument& place : t.on_its_way)
      if (inside(place, p)) {
        out(place, inward, inverse, p);
        moved = true;
      }
  }
  // The velocity once per instrument; between several the place in turns.
  std::size_t hits = 0;
  for (int pass = 0; pass < max_passes; ++pass) {
    bool clear = true;
    for (const ContactMoment::There& t : moment.there) {
      if (inverse == Vec3{} || !(t.placed.distance(p) < 0) || (pass > 0 && !inside(t.placed, p)))
        continue;
      clear = false;
      moved = true;
      ++hits;
      const Vec3 n = t.placed.normal(p, inward);
      const Vec3 velocity = (p - carried(t.to, t.from, p)) / moment.h;
      const Vec3 after = after_contact(v, velocity, n, t.placed.friction);
      const Vec3 by = free_part(after - v, inverse);
      p += moment.h * (by - dot(by, n) * n);
      v += by;
      if (t.placed.distance(p) < 0)
        out(t.placed, inward, inverse, p);
      if (by == Vec3{})
        continue;
      const Vec3 impulse = over(by, inverse);
      const NodeTouch touch{static_cast<std::uint32_t>(row), t.instrument, impulse};
      const auto at = std::lower_bound(
          impulses.begin(), impulses.end(), touch, [](const NodeTouch& a, const NodeTouch& b) {
            return a.node != b.node ? a.node < b.node : a.instrument < b.instrument;
          });
      if (at != impulses.end() && at->node == touch.node && at->instrument == touch.instrument)
        at->force += impulse;
      else
        impulses.insert(at, touch);
    }
    if (clear || moment.there.size() == 1)
      break;
  }
  if (!moved)
    return;
  if (hits > 1) {
    // Pinched: out across the line from one instrument to the other.
    const ContactMoment::There *a = nullptr, *b = nullptr;
    for (const ContactMoment::There& t : moment.there)
      if (inside(t.placed, p))
        (a == nullptr ? a : b) = &t;
      else if (b == nullptr && t.placed.distance(p) < 1e-3 * t.placed.radius)
        b = &t;
    if (a != nullptr) {
      const Vec3 n = a->placed.normal(p, inward);
      const Vec3 along = b == nullptr ? n : n - b->placed.normal(p, inward);
      Vec3 way = inward - dot(inward, along) / std::max(dot(along, along), 1e-300) * along;
      way = free_part(way, inverse);
      if (!(norm(way) > 1e-6 * norm(inward)))
        way = free_part(std::abs(along.x) < 0.6 * norm(along) ? cross(along, {1, 0, 0})
                                                              : cross(along, {0, 1, 0}),
                        inverse);
      if (norm(way) > 0)
        for (std::size_t k = 0; k < moment.there.size(); ++k)
          for (const ContactMoment::There& t : moment.there)
            if (inside(t.placed, p))
              leave(t.placed, way / norm(way), p);
    }
  }
  put(p - rest, state.u);
  put(v, state.v);
}

bool DynamicContact::still(double start) const {
  for (const auto& i : state_.instruments)
    if (i && ((start < i->way.end && i->way.from != i->way.to) || i->before != i->way.at(start)))
      return false;
  return true;
}

bool DynamicContact::inside(std::uint32_t node, const Vec3& displacement) const {
  const Vec3 p = model_.nodes[node].position + displacement;
  return node < surface_ &&
         std::any_of(state_.instruments.begin(), state_.instruments.end(), [&](const auto& i) {
           return i &&
                  PlacedInstrument(i->shape, i->way.to).distance(p) < -on_surface * i->shape.radius;
         });
}

Vec3 DynamicContact::left_of(std::uint32_t node, const Vec3& displacement, const Vec3& inverse_mass,
                             const Vec3& acceleration, std::vector<NodeTouch>& touches) const {
  Vec3 left = acceleration;
  const Vec3 p = model_.nodes[node].position + displacement;
  if (node >= surface_)
    return left;
  for (std::uint32_t k = 0; k < state_.instruments.size(); ++k) {
    if (!state_.instruments[k])
      continue;
    const PlacedInstrument placed(state_.instruments[k]->shape, state_.instruments[k]->way.to);
    if (!(std::abs(placed.distance(p)) < on_surface * placed.radius))
      continue;
    const Vec3 after = after_contact(left, {}, placed.normal(p, inward_[node]), placed.friction);
    const Vec3 by = free_part(after - left, inverse_mass);
    left += by;
    if (by != Vec3{})
      touches.push_back({node, k, over(by, inverse_mass)});
  }
  return left;
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
  for (std::vector<NodeTouch>& some : state_.impulses) {
    for (NodeTouch t : some) {
      t.node = layout_.node_of_row[t.node];
      all.push_back(t);
    }
    some.clear();
  }
  return sums_of_touches(std::move(all));
}

} // namespace gewebe
