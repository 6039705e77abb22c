// Solids cut by blades: sound whatever the blade, exact where formulas or the clipping of solids by
// planes (tetrahedra/clip.h, other code) say what comes out.

#include "base/disjoint_sets.h"
#include "incision/cut_blade_internal.h"
#include "incision/cut_link_internal.h"
#include "incision/cut_split_internal.h"
#include "stuffing/stuffing.h"
#include "surface_scenes.h"
#include "tests/unit/complaint.h"
#include "tet_cut_checks.h"
#include "tet_fixtures.h"
#include "tetrahedra/clip.h"
#include "tetrahedra/components.h"
#include "tetrahedra/order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::blade_strip;
using test::box_tetrahedra;
using test::fault_of;
using test::same_bytes;
using test::wall_area;

Vec3 direction(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  for (;;) {
    const Vec3 v{unit(random), unit(random), unit(random)};
    if (norm(v) < 1 && norm(v) > 0.1)
      return v / norm(v);
  }
}

/// A square blade with sides of 2 · reach, and the plane that it lies in.
struct FlatBlade {
  Vec3 centre, normal;
  TriangleMesh surface;

  FlatBlade(const Vec3& at, const Vec3& u, const Vec3& beside, double reach) : centre(at) {
    const Vec3 w = beside - u * dot(u, beside);
    const Vec3 v = w / norm(w);
    normal = cross(u, v);
    surface = blade_strip(at, u * reach, v * reach);
  }
};

FlatBlade random_flat(const tetrahedra::TetMesh& mesh, double reach, std::mt19937& random) {
  const Box3 box = tetrahedra::bounding_box(mesh);
  std::uniform_real_distribution<double> share(0.2, 0.8);
  const Vec3 size = box.size();
  const Vec3 at =
      box.min + Vec3{share(random) * size.x, share(random) * size.y, share(random) * size.z};
  const Vec3 u = direction(random);
  Vec3 v = direction(random);
  while (std::fabs(dot(u, v)) > 0.9)
    v = direction(random);
  return FlatBlade(at, u, v, reach * box.longest_side());
}

tetrahedra::TetMesh stuffed_metaballs() {
  return stuffing::stuff(Context{}, scenes::metaballs(12, 1, 0.3), {});
}

/// Materials in slabs along x whose interfaces are faces of a box of cubes.
tetrahedra::TetMesh slabs(std::uint32_t n, std::uint32_t first) {
  tetrahedra::TetMesh mesh = box_tetrahedra(n, n, n, 1.0 / n);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    double x = 0;
    for (const std::uint32_t corner : t)
      x += mesh.points[corner].x / 4;
    mesh.material.push_back(x * n < first ? 3 : 7);
  }
  return mesh;
}

double area_of_clip(const tetrahedra::TetMesh& mesh, const tetrahedra::ClipPlane& plane) {
  const tetrahedra::TetClip clip = tetrahedra::clip_tetrahedra(mesh, plane);
  double sum = 0;
  for (std::size_t f = clip.cut_begin; f < clip.mesh.triangles.size(); ++f) {
    const auto& [a, b, c] = clip.mesh.triangles[f];
    sum += norm(cross(clip.mesh.points[b] - clip.mesh.points[a],
                      clip.mesh.points[c] - clip.mesh.points[a])) /
           2;
  }
  return sum;
}

/// Volumes of what lies above and below a plane; NaN where a tetrahedron reaches far over it.
std::array<double, 2> volumes_beside(const tetrahedra::TetMesh& mesh, const Vec3& at,
                                     const Vec3& normal) {
  std::array<double, 2> sums{};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (const Vec3& p : test::places_of(mesh, t)) {
      least = test::smaller(least, dot(p - at, normal));
      most = test::larger(most, dot(p - at, normal));
    }
    const double reach = std::fmin(-least, most);
    sums[most > -least ? 0 : 1] +=
        reach <= 1e-12 ? test::volume_at(mesh, t) : std::numeric_limits<double>::quiet_NaN();
  }
  return sums;
}

// ---- Planes

void expect_planar_cut(const tetrahedra::TetMesh& mesh, const FlatBlade& blade,
                       const incision::BladeCutOptions& options, int& exact) {
  const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade.surface, options);
  ASSERT_EQ(fault_of(mesh, cut, options.least_angle), "");
  EXPECT_EQ(cut.report.folded, 0U);
  EXPECT_EQ(cut.report.rejoined, 0U);
  if (cut.report.kept > 0)
    return;
  ++exact;
  const double whole = tetrahedra::volume(mesh);
  const tetrahedra::TetClip clip = tetrahedra::clip_tetrahedra(mesh, {blade.centre, blade.normal});
  EXPECT_NEAR(wall_area(cut), area_of_clip(mesh, {blade.centre, blade.normal}),
              1e-11 * std::pow(whole, 2.0 / 3));
  const auto [above, below] = volumes_beside(cut.mesh, blade.centre, blade.normal);
  EXPECT_NEAR(below, signed_volume(clip.mesh), 1e-12 * whole);
  EXPECT_NEAR(above, whole - signed_volume(clip.mesh), 1e-12 * whole);
  for (const incision::WallTriangle& wall : cut.wall)
    for (std::size_t side = 0; side < 2; ++side)
      for (const Vec3& p : test::places_of(cut.mesh, wall.tetrahedron[side]))
        EXPECT_GE(dot(p - blade.centre, blade.normal) * (side == 0 ? 1 : -1), -1e-12);
}

