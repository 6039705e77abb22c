// Surfaces of VTK: read however they are stored, refused where they are broken.

#include "base/error.h"
#include "formats/mesh/mesh_file.h"
#include "formats/mesh/vtp.h"
#include "formats/stream/kind.h"
#include "geometry/mesh.h"
#include "tests/unit/complaint.h"
#include "vtk_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

/// A cube of edge 2 at a place whose digits need doubles: two squares (below and above), a strip
/// round the sides or four squares there, and a vertex and a line first.
struct Cube {
  bool strip = false, numbers = false, texture = false;
};

const std::vector<Vec3> corners{{0.1, 0, 0}, {2.1, 0, 0}, {2.1, 2, 0}, {0.1, 2, 0},
                                {0.1, 0, 2}, {2.1, 0, 2}, {2.1, 2, 2}, {0.1, 2, 2}};

std::string vtp(const Cube& cube, const test::VtkStyle& style) {
  const std::size_t squares = cube.strip ? 2 : 6;
  test::VtkWriter out(style, "PolyData",
                      "NumberOfPoints='8' NumberOfVerts='1' NumberOfLines='1' NumberOfStrips='" +
                          std::to_string(cube.strip ? 1 : 0) + "' NumberOfPolys='" +
                          std::to_string(squares) + "'");
  out.text(cube.texture ? "\n<PointData TCoords='uv' Scalars='x'>\n" : "\n<PointData>\n");
  out.array("Float32", "x", std::vector<float>(8, 7));
  std::vector<float> uv;
  for (const Vec3& p : corners)
    uv.insert(uv.end(), {static_cast<float>(p.x), static_cast<float>(p.y)});
  if (cube.texture)
    out.array("Float32", "uv", uv, 2);
  out.text("</PointData>\n<CellData>\n");
  if (cube.numbers) {
    std::vector<std::int32_t> part{9, 9}, material{8, 8};
    for (std::size_t s = 0; s < squares; ++s) {
      part.push_back(s < 2 ? 0 : 1);
      material.push_back(static_cast<std::int32_t>(s));
    }
    out.array("Int32", "part", part);
    out.array("Int16", "material", std::vector<std::int16_t>(material.begin(), material.end()));
  }
  out.text("</CellData>\n<Points>\n");
  std::vector<double> points;
  for (const Vec3& p : corners)
    points.insert(points.end(), {p.x, p.y, p.z});
  out.array("Float64", "Points", points, 3);
  const auto cells = [&](const char* section, const std::vector<std::int64_t>& nodes,
                         const std::vector<std::int32_t>& ends) {
    out.text(std::string("<") + section + ">\n");
    out.array("Int64", "connectivity", nodes);
    out.array("Int32", "offsets", ends);
    out.text(std::string("</") + section + ">\n");
  };
  out.text("</Points>\n");
  cells("Verts", {3}, {1});
  cells("Lines", {0, 6}, {2});
  cells("Strips",
        cube.strip ? std::vector<std::int64_t>{4, 0, 5, 1, 6, 2, 7, 3, 4, 0}
                   : std::vector<std::int64_t>{},
        cube.strip ? std::vector<std::int32_t>{10} : std::vector<std::int32_t>{});
  std::vector<std::int64_t> nodes{0, 3, 2, 1, 4, 5, 6, 7};
  std::vector<std::int32_t> ends{4, 8};
  if (!cube.strip) {
    nodes.insert(nodes.end(), {0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7});
    ends.insert(ends.end(), {12, 16, 20, 24});
  }
  cells("Polys", nodes, ends);
  return out.end();
}

