// The rules winding and zbuffer against brute-force statements of them.

#include "base/error.h"
#include "geometry/exact_predicates.h"
#include "mesh_fixtures.h"
#include "repair/oriented_surface.h"
#include "tests/unit/larger.h"
#include "volume/lattice.h"
#include "voxelization/solid_angle_tree_internal.h"
#include "voxelization/voxelize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace {

using namespace gewebe;
using namespace gewebe::test;

const volume::GridTransform unit_lattice = volume::uniform_transform(1);

std::set<Int3> voxels(const TriangleMesh& mesh, voxelization::VoxelRule rule,
                      voxelization::VoxelizeReport* report = nullptr, const Context& context = {}) {
  return inside_voxels(
      voxelization::scan_inside(context, mesh, unit_lattice, {.rule = rule}, report));
}

TriangleMesh turned(TriangleMesh mesh) {
  for (Triangle& t : mesh.triangles)
    std::swap(t[0], t[1]);
  return mesh;
}

TriangleMesh without(TriangleMesh mesh, const std::function<bool(const Vec3&)>& cut) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return cut((mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]]) / 3);
  });
  return mesh;
}

/// Sum of solid angles / 4 pi by the C library (van Oosterom and Strackee).
double winding_number(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vec3 a = mesh.points[i] - p, b = mesh.points[j] - p, c = mesh.points[k] - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    sum += std::atan2(dot(a, cross(b, c)),
                      la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::acos(-1.0));
}

struct Agreement {
  int inside = 0, wrong = 0, undecided = 0;
};

/// Compares around the mesh, oriented as it stands, with |w| > 1/2.
Agreement agreement(const TriangleMesh& mesh, const std::set<Int3>& inside,
                    const std::function<bool(const Int3&)>& skip = {}) {
  constexpr int margin = 2;
  Int3 min{}, max{};
  EXPECT_TRUE(volume::index_range(unit_lattice, bounding_box(mesh), min, max));
  Agreement result;
  for (std::int32_t i = min[0] - margin; i <= max[0] + margin; ++i)
    for (std::int32_t j = min[1] - margin; j <= max[1] + margin; ++j)
      for (std::int32_t k = min[2] - margin; k <= max[2] + margin; ++k) {
        if (skip && skip({i, j, k}))
          continue;
        const double w = winding_number(mesh, {1.0 * i, 1.0 * j, 1.0 * k});
        const bool found = inside.contains({i, j, k});
        result.inside += found;
        if (std::fabs(std::fabs(w) - 0.5) < 1e-9)
          ++result.undecided;
        else
          result.wrong += found != (std::fabs(w) > 0.5);
      }
  return result;
}

// ---- winding

TEST(VoxelizeWinding, ClosedSurfacesAreFilledWhereTheyWindAtAll) {
  const TriangleMesh a = sphere_mesh(3, 9, {0.1, 0.2, 0.3}), b = sphere_mesh(2, 7, {6, 1, -2}),
                     c = sphere_mesh(2, 3, {-1, 0, 0});
  std::set<Int3> expected = voxels(a, voxelization::VoxelRule::parity);
  for (const TriangleMesh* part : {&b, &c})
    expected.merge(voxels(*part, voxelization::VoxelRule::parity));
  TriangleMesh all = a;
  append(all, turned(b)); // overlaps, badly oriented
  append(all, c);         // within
  voxelization::VoxelizeReport report;
  EXPECT_EQ(voxels(all, voxelization::VoxelRule::winding, &report), expected);
  EXPECT_EQ(report.parts, 3u);
  EXPECT_EQ(report.parts_turned, 1u);
  EXPECT_EQ(report.boundary_edges, 0u);
  EXPECT_EQ(report.samples_summed, 0u);
  EXPECT_NE(voxels(all, voxelization::VoxelRule::parity), expected); // negative control
}

TEST(VoxelizeWinding, OneSolidIsAsByParityTiesIncluded) {
  std::mt19937 random(3);
  for (int size = 1; size <= 24; size += 3)
    for (int eighth = 0; eighth < 8; ++eighth) {
      const Vec3 low{eighth / 8.0, -7, eighth / 4.0};
      const TriangleMesh cube = box_mesh(low, low + Vec3{1.0 * size, 1.0 * size, 1.0 * size});
      EXPECT_EQ(voxels(cube, voxelization::VoxelRule::winding),
                voxels(cube, voxelization::VoxelRule::parity));
    }
  TriangleMesh ball = sphere_mesh(2, 12, {});
  for (Vec3& p : ball.points)
    p = {std::round(p.x), std::round(p.y), std::round(p.z)};
  const auto expected = voxels(ball, voxelization::VoxelRule::parity);
  EXPECT_EQ(voxels(ball, voxelization::VoxelRule::winding), expected);
  for (Triangle& t : ball.triangles) // half of the triangles badly oriented
    if (random() % 2 == 0)
      std::swap(t[0], t[1]);
  voxelization::VoxelizeReport report;
  EXPECT_EQ(voxels(ball, voxelization::VoxelRule::winding, &report), expected);
  EXPECT_GT(report.triangles_turned, ball.triangles.size() / 4);
}