TEST(TetCut, PlanesThroughABox) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(6, 6, 6, 1.0 / 6);
  std::mt19937 random(1);
  int exact = 0;
  for (int n = 0; n < 40; ++n)
    expect_planar_cut(mesh, random_flat(mesh, 3, random), {}, exact);
  EXPECT_GE(exact, 12);
}

TEST(TetCut, PlanesThroughDistortedAndRoundBodies) {
  const tetrahedra::TetMesh box = test::distorted_box(), round = stuffed_metaballs();
  std::mt19937 random(2);
  int exact = 0;
  for (int n = 0; n < 25; ++n) {
    expect_planar_cut(box, random_flat(box, 3, random), {}, exact);
    expect_planar_cut(round, random_flat(round, 3, random), {0.3, 0, {}, {}}, exact);
  }
  EXPECT_GE(exact, 25);
}

TEST(TetCut, APlaneParts) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(6, 6, 6, 1.0 / 6);
  std::mt19937 random(3);
  for (int n = 0; n < 20; ++n) {
    const incision::TetCut cut =
        incision::cut_tetrahedra(mesh, random_flat(mesh, 3, random).surface);
    EXPECT_EQ(tetrahedra::component_count(cut.mesh), 2U);
    const tetrahedra::TetReport report = tetrahedra::examine_tetrahedra(cut.mesh);
    EXPECT_TRUE(report.sound() && report.manifold_boundary());
  }
}

TEST(TetCut, APlaneOfNodesSplitsNothing) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(4, 4, 4, 0.25);
  const incision::TetCut cut =
      incision::cut_tetrahedra(mesh, blade_strip({0.5, 0.5, 0.5}, {2, 0, 0}, {0, 2, 0}, 3));
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  EXPECT_EQ(cut.mesh.tetrahedra.size(), mesh.tetrahedra.size());
  EXPECT_EQ(cut.mesh.points.size(), mesh.points.size() + 25);
  EXPECT_EQ(cut.wall.size(), 32U);
  EXPECT_NEAR(wall_area(cut), 1, 1e-14);
  EXPECT_EQ(tetrahedra::component_count(cut.mesh), 2U);
  EXPECT_EQ(cut.report.moved + cut.report.kept + cut.report.split, 0U);
  // Exactly as large as the body, and a hair beside the nodes.
  for (const double z : {0.5, 0.5 + 1e-13, 0.5 - 1e-13}) {
    const incision::TetCut tight =
        incision::cut_tetrahedra(mesh, blade_strip({0.5, 0.5, z}, {0.5, 0, 0}, {0, 0.5, 0}));
    EXPECT_EQ(fault_of(mesh, tight, incision::blade_cut_least_angle), "");
    EXPECT_NEAR(wall_area(tight), 1, 1e-12);
    EXPECT_EQ(tetrahedra::component_count(tight.mesh), 2U);
  }
}

TEST(TetCut, AnglesStayWithinTheirBound) {
  const tetrahedra::TetMesh mesh = stuffed_metaballs();
  std::mt19937 random(4);
  for (const double bound : {0.0, 4.0, 8.0, 10.0})
    for (int n = 0; n < 5; ++n) {
      const incision::TetCut cut = incision::cut_tetrahedra(
          mesh, random_flat(mesh, 3, random).surface, {0.3, bound, {}, {}});
      EXPECT_EQ(fault_of(mesh, cut, bound), "");
      EXPECT_EQ(fault_of(mesh, cut, bound + 20).substr(0, 21), "angles of tetrahedron");
    }
}

/// Parts of tetrahedra that are sharper than the bound may be as sharp as these.
TEST(TetCut, TetrahedraThatAreSharpAlreadyAreSplit) {
  tetrahedra::TetMesh mesh = box_tetrahedra(6, 6, 6, 1.0 / 6);
  for (Vec3& p : mesh.points)
    p.z *= 0.08; // dihedral angles of 5 degrees
  const incision::BladeCutOptions options{0, 10, {}, {}};
  const incision::TetCut cut = incision::cut_tetrahedra(
      mesh, blade_strip({2.5 / 6, 0.5, 0.04}, {0, 3, 0}, {0, 0, 3}), options);
  EXPECT_EQ(fault_of(mesh, cut, options.least_angle), "");
  EXPECT_GT(cut.report.split, 20U);
}

// ---- Blades that end in the tissue, one after the other

TEST(TetCut, ABladeThatEndsInsideLeavesTheFrontJoined) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(8, 8, 8, 0.125);
  const incision::TetCut cut =
      incision::cut_tetrahedra(mesh, blade_strip({0.3, 0.5, 0.53}, {0.4, 0, 0.05}, {0, 1, 0}));
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  EXPECT_EQ(tetrahedra::component_count(cut.mesh), 1U);
  // From x = 0 to 0.7, less an element at most.
  EXPECT_GT(wall_area(cut), 0.55);
  EXPECT_LT(wall_area(cut), 0.72);
  std::size_t joined = 0, apart = 0;
  for (const incision::WallTriangle& wall : cut.wall)
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_LE(cut.mesh.points[wall.corners[0][k]].x, 0.7 + 0.07);
      (wall.corners[0][k] == wall.corners[1][2 - k] ? joined : apart) += 1;
    }
  EXPECT_GT(joined, 10U);
  EXPECT_GT(apart, 10 * joined / 2);
}

