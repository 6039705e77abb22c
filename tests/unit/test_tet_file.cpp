// Tetrahedral meshes through files: what we write comes back bit for bit, what others write is
// read, what is broken is one error.

#include "base/error.h"
#include "formats/mesh/ply.h"
#include "formats/tetrahedra/tet_file.h"
#include "scratch.h"
#include "tests/unit/complaint.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "vtk_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::put;
using test::same_bytes;

const std::vector<formats::Kind> in_memory{formats::Kind::ply,   formats::Kind::vtu,
                                           formats::Kind::msh,   formats::Kind::msh4,
                                           formats::Kind::medit, formats::Kind::vtk};

std::string complaint(const std::string& bytes, formats::Kind kind) {
  return test::complaint([&] { return formats::tet_mesh_from_bytes(bytes, "m", kind); });
}

std::string complaint(const formats::TetgenFiles& bytes) {
  return test::complaint([&] { return formats::tet_mesh_from_tetgen(bytes, {"m.node", "m.ele"}); });
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// Two tetrahedra with a face in common, by nodes with every kind of double.
tetrahedra::TetMesh strange() {
  tetrahedra::TetMesh mesh;
  mesh.points = {{0.1, -0.0, 1e-300}, {1.0 / 3, 5e-324, 0},     {0, M_PI, -1e300},
                 {-7, 1, 2},          {1e22, 123456789.125, 1}, {0, 0, 0}};
  mesh.tetrahedra = {{0, 1, 2, 3}, {1, 4, 3, 2}};
  return mesh;
}

/// All meshes that a round trip is made of.
std::vector<tetrahedra::TetMesh> meshes() {
  std::vector<tetrahedra::TetMesh> all{strange()};
  for (const bool quadratic : {false, true})
    for (const bool material : {false, true})
      all.push_back(test::odd_tetrahedra(quadratic, material));
  all.push_back(strange()); // the largest material, and none of 0
  all.back().material = {INT32_MAX, 3};
  all.push_back(strange()); // 0 where 1, the first entity, is taken
  all.back().material = {1, 0};
  all.push_back({}); // nothing at all
  all.back().points = {{1, 2, 3}};
  return all;
}

// ---- What we write

TEST(TetFile, RoundTripsBitForBit) {
  int n = 0;
  for (const tetrahedra::TetMesh& mesh : meshes()) {
    for (const formats::Kind kind : in_memory) {
      const std::string bytes = formats::tet_mesh_bytes(mesh, kind);
      formats::TetReadStats stats;
      const tetrahedra::TetMesh again = formats::tet_mesh_from_bytes(bytes, "m", kind, &stats);
      EXPECT_TRUE(same_bytes(again, mesh)) << n << " " << formats::kind_name(kind);
      EXPECT_EQ(formats::tet_mesh_bytes(again, kind), bytes)
          << n << " " << formats::kind_name(kind);
      EXPECT_EQ(stats.skipped_elements + stats.skipped_properties, 0U);
      const formats::Kind told = formats::kind_from_magic(bytes.substr(0, 4096));
      EXPECT_EQ(told, kind == formats::Kind::msh4 ? formats::Kind::msh : kind);
      EXPECT_TRUE(formats::holds_tetrahedra(bytes.substr(0, 4096), told));
    }
    const formats::TetgenFiles files = formats::tetgen_bytes(mesh);
    const tetrahedra::TetMesh again = formats::tet_mesh_from_tetgen(files, {"m.node", "m.ele"});
    EXPECT_TRUE(mesh.tetrahedra.empty() || same_bytes(again, mesh)) << n;
    EXPECT_TRUE(same_bytes(again.points, mesh.points)) << n;
    ++n;
  }
}

TEST(TetFile, MaterialThatIsZeroEverywhere) {
  tetrahedra::TetMesh mesh = strange();
  mesh.material = {0, 0};
  for (const formats::Kind kind :
       {formats::Kind::ply, formats::Kind::vtu, formats::Kind::msh, formats::Kind::msh4})
    EXPECT_TRUE(same_bytes(
        formats::tet_mesh_from_bytes(formats::tet_mesh_bytes(mesh, kind), "m", kind), mesh));
  EXPECT_TRUE(
      same_bytes(formats::tet_mesh_from_tetgen(formats::tetgen_bytes(mesh), {"n", "e"}), mesh));
  EXPECT_TRUE(
      same_bytes(formats::tet_mesh_from_bytes(formats::tet_mesh_bytes(mesh, formats::Kind::medit),
                                              "m", formats::Kind::medit),
                 strange()));
}

TEST(TetFile, PlyShowsTheBoundaryAsFaces) {
  const tetrahedra::TetMesh mesh = test::box_tetrahedra(2, 2, 2);
  const std::string bytes = formats::tet_mesh_bytes(mesh, formats::Kind::ply);
  EXPECT_TRUE(bytes.starts_with(
      "ply\nformat binary_little_endian 1.0\ncomment gewebe_tetmesh, millimetres\n"
      "element vertex 27\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 48\nproperty list uchar int vertex_indices\n"
      "element tetrahedron 48\nproperty list uchar int vertex_indices\nend_header\n"));
  const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
  const TriangleMesh seen = formats::read_ply(bytes, "m");
  EXPECT_EQ(seen.points, mesh.points);
  ASSERT_EQ(seen.triangles.size(), surface.mesh.triangles.size());
  for (std::size_t f = 0; f < seen.triangles.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(seen.triangles[f][k], surface.node[surface.mesh.triangles[f][k]]);
  EXPECT_FALSE(
      formats::holds_tetrahedra("ply\nformat ascii 1.0\nelement face 3\nend_header\n\nelement "
                                "tetrahedron 1",
                                formats::Kind::ply));
}

TEST(TetFile, TetgenIsTwoFilesByEitherName) {
  const tetrahedra::TetMesh mesh = test::odd_tetrahedra(true, true);
  for (const std::string suffix : {".node", ".ele"}) {
    const ScratchFile file(suffix);
    const std::string stem = file.path().substr(0, file.path().size() - suffix.size());
    const std::string other = stem + (suffix == ".node" ? ".ele" : ".node");
    {
      formats::Output output(file.path(), {});
      formats::write_tet_mesh(output, mesh, formats::kind_from_suffix(file.path()));
      output.commit();
    }
    for (const std::string& name : {file.path(), other}) {
      formats::Input input(name);
      formats::TetReadOptions options;
      options.kind = formats::input_kind(input.peek(4096), name, "");
      EXPECT_EQ(options.kind, formats::Kind::tetgen);
      EXPECT_TRUE(same_bytes(formats::read_tet_mesh(input, options), mesh));
    }
    (void)std::remove(other.c_str());
    try {
      formats::Input input(file.path());
      (void)formats::read_tet_mesh(input, {.kind = formats::Kind::tetgen});
      FAIL() << "half a mesh was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.place(), other);
    }
  }
  const ScratchFile file(".txt");
  formats::Output output(file.path(), {});
  EXPECT_THROW(formats::write_tet_mesh(output, mesh, formats::Kind::tetgen), Error);
}

TEST(TetFile, ScalesAndDropsWhereAsked) {
  const ScratchFile file(".vtu");
  tetrahedra::TetMesh mesh = test::box_tetrahedra(1, 1, 1);
  mesh.points.insert(mesh.points.begin(), {7, 7, 7});
  for (Tetrahedron& t : mesh.tetrahedra)
    for (std::uint32_t& node : t)
      ++node;
  formats::Output output(file.path(), {});
  formats::write_tet_mesh(output, mesh, formats::Kind::vtu);
  output.commit();
  formats::Input input(file.path());
  formats::TetReadStats stats;
  const tetrahedra::TetMesh read = formats::read_tet_mesh(
      input, {.kind = formats::Kind::vtu, .scale = 10, .drop_unused = true}, &stats);
  EXPECT_EQ(stats.dropped_points, 1U);
  EXPECT_EQ(read.tetrahedra, test::box_tetrahedra(1, 1, 1).tetrahedra);
  EXPECT_EQ(read.points, test::box_tetrahedra(1, 1, 1, 10).points);
}

TEST(TetFile, KindsByName) {
  EXPECT_EQ(formats::kind_from_suffix("a.VTU"), formats::Kind::vtu);
  EXPECT_EQ(formats::kind_from_suffix("a.msh"), formats::Kind::msh);
  EXPECT_EQ(formats::kind_from_suffix("a.mesh"), formats::Kind::medit);
  EXPECT_EQ(formats::kind_from_suffix("a.1.node"), formats::Kind::tetgen);
  EXPECT_EQ(formats::kind_from_suffix("a.1.ele"), formats::Kind::tetgen);
  EXPECT_EQ(formats::kind_from_suffix("a.vtk"), formats::Kind::vtk);
  EXPECT_EQ(formats::kind_from_suffix("a.INP"), formats::Kind::inp);
  EXPECT_EQ(formats::kind_from_magic("# vtk DataFile Version 3.0\n"), formats::Kind::vtk);
  EXPECT_EQ(formats::kind_from_suffix("a.msh4"), formats::Kind::unknown);
  EXPECT_EQ(formats::kind_from_suffix("a.tetgen"), formats::Kind::unknown);
  for (const formats::Kind kind : formats::writable_tet_kinds())
    EXPECT_EQ(formats::kind_from_name(formats::kind_name(kind)), kind);
  EXPECT_EQ(formats::kind_from_name("mesh"), formats::Kind::ply);
  EXPECT_EQ(formats::kind_from_magic("<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\">"),
            formats::Kind::vtp);
  EXPECT_EQ(formats::kind_from_magic("<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\">"),
            formats::Kind::unknown);
  EXPECT_EQ(formats::kind_from_magic("# a\n\nMeshVersionFormatted 2"), formats::Kind::medit);
  EXPECT_EQ(complaint("", formats::Kind::obj),
            "m: obj has no tetrahedra, expected one of ply, vtu, msh, medit, tetgen, vtk, inp by "
            "content, suffix or --format");
}

// Abaqus and CalculiX read 20 characters of a number: what is longer is rounded, once.
TEST(TetFile, InpHasNumbersOf20Characters) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(1, 1, 1);
  mesh.points[0] = {-1.2345678901234567e-5, 0.1, 1.0 / 3};
  const std::string bytes = formats::tet_mesh_bytes(mesh, formats::Kind::inp);
  EXPECT_NE(bytes.find("1, -1.2345678901235e-05, 0.1, 0.3333333333333333\n"), std::string::npos)
      << bytes;
  const tetrahedra::TetMesh again = formats::tet_mesh_from_bytes(bytes, "m", formats::Kind::inp);
  EXPECT_EQ(again.tetrahedra, mesh.tetrahedra);
  EXPECT_NEAR(again.points[0].x, mesh.points[0].x, 1e-18);
  EXPECT_EQ(again.points[1], mesh.points[1]);
  EXPECT_EQ(formats::tet_mesh_bytes(again, formats::Kind::inp), bytes);
}

// ---- What others write

const char* const gmsh2 =
    "$Comments\nby hand\n$EndComments\n$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
    "$PhysicalNames\n1\n3 7 \"a b\"\n$EndPhysicalNames\n"
    "$Nodes\n5\n10 0 0 0\n3 1 0 0\n4 0 1 0\n5 0 0 1\n99 1 1 1.5e0\n$EndNodes\n"
    "$Elements\n4\n1 15 2 0 1 10\n2 2 2 1 1 10 3 4\n3 4 3 7 1 0 10 3 4 5\n"
    "4 4 2 8 2 3 4 5 99\n$EndElements\n";

TEST(TetFile, GmshByHand) {
  formats::TetReadStats stats;
  const tetrahedra::TetMesh mesh =
      formats::tet_mesh_from_bytes(gmsh2, "m", formats::Kind::msh, &stats);
  EXPECT_EQ(stats.skipped_elements, 2U);
  EXPECT_EQ(mesh.tetrahedra, (std::vector<Tetrahedron>{{0, 1, 2, 3}, {1, 2, 3, 4}}));
  EXPECT_EQ(mesh.material, (std::vector<std::int32_t>{7, 8}));
  EXPECT_EQ(mesh.points[4], Vec3({1, 1, 1.5}));
  EXPECT_EQ(formats::kind_from_magic(gmsh2), formats::Kind::msh);
  // Without groups it is the entities, if there are several.
  std::string text =
      replaced(replaced(gmsh2, "3 4 3 7 1 0", "3 4 2 0 1"), "4 4 2 8 2", "4 4 2 0 2");
  EXPECT_EQ(formats::tet_mesh_from_bytes(text, "m", formats::Kind::msh).material,
            (std::vector<std::int32_t>{1, 2}));
  text = replaced(text, "4 4 2 0 2", "4 4 2 0 1");
  EXPECT_TRUE(formats::tet_mesh_from_bytes(text, "m", formats::Kind::msh).material.empty());
  text = replaced(text, "4 4 2 0 1", "4 4 0"); // no tags at all
  EXPECT_EQ(formats::tet_mesh_from_bytes(text, "m", formats::Kind::msh).tetrahedra.size(), 2U);
}

/// Gmsh writes a negative group for an entity of reversed orientation.
TEST(TetFile, GmshNegativePhysicalGroups) {
  const std::string text =
      replaced(replaced(gmsh2, "3 4 3 7 1 0", "3 4 3 -7 1 0"), "4 4 2 8 2", "4 4 2 -8 2");
  EXPECT_EQ(complaint(text, formats::Kind::msh), "");
  EXPECT_EQ(formats::tet_mesh_from_bytes(text, "m", formats::Kind::msh).material,
            (std::vector<std::int32_t>{7, 8}));
}

const char* const gmsh4 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
    "$Entities\n1 0 0 2\n1 0 0 0 0\n4 0 0 0 1 1 1 2 9 8 0\n5 0 0 0 1 1 1 0 0\n$EndEntities\n"
    "$Nodes\n2 5 3 99\n0 1 0 1\n10\n0 0 0\n3 4 1 4\n3\n4\n5\n99\n1 0 0 .1 .2 .3\n0 1 0 0 0 0\n"
    "0 0 1 0 0 0\n1 1 1.5 0 0 0\n$EndNodes\n"
    "$Elements\n3 3 1 3\n0 1 15 1\n1 10\n3 4 4 1\n2 10 3 4 5\n3 5 4 1\n3 3 4 5 99\n$EndElements\n"
    "$NodeData\nanything 1 2 3\n$EndNodeData\n";

TEST(TetFile, Gmsh4ByHand) {
  formats::TetReadStats stats;
  const tetrahedra::TetMesh mesh =
      formats::tet_mesh_from_bytes(gmsh4, "m", formats::Kind::msh, &stats);
  EXPECT_EQ(stats.skipped_elements, 1U);
  EXPECT_EQ(mesh.tetrahedra, (std::vector<Tetrahedron>{{0, 1, 2, 3}, {1, 2, 3, 4}}));
  EXPECT_EQ(mesh.material, (std::vector<std::int32_t>{9, 0}));
  const std::string turned = replaced(gmsh4, "2 9 8 0", "2 -9 8 0");
  EXPECT_EQ(complaint(turned, formats::Kind::msh), "");
  EXPECT_EQ(formats::tet_mesh_from_bytes(turned, "m", formats::Kind::msh).material,
            (std::vector<std::int32_t>{9, 0}));
}

TEST(TetFile, GmshBinaryOfVersion2AndTheOtherEndian) {
  for (const bool swap : {false, true}) {
    const tetrahedra::TetMesh mesh = test::odd_tetrahedra(true, true);
    std::string bytes = "$MeshFormat\n2.2 1 8\n";
    put(bytes, std::int32_t{1}, swap);
    bytes += "\n$EndMeshFormat\n$Nodes\n" + std::to_string(mesh.points.size()) + "\n";
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
      put(bytes, static_cast<std::int32_t>(p + 5), swap);
      for (const double x : {mesh.points[p].x, mesh.points[p].y, mesh.points[p].z})
        put(bytes, x, swap);
    }
    bytes += "\n$EndNodes\n$Elements\n" + std::to_string(mesh.tetrahedra.size() + 1) + "\n";
    const auto integers = [&](const std::vector<std::uint32_t>& numbers) {
      for (const std::uint32_t number : numbers)
        put(bytes, number, swap);
    };
    integers({2, 1, 2, 1, 5, 6, 7, 5, 6});
    integers({11, static_cast<std::uint32_t>(mesh.tetrahedra.size()), 2});
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      const Tetrahedron& c = mesh.tetrahedra[t];
      const EdgeMiddles& m = mesh.middles[t];
      integers({static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(mesh.material[t]), 1,
                c[0] + 5, c[1] + 5, c[2] + 5, c[3] + 5, m[0] + 5, m[1] + 5, m[2] + 5, m[3] + 5,
                m[5] + 5, m[4] + 5});
    }
    bytes += "\n$EndElements\n";
    formats::TetReadStats stats;
    EXPECT_TRUE(
        same_bytes(formats::tet_mesh_from_bytes(bytes, "m", formats::Kind::msh, &stats), mesh));
    EXPECT_EQ(stats.skipped_elements, 1U);
  }
}

