#include "formats/mesh/ply.h"
#include "tests/unit/complaint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

using namespace gewebe;

namespace {

TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.points = {{0.1, -0.0, 1e-300}, {1.0 / 3, 5e-324, 0}, {0, M_PI, 1e300}, {-7, 1, 2}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  return mesh;
}

TriangleMesh everything() {
  TriangleMesh mesh = tetrahedron();
  mesh.normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {0.6f, 0.8f, 0}};
  mesh.texcoords = {
      {0, 0, 1, 0, 0, 1}, {.1f, .2f, .3f, .4f, .5f, .6f}, {-1, 2, 3, 4, 5, 1e30f}, {}};
  mesh.part = {0, 0, 3, INT32_MAX};
  mesh.material = {2, 1, 0, 0};
  return mesh;
}

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_equal(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_TRUE(same_bytes(a.points, b.points));
  EXPECT_TRUE(same_bytes(a.triangles, b.triangles));
  EXPECT_TRUE(same_bytes(a.normals, b.normals));
  EXPECT_TRUE(same_bytes(a.texcoords, b.texcoords));
  EXPECT_TRUE(same_bytes(a.part, b.part));
  EXPECT_TRUE(same_bytes(a.material, b.material));
}

// "PLACE: WHAT" of the complaint, or "" if there is none.
std::string complaint(const std::string& bytes) {
  return test::complaint([&] { check_mesh(formats::read_ply(bytes, "m.ply")); });
}

std::string ascii_square(const std::string& face = "4 0 1 2 3", const std::string& tail = "") {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0\n1 0 0\n1 1 0\n0 1 0\n" +
         face + "\n" + tail;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

template <class T>
void put_big(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

} // namespace

TEST(Ply, RoundTripsBitForBit) {
  for (const TriangleMesh& mesh : {tetrahedron(), everything(), TriangleMesh{}}) {
    const std::string bytes = formats::write_ply(mesh);
    expect_equal(formats::read_ply(bytes, "m"), mesh);
    EXPECT_EQ(formats::write_ply(formats::read_ply(bytes, "m")), bytes);
  }
  TriangleMesh other = everything(); // the negative control
  other.points[0].y = 0.0;
  EXPECT_FALSE(same_bytes(other.points, everything().points));
}

TEST(Ply, HeaderIsTheDocumentedOne) {
  const std::string bytes = formats::write_ply(everything());
  EXPECT_TRUE(
      bytes.starts_with("ply\nformat binary_little_endian 1.0\ncomment gewebe_mesh, millimetres\n"
                        "element vertex 4\nproperty double x\nproperty double y\n"
                        "property double z\nproperty float nx\nproperty float ny\n"
                        "property float nz\nelement face 4\n"
                        "property list uchar int vertex_indices\n"
                        "property list uchar float texcoord\nproperty int part\n"
                        "property int material\nend_header\n"));
}

TEST(Ply, PiecesAreTheWhole) {
  TriangleMesh mesh;
  for (int i = 0; i < 50000; ++i)
    mesh.points.push_back({double(i), 0, 0});
  std::string joined;
  int pieces = 0;
  formats::write_ply(mesh, [&](std::string_view piece) {
    joined += piece;
    ++pieces;
  });
  EXPECT_GT(pieces, 2);
  EXPECT_EQ(joined, formats::write_ply(mesh));
}

TEST(Ply, EveryPrefixIsRefused) {
  std::vector<std::string> files{formats::write_ply(everything()),
                                 formats::write_ply(tetrahedron())};
  files.push_back(ascii_square());
  files.back().pop_back(); // the last line end may be missing
  for (const std::string& bytes : files) {
    EXPECT_EQ(complaint(bytes), "");
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      // Cut in its last number, an ascii file can still be one: 3 of "3", not of "30".
      const std::string text = complaint(bytes.substr(0, size));
      EXPECT_NE(text, "") << size << " of " << bytes.size();
      EXPECT_TRUE(text.starts_with("m.ply:")) << text;
    }
  }
}

