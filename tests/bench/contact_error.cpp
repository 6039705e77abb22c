// Work and error of contact: what the activation distance d_hat, the tolerances of Newton's method
// and the stick length of friction cost, and how far forces are off. Each is changed by itself; the
// others keep their defaults.
//
//   pressed  a rigid sphere of 10 mm, 0.2 mm deep in a quarter of a large block: the force against
//            that of the half-space, too (Sneddon 1965), where the error of elements is included
//   sliding  the sphere pressed by 0.2 mm into a block of linear tetrahedra, then drawn by 0.3 mm
//            with friction 0.3: the forces of all steps
//
// The error is that of the force over the force of an answer with a d_hat and tolerances that are
// far smaller. One thread, and the time that its processor worked: the median of three runs. MuJoCo
// flex slides the same sphere along the same mesh (contact_error_mujoco.py), its error is that
// against its own answer with the stiffest contact; it is skipped where it is not installed.
//
//   bench_contact_error [gewebe|mujoco]
//
// Writes CSV to standard output: stage, program, nodes, contacts, threads, median_ms, error, its
// measure, the setting over its default
// (of MuJoCo: step, stiffness of contact, seconds for a part of the way), and the error against
// theory (empty: there is none).

#include "contact/instrument.h"
#include "fem/solid_model.h"
#include "statics/elastostatic.h"
#include "tests/bench/peer.h"
#include "tests/bench/timing.h"
#include "tests/unit/tet_fixtures.h"
#include "tests/validate/pressed_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stdlib.h>
#include <string>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr double radius = 10, depth = 0.2, young = 1e4, poisson = 0.3; // mm, Pa
constexpr int runs = 3;

/// Force of a rigid sphere on a half-space, 1e-6 N, and the radius of the touched circle.
std::pair<double, double> force_of_theory() {
  double low = 0, high = radius;
  for (int k = 0; k < 100; ++k) {
    const double a = (low + high) / 2;
    (a / 2 * std::log((radius + a) / (radius - a)) < depth ? low : high) = a;
  }
  const double a = low, logarithm = std::log((radius + a) / (radius - a));
  const double force =
      young / (1 - poisson * poisson) * ((radius * radius + a * a) / 2 * logarithm - a * radius);
  return {force, a};
}

model::Model block_of(const std::vector<double>& x, const std::vector<double>& y,
                      const std::vector<double>& z, bool quadratic) {
  const auto count = [](const std::vector<double>& at) {
    return static_cast<std::uint32_t>(at.size() - 1);
  };
  tetrahedra::TetMesh mesh = test::box_tetrahedra(count(x), count(y), count(z));
  for (Vec3& p : mesh.points)
    p = {x[static_cast<std::size_t>(p.x)], y[static_cast<std::size_t>(p.y)],
         z[static_cast<std::size_t>(p.z)]};
  fem::SolidModelOptions options;
  options.material.materials[0].young = young;
  options.material.materials[0].poisson = poisson;
  options.quadratic = quadratic;
  return fem::solid_model(std::move(mesh), options, with_threads(1));
}

/// Cells of even width to beyond the touched circle, then wider and wider.
model::Model quarter(double touched) {
  std::vector<double> at{0};
  const double cell = touched / 5;
  while (at.back() < 1.2 * touched)
    at.push_back(at.back() + cell);
  for (double width = 1.5 * cell; at.back() < 60 * touched; width *= 1.5)
    at.push_back(at.back() + width);
  std::vector<double> down;
  for (auto z = at.rbegin(); z != at.rend(); ++z)
    down.push_back(-*z);
  model::Model model = block_of(at, at, down, true);
  for (model::Node& node : model.nodes) {
    const auto& [x, y, z] = node.position;
    const bool far = x == at.back() || y == at.back() || z == down.front();
    node.fixed = static_cast<std::uint8_t>(
        far ? model::fixed_all : (x == 0 ? model::fixed_x : 0) | (y == 0 ? model::fixed_y : 0));
  }
  return model;
}

std::vector<double> even(double from, double to, int cells) {
  std::vector<double> at;
  for (int k = 0; k <= cells; ++k)
    at.push_back(from + (to - from) * k / cells);
  return at;
}

