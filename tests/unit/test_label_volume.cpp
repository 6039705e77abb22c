// Readers of label volumes and scans: the formats say the same, damage is refused.

#include "base/error.h"
#include "formats/volume/grey_volume.h"
#include "formats/volume/label_volume.h"
#include "tests/unit/complaint.h"
#include "tests/unit/scratch.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

using namespace gewebe;
using namespace gewebe::test;

namespace {

constexpr Int3 size{5, 4, 3};
/// Axes of 1, 2 and 4 mm, turned and mirrored.
constexpr std::array<double, 12> affine{0, -2, 0, 10, 1, 0, 0, 20, 0, 0, -4, 30};

/// Label 9 at (1, 2, 1) and (4, 3, 2), label 200 at (0, 0, 0).
template <class T>
std::vector<T> voxels() {
  std::vector<T> values(60);
  values[1 + 5 * (2 + 4 * 1)] = 9;
  values[4 + 5 * (3 + 4 * 2)] = 9;
  values[0] = static_cast<T>(200);
  return values;
}

template <class T>
std::string raw(const std::vector<T>& values, bool big_endian = false) {
  std::string bytes;
  for (const T value : values) {
    std::array<char, sizeof(T)> b = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (big_endian)
      std::reverse(b.begin(), b.end());
    bytes.append(b.data(), b.size());
  }
  return bytes;
}

/// A header under construction.
class Header {
public:
  Header(std::size_t length, bool big_endian) : bytes(length, '\0'), big_(big_endian) {}
  template <class T>
  void put(std::size_t at, std::initializer_list<T> values) {
    const std::string text = raw(std::vector<T>(values), big_);
    bytes.replace(at, text.size(), text);
  }
  std::string bytes;

private:
  bool big_;
};

struct Nifti {
  std::int16_t datatype = 2, bitpix = 8;
  std::int16_t qform = 0, sform = 1;
  bool big_endian = false;
  float slope = 1, intercept = 0;
  std::array<float, 3> quaternion{};
  float qfac = 1;
  char unit = 2;
  float offset = 352;
};

std::string nifti_1(const Nifti& n, const std::string& data) {
  Header h(352, n.big_endian);
  h.put<std::int32_t>(0, {348});
  h.put<std::int16_t>(40, {3, 5, 4, 3, 1, 1, 1, 1});
  h.put<std::int16_t>(70, {n.datatype, n.bitpix});
  h.put<float>(76, {n.qfac, 1, 2, 4});
  h.put<float>(108, {n.offset, n.slope, n.intercept});
  h.bytes[123] = n.unit;
  h.put<std::int16_t>(252, {n.qform, n.sform});
  h.put<float>(256, {n.quaternion[0], n.quaternion[1], n.quaternion[2], 10, 20, 30});
  h.put<float>(280, {0, -2, 0, 10, 1, 0, 0, 20, 0, 0, -4, 30});
  h.bytes.replace(344, 4, std::string("n+1\0", 4));
  return h.bytes + data;
}

std::string nifti_2(const std::string& data, bool big_endian) {
  Header h(544, big_endian);
  h.put<std::int32_t>(0, {540});
  h.bytes.replace(4, 8, std::string("n+2\0\r\n\032\n", 8));
  h.put<std::int16_t>(12, {64, 64});
  h.put<std::int64_t>(16, {3, 5, 4, 3, 1, 1, 1, 1});
  h.put<double>(104, {1, 1, 2, 4});
  h.put<std::int64_t>(168, {544});
  h.put<double>(176, {1, 0});
  h.put<std::int32_t>(344, {0, 1});
  h.put<double>(400, {0, -2, 0, 10, 1, 0, 0, 20, 0, 0, -4, 30});
  h.put<std::int32_t>(500, {2});
  return h.bytes + data;
}

std::string nrrd(const std::string& fields, const std::string& data) {
  return "NRRD0005\ndimension: 3\nsizes: 5 4 3\n" + fields + "\n" + data;
}
const std::string lps = "space: left-posterior-superior\nspace directions: (0,-1,0) (2,0,0) "
                        "(0,0,-4)\nspace origin: (-10,-20,30)\n";

std::string meta(const std::string& fields, const std::string& data) {
  return "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 1 2 4\n"
         "TransformMatrix = 0 -1 0 1 0 0 0 0 -1\nOffset = -10 -20 30\n" +
         fields + "ElementDataFile = LOCAL\n" + data;
}

std::string deflated(const std::string& bytes, int window_bits) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(bytes.size() + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  (void)deflateEnd(&stream);
  return out;
}
std::string gzipped(const std::string& bytes) {
  return deflated(bytes, 31);
}

formats::LabelVolume read(const std::string& bytes,
                          const std::vector<formats::LabelRange>& labels = {{9, 9}}) {
  return formats::label_volume_from_bytes(bytes, "test", labels, {});
}

std::string message(const std::string& bytes,
                    const std::vector<formats::LabelRange>& labels = {{9, 9}}) {
  try {
    (void)read(bytes, labels);
  } catch (const Error& error) {
    return error.place() + ": " + error.what();
  }
  return "";
}

void expect_sample(const std::string& bytes) {
  const formats::LabelVolume volume = read(bytes);
  EXPECT_EQ(volume.mask.size, size);
  EXPECT_EQ(volume.voxels, 2U);
  EXPECT_TRUE(volume.mask.inside({1, 2, 1}));
  EXPECT_TRUE(volume.mask.inside({4, 3, 2}));
  EXPECT_FALSE(volume.mask.inside({0, 0, 0}));
  EXPECT_FALSE(volume.mask.inside({5, 3, 2}));
  const std::vector<std::pair<std::int64_t, std::uint64_t>> labels{{0, 57}, {9, 2}, {200, 1}};
  EXPECT_EQ(volume.labels, labels);
  for (std::size_t n = 0; n < 12; ++n)
    EXPECT_NEAR(volume.mask.transform.m[n], affine[n], 1e-12) << n;
  EXPECT_TRUE(volume.warnings.empty());
  const formats::AllLabels all = formats::all_labels_from_bytes(bytes, "test", {}, {});
  EXPECT_EQ(all.format, volume.format);
  EXPECT_EQ(all.voxels.size, size);
  EXPECT_EQ(all.voxels.transform, volume.mask.transform);
  const std::vector<std::int32_t> expected = voxels<std::int32_t>();
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 5; ++i)
        EXPECT_EQ(all.voxels.at({i, j, k}), expected[static_cast<std::size_t>(i + 5 * (j + 4 * k))])
            << i << " " << j << " " << k;
  for (const Int3& beyond : {Int3{5, 3, 2}, Int3{-1, 0, 0}, Int3{0, 4, 0}, Int3{0, 0, -1}})
    EXPECT_EQ(all.voxels.at(beyond), 0);
  const formats::GreyScan scan = formats::grey_volume_from_bytes(bytes, "test", {});
  EXPECT_EQ(scan.format, volume.format);
  EXPECT_EQ(scan.volume.transform, volume.mask.transform);
  EXPECT_EQ(scan.volume.values, voxels<float>());
}