const char* const medit = "MeshVersionFormatted\n1 # a comment\n\nDimension\n3\n"
                          "Vertices 4 0 0 0 1  1 0 0 1  0 1 0 1  0 0 1 1\n"
                          "Edges 1 1 2 3\nTriangles\n2\n1 2 3 4\n2 3 4 0\nCorners 2 1 2\n"
                          "Normals 1\n 0.5 -1e-3 2\n"
                          "Tetrahedra\n1\n1 2 3 4 12\nHexahedra 0\nEnd\n";

TEST(TetFile, MeditByHand) {
  formats::TetReadStats stats;
  const tetrahedra::TetMesh mesh =
      formats::tet_mesh_from_bytes(medit, "m", formats::Kind::medit, &stats);
  EXPECT_EQ(stats.skipped_elements, 3U);
  EXPECT_EQ(mesh.tetrahedra, (std::vector<Tetrahedron>{{0, 1, 2, 3}}));
  EXPECT_EQ(mesh.material, (std::vector<std::int32_t>{12}));
  EXPECT_NEAR(tetrahedra::volume(mesh), 1.0 / 6, 1e-16);
}

TEST(TetFile, TetgenByHand) {
  const formats::TetgenFiles files{
      "# nodes\n4 3 1 1\n1 0 0 0 0.5 1 # first\n2 1 0 0 0.5 1\n\n3 0 1 0 .5 0\n"
      "4 0 0 1 -1 0\n",
      "1 4 2\n1 1 2 3 4 6 0.25\n# the end\n"};
  const tetrahedra::TetMesh mesh = formats::tet_mesh_from_tetgen(files, {"m.node", "m.ele"});
  EXPECT_EQ(mesh.tetrahedra, (std::vector<Tetrahedron>{{0, 1, 2, 3}}));
  EXPECT_EQ(mesh.material, (std::vector<std::int32_t>{6}));
}

