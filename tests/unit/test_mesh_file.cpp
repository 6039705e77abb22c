#include "base/error.h"
#include "formats/mesh/assimp_child.h"
#include "formats/mesh/mesh_file.h"
#include "formats/mesh/ply.h"
#include "formats/stream/child.h"
#include "tests/unit/complaint.h"
#include "tests/unit/sanitizers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include <sys/stat.h>
#include <unistd.h>

using namespace gewebe;
namespace fs = std::filesystem;

namespace {

// A folder that goes with the test.
class Folder {
public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "gewebe-mesh-XXXXXX").string();
    EXPECT_NE(::mkdtemp(name.data()), nullptr);
    path_ = name;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { fs::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

private:
  fs::path path_;
};

std::string put(const std::string& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

std::string get(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TriangleMesh read(const std::string& path, formats::MeshReadOptions options = {},
                  formats::MeshReadStats* stats = nullptr) {
  formats::Input input(path);
  if (options.kind == formats::Kind::unknown)
    options.kind = formats::input_kind(input.peek(4096), path, "");
  return formats::read_mesh(input, options, stats);
}

void write(const std::string& path, const TriangleMesh& mesh) {
  formats::Output output(path, {});
  formats::write_mesh(output, mesh, formats::kind_from_suffix(path));
  output.commit();
}

// "PLACE: WHAT" of the complaint, or "".
std::size_t edge_count(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  return edges.size();
}

std::size_t open_edges(const TriangleMesh& mesh) {
  std::multiset<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  return static_cast<std::size_t>(std::count_if(
      edges.begin(), edges.end(), [&](const auto& e) { return edges.count(e) == 1; }));
}

// Two boxes of different shape and material, one part each, the second textured.
TriangleMesh two_boxes() {
  TriangleMesh mesh;
  static constexpr int faces[6][4] = {{0, 2, 3, 1}, {0, 1, 5, 4}, {0, 4, 6, 2},
                                      {1, 3, 7, 5}, {2, 6, 7, 3}, {4, 5, 7, 6}};
  for (int box = 0; box < 2; ++box) {
    const std::uint32_t first = static_cast<std::uint32_t>(mesh.points.size());
    for (int c = 0; c < 8; ++c)
      mesh.points.push_back(
          {10.0 * box + (c & 1) * 1.5, -3 + (c >> 1 & 1) * (2.0 + box), (c >> 2) * 4.25});
    for (const auto& f : faces)
      for (const auto& t : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
        Triangle triangle{};
        std::array<float, 6> st{};
        for (std::size_t k = 0; k < 3; ++k) {
          triangle[k] = first + static_cast<std::uint32_t>(f[t[k]]);
          st[2 * k] = t[k] == 1 || t[k] == 2 ? 0.75f : 0.f;
          st[2 * k + 1] = t[k] >= 2 ? 0.5f : 0.f;
        }
        mesh.triangles.push_back(triangle);
        mesh.texcoords.push_back(st);
        mesh.part.push_back(box);
        mesh.material.push_back(1 - box);
      }
  }
  return mesh;
}

// The corners' positions, triangle by triangle.
std::vector<std::array<Vec3, 3>> shape(const TriangleMesh& mesh, bool sorted) {
  std::vector<std::array<Vec3, 3>> list;
  for (const Triangle& t : mesh.triangles)
    list.push_back({mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]});
  const auto less = [](const Vec3& a, const Vec3& b) {
    return std::tuple(a.x, a.y, a.z) < std::tuple(b.x, b.y, b.z);
  };
  if (sorted)
    for (auto& t : list) // turns, does not mirror
      std::rotate(t.begin(), std::min_element(t.begin(), t.end(), less), t.end());
  if (sorted)
    std::sort(list.begin(), list.end(), [&](const auto& a, const auto& b) {
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), less);
    });
  return list;
}

std::string shared(const std::string& name) {
  const char* folder = std::getenv("GEWEBE_SHARED");
  return std::string(folder == nullptr ? "../shared" : folder) + "/data/" + name;
}

std::string unit_square_obj(const std::string& more = "") {
  return "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n" + more + "f 1 2 3\nf 1 3 4\n";
}

} // namespace

// ---- child

TEST(Child, GivesItsBytes) {
  std::string large(3'000'000, 'x');
  large[1'234'567] = '\0';
  EXPECT_EQ(formats::run_in_child([&] { return large; }, {}), large);
  EXPECT_EQ(formats::run_in_child([] { return std::string(); }, {}), "");
}

