// The factor with entries of 16 bits against the factor.

#include "fem/assembly.h"
#include "linalg/factor.h"
#include "linalg/single_factor.h"
#include "tests/unit/larger.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace gewebe::test {
namespace {

TEST(SingleFactor, SolvesAsTheFactorDoesWithTheSameBytesEverywhere) {
  for (const unsigned n : {1U, 4U, 9U}) {
    const tetrahedra::TetMesh mesh = test::box_tetrahedra(n, n, n + 3, 2);
    const std::vector<fem::SolidElement> elements =
        fem::solid_elements(mesh, std::vector<fem::SolidMaterial>{{2500, 0.3, 1e-3}});
    std::vector<std::uint8_t> fixed(3 * mesh.points.size());
    fixed[0] = fixed[1] = fixed[2] = fixed[5] = 1;
    linalg::StiffnessMatrix k = fem::solid_stiffness(mesh, elements, fixed);
    for (std::size_t c = 0; c < k.order(); ++c)
      k.value[static_cast<std::size_t>(k.column_start[c])] += 3000;
    const linalg::Factor factor(k, {});
    std::mt19937 random(n);
    std::uniform_real_distribution<double> value(-1, 1);
    std::vector<double> f(k.order()), exact(k.order());
    for (double& x : f)
      x = value(random);
    factor.solve(f, exact);
    const auto solve = [&](int threads, CpuLevel cpu) {
      Context context;
      context.threads = threads;
      context.cpu = cpu;
      linalg::SingleFactor single(factor);
      std::vector<double> x = f;
      single.solve(x, context);
      x = f; // again, for nothing of the first time may be left
      single.solve(x, context);
      return x;
    };
    const std::vector<double> x = solve(1, CpuLevel::baseline);
    double off = 0, whole = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      off = test::larger(off, std::abs(x[i] - exact[i]));
      whole = test::larger(whole, std::abs(exact[i]));
    }
    EXPECT_LT(off, 1e-4 * whole);
    // Entries have 16 bits: what is left over is solved as well.
    std::vector<double> left(x.size());
    linalg::SingleFactor single(factor);
    std::vector<double> better = x;
    for (int round = 0; round < 3; ++round) {
      left = f;
      for (std::size_t c = 0; c < k.order(); ++c)
        for (auto e = static_cast<std::size_t>(k.column_start[c]);
             e < static_cast<std::size_t>(k.column_start[c + 1]); ++e) {
          const auto r = static_cast<std::size_t>(k.row[e]);
          left[r] -= k.value[e] * better[c];
          if (r != c)
            left[c] -= k.value[e] * better[r];
        }
      single.solve(left, {});
      for (std::size_t i = 0; i < left.size(); ++i)
        better[i] += left[i];
    }
    double still = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      still = test::larger(still, std::abs(better[i] - exact[i]));
    EXPECT_LT(still, 1e-11 * whole);
    EXPECT_EQ(x, solve(2, CpuLevel::baseline));
    EXPECT_EQ(x, solve(1, best_cpu_level()));
    EXPECT_EQ(x, solve(2, best_cpu_level()));
  }
}

} // namespace
} // namespace gewebe::test
