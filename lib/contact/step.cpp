#include "contact/step.h"

#include "base/rounded_text.h"
#include "collision/candidate_filter.h"
#include "contact/barrier.h"
#include "contact/contact_pairs.h"
#include "contact/friction.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>

namespace gewebe::contact {

namespace {

/// Force of a pair of weight 1 at half of d_hat is 1/4.33 of kappa d_hat^3.
constexpr double barrier_at_half = 4.33;
constexpr double armijo = 1e-4;
constexpr int max_halvings = 40;
/// Part of a step below which nothing moves any more.
constexpr double stuck = 1e-12;
/// Decrement below which an energy cannot be told from rounding.
constexpr double rounding = 1e-13;

std::string place_text(const Vec3& at) {
  return rounded_text(at.x) + " " + rounded_text(at.y) + " " + rounded_text(at.z);
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& way) {
  const double square = dot(way, way);
  const double t = square > 0 ? std::clamp(dot(p - a, way) / square, 0.0, 1.0) : 0;
  return norm(p - a - t * way);
}

/// The next power of 4: the stiffness of the barrier stays from step to step while forces change
/// little, so that what it stores is given back.
double stepped(double force) {
  int exponent = 0;
  const double part = std::frexp(force, &exponent); // 0.5 <= part < 1
  if (part == 0.5)
    --exponent;
  return std::ldexp(1, exponent + (exponent % 2 != 0 ? 1 : 0));
}

} // namespace

void StepReport::add(const StepReport& more) {
  iterations += more.iterations;
  rounds += more.rounds;
  lags += more.lags;
  searches += more.searches;
  cuts += more.cuts;
  steps += more.steps;
  halvings += more.halvings;
  most_iterations = std::max(most_iterations, more.most_iterations);
  pairs = std::max(pairs, more.pairs);
  vertices = std::max(vertices, more.vertices);
  gap = std::min(gap, more.gap);
  friction_residual = std::max(friction_residual, more.friction_residual);
}

/// The contact energy of a step, and what its minimisation needs.
class StepSolver::Work {
public:
  Work(const Island& island, collision::BroadPhase& broad_phase, InverseCache& inverses,
       const StepOptions& options, const Context& context)
      : island_(island), broad_phase_(broad_phase), inverses_(inverses), options_(options),
        context_(context), count_(island.table.vertex_count()), begin_(count_), at_(count_),
        way_(count_), trial_(count_), gradient_(count_), d_hat_(island.activation_distance),
        stick_(options.h > 0 ? options.parameters.stick_speed * options.h
                             : options.parameters.stick_length * island.edge),
        margin_(options.parameters.margin * island.edge) {
    read_positions(begin_);
    at_ = begin_;
    for (std::size_t a = 0; a < island.friction.owners(); ++a)
      for (std::size_t b = 0; b < island.friction.owners(); ++b)
        rough_ = rough_ || (island.allowed.at(a, b) != 0 && island.friction.at(a, b) > 0);
  }

  StepReport run();
  std::vector<ContactForce> forces();

private:
  void read_positions(std::vector<Vec3>& x);
  double longest_way() const;
  bool raise_stiffness(double force);
  void set_stiffness(std::span<const Vec3> to);
  void search(std::span<const Vec3> to, double reach);
  double free_part(std::span<const Vec3> to, double longest);
  void find_pairs(std::span<const Vec3> x) {
    find_active_pairs(island_.surface, filter_.select(island_.surface, x, d_hat_), x, d_hat_,
                      pairs_);
    for (ContactPair& pair : pairs_.pairs) {
      // The same force at the same part of d_hat, whatever d_min is.
      const double scale = d_hat_ * d_hat_ / barrier_range(d_hat_, pair.d_min);
      pair.weight *= scale * scale;
    }
  }
  double energy_at(std::span<const Vec3> x);
  void lag();
  void damp_lag(std::span<const FrictionPair> before);
  bool lag_changes();
  void minimise();
  bool solve_system(CondensedSystem& system, HessianMode mode);
  struct Step {
    double slope = 0;  ///< of the contact energy
    double length = 0; ///< the longest of a vertex
    double free = 0;   ///< part of it that collision detection allows
  };
  Step take_step(const CondensedSystem& system);
  std::pair<double, Vec3> nearest() const;
  [[noreturn]] void fail_stuck() const;
  void require_apart() const;
  bool follow_way(CondensedSystem& system, bool balanced);
  void take(CondensedSystem& system, const Step& step, double part);
  bool lower_energy(CondensedSystem& system, double contact);
  bool iterate(CondensedSystem& system, int iteration, bool& converged);
  bool move_bodies(const CondensedSystem& system, bool ends);
  struct Round {
    std::vector<Vec3> to, start;                 ///< ends of the ways; R0
    double energy = 0;                           ///< R0^T A R0, roughly
    std::vector<std::vector<VertexForce>> force; ///< F_0
  };
  bool follow_bodies(double margin);
  bool solve_round(const Round& round, double margin, bool& exact);
  void sharpen(double change);
  void go_back(const Round& round, std::span<const Vec3> begin);
  bool is_free(std::span<const Vec3> to);
  bool move_alone(std::span<const Vec3> to);
  bool covered(std::uint32_t vertex, const Vec3& x, double room) const {
    return distance_to_segment(x, swept_from_[vertex], swept_[vertex]) <= room;
  }
  bool covered(std::span<const Vec3> x, double room) const;
  double largest_distance(std::span<const Vec3> a, std::span<const Vec3> b) const;
  /// Length of a step of Newton's method below which positions have converged.
  double step_limit() const {
    return options_.parameters.step_tolerance * (rough_ ? std::min(d_hat_, stick_) : d_hat_);
  }

