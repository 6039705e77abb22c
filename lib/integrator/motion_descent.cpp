#include "integrator/motion_descent_internal.h"

#include "base/error.h"
#include "integrator/secants_internal.h"
#include "linalg/factor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

namespace gewebe::integrator {

namespace {

/// The two ways differ in their matrices, and in when a round is the last one.
struct Way {
  double tolerance;
  int most; ///< rounds
  /// Whether rounds that change by so much want a matrix of here.
  std::function<bool(double change, double before)> stale;
  /// The matrix is that of the last evaluation. \return whether there is none better
  std::function<bool(const Numbers& at)> renew;
  std::function<void(Numbers&)> solve;
  std::function<void(Numbers&)> into, out; ///< of the frames that solve() and secants are in
  Secants& secants;
  double& rate;       ///< of changes, that of a second round over the first one's
  double still = 0;   ///< a step of less, mm, counts as one of this much
  bool turns = false; ///< the matrix may be renewed wherever a round ends
  /// Changes count against the displacement from rest, and what is left is the sum of all that
  /// follow at the rate that was seen.
  bool to_rest = false;
};

// What a round's change is expected to leave is its part of this many, or of as many as rounds
// before left: never less than `least`, which a lucky round is no reason for.
constexpr double least_first = 0.2, least_later = 0.3, doubt = 1.25;
/// The same at rest.
constexpr double least_at_rest = 0.05;

/// Part of the whole displacement of a body with held nodes. A step that moves less than this is
/// nearly at rest, and no rounds are spent on its digits. The next steps correct the rest.
constexpr double still_part = 1e-5;
/// Smallest displacement that errors at rest count against, over that of the start.
constexpr double rest_part = 1e-6;

double distance(const Numbers& a, const Numbers& b, const Context& context) {
  const auto sum = sums_of_axes<1>(
      context, a.size(), [&](std::size_t begin, std::size_t end, std::array<double, 1>& sums) {
        for (std::size_t axis = begin; axis < end; ++axis)
          sums[0] += (a[axis] - b[axis]) * (a[axis] - b[axis]);
      });
  return std::sqrt(sum[0]);
}

/// The first of the points along the direction, from the whole of it on by halves, whose value is
/// low enough, into `next`; its part, or 0 if there is none.
double search(const MotionObjective& o, const MotionPoint& now, const Numbers& direction,
              double slope, bool turns, MotionPoint& next, const Context& context) {
  double s = 1;
  next.at.resize(now.at.size());
  while (s > 1e-14 && slope > 0) {
    parallel_blocks(context, now.at.size(), axes_grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t axis = begin; axis < end; ++axis)
        next.at[axis] = now.at[axis] - s * direction[axis];
    });
    o.evaluate(next, context, turns);
    if (next.value <= now.value - 1e-4 * s * slope + now.unsure)
      return s;
    s /= 2;
  }
  return 0;
}

/// What a round learned, into the secants.
void learn(const MotionPoint& from, const MotionPoint& to, const Way& way, MotionScratch& scratch,
           const Context& context) {
  Numbers &moved = scratch.moved, &turned = scratch.turned;
  moved.resize(to.at.size());
  turned.resize(to.at.size());
  parallel_blocks(context, moved.size(), axes_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t axis = begin; axis < end; ++axis) {
      moved[axis] = to.at[axis] - from.at[axis];
      turned[axis] = to.gradient[axis] - from.gradient[axis];
    }
  });
  way.into(moved);
  way.into(turned);
  way.secants.add(moved, turned, context);
}

/// Estimates the error after a round, from the error before it and from earlier steps.
void expect(const Way& way, SolidStep& step, double before) {
  const double measured = before < HUGE_VAL ? step.change / before : HUGE_VAL;
  if (way.to_rest) {
    // Of two rounds, since they alternate between quick and slow ones.
    const double rate = std::max(least_at_rest, std::sqrt(way.rate * std::min(measured, 1.0)));
    way.rate = std::min(measured, 1.0);
    step.left = rate < 1 ? step.change * rate / (1 - rate) : HUGE_VAL;
    return;
  }
  if (step.rounds == 1) {
    step.left = step.change * std::clamp(way.rate, least_first, 1.0);
    way.rate = std::min(1.0, std::max(way.rate, least_first) * doubt);
    return;
  }
  if (step.rounds == 2)
    way.rate = measured;
  step.left = step.change * std::clamp(measured, least_later, 1.0);
}