std::string nifti_of_bytes() {
  return nifti_1({}, raw(voxels<std::uint8_t>()));
}

} // namespace

TEST(LabelVolume, AllFormatsAndTypesSayTheSame) {
  expect_sample(nifti_of_bytes());
  expect_sample(gzipped(nifti_of_bytes()));
  for (const bool big : {false, true}) {
    expect_sample(nifti_1({.datatype = 4, .bitpix = 16, .big_endian = big},
                          raw(voxels<std::int16_t>(), big)));
    expect_sample(
        nifti_1({.datatype = 16, .bitpix = 32, .big_endian = big}, raw(voxels<float>(), big)));
    expect_sample(nifti_1({.datatype = 1280, .bitpix = 64, .big_endian = big},
                          raw(voxels<std::uint64_t>(), big)));
    expect_sample(nifti_2(raw(voxels<double>(), big), big));
    const std::string endian = big ? "endian: big\n" : "endian: little\n";
    expect_sample(
        nrrd(lps + endian + "type: int\nencoding: raw\n", raw(voxels<std::int32_t>(), big)));
    expect_sample(meta(std::string("ElementByteOrderMSB = ") + (big ? "True" : "False") +
                           "\nElementType = MET_UINT\n",
                       raw(voxels<std::uint32_t>(), big)));
  }
  expect_sample(nrrd(lps + "type: uchar\nencoding: gzip\n", gzipped(raw(voxels<std::uint8_t>()))));
  expect_sample(meta("CompressedData = True\nElementType = MET_UCHAR\n",
                     deflated(raw(voxels<std::uint8_t>()), 15)));
}

