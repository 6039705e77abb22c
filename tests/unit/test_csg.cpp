// CSG: identities, mixtures of tiles and leaves against dense arrays, refusals.

#include "base/error.h"
#include "csg_grids.h"
#include "larger.h"
#include "mesh_fixtures.h"
#include "tests/unit/complaint.h"
#include "volume/lattice.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

namespace {

using namespace gewebe;
using namespace gewebe::test;
using Op = volume::CsgOperation;

constexpr std::array all_operations{Op::add,       Op::subtract,   Op::unite,
                                    Op::intersect, Op::difference, Op::exclusive_or};

volume::Grid voxelized_ball(double radius, const Vec3& center, int samples = 1) {
  return voxelization::voxelize(Context{}, sphere_mesh(3, radius, center),
                                volume::uniform_transform(1), {.samples = samples});
}

/// What csg(1) says of a voxel, once more and without cleverness.
float expected_value(Op operation, const std::vector<float>& v) {
  const auto clamp = [](float x) { return std::min(1.0f, std::max(0.0f, x)); };
  const bool sum = operation == Op::add || operation == Op::subtract;
  float a = sum ? v[0] : clamp(v[0]);
  for (std::size_t n = 1; n < v.size(); ++n) {
    const float b = clamp(v[n]);
    switch (operation) {
    case Op::add:
      a = a + v[n];
      break;
    case Op::subtract:
      a = a - v[n];
      break;
    case Op::unite:
      a = test::larger(a, b);
      break;
    case Op::intersect:
      a = test::smaller(a, b);
      break;
    case Op::difference:
      a = test::smaller(a, 1 - b);
      break;
    case Op::exclusive_or:
      a = std::max(std::min(a, 1 - b), std::min(1 - a, b));
      break;
    }
  }
  return std::max(a, 0.0f);
}

void expect_dense_equal(Op operation, const std::vector<volume::Grid>& grids,
                        const volume::Grid& result, std::int32_t reach, bool everything = true) {
  std::vector<volume::GridAccessor> in;
  for (const volume::Grid& grid : grids)
    in.emplace_back(grid);
  volume::GridAccessor out(result);
  std::uint64_t active = 0;
  std::vector<float> v(grids.size());
  for (std::int32_t i = -reach; i < reach; ++i)
    for (std::int32_t j = -reach; j < reach; ++j)
      for (std::int32_t k = -reach; k < reach; ++k) {
        for (std::size_t g = 0; g < grids.size(); ++g)
          v[g] = in[g].value({i, j, k});
        const float expected = expected_value(operation, v);
        active += expected != 0;
        ASSERT_EQ(out.value({i, j, k}), expected);
      }
  if (everything) {
    EXPECT_EQ(result.active_voxels(), active);
  }
}

TEST(Csg, MixturesOfTilesAndLeavesAgainstDenseArrays) {
  std::mt19937 random(1);
  for (int n = 0; n < 6; ++n) {
    const std::vector<volume::Grid> grids{random_grid(random), random_grid(random),
                                          random_grid(random)};
    for (const Op operation : all_operations) {
      expect_dense_equal(operation, {grids[0], grids[1]}, combine(operation, {grids[0], grids[1]}),
                         20);
      expect_dense_equal(operation, grids, combine(operation, grids), 20);
    }
  }
}

TEST(Csg, LargeTilesAreSplitOnlyWhereNeeded) {
  const auto with_tiles = [](std::initializer_list<volume::TileView> tiles) {
    volume::GridBuilder builder{volume::GridInfo{}};
    for (const volume::TileView& tile : tiles)
      builder.add_tile(tile);
    return builder.finish(false);
  };
  const volume::Grid huge = with_tiles({{{0, 0, 0}, 4096, 0.75f, true}});
  const volume::Grid large = with_tiles({{{128, 0, 0}, 128, 0.5f, true}});
  const volume::Grid small = with_tiles({{{136, 8, 8}, 8, 1.0f, true}});
  volume::CsgReport report;
  const volume::Grid a = combine(Op::difference, {huge, large, small}, &report);
  volume::GridAccessor value(a);
  EXPECT_EQ(value.value({5, 5, 5}), 0.75f);
  EXPECT_EQ(value.value({4095, 4095, 4095}), 0.75f);
  EXPECT_EQ(value.value({-1, 0, 0}), 0.0f);
  EXPECT_EQ(value.value({128, 127, 127}), 0.5f);
  EXPECT_EQ(value.value({140, 12, 12}), 0.0f);
  EXPECT_EQ(value.value({136, 8, 7}), 0.5f);
  EXPECT_EQ(a.active_voxels(), 68719476736u - 512u);
  EXPECT_EQ(report.tiles_combined, 32767u + 4096u);
  EXPECT_EQ(combine(Op::add, {huge, huge}, &report).active_voxels(), 68719476736u);
  EXPECT_EQ(report.tiles_combined, 1u);
}

TEST(Csg, LargeTilesAgainstLeaves) {
  const volume::Grid block = voxelization::voxelize(
      Context{}, box_mesh({-128, -128, -128}, {128, 128, 128}), volume::uniform_transform(1), {});
  const volume::Grid grey = voxelized_ball(20, {0.1, 0.2, 0.3}, 3);
  for (const Op operation : all_operations)
    expect_dense_equal(operation, {block, grey}, combine(operation, {block, grey}), 32,
                       /*everything=*/false);
}

TEST(Csg, Identities) {
  const volume::Grid a = voxelized_ball(14, {0.1, 0.2, 0.3}), b = voxelized_ball(11, {6, -3, 2}),
                     nothing = volume::Grid();
  const volume::Grid grey = voxelized_ball(9, {1, 1, 1}, 4);
  const auto same = [](const volume::Grid& x, const volume::Grid& y) {
    return x.digest() == y.digest();
  };
  EXPECT_TRUE(same(combine(Op::unite, {a, a}), a));
  EXPECT_TRUE(same(combine(Op::unite, {grey, grey}), grey));
  EXPECT_TRUE(same(combine(Op::intersect, {grey, grey}), grey));
  EXPECT_TRUE(same(combine(Op::unite, {grey, nothing}), grey));
  EXPECT_TRUE(same(combine(Op::add, {grey, nothing}), grey));
  EXPECT_EQ(combine(Op::difference, {a, a}).active_voxels(), 0u);
  EXPECT_EQ(combine(Op::exclusive_or, {a, a}).active_voxels(), 0u);
  EXPECT_EQ(combine(Op::subtract, {grey, grey}).active_voxels(), 0u);
  EXPECT_EQ(combine(Op::intersect, {a, nothing}).active_voxels(), 0u);
  EXPECT_TRUE(same(combine(Op::add, {a, grey}), combine(Op::add, {grey, a})));
  EXPECT_TRUE(same(combine(Op::unite, {a, grey}), combine(Op::unite, {grey, a})));
  // On values 0 and 1: A xor B = (A ∪ B) ∖ (A ∩ B), A ∖ B = A ∖ (A ∩ B), A ∪ B = A + (B ∖ A).
  const volume::Grid both = combine(Op::intersect, {a, b}), either = combine(Op::unite, {a, b});
  EXPECT_TRUE(same(combine(Op::exclusive_or, {a, b}), combine(Op::difference, {either, both})));
  EXPECT_TRUE(same(combine(Op::difference, {a, b}), combine(Op::difference, {a, both})));
  EXPECT_TRUE(same(either, combine(Op::add, {a, combine(Op::difference, {b, a})})));
  EXPECT_EQ(either.active_voxels() + both.active_voxels(), a.active_voxels() + b.active_voxels());
  EXPECT_FALSE(same(combine(Op::difference, {a, b}), combine(Op::difference, {b, a}))); // control
}

TEST(Csg, ClampsOnceAtTheEnd) {
  volume::GridBuilder builder{volume::GridInfo{}};
  builder.add_tile({{0, 0, 0}, 8, 0.25f, true});
  const volume::Grid low = builder.finish(false);
  volume::GridBuilder other{volume::GridInfo{}};
  other.add_tile({{0, 0, 0}, 8, 1.0f, true});
  const volume::Grid one = other.finish(false);
  const volume::Grid negative = combine(Op::subtract, {low, one});
  EXPECT_EQ(negative.active_voxels(), 0u); // clamped, so nothing is left
  volume::GridBuilder minus{volume::GridInfo{}};
  minus.add_tile({{0, 0, 0}, 8, -1.0f, true});
  // 0.25 - 1 - (-1) = 0.25: in between nothing is clamped.
  const volume::Grid back = combine(Op::subtract, {low, one, minus.finish(false)});
  volume::GridAccessor value(back);
  EXPECT_EQ(value.value({3, 3, 3}), 0.25f);
  EXPECT_EQ(value.value({8, 3, 3}), 0.0f);
}

TEST(Csg, SetOperationsClampWhatNothingElseReaches) {
  // A leaf of values from 0 to 2 beside a tile far away: it is not taken as it is.
  std::mt19937 random(7);
  const volume::Grid grey = random_grid(random, 0, 2);
  volume::GridBuilder builder{volume::GridInfo{}};
  builder.add_tile({{80, 0, 0}, 8, 1.0f, true});
  const volume::Grid far = builder.finish(false);
  for (const Op operation : {Op::unite, Op::difference, Op::exclusive_or})
    expect_dense_equal(operation, {grey, far}, combine(operation, {grey, far}), 20, false);
  volume::CsgReport report; // control: a sum clamps nothing above 0
  const volume::Grid sum = combine(Op::add, {grey, far}, &report);
  EXPECT_EQ(report.leaves_computed, 0U);
  expect_dense_equal(Op::add, {grey, far}, sum, 20, false);
}

TEST(Csg, UntouchedLeavesAreShared) {
  const volume::Grid a = voxelized_ball(30, {0.1, 0.2, 0.3}, 2),
                     far = voxelized_ball(5, {80, 0, 0});
  for (const Op operation : {Op::add, Op::unite, Op::exclusive_or}) {
    volume::CsgReport report;
    combine(operation, {a, far}, &report);
    EXPECT_EQ(report.leaves_computed, 0u);
    EXPECT_EQ(report.leaves_shared, a.leaves().size() + far.leaves().size());
  }
  for (const Op operation : {Op::subtract, Op::difference}) {
    volume::CsgReport report;
    combine(operation, {a, far}, &report);
    EXPECT_EQ(report.leaves_computed, 0u);
    EXPECT_EQ(report.leaves_shared, a.leaves().size());
    EXPECT_EQ(report.leaves_skipped, far.leaves().size());
  }
  volume::CsgReport report; // control: where they overlap there is work
  combine(Op::add, {a, voxelized_ball(30, {5, 5, 5}, 2)}, &report);
  EXPECT_GT(report.leaves_computed, 0u);
}

TEST(Csg, SameResultForAnyNumberOfThreads) {
  const volume::Grid a = voxelized_ball(60, {0.1, 0.2, 0.3}, 2),
                     b = voxelized_ball(50, {20, 1, 0}, 3);
  for (const Op operation : all_operations)
    EXPECT_EQ(combine(operation, {a, b}, nullptr, 1).digest(),
              combine(operation, {a, b}, nullptr, 2).digest());
}

volume::Grid with_info(const std::function<void(volume::GridInfo&)>& change) {
  volume::GridInfo info;
  change(info);
  volume::GridBuilder builder(info);
  builder.add_tile({{0, 0, 0}, 8, 1.0f, true});
  return builder.finish(false);
}

TEST(Csg, Refusals) {
  const volume::Grid plain = with_info([](volume::GridInfo&) {});
  const auto said = [&](Op operation, const volume::Grid& grid, const std::string& words) {
    const std::string text = test::complaint([&] { combine(operation, {plain, grid}); });
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  said(Op::add, with_info([](volume::GridInfo& i) { i.level_set = true; }),
       "volume 1: is a level set");
  said(Op::add, with_info([](volume::GridInfo& i) { i.background = 2; }),
       "volume 1: has the background 2");
  said(Op::unite, with_info([](volume::GridInfo& i) { i.isovalue = 0.25; }), "volume 0 has 0.5");
  said(Op::unite,
       with_info([](volume::GridInfo& i) { i.transform = volume::uniform_transform(2); }),
       "volume 0 has voxel 1, origin (0, 0, 0), volume 1 has voxel 2");
  said(Op::unite, with_info([](volume::GridInfo& i) { i.transform.m[0] = 2; }), "expected cubic");
  const volume::Grid band = with_info([](volume::GridInfo& i) { i.band_isovalue = 0.5; });
  said(Op::add, band, "volume 1: is exact only near");
  said(Op::subtract, band, "volume 1: is exact only near");
  for (const Op operation : {Op::unite, Op::difference})
    EXPECT_EQ(test::complaint([&] { combine(operation, {plain, band}); }), "");
  said(Op::exclusive_or, with_info([](volume::GridInfo& i) { i.band_isovalue = 0.3; }),
       "expected 0.5");
  EXPECT_EQ(combine(Op::unite, {plain, band}).info().band_isovalue, 0.5);
  EXPECT_NE(test::complaint([&] { combine(Op::unite, {plain}); }).find("at least 2"),
            std::string::npos);
  EXPECT_THROW(volume::csg_operation_from_name("plus"), UsageError);
  EXPECT_EQ(volume::csg_operation_from_name("xor"), Op::exclusive_or);
}

TEST(Csg, OverflowIsAnError) {
  volume::GridBuilder builder{volume::GridInfo{}};
  builder.add_tile({{0, 0, 0}, 8, std::numeric_limits<float>::max(), true});
  const volume::Grid grid = builder.finish(false);
  EXPECT_THROW(combine(Op::add, {grid, grid}), Error);
  EXPECT_NO_THROW(combine(Op::unite, {grid, grid}));
}

TEST(Csg, OverflowOfOneVoxelOfALeafIsAnError) {
  const float max = std::numeric_limits<float>::max();
  const auto leaf = [&](std::size_t place) {
    volume::GridBuilder builder{volume::GridInfo{}};
    const std::vector<Int3> origins{{8, -8, 16}};
    for (const volume::LeafRef& ref : builder.add_leaves(Context{}, origins))
      for (std::size_t n = 0; n < volume::leaf_voxels; ++n) {
        ref.values[n] = n == place ? max : 0.25f + 0.5f * static_cast<float>(n % 2);
        ref.active[n / 64] |= std::uint64_t{1} << (n % 64);
      }
    return builder.finish(false);
  };
  for (const std::size_t place : {0U, 77U, 511U}) {
    const volume::Grid grid = leaf(place);
    EXPECT_THROW(combine(Op::add, {grid, grid}), Error) << place;
    EXPECT_NO_THROW(combine(Op::add, {grid, leaf((place + 1) % volume::leaf_voxels)}));
    EXPECT_NO_THROW(combine(Op::subtract, {grid, grid}));
    EXPECT_NO_THROW(combine(Op::unite, {grid, grid}));
    // Against a tile, too.
    volume::GridBuilder builder{volume::GridInfo{}};
    builder.add_tile({{8, -8, 16}, 8, max, true});
    const volume::Grid tile = builder.finish(false);
    EXPECT_THROW(combine(Op::add, {grid, tile}), Error) << place;
    EXPECT_THROW(combine(Op::add, {tile, grid}), Error) << place;
  }
}

TEST(Csg, LatticesThatPartFarFromTheFirstVolumeDiffer) {
  // Voxels of 1 and of 1 + 1e-8: alike to a millionth of a voxel near the origin, not at 10,000.
  const auto cube = [](double size, std::int32_t place) {
    volume::GridInfo info;
    info.transform = volume::uniform_transform(size);
    volume::GridBuilder builder(info);
    builder.add_tile({{place, 0, 0}, 8, 1.0f, true});
    return builder.finish(false);
  };
  const volume::Grid near = cube(1, 0);
  EXPECT_NO_THROW(combine(Op::unite, {near, cube(1 + 1e-8, 8)}));
  EXPECT_THROW(combine(Op::unite, {near, cube(1 + 1e-8, 10000)}), Error);
  EXPECT_THROW(combine(Op::unite, {cube(1 + 1e-8, 10000), near}), Error);
}

TEST(Csg, ResampleBringsOperandsToTheFirstLattice) {
  const volume::Grid a = voxelized_ball(14, {0.1, 0.2, 0.3}, 2);
  const volume::Grid fine = voxelization::voxelize(Context{}, sphere_mesh(3, 6, {30, 0, 0}),
                                                   volume::uniform_transform(0.5), {});
  const std::vector<volume::CsgOperand> operands{{a, "a"}, {fine, "fine"}};
  EXPECT_THROW(volume::csg(Context{}, Op::unite, operands), Error);
  volume::CsgReport report;
  const volume::Grid result =
      volume::csg(Context{}, Op::unite, operands, {.resample = true}, &report);
  EXPECT_EQ(report.resampled, 1u);
  EXPECT_EQ(result.info().transform, a.info().transform);
  volume::GridAccessor value(result);
  EXPECT_EQ(value.value({30, 0, 0}), 1.0f);
  EXPECT_EQ(value.value({0, 0, 0}), 1.0f);
}

} // namespace