  const Island& island_;
  collision::BroadPhase& broad_phase_;
  InverseCache& inverses_;
  const StepOptions& options_;
  const Context& context_;
  std::size_t count_;
  std::vector<Vec3> begin_; ///< y_n
  std::vector<Vec3> at_;    ///< present positions
  std::vector<Vec3> way_;   ///< x_free - x of the round
  std::vector<Vec3> trial_, gradient_, friction_before_;
  double d_hat_, stick_, margin_;
  double kappa_ = 0, typical_force_ = 0;
  double barrier_force_ = 0; ///< force at half of d_hat
  double last_step_ = 0;     ///< length of the last full step of Newton's method; else infinite
  bool rough_ = false;       ///< some pairs have friction
  int way_lags_ = 0, round_lags_ = 0; ///< renewals on the way, and behind solutions
  bool led_ = false;                  ///< some vertices go ways that nothing stops
  std::vector<double> changes_;       ///< of positions, by rounds
  bool settled_ = true;               ///< the last round ended with balanced forces
  bool models_hold_ = true;           ///< of all bodies, in the last round
  collision::Candidates candidates_;
  collision::CandidateFilter filter_;           ///< of the candidates
  std::vector<std::uint32_t> vertices_;         ///< of candidates, and those with forces
  std::vector<std::vector<VertexForce>> force_; ///< by body
  std::vector<Vec3> swept_from_, swept_;        ///< what the candidates are of
  ContactPairs pairs_;
  std::vector<FrictionPair> friction_;
  std::vector<std::array<Vec3, 4>> pair_forces_;
  std::vector<HessianBlock> blocks_, friction_blocks_;
  StepReport report_;
};

void StepSolver::Work::read_positions(std::vector<Vec3>& x) {
  const BodyTable& table = island_.table;
  for (std::size_t b = 0; b < table.bodies.size(); ++b)
    table.bodies[b]->positions(
        std::span(x).subspan(table.first[b], table.first[b + 1] - table.first[b]));
}

double StepSolver::Work::longest_way() const {
  double longest = 0;
  for (const Vec3& way : way_)
    longest = std::max(longest, norm(way));
  return longest;
}

/// Scales the barrier by a typical contact force: that of the bodies, a part of the largest of the
/// last step, or, where the bodies collide on their ways to `to`, a part of the force that stops a
/// vertex within the step. What turns out larger makes it stiffer (raise_stiffness); one that is
/// too stiff is a wall that Newton's steps bounce off.
void StepSolver::Work::set_stiffness(std::span<const Vec3> to) {
  const Parameters& p = options_.parameters;
  double force = std::numeric_limits<double>::infinity();
  for (const ContactBody* const body : island_.table.bodies)
    if (const double typical = body->typical_force(); typical > 0)
      force = std::min(force, typical);
  if (!std::isfinite(force))
    force = 1;
  for (const std::vector<VertexForce>& of : force_)
    for (const VertexForce& f : of)
      force = std::max(force, p.last_share * norm(f.force));
  double stiffness = std::numeric_limits<double>::infinity();
  for (const ContactBody* const body : island_.table.bodies)
    if (const double own = body->vertex_stiffness(); own > 0)
      stiffness = std::min(stiffness, own);
  if (!std::isfinite(stiffness))
    stiffness = 0;
  force = std::max(force, d_hat_ * stiffness);
  if (const double longest = longest_way(); longest > 0) {
    const double stop = p.stop_share * stiffness * longest;
    if (stop > force && collision::collision_free_step(island_.surface, candidates_, at_, to,
                                                       {0, p.kept_gap, d_hat_, 1000}) < 1)
      force = stop;
  }
  typical_force_ = force;
  barrier_force_ = stepped(force);
  kappa_ = barrier_force_ / (barrier_at_half * d_hat_ * d_hat_ * d_hat_);
}

/// Makes the barrier stiffer where forces have become much larger than the typical one: deep in the
/// barrier Newton's steps are short. \param force  largest of those that balance
bool StepSolver::Work::raise_stiffness(double force) {
  const Parameters& p = options_.parameters;
  const double wanted = stepped(p.last_share * force);
  if (!(wanted > barrier_force_))
    return false;
  const double factor = std::min(wanted / barrier_force_, p.stiffness_factor);
  barrier_force_ *= factor;
  kappa_ *= factor;
  return true;
}

void StepSolver::Work::search(std::span<const Vec3> to, double reach) {
  broad_phase_.find(island_.surface, at_, to, reach, island_.allowed, candidates_);
  ++report_.searches;
  swept_from_ = at_;
  swept_.resize(count_);
  for (std::size_t v = 0; v < count_; ++v)
    swept_[v] = to[v] - at_[v];
  std::vector<std::uint8_t> used(count_);
  const auto use = [&](const auto& lists) {
    for (const auto& list : lists)
      for (const std::uint32_t v : list)
        used[v] = 1;
  };
  use(candidates_.point_point);
  use(candidates_.point_edge);
  use(candidates_.edge_edge);
  use(candidates_.point_triangle);
  for (const FrictionPair& pair : friction_)
    for (std::size_t k = 0; k < pair.count; ++k)
      used[pair.vertex[k]] = 1;
  for (std::size_t b = 0; b < force_.size(); ++b)
    for (const VertexForce& f : force_[b])
      used[island_.table.first[b] + f.vertex] = 1;
  vertices_.clear();
  for (std::uint32_t v = 0; v < count_; ++v)
    if (used[v] != 0)
      vertices_.push_back(v);
  filter_.reset(candidates_, vertices_, at_);
}

/// Largest part of the way to `to` along which no surfaces come too close. \param longest  way of
/// any vertex
double StepSolver::Work::free_part(std::span<const Vec3> to, double longest) {
  const collision::Separation separation{0, options_.parameters.kept_gap, d_hat_, 1000};
  const auto part_of = [&](double range, double t_max) {
    return collision::collision_free_step(
        island_.surface, filter_.select(island_.surface, at_, range), at_, to, separation, t_max);
  };
  // Pairs in contact limit the way most. Behind them few others remain to be looked at.
  const double most = part_of(d_hat_, 1);
  return part_of(d_hat_ + 2 * most * longest, most);
}

/// Whether all vertices are within `room` of what the candidates were searched for.
bool StepSolver::Work::covered(std::span<const Vec3> x, double room) const {
  for (std::uint32_t v = 0; v < count_; ++v)
    if (!covered(v, x[v], room))
      return false;
  return true;
}

double StepSolver::Work::largest_distance(std::span<const Vec3> a, std::span<const Vec3> b) const {
  double most = 0;
  for (std::size_t v = 0; v < count_; ++v)
    if (const double d = norm(a[v] - b[v]); !(d <= most))
      most = d;
  return most;
}

/// Energy of contact; leaves the pairs of x.
double StepSolver::Work::energy_at(std::span<const Vec3> x) {
  find_pairs(x);
  return barrier_energy(pairs_, x, kappa_) + friction_energy(friction_, x, begin_, stick_);
}

/// Normal forces and tangent planes of friction at the present positions. \pre pairs are of here
void StepSolver::Work::lag() {
  if (!rough_)
    return;
  lag_friction(island_.surface, pairs_, at_, kappa_, island_.friction, friction_);
  ++report_.lags;
}

/// Halves the change of the lag's normal forces: where friction itself brings them forth, whole
/// changes may alternate for ever. \param before  the lag before this one
void StepSolver::Work::damp_lag(std::span<const FrictionPair> before) {
  const auto key = [](const FrictionPair& pair) { return std::pair(pair.count, pair.vertex); };
  std::map<std::pair<std::uint8_t, std::array<std::uint32_t, 4>>, double> forces;
  for (const FrictionPair& pair : before)
    forces[key(pair)] = pair.normal_force;
  for (FrictionPair& pair : friction_) {
    const auto found = forces.find(key(pair));
    const double part = (1 + (found == forces.end() ? 0 : found->second) / pair.normal_force) / 2;
    pair.normal_force *= part;
    pair.limit *= part;
  }
}

/// Takes a new lag where that changes forces by more than the tolerance, and tells whether it did:
/// the forces that balance are those of the lag that stays.
bool StepSolver::Work::lag_changes() {
  if (!rough_)
    return false;
  friction_before_.assign(count_, {});
  std::vector<Vec3> now(count_);
  (void)add_friction_gradient(friction_, at_, begin_, stick_, friction_before_);
  std::vector<FrictionPair> before = friction_;
  find_pairs(at_);
  lag();
  (void)add_friction_gradient(friction_, at_, begin_, stick_, now);
  double change = 0, largest = 0;
  barrier_forces(pairs_, at_, kappa_, pair_forces_);
  for (const std::array<Vec3, 4>& forces : pair_forces_)
    for (const Vec3& f : forces)
      largest = std::max(largest, norm(f));
  for (const std::uint32_t v : vertices_)
    change = std::max(change, norm(now[v] - friction_before_[v]));
  report_.friction_residual = largest > 0 ? change / largest : 0;
  if (!(report_.friction_residual <= options_.parameters.friction_tolerance)) {
    if (round_lags_ >= options_.parameters.whole_lags)
      damp_lag(before);
    return true;
  }
  friction_ = std::move(before);
  return false;
}

/// Newton's system at the present positions. \return whether it was positive definite
bool StepSolver::Work::solve_system(CondensedSystem& system, HessianMode mode) {
  barrier_hessian(pairs_, at_, kappa_, mode, blocks_);
  friction_hessian(friction_, at_, begin_, stick_, friction_blocks_);
  std::vector<std::uint32_t> active;
  for (const auto* const list : {&blocks_, &friction_blocks_})
    for (const HessianBlock& block : *list)
      active.insert(active.end(), block.vertex.begin(), block.vertex.begin() + block.count);
  std::ranges::sort(active);
  active.erase(std::ranges::unique(active).begin(), active.end());
  system.activate(active);
  system.clear_hessian();
  for (const auto* const list : {&blocks_, &friction_blocks_})
    for (const HessianBlock& block : *list)
      system.add_hessian(std::span(block.vertex).first(block.count),
                         std::span(block.entry).first(std::size_t{9} * block.count * block.count));
  return system.solve(gradient_, 0);
}

/// Smallest gap of the pairs, and where it is.
std::pair<double, Vec3> StepSolver::Work::nearest() const {
  double least = std::numeric_limits<double>::infinity();
  Vec3 place;
  for (const ContactPair& pair : pairs_.pairs) {
    ContactPairs one;
    one.d_hat = d_hat_;
    one.pairs = {pair};
    if (const double gap = smallest_gap(one, at_); !(gap >= least)) {
      least = gap;
      place = at_[pair.vertex[pair.count - std::size_t{1}]];
    }
  }
  return {least, place};
}

void StepSolver::Work::fail_stuck() const {
  throw NotSolved("contact: a prescribed motion meets fixed nodes near " +
                  place_text(nearest().second));
}

/// Surfaces must stand apart where a step begins.
void StepSolver::Work::require_apart() const {
  if (pairs_.pairs.empty())
    return;
  if (const auto [gap, place] = nearest(); !(gap > 0))
    throw IntersectsAtStart("contact: surfaces intersect near " + place_text(place));
}

/// The chosen step of the system; trial_ becomes its end.
StepSolver::Work::Step StepSolver::Work::take_step(const CondensedSystem& system) {
  Step result;
  const std::span<const std::uint32_t> vertices = system.vertices();
  trial_ = at_;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const Vec3& step = system.step(k);
    result.slope += dot(gradient_[vertices[k]], step);
    const double size = norm(step);
    result.length = size <= result.length ? result.length : size;
    trial_[vertices[k]] += step;
  }
  if (!std::isfinite(result.length))
    throw NotSolved("contact: Newton's step is not finite");
  result.free = free_part(trial_, result.length);
  if (!(result.free > stuck))
    fail_stuck();
  return result;
}