namespace {

/// Voxels as `type` of INR, the header filled up to 256 bytes.
std::string inr(const std::string& fields, const std::string& data) {
  std::string header = "#INRIMAGE-4#{\nXDIM=5\nYDIM=4\nZDIM=3\nVDIM=1\nVX=1\nVY=2\nVZ=4\n"
                       "SCALE=2**0\n" +
                       fields;
  header.resize(252, '\n');
  return header + "##}\n" + data;
}

} // namespace

TEST(LabelVolume, InrHasVoxelSizesAlone) {
  const std::string u8 = "TYPE=unsigned fixed\nPIXSIZE=8 bits\nCPU=decm\n";
  const formats::LabelVolume volume = read(inr(u8, raw(voxels<std::uint8_t>())));
  EXPECT_EQ(volume.format, "INR");
  EXPECT_EQ(volume.warnings.size(), 1U);
  EXPECT_EQ(volume.mask.transform.m, (std::array<double, 12>{1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 4, 0}));
  EXPECT_TRUE(volume.mask.inside({4, 3, 2}));
  EXPECT_EQ(read(gzipped(inr(u8, raw(voxels<std::uint8_t>())))).voxels, 2U);
  for (const auto& [name, big] :
       {std::pair("decm", false), std::pair("alpha", false), std::pair("pc", false),
        std::pair("sun", true), std::pair("sgi", true)}) {
    const std::string cpu = std::string("CPU=") + name + "\n";
    EXPECT_EQ(formats::grey_volume_from_bytes(
                  inr("TYPE=float\nPIXSIZE=32 bits\n" + cpu, raw(voxels<float>(), big)), "test", {})
                  .volume.values,
              voxels<float>());
    EXPECT_EQ(read(inr("TYPE=signed fixed\nPIXSIZE=16 bits\n#GEOMETRY=CARTESIAN\n" + cpu,
                       raw(voxels<std::int16_t>(), big)))
                  .voxels,
              2U);
  }
  const formats::LabelVolume moved = read(inr("TX=7\nTZ=-2.5\n" + u8, raw(voxels<std::uint8_t>())));
  EXPECT_EQ(moved.mask.transform.m[3], 7);
  EXPECT_EQ(moved.mask.transform.m[11], -2.5);
  for (const auto& [fields, says] :
       {std::pair("RX=0.1\n" + u8, "test:10: a rotation RX, expected none"),
        std::pair(std::string("TYPE=unsigned fixed\nPIXSIZE=24 bits\nCPU=decm\n"),
                  "test:10: TYPE 'unsigned fixed' with PIXSIZE '24 bits', expected unsigned fixed, "
                  "signed fixed or float of 8 to 64 bits"),
        std::pair(std::string("TYPE=float\nPIXSIZE=32 bits\nCPU=vax\n"),
                  "test:12: CPU 'vax', expected decm, alpha, pc, sun or sgi"),
        std::pair(std::string("TYPE=float\nPIXSIZE=32 bits\n"),
                  "test: the INR header has no field 'CPU', expected one"),
        std::pair("VZ=1\n" + u8, "test:10: a second 'VZ', expected one"),
        std::pair("XDIM\n" + u8, "test:10: 'XDIM', expected KEY=value")})
    EXPECT_EQ(message(inr(fields, raw(voxels<std::uint8_t>()))), says);
  EXPECT_EQ(message("#INRIMAGE-4#{\nXDIM=5\n"),
            "test: the header ends without ##}, expected that last line");
}

TEST(LabelVolume, GreyValuesNeedNotBeWhole) {
  std::vector<float> values = voxels<float>();
  values[7] = 0.25F;
  values[8] = NAN;
  const std::string bytes =
      nifti_1({.datatype = 16, .bitpix = 32, .slope = 2, .intercept = -1024}, raw(values));
  const labels::GreyVolume scan = formats::grey_volume_from_bytes(bytes, "test", {}).volume;
  EXPECT_EQ(scan.size, size);
  EXPECT_EQ(scan.values.at(0), -624);
  EXPECT_EQ(scan.values.at(7), -1023.5F);
  EXPECT_NE(scan.values.at(8), scan.values.at(8));
  EXPECT_EQ(scan.values.at(scan.row(2, 1) + 1), -1006);
  Context little;
  little.max_memory = 300;
  EXPECT_THROW((void)formats::grey_volume_from_bytes(bytes, "test", little), Error);
  EXPECT_THROW((void)formats::grey_volume_from_bytes(bytes.substr(0, 500), "test", {}), Error);
}

