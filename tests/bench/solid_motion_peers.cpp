// Solids in motion beside MuJoCo's flex and Warp's explicit elements (named and left out where
// Python has none), on equal meshes of linear tetrahedra and one thread: a beam of 100 x 25 x 25
// mm, E = 50 kPa, nu = 0.45, held at one end, falls under its weight for 0.2 s. Each at several
// steps, explicit and implicit where the peer has it; the error is that of the end's mean height at
// four times over its largest fall, against the same program at its finest step: the laws differ
// (MuJoCo's is St. Venant and Kirchhoff's; Warp's is our Neo-Hookean one, and in single precision),
// what is compared is what accuracy in time costs.
//
// Writes CSV to standard output: stage, program, tetrahedra, step in s, threads, median, fastest
// and slowest time of the processor for 0.2 s in ms, of three runs, error, what it is of.

#include "fem/assembly.h"
#include "integrator/solid_motion.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/tet_fixtures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
#include <string>
#include <unistd.h>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr double duration = 0.2; // s
constexpr int looks = 4;
constexpr double young = 5e4, poisson = 0.45;

struct Beam {
  tetrahedra::TetMesh mesh;
  std::vector<std::uint64_t> held;
};

Beam beam(std::uint32_t across) {
  Beam b{test::box_tetrahedra(4 * across, across, across, 25.0 / across), {}};
  for (std::size_t i = 0; i < b.mesh.points.size(); ++i)
    if (b.mesh.points[i].x == 0)
      b.held.push_back(i);
  return b;
}

struct Run {
  double ms = 0;
  std::vector<double> heights; ///< of the end, in mm
};

Run ours(const Beam& beam, integrator::SolidLaw law, int steps) {
  const std::vector<fem::SolidMaterial> materials{{young, poisson, 1e-3}};
  integrator::SolidMotionOptions options;
  options.law = law;
  integrator::SolidMotion moving(beam.mesh, materials, options, with_threads(1));
  const std::size_t axes = 3 * beam.mesh.points.size();
  std::vector<std::uint8_t> held(axes);
  for (const std::uint64_t node : beam.held)
    for (std::size_t a = 0; a < 3; ++a)
      held[3 * node + a] = 1;
  std::vector<double> load(axes);
  for (std::size_t i = 0; i < axes / 3; ++i)
    load[3 * i + 2] = -9810 * moving.masses()[i];
  moving.hold(held);
  moving.set_load(load);
  const std::vector<double> places(moving.places().begin(), moving.places().end());
  const double h = duration / steps;
  (void)moving.step(h, with_threads(1)); // with the factor, which is made once
  moving.restore(places, std::vector<double>(axes));
  Run run;
  for (int k = 0; k < steps; ++k) {
    run.ms += processor_milliseconds([&] { (void)moving.step(h, with_threads(1)); });
    if ((k + 1) % (steps / looks) != 0)
      continue;
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < axes / 3; ++i)
      if (beam.mesh.points[i].x > 100 - 1e-9) {
        sum += moving.places()[3 * i + 2];
        ++count;
      }
    run.heights.push_back(sum / count);
  }
  return run;
}

void write(const Beam& beam, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  const auto put = [&](const auto& values) {
    file.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof values[0]));
  };
  put(std::array<std::uint64_t, 3>{beam.mesh.points.size(), beam.mesh.tetrahedra.size(),
                                   beam.held.size()});
  put(beam.mesh.points);
  std::vector<std::uint64_t> corners;
  for (const Tetrahedron& t : beam.mesh.tetrahedra)
    corners.insert(corners.end(), t.begin(), t.end());
  put(corners);
  put(beam.held);
}

/// What a script says, called with the beam, a step, `more` and how many steps; nothing where it
/// can't run, or where it became unstable.
Run peer(const char* script, const std::string& path, const char* more, int steps) {
  std::array<char, 400> call{};
  (void)std::snprintf(call.data(), call.size(), "tests/bench/%s '%s' %.17g %.17g %.17g %s %d %d",
                      script, path.c_str(), young, poisson, duration / steps, more, steps,
                      steps / looks);
  const std::vector<double> numbers = numbers_of_script(call.data());
  if (numbers.size() != 1 + looks)
    return {};
  return {numbers[0], {numbers.begin() + 1, numbers.end()}};
}
Run mujoco(const std::string& path, const char* integrator, int steps) {
  return peer("solid_motion_mujoco.py", path, integrator, steps);
}

/// Against its own run of the finest step, the last one.
void show(const char* program, const Beam& beam, std::span<const int> steps,
          const std::function<Run(int)>& run) {
  const Run finest = run(steps.back());
  if (finest.heights.empty()) {
    std::fprintf(stderr, "%s: absent, or failed\n", program);
    return;
  }
  // Heights at rest are the middle of the side.
  double fall = 0;
  for (const double z : finest.heights)
    fall = test::larger(fall, std::abs(z - 12.5));
  for (const int count : steps.first(steps.size() - 1)) {
    std::vector<double> ms;
    double error = 0;
    for (int again = 0; again < 3; ++again) {
      const Run one = run(count);
      ms.push_back(one.heights.empty() ? NAN : one.ms);
      error = one.heights.empty() ? NAN : error;
      for (std::size_t k = 0; k < one.heights.size(); ++k)
        error = test::larger(error, std::abs(one.heights[k] - finest.heights[k]) / fall);
    }
    const Times times = times_of(ms);
    std::printf("falling beam of %zu tetrahedra,%s,%zu,%.4g,1,%.4g,%.4g,%.4g,%.3g,"
                "error of the end over its fall\n",
                beam.mesh.tetrahedra.size(), program, beam.mesh.tetrahedra.size(), duration / count,
                times.median, times.fastest, times.slowest, error);
    std::fflush(stdout);
  }
}

} // namespace

int main() {
  std::string path = (std::filesystem::temp_directory_path() / "gewebe-bench-XXXXXX").string();
  const int file = mkstemp(path.data());
  if (file < 0)
    return EXIT_FAILURE;
  (void)close(file);
  std::puts(
      "stage,program,tetrahedra,step_s,threads,median_ms,fastest_ms,slowest_ms,error,measure");
  for (const std::uint32_t across : {4U, 8U}) {
    const Beam body = beam(across);
    write(body, path);
    show("gewebe", body, std::array{12, 40, 100, 400, 1600, 6400},
         [&](int steps) { return ours(body, integrator::SolidLaw::corotational, steps); });
    show("gewebe Neo-Hookean", body, std::array{12, 40, 100, 400, 3200},
         [&](int steps) { return ours(body, integrator::SolidLaw::hyperelastic, steps); });
    show("mujoco discrete", body, std::array{12, 40, 100, 400, 3200},
         [&](int steps) { return mujoco(path, "discrete", steps); });
    show("mujoco Euler", body, std::array{400, 800, 1600, 6400},
         [&](int steps) { return mujoco(path, "Euler", steps); });
    show("warp", body, std::array{800, 1600, 3200, 12800},
         [&](int steps) { return peer("solid_motion_warp.py", path, "", steps); });
  }
  (void)std::filesystem::remove(path);
  return EXIT_SUCCESS;
}
