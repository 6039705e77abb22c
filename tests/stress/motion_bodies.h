#pragma once
// Bodies of the programs of tests/stress that move solids, and of unit tests of what they found.

#include "integrator/solid_motion.h"
#include "tests/unit/larger.h"
#include "tests/unit/tet_fixtures.h"
#include "tetrahedra/order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace gewebe::test {

constexpr double body_cell = 5; // mm

struct Chance {
  std::mt19937 random;

  double from(double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
  }
  double over_decades(double low, double high) {
    return std::exp(from(std::log(low), std::log(high)));
  }
  bool one_in(std::uint32_t n) { return random() % n == 0; }
  std::vector<double> numbers(std::size_t count, double by) {
    std::vector<double> all(count);
    for (double& one : all)
      one = from(-by, by);
    return all;
  }
};

struct Kind {
  integrator::SolidLaw law;
  bool quadratic;

  bool slow() const { return law != integrator::SolidLaw::corotational && quadratic; }
  const char* name() const {
    return law == integrator::SolidLaw::corotational
               ? quadratic ? "corotational quadratic" : "corotational"
           : quadratic ? "Neo-Hookean quadratic"
                       : "Neo-Hookean";
  }
};
constexpr std::array<Kind, 4> kinds = {{{integrator::SolidLaw::corotational, false},
                                        {integrator::SolidLaw::corotational, true},
                                        {integrator::SolidLaw::hyperelastic, false},
                                        {integrator::SolidLaw::hyperelastic, true}}};

/// A box whose inner nodes, and those of its faces within them, are shifted.
inline tetrahedra::TetMesh some_mesh(Chance& chance, const Kind& kind) {
  const std::uint32_t most = kind.slow() ? 1 : kind.quadratic ? 2 : 3;
  std::array<std::uint32_t, 3> size{};
  for (std::uint32_t& n : size)
    n = 1 + static_cast<std::uint32_t>(chance.random()) % most;
  tetrahedra::TetMesh mesh = box_tetrahedra(size[0], size[1], size[2], body_cell);
  for (Vec3& p : mesh.points)
    for (int a = 0; a < 3; ++a)
      if (p[a] > 0 && p[a] < body_cell * size[static_cast<std::size_t>(a)])
        p[a] += chance.from(-0.15, 0.15) * body_cell;
  if (kind.quadratic)
    tetrahedra::make_quadratic(mesh);
  return mesh;
}

inline bool sound(std::span<const double> numbers) {
  return std::ranges::all_of(numbers, [](double n) { return std::isfinite(n); });
}

/// How many tetrahedra are inside out, or flat, by their corners.
inline int inverted(const tetrahedra::TetMesh& mesh, std::span<const double> x) {
  int count = 0;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    std::array<Vec3, 4> p;
    for (std::size_t k = 0; k < 4; ++k)
      p[k] = {x[3 * std::size_t{t[k]}], x[3 * std::size_t{t[k]} + 1], x[3 * std::size_t{t[k]} + 2]};
    count += tetrahedra::tetrahedron_volume(p[0], p[1], p[2], p[3]) > 0 ? 0 : 1;
  }
  return count;
}

/// A body whose nodes are anywhere in its box.
struct Scrambled {
  tetrahedra::TetMesh mesh;
  fem::SolidMaterial material;
  integrator::SolidMotionOptions options;
  std::vector<double> displacement; ///< 3 n
};

/// That of the seed; nu is 0, 0.3, 0.45, 0.49 in turn.
inline Scrambled scrambled(std::uint32_t seed, const Kind& kind) {
  Chance chance{std::mt19937(1000000 + seed)};
  Scrambled body{some_mesh(chance, kind), {2e4, 0, 1e-3}, {}, {}};
  body.material.poisson = std::array{0.0, 0.3, 0.45, 0.49}.at(seed % 4);
  body.options.law = kind.law;
  Vec3 most;
  for (const Vec3& p : body.mesh.points)
    for (int a = 0; a < 3; ++a)
      most[a] = numeric::larger(most[a], p[a]);
  for (const Vec3& p : body.mesh.points)
    for (int a = 0; a < 3; ++a)
      body.displacement.push_back(chance.from(0, most[a]) - p[a]);
  return body;
}

} // namespace gewebe::test