const char* const by_hand_ply =
    "ply\nformat ascii 1.0\nelement tetrahedron 1\nproperty uchar material\n"
    "property list uchar uint vertex_index\nproperty float quality\nelement vertex 4\n"
    "property float z\nproperty float y\nproperty float x\nproperty float nx\n"
    "element edge 1\nproperty int a\nend_header\n3 4 0 1 2 3 0.5\n0 0 0 1\n0 0 1 1\n0 1 0 1\n"
    "1 0 0 1\n5\n";

TEST(TetFile, PlyByHand) {
  formats::TetReadStats stats;
  const tetrahedra::TetMesh mesh =
      formats::tet_mesh_from_bytes(by_hand_ply, "m", formats::Kind::ply, &stats);
  EXPECT_EQ(stats.skipped_elements, 1U);
  EXPECT_EQ(stats.skipped_properties, 2U);
  EXPECT_EQ(mesh.material, (std::vector<std::int32_t>{3}));
  EXPECT_NEAR(tetrahedra::volume(mesh), 1.0 / 6, 1e-16);
}

// ---- VTU, however it is stored

/// The mesh, behind a triangle.
std::string vtu(const tetrahedra::TetMesh& mesh, const test::VtkStyle& style) {
  std::vector<double> points;
  std::vector<std::int64_t> nodes, offsets, types, material;
  for (const Vec3& p : mesh.points)
    points.insert(points.end(), {p.x, p.y, p.z});
  nodes = {0, 1, 2};
  offsets = {3};
  types = {5};
  material = {77};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    nodes.insert(nodes.end(), mesh.tetrahedra[t].begin(), mesh.tetrahedra[t].end());
    if (!mesh.middles.empty())
      nodes.insert(nodes.end(), mesh.middles[t].begin(), mesh.middles[t].end());
    offsets.push_back(static_cast<std::int64_t>(nodes.size()));
    types.push_back(mesh.middles.empty() ? 10 : 24);
    material.push_back(mesh.material[t]);
  }
  test::VtkWriter out(style, "UnstructuredGrid",
                      "NumberOfPoints='" + std::to_string(mesh.points.size()) +
                          "' NumberOfCells='" + std::to_string(types.size()) + "'");
  out.text("\n<CellData>");
  out.array("Int32", "material", std::vector<std::int32_t>(material.begin(), material.end()));
  out.text("</CellData><Points>");
  out.array("Float64", "Points", points, 3);
  out.text("</Points><Cells>");
  out.array("Int64", "connectivity", nodes);
  out.array("UInt32", "offsets", std::vector<std::uint32_t>(offsets.begin(), offsets.end()));
  out.array("UInt8", "types", std::vector<std::uint8_t>(types.begin(), types.end()));
  out.text("</Cells>");
  return out.end();
}

