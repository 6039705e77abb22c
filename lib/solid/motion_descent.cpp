#include "solid/motion_descent_internal.h"

#include "base/error.h"
#include "solid/secants_internal.h"

#include <cmath>
#include <functional>
#include <utility>

namespace gewebe {

namespace {

/// The two ways differ in their matrices, and in when a round is the last one.
struct Way {
  double tolerance;
  int most; ///< rounds
  /// Whether rounds that change by so much want a matrix of here.
  std::function<bool(double change, double before)> stale;
  std::function<void(const Numbers& at)> renew; ///< the matrix is that of the last evaluation
  std::function<void(Numbers&)> solve;
};

double distance(const Numbers& a, const Numbers& b) {
  double sum = 0;
  for (std::size_t axis = 0; axis < a.size(); ++axis)
    sum += (a[axis] - b[axis]) * (a[axis] - b[axis]);
  return std::sqrt(sum);
}

/// The first of the points along the direction, from the whole of it on by halves, whose value is
/// low enough, into `next`; its part, or 0 if there is none.
double search(const MotionObjective& o, const MotionPoint& now, const Numbers& direction,
              double slope, MotionPoint& next, const Context& context) {
  double s = 1;
  while (s > 1e-14 && slope > 0) {
    next.at = now.at;
    add(next.at, -s, direction);
    o.evaluate(next, context);
    if (next.value <= now.value - 1e-4 * s * slope + now.unsure)
      return s;
    s /= 2;
  }
  return 0;
}

void descend(const MotionObjective& o, MotionPoint& now, const Way& way, SolidStep& step,
             const Context& context) {
  // Rounding of places, which no round gets below.
  const double rounding = 1e-15 * std::sqrt(product(o.body().rest, o.body().rest));
  Secants secants;
  MotionPoint next;
  double before = HUGE_VAL;
  bool stuck = true, fresh = false; // the matrix is of here
  while (step.rounds < way.most) {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
    if (stuck || way.stale(step.change, before)) {
      way.renew(now.at);
      secants.clear();
      fresh = true;
      stuck = false;
    }
    before = step.change;
    Numbers direction = now.gradient;
    secants.direction(direction, way.solve);
    ++step.rounds;
    const double slope = product(now.gradient, direction),
                 length = std::sqrt(product(direction, direction));
    if (!(length > rounding)) {
      step.change = 0;
      return;
    }
    const double s = search(o, now, direction, slope, next, context);
    if (!(s > 0)) {             // nothing to be gained, but perhaps with a matrix of here
      o.evaluate(now, context); // frames, strains and bubbles are those of the last one
      if (fresh)
        return;
      stuck = true;
      step.change = HUGE_VAL;
      continue;
    }
    fresh = false;
    step.change = s * length / distance(next.at, o.state().place);
    Numbers taken = next.at, turned = next.gradient;
    add(taken, -1, now.at);
    add(turned, -1, now.gradient);
    secants.add(std::move(taken), std::move(turned));
    std::swap(now, next);
    if (s == 1 && step.change <= way.tolerance)
      return;
  }
}

} // namespace

void descend_quickly(const MotionObjective& objective, MotionPoint& now, MotionQuick& quick,
                     const SolidMotionOptions& options, SolidStep& step, const Context& context) {
  const Way way{options.tolerance, options.max_rounds, [](double, double) { return false; },
                [&](const Numbers&) { quick.turn(objective.energy(), context); },
                [&](Numbers& v) { quick.solve(v, context); }};
  descend(objective, now, way, step, context);
}

void descend_as_reference(const MotionObjective& objective, MotionPoint& now,
                          MotionTangent& tangent, SolidStep& step, const Context& context) {
  const Way way{1e-10, 200, [](double change, double before) { return change > 0.25 * before; },
                [&](const Numbers& at) {
                  tangent.make(objective, at, context);
                  ++step.factorisations;
                },
                [&](Numbers& v) { tangent.solve(v); }};
  descend(objective, now, way, step, context);
}

} // namespace gewebe
