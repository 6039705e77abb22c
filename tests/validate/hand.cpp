// A hand that feels the device's force one sample late, on stiff tissue, for ten seconds: with a
// coupling it comes to rest, without it is thrown about.

#include "scene/simulation.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/sim_models.h"
#include "tests/validate/checks.h"

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe::validate {

namespace {

constexpr double radius = 8, sample = 0.001, seconds = 10, window = 0.01;

Vec3 above(double gap) {
  return Vec3{100, -50, 30} + Vec3{0.3, 0.2, 20 + radius + gap};
}

struct Held {
  std::vector<Point>
      excursion;              ///< mm from peak to peak in each hundredth of a second, over its end
  double given = 0, most = 0; ///< work of the hand at the device in the end, and at most, 1e-9 J
  double thrown = 0;          ///< s, when it was beyond 2 mm; 0: never
};

/// 50 g on 300 N/m and 1 N s/m (of an arm that holds lightly), led 1.5 mm deep into a net of a
/// thousand times an organ's stiffness, at rest (ffe), by implicit steps of the sample.
Held hold(const std::optional<contact::Coupling>& coupling) {
  scene::Simulation s(timing::with_threads(1), {});
  model::Model model = test::organ(2);
  for (model::Spring& spring : model.springs)
    spring.stiffness *= 1000;
  s.add_object("o", std::move(model), scene::Method::ffe);
  s.apply(scene::SetInstrument{0, {radius, {}, 0}, {above(0.1), {}}, "probe"});
  if (coupling)
    s.apply(scene::SetCoupling{0, *coupling});
  const double mass = 50, spring = 3e5, damper = 1000, rest = -1.5;
  Held held;
  double z = 0.1, v = 0, felt = 0, late = 0, low = HUGE_VAL, high = -HUGE_VAL;
  const int steps = static_cast<int>(std::lround(seconds / sample)),
            each = static_cast<int>(std::lround(window / sample));
  for (int i = 1; i <= steps; ++i) {
    v = (mass * v + sample * (spring * (rest - z) + late)) /
        (mass + sample * damper + sample * sample * spring);
    z += sample * v;
    s.apply(scene::MoveInstrument{0, above(z), {}, 0});
    s.step(sample);
    held.given -= late * sample * v;
    held.most = test::larger(held.most, held.given);
    late = std::exchange(felt, s.instrument(0).force.z);
    low = test::smaller(low, z);
    high = test::larger(high, z);
    const bool thrown = !(std::abs(z) <= 2);
    if (thrown)
      held.thrown = i * sample;
    if (i % each == 0 || thrown) {
      held.excursion.push_back({i * sample, std::max(high - low, 1e-9)});
      low = HUGE_VAL;
      high = -HUGE_VAL;
    }
    if (thrown)
      break;
  }
  return held;
}

} // namespace

Section hand() {
  Section section{"A hand at one kilohertz",
                  "A hand (50 g on 300 N/m and 1 N s/m) pushes a sphere of 8 mm by 1.5 mm into a "
                  "stiff net at rest and receives its force one sample of 1 ms late. Through a "
                  "coupling of 500 N/m and 0.5 N s/m it comes to rest and stays there for ten "
                  "seconds; with a rigid connection it does not.",
                  {},
                  {}};
  Plot plot{"hand.svg",
            "A hand that feels a force one sample late",
            "s",
            "mm from peak to peak in a hundredth of a second (1e-9 at least)",
            {}};
  const Held led = hold(contact::Coupling{5e5, 500}), rigid = hold(std::nullopt);
  const double last = led.excursion.back().y, without = rigid.excursion.back().y;
  section.checks.push_back({"coupled: excursion in the last hundredth of a second", "", "0 mm",
                            text_of(last, 2), last, 1e-3, text_of(last, 2)});
  section.checks.push_back({"coupled: it lasts ten seconds", "", "10 s",
                            text_of(led.excursion.back().x, 4),
                            std::abs(led.excursion.back().x - seconds), 1e-9,
                            text_of(std::abs(led.excursion.back().x - seconds), 2)});
  section.checks.push_back(
      {"rigidly led: excursion in its last hundredth of a second", "", "> 0.02 mm",
       text_of(without, 2), without > 0.02 ? 0.0 : 1.0, 0.5,
       rigid.thrown > 0 ? "thrown at " + text_of(rigid.thrown, 3) + " s" : ""});
  plot.curves.push_back({"coupled", led.excursion});
  plot.curves.push_back({"led rigidly", rigid.excursion});
  section.plots.push_back(std::move(plot));
  return section;
}

} // namespace gewebe::validate