TEST(LabelVolume, ScaledLabelsAreThoseThatAreMeant) {
  std::vector<float> values = voxels<float>();
  for (float& value : values)
    value = (value - 3) / 0.5F;
  expect_sample(
      nifti_1({.datatype = 16, .bitpix = 32, .slope = 0.5F, .intercept = 3}, raw(values)));
}

TEST(LabelVolume, JoinedGzipMembersAreOne) {
  const std::string bytes = nifti_of_bytes();
  expect_sample(gzipped(bytes.substr(0, 200)) + gzipped(bytes.substr(200)));
  EXPECT_NE(message(gzipped(bytes) + "x"), "");
}

TEST(LabelVolume, QformIsTheQuaternion) {
  // A quarter turn about z, mirrored along k: what `affine` is.
  const float half = std::sqrt(0.5F);
  const formats::LabelVolume volume = read(nifti_1(
      {.qform = 1, .sform = 0, .quaternion = {0, 0, half}, .qfac = -1}, raw(voxels<char>())));
  for (std::size_t n = 0; n < 12; ++n)
    EXPECT_NEAR(volume.mask.transform.m[n], affine[n], 1e-6) << n;
  // sform goes before qform, and without both the place is guessed.
  expect_sample(nifti_1({.qform = 1, .quaternion = {1, 0, 0}}, raw(voxels<std::uint8_t>())));
  const formats::LabelVolume guessed = read(nifti_1({.sform = 0}, raw(voxels<std::uint8_t>())));
  EXPECT_EQ(guessed.warnings.size(), 1U);
  EXPECT_EQ(guessed.mask.transform.m,
            (std::array<double, 12>{-1, 0, 0, 2, 0, 2, 0, -3, 0, 0, 4, -4}));
  EXPECT_NE(message(nifti_1({.qform = 1, .sform = 0, .quaternion = {1, 1, 0}},
                            raw(voxels<std::uint8_t>()))),
            "");
}

TEST(LabelVolume, UnitsBecomeMillimetres) {
  const formats::LabelVolume metres = read(nifti_1({.unit = 1}, raw(voxels<std::uint8_t>())));
  EXPECT_EQ(metres.mask.transform.m[3], 10000);
  EXPECT_EQ(metres.mask.transform.m[4], 1000);
  EXPECT_NE(message(nifti_1({.unit = 5}, raw(voxels<std::uint8_t>()))), "");
}

TEST(LabelVolume, SpacesOfNrrd) {
  const std::string data = "type: uchar\nencoding: raw\n";
  const std::string bytes = raw(voxels<std::uint8_t>());
  const std::string ras = "space directions: (0,1,0) (-2,0,0) (0,0,-4)\nspace origin: (10,20,30)\n";
  expect_sample(nrrd("space: RAS\n" + ras + data, bytes));
  expect_sample(nrrd("space: left-anterior-superior\nspace directions: (0,1,0) (2,0,0) (0,0,-4)\n"
                     "space origin: (-10,20,30)\n" +
                         data,
                     bytes));
  const formats::LabelVolume unknown = read(nrrd("space dimension: 3\n" + ras + data, bytes));
  EXPECT_EQ(unknown.warnings.size(), 1U);
  EXPECT_EQ(unknown.mask.transform.m[3], 10);
  EXPECT_NE(message(nrrd("space: 3D-left-handed\n" + ras + data, bytes)), "");
  const auto with_origin = [&](const std::string& word) {
    return nrrd("space: RAS\nspace directions: (0,1,0) (-2,0,0) (0,0,-4)\nspace origin: (" + word +
                    ",20,30)\n" + data,
                bytes);
  };
  expect_sample(with_origin("+10"));
  EXPECT_NE(message(with_origin("+-10")).find("'+-10', expected a finite number"),
            std::string::npos);
  // An axis that is none of space counts if it has one sample only.
  const std::string four = "NRRD0005\ndimension: 4\nsizes: 1 5 4 3\nspace: RAS\nspace directions: "
                           "none (0,1,0) (-2,0,0) (0,0,-4)\nspace origin: (10,20,30)\n" +
                           data + "\n";
  expect_sample(four + bytes);
  std::string two = four;
  two.replace(two.find("sizes: 1"), 8, "sizes: 2");
  EXPECT_NE(message(two + bytes + bytes), "");
}