TEST(TetCut, ASlitInsideHasNoRimOnTheBoundary) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(8, 8, 8, 0.125);
  const incision::TetCut cut =
      incision::cut_tetrahedra(mesh, blade_strip({0.5, 0.5, 0.5}, {0.3, 0, 0.02}, {0.01, 0.3, 0}));
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  EXPECT_GT(cut.wall.size(), 20U);
  EXPECT_EQ(tetrahedra::component_count(cut.mesh), 1U);
  TriangleMesh outer = tetrahedra::boundary(cut.mesh).mesh;
  EXPECT_NEAR(signed_volume(outer), 1, 1e-12);
}

TEST(TetCut, StepsThatGoBackToTheFrontPartTheBody) {
  tetrahedra::TetMesh mesh = box_tetrahedra(8, 8, 8, 0.125);
  const TriangleMesh whole = blade_strip({0.5, 0.5, 0.53}, {0.6, 0.05, 0.05}, {0, 0.7, 0.1}, 24);
  double area = 0;
  for (std::size_t step = 1; step <= 24; ++step) {
    TriangleMesh swept = whole;
    swept.triangles.resize(2 * step);
    const incision::TetCut cut = incision::cut_tetrahedra(mesh, swept);
    ASSERT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "") << step;
    EXPECT_EQ(tetrahedra::component_count(cut.mesh),
              step < 22 ? 1U : tetrahedra::component_count(cut.mesh));
    area += wall_area(cut);
    mesh = cut.mesh;
  }
  EXPECT_EQ(tetrahedra::component_count(mesh), 2U);
  const incision::TetCut again = incision::cut_tetrahedra(mesh, whole);
  EXPECT_EQ(again.wall.size(), 0U);
  EXPECT_EQ(tetrahedra::component_count(again.mesh), 2U);
  EXPECT_GT(area, 1.0);
}

TEST(TetCut, CutsOfCuts) {
  tetrahedra::TetMesh mesh = slabs(6, 2);
  const std::array<TriangleMesh, 3> blades{blade_strip({0.5, 0.5, 0.47}, {1, 0, 0.1}, {0, 1, 0.2}),
                                           blade_strip({0.5, 0.52, 0.5}, {1, 0.1, 0}, {0, 0.1, 1}),
                                           blade_strip({0.55, 0.5, 0.5}, {0, 1, 0}, {0.15, 0, 1})};
  std::uint64_t parts = 1;
  for (const TriangleMesh& blade : blades) {
    const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade);
    EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
    mesh = cut.mesh;
    parts *= 2;
    EXPECT_EQ(tetrahedra::component_count(mesh), parts);
  }
}

TEST(TetCut, HundredRandomCutsOneAfterTheOther) {
  tetrahedra::TetMesh mesh = slabs(9, 4);
  ASSERT_GE(mesh.tetrahedra.size(), 4000U);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> reach(0.05, 0.22), bend(-0.5, 0.5);
  std::size_t walls = 0;
  for (int n = 0; n < 100; ++n) {
    FlatBlade blade = random_flat(mesh, reach(random), random);
    const double curved = bend(random);
    for (Vec3& p : blade.surface.points)
      p += blade.normal * (curved * dot(p - blade.centre, p - blade.centre));
    const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade.surface);
    ASSERT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "") << n;
    walls += cut.wall.size();
    mesh = cut.mesh;
  }
  EXPECT_GT(walls, 1000U);
}

/// No piece has tetrahedra on both sides of a plane, farther away than nodes that it missed.
bool hangs_over(const incision::TetCut& cut, const FlatBlade& blade) {
  DisjointSets pieces(cut.mesh.points.size());
  for (const Tetrahedron& t : cut.mesh.tetrahedra)
    for (std::size_t k = 1; k < 4; ++k)
      pieces.join(t[0], t[k]);
  std::vector<std::array<bool, 2>> on(cut.mesh.points.size());
  for (const Tetrahedron& t : cut.mesh.tetrahedra) {
    Vec3 centre;
    for (const std::uint32_t corner : t)
      centre += cut.mesh.points[corner] * 0.25;
    const double height = dot(centre - blade.centre, blade.normal);
    if (std::fabs(height) > cut.report.largest_miss)
      on[pieces.find(t[0])][height > 0 ? 0 : 1] = true;
  }
  return std::ranges::any_of(on, [](const auto& sides) { return sides[0] && sides[1]; });
}

/// Fronts of the earlier wounds end on the last wall, touch it, run along it.
TEST(TetCut, AWoundedBodyFallsApartWhole) {
  std::uint64_t opened = 0;
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    tetrahedra::TetMesh mesh =
        seed % 2 == 0 ? box_tetrahedra(7, 7, 7, 1.0 / 7) : stuffed_metaballs();
    for (int n = 0; n < 4; ++n)
      mesh = incision::cut_tetrahedra(mesh, random_flat(mesh, 0.3, random).surface).mesh;
    const FlatBlade last = random_flat(mesh, 3, random);
    const incision::TetCut cut = incision::cut_tetrahedra(mesh, last.surface);
    EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "") << seed;
    EXPECT_EQ(cut.report.rejoined, 0U) << seed;
    EXPECT_FALSE(hangs_over(cut, last)) << seed;
    opened += cut.report.opened;
  }
  EXPECT_GT(opened, 10U);
}

// ---- Other shapes of blades

