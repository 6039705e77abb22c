// Strains solids in motion: random small bodies of either law and order, nu up to 0.49, E over
// four decades, that are thrown, loaded, held and let go in steps of 1e-5 to 1 s, some with damping
// and drag, some with fewer rounds than they want.
//
// Of every step: energy (of motion, of elements and of the load) doesn't grow, by more than 1e-10
// of what it is made of, where nothing moved held nodes; a body that is held nowhere has the
// momentum that load and drag leave it, to 1e-9 of the sum over its nodes; no number is lost.
//
// Argument: number of bodies (default 1500, of 40 steps).

#include "integrator/solid_motion.h"
#include "tests/stress/motion_bodies.h"
#include "tests/unit/larger.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <random>
#include <string_view>
#include <vector>

namespace {

using namespace gewebe;
using namespace gewebe::test;
using Numbers = std::vector<double>;

constexpr int steps_of_body = 40;
constexpr double energy_tolerance = 1e-10, momentum_tolerance = 1e-9;

std::vector<std::uint8_t> held_end(const tetrahedra::TetMesh& mesh) {
  std::vector<std::uint8_t> held;
  for (const Vec3& p : mesh.points)
    held.insert(held.end(), 3, p.x == 0 ? 1 : 0);
  return held;
}

double energy(const integrator::SolidMotion& body) {
  return body.kinetic_energy() + body.potential_energy();
}

struct Momentum {
  Vec3 sum;
  double size = 0; ///< of its parts
};
Momentum momentum(const integrator::SolidMotion& body) {
  Momentum all;
  for (std::size_t i = 0; i < body.masses().size(); ++i) {
    const auto v = body.velocity().subspan(3 * i, 3);
    const Vec3 part = body.masses()[i] * Vec3{v[0], v[1], v[2]};
    all.sum += part;
    all.size += norm(part);
  }
  return all;
}

struct Totals {
  std::uint64_t bodies = 0, steps = 0, limited = 0, unfinished = 0, failed = 0;
  double growth = 0, momentum = 0; ///< largest, over what they are made of
};

/// A body with what acts on it.
struct Thrown {
  Kind kind;
  tetrahedra::TetMesh mesh;
  integrator::SolidMotionOptions options;
  integrator::SolidMotion body;
  std::vector<std::uint8_t> held;
  Numbers load;
  double size = 0; ///< of forces on an axis
  /// What rounding of strains and of places is told against.
  double rest_energy = 0, rest_momentum = 0;

  Thrown(Chance& chance, const Kind& of)
      : Thrown(chance, of, some_mesh(chance, of), some(chance, of)) {}

