// Solids cut open by a plane: what is left is closed, has the volume that formulas say, and no
// cracks, wherever nodes, edges and faces lie in the plane.

#include "base/error.h"
#include "mesh/check.h"
#include "stuffing/stuffing.h"
#include "surface_scenes.h"
#include "tests/unit/stuffing_checks.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/clip.h"
#include "tetrahedra/order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <vector>

namespace gewebe::test {
namespace {

using test::box_tetrahedra;

long double distance(const tetrahedra::ClipPlane& plane, const Vec3& p) {
  long double sum = 0;
  for (int axis = 0; axis < 3; ++axis)
    sum += static_cast<long double>(plane.normal[axis]) *
           (static_cast<long double>(p[axis]) - plane.point[axis]);
  return sum;
}

/// Which share of a tetrahedron has distances below 0, those at its corners being in ascending
/// order: similar tetrahedra at one corner, and two of these where two corners lie on either side.
long double share_below(const std::array<long double, 4>& d) {
  const auto tip = [](long double at, long double a, long double b, long double c) {
    return at / (at - a) * (at / (at - b)) * (at / (at - c));
  };
  if (!(d[0] < 0))
    return 0;
  if (!(d[3] > 0))
    return 1;
  if (!(d[1] < 0))
    return tip(d[0], d[1], d[2], d[3]);
  if (!(d[2] > 0))
    return 1 - tip(d[3], d[0], d[1], d[2]);
  // Cut in two where the edge from corner 1 to corner 2 meets the plane.
  const long double share = d[1] / (d[1] - d[2]);
  return share * (1 - tip(d[3], d[0], d[1], 0)) + (1 - share) * tip(d[0], 0, d[2], d[3]);
}

/// By the formulas, of each tetrahedron alone.
double volume_left(const tetrahedra::TetMesh& mesh, const tetrahedra::ClipPlane& plane) {
  long double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    std::array<long double, 4> d{};
    for (std::size_t k = 0; k < 4; ++k)
      d[k] = distance(plane, mesh.points[t[k]]);
    std::ranges::sort(d);
    sum += share_below(d) * tetrahedra::tetrahedron_volume(mesh.points[t[0]], mesh.points[t[1]],
                                                           mesh.points[t[2]], mesh.points[t[3]]);
  }
  return static_cast<double>(sum);
}

std::vector<double> areas(const tetrahedra::TetClip& left) {
  std::vector<double> found;
  const TriangleMesh& mesh = left.mesh;
  for (const auto& [a, b, c] : mesh.triangles)
    found.push_back(norm(cross(mesh.points[b] - mesh.points[a], mesh.points[c] - mesh.points[a])) /
                    2);
  return found;
}

double cut_area(const tetrahedra::TetClip& left) {
  double sum = 0;
  const std::vector<double> all = areas(left);
  for (std::size_t f = left.cut_begin; f < all.size(); ++f)
    sum += all[f];
  return sum;
}

/// Clips, and looks for what holds of any solid with a closed boundary.
tetrahedra::TetClip expect_closed(const tetrahedra::TetMesh& mesh,
                                  const tetrahedra::ClipPlane& plane) {
  tetrahedra::TetClip left = tetrahedra::clip_tetrahedra(mesh, plane);
  check_mesh(left.mesh);
  const mesh::MeshReport found = mesh::examine_mesh(left.mesh);
  EXPECT_TRUE(found.closed());
  EXPECT_EQ(found.degenerate_faces, 0U);
  EXPECT_EQ(found.unused_points, 0U);
  EXPECT_TRUE(found.manifold() && found.oriented());
  const double whole = tetrahedra::volume(mesh);
  EXPECT_NEAR(signed_volume(left.mesh), volume_left(mesh, plane), 1e-12 * whole);
  EXPECT_EQ(left.tetrahedron.size(), left.mesh.triangles.size());
  // The cut lies in the plane and looks along the normal; no point of anything lies beyond.
  const Vec3 &n = plane.normal,
             scaled = n / std::max({std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)}),
             normal = scaled / norm(scaled);
  const double size =
      tetrahedra::bounding_box(mesh).longest_side() + norm(tetrahedra::bounding_box(mesh).max);
  for (const Vec3& p : left.mesh.points)
    EXPECT_LE(dot(p - plane.point, normal), 1e-14 * size);
  for (std::size_t f = left.cut_begin; f < left.mesh.triangles.size(); ++f) {
    const auto& [a, b, c] = left.mesh.triangles[f];
    for (const std::uint32_t corner : {a, b, c})
      EXPECT_NEAR(dot(left.mesh.points[corner] - plane.point, normal), 0, 1e-14 * size);
    EXPECT_GE(dot(cross(left.mesh.points[b] - left.mesh.points[a],
                        left.mesh.points[c] - left.mesh.points[a]),
                  normal),
              -1e-14 * size * size);
  }
  return left;
}