TEST(TetFile, VtuHoweverItIsStored) {
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh mesh = test::odd_tetrahedra(quadratic, true);
    const std::vector<test::VtkStyle> styles = test::binary_vtk_styles();
    for (std::size_t n = 0; n < styles.size(); ++n) {
      const std::string bytes = vtu(mesh, styles[n]);
      ASSERT_EQ(complaint(bytes, formats::Kind::vtu), "") << n << bytes.substr(0, 600);
      formats::TetReadStats stats;
      EXPECT_TRUE(
          same_bytes(formats::tet_mesh_from_bytes(bytes, "m", formats::Kind::vtu, &stats), mesh))
          << n;
      EXPECT_EQ(stats.skipped_elements, 1U);
    }
    test::VtkStyle text;
    text.text = true;
    const tetrahedra::TetMesh read =
        formats::tet_mesh_from_bytes(vtu(mesh, text), "m", formats::Kind::vtu);
    EXPECT_EQ(read.tetrahedra, mesh.tetrahedra);
    EXPECT_EQ(read.middles, mesh.middles);
    EXPECT_EQ(read.material, mesh.material);
    for (std::size_t p = 0; p < mesh.points.size(); ++p) // std::to_string has six digits
      EXPECT_LT(norm(read.points[p] - mesh.points[p]), 2e-6);
  }
}