/// Takes a part of the way that is left, with the forces of the linear forecast behind it. \return
/// whether it did; else forces must balance first
bool StepSolver::Work::follow_way(CondensedSystem& system, bool balanced) {
  const Parameters& p = options_.parameters;
  double reach = 1;
  Step step = take_step(system);
  if (const double most = p.longest_step * island_.edge;
      !pairs_.pairs.empty() && step.length > most) {
    reach = std::max(most / step.length, p.least_reach);
    system.choose_reach(reach);
    step = take_step(system);
  }
  for (int k = 0; k < p.max_reaches && !pairs_.pairs.empty() && step.free < p.full_reach; ++k) {
    if (!balanced)
      return false;
    reach = std::max(reach * step.free, p.least_reach);
    system.choose_reach(reach);
    step = take_step(system);
  }
  take(system, step, step.free);
  return true;
}

/// Takes a part of the step that ends at trial_.
void StepSolver::Work::take(CondensedSystem& system, const Step& step, double part) {
  for (const std::uint32_t v : system.vertices())
    at_[v] = part < 1 ? at_[v] + part * (trial_[v] - at_[v]) : trial_[v];
  system.advance(part);
  report_.cuts += step.free < 1 ? 1 : 0;
  if (part == 1 && system.share() == 0)
    last_step_ = step.length;
}

