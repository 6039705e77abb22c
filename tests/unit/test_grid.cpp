// The narrow view of sparse volumes: transforms, leaves, tiles, access, figures.

#include "base/error.h"
#include "volume/grid.h"
#include "volume/volume_stats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace gewebe;

TEST(GridTransform, InverseComesBack) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 200; ++n) {
    GridTransform transform;
    for (double& value : transform.m)
      value = unit(random);
    if (std::fabs(transform.determinant()) < 0.05)
      continue;
    const Vec3 index{100 * unit(random), 100 * unit(random), 100 * unit(random)};
    EXPECT_LT(norm(transform.to_index(transform.to_world(index)) - index), 1e-10);
  }
}

TEST(GridTransform, CubicMeansEqualEdgesAtRightAngles) {
  EXPECT_TRUE(uniform_transform(0.1).is_cubic());
  GridTransform rotated;
  rotated.m = {0.6, -0.8, 0, 5, 0.8, 0.6, 0, 5, 0, 0, -1, 5}; // mirrored too
  EXPECT_TRUE(rotated.is_cubic());
  GridTransform stretched = uniform_transform(1);
  stretched.m[10] = 1.001;
  EXPECT_FALSE(stretched.is_cubic());
  GridTransform sheared = uniform_transform(1);
  sheared.m[1] = 0.001;
  EXPECT_FALSE(sheared.is_cubic());
  GridTransform broken = uniform_transform(1);
  broken.m[0] = NAN;
  EXPECT_FALSE(broken.is_cubic());
}

TEST(GridTransform, SameLatticeAllowsRoundingOnly) {
  const Int3 min{-1000, -1000, -1000};
  const Int3 max{1000, 1000, 1000};
  const GridTransform a = uniform_transform(0.1);
  GridTransform b = a;
  b.m[3] = 1e-12;
  EXPECT_TRUE(same_lattice(a, b, min, max));
  b.m[3] = 0.05;
  EXPECT_FALSE(same_lattice(a, b, min, max));
  b = uniform_transform(0.1 * (1 + 1e-8)); // 1e-5 voxels at the corners
  EXPECT_FALSE(same_lattice(a, b, min, max));
}

TEST(Grid, BuildsAndAnswersForNegativeIndicesLeavesAndTiles) {
  GridInfo info;
  info.transform = uniform_transform(2);
  GridBuilder builder(info);
  const std::vector<Int3> origins{{-8, -16, 0}, {0, 0, 0}};
  const std::vector<LeafRef> refs = builder.add_leaves({}, origins);
  refs[0].values[leaf_offset({-1, -9, 7})] = 3;
  refs[0].active[leaf_offset({-1, -9, 7}) / 64] |= std::uint64_t{1}
                                                   << (leaf_offset({-1, -9, 7}) % 64);
  for (int n = 0; n < leaf_voxels; ++n)
    refs[1].values[n] = 0.25F;
  for (int word = 0; word < 8; ++word)
    refs[1].active[word] = ~std::uint64_t{0};
  builder.add_tile({{128, 128, -128}, 128, 1, true});
  builder.add_tile({{4096, 0, 0}, 4096, 0.5F, true});
  const Grid grid = builder.finish();

  EXPECT_EQ(grid.leaves().size(), 1U); // the constant, wholly active leaf became a tile
  EXPECT_EQ(grid.tiles().size(), 3U);
  GridAccessor accessor(grid);
  EXPECT_EQ(accessor.value({-1, -9, 7}), 3);
  EXPECT_EQ(accessor.value({-1, -9, 6}), 0);
  EXPECT_EQ(accessor.value({7, 7, 7}), 0.25F);
  EXPECT_EQ(accessor.value({8, 7, 7}), 0);
  EXPECT_EQ(accessor.value({255, 255, -1}), 1);
  EXPECT_EQ(accessor.value({8191, 4095, 4095}), 0.5F);
  float tile = -1;
  EXPECT_EQ(accessor.leaf_at({200, 200, -50}, tile).values, nullptr);
  EXPECT_EQ(tile, 1);
  const std::uint64_t k4096 = 4096;
  EXPECT_EQ(grid.active_voxels(), 1 + 512 + 128 * 128 * 128 + k4096 * k4096 * k4096);
}

TEST(Grid, SharedLeafKeepsItsValues) {
  GridBuilder first(GridInfo{});
  const Int3 origin{16, 0, -8};
  const LeafRef leaf = first.add_leaves({}, {&origin, 1}).at(0);
  for (int n = 0; n < leaf_voxels; ++n)
    leaf.values[n] = static_cast<float>(n);
  const Grid a = first.finish();
  GridBuilder second(GridInfo{});
  second.share_leaf(a, a.leaves().at(0));
  const Grid b = second.finish();
  EXPECT_EQ(a.digest(), b.digest());
  EXPECT_THROW(second.share_leaf(a, LeafView{{80, 0, 0}, nullptr, nullptr}), Error);
}

TEST(VolumeStats, CountsLeavesAndTiles) {
  GridInfo info;
  info.transform = uniform_transform(0.5);
  GridBuilder builder(info);
  builder.add_tile({{0, 0, 0}, 8, 1, true});
  builder.add_tile({{8, 0, 0}, 8, 0.25F, true});
  const VolumeStats stats = volume_stats({}, builder.finish());
  EXPECT_EQ(stats.active_voxels, 1024U);
  EXPECT_EQ(stats.inside_voxels, 512U);
  EXPECT_DOUBLE_EQ(stats.volume, 512 * 1.25 / 8);
  EXPECT_DOUBLE_EQ(stats.inside_volume, 64);
  EXPECT_EQ(stats.min, 0.25);
  EXPECT_EQ(stats.max, 1);
  EXPECT_EQ(stats.box.min, (Vec3{-0.25, -0.25, -0.25}));
  EXPECT_EQ(stats.box.max, (Vec3{7.75, 3.75, 3.75}));
  EXPECT_TRUE(volume_stats({}, Grid()).box.empty());
}