tetrahedra::TetMesh stuffed_ball() {
  return stuffing::stuff({}, ball_grid(5, 1, {}), {});
}

TEST(TetClip, ABallIsClosedAndKeepsItsVolumeWhereverItIsCut) {
  const tetrahedra::TetMesh mesh = stuffed_ball();
  tetrahedra::require_sound(tetrahedra::examine_tetrahedra(mesh));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int round = 0; round < 60; ++round) {
    const tetrahedra::ClipPlane plane{{4 * unit(random), 4 * unit(random), unit(random)},
                                      {unit(random), unit(random), unit(random) + 0.01}};
    const tetrahedra::TetClip left = expect_closed(mesh, plane);
    const tetrahedra::TetClip right = expect_closed(mesh, {plane.point, -plane.normal});
    EXPECT_NEAR(cut_area(left), cut_area(right), 1e-12 * (1 + cut_area(left)));
    EXPECT_EQ(left.tetrahedra_cut, right.tetrahedra_cut);
    EXPECT_EQ(left.tetrahedra_cut + left.tetrahedra_removed + right.tetrahedra_removed,
              mesh.tetrahedra.size());
  }
  // Across the middle: nearly the circle, and half of the ball. Nodes of the lattice lie there.
  for (const Vec3& normal : {Vec3{1, 0, 0}, Vec3{0, -2, 0}, Vec3{0, 0, 7}, Vec3{3, 3, 0}}) {
    const tetrahedra::TetClip left = expect_closed(mesh, {{}, normal});
    EXPECT_NEAR(cut_area(left), 25 * std::numbers::pi, 1.5);
    EXPECT_NEAR(signed_volume(left.mesh), tetrahedra::volume(mesh) / 2,
                0.005 * tetrahedra::volume(mesh));
    EXPECT_GT(left.tetrahedra_removed, 0U);
  }
}

TEST(TetClip, TheCutOfACubeHasItsArea) {
  for (const std::uint32_t n : {1U, 3U}) {
    const tetrahedra::TetMesh mesh = box_tetrahedra(n, n, n, 1.0 / n);
    const Vec3 middle{0.5, 0.5, 0.5};
    const auto area = [&](const tetrahedra::ClipPlane& plane) {
      return cut_area(expect_closed(mesh, plane));
    };
    EXPECT_NEAR(area({{0, 0, 0.3}, {0, 0, 1}}), 1, 1e-14);
    EXPECT_NEAR(area({{0.71, 9, -9}, {-1e-300, 0, 0}}), 1, 1e-14);
    EXPECT_NEAR(area({middle, {1e300, 1e300, 0}}), std::numbers::sqrt2, 1e-13);
    EXPECT_NEAR(area({middle, {1, 1, 1}}), 0.75 * std::numbers::sqrt3, 1e-13); // a hexagon
    EXPECT_NEAR(area({{0.1, 0, 0}, {1, 1, 1}}), 0.01 * std::numbers::sqrt3 / 2, 1e-14);
    EXPECT_NEAR(area({middle, {0, 1, 2}}), std::sqrt(1.25), 1e-13);
  }
}

// Kuhn's tetrahedra have faces across the axes and the diagonals: what is left is a box again.
TEST(TetClip, FacesInThePlaneAreTheCut) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(3, 2, 4);
  for (std::uint32_t k = 1; k < 4; ++k) {
    const tetrahedra::TetClip left = expect_closed(mesh, {{7, -7, k * 1.0}, {0, 0, 1}});
    EXPECT_EQ(left.tetrahedra_cut, 0U);
    EXPECT_EQ(left.tetrahedra_removed, 36U * (4 - k));
    EXPECT_EQ(left.mesh.triangles.size() - left.cut_begin, 12U);
    const TriangleMesh box = tetrahedra::boundary(box_tetrahedra(3, 2, k)).mesh;
    EXPECT_EQ(left.mesh.points, box.points); // no point but nodes
    EXPECT_EQ(left.mesh.triangles.size(), box.triangles.size());
    EXPECT_EQ(cut_area(left), 6);
    EXPECT_EQ(signed_volume(left.mesh), 6.0 * k);
  }
  // The diagonal planes of cubes hold faces, too; other cubes are cut there.
  const tetrahedra::TetClip left = expect_closed(mesh, {{}, {1, -1, 0}});
  EXPECT_EQ(left.tetrahedra_cut, 0U);
  EXPECT_NEAR(cut_area(left), 8 * std::numbers::sqrt2, 1e-12);
  EXPECT_NEAR(signed_volume(left.mesh), 8, 1e-12);
}