/// Lowers the energy with the way that is left as it is. \param contact  energy of contact here
/// \return whether anything was gained
bool StepSolver::Work::lower_energy(CondensedSystem& system, double contact) {
  const Parameters& p = options_.parameters;
  system.choose_reach(led_ ? 0 : 1);
  Step step = take_step(system);
  // What is stiff is restored by a damped step, too; a part of a step would leave it as it is. The
  // one that is expected to lower the energy most is taken.
  const auto gain = [&](const Step& of) {
    return -of.free * (1 - of.free / 2) * (system.slope() + of.slope);
  };
  double damping = 0, best_damping = 0, most = gain(step);
  for (int k = 0; k < p.max_dampings && step.free < p.full_reach; ++k) {
    const double size = step.length * step.length;
    const double softest = size > 0 ? -(system.slope() + step.slope) / size : 0;
    damping =
        damping > 0 ? p.damping_factor * damping : softest / std::max(step.free, p.least_reach);
    if (!(damping > 0) || !system.solve(gradient_, damping))
      break;
    system.choose_reach(led_ ? 0 : 1);
    step = take_step(system);
    if (gain(step) > most) {
      most = gain(step);
      best_damping = damping;
    }
  }
  if (best_damping != damping) {
    (void)system.solve(gradient_, best_damping);
    system.choose_reach(led_ ? 0 : 1);
    step = take_step(system);
  }
  system.require_descent(step.slope);
  const double slope = system.slope() + step.slope, here = system.energy(0) + contact;
  const double unsure = rounding * (std::abs(here) + std::abs(contact));
  const std::vector<Vec3> target = trial_;
  double part = step.free;
  for (int k = 0; k < max_halvings; ++k) {
    for (const std::uint32_t v : system.vertices())
      trial_[v] = part < 1 ? at_[v] + part * (target[v] - at_[v]) : target[v];
    if (system.energy(part) + energy_at(trial_) <=
        here + armijo * part * std::min(slope, 0.0) + unsure) {
      trial_ = target;
      take(system, step, part);
      return true;
    }
    part /= 2;
  }
  if (!(step.length <= step_limit()) || step.free < 1)
    return false;
  // The energy cannot be told from rounding; forces can.
  trial_ = target;
  take(system, step, 1);
  return true;
}