TEST(VoxelizeWinding, DuplicateTrianglesCountOnce) {
  TriangleMesh mesh = sphere_mesh(2, 9, {0.1, 0.2, 0.3});
  const auto expected = voxels(mesh, voxelization::VoxelRule::parity);
  for (std::size_t n = 0; n < 40; ++n)
    mesh.triangles.push_back(mesh.triangles[7 * n]);
  voxelization::VoxelizeReport report;
  EXPECT_EQ(voxels(mesh, voxelization::VoxelRule::winding, &report), expected);
  EXPECT_EQ(report.triangles_duplicate, 40u);
}

TEST(VoxelizeWinding, OpenSurfacesAgreeWithTheSumOfAllSolidAngles) {
  const TriangleMesh ball = sphere_mesh(2, 11, {0.1, 0.2, 0.3});
  TriangleMesh two = without(ball, [](const Vec3& p) { return p.x > 5; });
  append(two, without(sphere_mesh(2, 8, {9, 3, 1}), [](const Vec3& p) { return p.y < 2; }));
  std::mt19937 random(4);
  TriangleMesh moth_eaten = ball;
  std::shuffle(moth_eaten.triangles.begin(), moth_eaten.triangles.end(), random);
  moth_eaten.triangles.resize(moth_eaten.triangles.size() * 4 / 5);
  TriangleMesh cube = box_mesh({-4, -3, -5}, {5, 6, 4}); // a face on voxel centres is missing
  cube.triangles.erase(cube.triangles.begin(), cube.triangles.begin() + 2);
  int number = 0;
  for (const TriangleMesh& mesh :
       {without(ball, [](const Vec3& p) { return p.z > 8; }),
        without(ball, [](const Vec3& p) { return p.x + p.y > 0.5; }), two, moth_eaten, cube}) {
    voxelization::VoxelizeReport report;
    const auto inside = voxels(mesh, voxelization::VoxelRule::winding, &report);
    const auto on_cube = [&](const Int3& v) { // where the winding number jumps
      return number == 4 && v[2] >= -5 && v[2] <= 4 && v[0] >= -4 && v[0] <= 5 && v[1] >= -3 &&
             v[1] <= 6 && (v[0] == -4 || v[0] == 5 || v[1] == -3 || v[1] == 6 || v[2] == 4);
    };
    const Agreement result = agreement(mesh, inside, on_cube);
    EXPECT_EQ(result.wrong, 0) << number;
    EXPECT_GT(result.inside, 100) << number;
    EXPECT_LT(result.undecided, number == 4 ? 65 : 3) << number; // 1/2 on a missing face
    EXPECT_GT(report.boundary_edges, 0u);
    EXPECT_GT(report.samples_summed, 0u);
    EXPECT_GT(agreement(ball, inside).wrong + (number == 3 ? 1 : 0), 0) << number; // control
    ++number;
  }
}

TEST(VoxelizeWinding, SameForAnyThreadsAndProcessor) {
  const TriangleMesh mesh =
      without(sphere_mesh(3, 40, {0.1, 0.2, 0.3}), [](const Vec3& p) { return p.z > 30; });
  Context one, two;
  one.threads = 1;
  one.cpu = CpuLevel::baseline;
  two.threads = 2;
  for (const voxelization::VoxelRule rule :
       {voxelization::VoxelRule::winding, voxelization::VoxelRule::zbuffer}) {
    const voxelization::InsideScan a =
        voxelization::scan_inside(one, mesh, unit_lattice, {.rule = rule});
    const voxelization::InsideScan b =
        voxelization::scan_inside(two, mesh, unit_lattice, {.rule = rule});
    EXPECT_EQ(a.origins, b.origins);
    EXPECT_EQ(a.bits, b.bits);
    EXPECT_EQ(a.tiles.size(), b.tiles.size());
    EXPECT_FALSE(a.bits.empty());
  }
}

