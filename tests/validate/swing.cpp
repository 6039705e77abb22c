// Against an experiment in time: a silicone beam that is let go and swings.

#include "fit/swing_fit.h"
#include "integrator/solid_motion.h"
#include "tests/bench/timing.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/validate/checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::validate {

namespace {

constexpr double step = 1.0 / 3200;  ///< s; backward Euler damps by a ratio of 3 f times it
constexpr double ratio = 0.055;      ///< the one damping ratio, of both recordings
constexpr double seen = 1.5;         ///< s behind the release
constexpr int every = 16;            ///< steps between samples
constexpr double started = 1;        ///< mm down: from then on times are compared
constexpr std::size_t compared = 12; ///< half swings
const char* const source =
    "Dubied et al., Sim-to-Real for Soft Robots using Differentiable FEM, IEEE RA-L 2022";

/// How far the marker on the upper edge of the free end is below where it was held.
struct Path {
  std::vector<double> time, down;
};

/// Nothing where there is no file.
std::optional<Path> recording(const std::string& name) {
  std::ifstream file(test::shared_folder() + "/data/eth_beam/" + name + ".csv");
  if (!file)
    return {};
  Path path;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string time, up;
    std::getline(words, time, ',');
    std::getline(words, up, ',');
    path.time.push_back(std::stod(time));
    path.down.push_back(std::stod(up));
  }
  for (std::size_t k = path.down.size(); k-- > 0;)
    path.down[k] = path.down[0] - path.down[k];
  return path;
}

/// Its times count from where it is `started` down; what is before, and after `seen`, is dropped.
Path from_its_start(const Path& path) {
  std::size_t first = 0;
  while (first < path.down.size() && !(path.down[first] > started))
    ++first;
  Path result;
  if (first == 0 || first == path.down.size())
    return result;
  const double part = (started - path.down[first - 1]) / (path.down[first] - path.down[first - 1]),
               zero = path.time[first - 1] + part * (path.time[first] - path.time[first - 1]);
  for (std::size_t k = first; k < path.time.size() && path.time[k] - zero <= seen; ++k) {
    result.time.push_back(path.time[k] - zero);
    result.down.push_back(path.down[k]);
  }
  return result;
}

/// 540 quadratic tetrahedra.
test::Solid beam() {
  test::Solid solid{test::box_tetrahedra(10, 3, 3, 10), true, {{270000, 0.499, 1.07e-3}}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    solid.hold(axis, [](const Vec3& p) { return p.x == 0; });
  return solid;
}

/// What hangs on each node, g: a weight on the upper edge of the free end, in equal shares, as the
/// word `mass` of a scene hangs it there.
std::vector<double> hung(const test::Solid& solid, double weight) {
  std::vector<std::size_t> edge;
  for (std::size_t n = 0; n < solid.mesh.points.size(); ++n)
    if (solid.mesh.points[n].x == 100 && solid.mesh.points[n].z == 30)
      edge.push_back(n);
  std::vector<double> masses(solid.mesh.points.size());
  for (const std::size_t n : edge)
    masses[n] = weight / static_cast<double>(edge.size());
  return masses;
}

/// The marker stands 6 mm above the middle of the edge, carried by the end.
Path simulated(const test::Solid& solid, double weight, double frequency, Cost& cost) {
  integrator::SolidMotionOptions options;
  options.damping = integrator::damping_per_stiffness(ratio - 3 * frequency * step, frequency);
  constexpr double gravity = -9807.09; // mm/s²
  const std::vector<double> more = hung(solid, weight);
  std::vector<double> masses = fem::solid_masses(solid.mesh, solid.materials);
  std::vector<double> load =
      fem::gravity_load(solid.mesh, solid.materials, solid.elements, {0, 0, gravity});
  for (std::size_t n = 0; n < masses.size(); ++n) {
    masses[n] += more[n];
    load[3 * n + 2] += more[n] * gravity;
  }
  integrator::SolidMotion moving(solid.mesh, solid.materials,
                                 integrator::SolidNet{.masses = masses}, options,
                                 timing::with_threads(1));
  moving.hold(solid.fixed);
  moving.set_load(load);
  const auto place = [&](std::size_t node) {
    return Vec3{moving.places()[3 * node], moving.places()[3 * node + 1],
                moving.places()[3 * node + 2]};
  };
  const std::size_t top = solid.node_at({100, 15, 30}), bottom = solid.node_at({100, 15, 0});
  Path path;
  cost.unknowns = solid.unknowns();
  const int steps = static_cast<int>((seen + 0.1) / step);
  cost.solve = timing::processor_milliseconds([&] {
    for (int k = 0; k < steps; ++k) {
      (void)moving.step(step, timing::with_threads(1));
      if ((k + 1) % every != 0)
        continue;
      const Vec3 up = place(top) - place(bottom);
      path.time.push_back((k + 1) * step);
      path.down.push_back(36 - (place(top) + 6 / norm(up) * up).z);
    }
  });
  return path;
}

/// How far it goes from one turning point to the next, over the first such way: silicone creeps, so
/// that the middle of its swings moves, which these ways don't see.
std::vector<double> half_swings(const Path& path, double middle) {
  std::vector<double> most; // of the first, where it begins
  double sign = 0;
  for (const double down : path.down) {
    const double off = down - middle;
    if (off * sign > 0) {
      most.back() = test::larger(most.back(), std::abs(off));
    } else {
      sign = off;
      most.push_back(std::abs(off));
    }
  }
  std::vector<double> ways;
  for (std::size_t k = 1; k + 1 < most.size(); ++k)
    ways.push_back((most[k] + most[k + 1]) / (most[1] + most[2]));
  return ways;
}

} // namespace

