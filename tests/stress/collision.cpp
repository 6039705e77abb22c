// Strains distances and continuous collision detection of lib/collision by rational numbers:
// random pairs of a point and a triangle, and of two edges, in general position, on a coarse
// lattice (coplanar, parallel, touching, of no length or area), and nearly flat. Distances must be
// the exact ones to rounding; on the step found, no pair may touch or pass. Tells the largest error
// and times. Argument: number of pairs (default 1000000).

#include "collision/ccd.h"
#include "collision/distance.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/larger.h"
#include "tests/unit/rational_distance.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <utility>

namespace {

using namespace gewebe;
using test::along;
using test::cross;
using test::dot;
using test::exact;
using test::ExactQuad;
using test::minus;
using test::Number;
using test::of_edges;
using test::of_triangle;
using test::Vector;
using Quad = std::array<Vec3, 4>;

/// Six times the volume of the four points; 0 where they are coplanar.
Number exact_volume(const ExactQuad& x) {
  return dot(cross(minus(x[1], x[0]), minus(x[2], x[0])), minus(x[3], x[0]));
}

ExactQuad at(const Quad& x0, const Quad& x1, const Number& t) {
  ExactQuad x;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector from = exact(x0[k]);
    x[k] = along(from, t, minus(exact(x1[k]), from));
  }
  return x;
}

/// Whether the volume has no zero for a <= t <= b: its Bernstein coefficients there have one sign.
/// It is a cubic in t, given by four values.
bool never_coplanar(const Quad& x0, const Quad& x1, const Number& a, const Number& b) {
  const Number h = (b - a) / 3;
  const Number f0 = exact_volume(at(x0, x1, a)), f1 = exact_volume(at(x0, x1, a + h)),
               f2 = exact_volume(at(x0, x1, b - h)), f3 = exact_volume(at(x0, x1, b));
  const Number c1 = (-5 * f0 + 18 * f1 - 9 * f2 + 2 * f3) / 6,
               c2 = (2 * f0 - 9 * f1 + 18 * f2 - 5 * f3) / 6;
  const int s = sgn(f0);
  return s != 0 && sgn(c1) == s && sgn(c2) == s && sgn(f3) == s;
}

/// Whether the pair keeps apart on all of [a, b]: it is never coplanar, or in the middle further
/// apart than it can move from there; else both halves.
template <class Distance>
bool keeps_apart(const Quad& x0, const Quad& x1, const Number& a, const Number& b, double motion,
                 Distance&& distance, int depth = 0) {
  const Number middle = (a + b) / 2, half = (b - a) / 2;
  const Number way = half * Number(motion * (1 + 1e-10));
  if (Number(distance(at(x0, x1, middle))) > way * way)
    return true;
  if (never_coplanar(x0, x1, a, b))
    return true;
  if (depth > 45)
    return false;
  return keeps_apart(x0, x1, a, middle, motion, distance, depth + 1) &&
         keeps_apart(x0, x1, middle, b, motion, distance, depth + 1);
}

struct Tally {
  double error = 0; ///< of distances
  std::size_t passed = 0, stopped = 0, full = 0, stuck = 0;
};

template <class Exact, class Distance, class Step>
void look(const Quad& x0, const Quad& x1, std::size_t first, Tally& tally, Exact&& exact_distance,
          Distance&& distance, Step&& step_of) {
  const double true_distance = std::sqrt(exact_distance(exact(x0)).get_d());
  tally.error = test::larger(tally.error, std::abs(std::sqrt(distance(x0)) - true_distance));
  const double t = step_of(x0, x1);
  if (t == 0) {
    tally.stuck += true_distance > 1e-6;
    return;
  }
  (t < 1 ? tally.stopped : tally.full) += 1;
  double motion = 0; // of the distance over the whole way
  for (std::size_t i = 0; i < first; ++i)
    for (std::size_t j = first; j < 4; ++j)
      motion = test::larger(motion, norm(x1[i] - x0[i] - (x1[j] - x0[j])));
  tally.passed += !keeps_apart(x0, x1, 0, Number(t), motion, exact_distance);
}

} // namespace

int main(int count, char** words) {
  const long pairs = count > 1 ? std::strtol(words[1], nullptr, 10) : 1000000;
  if (pairs < 2) {
    (void)std::fputs("stress_collision: expected a number of pairs\n", stderr);
    return 2;
  }
  std::mt19937 random(20240701);
  Tally triangles, edges;
  const std::clock_t start = std::clock();
  for (long k = 0; k < pairs / 2; ++k) {
    const Quad x0 = test::random_pair<4>(random);
    Quad x1 = test::random_pair<4>(random);
    if (k % 2 == 0)
      for (std::size_t i = 0; i < 4; ++i)
        x1[i] = x0[i] + 0.2 * x1[i];
    const collision::Separation separation{.share = k % 3 == 0 ? 0.5 : 0.01};
    look(
        x0, x1, 1, triangles, of_triangle,
        [](const Quad& x) { return collision::point_triangle_squared_distance(x); },
        [&](const Quad& a, const Quad& b) {
          return collision::point_triangle_step(a, b, separation);
        });
    look(
        x0, x1, 2, edges, of_edges,
        [](const Quad& x) { return collision::edge_edge_squared_distance(x); },
        [&](const Quad& a, const Quad& b) { return collision::edge_edge_step(a, b, separation); });
  }
  bool good = true;
  for (const auto& [name, t] : {std::pair("point and triangle", triangles), {"edges", edges}}) {
    std::printf("%s: %zu full steps, %zu stopped, %zu stuck apart, %zu passed; error of distances "
                "%.2g\n",
                name, t.full, t.stopped, t.stuck, t.passed, t.error);
    good = good && t.passed == 0 && t.stuck == 0 && t.error < 1e-12;
  }
  std::printf("%ld pairs in %.0f s\n", pairs,
              static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  return good ? EXIT_SUCCESS : EXIT_FAILURE;
}
