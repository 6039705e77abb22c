// The narrow view of sparse volumes: transforms, leaves, tiles, access, figures.

#include "base/error.h"
#include "base/zero_pages.h"
#include "tests/unit/larger.h"
#include "volume/grid.h"
#include "volume/volume_stats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

using namespace gewebe;

TEST(GridTransform, InverseComesBack) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 200; ++n) {
    volume::GridTransform transform;
    for (double& value : transform.m)
      value = unit(random);
    if (std::fabs(transform.determinant()) < 0.05)
      continue;
    const Vec3 index{100 * unit(random), 100 * unit(random), 100 * unit(random)};
    EXPECT_LT(norm(transform.to_index(transform.to_world(index)) - index), 1e-10);
  }
}

TEST(GridTransform, CubicMeansEqualEdgesAtRightAngles) {
  EXPECT_TRUE(volume::uniform_transform(0.1).is_cubic());
  volume::GridTransform rotated;
  rotated.m = {0.6, -0.8, 0, 5, 0.8, 0.6, 0, 5, 0, 0, -1, 5}; // mirrored too
  EXPECT_TRUE(rotated.is_cubic());
  volume::GridTransform stretched = volume::uniform_transform(1);
  stretched.m[10] = 1.001;
  EXPECT_FALSE(stretched.is_cubic());
  volume::GridTransform sheared = volume::uniform_transform(1);
  sheared.m[1] = 0.001;
  EXPECT_FALSE(sheared.is_cubic());
  volume::GridTransform broken = volume::uniform_transform(1);
  broken.m[0] = NAN;
  EXPECT_FALSE(broken.is_cubic());
}

TEST(GridTransform, SameLatticeAllowsRoundingOnly) {
  const Int3 min{-1000, -1000, -1000};
  const Int3 max{1000, 1000, 1000};
  const volume::GridTransform a = volume::uniform_transform(0.1);
  volume::GridTransform b = a;
  b.m[3] = 1e-12;
  EXPECT_TRUE(volume::same_lattice(a, b, min, max));
  b.m[3] = 0.05;
  EXPECT_FALSE(volume::same_lattice(a, b, min, max));
  b = volume::uniform_transform(0.1 * (1 + 1e-8)); // 1e-5 voxels at the corners
  EXPECT_FALSE(volume::same_lattice(a, b, min, max));
}

TEST(Grid, BuildsAndAnswersForNegativeIndicesLeavesAndTiles) {
  volume::GridInfo info;
  info.transform = volume::uniform_transform(2);
  volume::GridBuilder builder(info);
  const std::vector<Int3> origins{{-8, -16, 0}, {0, 0, 0}};
  const std::vector<volume::LeafRef> refs = builder.add_leaves({}, origins);
  refs[0].values[volume::leaf_offset({-1, -9, 7})] = 3;
  refs[0].active[volume::leaf_offset({-1, -9, 7}) / 64] |=
      std::uint64_t{1} << (volume::leaf_offset({-1, -9, 7}) % 64);
  for (int n = 0; n < volume::leaf_voxels; ++n)
    refs[1].values[n] = 0.25F;
  for (int word = 0; word < 8; ++word)
    refs[1].active[word] = ~std::uint64_t{0};
  builder.add_tile({{128, 128, -128}, 128, 1, true});
  builder.add_tile({{4096, 0, 0}, 4096, 0.5F, true});
  const volume::Grid grid = builder.finish();

  EXPECT_EQ(grid.leaves().size(), 1U); // the constant, wholly active leaf became a tile
  EXPECT_EQ(grid.tiles().size(), 3U);
  volume::GridAccessor accessor(grid);
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
  volume::GridBuilder first(volume::GridInfo{});
  const Int3 origin{16, 0, -8};
  const volume::LeafRef leaf = first.add_leaves({}, {&origin, 1}).at(0);
  for (int n = 0; n < volume::leaf_voxels; ++n)
    leaf.values[n] = static_cast<float>(n);
  const volume::Grid a = first.finish();
  volume::GridBuilder second(volume::GridInfo{});
  second.share_leaf(a, a.leaves().at(0));
  const volume::Grid b = second.finish();
  EXPECT_EQ(a.digest(), b.digest());
  EXPECT_THROW(second.share_leaf(a, volume::LeafView{{80, 0, 0}, nullptr, nullptr}), Error);
}

