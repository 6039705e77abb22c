// CSG of band volumes: what a band leaves away must not change the side of any voxel.

#include "csg_grids.h"
#include "density/density.h"
#include "density_scenes.h"

#include <gtest/gtest.h>

#include <optional>

namespace {

using namespace gewebe;
using namespace gewebe::test;

Grid scene(unsigned seed, std::optional<double> band) {
  DensityOptions options;
  options.info.transform = uniform_transform(0.5);
  options.band = band;
  if (band)
    options.info.isovalue = *band;
  return metaball_density({}, random_particles(12, 6, 5, {1, 2, 3}, seed), options);
}

/// Voxels of [-40, 40)³ whose values lie on different sides of `isovalue`.
int other_sides(const Grid& a, const Grid& b, float isovalue) {
  GridAccessor of_a(a), of_b(b);
  int count = 0;
  for (std::int32_t i = -40; i < 40; ++i)
    for (std::int32_t j = -40; j < 40; ++j)
      for (std::int32_t k = -40; k < 40; ++k)
        count += (of_a.value({i, j, k}) < isovalue) != (of_b.value({i, j, k}) < isovalue) ? 1 : 0;
  return count;
}

TEST(CsgBand, EveryVoxelKeepsItsSide) {
  using Op = CsgOperation;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Grid a = scene(seed, {}), b = scene(seed + 100, {});
    const Grid a_band = scene(seed, 0.5), b_band = scene(seed + 100, 0.5);
    ASSERT_GT(a.leaves().size(), a_band.leaves().size());
    for (const Op op : {Op::unite, Op::intersect, Op::difference, Op::exclusive_or}) {
      const Grid plain = combine(op, {a, b});
      EXPECT_EQ(other_sides(plain, combine(op, {a_band, b}), 0.5F), 0);
      EXPECT_EQ(other_sides(plain, combine(op, {a, b_band}), 0.5F), 0);
      EXPECT_EQ(other_sides(plain, combine(op, {a_band, b_band}), 0.5F), 0);
    }
  }
}

TEST(CsgBand, AtAnotherIsovalueSidesAreLost) {
  EXPECT_GT(other_sides(scene(1, {}), scene(1, 0.5), 0.9F), 0);
}

} // namespace