TEST(SolidAngleTree, TreeAndSumAgreeWithinTheirErrors) {
  const TriangleMesh mesh =
      without(sphere_mesh(3, 5, {0.1, 0.2, 0.3}), [](const Vec3& p) { return p.z > 1; });
  const voxelization::SolidAngleTree tree(mesh.points, mesh.triangles, mesh.triangles,
                                          best_cpu_level());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-30, 30), small(-1, 1);
  double largest = 0;
  int bounded = 0;
  for (int n = 0; n < 300; ++n) {
    const Vec3 p{place(random), place(random), place(random)};
    const double exact = winding_number(mesh, p);
    EXPECT_NEAR(tree.exact_at(p), exact, 1e-12);
    EXPECT_NEAR(tree.at(p, 0).value, exact, 1e-12);
    const voxelization::WindingSum rough = tree.at(p, 1e-3);
    EXPECT_LE(std::fabs(rough.value - exact), rough.error + 1e-13);
    largest = test::larger(largest, std::fabs(rough.value - exact));
    const voxelization::WindingSum range = tree.within(p, 2);
    bounded += range.error < 1;
    for (int m = 0; m < 20; ++m) {
      const Vec3 q = p + Vec3{small(random), small(random), small(random)};
      EXPECT_LE(std::fabs(range.value - winding_number(mesh, q)), range.error + 1e-13);
    }
  }
  EXPECT_GT(bounded, 150);
  EXPECT_GT(largest, 1e-7); // the tree was used
}

TEST(SolidAngleTree, AnglesAreThoseOfTheLibrary) {
  for (int n = 0; n <= 100000; ++n) {
    const double angle = n * 1e-5 * std::acos(-1.0), y = std::fabs(std::sin(angle));
    EXPECT_NEAR(voxelization::angle_of(std::cos(angle), y), std::atan2(y, std::cos(angle)), 1e-15);
  }
  EXPECT_EQ(voxelization::angle_of(0, 0), 0);
  EXPECT_EQ(voxelization::angle_of(2, 0), 0);
}

TEST(OrientedSurface, ConesCloseAnyChain) {
  std::mt19937 random(8);
  for (int n = 0; n < 50; ++n) {
    TriangleMesh mesh = sphere_mesh(2, 9, {0.1, 0.2, 0.3});
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
    mesh.triangles.resize(mesh.triangles.size() / 2);
    for (Triangle& t : mesh.triangles)
      if (random() % 3 == 0)
        std::swap(t[0], t[1]);
    const repair::ClosingCones closing = repair::closing_cones(mesh.points, mesh.triangles);
    EXPECT_FALSE(closing.cones.empty());
    EXPECT_GE(closing.pieces.size(), closing.cones.size());
    for (const auto* added : {&closing.cones, &closing.pieces}) {
      std::vector<Triangle> all = mesh.triangles;
      all.insert(all.end(), added->begin(), added->end());
      std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
      for (const Triangle& t : all)
        for (std::size_t c = 0; c < 3; ++c)
          balance[std::minmax(t[c], t[(c + 1) % 3])] += t[c] < t[(c + 1) % 3] ? 1 : -1;
      EXPECT_TRUE(
          std::all_of(balance.begin(), balance.end(), [](auto& b) { return b.second == 0; }));
    }
  }
}

TEST(VoxelizeRules, SamplesAreCountedForEachRule) {
  TriangleMesh mesh = sphere_mesh(2, 70, {0.3, -0.2, 0.1}); // large tiles on the fine lattice
  append(mesh, turned(sphere_mesh(1, 20, {-40, 0, 0})));
  rotate(mesh, 1);
  for (const int n : {2, 3}) {
    const auto parity =
        voxelization::scan_inside(Context{}, mesh, volume::uniform_transform(2), {.samples = n});
    const auto winding =
        voxelization::scan_inside(Context{}, mesh, volume::uniform_transform(2),
                                  {.rule = voxelization::VoxelRule::winding, .samples = n});
    const auto zbuffer =
        voxelization::scan_inside(Context{}, mesh, volume::uniform_transform(2),
                                  {.rule = voxelization::VoxelRule::zbuffer, .samples = n});
    const TriangleMesh hull = [&] {
      TriangleMesh outer = mesh;
      outer.triangles.resize(320);
      return outer;
    }();
    const auto filled =
        voxelization::scan_inside(Context{}, hull, volume::uniform_transform(2), {.samples = n});
    EXPECT_NE(parity.counts, filled.counts);
    for (const voxelization::InsideScan* scan : {&winding, &zbuffer}) { // both fill the hollow
      EXPECT_EQ(scan->samples, n);
      EXPECT_EQ(scan->origins, filled.origins);
      EXPECT_EQ(scan->counts, filled.counts);
      EXPECT_EQ(scan->tiles.size(), filled.tiles.size());
    }
  }
}