/// One iteration of Newton's method. \return whether anything was gained
bool StepSolver::Work::iterate(CondensedSystem& system, int iteration, bool& converged) {
  const Parameters& p = options_.parameters;
  std::ranges::fill(gradient_, Vec3{});
  find_pairs(at_);
  double contact = add_barrier_gradient(pairs_, at_, kappa_, gradient_) +
                   add_friction_gradient(friction_, at_, begin_, stick_, gradient_);
  CondensedSystem::Residual residual = system.residual(gradient_);
  converged = last_step_ <= step_limit() &&
              residual.difference <=
                  p.force_tolerance * std::max(residual.largest, p.small_force * typical_force_);
  if (converged)
    return true;
  const auto balances = [&](double tolerance) {
    return residual.difference <= tolerance * std::max(residual.largest, typical_force_);
  };
  // Normal forces that do not balance are none to hold anything by friction.
  const bool lags =
      rough_ && iteration > 0 && way_lags_ < p.max_way_lags && balances(p.lag_tolerance);
  const bool stiffer = balances(p.way_tolerance) && raise_stiffness(residual.largest);
  if (lags) {
    const std::vector<FrictionPair> before = friction_;
    lag();
    if (way_lags_++ >= p.whole_lags)
      damp_lag(before);
  }
  if (lags || stiffer) {
    std::ranges::fill(gradient_, Vec3{});
    contact = add_barrier_gradient(pairs_, at_, kappa_, gradient_) +
              add_friction_gradient(friction_, at_, begin_, stick_, gradient_);
    residual = system.residual(gradient_);
  }
  const bool near = last_step_ <= d_hat_, balanced = balances(p.way_tolerance);
  last_step_ = std::numeric_limits<double>::infinity();
  // The exact Hessian converges fastest from near by; from afar it may be all but singular.
  const HessianMode from_afar =
      iteration < p.gauss_newton ? HessianMode::gauss_newton : HessianMode::projected;
  if (!(near && solve_system(system, HessianMode::exact)) && !solve_system(system, from_afar) &&
      !solve_system(system, HessianMode::projected))
    throw NotSolved("contact: Newton's system is not positive definite");
  if (led_ && system.share() > 0 && (balanced || iteration == 0) && follow_way(system, balanced))
    return true;
  return lower_energy(system, contact);
}