TEST(Child, CrashIsAnError) {
  EXPECT_EQ(test::complaint([] {
              formats::run_in_child(
                  []() -> std::string {
                    std::signal(SIGSEGV, SIG_DFL);
                    std::raise(SIGSEGV);
                    return "";
                  },
                  {});
            }),
            "crashed (signal 11)");
  EXPECT_EQ(test::complaint([] { formats::run_in_child([]() -> std::string { ::_exit(0); }, {}); }),
            "ended without an answer");
  EXPECT_EQ(test::complaint(
                [] { formats::run_in_child([]() -> std::string { throw Error("no"); }, {}); }),
            "no");
}

TEST(Child, TimeIsLimited) {
  formats::ChildLimits limits;
  limits.cpu_seconds = 1;
  EXPECT_EQ(test::complaint([&] {
              formats::run_in_child(
                  []() -> std::string {
                    for (volatile bool on = true; on;)
                      ;
                    return "";
                  },
                  limits);
            }),
            "took over 1 s");
  limits.seconds = 0.1;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_NE(test::complaint([&] {
              formats::run_in_child(
                  []() -> std::string {
                    for (;;)
                      ::pause();
                  },
                  limits);
            }),
            "");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}

TEST(Child, MemoryIsLimited) {
  if (test::under_sanitizers())
    GTEST_SKIP() << "a sanitizer's shadow takes terabytes of address space";
  formats::ChildLimits limits;
  limits.memory = 64 << 20;
  const auto take = [&](std::size_t size) {
    return test::complaint([&] {
      formats::run_in_child([&] { return std::to_string(std::string(size, 'x').size()); }, limits);
    });
  };
  EXPECT_EQ(take(16 << 20), "");
  EXPECT_EQ(take(256 << 20), "out of memory");
}

TEST(Child, InheritsNothing) {
  Folder folder;
  const int fd = ::fileno(std::fopen((folder / "open").c_str(), "w"));
  EXPECT_EQ(formats::run_in_child(
                [&] {
                  return std::string(::write(fd == 3 ? 4 : fd, "x", 1) < 0 &&
                                             ::write(1, "x", 1) == 1
                                         ? "alone"
                                         : "not alone");
                },
                {}),
            "alone");
  ::close(fd);
}

// -------------------------------------------------------------------------------------------
// formats

TEST(MeshFile, RoundTripsThroughEveryWritableKind) {
  Folder folder;
  const TriangleMesh mesh = two_boxes();
  ASSERT_EQ(open_edges(mesh), 0u);
  for (const formats::Kind kind : formats::writable_mesh_kinds()) {
    SCOPED_TRACE(formats::kind_name(kind));
    const std::string path = folder / ("m." + std::string(formats::kind_name(kind)));
    write(path, mesh);
    const std::string bytes = get(path);
    write(path, mesh);
    EXPECT_EQ(get(path), bytes); // the same from run to run
    formats::MeshReadStats stats;
    const TriangleMesh back = read(path, {}, &stats);
    // Kinds in single precision and metres keep 24 bits.
    const auto expected = shape(mesh, true), found = shape(back, true);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t t = 0; t < found.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_LE(norm(found[t][k] - expected[t][k]), kind == formats::Kind::glb ? 2e-6 : 0.0);
    EXPECT_NEAR(signed_volume(back), signed_volume(mesh), 1e-5);
    EXPECT_EQ(back.points.size(), 16u);
    EXPECT_EQ(open_edges(back), 0u);
    EXPECT_EQ(stats.parts, kind == formats::Kind::stl ? 1u : 2u);
    EXPECT_EQ(stats.weld.degenerate_removed, 0u);
    if (kind == formats::Kind::stl)
      continue;
    ASSERT_EQ(back.material.size(), 24u);
    ASSERT_EQ(back.texcoords.size(), 24u);
    if (kind == formats::Kind::three_ds) // welds texture coordinates of equal position
      continue;
    EXPECT_EQ(back.texcoords[5], mesh.texcoords[5]);
  }
}

TEST(MeshFile, PlyAndObjKeepEveryDigit) {
  Folder folder;
  TriangleMesh mesh = two_boxes();
  mesh.points[0] = {0.1, 1.0 / 3, -1e-7};
  write(folder / "m.ply", mesh);
  EXPECT_EQ(read(folder / "m.ply").points, mesh.points);
  write(folder / "m.obj", mesh);
  EXPECT_NE(get(folder / "m.obj").find("v 0.1 0.3333333333333333 -1e-07\n"), std::string::npos);
}

