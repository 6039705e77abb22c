// Strains the stability of elastodynamics: random nets with stiffness ratios to 1e9, mass ratios to
// 1e6, slivers, damping ratios 0, 0.1, 1 and 3, at 0.99 of the safe step; at 1.5 times it nothing
// may come out that is not finite. Arguments: nets and steps (default 50 and 100000).

#include "tests/unit/random_nets.h"

#include <cstdio>
#include <cstdlib>

namespace {

using namespace gewebe;

double energy_of(const model::Model& model, const dynamics::Elastodynamic& object) {
  return dynamics::kinetic_energy(model, object.motion()) +
         dynamics::elastic_energy(model, object.motion());
}

int run(std::uint32_t nets, double steps) {
  Context context;
  context.threads = 1;
  int failures = 0, reported = 0;
  double worst = 0;
  for (std::uint32_t seed = 0; seed < nets; ++seed) {
    const model::Model model = test::random_model(seed);
    const auto start = test::kicked(model, 1e-7, 0);
    for (const double part : {0.99, 1.5}) {
      dynamics::Elastodynamic object(model);
      object.set_motion(start);
      const double first = energy_of(model, object), h = part * model::safe_step(model);
      bool good = true;
      try {
        (void)object.advance(steps * h, h, context);
        const double growth = energy_of(model, object) / first;
        good = std::isfinite(growth) && (part > 1 || growth < 200);
        if (part < 1 && !(growth <= worst))
          worst = growth;
      } catch (const dynamics::MotionError&) {
        good = part > 1;
        ++reported;
      }
      if (!good)
        std::printf("net %u at %g of the safe step FAILED\n", seed, part);
      failures += good ? 0 : 1;
    }
  }
  std::printf(
      "%u nets, %g steps: energy grew %.3g times at most at 0.99 of the safe step; at 1.5 of "
      "it %d were reported\n",
      nets, steps, worst, reported);
  return failures == 0 && reported > 0 ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  const double nets = argc > 1 ? std::strtod(argv[1], nullptr) : 50;
  const double steps = argc > 2 ? std::strtod(argv[2], nullptr) : 1e5;
  if (!(nets >= 1 && nets <= 1e6 && steps >= 1 && steps <= 1e8)) {
    std::fputs("usage: stress_ela [NETS [STEPS]]\n", stderr);
    return 2;
  }
  return run(static_cast<std::uint32_t>(nets), steps);
}