/// A tube about the z axis through `centre`, closed round it, open at its ends.
TriangleMesh tube(const Vec3& centre, double radius, double half, std::uint32_t sides) {
  TriangleMesh blade;
  for (std::uint32_t n = 0; n < sides; ++n) {
    const double angle = 2 * std::numbers::pi * n / sides;
    for (const double z : {-half, half})
      blade.points.push_back(centre + Vec3{radius * std::cos(angle), radius * std::sin(angle), z});
    const std::uint32_t a = 2 * n, b = 2 * ((n + 1) % sides);
    blade.triangles.push_back({a, b, a + 1});
    blade.triangles.push_back({b, b + 1, a + 1});
  }
  return blade;
}

TEST(TetCut, ATubeCutsOutACore) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(10, 10, 10, 0.1);
  const incision::TetCut cut = incision::cut_tetrahedra(mesh, tube({0.5, 0.5, 0.5}, 0.31, 0.7, 24));
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  ASSERT_EQ(tetrahedra::component_count(cut.mesh), 2U);
  tetrahedra::TetMesh rest = cut.mesh;
  const tetrahedra::TetComponentReport parts = tetrahedra::keep_components(rest, {1, 0});
  const double polygon = 12 * 0.31 * 0.31 * std::sin(2 * std::numbers::pi / 24);
  EXPECT_NEAR(parts.dropped_volume, polygon, 0.02 * polygon);
  EXPECT_NEAR(wall_area(cut), 48 * 0.31 * std::sin(std::numbers::pi / 24), 0.05);
}

TEST(TetCut, ANarrowBladeLeavesTheSolidSound) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(6, 6, 6, 1.0 / 6);
  std::mt19937 random(8);
  std::uint64_t rejoined = 0;
  for (int n = 0; n < 60; ++n) {
    const double width = 0.02 + 0.004 * n;
    const FlatBlade at = random_flat(mesh, 1, random);
    const Vec3 u = direction(random), v = cross(u, at.normal) / norm(cross(u, at.normal));
    const incision::TetCut cut =
        incision::cut_tetrahedra(mesh, blade_strip(at.centre, u * 0.6, v * width, 7));
    ASSERT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "") << n;
    rejoined += cut.report.rejoined;
  }
  EXPECT_GT(rejoined, 0U); // the case occurs
}

TEST(TetCut, ASecondLeafWithinAnEdgeIsTold) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(2, 2, 2, 0.5);
  TriangleMesh blade = blade_strip({0.5, 0.5, 0.7}, {1, 0, 0}, {0, 1, 0});
  const TriangleMesh second = blade_strip({0.5, 0.5, 0.8}, {0, 1, 0}, {1, 0, 0});
  for (const Triangle& t : second.triangles)
    blade.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  blade.points.insert(blade.points.end(), second.points.begin(), second.points.end());
  const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade);
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  EXPECT_GT(cut.report.folded, 8U);
  EXPECT_EQ(cut.wall.size(), 0U);
  EXPECT_TRUE(same_bytes(cut.mesh, mesh));
}

TEST(TetCut, ABladeBesideTheBodyChangesNothing) {
  const tetrahedra::TetMesh mesh = slabs(3, 1);
  for (const TriangleMesh& blade :
       {blade_strip({0.5, 0.5, 1.2}, {1, 0, 0}, {0, 1, 0}), TriangleMesh{},
        blade_strip({0.5, 0.5, 0.5}, {0.01, 0, 0}, {0, 0.01, 0})}) {
    const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade);
    EXPECT_TRUE(same_bytes(cut.mesh, mesh));
    EXPECT_TRUE(cut.changed.empty() && cut.wall.empty());
    EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  }
}

// ---- Options

TEST(TetCut, HeldNodesAreNotMoved) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(6, 6, 6, 1.0 / 6);
  const TriangleMesh blade = blade_strip({0.5, 0.5, 0.54}, {1, 0, 0.1}, {0, 1, 0.05});
  const incision::TetCut free = incision::cut_tetrahedra(mesh, blade);
  ASSERT_GT(free.report.moved, 10U);
  std::vector<std::uint32_t> held;
  for (std::uint32_t n = 0; n < mesh.points.size(); n += 2)
    held.push_back(static_cast<std::uint32_t>(mesh.points.size() - 1 - n));
  incision::BladeCutOptions options;
  options.held = held;
  const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade, options);
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  std::size_t moved = 0;
  for (const std::uint32_t n : held) {
    EXPECT_EQ(cut.mesh.points[n], mesh.points[n]);
    moved += free.mesh.points[n] == mesh.points[n] ? 0 : 1;
  }
  EXPECT_GT(moved, 0U);
  EXPECT_GT(cut.report.moved, 0U);
}

