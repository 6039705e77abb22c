// The work of a hand that leads an instrument over a closed path: what contact, not tissue, adds or
// takes.

#include "scene/simulation.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/sim_models.h"
#include "tests/validate/checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::validate {

namespace {

constexpr double radius = 5, deep = 2, aside = 4; // mm
constexpr double duration = 2;                    // s

/// Smoothly from 0 to 1.
double ramp(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

/// Down, aside, up, and back to the start, from just above the surface of a ball about 0 of 20 mm.
Vec3 place(double share) {
  const double down = ramp(4 * share) - ramp(4 * share - 2),
               along = ramp(4 * share - 1) - ramp(4 * share - 3);
  const double angle = aside * along / 20, height = 20 + radius + 0.2 - (deep + 0.2) * down;
  return Vec3{100, -50, 30} + height * Vec3{std::sin(angle), 0.02, std::cos(angle)};
}

/// Without what tissue itself loses.
model::Model lossless() {
  model::Model model = test::organ(3);
  for (model::Spring& spring : model.springs)
    spring.damping = 0;
  for (model::Node& node : model.nodes)
    node.drag = 0;
  return model;
}

struct Cycle {
  double work = 0;  ///< of the hand, 1e-9 J
  double kept = 0;  ///< energy of the object in the end
  double most = 0;  ///< largest energy that the hand had given
  double least = 0; ///< least of what it had given beyond what the object had, at any time
};

Cycle lead(scene::Method method, scene::Integration integration, double friction, double step) {
  scene::Simulation s(timing::with_threads(1), {});
  s.add_object("organ", lossless(), method, {}, integration);
  s.apply(scene::SetTimestep{step});
  s.apply(scene::SetInstrument{0, {radius, {}, friction}, {place(0), {}}, "probe"});
  s.step(0);
  Cycle cycle;
  const auto steps = static_cast<std::size_t>(std::round(duration / step));
  Vec3 last = place(0), force;
  for (std::size_t k = 1; k <= steps; ++k) {
    const Vec3 to = place(static_cast<double>(k) / static_cast<double>(steps));
    s.apply(scene::MoveInstrument{0, to, {}, method == scene::Method::ffe ? 0 : step});
    s.step(step);
    const Vec3 now = s.instrument(0).force;
    // A dynamic force is the mean over the step, a static one that of its end.
    cycle.work -= dot(method == scene::Method::ffe ? 0.5 * (force + now) : now, to - last);
    force = now;
    last = to;
    const scene::SimulationState state = s.state();
    cycle.kept = state.kinetic_energy + state.elastic_energy;
    cycle.most = test::larger(cycle.most, cycle.work);
    if (method != scene::Method::ffe)
      cycle.least = test::smaller(cycle.least, cycle.work - cycle.kept);
  }
  return cycle;
}

std::string name_of(double friction) {
  return friction > 0 ? ", friction 0.3" : "";
}

} // namespace

Section passivity() {
  Section section{
      "Work over a closed path",
      "A sphere of 5 mm is pressed 2 mm into a net without damping (ball of 20 mm, edges of 4 mm), "
      "moved 4 mm aside, lifted and moved back, in 2 s. The figure is the work of the hand less "
      "the energy kept by the net, over the largest work. Without friction it vanishes with the "
      "step; with friction it is the same in motion as at rest. Static forces are those at the "
      "ends of steps, dynamic ones means over steps.",
      {},
      {}};
  Plot without{"passivity.svg",
               "A sphere led over a closed path, without friction",
               "step, s",
               "work that is missing, over the largest",
               {}};
  Plot with{"passivity-friction.svg",
            "A sphere led over a closed path, friction 0.3",
            "step, s",
            "work that friction takes, over the largest",
            {}};
  struct Way {
    const char* name;
    scene::Method method;
    scene::Integration integration;
    double step, bound;
  };
  const std::array<Way, 2> ways{
      {{"at rest (ffe)", scene::Method::ffe, scene::Integration::semi_implicit, 1.0 / 50, 2e-5},
       {"in motion (ela)", scene::Method::ela, scene::Integration::implicit, 1.0 / 50, 0.02}}};
  constexpr int halvings = 4;
  const auto check = [&](const std::string& what, const std::string& expected, double figure,
                         double error, double bound) {
    section.checks.push_back(
        {what, "", expected, text_of(figure, 3), error, bound, text_of(error, 2)});
  };
  std::vector<double> taken;
  for (const double friction : {0.0, 0.3})
    for (const Way& way : ways) {
      Curve curve{way.name, {}};
      std::vector<double> lost;
      double worst = 0, won = 0; // at any step
      Cycle c;
      for (int k = 0; k <= halvings; ++k) {
        const double step = way.step / (1 << k);
        c = lead(way.method, way.integration, friction, step);
        lost.push_back((c.work - c.kept) / c.most);
        worst = test::larger(worst, std::abs(lost.back()));
        won = test::larger(won, -c.least / c.most);
        curve.points.push_back({step, std::abs(lost.back())});
      }
      const std::size_t n = lost.size();
      const double change = lost[n - 1] - lost[n - 2], before = lost[n - 2] - lost[n - 3];
      const std::string what = way.name + name_of(friction);
      if (friction > 0) {
        check(what + ": friction takes", "> 0", lost[n - 1], lost[n - 1] > 0 ? 0 : 1, 0);
        taken.push_back(lost[n - 1]);
        with.curves.push_back(curve);
      } else {
        check(what + ": work that is missing", "0", lost[n - 1], std::abs(lost[n - 1]), way.bound);
        without.curves.push_back(curve);
      }
      check(what + ": the last half step changes it, over the one before", "below 0.6",
            change / before, std::abs(change / before), 0.6);
      if (way.method != scene::Method::ffe)
        check(what + ": energy from nowhere at any time", "0", 0 - c.least / c.most,
              0 - c.least / c.most, 1e-3);
      if (way.integration == scene::Integration::implicit) {
        const std::string steps = " at any step up to " + text_of(way.step, 2) + " s";
        if (!(friction > 0))
          check(what + ": work that is missing" + steps, "0", worst, worst, 0.3);
        check(what + ": energy from nowhere" + steps, "0", won, won, 0.5);
      }
    }
  const double friction_off = std::abs(taken[1] / taken[0] - 1);
  check("friction takes as much in motion as at rest", "1", 1 + friction_off, friction_off, 0.02);
  section.plots = {std::move(without), std::move(with)};
  return section;
}

} // namespace gewebe::validate