TEST(Ply, EveryChangedByteIsAnErrorOrAMesh) {
  for (const std::string& good : {formats::write_ply(everything()), ascii_square()})
    for (std::size_t at = 0; at < good.size(); ++at)
      for (const int value : {0, 1, 9, 10, 45, 57, 127, 128, 255}) {
        std::string bytes = good;
        bytes[at] = static_cast<char>(value);
        complaint(bytes);
      }
}

TEST(Ply, SurplusBytesAreRefused) {
  const std::string bytes = formats::write_ply(tetrahedron());
  EXPECT_EQ(complaint(bytes + "x"), "m.ply: byte " + std::to_string(bytes.size()) +
                                        ": 1 bytes after the last element, expected the end");
  EXPECT_EQ(complaint(ascii_square("4 0 1 2 3", " \r\n\n")), "");
  EXPECT_EQ(complaint(ascii_square("4 0 1 2 3", "7\n")),
            "m.ply:15: \"7\" after the last element, expected the end");
  EXPECT_EQ(complaint(ascii_square("4 0 1 2 3 9")),
            "m.ply:14: \"9\" is left on the line, expected its end");
}

TEST(Ply, AsciiWithQuadBecomesTwoTriangles) {
  formats::PlyStats stats;
  const TriangleMesh mesh = formats::read_ply(ascii_square(), "m", &stats);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(stats.polygons, 1u);
  EXPECT_EQ(complaint(replaced(ascii_square(), "vertex_indices", "vertex_index")), "");
  std::string crlf;
  for (const char c : ascii_square())
    crlf += c == '\n' ? "\r\n" : std::string(1, c);
  expect_equal(formats::read_ply(crlf, "m"), mesh);
  expect_equal(formats::read_ply(replaced(ascii_square(), "1 0 0\n", "\n+1 0.0 -0e5\n\n"), "m"),
               [&] {
                 TriangleMesh same = mesh;
                 same.points[1].z = -0.0;
                 return same;
               }());
}

TEST(Ply, BigEndianAndEveryScalarType) {
  std::string bytes = "ply\r\nformat binary_big_endian 1.0\r\nobj_info x\r\nelement vertex 3\r\n"
                      "property short x\r\nproperty uint8 quality\r\nproperty ushort y\r\n"
                      "property int32 z\r\nelement edge 2\r\nproperty list uint16 double w\r\n"
                      "property char c\r\nelement face 1\r\nproperty list int uint vertex_index\r\n"
                      "property list uchar uchar flags\r\nproperty float32 part\r\n"
                      "property list char float64 texcoord\r\nend_header\r\n";
  for (const int v : {0, 1, 2}) {
    put_big(bytes, static_cast<std::int16_t>(-300 * v));
    put_big(bytes, std::uint8_t{200});
    put_big(bytes, static_cast<std::uint16_t>(40000 + v));
    put_big(bytes, v == 2 ? INT32_MIN : v);
  }
  put_big(bytes, std::uint16_t{2});
  put_big(bytes, std::nan(""));
  put_big(bytes, 1.0);
  put_big(bytes, std::int8_t{-1});
  put_big(bytes, std::uint16_t{0});
  put_big(bytes, std::int8_t{-1});
  put_big(bytes, 3);
  for (const std::uint32_t corner : {2u, 0u, 1u})
    put_big(bytes, corner);
  put_big(bytes, std::uint8_t{0});
  put_big(bytes, 5.0f);
  put_big(bytes, std::int8_t{6});
  for (int i = 0; i < 6; ++i)
    put_big(bytes, i / 4.0);
  formats::PlyStats stats;
  const TriangleMesh mesh = formats::read_ply(bytes, "m", &stats);
  EXPECT_EQ(mesh.points,
            (std::vector<Vec3>{{0, 40000, 0}, {-300, 40001, 1}, {-600, 40002, INT32_MIN}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 0, 1}}));
  EXPECT_EQ(mesh.part, (std::vector<std::int32_t>{5}));
  EXPECT_EQ(mesh.texcoords[0][5], 1.25f);
  EXPECT_EQ(stats.skipped_elements, 1u);
  EXPECT_EQ(stats.skipped_properties, 2u);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_NE(complaint(bytes.substr(0, size)), "");
}