TEST(TetCut, ABodyThatIsElsewhereIsCutThere) {
  const tetrahedra::TetMesh mesh = slabs(6, 2);
  const TriangleMesh blade = blade_strip({0.5, 0.5, 0.54}, {0.4, 0, 0.1}, {0, 1, 0.05}, 3);
  const auto map = [](const Vec3& p) { return Vec3{2 * p.z, 2 * p.x, 2 * p.y}; };
  std::vector<Vec3> places;
  for (const Vec3& p : mesh.points)
    places.push_back(map(p));
  TriangleMesh there = blade;
  for (Vec3& p : there.points)
    p = map(p);
  incision::BladeCutOptions options;
  options.places = places;
  const incision::TetCut a = incision::cut_tetrahedra(mesh, blade),
                         b = incision::cut_tetrahedra(mesh, there, options);
  EXPECT_EQ(fault_of(mesh, b, incision::blade_cut_least_angle), "");
  EXPECT_EQ(a.mesh.tetrahedra, b.mesh.tetrahedra);
  ASSERT_EQ(a.mesh.points.size(), b.mesh.points.size());
  for (std::size_t n = 0; n < a.mesh.points.size(); ++n)
    EXPECT_LE(norm(a.mesh.points[n] - b.mesh.points[n]), 1e-14);
  // Bent out of shape the body is as sound.
  for (Vec3& p : places)
    p = {p.x + p.y * p.y, p.y * (1 + p.z), p.z - p.x * p.y / 2};
  const incision::TetCut bent = incision::cut_tetrahedra(mesh, there, options);
  EXPECT_EQ(fault_of(mesh, bent, incision::blade_cut_least_angle), "");
  EXPECT_GT(bent.wall.size(), 20U);
}

TEST(TetCut, ComparesWhatIsNearTheBladeAlone) {
  std::array<std::uint64_t, 2> tested{};
  for (std::uint32_t n = 0; n < 2; ++n) {
    const tetrahedra::TetMesh mesh = box_tetrahedra(8 + 8 * n, 8 + 8 * n, 8 + 8 * n);
    const incision::TetCut cut =
        incision::cut_tetrahedra(mesh, blade_strip({4, 4, 4.4}, {1.5, 0, 0}, {0, 1.5, 0.2}));
    EXPECT_GT(cut.wall.size(), 8U);
    tested[n] = cut.report.tested;
  }
  EXPECT_EQ(tested[0], tested[1]);
  EXPECT_LT(tested[0], 400U);
}

TEST(TetCut, RefusesByName) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(2, 2, 2);
  const TriangleMesh blade = blade_strip({1, 1, 1.1}, {2, 0, 0}, {0, 2, 0});
  const auto refusal = [&](const tetrahedra::TetMesh& solid, const TriangleMesh& surface,
                           const incision::BladeCutOptions& options = {}) {
    return test::complaint([&] { incision::cut_tetrahedra(solid, surface, options); });
  };
  tetrahedra::TetMesh curved = mesh;
  tetrahedra::make_quadratic(curved);
  EXPECT_EQ(refusal(curved, blade), "");
  for (std::size_t n = mesh.points.size(); n < curved.points.size(); ++n)
    curved.points[n].z += 0.01;
  EXPECT_NE(refusal(curved, blade).find("is curved"), std::string::npos);
  tetrahedra::TetMesh turned = mesh;
  std::swap(turned.tetrahedra[9][0], turned.tetrahedra[9][1]);
  EXPECT_NE(refusal(turned, blade).find("no positive volume"), std::string::npos);
  TriangleMesh odd = blade;
  std::swap(odd.triangles[1][0], odd.triangles[1][1]);
  EXPECT_NE(refusal(mesh, odd).find("the same way"), std::string::npos);
  odd = blade;
  odd.points.push_back({1, 1, 3});
  odd.triangles.push_back({odd.triangles[0][1], odd.triangles[0][2], 4});
  EXPECT_NE(refusal(mesh, odd).find("3 triangles"), std::string::npos);
  odd = blade;
  odd.points[2].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(mesh, odd), "");
  odd.points[2].y = 1e13;
  EXPECT_NE(refusal(mesh, odd).find("2^40"), std::string::npos);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double snap : {-0.1, 0.6, nan})
    EXPECT_NE(refusal(mesh, blade, {snap, 8, {}, {}}).find("0 to 0.5"), std::string::npos);
  for (const double angle : {-1.0, 60.0, nan})
    EXPECT_NE(refusal(mesh, blade, {0.3, angle, {}, {}}).find("degrees"), std::string::npos);
  const std::vector<Vec3> places(3);
  incision::BladeCutOptions options;
  options.places = places;
  EXPECT_NE(refusal(mesh, blade, options).find("3 places"), std::string::npos);
  const std::vector<std::uint32_t> held{27};
  options = {};
  options.held = held;
  EXPECT_NE(refusal(mesh, blade, options).find("node 27"), std::string::npos);
  std::vector<Vec3> lost = mesh.points;
  lost[13].z = nan;
  options = {};
  options.places = lost;
  EXPECT_NE(refusal(mesh, blade, options), "");
}

// ---- Quadratic solids, and what nodes carry

Vec3 polynomial(const Vec3& p, bool quadratic) {
  const Vec3 linear{1 + p.x - 2 * p.y, p.z + 0.5 * p.x, 3 - p.y};
  return quadratic ? linear + Vec3{p.x * p.y, p.z * p.z - p.x * p.z, p.y * p.y} : linear;
}