TEST(MeshFile, EmptyMeshes) {
  Folder folder;
  write(folder / "m.ply", {});
  EXPECT_TRUE(read(folder / "m.ply").points.empty());
  write(folder / "m.obj", {});
  write(folder / "m.stl", {});
  EXPECT_EQ(get(folder / "m.stl").size(), 84u);
  for (const char* name : {"m.glb", "m.3ds", "m.dae"})
    EXPECT_NE(test::complaint([&] { write(folder / name, {}); }).find("expected at least one"),
              std::string::npos);
  EXPECT_NE(test::complaint([&] { read(folder / "m.stl"); }), "");
}

TEST(MeshFile, LargeMeshSplitsAndRejoinsIn3ds) {
  Folder folder;
  TriangleMesh mesh; // a closed, twisted band of 2 * n quads is enough: a bipyramid over n corners
  const std::uint32_t n = 70000;
  mesh.points = {{0, 0, 1000}, {0, 0, -500}};
  for (std::uint32_t i = 0; i < n; ++i)
    mesh.points.push_back(
        {1000 * std::cos(2 * M_PI * i / n), 1000 * std::sin(2 * M_PI * i / n), 0});
  for (std::uint32_t i = 0; i < n; ++i) {
    mesh.triangles.push_back({0, 2 + i, 2 + (i + 1) % n});
    mesh.triangles.push_back({1, 2 + (i + 1) % n, 2 + i});
  }
  write(folder / "m.3ds", mesh);
  const TriangleMesh back = read(folder / "m.3ds");
  EXPECT_EQ(back.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(back.points.size(), mesh.points.size());
  EXPECT_EQ(open_edges(back), 0u);
}

TEST(MeshFile, Units) {
  Folder folder;
  const std::string obj = put(folder / "m.obj", unit_square_obj());
  formats::MeshReadOptions options;
  EXPECT_EQ(bounding_box(read(obj)).max, (Vec3{1, 1, 0}));
  options.unit = "cm";
  EXPECT_EQ(bounding_box(read(obj, options)).max, (Vec3{10, 10, 0}));
  options.unit = "m";
  EXPECT_EQ(bounding_box(read(obj, options)).max, (Vec3{1000, 1000, 0}));
  write(folder / "m.ply", read(obj));
  EXPECT_EQ(bounding_box(read(folder / "m.ply", options)).max, (Vec3{1000, 1000, 0}));
  options.unit = "inch";
  EXPECT_THROW(read(obj, options), UsageError);
  // Formats that state a unit: --unit says what the numbers mean in spite of that.
  write(folder / "m.glb", read(obj)); // as 0.001 m
  write(folder / "m.dae", read(obj)); // as 1, of 0.001 m
  for (const char* const name : {"m.glb", "m.dae"}) {
    EXPECT_NEAR(bounding_box(read(folder / name)).max.x, 1, 1e-6) << name;
    options.unit = "mm";
    EXPECT_NEAR(bounding_box(read(folder / name, options)).max.x,
                std::string(name) == "m.glb" ? 0.001 : 1, 1e-6)
        << name;
    options.unit = "m";
    EXPECT_NEAR(bounding_box(read(folder / name, options)).max.x,
                std::string(name) == "m.glb" ? 1 : 1000, 1e-3)
        << name;
  }
}

TEST(MeshFile, CornersOfAStrangeColladaUnit) {
  Folder folder;
  write(folder / "m.dae", two_boxes());
  std::string xml = get(folder / "m.dae");
  const std::size_t at = xml.find("meter=\"0.001\"");
  ASSERT_NE(at, std::string::npos);
  xml.replace(at, 13, "meter=\"0.0254\"");
  put(folder / "inch.dae", xml);
  EXPECT_NEAR(bounding_box(read(folder / "inch.dae")).max.x, 11.5 * 25.4, 1e-9);
}

TEST(MeshFile, ObjWithAndWithoutItsMaterialFile) {
  Folder folder;
  const std::string text = unit_square_obj("mtllib m.mtl\nusemtl red\n");
  const std::string obj = put(folder / "m.obj", text);
  EXPECT_EQ(read(obj).triangles.size(), 2u);
  put(folder / "m.mtl", "newmtl red\nKd 1 0 0\n");
  EXPECT_EQ(read(obj).triangles.size(), 2u);
  // A FIFO in its place must not hold us.
  fs::remove(folder / "m.mtl");
  ASSERT_EQ(::mkfifo((folder / "m.mtl").c_str(), 0600), 0);
  EXPECT_EQ(read(obj).triangles.size(), 2u);
}

TEST(MeshFile, ObjGroupsOfOneNameAreOnePart) {
  Folder folder;
  const std::string obj =
      put(folder / "m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 2 0\ng a\nf 1 2 3\n"
                            "g b\nf 2 4 3\ng a\nf 4 5 3\n");
  formats::MeshReadStats stats;
  EXPECT_EQ(read(obj, {}, &stats).part, (std::vector<std::int32_t>{0, 1, 0}));
  EXPECT_EQ(stats.parts, 2u);
}

TEST(MeshFile, DxfLayersArePartsAndAxesStay) {
  Folder folder;
  std::string dxf = "999\nmade by hand\n  0\nSECTION\n  2\nENTITIES\n";
  const auto face = [&](const std::string& layer, const std::vector<Vec3>& corners) {
    dxf += "  0\n3DFACE\n  8\n" + layer + "\n";
    for (std::size_t k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis)
        dxf += " " + std::to_string(10 * (axis + 1) + static_cast<int>(k)) + "\n" +
               std::to_string(corners[std::min(k, corners.size() - 1)][axis]) + "\n";
  };
  face("ONE", {{1, 2, 3}, {2, 2, 3}, {2, 3, 3}});
  face("TWO", {{1, 2, 3}, {1, 2, 9}, {2, 2, 9}, {2, 2, 3}});
  face("ONE", {{1, 2, 3}, {2, 3, 3}, {1, 3, 3}});
  dxf += "  0\nENDSEC\n  0\nEOF\n";
  const std::string path = put(folder / "m.dxf", dxf);
  formats::MeshReadStats stats;
  const TriangleMesh mesh = read(path, {}, &stats);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_EQ(stats.parts, 2u);
  EXPECT_EQ(stats.polygons, 1u);
  EXPECT_EQ(bounding_box(mesh).min, (Vec3{1, 2, 3}));
  EXPECT_EQ(bounding_box(mesh).max, (Vec3{2, 3, 9}));
  const auto& t = mesh.triangles[0];
  EXPECT_GT(cross(mesh.points[t[1]] - mesh.points[t[0]], mesh.points[t[2]] - mesh.points[t[0]]).z,
            0);
}

TEST(MeshFile, GltfNodesAreMovedAndMirroredOnesTurned) {
  Folder folder;
  // One triangle (base64 of 9 floats), shown twice: moved, and mirrored in x.
  const std::string gltf =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],)"
      R"("nodes":[{"mesh":0,"translation":[1,2,3]},{"mesh":0,"scale":[-1,1,1]}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
      R"("min":[0,0,0],"max":[1,1,0]}],)"
      R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36}],)"
      R"("buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
      R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
  formats::MeshReadStats stats;
  const TriangleMesh mesh = read(put(folder / "m.gltf", gltf), {}, &stats);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(stats.parts, 2u);
  EXPECT_EQ(bounding_box(mesh).max, (Vec3{2000, 3000, 3000}));
  EXPECT_EQ(bounding_box(mesh).min, (Vec3{-1000, 0, 0}));
  for (const Triangle& t : mesh.triangles) // both seen from +z
    EXPECT_GT(cross(mesh.points[t[1]] - mesh.points[t[0]], mesh.points[t[2]] - mesh.points[t[0]]).z,
              0);
}

