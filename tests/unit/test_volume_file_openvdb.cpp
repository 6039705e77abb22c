// Streams that OpenVDB itself writes: grids of other types, several grids, cut streams.

#include "formats/volume/volume_file.h"
#include "mesh/check.h"
#include "surface/marching_cubes.h"
#include "tests/unit/complaint.h"
#include "tests/unit/sanitizers.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string>

namespace gewebe::test {
namespace {

/// A cube of eight voxels.
template <class GridType>
openvdb::GridBase::Ptr cube(const std::string& name, const typename GridType::ValueType& value) {
  openvdb::initialize();
  const auto grid = GridType::create();
  grid->setName(name);
  auto accessor = grid->getAccessor();
  for (int n = 0; n < 8; ++n)
    accessor.setValue({n & 1, n >> 1 & 1, n >> 2}, value);
  return grid;
}

std::string stream_of(const openvdb::GridPtrVec& grids, bool packed = true) {
  std::ostringstream out;
  openvdb::io::Stream stream(out);
  if (!packed)
    stream.setCompression(openvdb::io::COMPRESS_NONE);
  stream.write(grids);
  return out.str();
}

std::string complaint(const std::string& bytes) {
  const std::string said =
      test::complaint([&] { return formats::volume_from_bytes(bytes, "x.vdb"); });
  EXPECT_EQ(said.find('\n'), std::string::npos);
  EXPECT_TRUE(said.empty() || said.starts_with("x.vdb: ")) << said;
  return said.empty() ? said : said.substr(7);
}

double volume_of(const std::string& bytes) {
  return mesh::examine_mesh(
             surface::marching_cubes({}, formats::volume_from_bytes(bytes, "x.vdb")).mesh)
      .volume;
}

TEST(VolumeFileOpenvdb, OtherTypesAreNamed) {
  const std::string none = "0 float grids and none named density, expected a grid 'density'";
  EXPECT_EQ(complaint(stream_of({cube<openvdb::DoubleGrid>("density", 1)})), none);
  EXPECT_EQ(complaint(stream_of({cube<openvdb::Int32Grid>("density", 1)})), none);
  EXPECT_EQ(complaint(stream_of({cube<openvdb::BoolGrid>("density", true)})), none);
  EXPECT_EQ(complaint(stream_of({cube<openvdb::Vec3SGrid>("v", {1, 2, 3})})), none);
  EXPECT_NE(complaint(stream_of({})), "");
}

TEST(VolumeFileOpenvdb, OfSeveralGridsDensityIsRead) {
  const auto other = cube<openvdb::FloatGrid>("temperature", 20);
  const auto density = cube<openvdb::FloatGrid>("density", 1);
  const auto vectors = cube<openvdb::Vec3SGrid>("velocity", {1, 2, 3});
  const double expected = volume_of(stream_of({density}));
  EXPECT_GT(expected, 0);
  EXPECT_EQ(volume_of(stream_of({vectors, other, density})), expected);
  EXPECT_EQ(volume_of(stream_of({density, other})), expected);
  // One float grid of another name will do, of two it is not clear.
  EXPECT_GT(volume_of(stream_of({vectors, other})), expected);
  EXPECT_EQ(complaint(stream_of({other, cube<openvdb::FloatGrid>("fuel", 1)})),
            "2 float grids and none named density, expected a grid 'density'");
}

/// `bytes` with the last `from` in it replaced by `to`, which is as long.
std::string with(std::string bytes, const std::string& from, const std::string& to) {
  const std::size_t place = bytes.rfind(from);
  EXPECT_NE(place, std::string::npos) << from;
  return bytes.replace(place, to.size(), to);
}

TEST(VolumeFileOpenvdb, FaultsAreSaidWithoutTheWordsOfTheLibrary) {
  const std::string unknown_type =
      "the stream holds a grid of an unknown type, expected float grids";
  for (const bool two : {false, true}) { // alone by our reader, of two grids by OpenVDB's
    openvdb::GridPtrVec grids{cube<openvdb::FloatGrid>("density", 1)};
    if (two)
      grids.push_back(cube<openvdb::DoubleGrid>("other", 1));
    const std::string whole = stream_of(grids);
    EXPECT_EQ(complaint(whole), "");
    EXPECT_EQ(complaint(with(whole, "UniformScaleMap", "UniformScaleMaq")),
              "the grid's transform is of an unknown kind, expected an affine one");
    if (two) {
      EXPECT_EQ(complaint(with(whole, "Tree_double_5_4_3", "Tree_double_5_4_2")), unknown_type);
    }
  }
  const std::string one = stream_of({cube<openvdb::FloatGrid>("density", 1)});
  EXPECT_EQ(complaint(with(one, "Tree_float_5_4_3", "Tree_float_5_4_2")), unknown_type);
  // The tree begins behind the map's name and its fifteen numbers: how many buffers it has.
  const std::size_t tree = one.rfind("UniformScaleMap") + 15 + 15 * sizeof(double);
  std::string several = one;
  several[tree] = 2;
  EXPECT_EQ(complaint(several), "the grid's tree has several buffers, expected one");
  // Values that do not unpack, as Blosc and as zlib packs them.
  const auto grid = openvdb::FloatGrid::create();
  for (int n = 0; n < 512; ++n)
    grid->tree().setValue({n & 7, n >> 3 & 7, n >> 6}, 0.01F * static_cast<float>(n % 9));
  for (const std::uint32_t way : {openvdb::io::COMPRESS_BLOSC, openvdb::io::COMPRESS_ZIP}) {
    std::ostringstream out;
    openvdb::io::Stream stream(out);
    stream.setCompression(way | openvdb::io::COMPRESS_ACTIVE_MASK);
    stream.write(openvdb::GridPtrVec{grid});
    std::string bytes = std::move(out).str();
    EXPECT_EQ(complaint(bytes), "");
    // Last are the values of the one leaf, behind their size.
    std::int64_t size = 0;
    std::size_t packed = bytes.size();
    do {
      std::memcpy(&size, bytes.data() + --packed - sizeof size, sizeof size);
    } while (size != static_cast<std::int64_t>(bytes.size() - packed));
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(packed), bytes.end(), '\xff');
    EXPECT_EQ(complaint(bytes), "a packed block is damaged: it does not unpack") << way;
  }
}

// OpenVDB makes a string as long as a stream says, up to 4 GiB, before it reads it.
TEST(VolumeFileOpenvdb, LengthsBeyondTheStreamAreRefused) {
  const std::string whole = stream_of(
      {cube<openvdb::FloatGrid>("temperature", 20), cube<openvdb::FloatGrid>("density", 1)});
  for (const char* const text : {"Tree_float_5_4_3", "UniformScaleMap"})
    for (const std::size_t place : {whole.find(text), whole.rfind(text)}) {
      std::string bytes = whole;
      bytes[place - 1] = '\xf0'; // the highest byte of its length
      EXPECT_NE(complaint(bytes).find("ends early, expected a "), std::string::npos)
          << text << " at " << place << ": " << complaint(bytes);
    }
}

TEST(VolumeFileOpenvdb, TruncatedStreamsOfSeveralGridsAreRefused) {
  if (test::under_sanitizers())
    GTEST_SKIP() << "OpenVDB's reader of other types leaks the tree when it throws";
  for (const bool packed : {true, false}) {
    const std::string whole = stream_of(
        {cube<openvdb::Vec3SGrid>("velocity", {1, 2, 3}), cube<openvdb::FloatGrid>("density", 1)},
        packed);
    EXPECT_EQ(complaint(whole), "");
    for (std::size_t n = 0; n < 24; ++n) {
      const std::size_t size = whole.size() * n / 24;
      EXPECT_NE(complaint(whole.substr(0, size)), "") << size << " of " << whole.size();
    }
    EXPECT_NE(complaint(whole.substr(0, whole.size() - 1)), "");
  }
}

} // namespace
} // namespace gewebe::test
