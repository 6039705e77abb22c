#include "contact/step.h"

#include "contact/contact_energy.h"
#include "contact/swept_candidates.h"
#include "text/rounded_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>

namespace gewebe::contact {

namespace {

constexpr double armijo = 1e-4;
constexpr int max_halvings = 40;
/// Part of a step below which nothing moves any more.
constexpr double stuck = 1e-12;
/// Decrement below which the change of an energy is lost in rounding.
constexpr double rounding = 1e-13;

std::string place_text(const Vec3& at) {
  return text::rounded_text(at.x) + " " + text::rounded_text(at.y) + " " + text::rounded_text(at.z);
}

std::vector<Vec3> read_positions(const BodyTable& table) {
  std::vector<Vec3> x(table.vertex_count());
  for (std::size_t b = 0; b < table.bodies.size(); ++b)
    table.bodies[b]->positions(
        std::span(x).subspan(table.first[b], table.first[b + 1] - table.first[b]));
  return x;
}

double longest(std::span<const Vec3> ways) {
  double most = 0;
  for (const Vec3& way : ways)
    most = std::max(most, norm(way));
  return most;
}

double largest_distance(std::span<const Vec3> a, std::span<const Vec3> b) {
  double most = 0;
  for (std::size_t v = 0; v < a.size(); ++v)
    if (const double d = norm(a[v] - b[v]); !(d <= most))
      most = d;
  return most;
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
  first_order += more.first_order;
  most_iterations = std::max(most_iterations, more.most_iterations);
  pairs = std::max(pairs, more.pairs);
  vertices = std::max(vertices, more.vertices);
  gap = std::min(gap, more.gap);
  friction_residual = std::max(friction_residual, more.friction_residual);
}

/// The minimisation of a step: rounds of linear models, each by Newton's method.
class StepSolver::Work {
public:
  Work(const Island& island, collision::BroadPhase& broad_phase, InverseCache& inverses,
       const StepOptions& options, const Context& context)
      : island_(island), inverses_(inverses), options_(options), context_(context),
        count_(island.table.vertex_count()), begin_(read_positions(island.table)), at_(begin_),
        way_(count_), trial_(count_), gradient_(count_), d_hat_(island.activation_distance),
        candidates_(island, broad_phase, options.parameters),
        energy_(island, options,
                options.start.empty() ? std::span<const Vec3>(begin_) : options.start) {}

  StepReport run();
  const std::vector<ContactForce>& forces() const { return pair_forces_; }

private:
  double typical_force(std::span<const Vec3> to);
  void search(std::span<const Vec3> from, std::span<const Vec3> to, double reach);
  void find_pairs(std::span<const Vec3> x) { energy_.find_pairs(candidates_.near(x, d_hat_), x); }
  double energy_at(std::span<const Vec3> x) {
    find_pairs(x);
    return energy_.energy(x);
  }
  double renew_gradient() {
    for (const std::uint32_t v : candidates_.vertices()) // all that pairs have
      gradient_[v] = {};
    return energy_.add_gradient(at_, gradient_);
  }
  bool solve_system(CondensedSystem& system, HessianMode mode) {
    energy_.assemble(at_, mode, system);
    return system.solve(gradient_, 0);
  }
  struct Step {
    double slope = 0;  ///< of the contact energy
    double length = 0; ///< the longest of a vertex
    double free = 0;   ///< part of it that collision detection allows
  };
  Step take_step(const CondensedSystem& system);
  void require_apart() const;
  bool follow_way(CondensedSystem& system, bool balanced);
  void take(CondensedSystem& system, const Step& step, double part);
  bool lower_energy(CondensedSystem& system, double contact);
  int simple_iterations() const {
    return options_.h > 0 ? options_.parameters.iterations.gauss_newton
                          : options_.parameters.iterations.gauss_newton_at_rest;
  }
  bool iterate(CondensedSystem& system, int iteration, bool& converged);
  bool move_bodies(const CondensedSystem& system, bool ends);
  struct Round {
    std::vector<Vec3> to, start;                 ///< ends of the ways; R0
    double energy = 0;                           ///< R0^T A R0, roughly
    std::vector<std::vector<VertexForce>> force; ///< F_0
  };
  Round begin_round();
  bool follow_bodies(double margin);
  bool solve_round(const Round& round, double margin, bool& exact);
  void sharpen(double change);
  void go_back(const Round& round, std::span<const Vec3> begin);
  bool is_free(std::span<const Vec3> to);
  bool move_alone(std::span<const Vec3> to);
  void finish_report();