std::string complaint(const std::string& bytes) {
  return test::complaint([&] { return formats::read_vtp(bytes, "m"); });
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::vector<test::VtkStyle> all_styles() {
  std::vector<test::VtkStyle> styles = test::binary_vtk_styles();
  styles.emplace_back();
  styles.back().text = true;
  return styles;
}

TEST(Vtp, HoweverItIsStored) {
  for (const test::VtkStyle& style : all_styles())
    for (const bool strip : {false, true}) {
      const std::string bytes = vtp({.strip = strip}, style);
      EXPECT_EQ(formats::kind_from_magic(bytes.substr(0, 4096)), formats::Kind::vtp);
      ASSERT_EQ(complaint(bytes), "") << bytes.substr(0, 600);
      formats::VtpStats stats;
      const TriangleMesh mesh = formats::read_vtp(bytes, "m", &stats);
      EXPECT_EQ(mesh.points, corners);
      EXPECT_EQ(mesh.triangles.size(), 12U);
      EXPECT_NEAR(signed_volume(mesh), 8, 1e-14);
      EXPECT_NEAR(surface_area(mesh), 24, 1e-14);
      EXPECT_EQ(stats.polygons, strip ? 2U : 6U);
      EXPECT_EQ(stats.skipped_primitives, 2U);
      EXPECT_TRUE(mesh.part.empty() && mesh.material.empty() && mesh.texcoords.empty());
    }
}

TEST(Vtp, PartsMaterialsAndTexture) {
  for (const test::VtkStyle& style : all_styles()) {
    const TriangleMesh mesh =
        formats::read_vtp(vtp({.numbers = true, .texture = true}, style), "m");
    ASSERT_EQ(mesh.part.size(), 12U);
    ASSERT_EQ(mesh.material.size(), 12U);
    ASSERT_EQ(mesh.texcoords.size(), 12U);
    for (std::size_t t = 0; t < 12; ++t) {
      EXPECT_EQ(mesh.part[t], t < 4 ? 0 : 1);
      EXPECT_EQ(mesh.material[t], static_cast<std::int32_t>(t / 2));
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = mesh.points[mesh.triangles[t][k]];
        EXPECT_NEAR(mesh.texcoords[t][2 * k], p.x, 1e-5);
        EXPECT_NEAR(mesh.texcoords[t][2 * k + 1], p.y, 1e-5);
      }
    }
  }
}

TEST(Vtp, EveryPrefixIsAnError) {
  for (const test::VtkStyle& style : all_styles()) {
    const std::string bytes = vtp({.numbers = true, .texture = true}, style);
    const std::size_t whole = bytes.size() - 1; // but for the end of the line
    for (std::size_t size = 0; size < whole; size += size < whole - 40 ? 7 : 1)
      EXPECT_NE(complaint(bytes.substr(0, size)), "") << size;
  }
}

// Whatever bytes change, the answer is an error or a mesh.
TEST(Vtp, DamageIsSeenOrHarmless) {
  std::mt19937 random(7);
  for (const test::VtkStyle& style : all_styles()) {
    const std::string bytes = vtp({.numbers = true, .texture = true}, style);
    for (int n = 0; n < 400; ++n) {
      std::string damaged = bytes;
      for (int k = 0; k < 1 + n % 3; ++k)
        damaged[random() % damaged.size()] = static_cast<char>(random());
      try {
        check_mesh(formats::read_vtp(damaged, "m"));
      } catch (const Error&) { // what damage is for
      }
    }
  }
}