/// VTK's header gives 0 for a full last block, meshio's its size. Blocks of 8 bytes divide most of
/// these arrays.
TEST(TetFile, VtuWhoseLastBlockIsFull) {
  for (const bool by_name : {false, true})
    for (const std::size_t block : {8U, 24U, 1U << 20U}) {
      const tetrahedra::TetMesh mesh = test::odd_tetrahedra(false, true);
      test::VtkStyle style;
      style.zlib = true;
      style.block = block;
      style.full_by_name = by_name;
      const std::string bytes = vtu(mesh, style);
      ASSERT_EQ(complaint(bytes, formats::Kind::vtu), "") << block << by_name;
      EXPECT_TRUE(same_bytes(formats::tet_mesh_from_bytes(bytes, "m", formats::Kind::vtu), mesh));
    }
}

TEST(TetFile, VtuWithSignedBytes) {
  for (test::VtkStyle style : test::binary_vtk_styles()) {
    test::VtkWriter out(style, "UnstructuredGrid", "NumberOfPoints='4' NumberOfCells='1'");
    out.text("<Points>");
    out.array("Int8", "Points",
              std::vector<std::int8_t>{-128, 0, 0, 127, -1, 0, 0, 1, 0, 0, 0, 100}, 3);
    out.text("</Points><Cells>");
    out.array("Int8", "connectivity", std::vector<std::int8_t>{0, 1, 2, 3});
    out.array("UInt8", "offsets", std::vector<std::uint8_t>{4});
    out.array("Int8", "types", std::vector<std::int8_t>{10});
    out.text("</Cells>");
    const tetrahedra::TetMesh mesh =
        formats::tet_mesh_from_bytes(out.end(), "m", formats::Kind::vtu);
    EXPECT_EQ(mesh.points, (std::vector<Vec3>{{-128, 0, 0}, {127, -1, 0}, {0, 1, 0}, {0, 0, 100}}));
  }
}