/// All corners of a tetrahedron can lie on a folded blade that follows the faces of the mesh. Such
/// a tetrahedron must not become a component of its own.
TEST(TetCut, TetrahedraWithAllCornersOnTheBladeStayAttached) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(2, 2, 2, 0.5);
  const std::vector<std::vector<Vec3>> folds{{{-0.1, 0.4, -0.5},
                                              {1.6, -0.4, 0.2},
                                              {-0.2, 0.8, 0.2},
                                              {1.5, -0.1, 0.9},
                                              {-0.4, 0.5, 0.4},
                                              {1.3, -0.3, 1.1}},
                                             {{0.2, -0.4, 0.7},
                                              {1.7, 0.9, 0.8},
                                              {-0.2, 0.1, 0.7},
                                              {1.3, 1.4, 0.8},
                                              {-0.3, 0.1, 1.4},
                                              {1.3, 1.3, 1.5}},
                                             {{0.5, -0.7, 0.1},
                                              {-0.1, 0.9, 1.2},
                                              {0.6, -0.4, -0.2},
                                              {0, 1.2, 0.9},
                                              {0.1, -0.3, -0.7},
                                              {-0.5, 1.3, 0.3}}};
  incision::BladeCutOptions options;
  options.along_faces = true;
  for (const std::vector<Vec3>& points : folds) {
    TriangleMesh blade;
    blade.points = points;
    blade.triangles = {{0, 2, 1}, {2, 3, 1}, {2, 4, 3}, {4, 5, 3}};
    const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade, options);
    EXPECT_EQ(fault_of(mesh, cut, options.least_angle), "");
    EXPECT_EQ(cut.mesh.tetrahedra.size(), mesh.tetrahedra.size());
    EXPECT_EQ(tetrahedra::component_count(cut.mesh), 1U);
  }
}

TEST(TetCut, QuadraticSolidsKeepTheirMiddles) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> reach(0.1, 0.5);
  for (const bool distorted : {false, true}) {
    tetrahedra::TetMesh mesh = distorted ? test::distorted_box() : slabs(5, 2);
    tetrahedra::make_quadratic(mesh);
    for (int n = 0; n < 12; ++n) {
      const incision::TetCut cut =
          incision::cut_tetrahedra(mesh, random_flat(mesh, reach(random), random).surface);
      ASSERT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "") << n;
      ASSERT_EQ(cut.mesh.middles.size(), cut.mesh.tetrahedra.size());
      mesh = cut.mesh;
    }
  }
}

TEST(TetCut, QuadraticSolidsAreCutAsLinearOnesAre) {
  const tetrahedra::TetMesh mesh = slabs(5, 2);
  tetrahedra::TetMesh quadratic = mesh;
  tetrahedra::make_quadratic(quadratic);
  const TriangleMesh blade = blade_strip({0.4, 0.5, 0.54}, {0.5, 0, 0.1}, {0, 1, 0.05});
  const incision::TetCut a = incision::cut_tetrahedra(mesh, blade),
                         b = incision::cut_tetrahedra(quadratic, blade);
  ASSERT_EQ(a.mesh.tetrahedra.size(), b.mesh.tetrahedra.size());
  for (std::size_t t = 0; t < a.mesh.tetrahedra.size(); ++t)
    EXPECT_EQ(test::places_of(a.mesh, t), test::places_of(b.mesh, t));
  EXPECT_EQ(a.wall.size(), b.wall.size());
  EXPECT_EQ(a.changed, b.changed);
  // All nodes stay in use, so that none is left over.
  EXPECT_EQ(tetrahedra::examine_tetrahedra(b.mesh).unused_points.count, 0U);
  EXPECT_EQ(tetrahedra::component_count(a.mesh), tetrahedra::component_count(b.mesh));
}

TEST(TetCut, NodesCarryWhatTheElementsSay) {
  std::mt19937 random(13);
  for (const bool quadratic : {false, true}) {
    tetrahedra::TetMesh mesh = test::distorted_box();
    if (quadratic)
      tetrahedra::make_quadratic(mesh);
    const incision::TetCut cut =
        incision::cut_tetrahedra(mesh, random_flat(mesh, 0.6, random).surface);
    ASSERT_GT(cut.report.moved, 0U);
    std::vector<Vec3> field;
    for (const Vec3& p : mesh.points)
      field.push_back(polynomial(p, quadratic));
    const std::vector<Vec3> carried = incision::carry_over(mesh, cut.origin, field);
    ASSERT_EQ(carried.size(), cut.mesh.points.size());
    for (std::size_t n = 0; n < carried.size(); ++n)
      EXPECT_LE(norm(carried[n] - polynomial(cut.mesh.points[n], quadratic)), 1e-12) << n;
  }
}

/// Moved from below a saddle to as far above it, a node would leave the boundary's area as it is,
/// but not the volume.
TEST(TetCut, ANodeOnASaddleStays) {
  tetrahedra::TetMesh mesh;
  const double high = 0.3, off = 0.1;
  mesh.points = {{0, 0, -off},  {0, 0, 1},     {1, 0, high},
                 {0, 1, -high}, {-1, 0, high}, {0, -1, -high}};
  mesh.tetrahedra = {{0, 2, 3, 1}, {0, 3, 4, 1}, {0, 4, 5, 1}, {0, 5, 2, 1}};
  const incision::TetCut cut =
      incision::cut_tetrahedra(mesh, blade_strip({0, 0, off}, {3, 0, 0}, {0, 3, 0}));
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  EXPECT_EQ(cut.mesh.points[0], mesh.points[0]);
  EXPECT_GT(cut.wall.size(), 3U);
}