TEST(MeshFile, WeldWordsAndDefaults) {
  EXPECT_EQ(formats::weld_from_name("auto"), std::nullopt);
  EXPECT_EQ(formats::weld_from_name(""), std::nullopt);
  EXPECT_EQ(formats::weld_from_name("all"), repair::Weld::all);
  EXPECT_THROW(formats::weld_from_name("some"), UsageError);
  Folder folder;
  TriangleMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  write(folder / "m.ply", mesh);
  EXPECT_EQ(read(folder / "m.ply").points.size(), 6u); // its indices count
  formats::MeshReadOptions options;
  options.weld = repair::Weld::all;
  EXPECT_EQ(read(folder / "m.ply", options).points.size(), 4u);
  write(folder / "m.stl", mesh);
  EXPECT_EQ(read(folder / "m.stl").points.size(), 4u);
  options.weld = repair::Weld::none;
  EXPECT_EQ(read(folder / "m.stl", options).points.size(), 6u);
}

TEST(MeshFile, ComplaintsNameTheFile) {
  Folder folder;
  const std::string off = put(folder / "m.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n");
  const std::string text = test::complaint([&] { read(off); });
  EXPECT_TRUE(text.starts_with(off + ": not readable as OFF: ")) << text;
  EXPECT_TRUE(text.ends_with(", expected a valid OFF file")) << text;
  const std::string unknown = put(folder / "m.xyz", "1 2 3\n");
  EXPECT_NE(test::complaint([&] { read(unknown); }).find("expected one of ply, obj"),
            std::string::npos);
  EXPECT_NE(test::complaint([&] { read(put(folder / "m.glb", "glTF")); }), "");
  const std::string solid = put(folder / "m.mesh", "MeshVersionFormatted 2\n");
  EXPECT_TRUE(
      test::complaint([&] { read(solid); }).starts_with(solid + ": medit is a tetrahedral mesh"));
}