/// meshio stores physical groups of Gmsh and references of Medit under these names.
TEST(TetFile, VtuReadsMeshioMaterialNames) {
  const tetrahedra::TetMesh mesh = test::odd_tetrahedra(false, true);
  for (const std::string name : {"gmsh:physical", "medit:ref"}) {
    test::VtkStyle text;
    text.text = true;
    const std::string bytes = replaced(vtu(mesh, text), "'material'", "'" + name + "'");
    EXPECT_EQ(formats::tet_mesh_from_bytes(bytes, "m", formats::Kind::vtu).material, mesh.material)
        << name;
  }
  test::VtkStyle text;
  text.text = true;
  const std::string bytes = replaced(vtu(mesh, text), "'material'", "'other'");
  EXPECT_TRUE(formats::tet_mesh_from_bytes(bytes, "m", formats::Kind::vtu).material.empty());
}

// ---- What is broken

/// An Error, or a mesh that passes. Nothing else may come of any bytes.
bool is_mesh(const std::string& bytes, formats::Kind kind) {
  try {
    tetrahedra::check_mesh(formats::tet_mesh_from_bytes(bytes, "m", kind));
    return true;
  } catch (const Error& error) {
    EXPECT_FALSE(error.place().empty()) << error.what();
    return false;
  }
}

std::vector<std::pair<formats::Kind, std::string>> samples() {
  std::vector<std::pair<formats::Kind, std::string>> all;
  tetrahedra::TetMesh mesh = strange();
  mesh.material = {1, 4};
  for (const formats::Kind kind : in_memory)
    all.emplace_back(kind, formats::tet_mesh_bytes(mesh, kind));
  all.emplace_back(formats::Kind::msh, gmsh2);
  all.emplace_back(formats::Kind::medit, medit);
  test::VtkStyle style;
  style.zlib = true;
  all.emplace_back(formats::Kind::vtu, vtu(mesh, style));
  style.text = true;
  all.emplace_back(formats::Kind::vtu, vtu(mesh, style));
  return all;
}

TEST(TetFile, VtkEndsBehindASection) {
  tetrahedra::TetMesh mesh = strange();
  mesh.material = {1, 4};
  const std::string bytes = formats::tet_mesh_bytes(mesh, formats::Kind::vtk);
  for (std::size_t size = 0; size + 1 < bytes.size(); ++size) {
    const std::string_view next = std::string_view(bytes).substr(size);
    const bool border = next.starts_with("CELL_DATA") || next.starts_with("\nCELL_DATA") ||
                        next.starts_with("SCALARS") || next.starts_with("\nSCALARS");
    EXPECT_EQ(is_mesh(bytes.substr(0, size), formats::Kind::vtk), border) << size;
  }
}

TEST(TetFile, EveryPrefixIsAnError) {
  for (const auto& [kind, bytes] : samples()) {
    ASSERT_TRUE(is_mesh(bytes, kind));
    if (kind ==
        formats::Kind::vtk) // a legacy file may end behind any section, see VtkEndsBehindASection
      continue;
    // Behind the last word blanks may lack, and in Medit all that follows the tetrahedra.
    const std::size_t end =
        kind == formats::Kind::medit ? bytes.rfind("\n1 ") + 1 : bytes.find_last_not_of(" \n") + 1;
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_FALSE(is_mesh(bytes.substr(0, size), kind) && size < end)
          << formats::kind_name(kind) << " " << size << " of " << bytes.size();
  }
  const formats::TetgenFiles files = formats::tetgen_bytes(strange());
  for (std::size_t size = 0; size + 2 < files.node.size(); ++size)
    EXPECT_NE(complaint({files.node.substr(0, size), files.ele}), "");
  for (std::size_t size = 0; size + 2 < files.ele.size(); ++size)
    EXPECT_NE(complaint({files.node, files.ele.substr(0, size)}), "");
}