/// Moves all bodies under the forces found. \param ends  with the momenta that belong to them
/// \return whether these are right
bool StepSolver::Work::move_bodies(const CondensedSystem& system, bool ends) {
  find_pairs(at_);
  const double room =
      options_.parameters.momentum_room * std::min(d_hat_, smallest_gap(pairs_, at_));
  bool exact = true;
  for (std::size_t b = 0; b < island_.table.bodies.size(); ++b) {
    ContactBody& body = *island_.table.bodies[b];
    force_[b] = system.forces(b);
    body.move(system.share(), force_[b]);
    if (!ends)
      continue;
    models_hold_ = body.model_holds() && models_hold_;
    exact = body.keep_momentum(room) && exact;
  }
  return exact;
}

/// Whether the way from here to `to` is free, and nothing touches there.
bool StepSolver::Work::is_free(std::span<const Vec3> to) {
  if (vertices_.empty())
    return true;
  if (collision::collision_free_step(island_.surface, candidates_, at_, to, {0, 0, d_hat_, 1000}) <
      1)
    return false;
  find_pairs(to);
  return pairs_.pairs.empty();
}

/// The step of bodies that meet nothing on their ways. \param to  ends of the ways of linear bodies
/// \return whether it is one; else all stand where they began
bool StepSolver::Work::move_alone(std::span<const Vec3> to) {
  const BodyTable& table = island_.table;
  std::vector<std::size_t> moved;
  bool alone = true;
  trial_.assign(to.begin(), to.end());
  for (std::size_t b = 0; b < table.bodies.size() && alone; ++b) {
    ContactBody& body = *table.bodies[b];
    if (body.is_linear())
      continue;
    alone = body.solve_alone();
    if (!alone)
      break;
    moved.push_back(b);
    body.positions(std::span(trial_).subspan(table.first[b], table.first[b + 1] - table.first[b]));
  }
  if (alone) {
    search(trial_, d_hat_);
    alone = is_free(trial_);
  }
  if (!alone) {
    for (const std::size_t b : moved)
      table.bodies[b]->begin_again();
    return false;
  }
  for (ContactBody* const body : table.bodies)
    if (body->is_linear())
      body->move(0, {});
  at_ = trial_;
  return true;
}