void descend(const MotionObjective& o, MotionPoint& now, const Way& way, MotionScratch& scratch,
             SolidStep& step, const Context& context) {
  // Rounding of places, which no round gets below.
  const double rounding = 1e-15 * std::sqrt(product(o.body().rest, o.body().rest));
  MotionPoint& next = scratch.next;
  Numbers& direction = scratch.direction;
  double before = HUGE_VAL;
  bool stuck = true, fresh = false; // the matrix is of here
  while (step.rounds < way.most) {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
    if (stuck || way.stale(step.change, before)) {
      fresh = way.renew(now.at);
      stuck = false;
    }
    before = step.change;
    direction = now.gradient;
    way.into(direction);
    way.secants.direction(direction, way.solve, context);
    way.out(direction);
    ++step.rounds;
    const double slope = product(now.gradient, direction),
                 length = std::sqrt(product(direction, direction));
    if (!(length > rounding)) {
      step.change = step.left = 0;
      return;
    }
    const double s = search(o, now, direction, slope, way.turns, next, context);
    if (!(s > 0)) {                   // nothing to be gained, but perhaps with a matrix of here
      o.evaluate(now, context, true); // frames, strains and bubbles are those of the last one
      if (fresh)
        return;
      stuck = true;
      step.change = HUGE_VAL;
      continue;
    }
    fresh = false;
    const Numbers& from = way.to_rest ? o.body().rest : o.state().place;
    step.change = s * length / std::max(way.still, distance(next.at, from, context));
    if (s < 1)
      way.secants.forget_earlier();
    learn(now, next, way, scratch, context);
    std::swap(now, next);
    expect(way, step, before);
    if (s == 1 && step.left <= way.tolerance)
      return;
  }
}

} // namespace

void descend_quickly(const MotionObjective& objective, MotionPoint& now, MotionQuick& quick,
                     const SolidMotionOptions& options, SolidStep& step, const Context& context) {
  bool first = true;
  const auto turn = [&](const Numbers&) {
    quick.turn(objective.energy(), context);
    quick.fill(objective.energy().volumes(), context);
    if (!std::exchange(first, false))
      quick.forget();
    return true;
  };
  double rate = quick.rate();
  quick.secants().begin_step();
  const Way way{options.tolerance,
                options.max_rounds,
                [](double, double) { return false; },
                turn,
                [&](Numbers& v) { quick.solve(v, context); },
                [&](Numbers& v) { quick.into_frames(v, context); },
                [&](Numbers& v) { quick.out_of_frames(v, context); },
                quick.secants(),
                rate,
                objective.state().any_held()
                    ? still_part * distance(now.at, objective.body().rest, context)
                    : 0};
  descend(objective, now, way, quick.scratch(), step, context);
  quick.set_rate(rate);
}

void descend_as_reference(const MotionObjective& objective, MotionPoint& now,
                          MotionTangent& tangent, SolidStep& step, const Context& context) {
  Secants secants;
  double rate = 1;
  const auto stay = [](Numbers&) {};
  const Way way{3e-11,
                200,
                [](double change, double before) { return change > 0.25 * before; },
                [&](const Numbers& at) {
                  tangent.make(objective, at, context);
                  secants.clear();
                  ++step.factorisations;
                  return true;
                },
                [&](Numbers& v) { tangent.solve(v); },
                stay,
                stay,
                secants,
                rate};
  MotionScratch scratch;
  descend(objective, now, way, scratch, step, context);
}

namespace {

/// Changes from which on frames are those of where the body is.
constexpr double turning_part = 1e-2;
/// Rounds with one matrix before its rate is known.
constexpr int rounds_of_rate = 3;

} // namespace

void descend_to_rest(const MotionObjective& objective, MotionPoint& now, MotionQuick& quick,
                     MotionTangent& tangent, bool& exact, const SolidMotionOptions& options,
                     SolidStep& step, const Context& context) {
  Secants& secants = quick.secants();
  if (!exact)
    secants.begin_step();
  const double worth = quick.rounds_of_tangent(objective.body());
  bool first = true, wants_tangent = false;
  int rounds = 0; // with this matrix
  const auto stale = [&](double change, double before) {
    ++rounds;
    if (rounds > rounds_of_rate && change > options.tolerance) {
      const double rate = change / before,
                   to_come =
                       rate < 1 ? std::log(options.tolerance / change) / std::log(rate) : HUGE_VAL;
      wants_tangent = to_come > worth;
    }
    return wants_tangent || (!exact && change > turning_part);
  };
  const auto renew = [&](const Numbers& at) {
    const bool begins = std::exchange(first, false), stuck = !begins && step.change == HUGE_VAL;
    if (stuck || std::exchange(wants_tangent, false)) {
      secants.clear();
      rounds = 0;
      ++step.factorisations;
      try {
        tangent.make(objective, at, context);
        exact = true;
        return true;
      } catch (const linalg::NotPositiveDefinite&) {
        exact = false; // what is torn far apart has no tangent in numbers of this length
      }
    }
    if (!exact) {
      quick.turn(objective.energy(), context);
      quick.fill(objective.energy().volumes(), context);
    }
    return false;
  };
  const auto in_frames = [&](auto&& change) {
    return [&, change](gewebe::integrator::Numbers& v) {
      if (!exact)
        change(v);
    };
  };
  double rate = 1;
  const Way way{.tolerance = options.tolerance,
                .most = options.max_rounds,
                .stale = stale,
                .renew = renew,
                .solve =
                    [&](Numbers& v) {
                      if (exact)
                        tangent.solve(v);
                      else
                        quick.solve(v, context);
                    },
                .into = in_frames([&](Numbers& v) { quick.into_frames(v, context); }),
                .out = in_frames([&](Numbers& v) { quick.out_of_frames(v, context); }),
                .secants = secants,
                .rate = rate,
                .still =
                    rest_part * distance(objective.state().place, objective.body().rest, context),
                .turns = true,
                .to_rest = true};
  descend(objective, now, way, quick.scratch(), step, context);
  if (exact)
    secants.clear(); // they stand in the fixed frame
}

} // namespace gewebe::integrator