model::Model small_block() {
  const std::vector<double> across = even(-5, 5, 16);
  model::Model model = block_of(across, across, even(-4, 0, 6), false);
  for (model::Node& node : model.nodes)
    node.fixed = node.position.z == -4 ? model::fixed_all : model::fixed_none;
  return model;
}

struct Scene {
  std::string name;
  model::Model model;
  std::vector<Vec3> way; ///< of the sphere's centre
  std::size_t counted;   ///< from this part of the way on forces count
  double friction = 0;
};

struct Answer {
  std::vector<Vec3> forces; ///< on the sphere, by parts of the way
  std::size_t contacts = 0;
  double milliseconds = 0;
};

Answer answer(const Scene& scene, statics::Elastostatic& solver,
              const contact::Parameters& parameters) {
  Answer result;
  validate::PressedBody body(scene.model, solver, {radius, {}, scene.friction},
                             {{scene.way[0].x, 0, radius + 0.02}, {}}, parameters);
  result.milliseconds = processor_milliseconds([&] {
    for (const Vec3& to : scene.way) {
      if (!body.move({to, {}})) {
        (void)std::fprintf(stderr, "contact_error: %s is not solved\n", scene.name.c_str());
        std::exit(EXIT_FAILURE);
      }
      result.forces.push_back(body.force_on_instrument());
    }
  });
  result.contacts = body.forces().size();
  return result;
}

double error_of(const Scene& scene, const std::vector<Vec3>& found,
                const std::vector<Vec3>& known) {
  double square = 0, size = 0;
  for (std::size_t k = scene.counted; k < known.size(); ++k) {
    const Vec3 off = found[k] - known[k];
    square += dot(off, off);
    size += dot(known[k], known[k]);
  }
  return std::sqrt(square / size);
}

void set_gap(contact::Parameters& p, double factor) {
  p.lengths.activation_distance *= factor;
  p.lengths.activation_over_radius *= factor;
}
void set_tolerance(contact::Parameters& p, double factor) {
  p.tolerances.step *= factor;
  p.tolerances.force *= factor;
  p.tolerances.friction *= factor;
}
void set_stick(contact::Parameters& p, double factor) {
  p.lengths.stick_length *= factor;
}

void row(const Scene& scene, const std::string& program, std::size_t contacts, double milliseconds,
         double error, const std::string& setting, const std::string& theory) {
  std::printf("%s,%s,%zu,%zu,1,%.4f,%.3e,of the force,%s,%s\n", scene.name.c_str(), program.c_str(),
              scene.model.nodes.size(), contacts, milliseconds, error, setting.c_str(),
              theory.c_str());
  (void)std::fflush(stdout);
}

void bench(const Scene& scene, double theory) {
  statics::Elastostatic solver(scene.model, nullptr, with_threads(1));
  contact::Parameters tight;
  set_gap(tight, 1e-3);
  set_tolerance(tight, 0.1);
  set_stick(tight, 1e-2);
  const Answer known = answer(scene, solver, tight);
  using Set = void (*)(contact::Parameters&, double);
  std::vector<std::pair<std::string, Set>> series{{"d_hat", set_gap},
                                                  {"tolerances", set_tolerance}};
  if (scene.friction > 0)
    series.emplace_back("stick length", set_stick);
  for (const auto& [name, set] : series)
    for (const double factor : set == set_tolerance
                                   ? std::vector{1e4, 1e3, 100.0, 10.0, 1.0, 0.1, 0.01}
                                   : std::vector{10.0, 3.0, 1.0, 1.0 / 3, 0.1, 1.0 / 30, 0.01}) {
      contact::Parameters parameters;
      set(parameters, factor);
      std::vector<double> times;
      Answer found;
      for (int run = 0; run < runs; ++run) {
        found = answer(scene, solver, parameters);
        times.push_back(found.milliseconds);
      }
      std::array<char, 32> setting{}, text{};
      (void)std::snprintf(setting.data(), setting.size(), "%g", factor);
      if (theory > 0)
        (void)std::snprintf(text.data(), text.size(), "%.3e",
                            std::abs(4 * found.forces.back().z / theory - 1));
      row(scene, "Gewebe; " + name, found.contacts, times_of(times).median,
          error_of(scene, found.forces, known.forces), setting.data(), text.data());
    }
}

