// What touches within a step of a solid that moves: instruments and surfaces.

#include "base/larger.h"
#include "base/vector_at.h"
#include "dynamics/solid_dynamic.h"
#include "statics/joined_yielding.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

namespace gewebe {

namespace {

constexpr std::size_t max_parts = 256; ///< of an instrument's way in one step
constexpr double slow_way = 0.1;       ///< of an edge: halves would do no better
/// Of a body's energy and what is done to it: so much may come of forces that were not found.
constexpr double thrown_by = 0.1;

} // namespace

SolidDynamic::Began SolidDynamic::began(double from) const {
  Began start{0, {engine_->places().begin(), engine_->places().end()}, {}, {}};
  if (!state_.instruments.empty())
    start.energy = engine_->kinetic_energy() + engine_->elastic_energy();
  for (const auto& i : state_.instruments)
    start.stood.push_back(i ? i->at(from) : Pose{});
  start.stands = state_.stands;
  return start;
}

// ---- what stands beside it

/// Of the body's nodes and those beside it: what is given for its own, and displacements of theirs,
/// as places, or 0. \param room for it, where there are such
std::span<const double> SolidDynamic::with_beside(std::span<const double> own, bool places,
                                                  std::vector<double>& room) const {
  if (state_.stands->empty())
    return own;
  room.assign(own.begin(), own.end());
  const std::size_t count = own.size();
  room.resize(count + state_.stands->size());
  for (std::size_t k = 0; places && k < state_.stands->size(); ++k)
    room[count + k] = beside_model_->nodes[(count + k) / 3].position[static_cast<int>(k % 3)] +
                      (*state_.stands)[k];
  return room;
}

/// Nodes of all that stand where they must. \pre some stand beside it
std::map<std::uint32_t, Vec3> SolidDynamic::displaced(double time) const {
  std::map<std::uint32_t, Vec3> all = state_.load->displacement;
  for (const auto& [node, u] : standing_->displaced(time))
    all.emplace_hint(all.end(), static_cast<std::uint32_t>(model_.nodes.size()) + node, u);
  return all;
}

/// Where nothing touches them.
void SolidDynamic::let_stand(double from, double to) {
  const bool let_go = !standing_touches().empty();
  if (standing_ == nullptr || (!let_go && !standing_->changes(from, to)))
    return;
  const std::unique_ptr<Yielding> all = standing_->yielding(to, {});
  (void)all->push({}, {});
  const std::span<const double> shape = all->shape();
  state_.stands.replace().assign(shape.begin(), shape.end());
}

std::vector<NodeTouch> SolidDynamic::standing_touches() const {
  return touches_of_part(state_.touched, static_cast<std::uint32_t>(model_.nodes.size()),
                         static_cast<std::uint32_t>(model_of_all().nodes.size()));
}

/// The farthest way of one of their nodes in a step, along an axis.
double SolidDynamic::moved_beside(const Began& start) const {
  double most = 0;
  for (std::size_t k = 0; k < state_.stands->size(); ++k)
    most = larger(most, std::abs((*state_.stands)[k] - (*start.stands)[k]));
  return most;
}

/// Whether a step left more energy than instruments and other forces gave, by their ways: then
/// forces that were not found have thrown the body about.
bool SolidDynamic::thrown(const Began& start, std::span<const double> forces, double to) const {
  if (state_.instruments.empty() || standing_ != nullptr) // whose energy nobody knows
    return false;
  double work = 0;
  for (const NodeTouch& t : state_.touched) {
    if (t.instrument >= state_.instruments.size() || !state_.instruments[t.instrument])
      continue;
    const Vec3 at = vector_at(engine_->places(), t.node);
    const Pose now = state_.instruments[t.instrument]->at(to);
    work += dot(t.force, at - carried(now, start.stood[t.instrument], at));
  }
  for (std::size_t axis = 0; axis < forces.size(); ++axis)
    work += forces[axis] * (engine_->places()[axis] - start.places[axis]);
  const double now = engine_->kinetic_energy() + engine_->elastic_energy();
  return !(now - start.energy - work <= thrown_by * (start.energy + std::abs(work)));
}

/// A step; in halves where surfaces come together too fast for its forces to be found, or where
/// forces of instruments that were not found throw it about.
void SolidDynamic::step_in_parts(double h, double from, double to, bool first, int halvings,
                                 const Context& context) {
  if (meetings_.empty() &&
      std::ranges::none_of(state_.instruments, [](const auto& i) { return i.has_value(); })) {
    (void)step(h, from, to, first, context);
    return;
  }
  const State was = state_;
  const TouchCounts touches = counts_.touches;
  const std::vector<double> places(engine_->places().begin(), engine_->places().end()),
      velocity(engine_->velocity().begin(), engine_->velocity().end());
  const bool met = step(h, from, to, first, context);
  if (met || halvings == 0 || state_.tries <= 0)
    return;
  if (!meetings_.empty()) {
    std::vector<double> free(velocity);
    free.resize(velocity.size() + state_.stands->size());
    std::vector<double> moved(free.size());
    for (std::size_t axis = 0; axis < velocity.size(); ++axis) {
      free[axis] *= h;
      moved[axis] = engine_->places()[axis] - places[axis];
    }
    for (std::size_t k = 0; k < state_.stands->size(); ++k)
      moved[velocity.size() + k] = (*state_.stands)[k] - (*was.stands)[k];
    if (!(std::max(contact_->way_of(free), contact_->way_of(moved)) > slow_way))
      return;
  }
  const int tries = state_.tries - 1;
  state_ = was;
  state_.tries = tries;
  counts_.touches = touches;
  ++counts_.steps;
  engine_->begin_again(places, velocity, context);
  const double middle = from + h / 2;
  step_in_parts(h / 2, from, middle, first, halvings - 1, context);
  if (state_.resting)
    state_.held_time += to - middle;
  else
    step_in_parts(h / 2, middle, to, false, halvings - 1, context);
}

bool SolidDynamic::instruments_move(bool first, double from, double to) const {
  return std::ranges::any_of(state_.instruments, [&](const auto& i) {
    if (i && i->led)
      return i->way.end > to || i->moves(to, to - from);
    return i && (i->way.end > to || (first && i->jumped(from)));
  });
}

/// A step, with what instruments do in it.
SolidDynamic::Pushed SolidDynamic::push(const std::vector<double>& forces,
                                        const std::vector<double>& target, double h, double from,
                                        double to, bool first, const Context& context) {
  SolidMotion& moving = *engine_;
  const auto& instruments = state_.instruments;
  const auto need_contact = [&] {
    if (!contact_)
      contact_ = std::make_unique<SolidContact>(model_of_all(), model_.nodes.size(), meetings_);
  };
  if (!meetings_.empty())
    need_contact();
  std::vector<double> room, more_room;
  bool meets = contact_ && contact_->may_meet(with_beside(moving.places(), true, room),
                                              with_beside(moving.velocity(), false, more_room), h);
  std::vector<double> places, velocity; // where it begins, if that may be needed again
  const CopyOnWrite<std::vector<double>> stands = state_.stands;
  if (!meetings_.empty() && !meets) {
    places.assign(moving.places().begin(), moving.places().end());
    velocity.assign(moving.velocity().begin(), moving.velocity().end());
  }
  const auto begin_again = [&] {
    if (meets || !contact_ || !contact_->may_have_met(with_beside(moving.places(), true, room)))
      return false;
    moving.begin_again(places, velocity, context);
    state_.stands = stands;
    meets = true;
    return true;
  };
  Pushed pushed;
  SolidStep& all = pushed.took;
  bool &met = pushed.met, &exact = pushed.exact;
  if (!meets && std::ranges::none_of(instruments, [](const auto& i) { return i.has_value(); })) {
    let_stand(from, to);
    state_.touched.clear();
    state_.pushes.clear();
    moving.drop_tangent();
    if (!target.empty())
      moving.move_held(target);
    all = moving.step(h, context);
    if (!begin_again())
      return pushed;
  }
  need_contact();
  const std::map<std::uint32_t, Vec3> of_all =
      standing_ != nullptr ? displaced(to) : std::map<std::uint32_t, Vec3>();
  const auto& displaced_now = standing_ != nullptr ? of_all : state_.load->displacement;
  const auto go = [&](double jump, double way, double jump_to, double way_to, bool clearing) {
    std::vector<std::optional<MovedInstrument>> moved;
    for (const auto& i : instruments) {
      if (!i) {
        moved.emplace_back();
        continue;
      }
      const auto at = [&](double of_jump, double of_way) {
        const Pose start = i->at(from);
        return of_jump < 1 ? between(i->before, start, of_jump)
                           : between(start, i->guess(to, h), of_way);
      };
      moved.emplace_back(MovedInstrument{i->shape, at(jump, way), at(jump_to, way_to)});
      if (i->led && !clearing) {
        moved.back()->compliance = CouplingStep(i->led->coupling, i->led->lag, h).compliance;
        moved.back()->pushed = i->led->force;
      }
    }
    const SolidContact::Result result = contact_->step(
        {moving, forces, clearing ? std::span<const double>() : std::span<const double>(target),
         displaced_now, moved, h, options_, clearing, meets, standing_, clearing ? from : to},
        state_.touched, state_.pushes, state_.stands.write(), context);
    counts_.touches.add(contact_->take_counts());
    all.rounds += result.took.rounds;
    all.factorisations += result.took.factorisations;
    all.change = result.took.change;
    all.left = result.took.left;
    all.limited = result.took.limited;
    exact = clearing || result.exact;
    met = met && result.met;
  };
  const auto parts = [&](bool jump) {
    std::vector<MovedInstrument> ways;
    for (const auto& i : instruments)
      if (i && jump)
        ways.push_back({i->shape, i->before, i->at(from)});
      else if (i)
        ways.push_back({i->shape, i->at(from), i->guess(to, h)});
    const bool moves = std::ranges::any_of(ways, [](const auto& w) { return w.before != w.now; });
    return moves ? parts_of_way(ways, max_parts) : 0;
  };
  const auto share = [](std::size_t part, std::size_t of) {
    return static_cast<double>(part) / static_cast<double>(of);
  };
  const std::size_t jumps = first ? parts(true) : 0, ways = std::max<std::size_t>(1, parts(false));
  const std::vector<NodeTouch> touched = state_.touched;
  do {
    state_.touched = touched;
    met = true;
    for (std::size_t p = 0; p < jumps; ++p)
      go(share(p, jumps), 0, share(p + 1, jumps), 0, true);
    for (std::size_t p = 0; p < ways; ++p)
      go(1, share(p, ways), 1, share(p + 1, ways), p + 1 < ways);
  } while (begin_again());
  lead_instruments(to, h);
  for (NodeTouch t : state_.touched) {
    t.force *= h;
    state_.impulses.push_back(t);
  }
  state_.exact = state_.exact && exact;
  return pushed;
}

/// Where those that are led have gone in a step, by what they felt.
void SolidDynamic::lead_instruments(double to, double h) {
  for (std::uint32_t k = 0; k < state_.instruments.size(); ++k)
    if (auto& i = state_.instruments[k]; i && i->led) {
      Vec3 felt;
      for (const NodeTouch& t : state_.touched)
        felt -= t.instrument == k ? t.force : Vec3{};
      i->led->settle(i->way.at(to).place, h, felt);
    }
}

} // namespace gewebe