/// Moves the bodies to where the system has them and looks whether what was not watched on the way
/// met anything. \param margin  of the candidates \return whether it met nothing; trial_ is where
/// they are
bool StepSolver::Work::follow_bodies(double margin) {
  trial_.resize(count_);
  read_positions(trial_);
  if (covered(trial_, margin / 2))
    return collision::collision_free_step(island_.surface, candidates_, at_, trial_,
                                          {0, 0, d_hat_, 1000}) >= 1;
  // From where all stood when it was searched: what was watched has gone on since, the rest has
  // not.
  at_.swap(swept_from_);
  const std::vector<Vec3> from = at_;
  search(trial_, d_hat_ + margin);
  return collision::collision_free_step(island_.surface, candidates_, from, trial_,
                                        {0, 0, d_hat_, 1000}) >= 1;
}

/// Newton's method with one model of each body. Where vertices leave what was searched, it is
/// searched again from there. \param exact  becomes whether momenta are right \return false: some
/// met something outside the searched region; else trial_ is the end
bool StepSolver::Work::solve_round(const Round& round, double margin, bool& exact) {
  const Parameters& p = options_.parameters;
  auto system =
      std::make_unique<CondensedSystem>(island_.table, vertices_, round.start, round.force,
                                        round.energy, 1, p.ridge, inverses_, context_.cpu);
  last_step_ = std::numeric_limits<double>::infinity();
  bool converged = vertices_.empty();
  if (converged)
    system->advance(1);
  int iteration = 0, searches = 0;
  way_lags_ = round_lags_ = 0;
  settled_ = true;
  while (!converged) {
    // Better models serve more than the end of this one.
    if (system->share() == 0 && iteration >= p.round_iterations) {
      settled_ = false;
      break;
    }
    if (report_.iterations + static_cast<std::uint64_t>(iteration) >= p.max_iterations)
      throw NotSolved("contact: Newton's method did not converge in " +
                      std::to_string(p.max_iterations) + " iterations");
    bool done = false;
    const bool gained = iterate(*system, iteration, done);
    ++iteration;
    if (!gained && !done) {
      // Nothing to be gained by the simple Hessian, perhaps by the projected one.
      if (iteration <= p.gauss_newton) {
        iteration = p.gauss_newton;
        continue;
      }
      throw NotSolved("contact: no descent");
    }
    if (done) {
      converged = !lag_changes();
      if (!converged && ++round_lags_ > p.max_lags)
        throw NotSolved("contact: friction did not settle");
    } else if (!std::ranges::all_of(
                   vertices_, [&](std::uint32_t v) { return covered(v, at_[v], margin / 2); })) {
      if (++searches > p.max_way_searches)
        throw NotSolved("contact: bodies move farther than they were searched for");
      (void)move_bodies(*system, false);
      if (!follow_bodies(margin))
        return false;
      at_ = trial_;
      search(round.to, d_hat_ + margin);
      system = std::make_unique<CondensedSystem>(island_.table, vertices_, round.start, force_,
                                                 round.energy, system->share(), p.ridge, inverses_,
                                                 context_.cpu);
      last_step_ = std::numeric_limits<double>::infinity();
    }
  }
  report_.iterations += static_cast<std::uint64_t>(iteration);
  report_.vertices = std::max(report_.vertices, system->unknowns() / 3);
  models_hold_ = true;
  exact = move_bodies(*system, true);
  return follow_bodies(margin);
}

/// Takes better models where rounds converge slowly. \param change  of positions by the last round
void StepSolver::Work::sharpen(double change) {
  const Parameters& p = options_.parameters;
  changes_.push_back(change);
  if (changes_.size() < 3)
    return;
  // Rounds may alternate.
  const double rate = std::sqrt(change / changes_[changes_.size() - 3]);
  const double rounds = std::log(p.round_tolerance * d_hat_ / change) / std::log(rate);
  if (!(rate < 1) || rounds > p.slow_rounds)
    for (ContactBody* const body : island_.table.bodies)
      body->sharpen();
}

/// Undoes a round whose models did not hold.
void StepSolver::Work::go_back(const Round& round, std::span<const Vec3> begin) {
  force_ = round.force;
  for (std::size_t b = 0; b < island_.table.bodies.size(); ++b)
    island_.table.bodies[b]->move(1, force_[b]);
  at_.assign(begin.begin(), begin.end());
  find_pairs(at_);
  lag();
}