TEST(TetClip, NodesInThePlaneLeaveNoCracks) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(3, 3, 3);
  std::mt19937 random(11);
  const auto node = [&] { return mesh.points[random() % mesh.points.size()]; };
  int cut = 0;
  for (int round = 0; round < 300; ++round) {
    const Vec3 a = node(), b = node(), c = node();
    const Vec3 normal = cross(b - a, c - a);
    if (normal == Vec3{})
      continue;
    const tetrahedra::TetClip left = expect_closed(mesh, {a, normal});
    cut += left.tetrahedra_cut > 0 ? 1 : 0;
  }
  EXPECT_GT(cut, 100);
}

// Every way in which the corners of one may lie.
TEST(TetClip, OneTetrahedronInAnyPosition) {
  for (int way = 0; way < 81; ++way) {
    tetrahedra::TetMesh mesh;
    mesh.tetrahedra = {{0, 1, 2, 3}};
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    // The plane z = 0 after a shear: heights as they are wanted.
    std::array<int, 4> height{way % 3 - 1, way / 3 % 3 - 1, way / 9 % 3 - 1, way / 27 - 1};
    const Vec3 normal{height[1] - height[0] * 1.0, height[2] - height[0] * 1.0,
                      height[3] - height[0] * 1.0};
    if (normal == Vec3{})
      continue; // all in one plane
    // normal · p + height[0] = height of p.
    const Vec3 point = normal * (-height[0] / dot(normal, normal));
    const tetrahedra::TetClip left = expect_closed(mesh, {point, normal});
    const auto on = [&](int side) { return std::ranges::count(height, side); };
    EXPECT_EQ(left.tetrahedra_removed, on(-1) == 0 ? 1U : 0U);
    EXPECT_EQ(left.tetrahedra_cut, on(-1) > 0 && on(1) > 0 ? 1U : 0U);
    const std::size_t triangles = left.mesh.triangles.size() - left.cut_begin;
    EXPECT_EQ(triangles, on(-1) == 0 || on(1) == 0 ? 0U : on(-1) == 2 && on(1) == 2 ? 2U : 1U);
  }
}

// Where coordinates are rounded, faces that lie in a plane still do.
TEST(TetClip, ATurnedBoxIsCutAlongItsFaces) {
  tetrahedra::TetMesh mesh = box_tetrahedra(4, 3, 5, 0.1);
  const Vec3 x = Vec3{2, -1, 2} / 3, y = Vec3{2, 2, -1} / 3, z = Vec3{-1, 2, 2} / 3;
  for (Vec3& p : mesh.points)
    p = x * p.x + y * p.y + z * p.z + Vec3{31.7, -12.3, 5.9};
  for (std::uint32_t k = 1; k < 5; ++k) {
    const std::size_t node = std::size_t{k} * 5 * 4 + 7;
    const tetrahedra::TetClip left = expect_closed(mesh, {mesh.points[node], z});
    EXPECT_EQ(left.tetrahedra_cut, 0U) << k;
    EXPECT_EQ(left.mesh.triangles.size() - left.cut_begin, 24U) << k;
    EXPECT_NEAR(cut_area(left), 0.12, 1e-12);
  }
}