TEST(Vtp, ErrorsNamePlaceAndFault) {
  test::VtkStyle style;
  style.text = true;
  const std::string text = vtp({.numbers = true}, style);
  const auto with = [&](const char* from, const char* to) {
    return complaint(replaced(text, from, to));
  };
  EXPECT_EQ(complaint(text), "");
  EXPECT_EQ(with("NumberOfPoints='8'", "NumberOfPoints='4294967295'"),
            "m: NumberOfPoints is 4294967295, expected less than 4294967295");
  EXPECT_NE(
      with("NumberOfPoints='8'", "NumberOfPoints='4000000000'").find("12000000000 numbers in"),
      std::string::npos);
  EXPECT_NE(with("NumberOfPoints='8'", "NumberOfPoints='7'").find("more than 21 numbers"),
            std::string::npos);
  EXPECT_EQ(with("NumberOfPoints='8'", "NumberOfPoints='-8'"),
            "m:3: NumberOfPoints is \"-8\", expected an integer from 0");
  EXPECT_NE(with("NumberOfPolys='6'", "NumberOfPolys='5'").find("more than 7 numbers"),
            std::string::npos);
  EXPECT_NE(
      with("NumberOfPolys='6'", "NumberOfPolys='4000000000'").find("expected a count that fits"),
      std::string::npos);
  EXPECT_EQ(with("\n0\n3\n2\n1\n", "\n0\n3\n8\n1\n"),
            "m: polygon 0: point 8, expected 0 to below 8");
  EXPECT_EQ(with("\n0\n3\n2\n1\n", "\n0\n3\n-2\n1\n"),
            "m: polygon 0: point -2, expected 0 to below 8");
  EXPECT_NE(with("\n4\n8\n12\n", "\n4\n2\n12\n").find("offset 2 of cell 1, expected 4 or more"),
            std::string::npos);
  EXPECT_NE(with("\n4\n8\n12\n", "\n-4\n8\n12\n").find("offset -4 of cell 0, expected 0 or more"),
            std::string::npos);
  EXPECT_NE(with("\n4\n8\n12\n16\n20\n24\n", "\n4\n8\n12\n16\n20\n60000000000\n")
                .find("expected a count that fits"),
            std::string::npos);
  EXPECT_EQ(with("\n4\n8\n12\n", "\n2\n8\n12\n"), "m: polygon 0: 2 points, expected 3 or more");
  EXPECT_NE(with("\n9\n9\n0\n", "\n9\n9\n-1\n").find("part -1 of cell 2, expected 0 to 2147483647"),
            std::string::npos);
  EXPECT_EQ(with("<Polys>", "<Pullys>").substr(0, 3), "m:1");
  EXPECT_EQ(replaced(text, "'PolyData'", "'ImageData'").find("'PolyData'"), std::string::npos);
  EXPECT_EQ(with("'PolyData'", "'ImageData'"), "m:2: expected <VTKFile type=\"PolyData\">");
  EXPECT_EQ(
      with("Float64' Name='Points' NumberOfComponents='3'", "Float64' Name='Points'").substr(0, 4),
      "m:39");
  EXPECT_NE(with("0.100000", "nan").find("finite number"), std::string::npos);
  EXPECT_EQ(with("<Polys>\n<DataArray type='Int64' Name='connectivity'",
                 "<Polys>\n<DataArray type='Int64' Name='other'"),
            "m: no DataArray Polys/connectivity, expected one");
  const std::string strips = vtp({.strip = true, .numbers = true}, style);
  EXPECT_NE(complaint(strips).find("part of polygons and of strips, expected one of them"),
            std::string::npos);
}

// A count that the bytes can't hold costs no memory: the sizes are the file's own claims.
TEST(Vtp, HugeClaimsCostNothing) {
  for (const test::VtkStyle& style : all_styles())
    for (const auto& [from, to] : {std::pair("NumberOfPoints='8'", "NumberOfPoints='4000000000'"),
                                   std::pair("NumberOfPolys='6'", "NumberOfPolys='4000000000'")})
      EXPECT_NE(complaint(replaced(vtp({}, style), from, to)), "");
}

TEST(Vtp, IsAKindOfMesh) {
  EXPECT_EQ(formats::kind_from_suffix("a.VTP"), formats::Kind::vtp);
  EXPECT_EQ(formats::kind_from_name("vtp"), formats::Kind::vtp);
  EXPECT_EQ(std::ranges::count(formats::readable_mesh_kinds(), formats::Kind::vtp), 1);
}

} // namespace
} // namespace gewebe::test