StepReport StepSolver::Work::run() {
  const Parameters& p = options_.parameters;
  const BodyTable& table = island_.table;
  const bool linear =
      std::ranges::all_of(table.bodies, [](const ContactBody* b) { return b->is_linear(); });
  for (const ContactBody* const body : table.bodies)
    force_.push_back(body->last_forces());
  led_ = std::ranges::any_of(table.bodies, [](const ContactBody* b) { return b->is_led(); });
  double margin = margin_;
  bool may_be_alone = options_.h > 0 && !linear;
  for (int number = 0; number < p.max_rounds; ++number) {
    if (context_.cancelled && context_.cancelled())
      throw Cancelled();
    ++report_.rounds;
    Round round{std::vector<Vec3>(count_), std::vector<Vec3>(count_), 0, force_};
    for (std::size_t b = 0; b < table.bodies.size(); ++b)
      round.energy += table.bodies[b]->linearise(
          force_[b], std::span(way_).subspan(table.first[b], table.first[b + 1] - table.first[b]));
    for (std::size_t v = 0; v < count_; ++v) {
      round.to[v] = at_[v] + way_[v];
      round.start[v] = -way_[v];
    }
    const std::vector<Vec3> round_begin = at_;
    if (number == 0) {
      search(round.to, d_hat_ + margin);
      if (may_be_alone && std::ranges::all_of(force_, &std::vector<VertexForce>::empty) &&
          is_free(round.to)) {
        if (move_alone(round.to))
          break;
        may_be_alone = false;
        number = -1; // with new models
        continue;
      }
      set_stiffness(round.to);
      find_pairs(at_);
      require_apart();
      lag();
    }
    bool exact = true;
    for (int attempt = 0;; ++attempt) {
      if (attempt > 0 || !covered(at_, margin / 2) || !covered(round.to, margin / 2)) {
        search(round.to, d_hat_ + margin);
        find_pairs(at_);
      }
      if (solve_round(round, margin, exact))
        break;
      if (attempt >= p.max_searches)
        throw NotSolved("contact: bodies move farther than they were searched for");
      margin *= 2;
      force_ = round.force;
      at_ = round_begin;
      round.to = trial_;
    }
    const double change = largest_distance(trial_, round_begin);
    if (models_hold_) {
      at_.swap(trial_);
      if (settled_ && (linear || (number > 0 && exact && change <= p.round_tolerance * d_hat_)))
        break;
      sharpen(change);
    } else {
      go_back(round, round_begin);
    }
    if (number + 1 == p.max_rounds)
      throw NotSolved("contact: bodies that are not linear did not come to rest in " +
                      std::to_string(number + 1) + " rounds");
  }
  find_pairs(at_);
  report_.pairs = pairs_.pairs.size();
  report_.gap = std::min(report_.gap, smallest_gap(pairs_, at_));
  report_.steps = 1;
  report_.most_iterations = report_.iterations;
  return report_;
}

std::vector<ContactForce> StepSolver::Work::forces() {
  std::map<std::pair<std::uint32_t, std::uint32_t>, ContactForce> all;
  const auto add = [&](const auto& pair, const std::array<Vec3, 4>& forces, bool normal) {
    const std::vector<std::uint32_t>& owner = island_.surface.owner;
    const std::uint32_t one = owner[pair.vertex[0]];
    std::uint32_t other = one;
    for (std::size_t k = 1; k < pair.count; ++k)
      other = owner[pair.vertex[k]] != one ? owner[pair.vertex[k]] : other;
    for (std::size_t k = 0; k < pair.count; ++k) {
      const std::uint32_t v = pair.vertex[k], from = owner[v] == one ? other : one;
      ContactForce& f = all[{v, from}];
      f.vertex = v;
      f.from = from;
      (normal ? f.normal : f.friction) += forces[k];
    }
  };
  barrier_forces(pairs_, at_, kappa_, pair_forces_);
  for (std::size_t k = 0; k < pairs_.pairs.size(); ++k)
    add(pairs_.pairs[k], pair_forces_[k], true);
  friction_forces(friction_, at_, begin_, stick_, pair_forces_);
  for (std::size_t k = 0; k < friction_.size(); ++k)
    add(friction_[k], pair_forces_[k], false);
  std::vector<ContactForce> list;
  for (const auto& entry : all)
    if (entry.second.normal != Vec3{} || entry.second.friction != Vec3{})
      list.push_back(entry.second);
  return list;
}

StepSolver::StepSolver(const Island& island) : island_(island), broad_phase_(island.surface) {}

StepReport StepSolver::solve(const StepOptions& options, const Context& context) {
  Work work(island_, broad_phase_, inverses_, options, context);
  const StepReport report = work.run();
  forces_ = work.forces();
  return report;
}

} // namespace gewebe::contact