TEST(TetFile, EveryChangedByteIsAnErrorOrAMesh) {
  std::mt19937 random(11);
  for (const auto& [kind, bytes] : samples())
    for (std::size_t n = 0; n < bytes.size(); ++n)
      for (int round = 0; round < 3; ++round) {
        std::string changed = bytes;
        changed[n] =
            static_cast<char>(round == 0 ? bytes[n] ^ 0x80 : static_cast<int>(random() % 256));
        (void)is_mesh(changed, kind);
        changed = bytes.substr(0, n) + bytes.substr(n + 1 + random() % 40 % (bytes.size() - n));
        (void)is_mesh(changed, kind);
      }
  const formats::TetgenFiles files = formats::tetgen_bytes(strange());
  for (std::size_t n = 0; n < files.node.size() + files.ele.size(); ++n) {
    formats::TetgenFiles changed = files;
    std::string& text = n < files.node.size() ? changed.node : changed.ele;
    text[n < files.node.size() ? n : n - files.node.size()] = static_cast<char>(random() % 256);
    (void)complaint(changed);
  }
}

TEST(TetFile, BadContentIsNamedWithItsPlace) {
  const auto gmsh = [](const char* from, const char* to) {
    return complaint(replaced(gmsh2, from, to), formats::Kind::msh);
  };
  EXPECT_EQ(gmsh("2.2 0 8", "4 0 8"), "m:5: version \"4\", expected 2.2 or 4.1");
  EXPECT_EQ(gmsh("3 4 5 99", "3 4 5 98"), "m:24: an element with node 98, which is not there");
  EXPECT_EQ(gmsh("2 2 2 1 1 10 3 4", "2 5 2 1 1 10 3 4 5 3 4 5 3"),
            "m:22: hexahedra, expected tetrahedra of 4 or 10 nodes");
  EXPECT_EQ(gmsh("2 2 2 1 1 10 3 4", "2 29 2 1 1 10 3 4"),
            "m:22: tetrahedra of over 10 nodes, expected tetrahedra of 4 or 10 nodes");
  EXPECT_EQ(gmsh("\n3 1 0 0", "\n10 1 0 0"), "m:17: two nodes of number 10, expected one");
  EXPECT_EQ(gmsh("\n3 1 0 0", "\n3 1 nan 0"), "m:14: \"nan\", expected y, a finite number");
  EXPECT_EQ(gmsh("$Nodes\n5", "$Nodes\n4"), "m:17: expected $EndNodes");
  EXPECT_EQ(gmsh("$Nodes\n5", "$Nodes\n500000"),
            "m:12: 500000 nodes in 153 bytes, expected a count that fits");
  EXPECT_EQ(gmsh("1.5e0", "1e999"), "m:17: \"1e999\", expected z, a finite number");

  const std::string ours = formats::tet_mesh_bytes(strange(), formats::Kind::msh);
  EXPECT_EQ(complaint(replaced(ours, "2 4 2 0 1 2 5 4 3", "2 4 2 0 1 2 5 4 7"), formats::Kind::msh),
            "m:16: an element with node 7, which is not there");
  EXPECT_EQ(complaint(replaced(gmsh4, "3 3 1 3\n", "3 4 1 3\n"), formats::Kind::msh),
            "m:32: 3 elements in blocks, expected 4");

  const auto in_medit = [](const char* from, const char* to) {
    return complaint(replaced(medit, from, to), formats::Kind::medit);
  };
  EXPECT_EQ(in_medit("1 2 3 4 12", "1 2 3 5 12"), "m:17: vertex 5, expected 1 to 4");
  EXPECT_EQ(in_medit("1 2 3 4 12", "1 2 3 4 -2"), "m:17: material -2, expected 0 to 2147483647");
  EXPECT_EQ(in_medit("Dimension\n3", "Dimension\n2"),
            "m:5: a mesh of another dimension, expected 3");
  EXPECT_EQ(in_medit("Hexahedra 0", "Hexahedra 1 1 1 1 1 1 1 1 1 1"),
            "m:18: Hexahedra, expected tetrahedra of 4 or 10 nodes in the usual order");
  EXPECT_EQ(in_medit("End\n", "TetrahedraP2 1\n1 2 3 4 1 2 3 4 1 2 0"),
            "m:20: tetrahedra of 4 and of 10 nodes, expected one order");
  EXPECT_EQ(in_medit("End\n", "End\nEnd\n"), "m:20: words after End, expected the end");
  EXPECT_EQ(in_medit("Vertices 4", "Vertices 4000000000"),
            "m:6: 4000000000 vertices in 155 bytes, expected a count that fits");

  test::VtkStyle style;
  style.text = true;
  tetrahedra::TetMesh mesh = strange();
  mesh.material = {1, 4};
  for (Vec3& p : mesh.points)
    p = {1, 2, 3};
  const std::string text = vtu(mesh, style);
  const auto in_vtu = [&](const char* from, const char* to) {
    return complaint(replaced(text, from, to), formats::Kind::vtu);
  };
  EXPECT_EQ(in_vtu("5\n10\n10", "5\n10\n12"),
            "m:47: hexahedra, expected tetrahedra of 4 or 10 nodes");
  EXPECT_EQ(in_vtu("NumberOfPoints='6'", "NumberOfPoints='4'"), "m:9: more than 12 numbers");
  EXPECT_EQ(in_vtu("NumberOfPoints='6'", "NumberOfPoints='4000000000'"),
            "m:9: 12000000000 numbers in 163 bytes, expected a count that fits");
  EXPECT_EQ(in_vtu("4\n3\n2\n", "4\n6\n2\n"), "m: cell 2: point 6, expected 0 to below 6");
  EXPECT_EQ(in_vtu("4\n3\n2\n", "4\n-1\n2\n"), "m: cell 2: point -1, expected 0 to below 6");
  EXPECT_EQ(in_vtu("LittleEndian", "MiddleEndian"),
            "m:2: byte_order \"MiddleEndian\", expected LittleEndian or BigEndian");
  EXPECT_EQ(in_vtu("version='1.0'", "compressor='vtkLZ4DataCompressor'"),
            "m:2: data packed by \"vtkLZ4DataCompressor\", expected vtkZLibDataCompressor or none");
  EXPECT_EQ(in_vtu("'connectivity'", "'conectivity'"),
            "m: no DataArray Cells/connectivity, expected one");

  const formats::TetgenFiles files = formats::tetgen_bytes(strange());
  EXPECT_EQ(complaint({files.node, replaced(files.ele, "2 4 0", "2 5 0")}),
            "m.ele:2: tetrahedra of 5 nodes, expected 4 or 10");
  EXPECT_EQ(complaint({files.node, replaced(files.ele, "0 1 2 3", "0 1 2 6")}),
            "m.ele:3: point 6, expected 0 to below 6");
  EXPECT_EQ(complaint({replaced(files.node, "\n3 ", "\n4 "), files.ele}),
            "m.node:6: point 4, expected 3");
  const std::string ply = formats::tet_mesh_bytes(strange(), formats::Kind::ply);
  EXPECT_EQ(complaint(replaced(ply, "tetrahedron 2", "tetrahedron 3"), formats::Kind::ply),
            "m: byte 491: 3 elements \"tetrahedron\" in 34 bytes, expected a count that fits");
  EXPECT_EQ(complaint(replaced(by_hand_ply, "3 4 0 1 2 3", "3 4 0 1 2 4"), formats::Kind::ply),
            "m:15: a vertex is no integer from 0 to below 4");
  EXPECT_EQ(complaint(replaced(by_hand_ply, "3 4 0 1 2 3", "-3 4 0 1 2 3"), formats::Kind::ply),
            "m:15: material is no integer from 0 to below 2147483648");
  EXPECT_EQ(complaint(replaced(ply, "element tetrahedron", "element other"), formats::Kind::ply),
            "m: a PLY file without the element tetrahedron, expected that");
}