// ---- zbuffer

/// The rule as it is said, for a mesh of small integers: rays from the sample, moved by 2^-14,
/// 2^-28, 2^-42, along both directions of each axis meet a triangle.
bool between_all_pairs(const TriangleMesh& mesh, const Int3& at) {
  const Vec3 p{at[0] + 0x1p-14, at[1] + 0x1p-28, at[2] + 0x1p-42};
  std::uint64_t tests = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    bool before = false, after = false;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
      const int turn = turn_sign(a[u], a[v], b[u], b[v], c[u], c[v], tests);
      if (turn == 0 || turn_sign(a[u], a[v], b[u], b[v], p[u], p[v], tests) != turn ||
          turn_sign(b[u], b[v], c[u], c[v], p[u], p[v], tests) != turn ||
          turn_sign(c[u], c[v], a[u], a[v], p[u], p[v], tests) != turn)
        continue;
      // The normal's component along the axis has the sign of `turn`.
      (side_sign(a, b, c, p, tests) == turn ? before : after) = true;
    }
    if (!before || !after)
      return false;
  }
  return true;
}

TEST(VoxelizeZbuffer, IsTheRuleBitForBit) {
  std::mt19937 random(6);
  for (int n = 0; n < 12; ++n) {
    TriangleMesh mesh = sphere_mesh(n % 3, 9, {});
    for (Vec3& p : mesh.points) { // on voxel centres, spiky, and in every third scene open
      const double scale = n % 2 == 0 ? 1 : 0.3 + 0.1 * static_cast<double>(random() % 8);
      p = {std::round(p.x * scale), std::round(p.y * scale), std::round(p.z * scale)};
    }
    if (n % 3 == 2)
      append(mesh, sphere_mesh(0, 4, {}));
    for (Vec3& p : mesh.points)
      p = {std::round(p.x), std::round(p.y), std::round(p.z)};
    if (n >= 9)
      mesh.triangles.resize(mesh.triangles.size() * 3 / 4);
    const auto inside = voxels(mesh, voxelization::VoxelRule::zbuffer);
    std::size_t expected = 0;
    for (std::int32_t i = -11; i <= 11; ++i)
      for (std::int32_t j = -11; j <= 11; ++j)
        for (std::int32_t k = -11; k <= 11; ++k) {
          const bool is = between_all_pairs(mesh, {i, j, k});
          expected += is;
          ASSERT_EQ(inside.contains({i, j, k}), is) << n << ": " << i << " " << j << " " << k;
        }
    EXPECT_EQ(inside.size(), expected);
    EXPECT_GT(expected, 30u);
  }
}

TEST(VoxelizeZbuffer, ConvexBodiesAreExactAndHollowsAreFilled) {
  const TriangleMesh ball = sphere_mesh(4, 40, {0.1, 0.2, 0.3});
  const auto exact = voxels(ball, voxelization::VoxelRule::parity);
  EXPECT_EQ(voxels(ball, voxelization::VoxelRule::zbuffer), exact);
  TriangleMesh hollow = ball;
  append(hollow, turned(sphere_mesh(4, 28, {0.1, 0.2, 0.3})));
  const auto parity = voxels(hollow, voxelization::VoxelRule::parity);
  const auto zbuffer = voxels(hollow, voxelization::VoxelRule::zbuffer);
  EXPECT_EQ(zbuffer, exact); // the whole hollow is missed
  const double missed =
      static_cast<double>(zbuffer.size() - parity.size()) / static_cast<double>(zbuffer.size());
  EXPECT_NEAR(missed, std::pow(28.0 / 40, 3), 0.01);
  RecordProperty("missed_percent", static_cast<int>(std::lround(100 * missed)));
  // A point is inside only where each of the other rules' lines of sight is blocked.
  for (const Int3& v : parity)
    EXPECT_TRUE(zbuffer.contains(v));
}

TEST(VoxelizeZbuffer, BuffersBeyondTheLimitAreRefusedWithTheNumber) {
  Context context;
  context.max_memory = std::uint64_t{100} << 20;
  const TriangleMesh needle = box_mesh({0, 0, 0}, {90000, 1, 90000});
  try {
    voxelization::scan_inside(context, needle, volume::uniform_transform(10),
                              {.rule = voxelization::VoxelRule::zbuffer});
    FAIL() << "no limit was found";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("needs"), std::string::npos) << error.what();
  }
}

} // namespace