  /// Something else acts from now on.
  void change(Chance& chance) {
    const std::size_t axes = held.size();
    switch (chance.random() % 4) {
    case 0:
      std::ranges::fill(load, 0.0);
      break;
    case 1:
      load = chance.numbers(axes, size);
      break;
    case 2:
      held = chance.one_in(2) ? held_end(mesh) : std::vector<std::uint8_t>(axes);
      body.hold(held);
      break;
    default:
      body.set_state(chance.numbers(axes, 0.1 * body_cell),
                     chance.numbers(axes, chance.over_decades(1, 1000)));
      body.hold(held); // what is held doesn't move
    }
    body.set_load(load);
  }
  bool any_held() const {
    return std::ranges::any_of(held, [](std::uint8_t h) { return h != 0; });
  }

private:
  static integrator::SolidMotionOptions some(Chance& chance, const Kind& kind) {
    integrator::SolidMotionOptions options;
    options.law = kind.law;
    options.drag = chance.one_in(3) ? chance.over_decades(0.1, 100) : 0;
    options.damping = chance.one_in(3) ? chance.over_decades(1e-4, 0.1) : 0;
    options.tolerance = chance.over_decades(1e-6, 0.1);
    options.max_rounds = 1 + static_cast<int>(chance.random() % 10);
    return options;
  }
  Thrown(Chance& chance, const Kind& of, tetrahedra::TetMesh shape,
         const integrator::SolidMotionOptions& with)
      : Thrown(of, std::move(shape), with, chance.over_decades(1e2, 1e6),
               std::array{0.0, 0.3, 0.45, 0.49}.at(chance.random() % 4)) {}
  Thrown(const Kind& of, tetrahedra::TetMesh shape, const integrator::SolidMotionOptions& with,
         double young, double poisson)
      : kind(of), mesh(std::move(shape)), options(with),
        body(mesh, std::vector<fem::SolidMaterial>{{young, poisson, 1e-3}}, options),
        held(3 * mesh.points.size()), load(held.size()) {
    double mass = 0;
    for (const double m : body.masses())
      mass += m;
    size = 1e5 * mass / static_cast<double>(mesh.points.size());
    rest_energy = 1e-3 * young * mass / 1e-3;
    rest_momentum = 1e-2 * body_cell * mass;
  }
};

void throw_body(std::uint32_t seed, Totals& totals) {
  Chance chance{std::mt19937(seed)};
  Thrown t(chance, kinds[seed % 64 == 63 ? 3 : seed % 3]); // the slow ones seldom
  integrator::SolidMotion& body = t.body;
  ++totals.bodies;
  double h = chance.over_decades(1e-5, 1);
  for (int n = 0; n < (t.kind.slow() ? steps_of_body / 8 : steps_of_body); ++n) {
    const auto far = [](double x) { return std::abs(x) > 1e4 * body_cell; };
    if (std::ranges::any_of(body.places(), far)) // where rounding of places would be judged
      body.set_state(Numbers(t.held.size()), Numbers(t.held.size()));
    if (n % 8 == 0)
      t.change(chance);
    if (chance.one_in(20))
      h = chance.over_decades(1e-5, 1);
    const bool led = t.any_held() && chance.one_in(20);
    if (led) {
      Numbers target = body.displacement();
      for (double& u : target)
        u += chance.from(-0.05, 0.05) * body_cell;
      body.move_held(target);
    }
    const double before = energy(body);
    const Momentum was = momentum(body);
    const integrator::SolidStep step = body.step(h, {});
    ++totals.steps;
    totals.limited += step.limited ? 1 : 0;
    totals.unfinished += step.left <= t.options.tolerance ? 0 : 1;
    const double work = body.elastic_energy() - body.potential_energy(), after = energy(body);
    const double scale = t.rest_energy + std::abs(before) + body.kinetic_energy() +
                         body.elastic_energy() + std::abs(work) + std::abs(before + work);
    const double growth = led ? 0 : (after - before) / scale;
    double off = 0;
    if (!t.any_held()) {
      const Momentum is = momentum(body);
      Vec3 expected = was.sum;
      double pushed = 0;
      for (std::size_t axis = 0; axis < t.load.size(); ++axis) {
        expected[static_cast<int>(axis % 3)] += h * t.load[axis];
        pushed += h * std::abs(t.load[axis]);
      }
      expected = 1 / (1 + t.options.drag * h) * expected;
      off = norm(is.sum - expected) / (was.size + is.size + pushed + t.rest_momentum / h);
    }
    totals.growth = test::larger(totals.growth, growth);
    totals.momentum = test::larger(totals.momentum, off);
    if (sound(body.places()) && sound(body.velocity()) && growth <= energy_tolerance &&
        off <= momentum_tolerance)
      continue;
    ++totals.failed;
    std::printf(
        "body %u (%s), step %d of %g s: FAILED (energy grows by %.3g of its parts, momentum "
        "is off by %.3g)\n",
        seed, t.kind.name(), n, h, growth, off);
    return;
  }
}

int run(std::uint32_t bodies) {
  Totals totals;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  for (std::uint32_t seed = 0; seed < bodies; ++seed)
    throw_body(seed, totals);
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf(
      "%llu bodies, %llu steps (%llu limited, %llu unfinished): energy grew by at most %.3g "
      "of its parts, momentum was off by %.3g; %llu failed\n",
      number(totals.bodies), number(totals.steps), number(totals.limited),
      number(totals.unfinished), totals.growth, totals.momentum, number(totals.failed));
  return totals.failed == 0 ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  std::uint32_t count = 1500;
  if (argc > 1) {
    const std::string_view text = argv[1];
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), count);
    if (argc > 2 || parsed.ec != std::errc() || parsed.ptr != text.data() + text.size() ||
        count < 1) {
      (void)std::fputs("stress_solid_motion: expected a number of bodies\n", stderr);
      return 2;
    }
  }
  try {
    return run(count);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "stress_solid_motion: %s\n", error.what());
    return 1;
  }
}
