// Volumes on disk: round trip, equal bytes, every truncated prefix, damaged heads.

#include "base/error.h"
#include "formats/volume/volume_file_internal.h"
#include "tests/unit/scratch.h"
#include "volume/grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

using namespace gewebe;
using namespace gewebe::test;

namespace {

volume::Grid sample_grid(float value = 0.75F) {
  volume::GridInfo info;
  info.transform = volume::uniform_transform(0.5);
  info.isovalue = 0.25;
  volume::GridBuilder builder(info);
  const std::vector<Int3> origins{{0, 0, 0}, {-8, 16, 8}, {128, 0, -16}};
  const std::vector<volume::LeafRef> leaves = builder.add_leaves({}, origins);
  for (const volume::LeafRef& leaf : leaves)
    for (int n = 0; n < volume::leaf_voxels; n += 3) {
      leaf.values[n] = value * static_cast<float>(n) / 512;
      leaf.active[n / 64] |= std::uint64_t{1} << (n % 64);
    }
  builder.add_tile({{64, 64, 64}, 8, 1.0F, true});
  builder.add_tile({{0, 256, 0}, 128, 0.5F, true});
  return builder.finish();
}

std::string bytes_of(const volume::Grid& grid, formats::StreamWay way = formats::usual_way,
                     formats::Packing packing = formats::Packing::blosc) {
  const ScratchFile file(".vdb");
  formats::Output output(file.path(), {});
  formats::write_volume(output, grid, {}, packing, way);
  output.commit();
  formats::Input input(file.path());
  return input.read_all();
}

volume::Grid grid_of(const std::string& bytes) {
  return formats::volume_from_bytes(bytes, "test.vdb");
}

/// A leaf for each way to tell inactive values: all background, all another value, two of them, as
/// many as there are voxels; and one that is all active.
volume::Grid grid_of_all_kinds() {
  volume::GridBuilder builder(volume::GridInfo{});
  const std::vector<Int3> origins{{0, 0, 0}, {8, 0, 0}, {16, 0, 0}, {24, 0, 0}, {32, 0, 0}};
  const std::vector<volume::LeafRef> leaves = builder.add_leaves({}, origins);
  for (std::size_t kind = 0; kind < leaves.size(); ++kind)
    for (int n = 0; n < volume::leaf_voxels; ++n) {
      const bool active = kind == 4 || n % 3 == 0;
      const auto number = static_cast<float>(n);
      leaves[kind].values[n] = active      ? 1 + number
                               : kind == 0 ? 0
                               : kind == 1 ? 0.5F
                               : kind == 2 ? (n % 2 == 0 ? 0.25F : 0.75F)
                                           : -number;
      if (active)
        leaves[kind].active[n / 64] |= std::uint64_t{1} << (n % 64);
    }
  return builder.finish();
}

} // namespace

TEST(VolumeFile, RoundTripKeepsEverything) {
  const volume::Grid grid = sample_grid();
  const volume::Grid back = grid_of(bytes_of(grid));
  EXPECT_EQ(back.digest(), grid.digest());
  EXPECT_EQ(back.info().transform, grid.info().transform);
  EXPECT_EQ(back.info().isovalue, 0.25);
  EXPECT_EQ(back.leaves().size(), 3U);
  EXPECT_EQ(back.tiles().size(), 2U);
  volume::GridAccessor accessor(back);
  EXPECT_EQ(accessor.value({70, 70, 70}), 1.0F);
  EXPECT_EQ(accessor.value({100, 300, 100}), 0.5F);
  EXPECT_EQ(accessor.value({0, 0, 3}), 0.75F * 3 / 512);
  EXPECT_EQ(accessor.value({1000, 0, 0}), 0.0F);
}

// Streams of another OpenVDB are left to it: what it writes and reads is what we do.
TEST(VolumeFile, OpenvdbsOwnReaderAndWriterGiveTheSame) {
  EXPECT_EQ(formats::usual_way, formats::StreamWay::parallel);
  const volume::Grid grid = sample_grid();
  const std::string ours = bytes_of(grid, formats::StreamWay::parallel);
  const std::string theirs = bytes_of(grid, formats::StreamWay::plain);
  EXPECT_EQ(theirs, bytes_of(grid, formats::StreamWay::plain));
  for (const std::string& bytes : {ours, theirs})
    for (const formats::StreamWay way : {formats::StreamWay::parallel, formats::StreamWay::plain}) {
      const volume::Grid back = formats::volume_from_bytes(bytes, "test.vdb", {}, way);
      EXPECT_EQ(back.digest(), grid.digest());
      EXPECT_EQ(back.active_voxels(), grid.active_voxels());
    }
  // The leaves, with which a stream ends, are packed to the same bytes.
  EXPECT_EQ(ours.substr(ours.size() - 2000), theirs.substr(theirs.size() - 2000));
}