TEST(TetClip, TheCutHasTheMaterialOfItsTetrahedra) {
  tetrahedra::TetMesh mesh = box_tetrahedra(4, 4, 4, 0.25);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    Vec3 middle;
    for (const std::uint32_t corner : t)
      middle += mesh.points[corner] / 4;
    mesh.material.push_back(middle.x < 0.25 ? 0 : middle.y < 0.5 ? 7 : 3);
  }
  for (const tetrahedra::ClipPlane& plane : {tetrahedra::ClipPlane{{0, 0, 0.4}, {0, 0, 1}},
                                             tetrahedra::ClipPlane{{0, 0, 0.5}, {0, 0, -2}}}) {
    const tetrahedra::TetClip left = expect_closed(mesh, plane);
    const std::vector<double> all = areas(left);
    std::array<double, 8> by_material{};
    for (std::size_t f = 0; f < all.size(); ++f) {
      ASSERT_EQ(left.mesh.material[f], mesh.material[left.tetrahedron[f]]);
      if (f >= left.cut_begin)
        by_material.at(static_cast<std::size_t>(left.mesh.material[f])) += all[f];
      // The triangle lies in its tetrahedron.
      const Tetrahedron& t = mesh.tetrahedra[left.tetrahedron[f]];
      const auto& [a, b, c] = left.mesh.triangles[f];
      const Vec3 middle = (left.mesh.points[a] + left.mesh.points[b] + left.mesh.points[c]) / 3;
      for (std::size_t k = 0; k < 4; ++k) {
        std::array<Vec3, 4> moved{mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]],
                                  mesh.points[t[3]]};
        moved.at(k) = middle;
        EXPECT_GE(tetrahedra::tetrahedron_volume(moved[0], moved[1], moved[2], moved[3]), -1e-16);
      }
    }
    EXPECT_NEAR(by_material[0], 0.25, 1e-14);
    EXPECT_NEAR(by_material[7], 0.375, 1e-14);
    EXPECT_NEAR(by_material[3], 0.375, 1e-14);
  }
  mesh.material.clear();
  EXPECT_TRUE(tetrahedra::clip_tetrahedra(mesh, {{0, 0, 0.4}, {0, 0, 1}}).mesh.material.empty());
}

TEST(TetClip, APlaneThatMissesLeavesAllOrNothing) {
  tetrahedra::TetMesh mesh = stuffed_ball();
  mesh.material.assign(mesh.tetrahedra.size(), 0);
  mesh.material[5] = 2;
  const tetrahedra::TetBoundary whole = tetrahedra::boundary(mesh);
  const double top = tetrahedra::bounding_box(mesh).max.z;
  for (const double z : {top + 1, top}) { // beside it, and touching it
    const tetrahedra::TetClip left = tetrahedra::clip_tetrahedra(mesh, {{0, 0, z}, {0, 0, 1}});
    EXPECT_EQ(left.mesh.points, whole.mesh.points);
    EXPECT_EQ(left.mesh.triangles, whole.mesh.triangles);
    EXPECT_EQ(left.mesh.material, whole.mesh.material);
    EXPECT_EQ(left.tetrahedron, whole.tetrahedron);
    EXPECT_EQ(left.cut_begin, whole.tetrahedron.size());
    EXPECT_EQ(left.tetrahedra_cut + left.tetrahedra_removed, 0U);
    const tetrahedra::TetClip none = tetrahedra::clip_tetrahedra(mesh, {{0, 0, z}, {0, 0, -1}});
    EXPECT_TRUE(none.mesh.points.empty() && none.mesh.triangles.empty());
    EXPECT_EQ(none.tetrahedra_removed, mesh.tetrahedra.size());
  }
  // A face of the boundary in the plane: nothing or all goes.
  const tetrahedra::TetMesh box = box_tetrahedra(2, 2, 2);
  EXPECT_EQ(expect_closed(box, {{0, 0, 2}, {0, 0, 1}}).mesh.triangles,
            tetrahedra::boundary(box).mesh.triangles);
  EXPECT_TRUE(expect_closed(box, {{0, 0, 2}, {0, 0, -1}}).mesh.triangles.empty());
  EXPECT_TRUE(tetrahedra::clip_tetrahedra({}, {{}, {0, 0, 1}}).mesh.triangles.empty());
}

// A body beside the plane goes or stays as it is, though nothing of it is cut.
TEST(TetClip, BodiesGoOneByOne) {
  tetrahedra::TetMesh mesh = box_tetrahedra(2, 1, 1);
  const tetrahedra::TetMesh other = mesh;
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (const Vec3& p : other.points)
    mesh.points.push_back(p + Vec3{5, 0, 0});
  for (const auto& [a, b, c, d] : other.tetrahedra)
    mesh.tetrahedra.push_back({a + first, b + first, c + first, d + first});
  const tetrahedra::TetClip left = expect_closed(mesh, {{4, 0, 0}, {1, 0, 0}});
  EXPECT_EQ(left.mesh.triangles, tetrahedra::boundary(other).mesh.triangles);
  EXPECT_EQ(left.tetrahedra_removed, other.tetrahedra.size());
  EXPECT_EQ(left.tetrahedra_cut, 0U);
}