TEST(MeshFile, EveryPrefixOfSmallFilesEndsInOrder) {
  Folder folder;
  const TriangleMesh mesh = two_boxes();
  for (const char* name : {"m.glb", "m.stl", "m.3ds"}) {
    write(folder / name, mesh);
    const std::string bytes = get(folder / name);
    for (std::size_t size = 1; size < bytes.size(); size += 1 + bytes.size() / 24) {
      formats::AssimpSource source;
      const std::string part = bytes.substr(0, size);
      source.bytes = part;
      source.kind = formats::kind_from_suffix(name);
      try {
        check_mesh(formats::read_by_assimp(source));
      } catch (const Error&) {
      }
    }
  }
}

// ---- real data

namespace {

struct Target {
  const char* name;
  std::optional<repair::Weld> weld;
  std::size_t points, edges, triangles;
  std::uint64_t parts;
};

void expect_target(const Target& target) {
  SCOPED_TRACE(target.name);
  formats::MeshReadOptions options;
  options.weld = target.weld;
  formats::MeshReadStats stats;
  const TriangleMesh mesh = read(shared(target.name), options, &stats);
  EXPECT_EQ(mesh.points.size(), target.points);
  EXPECT_EQ(edge_count(mesh), target.edges);
  EXPECT_EQ(mesh.triangles.size(), target.triangles);
  EXPECT_EQ(stats.parts, target.parts);
  EXPECT_EQ(open_edges(mesh), 0u);
  EXPECT_GT(signed_volume(mesh), 0);
}

} // namespace

TEST(MeshData, OrgansWeldAsCounted) {
  if (!fs::exists(shared("")))
    GTEST_SKIP() << "no " << shared("");
  const std::optional<repair::Weld> automatic;
  for (const Target& target : {
           Target{"ts_liver_gallbladder_portal.dxf", automatic, 15696, 47076, 31384, 3},
           Target{"ts_liver_gallbladder_portal.obj", automatic, 15696, 47076, 31384, 3},
           Target{"ts_liver_gallbladder_portal.dxf", repair::Weld::all, 15651, 46982, 31384, 3},
           Target{"ts_liver_gallbladder_portal.obj", repair::Weld::all, 15673, 47037, 31384, 3},
           Target{"hubmap_F_spleen_uv.obj", automatic, 4274, 12816, 8544, 5},
           Target{"sofa_liver_smooth.obj", automatic, 2194, 6576, 4384, 1},
           Target{"gca90_large_intestine_20k.stl", automatic, 10000, 30000, 20000, 1},
       })
    expect_target(target);
  formats::MeshReadOptions
      options; // the negative control: without joining at borders the spleen stays open
  options.weld = repair::Weld::part;
  EXPECT_EQ(read(shared("hubmap_F_spleen_uv.obj"), options).points.size(), 4564u);
}

TEST(MeshData, MalformedFilesAreErrorsOrMeshes) {
  if (!fs::exists(shared("")))
    GTEST_SKIP() << "no " << shared("");
  int files = 0, meshes = 0;
  for (const char* folder : {"malformed_assimp", "malformed_trimesh", "dxf_assimp"})
    for (const auto& entry : fs::directory_iterator(shared(folder))) {
      const auto start = std::chrono::steady_clock::now();
      const std::string text = test::complaint([&] {
        check_mesh(read(entry.path().string()));
        ++meshes;
      });
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
      EXPECT_EQ(text.find('\n'), std::string::npos);
      EXPECT_TRUE(text.empty() || text.starts_with(entry.path().string())) << text;
      ++files;
    }
  EXPECT_GE(files, 89);
  EXPECT_GE(meshes, 20);
}