Section swings() {
  Section section{
      "The silicone beam, let go",
      "The same beam is held straight and released: its free end falls and swings. The model has "
      "540 quadratic tetrahedra, corotational, E = 270,000 Pa, ν = 0.499. Steps of 1/3200 s damp "
      "little themselves; the damping ratio is " +
          text_of(ratio) +
          " for both loads, less the share of the steps. Frequency and rest position come from a "
          "decaying oscillation fitted to each path (`lib/fit/swing_fit.h`); measured ones are "
          "the mean of two trials. Decay compares the distances between turning points, relative "
          "to the first, over six swings. The release by hand is slower than in the simulation, "
          "so measured swings begin smaller. Times count from a droop of 1 mm. "
          "The 52 g hang on the nodes of the upper edge of the free end.",
      {},
      {}};
  for (const bool loaded : {false, true}) {
    const std::string name = loaded ? "load52" : "gravity",
                      what = loaded ? "with 52 g" : "own weight";
    const auto a = recording(name + "_a"), b = recording(name + "_b");
    if (!a || !b) {
      section.checks.push_back(skipped("swing, " + what, source, "no recordings"));
      continue;
    }
    const Path first = from_its_start(*a), second = from_its_start(*b);
    const fit::SwingFit of_first = fit::fit_swing(first.time, first.down),
                        of_second = fit::fit_swing(second.time, second.down);
    const double frequency = (of_first.frequency + of_second.frequency) / 2,
                 rest = (of_first.rest + of_second.rest) / 2;
    Cost cost;
    const Path ours = from_its_start(simulated(beam(), loaded ? 52 : 0, frequency, cost));
    const fit::SwingFit fit = fit::fit_swing(ours.time, ours.down);
    const auto check = [&](const std::string& of, double reference, double found, double bound) {
      section.checks.push_back({of + ", " + what,
                                source,
                                text_of(reference, 3),
                                text_of(found, 3),
                                std::abs(found / reference - 1),
                                bound,
                                {},
                                cost});
    };
    check("frequency, Hz", frequency, fit.frequency, 0.05);
    check("rest, mm down", rest, fit.rest, 0.07);
    const std::vector<double> mine = half_swings(ours, fit.rest),
                              one = half_swings(first, of_first.rest),
                              other = half_swings(second, of_second.rest);
    double apart = std::min({mine.size(), one.size(), other.size()}) < compared ? NAN : 0;
    for (std::size_t k = 0; k < compared && !std::isnan(apart); ++k)
      apart = test::larger(apart, std::abs(mine[k] - (one[k] + other[k]) / 2));
    section.checks.push_back({"decay, " + what,
                              source,
                              "as measured",
                              percent(apart) + " of the first way off",
                              apart,
                              0.1,
                              {},
                              cost});
    Plot plot{"swing-" + name + ".svg",
              "The beam's end, " + what,
              "seconds since it was 1 mm down",
              "mm above where it was held",
              {},
              true};
    const auto add = [&](const char* of, const Path& path) {
      Curve curve{of, {}};
      for (std::size_t k = 0; k < path.time.size(); ++k)
        curve.points.push_back({path.time[k], -path.down[k]});
      plot.curves.push_back(std::move(curve));
    };
    add("Gewebe", ours);
    add("measured", first);
    add("measured again", second);
    section.plots.push_back(std::move(plot));
  }
  return section;
}

} // namespace gewebe::validate