struct Peer {
  double step, stiffness, seconds; ///< s, 1/s2, s for each part of the way
};

/// The same way by MuJoCo: nothing where it is not installed.
Answer peer_answer(const Scene& scene, const std::string& file, const Peer& peer) {
  std::array<char, 256> words{};
  (void)std::snprintf(words.data(), words.size(), "%s %g %g %g %g %g %g %g discrete", file.c_str(),
                      young, poisson, radius, scene.friction, peer.step, peer.stiffness,
                      peer.seconds);
  std::string call = std::string("tests/bench/contact_error_mujoco.py ") + words.data();
  for (const Vec3& p : scene.way) {
    (void)std::snprintf(words.data(), words.size(), " %.9g,%.9g", p.x, p.z);
    call += words.data();
  }
  const std::vector<double> numbers = numbers_of_script(call);
  Answer result;
  if (numbers.size() != 1 + 2 * scene.way.size())
    return result;
  result.milliseconds = numbers[0];
  for (std::size_t k = 1; k + 1 < numbers.size(); k += 2)
    result.forces.push_back({numbers[k], 0, numbers[k + 1]});
  return result;
}

void bench_peer(const Scene& scene) {
  std::string folder = (std::filesystem::temp_directory_path() / "gewebe-bench-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr)
    std::exit(EXIT_FAILURE);
  const std::string file = folder + "/block";
  std::vector<double> places;
  std::vector<std::uint64_t> corners, held;
  for (std::size_t n = 0; n < scene.model.nodes.size(); ++n) {
    const model::Node& node = scene.model.nodes[n];
    places.insert(places.end(), {node.position.x, node.position.y, node.position.z});
    if (node.fixed == model::fixed_all)
      held.push_back(n);
  }
  for (const Tetrahedron& t : scene.model.tetrahedra)
    corners.insert(corners.end(), t.begin(), t.end());
  {
    std::ofstream out(file, std::ios::binary);
    const std::array<std::uint64_t, 3> sizes{scene.model.nodes.size(),
                                             scene.model.tetrahedra.size(), held.size()};
    const auto write = [&](const auto& list) {
      out.write(reinterpret_cast<const char*>(list.data()),
                static_cast<std::streamsize>(list.size() * sizeof(list[0])));
    };
    write(sizes);
    write(places);
    write(corners);
    write(held);
  }
  const Answer known = peer_answer(scene, file, {0.005, 1e7, 0.1});
  if (known.forces.empty())
    (void)std::fputs("contact_error: MuJoCo skipped: not installed\n", stderr);
  else
    for (const Peer& peer : {Peer{0.01, 1e4, 0.06}, Peer{0.01, 1e5, 0.06}, Peer{0.01, 1e6, 0.06},
                             Peer{0.01, 1e7, 0.1}, Peer{0.005, 1e6, 0.06}}) {
      const Answer found = peer_answer(scene, file, peer);
      std::array<char, 96> setting{};
      (void)std::snprintf(setting.data(), setting.size(), "%g s; %g/s2; %g s", peer.step,
                          peer.stiffness, peer.seconds);
      if (!found.forces.empty())
        row(scene, "MuJoCo flex", 0, found.milliseconds,
            error_of(scene, found.forces, known.forces), setting.data(), "");
    }
  std::filesystem::remove_all(folder);
}

} // namespace

int main(int argc, char** argv) {
  std::puts("stage,program,nodes,contacts,threads,median_ms,error,measure,setting,theory_error");
  const auto [force, touched] = force_of_theory();
  const std::string only = argc > 1 ? argv[1] : "";
  if (only != "mujoco")
    bench({"pressed sphere",
           quarter(touched),
           {{0, 0, radius - depth / 2}, {0, 0, radius - depth}},
           1},
          force);
  Scene sliding{"sliding sphere", small_block(), {}, 1, 0.3};
  sliding.way = {{-1, 0, radius - depth / 2}, {-1, 0, radius - depth}};
  for (int k = 1; k <= 6; ++k)
    sliding.way.push_back({-1 + 0.05 * k, 0, radius - depth});
  if (only != "mujoco")
    bench(sliding, 0);
  if (only != "gewebe")
    bench_peer(sliding);
  return EXIT_SUCCESS;
}