TEST(Ply, PolygonsKeepTheirAttributes) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement face 3\nproperty list uchar int vertex_indices\n"
      "property list uchar float texcoord\nproperty int part\nproperty int material\n"
      "element vertex 5\nproperty double x\nproperty double y\nproperty double z\nend_header\n"
      "3 0 1 2 6 0 0 1 0 2 0 1 5\n"
      "4 3 0 1 2 8 3 3 0 0 1 1 2 2 2 6\n" // concave: the reflex corner is 1, opposite to 3
      "3 2 1 4 6 2 0 1 0 4 0 3 7\n"
      "0 -3 0\n-1 0 0\n0 3 0\n-4 0 0\n9 0 0\n"; // faces before vertices
  const TriangleMesh mesh = formats::read_ply(text, "m");
  ASSERT_EQ(mesh.triangles.size(), 4u);
  EXPECT_EQ(mesh.part, (std::vector<std::int32_t>{1, 2, 2, 3}));
  EXPECT_EQ(mesh.material, (std::vector<std::int32_t>{5, 6, 6, 7}));
  for (const std::size_t t : {1u, 2u}) {
    // The cut goes between 3 and 1, so both triangles have these corners; s was written as the
    // index.
    std::array<bool, 5> has{};
    for (std::size_t k = 0; k < 3; ++k) {
      has[mesh.triangles[t][k]] = true;
      EXPECT_EQ(mesh.texcoords[t][2 * k], static_cast<float>(mesh.triangles[t][k]));
      EXPECT_EQ(mesh.texcoords[t][2 * k + 1], static_cast<float>(mesh.triangles[t][k]));
    }
    EXPECT_TRUE(has[1] && has[3]);
  }
}

TEST(Ply, NormalsBecomeUnit) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                     "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                     "end_header\n0 0 0 0 3 4\n0 0 0 0 0 0\n0 0 0 1.000001 0 0\n";
  const TriangleMesh mesh = formats::read_ply(text, "m");
  EXPECT_EQ(mesh.normals[0], (std::array<float, 3>{0, 0.6f, 0.8f}));
  EXPECT_EQ(mesh.normals[1], (std::array<float, 3>{0, 0, 0}));
  EXPECT_EQ(mesh.normals[2][0], 1.000001f);
  EXPECT_NE(complaint(replaced(text, "0 3 4", "0 nan 4")), "");
}

TEST(Ply, PointsAloneAndNothingAreMeshes) {
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                           "property float y\nproperty float z\nend_header\n";
  EXPECT_EQ(formats::read_ply(head + "1 2 3", "m").points, (std::vector<Vec3>{{1, 2, 3}}));
  EXPECT_EQ(complaint(replaced(head, "vertex 1", "vertex 0")), "");
}

