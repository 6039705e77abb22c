// CSG of band volumes: what a band leaves away must not change the side of any voxel.

#include "csg_grids.h"
#include "density/density.h"
#include "density_scenes.h"

#include <gtest/gtest.h>

#include <optional>

namespace {

using namespace gewebe;
using namespace gewebe::test;

volume::Grid random_scene(unsigned seed, std::optional<double> band) {
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(0.5);
  options.band = band;
  if (band)
    options.info.isovalue = *band;
  return density::metaball_density({}, random_particles(12, 6, 5, {1, 2, 3}, seed), options);
}

/// Voxels of [-40, 40)³ whose values lie on different sides of `isovalue`.
int other_sides(const volume::Grid& a, const volume::Grid& b, float isovalue) {
  volume::GridAccessor of_a(a), of_b(b);
  int count = 0;
  for (std::int32_t i = -40; i < 40; ++i)
    for (std::int32_t j = -40; j < 40; ++j)
      for (std::int32_t k = -40; k < 40; ++k)
        count += (of_a.value({i, j, k}) < isovalue) != (of_b.value({i, j, k}) < isovalue) ? 1 : 0;
  return count;
}

TEST(CsgBand, EveryVoxelKeepsItsSide) {
  using Op = volume::CsgOperation;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const volume::Grid a = random_scene(seed, {}), b = random_scene(seed + 100, {});
    const volume::Grid a_band = random_scene(seed, 0.5), b_band = random_scene(seed + 100, 0.5);
    ASSERT_GT(a.leaves().size(), a_band.leaves().size());
    for (const Op op : {Op::unite, Op::intersect, Op::difference, Op::exclusive_or}) {
      const volume::Grid plain = combine(op, {a, b});
      EXPECT_EQ(other_sides(plain, combine(op, {a_band, b}), 0.5F), 0);
      EXPECT_EQ(other_sides(plain, combine(op, {a, b_band}), 0.5F), 0);
      EXPECT_EQ(other_sides(plain, combine(op, {a_band, b_band}), 0.5F), 0);
    }
  }
}

TEST(CsgBand, AtAnotherIsovalueSidesAreLost) {
  EXPECT_GT(other_sides(random_scene(1, {}), random_scene(1, 0.5), 0.9F), 0);
}

} // namespace
