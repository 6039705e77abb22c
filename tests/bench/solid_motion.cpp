// Solids in motion in real time: a beam of 100 x 25 x 25 mm, E = 50 kPa, nu = 0.45, held at one
// end, that falls under its weight from rest, again and again, in steps of 1/60 s: 52,728 linear
// and 5,184 quadratic corotational tetrahedra. Times of whole steps, of their parts, each by
// itself and by its share of a step, and errors of steps against converged Newton from the same
// state, over the step's displacement.
//
// Writes CSV to standard output: body, tetrahedra, threads, what, number of samples, mean, median,
// 99 % quantile, and the unit. Arguments: steps (1000), of which every how manieth is compared
// (97).

#include "integrator/solid_motion.h"
#include "fem/assembly.h"
#include "fem/corotational.h"
#include "linalg/factor.h"
#include "linalg/single_factor.h"
#include "tests/bench/timing.h"
#include "tests/unit/tet_fixtures.h"
#include "tetrahedra/order.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

using Numbers = std::vector<double>;

constexpr double h = 1.0 / 60;
constexpr int fall = 60; // steps, then from rest again

struct Beam {
  std::string name;
  tetrahedra::TetMesh mesh;
  std::vector<fem::SolidMaterial> materials{{5e4, 0.45, 1e-3}};
  std::vector<std::uint8_t> held{};
  Numbers load{};

  std::size_t axes() const { return held.size(); }
};

Beam beam(bool quadratic) {
  Beam b{quadratic ? "quadratic" : "linear", quadratic
                                                 ? test::box_tetrahedra(24, 6, 6, 100.0 / 24)
                                                 : test::box_tetrahedra(52, 13, 13, 100.0 / 52)};
  if (quadratic)
    tetrahedra::make_quadratic(b.mesh);
  for (const Vec3& p : b.mesh.points)
    b.held.insert(b.held.end(), 3, p.x == 0 ? 1 : 0);
  b.load.resize(b.axes());
  const Numbers masses = fem::solid_masses(b.mesh, b.materials);
  for (std::size_t i = 0; i < masses.size(); ++i)
    b.load[3 * i + 2] = -9810 * masses[i];
  return b;
}

integrator::SolidMotion moving(const Beam& b, bool reference, const Context& context) {
  integrator::SolidMotionOptions options;
  options.reference = reference;
  integrator::SolidMotion body(b.mesh, b.materials, options, context);
  body.hold(b.held);
  body.set_load(b.load);
  return body;
}