// A cut point belongs to its edge alone, whichever tetrahedra come first.
TEST(TetClip, PointsDoNotDependOnTheOrderOfTetrahedra) {
  tetrahedra::TetMesh mesh = stuffed_ball();
  const tetrahedra::ClipPlane plane{{0.3, -0.2, 0.1}, {1, 0.7, -0.4}};
  const tetrahedra::TetClip one = tetrahedra::clip_tetrahedra(mesh, plane);
  std::shuffle(mesh.tetrahedra.begin(), mesh.tetrahedra.end(), std::mt19937(5));
  for (Tetrahedron& t : mesh.tetrahedra)
    t = {t[2], t[0], t[1], t[3]};
  const tetrahedra::TetClip other = tetrahedra::clip_tetrahedra(mesh, plane);
  EXPECT_TRUE(test::same_bytes(one.mesh.points, other.mesh.points));
  EXPECT_EQ(one.cut_begin, other.cut_begin);
  EXPECT_NEAR(cut_area(one), cut_area(other), 1e-12);
}

TEST(TetClip, PointsTellBetweenWhichNodesTheyStand) {
  const tetrahedra::TetMesh mesh = test::distorted_box();
  const tetrahedra::TetClip left = tetrahedra::clip_tetrahedra(mesh, {{1, 1, 1}, {1, 2, -0.5}});
  ASSERT_EQ(left.origin.size(), left.mesh.points.size());
  std::size_t crossings = 0;
  for (std::size_t k = 0; k < left.origin.size(); ++k) {
    const auto& [a, b, share] = left.origin[k];
    const Vec3 place = mesh.points[a] + (mesh.points[b] - mesh.points[a]) * share;
    EXPECT_EQ(place, left.mesh.points[k]);
    EXPECT_GE(share, 0);
    EXPECT_LE(share, 0.5); // from the nearer one
    crossings += a != b ? 1 : 0;
  }
  EXPECT_GT(crossings, 20U);
}

TEST(TetClip, QuadraticTetrahedraBecomeEightOfTheirNodes) {
  tetrahedra::TetMesh mesh = test::distorted_box();
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    mesh.material.push_back(t % 3 == 0);
  EXPECT_EQ(tetrahedra::linear_parts(mesh).tetrahedra, mesh.tetrahedra); // linear already
  tetrahedra::make_quadratic(mesh);
  const tetrahedra::TetMesh parts = tetrahedra::linear_parts(mesh);
  tetrahedra::check_mesh(parts);
  EXPECT_EQ(parts.points, mesh.points);
  EXPECT_TRUE(parts.middles.empty());
  ASSERT_EQ(parts.tetrahedra.size(), 8 * mesh.tetrahedra.size());
  const auto volume_of = [](const tetrahedra::TetMesh& of, std::size_t t) {
    const auto& [a, b, c, d] = of.tetrahedra[t];
    return tetrahedra::tetrahedron_volume(of.points[a], of.points[b], of.points[c], of.points[d]);
  };
  for (std::size_t t = 0; t < parts.tetrahedra.size(); ++t) {
    EXPECT_NEAR(volume_of(parts, t) / volume_of(mesh, t / 8), 0.125, 1e-12);
    EXPECT_EQ(parts.material[t], mesh.material[t / 8]);
  }
  const tetrahedra::TetReport report = tetrahedra::examine_tetrahedra(parts);
  EXPECT_TRUE(report.sound()); // they meet face to face
  EXPECT_TRUE(report.manifold_boundary());
  EXPECT_EQ(report.boundary_triangles, 4 * tetrahedra::examine_tetrahedra(mesh).boundary_triangles);
}

TEST(TetClip, PlanesWithoutDirectionAreRefused) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(1, 1, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = HUGE_VAL;
  for (const tetrahedra::ClipPlane& plane :
       {tetrahedra::ClipPlane{{0, 0, 0}, {0, 0, 0}}, tetrahedra::ClipPlane{{0, 0, 0}, {0, nan, 1}},
        tetrahedra::ClipPlane{{nan, 0, 0}, {0, 0, 1}},
        tetrahedra::ClipPlane{{0, 0, 0}, {inf, 0, 0}},
        tetrahedra::ClipPlane{{0, inf, 0}, {0, 0, 1}}})
    EXPECT_THROW((void)tetrahedra::clip_tetrahedra(mesh, plane), Error);
  tetrahedra::TetMesh large = mesh;
  for (Vec3& p : large.points)
    p = (p - Vec3{0.5, 0.5, 0.5}) * 1.7e308;
  EXPECT_THROW((void)tetrahedra::clip_tetrahedra(large, {{1e308, 1e308, 1e308}, {-1, -1, -1}}),
               Error);
}

} // namespace
} // namespace gewebe::test