/// A box with a notch between an upright plane and a slanted one, whose floor is an edge.
TEST(TetCut, ANodeCanFallIntoThreePieces) {
  tetrahedra::TetMesh whole = box_tetrahedra(4, 2, 4), mesh;
  mesh.points = whole.points;
  for (const Tetrahedron& t : whole.tetrahedra) {
    Vec3 c;
    for (const std::uint32_t corner : t)
      c += whole.points[corner] * 0.25;
    if (!(c.z > 2 && c.x > 2 && c.x - 2 < c.z - 2))
      mesh.tetrahedra.push_back(t);
  }
  tetrahedra::drop_unused_points(mesh);
  ASSERT_TRUE(tetrahedra::examine_tetrahedra(mesh).manifold_boundary());
  const TriangleMesh blade = blade_strip({2, 1, 2}, {3, 0, 0}, {0, 3, 0});
  const incision::TetCut cut = incision::cut_tetrahedra(mesh, blade);
  EXPECT_EQ(fault_of(mesh, cut, incision::blade_cut_least_angle), "");
  EXPECT_EQ(tetrahedra::component_count(cut.mesh), 3U);
  const auto at_floor = std::ranges::count_if(cut.mesh.points, [](const Vec3& p) {
    return p == Vec3{2, 1, 2};
  });
  EXPECT_EQ(at_floor, 3);
  EXPECT_NEAR(wall_area(cut), 8, 1e-12);
}

// ---- Parts of it

TEST(TetCut, PartsOfATetrahedronAgreeOnFacesInAnyPattern) {
  tetrahedra::TetMesh whole;
  whole.points = {{0, 0, 0}, {1, 0, 0}, {0.2, 0.9, 0}, {0.3, 0.4, 0.8}};
  whole.tetrahedra = {{0, 1, 2, 3}};
  std::array<std::uint32_t, 6> order{0, 1, 2, 3, 4, 5};
  std::mt19937 random(9);
  for (std::uint32_t pattern = 0; pattern < 64; ++pattern) {
    std::ranges::shuffle(order, random);
    tetrahedra::TetMesh parts;
    parts.points = whole.points;
    std::vector<incision::EdgeNode> nodes;
    for (const std::uint32_t e : order)
      if ((pattern >> e & 1U) != 0) {
        const auto& [a, b] = tetrahedra::tetrahedron_edges[e];
        nodes.push_back({{a, b}, static_cast<std::uint32_t>(parts.points.size())});
        parts.points.push_back(whole.points[a] * 0.4 + whole.points[b] * 0.6);
      }
    incision::split_tetrahedron(whole.tetrahedra[0], nodes,
                                [&](const Tetrahedron& part) { parts.tetrahedra.push_back(part); });
    const tetrahedra::TetReport report = tetrahedra::examine_tetrahedra(parts);
    EXPECT_TRUE(report.sound() && report.manifold_boundary()) << pattern;
    EXPECT_EQ(report.unused_points.count, 0U);
    EXPECT_NEAR(report.volume, tetrahedra::volume(whole), 1e-15);
    // Every corner adds one triangle to each of the two faces at its edge.
    EXPECT_EQ(report.boundary_triangles, 4 + 2 * nodes.size());
  }
}

TEST(TetCut, SharpnessIsTheCosineOfTheWorstAngle) {
  std::mt19937 random(10);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 500; ++n) {
    std::array<Vec3, 4> p;
    for (Vec3& point : p)
      point = {unit(random), unit(random), unit(random)};
    if (!(tetrahedra::tetrahedron_volume(p[0], p[1], p[2], p[3]) > 0)) {
      EXPECT_EQ(incision::sharpness(p[0], p[1], p[2], p[3]), 2);
      continue;
    }
    double worst = 0;
    for (const double angle : tetrahedra::dihedral_angles(p[0], p[1], p[2], p[3]))
      worst = test::larger(worst, std::fabs(std::cos(angle)));
    EXPECT_NEAR(incision::sharpness(p[0], p[1], p[2], p[3]), worst, 1e-12);
  }
}

TEST(TetCut, EdgesPassABladeBetweenItsTrianglesOnce) {
  // A roof over a fan, whose ridges and tip edges pass exactly, and its border.
  TriangleMesh roof;
  roof.points = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  roof.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
  const incision::Blade blade(roof);
  for (int i = -4; i <= 4; ++i)
    for (int j = -4; j <= 4; ++j) {
      const double x = i / 4.0, y = j / 4.0;
      const incision::BladeCrossing up = blade.crossing({x, y, -1}, {x, y, 2});
      const bool within = std::abs(i) + std::abs(j) <= 4;
      EXPECT_EQ(up.passes, within ? 1U : 0U) << x << " " << y;
      EXPECT_EQ(up.direction, within ? 1 : 0);
      EXPECT_NEAR(up.share, within ? (2 - std::fabs(x) - std::fabs(y)) / 3 : 0, 1e-15);
      const incision::BladeCrossing down = blade.crossing({x, y, 2}, {x, y, -1});
      EXPECT_EQ(down.direction, -up.direction);
    }
  EXPECT_EQ(blade.crossing({-2, 0, 0.5}, {2, 0, 0.5}).passes, 2U);
  EXPECT_EQ(blade.crossing({-2, 0, 0.5}, {2, 0, 0.5}).direction, 0);
}