TEST(Ply, BadContentIsNamedWithItsPlace) {
  const std::string good = ascii_square();
  const auto spoiled = [&](const std::string& from, const std::string& to) {
    return complaint(replaced(good, from, to));
  };
  EXPECT_EQ(spoiled("4 0 1 2 3", "4 0 1 2 4"),
            "m.ply:14: a face with corner 4, expected an index below 4");
  EXPECT_EQ(spoiled("4 0 1 2 3", "4 0 1 2 -1"),
            "m.ply:14: a face with corner -1, expected an index below 4");
  EXPECT_NE(spoiled("4 0 1 2 3", "4 0 1 2 1.5"), "");
  EXPECT_NE(spoiled("4 0 1 2 3", "2 0 1"), "");
  EXPECT_NE(spoiled("4 0 1 2 3", "-1 0 1"), "");
  EXPECT_NE(spoiled("4 0 1 2 3", "4294967295 0 1"), "");
  EXPECT_NE(spoiled("4 0 1 2 3", "1e300 0 1"), "");
  EXPECT_EQ(spoiled("1 1 0", "1 nan 0"), "m.ply:12: y is not finite, expected a finite number");
  EXPECT_EQ(spoiled("1 1 0", "1 inf 0"), "m.ply:12: y is not finite, expected a finite number");
  EXPECT_EQ(spoiled("1 1 0", "1 1e999 0"), "m.ply:12: \"1e999\", expected a number");
  EXPECT_EQ(spoiled("1 1 0", "1 +1 0"), "");
  EXPECT_EQ(spoiled("1 1 0", "1 +-1 0"), "m.ply:12: \"+-1\", expected a number");
  EXPECT_EQ(spoiled("1 1 0", "1 0x1 0"), "m.ply:12: \"0x1\", expected a number");
  EXPECT_EQ(spoiled("1 1 0", "1 1"), "m.ply:12: the line ends here, expected another number");
  EXPECT_EQ(spoiled("face 1", "face 2"),
            "m.ply:13: 2 elements \"face\" in 11 bytes, expected at least 8 bytes for each");
  EXPECT_EQ(complaint(replaced(ascii_square("4 0 1 2 3", "       \n"), "face 1", "face 2")),
            "m.ply:16: the file ends here, expected another face");
  EXPECT_EQ(spoiled("vertex 4", "vertex 18446744073709551615").substr(0, 8), "m.ply:9:");
  EXPECT_NE(spoiled("vertex 4", "vertex 18446744073709551616"), "");
  EXPECT_NE(spoiled("vertex 4", "vertex -4"), "");
  EXPECT_NE(spoiled("vertex 4", "vertex 4x"), "");
  EXPECT_NE(spoiled("property float x\n", ""), "");
  EXPECT_NE(spoiled("float x", "list uchar float x"), "");
  EXPECT_NE(spoiled("float y", "float x"), "");
  EXPECT_NE(spoiled("float x", "half x"), "");
  EXPECT_NE(spoiled("list uchar int vertex_indices", "int vertex_indices"), "");
  EXPECT_NE(spoiled("list uchar int vertex_indices", "list float int vertex_indices"), "");
  EXPECT_NE(spoiled("element face 1", "element vertex 1"), "");
  EXPECT_NE(spoiled("format ascii 1.0", "format ascii 2.0"), "");
  EXPECT_NE(spoiled("format ascii 1.0", "format ebcdic 1.0"), "");
  EXPECT_NE(spoiled("format ascii 1.0\n", ""), "");
  EXPECT_NE(spoiled("ply\n", "plx\n"), "");
  EXPECT_EQ(spoiled("property float y", std::string("ele\x1b\nment")),
            "m.ply:5: \"ele?\", expected element, property, comment or end_header");
}

TEST(Ply, CountsBeyondTheBytesAreRefusedBeforeRoomIsTaken) {
  const std::string good = formats::write_ply(tetrahedron());
  EXPECT_NE(complaint(replaced(good, "vertex 4", "vertex 4000000000")), "");
  EXPECT_NE(complaint(replaced(good, "face 4", "face 4000000000")), "");
  EXPECT_NE(complaint(replaced(good, "face 4", "face 5")), "");
  EXPECT_NE(complaint(replaced(good, "face 4", "face 3")), "");
  // An element without property takes no bytes, however many there are.
  EXPECT_EQ(
      complaint(replaced(good, "element face", "element none 18446744073709551615\nelement face")),
      "");
  std::string list = good;
  list[list.size() - 13] = static_cast<char>(255); // the last face's count
  EXPECT_NE(complaint(list), "");
}

TEST(Ply, TexcoordsMustFitTheCorners) {
  const std::string text = replaced(ascii_square("3 0 1 2 6 0 0 0 0 0 0"), "vertex_indices\n",
                                    "vertex_indices\nproperty list uchar float texcoord\n");
  EXPECT_EQ(complaint(text), "");
  EXPECT_NE(complaint(replaced(text, "6 0 0 0 0 0 0", "4 0 0 0 0")), "");
  EXPECT_NE(complaint(replaced(text, "6 0 0 0 0 0 0", "6 0 0 0 0 0 1e39")), "");
  EXPECT_NE(complaint(replaced(text, "6 0 0 0 0 0 0", "6 0 0 0 0 0 nan")), "");
}