  const Island& island_;
  InverseCache& inverses_;
  const StepOptions& options_;
  const Context& context_;
  std::size_t count_;
  std::vector<Vec3> begin_; ///< y_n
  std::vector<Vec3> at_;    ///< present positions
  std::vector<Vec3> way_;   ///< x_free - x of the round
  std::vector<Vec3> trial_, gradient_;
  double d_hat_;
  double last_step_ = 0; ///< length of the last full step of Newton's method; else infinite
  int way_lags_ = 0, round_lags_ = 0; ///< renewals of friction on the way, and behind solutions
  bool led_ = false;                  ///< some vertices go ways that nothing stops
  std::vector<double> changes_;       ///< of positions, by rounds
  bool settled_ = true;               ///< the last round ended with balanced forces
  bool models_hold_ = true;           ///< of all bodies, in the last round
  SweptCandidates candidates_;
  ContactEnergy energy_;
  std::vector<std::vector<VertexForce>> force_; ///< by body
  std::vector<ContactForce> pair_forces_;       ///< that bodies have moved by
  StepReport report_;
};

/// A force that is typical for the step: that of the bodies, a part of the largest of the last
/// step, or, where the bodies collide on their ways to `to`, a part of the force that stops a
/// vertex within the step. It scales the barrier, which becomes stiffer where forces turn out
/// larger; one that is too stiff is a wall that Newton's steps bounce off.
double StepSolver::Work::typical_force(std::span<const Vec3> to) {
  const Parameters& p = options_.parameters;
  double force = std::numeric_limits<double>::infinity();
  for (const ContactBody* const body : island_.table.bodies)
    if (const double typical = body->typical_force(); typical > 0)
      force = std::min(force, typical);
  if (!std::isfinite(force))
    force = 1;
  for (const std::vector<VertexForce>& of : force_)
    for (const VertexForce& f : of)
      force = std::max(force, p.stiffness.last_share * norm(f.force));
  double stiffness = std::numeric_limits<double>::infinity();
  for (const ContactBody* const body : island_.table.bodies)
    if (const double own = body->vertex_stiffness(); own > 0)
      stiffness = std::min(stiffness, own);
  if (!std::isfinite(stiffness))
    stiffness = 0;
  force = std::max(force, d_hat_ * stiffness);
  const double stop = p.stiffness.stop_share * stiffness * longest(way_);
  return stop > force && !candidates_.keep_gaps(at_, to) ? stop : force;
}

/// Searches for candidates, with the vertices that have forces.
void StepSolver::Work::search(std::span<const Vec3> from, std::span<const Vec3> to, double reach) {
  std::vector<std::uint32_t> also = energy_.friction_vertices();
  for (std::size_t b = 0; b < force_.size(); ++b)
    for (const VertexForce& f : force_[b])
      also.push_back(island_.table.first[b] + f.vertex);
  candidates_.search(from, to, reach, also);
}

/// Surfaces must stand apart where a step begins.
void StepSolver::Work::require_apart() const {
  if (energy_.pairs().pairs.empty())
    return;
  if (const SmallestGap least = find_smallest_gap(energy_.pairs(), at_); !(least.gap > 0))
    throw IntersectsAtStart("contact: surfaces intersect near " + place_text(least.position));
}

/// The chosen step of the system; trial_ becomes its end, for the vertices of the system alone: no
/// candidate has another.
StepSolver::Work::Step StepSolver::Work::take_step(const CondensedSystem& system) {
  Step result;
  const std::span<const std::uint32_t> vertices = system.vertices();
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const Vec3& step = system.step(k);
    result.slope += dot(gradient_[vertices[k]], step);
    const double size = norm(step);
    result.length = size <= result.length ? result.length : size;
    trial_[vertices[k]] = at_[vertices[k]] + step;
  }
  if (!std::isfinite(result.length))
    throw NotSolved("contact: Newton's step is not finite");
  result.free = candidates_.free_part(at_, trial_);
  if (!(result.free > stuck))
    throw NotSolved("contact: a prescribed motion meets fixed nodes near " +
                    place_text(find_smallest_gap(energy_.pairs(), at_).position));
  return result;
}

/// Takes a part of the way that is left, with the forces of the linear forecast behind it. \return
/// whether it did; else forces must balance first
bool StepSolver::Work::follow_way(CondensedSystem& system, bool balanced) {
  const Parameters& p = options_.parameters;
  double reach = 1;
  Step step = take_step(system);
  if (const double most = p.lengths.longest_step * island_.edge;
      !energy_.pairs().pairs.empty() && step.length > most) {
    reach = std::max(most / step.length, p.iterations.least_reach);
    system.choose_reach(reach);
    step = take_step(system);
  }
  for (int k = 0; k < p.iterations.reaches && !energy_.pairs().pairs.empty() &&
                  step.free < p.iterations.full_reach;
       ++k) {
    if (!balanced)
      return false;
    reach = std::max(reach * step.free, p.iterations.least_reach);
    system.choose_reach(reach);
    step = take_step(system);
  }
  take(system, step, step.free);
  return true;
}

/// Takes a part of the step that ends at trial_.
void StepSolver::Work::take(CondensedSystem& system, const Step& step, double part) {
  energy_.advance_duals(at_, trial_, part);
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
  for (int k = 0; k < p.iterations.dampings && step.free < p.iterations.full_reach; ++k) {
    const double size = step.length * step.length;
    const double softest = size > 0 ? -(system.slope() + step.slope) / size : 0;
    damping = damping > 0 ? p.iterations.damping_factor * damping
                          : softest / std::max(step.free, p.iterations.least_reach);
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
  const std::span<const std::uint32_t> vertices = system.vertices();
  std::vector<Vec3> target;
  for (const std::uint32_t v : vertices)
    target.push_back(trial_[v]);
  const auto try_part = [&](double part) {
    for (std::size_t n = 0; n < vertices.size(); ++n) {
      const Vec3& at = at_[vertices[n]];
      trial_[vertices[n]] = part < 1 ? at + part * (target[n] - at) : target[n];
    }
  };
  double part = step.free;
  for (int k = 0; k < max_halvings; ++k) {
    try_part(part);
    if (system.energy(part) + energy_at(trial_) <=
        here + armijo * part * std::min(slope, 0.0) + unsure) {
      try_part(1);
      take(system, step, part);
      return true;
    }
    part /= 2;
  }
  if (!(step.length <= energy_.step_limit()) || step.free < 1)
    return false;
  // The energy's change is lost in rounding, that of forces is not.
  try_part(1);
  take(system, step, 1);
  return true;
}

/// One iteration of Newton's method. \return whether anything was gained
bool StepSolver::Work::iterate(CondensedSystem& system, int iteration, bool& converged) {
  const Parameters& p = options_.parameters;
  find_pairs(at_);
  double contact = renew_gradient();
  CondensedSystem::Residual residual = system.residual(gradient_);
  const double typical = energy_.typical_force();
  const auto balances_exactly = [&](double tolerance) {
    return residual.difference <=
           tolerance * std::max(residual.largest, p.tolerances.small_force * typical);
  };
  converged = last_step_ <= energy_.step_limit() && balances_exactly(p.tolerances.force);
  if (converged)
    return true;
  const auto balances = [&](double tolerance) {
    return residual.difference <= tolerance * std::max(residual.largest, typical);
  };
  // Normal forces that do not balance are none to hold anything by friction, and the typical force
  // of an impact may be much larger than they are.
  const bool lags = energy_.has_friction() && iteration > 0 && way_lags_ < p.iterations.way_lags &&
                    balances_exactly(p.tolerances.lag);
  const bool stiffer = balances(p.tolerances.way) && energy_.raise_stiffness(residual.largest);
  if (lags)
    energy_.lag(at_, way_lags_++ >= p.iterations.whole_lags);
  if (lags || stiffer) {
    contact = renew_gradient();
    residual = system.residual(gradient_);
  }
  const bool balanced = balances(p.tolerances.way), near = balanced && last_step_ <= d_hat_;
  last_step_ = std::numeric_limits<double>::infinity();
  // The exact Hessian converges fastest from near by; from afar it may be all but singular.
  const HessianMode from_afar =
      iteration < simple_iterations() ? HessianMode::gauss_newton : HessianMode::projected;
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
  const Parameters& p = options_.parameters;
  const double room = std::min(p.lengths.momentum_room * d_hat_,
                               p.lengths.momentum_gap * smallest_gap(energy_.pairs(), at_));
  bool exact = true;
  for (std::size_t b = 0; b < island_.table.bodies.size(); ++b) {
    ContactBody& body = *island_.table.bodies[b];
    force_[b] = system.forces(b);
    body.move(system.share(), force_[b]);
    if (ends)
      exact = body.keep_momentum(room) && exact;
  }
  return exact;
}

/// Whether the way from here to `to` is free, and nothing touches there.
bool StepSolver::Work::is_free(std::span<const Vec3> to) {
  if (candidates_.vertices().empty())
    return true;
  if (!candidates_.are_free(at_, to))
    return false;
  find_pairs(to);
  return energy_.pairs().pairs.empty();
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
    search(at_, trial_, d_hat_);
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
  trial_ = read_positions(island_.table);
  if (candidates_.cover(trial_, margin / 2))
    return candidates_.are_free(at_, trial_);
  // From where all stood when it was searched: what was watched has gone on since, the rest has
  // not.
  const std::vector<Vec3> from(candidates_.from().begin(), candidates_.from().end());
  search(from, trial_, d_hat_ + margin);
  return candidates_.are_free(from, trial_);
}

/// Newton's method with one model of each body. Where vertices leave what was searched, it is
/// searched again from there. \param exact  becomes whether momenta are right \return false: some
/// met something outside the searched region; else trial_ is the end
bool StepSolver::Work::solve_round(const Round& round, double margin, bool& exact) {
  const Parameters& p = options_.parameters;
  const std::uint64_t most = options_.h > 0 ? p.iterations.of_step : p.iterations.of_step_at_rest;
  const auto make_system = [&](std::span<const std::vector<VertexForce>> force, double share) {
    const std::span<const std::uint32_t> vertices = candidates_.vertices();
    return std::make_unique<CondensedSystem>(
        island_.table, std::vector(vertices.begin(), vertices.end()), round.start, force,
        round.energy, share, p.stiffness.ridge, inverses_, context_.cpu);
  };
  auto system = make_system(round.force, 1);
  last_step_ = std::numeric_limits<double>::infinity();
  bool converged = candidates_.vertices().empty();
  if (converged)
    system->advance(1);
  int iteration = 0, searches = 0;
  way_lags_ = round_lags_ = 0;
  settled_ = true;
  while (!converged) {
    // Better models serve more than the end of this one.
    if (system->share() == 0 && iteration >= p.iterations.of_round) {
      settled_ = false;
      break;
    }
    if (report_.iterations >= most)
      throw NotSolved("contact: Newton's method did not converge in " + std::to_string(most) +
                      " iterations");
    bool done = false;
    const bool gained = iterate(*system, iteration, done);
    ++iteration;
    ++report_.iterations;
    if (!gained && !done) {
      // Nothing to be gained by the simple Hessian, perhaps by the projected one.
      if (iteration <= simple_iterations()) {
        iteration = simple_iterations();
        continue;
      }
      throw NotSolved("contact: no descent");
    }
    if (done) {
      find_pairs(at_);
      converged =
          !energy_.renew_lag(at_, candidates_.vertices(), round_lags_ >= p.iterations.whole_lags);
      if (!converged && ++round_lags_ > p.iterations.lags)
        throw NotSolved("contact: friction did not settle");
    } else if (!candidates_.cover_own(at_, margin / 2)) {
      if (++searches > p.iterations.way_searches)
        throw NotSolved("contact: bodies move farther than they were searched for");
      (void)move_bodies(*system, false);
      if (!follow_bodies(margin))
        return false;
      at_ = trial_;
      search(at_, round.to, d_hat_ + margin);
      system = make_system(force_, system->share());
      last_step_ = std::numeric_limits<double>::infinity();
    }
  }
  report_.vertices = std::max(report_.vertices, system->unknowns() / 3);
  exact = move_bodies(*system, true);
  if (!follow_bodies(margin))
    return false; // with these models again
  models_hold_ = true;
  for (ContactBody* const body : island_.table.bodies)
    models_hold_ = body->model_holds() && models_hold_;
  return true;
}

/// Takes better models where rounds converge slowly. \param change  of positions by the last round
void StepSolver::Work::sharpen(double change) {
  const Parameters& p = options_.parameters;
  changes_.push_back(change);
  if (changes_.size() < 3)
    return;
  // Rounds may alternate.
  const double rate = std::sqrt(change / changes_[changes_.size() - 3]);
  const double rounds = std::log(p.tolerances.round * d_hat_ / change) / std::log(rate);
  if (rate < 1 && rounds <= p.iterations.slow_rounds)
    return;
  for (ContactBody* const body : island_.table.bodies)
    body->sharpen();
  changes_.clear();
}

/// Undoes a round whose models did not hold.
void StepSolver::Work::go_back(const Round& round, std::span<const Vec3> begin) {
  force_ = round.force;
  for (std::size_t b = 0; b < island_.table.bodies.size(); ++b)
    island_.table.bodies[b]->move(1, force_[b]);
  at_.assign(begin.begin(), begin.end());
  find_pairs(at_);
  energy_.lag(at_, false);
}

/// Linearises all bodies.
StepSolver::Work::Round StepSolver::Work::begin_round() {
  const BodyTable& table = island_.table;
  Round round{std::vector<Vec3>(count_), std::vector<Vec3>(count_), 0, force_};
  for (std::size_t b = 0; b < table.bodies.size(); ++b)
    round.energy += table.bodies[b]->linearise(
        force_[b], std::span(way_).subspan(table.first[b], table.first[b + 1] - table.first[b]));
  for (std::size_t v = 0; v < count_; ++v) {
    round.to[v] = at_[v] + way_[v];
    round.start[v] = -way_[v];
  }
  return round;
}

void StepSolver::Work::finish_report() {
  find_pairs(at_);
  report_.pairs = energy_.pairs().pairs.size();
  report_.gap = std::min(report_.gap, smallest_gap(energy_.pairs(), at_));
  report_.lags = energy_.lags();
  report_.friction_residual = energy_.friction_residual();
  report_.searches = candidates_.searches();
  report_.steps = 1;
  report_.most_iterations = report_.iterations;
}

StepReport StepSolver::Work::run() {
  const Parameters& p = options_.parameters;
  const BodyTable& table = island_.table;
  const bool linear =
      std::ranges::all_of(table.bodies, [](const ContactBody* b) { return b->is_linear(); });
  for (const ContactBody* const body : table.bodies)
    force_.push_back(body->last_forces());
  led_ = std::ranges::any_of(table.bodies, [](const ContactBody* b) { return b->is_led(); });
  double margin = p.lengths.margin * island_.edge;
  bool may_be_alone = options_.h > 0 && !linear;
  for (int number = 0; number < p.iterations.rounds; ++number) {
    if (context_.cancelled && context_.cancelled())
      throw Cancelled();
    ++report_.rounds;
    Round round = begin_round();
    const std::vector<Vec3> round_begin = at_;
    if (number == 0) {
      search(at_, round.to, d_hat_ + margin);
      if (may_be_alone && std::ranges::all_of(force_, &std::vector<VertexForce>::empty) &&
          is_free(round.to)) {
        if (move_alone(round.to))
          break;
        may_be_alone = false;
        number = -1; // with new models
        continue;
      }
      energy_.set_stiffness(typical_force(round.to));
      find_pairs(at_);
      require_apart();
      energy_.lag(at_, false);
    }
    bool exact = true;
    for (int attempt = 0;; ++attempt) {
      if (attempt > 0 || !candidates_.cover(at_, margin / 2) ||
          !candidates_.cover(round.to, margin / 2)) {
        search(at_, round.to, d_hat_ + margin);
        find_pairs(at_);
      }
      if (solve_round(round, margin, exact))
        break;
      if (attempt >= p.iterations.searches)
        throw NotSolved("contact: bodies move farther than they were searched for");
      margin *= 2;
      force_ = round.force;
      at_ = round_begin;
      round.to = trial_;
    }
    const double change = largest_distance(trial_, round_begin);
    if (models_hold_) {
      // Not where momentum has been made exact: there they would be other ones.
      find_pairs(at_);
      pair_forces_ = energy_.forces(at_);
      at_.swap(trial_);
      if (settled_ && (linear || (number > 0 && exact && change <= p.tolerances.round * d_hat_)))
        break;
      sharpen(change);
    } else {
      go_back(round, round_begin);
    }
    if (number + 1 == p.iterations.rounds)
      throw NotSolved("contact: bodies that are not linear did not come to rest in " +
                      std::to_string(number + 1) + " rounds");
  }
  finish_report();
  return report_;
}

StepSolver::StepSolver(const Island& island) : island_(island), broad_phase_(island.surface) {}

StepReport StepSolver::solve(const StepOptions& options, const Context& context) {
  Work work(island_, broad_phase_, inverses_, options, context);
  const StepReport report = work.run();
  forces_ = work.forces();
  return report;
}

} // namespace gewebe::contact