TEST(VolumeFile, UncompressedStreamsHoldTheSame) {
  const volume::Grid grid = grid_of_all_kinds();
  const std::string packed = bytes_of(grid);
  const std::string ours = bytes_of(grid, formats::StreamWay::parallel, formats::Packing::none);
  const std::string theirs = bytes_of(grid, formats::StreamWay::plain, formats::Packing::none);
  EXPECT_EQ(ours.substr(21, 36), packed.substr(21, 36)); // the UUID is that of the content
  EXPECT_NE(ours, packed);
  // The leaves, with which a stream ends, are OpenVDB's own bytes.
  EXPECT_EQ(ours.substr(ours.size() - 5000), theirs.substr(theirs.size() - 5000));
  for (const std::string& bytes : {packed, ours, theirs})
    for (const formats::StreamWay way : {formats::StreamWay::parallel, formats::StreamWay::plain}) {
      const volume::Grid back = formats::volume_from_bytes(bytes, "test.vdb", {}, way);
      EXPECT_EQ(back.digest(), grid.digest());
      EXPECT_EQ(back.active_voxels(), grid.active_voxels());
      volume::GridAccessor accessor(back);
      EXPECT_EQ(accessor.value({8, 0, 1}), 0.5F);
      EXPECT_EQ(accessor.value({16, 0, 1}), 0.75F);
      EXPECT_EQ(accessor.value({24, 0, 1}), -1.0F);
      EXPECT_EQ(accessor.value({32, 0, 1}), 2.0F);
    }
  for (std::size_t size = 0; size < ours.size(); size += size + 9000 < ours.size() ? 97 : 1)
    EXPECT_THROW((void)grid_of(ours.substr(0, size)), Error) << size << " of " << ours.size();
}

TEST(VolumeFile, RotatedTransformSurvivesExactly) {
  volume::GridInfo info;
  info.transform.m = {0.3, -0.4, 0, 1.25, 0.4, 0.3, 0, -7.1, 0, 0, 0.5, 1.0 / 3};
  volume::GridBuilder builder(info);
  builder.add_tile({{0, 0, 0}, 8, 1.0F, true});
  const volume::Grid grid = builder.finish();
  EXPECT_EQ(grid_of(bytes_of(grid)).info().transform, info.transform);
}

TEST(VolumeFile, EqualContentGivesEqualBytesAndOtherContentAnotherUuid) {
  const std::string a = bytes_of(sample_grid());
  EXPECT_EQ(a, bytes_of(sample_grid()));
  const std::string b = bytes_of(sample_grid(0.5F));
  EXPECT_NE(a.substr(21, 36), b.substr(21, 36));
  EXPECT_EQ(a[35], '8'); // version of the UUID
}

TEST(VolumeFile, EveryTruncatedPrefixIsRefused) {
  volume::GridBuilder builder(volume::GridInfo{});
  const Int3 origin{8, 0, 0};
  const volume::LeafRef leaf = builder.add_leaves({}, {&origin, 1}).at(0);
  for (int n = 0; n < volume::leaf_voxels; n += 7) {
    leaf.values[n] = static_cast<float>(n);
    leaf.active[n / 64] |= std::uint64_t{1} << (n % 64);
  }
  const std::string whole = bytes_of(builder.finish());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THROW((void)grid_of(whole.substr(0, size)), Error) << size << " of " << whole.size();
  }
  EXPECT_NO_THROW((void)grid_of(whole)); // negative control: the whole is fine
}

TEST(VolumeFile, HugeStringsInTheHeadTakeNoMemory) {
  std::string bytes = bytes_of(sample_grid());
  const std::size_t metadata = 21 + 36;
  const std::uint32_t huge = 0xfffffff0U;
  std::memcpy(bytes.data() + metadata, &huge, 4); // the count of file metadata
  EXPECT_THROW((void)grid_of(bytes), Error);
}

TEST(VolumeFile, ValuesThatAreNotFiniteAreRefused) {
  volume::GridBuilder builder(volume::GridInfo{});
  const Int3 origin{0, 0, 0};
  const auto leaf = builder.add_leaves({}, {&origin, 1}).at(0);
  leaf.values[5] = NAN;
  leaf.active[0] = 1U << 5U;
  EXPECT_THROW((void)grid_of(bytes_of(builder.finish())), Error);
}

TEST(VolumeFile, OtherBytesAreRefused) {
  EXPECT_THROW((void)grid_of("ply\nformat ascii 1.0\n"), Error);
  EXPECT_THROW((void)grid_of(std::string(4096, '\0')), Error);
}