double distance(const Numbers& a, const Numbers& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

double mean(const Numbers& samples) {
  double sum = 0;
  for (const double sample : samples)
    sum += sample;
  return sum / static_cast<double>(samples.size());
}

void report(const Beam& b, int threads, const char* what, Numbers samples, const char* unit) {
  if (samples.empty())
    return;
  const double average = mean(samples);
  std::ranges::sort(samples);
  const std::size_t n = samples.size();
  std::printf("%s,%zu,%d,%s,%zu,%.5g,%.5g,%.5g,%s\n", b.name.c_str(), b.mesh.tetrahedra.size(),
              threads, what, n, average, samples[n / 2], samples[std::min(n - 1, n * 99 / 100)],
              unit);
  std::fflush(stdout);
}

/// Means of a step: ms, and how often its parts.
struct StepMeans {
  double time = 0, rounds = 0, evaluations = 0;
};

StepMeans time_steps(const Beam& b, int threads, int steps, int compared) {
  const Context context = with_threads(threads);
  integrator::SolidMotion body = moving(b, false, context), newton = moving(b, true, context);
  (void)body.step(h, context); // makes the factor
  Numbers times, rounds, evaluations, errors;
  for (int n = 0; n < steps; ++n) {
    if (n % fall == 0)
      body.set_state(Numbers(b.axes()), Numbers(b.axes()), context);
    const Numbers before = body.displacement(),
                  speed(body.velocity().begin(), body.velocity().end());
    integrator::SolidStep step;
    times.push_back(milliseconds([&] { step = body.step(h, context); }));
    rounds.push_back(step.rounds);
    evaluations.push_back(step.evaluations);
    if (n % compared != compared - 1)
      continue;
    newton.set_state(before, speed, context);
    (void)newton.step(h, context);
    const Numbers exact = newton.displacement();
    errors.push_back(100 * distance(body.displacement(), exact) / distance(exact, before));
  }
  report(b, threads, "step", times, "ms");
  report(b, threads, "rounds of a step", rounds, "1");
  report(b, threads, "evaluations of a step", evaluations, "1");
  report(b, threads, "error of a step", errors, "%");
  return {mean(times), mean(rounds), mean(evaluations)};
}

void time_parts(const Beam& b, int threads, int runs, const StepMeans& step) {
  const Context context = with_threads(threads);
  const std::vector<fem::SolidElement> elements = fem::solid_elements(b.mesh, b.materials, context);
  fem::CorotationalSolid solid(b.mesh, elements, {false, false});
  Numbers x, forces(b.axes()), rotations(3 * b.axes());
  for (const Vec3& p : b.mesh.points) // bent somewhat
    x.insert(x.end(), {p.x, p.y, p.z - 2e-3 * p.x * p.x});
  linalg::StiffnessMatrix matrix = fem::solid_stiffness(b.mesh, elements, b.held, context);
  const Numbers masses = fem::solid_masses(b.mesh, b.materials);
  for (std::size_t c = 0; c < matrix.order(); ++c)
    matrix.value[static_cast<std::size_t>(matrix.column_start[c])] +=
        masses[static_cast<std::size_t>(matrix.axis_of_row[c]) / 3] / (h * h);
  linalg::SingleFactor factor{linalg::Factor(matrix, context)};
  Numbers rows(matrix.order()), forced, solved, turned;
  for (int run = -3; run < runs; ++run) {
    const auto time = [&](Numbers& to, const auto& work) {
      const double taken = milliseconds(work);
      if (run >= 0)
        to.push_back(taken);
    };
    time(forced, [&] { (void)solid.evaluate(x, {1, 0}, forces, context, false); });
    time(turned, [&] {
      (void)solid.evaluate(x, {1, 0}, forces, context, true);
      solid.node_rotations(rotations, context);
    });
    for (std::size_t k = 0; k < rows.size(); ++k)
      rows[k] = std::sin(static_cast<double>(k));
    time(solved, [&] { factor.solve(rows, context); });
  }
  report(b, threads, "energy and forces", forced, "ms");
  report(b, threads, "the same and frames of nodes", turned, "ms");
  report(b, threads, "solution with the factor", solved, "ms");
  const double solving = step.rounds * mean(solved), evaluating = step.evaluations * mean(forced),
               turning = mean(turned) - mean(forced);
  report(b, threads, "of a step: solutions", {100 * solving / step.time}, "%");
  report(b, threads, "of a step: energy and forces", {100 * evaluating / step.time}, "%");
  report(b, threads, "of a step: frames", {100 * turning / step.time}, "%");
  report(b, threads, "of a step: the rest",
         {100 - 100 * (solving + evaluating + turning) / step.time}, "%");
}

} // namespace

int main(int count, char** arguments) {
  const int steps = count > 1 ? std::atoi(arguments[1]) : 1000,
            compared = std::max(1, count > 2 ? std::atoi(arguments[2]) : 97);
  std::puts("body,tetrahedra,threads,what,samples,mean,median,quantile_99,unit");
  for (const bool quadratic : {false, true}) {
    const Beam b = beam(quadratic);
    for (const int threads : {1, 2}) {
      const StepMeans means = time_steps(b, threads, steps, compared);
      time_parts(b, threads, std::max(1, steps / 5), means);
    }
  }
  return EXIT_SUCCESS;
}