TEST(TetCut, ARingOfTetrahedraFallsIntoTwoDiscs) {
  // Eight triangles of a ring round a square hole, as a node sees them: inner vertices 0 … 3, outer
  // ones 4 … 7; faces numbered by their ends.
  const auto face = [](std::uint32_t a, std::uint32_t b, bool open) {
    return incision::NodeLink::Face{
        {{{a, 0}, {b, 0}}}, 10 * std::min(a, b) + std::max(a, b), open, open};
  };
  incision::NodeLink ring;
  for (std::uint32_t n = 0; n < 4; ++n) {
    const std::uint32_t next = (n + 1) % 4;
    ring.add({face(n, next, true), face(next, n + 4, false), face(n, n + 4, false)});
    ring.add({face(n + 4, next + 4, true), face(next, n + 4, false), face(next, next + 4, false)});
  }
  EXPECT_EQ(ring.euler_number(), 0);
  const std::vector<std::uint32_t> ways = ring.ways_across(4);
  ASSERT_EQ(ways.size(), 2U);
  std::array<std::uint32_t, 4> ends{ways[0] / 10, ways[0] % 10, ways[1] / 10, ways[1] % 10};
  std::ranges::sort(ends);
  EXPECT_EQ(std::ranges::adjacent_find(ends), ends.end());
  EXPECT_TRUE(ring.ways_across(0).empty());
  incision::NodeLink disc;
  disc.add({face(0, 1, true), face(1, 2, true), face(0, 2, true)});
  EXPECT_EQ(disc.euler_number(), 1);
  EXPECT_TRUE(disc.ways_across(4).empty());
}

/// The checks themselves: each catches the fault that it is for.
TEST(TetCut, ChecksSeePlantedFaults) {
  const tetrahedra::TetMesh mesh = slabs(5, 2);
  const incision::TetCut cut =
      incision::cut_tetrahedra(mesh, blade_strip({0.4, 0.5, 0.54}, {0.5, 0, 0.1}, {0, 1, 0.05}));
  const auto fault = [&](const std::function<void(incision::TetCut&)>& plant) {
    incision::TetCut spoilt = cut;
    plant(spoilt);
    const std::string what = fault_of(mesh, spoilt, incision::blade_cut_least_angle);
    return what.substr(0, what.find_last_not_of("0123456789 ") + 1);
  };
  EXPECT_EQ(fault([](incision::TetCut&) {}), "");
  const std::size_t added = mesh.tetrahedra.size();
  ASSERT_GT(cut.mesh.tetrahedra.size(), added);
  EXPECT_EQ(fault([&](incision::TetCut& c) {
              std::swap(c.mesh.tetrahedra[added][0], c.mesh.tetrahedra[added][1]);
            }),
            "inverted tetrahedron");
  EXPECT_EQ(
      fault([&](incision::TetCut& c) { c.mesh.material[added] = 10 - c.mesh.material[added]; }),
      "material of tetrahedron");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.mesh.points.back().z += 1e-6; }), "place of node");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.origin.back().tetrahedron = 1 << 30; }),
            "origin of node");
  EXPECT_EQ(fault([](incision::TetCut& c) {
              for (incision::TetNodeOrigin& from : c.origin)
                if (from.node == incision::TetNodeOrigin::none)
                  from.weights = {0.25, 0.25, 0.25, 0.25};
            }),
            "place of node");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.origin[1].node = 0; }), "number of node");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.changed.pop_back(); }),
            "tetrahedron told to be unchanged");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.wall.pop_back(); }), "surface that is left out");
  EXPECT_EQ(fault([&](incision::TetCut& c) {
              c.surface.erase(std::ranges::find_if(
                  c.surface, [&](const incision::CutFace& f) { return f.tetrahedron >= added; }));
            }),
            "surface that is left out");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.surface.push_back(c.surface[3]); }),
            "surface told twice");
  EXPECT_EQ(fault([](incision::TetCut& c) {
              c.surface[4].weights[1] = {0.3, 0.3, 0.4};
            }),
            "weights of surface");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.surface[4].face_before += 4; }),
            "tetrahedron of surface");
  EXPECT_EQ(fault([](incision::TetCut& c) {
              std::swap(c.wall[0].corners[0][0], c.wall[0].corners[0][1]);
            }),
            "wall inside the tissue");
  EXPECT_EQ(fault([](incision::TetCut& c) { c.wall.push_back(c.wall[0]); }), "wall told twice");
  EXPECT_EQ(fault([](incision::TetCut& c) {
              std::swap(c.wall[0].tetrahedron[0], c.wall[0].tetrahedron[1]);
            }),
            "tetrahedron of wall");
  EXPECT_EQ(fault([](incision::TetCut& c) {
              const Triangle t = c.wall[0].corners[1];
              c.wall[0].corners[1] = {t[1], t[2], t[0]};
            }),
            "sides of wall");
  EXPECT_EQ(fault([&](incision::TetCut& c) {
              const auto t = c.mesh.tetrahedra.size() - 1;
              c.mesh.tetrahedra.erase(c.mesh.tetrahedra.begin() + static_cast<std::ptrdiff_t>(t));
              c.mesh.material.pop_back();
              c.tetrahedron.pop_back();
            }),
            "volume of material");
  // A copy glued to its node again at one of its tetrahedra.
  const std::string glued = fault([&](incision::TetCut& c) {
    const auto copy = static_cast<std::uint32_t>(c.mesh.points.size() - 1);
    const auto node =
        static_cast<std::uint32_t>(std::ranges::find(c.origin, c.origin[copy]) - c.origin.begin());
    for (std::size_t t = 0; t < c.mesh.tetrahedra.size(); ++t)
      for (std::uint32_t& corner : c.mesh.tetrahedra[t])
        if (corner == copy) {
          corner = node;
          return;
        }
  });
  EXPECT_NE(glued, "");
}

} // namespace
} // namespace gewebe::test
