#pragma once
// A step of bodies in contact by incremental potential contact (Li et al., ACM TOG 39(4), 2020).
//
// The positions y of all vertices at the end of the step minimise
//
//   E(y) = sum over bodies of 1/2 r^T A r  +  sum over pairs of kappa w b(d^2 - d_min^2)
//                                          +  sum over pairs of mu lambda f0(|T^T (y - y_n)|)
//
// with r = y - y_free. y_n are the positions at the beginning (or StepOptions::start), b is the
// barrier of contact/barrier.h, f0 the smoothed friction of contact/friction.h, whose normal forces
// lambda and tangent planes T are lagged. Newton's method with a line search; no step passes what
// continuous collision detection allows. Forces are the pairs' own: they sum to zero and never
// pull.
//
// Bodies that are not linear are linearised again in each round, until a round changes nothing.

#include "base/context.h"
#include "base/error.h"
#include "collision/candidates.h"
#include "collision/surface.h"
#include "contact/condensed_system.h"
#include "contact/parameters.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::contact {

/// Bodies that may touch each other, with their surfaces one behind the other.
struct Island {
  BodyTable table;
  collision::CollisionSurface surface;    ///< owner of a vertex: its body
  collision::AllowedPairs allowed;        ///< by bodies
  collision::OwnerTable<double> friction; ///< Coulomb's coefficient, by bodies
  double edge = 0;                        ///< median of the edges that may touch, mm
  double activation_distance = 0;         ///< d_hat, mm
};

struct StepOptions {
  double h = 0; ///< length of the step, s; 0: at rest
  Parameters parameters{};
  /// Positions of all vertices that their speeds count from, where those are others than the ones
  /// at the beginning: of a second stage, which may intersect.
  std::span<const Vec3> start{};
};

/// Force of one body on a vertex of another.
struct ContactForce {
  std::uint32_t vertex = 0; ///< of the island's surface
  std::uint32_t from = 0;   ///< body; the vertex's own where it touches itself
  Vec3 normal, friction;    ///< 1e-6 N
};

struct StepReport {
  std::uint64_t iterations = 0, rounds = 0, lags = 0;
  std::uint64_t searches = 0; ///< broad phases
  std::uint64_t cuts = 0;     ///< iterations that collision detection shortened
  std::uint64_t steps = 0, halvings = 0;
  std::uint64_t first_order = 0;     ///< steps of second order that had to be of first
  std::uint64_t most_iterations = 0; ///< of one step
  std::size_t pairs = 0;             ///< active at the end
  std::size_t vertices = 0;          ///< unknowns of the last system over 3
  double gap = 1e300;                ///< smallest, mm; 1e300 without pairs
  double friction_residual = 0; ///< last change of a friction force over the largest pair force

  void add(const StepReport& more);
};

/// A step whose contact was not solved: take a shorter one.
class NotSolved : public Error {
public:
  using Error::Error;
};

/// Surfaces intersect, or touch, where a step begins: no shorter step helps.
class IntersectsAtStart : public NotSolved {
public:
  using NotSolved::NotSolved;
};

class StepSolver {
public:
  /// \pre the island outlives this
  explicit StepSolver(const Island& island);

  /// Moves all bodies to the end of the step. \pre bodies stand apart at its beginning
  /// \throw NotSolved; as the bodies; Cancelled
  StepReport solve(const StepOptions& options, const Context& context);
  /// Of the last step, by ascending vertex and body.
  const std::vector<ContactForce>& forces() const noexcept { return forces_; }

private:
  class Work;
  const Island& island_;
  collision::BroadPhase broad_phase_;
  InverseCache inverses_;
  std::vector<ContactForce> forces_;
};

} // namespace gewebe::contact
