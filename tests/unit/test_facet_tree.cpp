// The tree that rays walk: each of its answers is that of a look at all facets, on every level.

#include "larger.h"
#include "shading/facet_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace gewebe::test {
namespace {

/// Of all facets one by one.
double nearest_of_all(const std::vector<shading::FacetCorners>& facets, const Vec3& from,
                      const Vec3& along, double most) {
  double nearest = most;
  for (const auto& [a, b, c] : facets) {
    const Vec3 edge1 = b - a, edge2 = c - a, p = cross(along, edge2), to = from - a;
    const double det = dot(edge1, p);
    if (det == 0)
      continue;
    const Vec3 q = cross(to, edge1);
    const double u = dot(to, p) / det, v = dot(along, q) / det, t = dot(edge2, q) / det;
    constexpr double slack = 1e-9;
    if (u >= -slack && u <= 1 + slack && v >= -slack && u + v <= 1 + slack && t > 0)
      nearest = test::smaller(nearest, t);
  }
  return nearest;
}

std::vector<CpuLevel> levels() {
  return best_cpu_level() == CpuLevel::baseline ? std::vector{CpuLevel::baseline}
                                                : std::vector{CpuLevel::baseline, CpuLevel::avx2};
}

std::vector<shading::FacetCorners> random_facets(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> place(-10, 10), near(-1, 1);
  std::vector<shading::FacetCorners> facets(count);
  for (auto& [a, b, c] : facets) {
    a = {place(random), place(random), place(random)};
    b = a + Vec3{near(random), near(random), near(random)};
    c = a + Vec3{near(random), near(random), near(random)};
  }
  return facets;
}

Vec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Vec3 v{normal(random), normal(random), normal(random)};
  return v / norm(v);
}

TEST(FacetTree, FindsWhatALookAtAllFinds) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-12, 12);
  int met = 0;
  for (const std::size_t count : {1u, 2u, 4u, 5u, 8u, 9u, 16u, 17u, 63u, 1000u}) {
    const std::vector<shading::FacetCorners> facets = random_facets(count, random);
    const shading::FacetTree tree = shading::facet_tree(facets);
    for (int n = 0; n < 500; ++n) {
      const Vec3 from{place(random), place(random), place(random)};
      const Vec3 along = random_direction(random);
      for (const double most : {3.0, HUGE_VAL}) {
        const double all = nearest_of_all(facets, from, along, most);
        met += all < most ? 1 : 0;
        for (const CpuLevel level : levels())
          ASSERT_EQ(shading::first_hit(level)(tree, from, along, most), all) << count << ' ' << n;
      }
    }
  }
  EXPECT_GT(met, 100);
}

// Unit squares of a grid: rays along an axis run in sides of boxes, where 0 · ∞ comes up.
TEST(FacetTree, RaysAlongAnAxisRunInSidesOfBoxes) {
  std::vector<shading::FacetCorners> facets;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const Vec3 o{static_cast<double>(x), static_cast<double>(y),
                   static_cast<double>((x + y) % 3)};
      facets.push_back({o, o + Vec3{1, 0, 0}, o + Vec3{1, 1, 0}});
      facets.push_back({o, o + Vec3{1, 1, 0}, o + Vec3{0, 1, 0}});
    }
  const shading::FacetTree tree = shading::facet_tree(facets);
  int met = 0;
  for (int x = 0; x <= 16; ++x)
    for (int y = 0; y <= 16; ++y)
      for (const double sign : {1.0, -1.0}) {
        const Vec3 from{x / 2.0, y / 2.0, -5 * sign}, along{0, 0, sign};
        const double all = nearest_of_all(facets, from, along, 100);
        met += all < 100 ? 1 : 0;
        for (const CpuLevel level : levels())
          ASSERT_EQ(shading::first_hit(level)(tree, from, along, 100), all)
              << x << ' ' << y << ' ' << sign;
      }
  EXPECT_EQ(met, 2 * 17 * 17);
}

TEST(FacetTree, NothingIsMetWhereNothingIs) {
  const shading::FacetTree none = shading::facet_tree({});
  const shading::FacetTree point = shading::facet_tree(
      std::vector<shading::FacetCorners>(9, shading::FacetCorners{})); // no area
  for (const CpuLevel level : levels()) {
    EXPECT_EQ(shading::first_hit(level)(none, {}, {1, 0, 0}, 7), 7);
    EXPECT_EQ(shading::first_hit(level)(point, {-1, 0, 0}, {1, 0, 0}, 7), 7);
  }
}

} // namespace
} // namespace gewebe::test
