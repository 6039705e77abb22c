// The lattices of --dim, and index ranges of boxes.

#include "base/error.h"
#include "volume/lattice.h"

#include <gtest/gtest.h>

namespace {

using namespace gewebe;

TEST(Lattice, DimDividesTheLongestSide) {
  const volume::GridTransform t = volume::lattice_for_dim({{-1, 0, 5}, {3, 1, 7}}, 8);
  EXPECT_EQ(t, volume::uniform_transform(0.5));
  EXPECT_EQ(t.to_world({2, 4, 6}), (Vec3{1, 2, 3})); // centres at multiples of the edge
}

TEST(Lattice, DimNeedsExtent) {
  EXPECT_THROW(volume::lattice_for_dim({}, 8), Error);
  EXPECT_THROW(volume::lattice_for_dim({{1, 1, 1}, {1, 1, 1}}, 8), Error);
  EXPECT_THROW(volume::lattice_for_dim({{0, 0, 0}, {1, 1, 1}}, 0), Error);
  EXPECT_NO_THROW(volume::lattice_for_dim({{0, 0, 0}, {1, 0, 0}}, 8));
}

TEST(Lattice, IndexRangeHoldsExactlyTheCentresInTheBox) {
  Int3 min{}, max{};
  ASSERT_TRUE(
      volume::index_range(volume::uniform_transform(0.5), {{-1, 0, 0.1}, {1, 0.9, 0.6}}, min, max));
  EXPECT_EQ(min, (Int3{-2, 0, 1}));
  EXPECT_EQ(max, (Int3{2, 1, 1}));
  EXPECT_FALSE(
      volume::index_range(volume::uniform_transform(1), {{0.1, 0, 0}, {0.9, 1, 1}}, min, max));
  EXPECT_FALSE(volume::index_range(volume::uniform_transform(1), {}, min, max));
}

TEST(Lattice, IndexRangeOfARotatedLatticeCoversTheBox) {
  volume::GridTransform t; // quarter turn about z, edge 2, moved
  t.m = {0, -2, 0, 10, 2, 0, 0, 20, 0, 0, 2, 30};
  Int3 min{}, max{};
  ASSERT_TRUE(volume::index_range(t, {{6, 20, 30}, {10, 28, 32}}, min, max));
  EXPECT_EQ(min, (Int3{0, 0, 0}));
  EXPECT_EQ(max, (Int3{4, 2, 1}));
}

TEST(Lattice, IndexRangeRefusesWhatIntegersCannotHold) {
  Int3 min{}, max{};
  EXPECT_THROW(
      volume::index_range(volume::uniform_transform(1e-9), {{0, 0, 0}, {100, 1, 1}}, min, max),
      Error);
  EXPECT_THROW(
      volume::index_range(volume::uniform_transform(1), {{-2e9, 0, 0}, {0, 1, 1}}, min, max),
      Error);
}

} // namespace
