#pragma once
// Parameters of the contact solver: the one place where their defaults stand, each with its reason.

#include <cstdint>

namespace gewebe::contact {

/// Lengths and speeds. Those without a unit are over the median edge of the collision surfaces.
struct ContactLengths {
  /// Activation distance d_hat of the barrier. Surfaces at rest on each other stand apart by less.
  /// Hertz: the force is off by 0.3 % with 1e-3 where the offset of d_min is used.
  double activation_distance = 1e-3;
  /// ... but at most this part of an instrument's radius.
  double activation_over_radius = 1e-3;
  /// Margin of the broad phase, so that one set of candidates serves for a step.
  double margin = 0.2;
  /// At rest: displacement below which friction is not yet fully developed.
  double stick_length = 1e-3;
  /// Slip speed below which friction is not yet fully developed, mm/s. A body that sticks creeps
  /// with at most this speed.
  double stick_speed = 0.1;
  /// The same, over the approach of both surfaces: 6 degrees of tilt between facets.
  double stick_per_approach = 0.1;
  /// Longest step of Newton's method over an edge, by which less of the way is taken.
  double longest_step = 0.25;
  /// Part of the smaller of gap and d_hat that a step may not use up: it would land deep in the
  /// barrier.
  double kept_gap = 0.5;
  /// Parts of d_hat and of the smallest gap by which free bodies may be moved at the end, so that
  /// their momenta are exact; where the gap is a third of d_hat, forces change by 0.5 %.
  double momentum_room = 1e-3, momentum_gap = 0.1;
};

/// Stiffness of the barrier.
struct ContactStiffness {
  /// Typical force of an impact, over the force that would stop a vertex within the step.
  double stop_share = 0.125;
  /// ... over the largest force of the last step: gaps stay a good part of d_hat.
  double last_share = 0.25;
  /// The barrier becomes stiffer within a step where that share of a force is larger than the
  /// typical force, by at most this factor at a time: deep in the barrier surfaces that slide on
  /// each other move only by about the root of gap times radius.
  double factor = 16;
  /// Compliance that is added to the diagonal where rounding has made W indefinite, over its
  /// largest entry.
  double ridge = 1e-7;
};

/// Numbers of iterations, and when a step is taken in parts.
struct ContactIterations {
  /// Newton iterations of one round whose bodies are at the ends of their paths; then bodies are
  /// linearised again. Iterations of a whole step, then it fails: in time, where halved steps are
  /// quicker, and at rest.
  int of_round = 100;
  std::uint64_t of_step = 300, of_step_at_rest = 1000;
  int rounds = 40; ///< linearisations of bodies that are not linear
  /// Where more rounds than this are still to be expected, bodies are linearised by better models.
  double slow_rounds = 8;
  int gauss_newton = 12; ///< iterations before the projected Hessian takes over, in time
  /// The same at rest: where an instrument slides along a soft surface the curvature of gaps counts
  /// from the first iteration on, 6 in place of 13 iterations in the median.
  int gauss_newton_at_rest = 0;
  /// If collision detection allows less than this part of a step, the step is repeated with a
  /// smaller part of the path: at most so many times, and not below the least part.
  double full_reach = 0.5, least_reach = 1e-4;
  int reaches = 3;
  /// Steps are damped where collision detection allows less than full_reach of them: at most so
  /// many times, each time by this factor more.
  int dampings = 6;
  double damping_factor = 6;
  /// Renewals of friction's lag in one round where forces all but balance, then those between
  /// solutions.
  int way_lags = 100, lags = 30;
  int whole_lags = 4;    ///< behind so many of each, normal forces take half of their changes
  int searches = 5;      ///< broad phases of one step, each with twice the margin
  int way_searches = 40; ///< ... where vertices leave what was searched
};

struct ContactTolerances {
  /// Largest last step of Newton's method, over the smaller of d_hat and the stick length.
  double step = 1e-2;
  /// Largest difference of a force on a vertex from those of its pairs, over the largest force.
  /// Deep in the barrier steps are short long before forces balance.
  double force = 1e-5;
  /// Forces below this part of the typical one count as that part of it: they may vanish.
  double small_force = 1e-2;
  /// Largest change of a friction force by its last lag, over the largest pair force.
  double friction = 1e-3;
  /// The same, where bodies still are on their ways: what suffices for the next part of them.
  double way = 0.2;
  /// The same. Below it, friction takes its limits from the present normal forces; forces that do
  /// not balance would mislead it.
  double lag = 5e-3;
  /// Largest last change of a round, over d_hat. Half a thousandth of an edge in its place, where
  /// an instrument makes d_hat small, costs a quarter less, but forces are off by 0.2 %.
  double round = 0.5;
};

struct Parameters {
  ContactLengths lengths;
  ContactStiffness stiffness;
  ContactIterations iterations;
  ContactTolerances tolerances;
};

} // namespace gewebe::contact