TEST(LabelVolume, UnknownLabelNamesThoseThereAre) {
  EXPECT_EQ(message(nifti_of_bytes(), {{9, 9}, {8, 8}}),
            "test: has no label 8, expected some of 0, 9, 200");
  EXPECT_EQ(message(nifti_of_bytes(), {{0, 0}, {10, 199}}),
            "test: has no label 10 to 199, expected some of 0, 9, 200");
}

TEST(LabelVolume, RangesAreOfWhatThereIs) {
  EXPECT_EQ(read(nifti_of_bytes(), {{1, 199}}).voxels, 2U);
  EXPECT_EQ(read(nifti_of_bytes(), {{-5, 8}}).voxels, 57U);
  EXPECT_EQ(read(nifti_of_bytes(), {{9, INT64_MAX}, {200, 200}}).voxels, 3U);
  EXPECT_EQ(read(nifti_of_bytes(), {{INT64_MIN, INT64_MAX}}).voxels, 60U);
  // Beyond the table of small ones.
  std::vector<double> values = voxels<double>();
  values[7] = 70000;
  values[8] = 70002;
  values[11] = -3;
  const std::string bytes = nifti_2(raw(values), false);
  EXPECT_EQ(read(bytes, {{70000, 70001}, {-3, -1}}).voxels, 2U);
  EXPECT_EQ(read(bytes, {{201, 70000}, {70001, 70002}}).voxels, 2U);
  EXPECT_EQ(read(bytes, {{70001, 80000}}).voxels, 1U);
}

TEST(LabelVolume, EveryTruncatedPrefixIsRefused) {
  const std::string plain = raw(voxels<std::uint8_t>());
  for (const std::string& whole :
       {nifti_of_bytes(), gzipped(nifti_of_bytes()), nifti_2(raw(voxels<double>()), false),
        nrrd(lps + "type: uchar\nencoding: raw\n", plain),
        nrrd(lps + "type: uchar\nencoding: gzip\n", gzipped(plain)),
        meta("ElementType = MET_UCHAR\n", plain),
        meta("CompressedData = True\nElementType = MET_UCHAR\n", deflated(plain, 15))}) {
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(message(whole.substr(0, length)), "") << length << " of " << whole.size();
    EXPECT_EQ(message(whole), "");
    EXPECT_NE(message(whole + '\0'), "") << "a byte more";
  }
}

TEST(LabelVolume, DamagedCompressedDataIsRefused) {
  std::string bytes = gzipped(nifti_of_bytes());
  bytes[bytes.size() - 6] = static_cast<char>(bytes[bytes.size() - 6] ^ 1); // of the checksum
  EXPECT_NE(message(bytes), "");
}

TEST(LabelVolume, AllLabelsAreNumbersOf31Bits) {
  const auto complaint = [](double value) {
    std::vector<double> values = voxels<double>();
    values[7] = value;
    return test::complaint([&] {
      return formats::all_labels_from_bytes(nifti_2(raw(values), false), "test", {}, {});
    });
  };
  EXPECT_EQ(complaint(0x1p31 - 1), "");
  EXPECT_EQ(complaint(0x1p31), "test: has label 2147483648, expected 0 to 2147483647");
  EXPECT_EQ(complaint(-1), "test: has label -1, expected 0 to 2147483647");
  EXPECT_EQ(complaint(0.5), "test: voxel (2, 1, 0) is 0.5, expected whole numbers");
}

TEST(LabelVolume, LabelsThatAreNotWantedAreNone) {
  std::vector<double> values = voxels<double>();
  values[7] = -3;
  const std::string bytes = nifti_2(raw(values), false);
  const labels::LabelRuns some =
      formats::all_labels_from_bytes(bytes, "test", {{100, 300}}, {}).voxels;
  EXPECT_EQ(some.at({0, 0, 0}), 200);
  EXPECT_EQ(some.at({1, 2, 1}), 0);
  EXPECT_EQ(some.at({2, 1, 0}), 0);
  EXPECT_EQ(some.runs.size(), 13U); // a row each, and what is behind the voxel of 200
  EXPECT_THROW((void)formats::all_labels_from_bytes(bytes, "test", {{1, 8}}, {}), Error);
  EXPECT_THROW((void)formats::all_labels_from_bytes(bytes, "test", {{-3, -3}}, {}), Error);
}