// ---- Other programs (tests/contract/tet_files.sh)

// Writes a mesh in every format into a folder, $GEWEBE_TET_FILES if that is set, and reads it; what
// lies in its folder `other` is written as TetGen's, in text, beside each file.
TEST(TetFile, ForOtherPrograms) {
  const char* const given = std::getenv("GEWEBE_TET_FILES");
  const ScratchFile own(".folder");
  const std::string folder = given != nullptr ? given : own.path() + ".d";
  std::filesystem::create_directories(folder);
  const auto read = [](const std::string& path) {
    formats::Input input(path);
    return formats::read_tet_mesh(input, {.kind = formats::input_kind(input.peek(4096), path, "")});
  };
  const auto write = [](const std::string& path, const tetrahedra::TetMesh& mesh,
                        formats::Kind kind) {
    formats::Output output(path, {});
    formats::write_tet_mesh(output, mesh, kind);
    output.commit();
  };
  for (const bool quadratic : {false, true}) {
    const std::string stem = folder + (quadratic ? "/quadratic" : "/linear");
    const tetrahedra::TetMesh mesh = test::odd_tetrahedra(quadratic, true);
    for (const char* const suffix : {".ply", ".vtu", ".msh", ".4.msh", ".mesh", ".node", ".vtk"}) {
      write(stem + suffix, mesh,
            suffix == std::string(".4.msh") ? formats::Kind::msh4
                                            : formats::kind_from_suffix(suffix));
      EXPECT_TRUE(same_bytes(read(stem + suffix), mesh)) << suffix;
    }
  }
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder + "/other", none)) {
    const std::string path = entry.path();
    const tetrahedra::TetMesh mesh = read(path);
    EXPECT_NO_THROW(tetrahedra::require_sound(tetrahedra::examine_tetrahedra(mesh))) << path;
    write(path + ".node", mesh, formats::Kind::tetgen);
  }
  if (given == nullptr)
    std::filesystem::remove_all(folder);
}

} // namespace
} // namespace gewebe::test