TEST(VolumeStats, CountsLeavesAndTiles) {
  volume::GridInfo info;
  info.transform = volume::uniform_transform(0.5);
  volume::GridBuilder builder(info);
  builder.add_tile({{0, 0, 0}, 8, 1, true});
  builder.add_tile({{8, 0, 0}, 8, 0.25F, true});
  const volume::VolumeStats stats = volume::volume_stats({}, builder.finish());
  EXPECT_EQ(stats.active_voxels, 1024U);
  EXPECT_EQ(stats.inside_voxels, 512U);
  EXPECT_DOUBLE_EQ(stats.volume, 512 * 1.25 / 8);
  EXPECT_DOUBLE_EQ(stats.inside_volume, 64);
  EXPECT_EQ(stats.min, 0.25);
  EXPECT_EQ(stats.max, 1);
  EXPECT_EQ(stats.box.min, (Vec3{-0.25, -0.25, -0.25}));
  EXPECT_EQ(stats.box.max, (Vec3{7.75, 3.75, 3.75}));
  EXPECT_TRUE(volume::volume_stats({}, volume::Grid()).box.empty());
}

TEST(ZeroPages, AreZeroAlignedAndMovable) {
  for (const std::size_t bytes :
       {std::size_t{1}, std::size_t{5000}, std::size_t{2} << 20, std::size_t{5000000}}) {
    ZeroPages pages(bytes);
    ASSERT_GE(pages.size(), bytes);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(pages.data()) % 64, 0U);
    EXPECT_TRUE(std::all_of(pages.data(), pages.data() + pages.size(),
                            [](std::byte b) { return b == std::byte{0}; }));
    pages.data()[pages.size() - 1] = std::byte{7};
    EXPECT_TRUE(pages.holds(pages.data() + bytes - 1));
    EXPECT_FALSE(pages.holds(pages.data() + pages.size()));
    const ZeroPages taken = std::move(pages);
    EXPECT_EQ(taken.data()[taken.size() - 1], std::byte{7});
  }
  EXPECT_EQ(ZeroPages(0).data(), nullptr);
  EXPECT_THROW(ZeroPages(SIZE_MAX - 10), std::bad_alloc);
}

TEST(Grid, PruneMakesTilesOfConstantLeavesAndOfBlocksOfThem) {
  for (const float background : {0.0F, 2.0F}) {
    volume::GridInfo info;
    info.background = background;
    volume::GridBuilder builder(info);
    std::vector<Int3> origins;
    for (std::int32_t i = 0; i < 128; i += 8)
      for (std::int32_t j = 0; j < 128; j += 8)
        for (std::int32_t k = 0; k < 128; k += 8)
          origins.push_back({i, j, k});
    origins.insert(origins.end(), {{-8, 0, 0}, {-16, 0, 0}, {-24, 0, 0}});
    const std::vector<volume::LeafRef> refs = builder.add_leaves({}, origins);
    for (std::size_t n = 0; n < 4096; ++n) {
      std::fill_n(refs[n].values, volume::leaf_voxels, 0.5F);
      std::fill_n(refs[n].active, 8, ~std::uint64_t{0});
    }
    for (std::size_t n = 4096; n < refs.size(); ++n)
      EXPECT_EQ(refs[n].values[511], background);
    refs[4096].values[100] = 9;                 // one value
    refs[4097].active[3] = 1;                   // one active voxel, so it stays too
    const volume::Grid grid = builder.finish(); // the third of them is background
    EXPECT_EQ(grid.leaves().size(), 2U);
    ASSERT_EQ(grid.tiles().size(), 1U);
    EXPECT_EQ(grid.tiles()[0].dim, 128);
    EXPECT_EQ(grid.tiles()[0].value, 0.5F);
    EXPECT_TRUE(grid.tiles()[0].active);
    EXPECT_EQ(grid.active_voxels(), 128U * 128 * 128 + 1);
  }
}

TEST(Grid, SharedLeafOutlivesItsLender) {
  const Int3 origin{0, 0, 0};
  volume::GridBuilder builder(volume::GridInfo{});
  const float* place = nullptr;
  {
    volume::GridBuilder lender(volume::GridInfo{});
    const volume::LeafRef leaf = lender.add_leaves({}, {&origin, 1}).at(0);
    std::fill_n(leaf.values, volume::leaf_voxels, 0.75F);
    const volume::Grid lent = lender.finish(false);
    place = lent.leaves().at(0).values;
    builder.share_leaf(lent, lent.leaves().at(0));
  }
  const volume::Grid grid = builder.finish(false);
  EXPECT_EQ(grid.leaves().at(0).values, place); // not copied
  EXPECT_EQ(volume::GridAccessor(grid).value({3, 4, 5}), 0.75F);
}