TEST(LabelVolume, RunsOfAllLabelsKeepToTheMemory) {
  // Every voxel another label than the one before it.
  std::vector<std::uint8_t> values(200 * 200 * 20);
  for (std::size_t n = 0; n < values.size(); ++n)
    values[n] = static_cast<std::uint8_t>(n % 2);
  std::string bytes = "NRRD0005\ndimension: 3\nsizes: 200 200 20\ntype: uchar\nencoding: raw\n" +
                      lps + "\n" + raw(values);
  Context context;
  context.max_memory = 10000000;
  EXPECT_THROW((void)formats::all_labels_from_bytes(bytes, "test", {}, context), Error);
  context.max_memory = 30000000;
  EXPECT_EQ(formats::all_labels_from_bytes(bytes, "test", {}, context).voxels.runs.size(),
            values.size());
}

TEST(LabelVolume, ValuesThatAreNoLabelsAreRefused) {
  for (const float bad : {0.5F, NAN, HUGE_VALF, 1e30F}) {
    std::vector<float> values = voxels<float>();
    values[7] = bad;
    EXPECT_NE(message(nifti_1({.datatype = 16, .bitpix = 32}, raw(values))).find("voxel (2, 1, 0)"),
              std::string::npos)
        << bad;
  }
}

TEST(LabelVolume, HugeClaimsTakeNoMemory) {
  Header h(352, false);
  h.bytes = nifti_of_bytes();
  h.put<std::int16_t>(40, {3, 30000, 30000, 30000});
  Context context;
  context.max_memory = std::uint64_t{1} << 30U;
  EXPECT_THROW((void)formats::label_volume_from_bytes(h.bytes, "test", {{9, 9}}, context), Error);
  EXPECT_THROW((void)read(h.bytes), Error); // the bytes end first
}

TEST(LabelVolume, WhatItsSizeRulesOutIsRefusedBeforeAVoxelIsUnpacked) {
  Header h(352, false);
  h.bytes = nifti_of_bytes().substr(0, 352);
  h.put<std::int16_t>(40, {3, 1600, 1600, 1600});
  std::size_t asked = 0;
  const formats::LabelCheck check = [&](const labels::LabelMask& mask) {
    ++asked;
    EXPECT_EQ(mask.size, (Int3{1600, 1600, 1600}));
    EXPECT_TRUE(mask.bits.empty());
    throw Error("too large");
  };
  for (const std::string& bytes : {h.bytes, gzipped(h.bytes)}) // no voxel follows
    try {
      (void)formats::label_volume_from_bytes(bytes, "test", {{9, 9}}, {}, check);
      ADD_FAILURE() << "not refused";
    } catch (const Error& error) {
      EXPECT_STREQ(error.what(), "too large");
      EXPECT_EQ(error.place(), "test");
    }
  EXPECT_EQ(asked, 2U);
}

TEST(LabelVolume, FirstBytesTellOne) {
  EXPECT_TRUE(formats::is_label_volume(nifti_of_bytes()));
  EXPECT_TRUE(formats::is_label_volume(gzipped(nifti_of_bytes()).substr(0, 80)) ||
              gzipped(nifti_of_bytes()).size() < 100);
  EXPECT_TRUE(formats::is_label_volume(gzipped(nifti_of_bytes())));
  EXPECT_TRUE(formats::is_label_volume(meta("", "")));
  EXPECT_FALSE(formats::is_label_volume("ply\nformat ascii 1.0\n"));
  EXPECT_FALSE(formats::is_label_volume("0 0 0 1\n"));
  EXPECT_FALSE(formats::is_label_volume(""));
}

TEST(LabelVolume, FilesOfTwoParts) {
  const ScratchFile header(".nhdr"), data(".raw");
  const std::string name = data.path().substr(data.path().find_last_of('/') + 1);
  {
    std::ofstream(header.path()) << nrrd(
        lps + "type: uchar\nencoding: raw\ndata file: " + name + "\n", "");
    std::ofstream(data.path()) << raw(voxels<std::uint8_t>());
  }
  formats::Input input(header.path());
  EXPECT_EQ(formats::read_label_volume(input, {{9, 9}}, {}).voxels, 2U);
  std::ofstream(data.path()) << "short";
  formats::Input again(header.path());
  EXPECT_THROW((void)formats::read_label_volume(again, {{9, 9}}, {}), Error);
}