/// Every figure against a plain loop over all voxels, for isovalues between and on single precision
/// numbers and both classes of volume.
TEST(VolumeStats, AgreesWithPlainSums) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(-1, 2);
  for (const bool level_set : {false, true})
    for (const double isovalue : {0.5, 0.1, -0.3, 1.0 / 3}) {
      volume::GridInfo info;
      info.isovalue = isovalue;
      info.level_set = level_set;
      info.transform = volume::uniform_transform(0.5);
      volume::GridBuilder builder(info);
      const std::vector<Int3> origins{{0, 0, 0}, {8, 0, -8}, {64, 0, 0}};
      double sum = 0;
      float min = 0.3F, max = 0.3F;
      std::uint64_t inside = 0;
      const auto count = [&](float v, std::uint64_t times) {
        sum += static_cast<double>(v) * static_cast<double>(times);
        const auto wide = static_cast<double>(v);
        inside += (level_set ? wide < isovalue : wide > isovalue) ? times : 0;
        min = test::smaller(min, v);
        max = test::larger(max, v);
      };
      for (const volume::LeafRef& leaf : builder.add_leaves({}, origins))
        for (int n = 0; n < volume::leaf_voxels; ++n) {
          leaf.values[n] = n % 5 == 0 ? static_cast<float>(isovalue) : value(random);
          count(leaf.values[n], 1);
        }
      builder.add_tile({{128, 0, 0}, 128, 0.3F, true});
      count(0.3F, std::uint64_t{128} * 128 * 128);
      const volume::VolumeStats stats = volume::volume_stats({}, builder.finish(false));
      EXPECT_EQ(stats.inside_voxels, inside);
      EXPECT_NEAR(stats.volume, sum / 8, 1e-12 * std::fabs(sum));
      EXPECT_EQ(stats.min, static_cast<double>(min));
      EXPECT_EQ(stats.max, static_cast<double>(max));
    }
}

TEST(Grid, SummaryTellsWhatValuesHaveInCommon) {
  const auto summary = [](const std::function<void(const volume::LeafRef&)>& change,
                          const volume::TileView& tile = {{8, 0, 0}, 8, 0.5F, true}) {
    volume::GridBuilder builder(volume::GridInfo{});
    const Int3 origin{0, 0, 0};
    const volume::LeafRef leaf = builder.add_leaves({}, {&origin, 1}).at(0);
    for (int n = 0; n < volume::leaf_voxels; ++n)
      leaf.values[n] = static_cast<float>(n + 1) / 1024;
    std::fill_n(leaf.active, 8, ~std::uint64_t{0});
    change(leaf);
    builder.add_tile(tile);
    return builder.finish(false).summary({});
  };
  const volume::ValueSummary plain = summary([](const volume::LeafRef&) {});
  EXPECT_TRUE(plain.finite && plain.active_where_not_0 && plain.varied_leaves);
  EXPECT_EQ(plain.min, 1.0F / 1024);
  EXPECT_EQ(plain.max, 0.5F);
  EXPECT_EQ(summary([](const volume::LeafRef& l) { l.values[77] = -3; }).min, -3);
  EXPECT_EQ(summary([](const volume::LeafRef& l) { l.values[77] = 3; }).max, 3);
  EXPECT_TRUE(std::signbit(summary([](const volume::LeafRef& l) { l.values[77] = -0.0F; }).min));
  EXPECT_FALSE(summary([](const volume::LeafRef& l) { l.values[77] = NAN; }).finite);
  EXPECT_FALSE(summary([](const volume::LeafRef& l) { l.values[77] = -NAN; }).finite);
  EXPECT_FALSE(summary([](const volume::LeafRef& l) { l.values[77] = -HUGE_VALF; }).finite);
  EXPECT_FALSE(summary([](const volume::LeafRef&) {}, {{8, 0, 0}, 8, NAN, true}).finite);
  EXPECT_FALSE(summary([](const volume::LeafRef& l) { l.values[77] = 0; }).active_where_not_0);
  EXPECT_FALSE(summary([](const volume::LeafRef& l) { l.active[3] = 1; }).active_where_not_0);
  EXPECT_FALSE(
      summary([](const volume::LeafRef&) {}, {{8, 0, 0}, 8, 0.5F, false}).active_where_not_0);
  EXPECT_FALSE(summary([](const volume::LeafRef&) {}, {{8, 0, 0}, 8, 0, true}).active_where_not_0);
  EXPECT_FALSE(summary([](const volume::LeafRef& l) {
                 std::fill_n(l.values, volume::leaf_voxels, 0.25F);
               }).varied_leaves);
}
