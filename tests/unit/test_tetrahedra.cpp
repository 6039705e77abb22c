// Boundary, findings, quality and order of tetrahedra against analytic cases and slow plain code.

#include "base/error.h"
#include "larger.h"
#include "mesh/check.h"
#include "tests/unit/complaint.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/faces.h"
#include "tetrahedra/order.h"
#include "tetrahedra/quality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::box_tetrahedra;
using test::same_bytes;

tetrahedra::TetMesh one(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  tetrahedra::TetMesh mesh;
  mesh.points = {a, b, c, d};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  return mesh;
}

tetrahedra::TetMesh regular() {
  return one({1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1});
}

std::uint32_t draw(std::mt19937& random, std::uint32_t below) {
  return static_cast<std::uint32_t>(random() % below);
}

/// Corners below `points`, some of them equal, some tetrahedra twice.
tetrahedra::TetMesh random_mesh(std::mt19937& random, std::size_t count, std::uint32_t points) {
  tetrahedra::TetMesh mesh;
  for (std::uint32_t p = 0; p < points; ++p)
    mesh.points.push_back({static_cast<double>(random() % 5), static_cast<double>(random() % 5),
                           static_cast<double>(random() % 5)});
  for (std::size_t t = 0; t < count; ++t) {
    Tetrahedron corners{};
    for (std::uint32_t& corner : corners)
      corner = draw(random, points);
    if (t > 0 && random() % 8 == 0) {
      corners = mesh.tetrahedra[random() % t];
      std::shuffle(corners.begin(), corners.end(), random);
    }
    mesh.tetrahedra.push_back(corners);
  }
  return mesh;
}

std::string complaint(const tetrahedra::TetMesh& mesh) {
  return test::complaint([&] { tetrahedra::require_sound(tetrahedra::examine_tetrahedra(mesh)); });
}

double volume_of(const tetrahedra::TetMesh& mesh, std::size_t t) {
  const Tetrahedron& c = mesh.tetrahedra[t];
  return tetrahedra::tetrahedron_volume(mesh.points[c[0]], mesh.points[c[1]], mesh.points[c[2]],
                                        mesh.points[c[3]]);
}

// ---- Boundary

TEST(TetBoundary, OfABoxIsItsSurface) {
  const tetrahedra::TetMesh mesh = box_tetrahedra(3, 4, 5, 0.5);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    ASSERT_EQ(volume_of(mesh, t), 0.125 / 6) << t;
  const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
  const mesh::MeshReport report = mesh::examine_mesh(surface.mesh);
  EXPECT_EQ(report.triangles, 2U * 2 * (12 + 15 + 20));
  EXPECT_TRUE(report.closed() && report.manifold() && report.outward());
  EXPECT_EQ(report.euler, 2);
  EXPECT_EQ(report.unused_points, 0U);
  EXPECT_NEAR(report.volume, 60 * 0.125, 1e-12);
  ASSERT_EQ(surface.node.size(), 4U * 5 * 6 - 2 * 3 * 4);
  EXPECT_TRUE(std::is_sorted(surface.node.begin(), surface.node.end()));
  for (std::size_t p = 0; p < surface.node.size(); ++p)
    EXPECT_EQ(surface.mesh.points[p], mesh.points[surface.node[p]]);
  EXPECT_TRUE(std::is_sorted(surface.tetrahedron.begin(), surface.tetrahedron.end()));
  EXPECT_TRUE(surface.middles.empty() && surface.mesh.material.empty());
}

TEST(TetBoundary, RandomOnesAsAMapCountsThem) {
  std::mt19937 random(1);
  for (int round = 0; round < 60; ++round) {
    const tetrahedra::TetMesh mesh = random_mesh(random, 1 + random() % 120, 4 + draw(random, 40));
    std::map<std::set<std::uint32_t>, int> count;
    for (const Tetrahedron& t : mesh.tetrahedra)
      for (std::uint32_t k = 0; k < 4 && !tetrahedra::has_equal_corners(t); ++k) {
        const Triangle face = tetrahedra::corners_of_face(t, k);
        ++count[{face.begin(), face.end()}];
      }
    const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
    std::vector<std::set<std::uint32_t>> expected, found;
    for (const auto& [face, n] : count)
      if (n == 1)
        expected.push_back(face);
    for (std::size_t f = 0; f < surface.mesh.triangles.size(); ++f) {
      const Triangle& t = surface.mesh.triangles[f];
      found.push_back({surface.node[t[0]], surface.node[t[1]], surface.node[t[2]]});
      // Outward: the tetrahedron's own centre is behind.
      const Tetrahedron& inside = mesh.tetrahedra[surface.tetrahedron[f]];
      const Vec3 &a = surface.mesh.points[t[0]], &b = surface.mesh.points[t[1]],
                 &c = surface.mesh.points[t[2]];
      double sum = 0;
      for (const std::uint32_t corner : inside)
        sum += dot(cross(b - a, c - a), mesh.points[corner] - a);
      EXPECT_LE(sum, 0);
    }
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
  }
}

TEST(TetBoundary, CarriesMaterialAndMiddles) {
  tetrahedra::TetMesh mesh = box_tetrahedra(2, 2, 2);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    mesh.material.push_back(static_cast<std::int32_t>(t));
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); t += 3) // inverted ones too
    std::swap(mesh.tetrahedra[t][0], mesh.tetrahedra[t][1]);
  tetrahedra::make_quadratic(mesh);
  const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
  EXPECT_EQ(signed_volume(surface.mesh), 8);
  ASSERT_EQ(surface.middles.size(), surface.mesh.triangles.size());
  for (std::size_t f = 0; f < surface.middles.size(); ++f) {
    EXPECT_EQ(surface.mesh.material[f], static_cast<std::int32_t>(surface.tetrahedron[f]));
    const Triangle& t = surface.mesh.triangles[f];
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(mesh.points[surface.middles[f][k]],
                (surface.mesh.points[t[k]] + surface.mesh.points[t[(k + 1) % 3]]) * 0.5);
  }
}

// ---- Quality

TEST(TetQuality, OfKnownShapes) {
  const tetrahedra::TetQuality even = tetrahedra::tet_quality(regular());
  EXPECT_NEAR(even.smallest_angle, 70.528779365509308, 1e-12);
  EXPECT_NEAR(even.largest_angle, 70.528779365509308, 1e-12);
  EXPECT_NEAR(even.radius_edge_ratio, std::sqrt(6.0) / 4, 1e-15);
  EXPECT_NEAR(even.volume, 8.0 / 3, 1e-15);
  EXPECT_EQ(even.angles.counts[7], 6U);
  const tetrahedra::TetQuality corner =
      tetrahedra::tet_quality(one({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}));
  EXPECT_NEAR(corner.smallest_angle, 54.735610317245346, 1e-12);
  EXPECT_EQ(corner.largest_angle, 90);
  EXPECT_EQ(corner.angles.counts[5], 3U);
  EXPECT_EQ(corner.angles.counts[9], 3U);
  EXPECT_NEAR(corner.radius_edge_ratio, std::sqrt(3.0) / 2, 1e-15);
  EXPECT_EQ(corner.edge_min, 1);
  EXPECT_EQ(corner.edge_max, std::sqrt(2.0));
}

TEST(TetQuality, AnglesKeepTheirDigitsHoweverFlat) {
  for (const double height : {1e-3, 1e-8, 1e-15, 1e-100}) {
    // A flat pyramid over an equilateral triangle: at the base atan(height / inradius).
    const double s = std::sqrt(3.0) / 2;
    const auto angles =
        tetrahedra::dihedral_angles({1, 0, 0}, {-0.5, s, 0}, {-0.5, -s, 0}, {0, 0, height});
    const double base = std::atan(height / 0.5);
    for (const std::size_t e : {0U, 1U, 2U})
      EXPECT_NEAR(angles[e] / base, 1, 1e-14) << height;
    for (const std::size_t e : {3U, 4U, 5U})
      EXPECT_GT(angles[e], 2.09);
    // A sliver: two edges of length 2 that cross at a distance of `height`.
    const auto sliver =
        tetrahedra::dihedral_angles({-1, 0, 0}, {1, 0, 0}, {0, -1, height}, {0, 1, height});
    const double crossing = M_PI - 2 * std::atan(height);
    EXPECT_NEAR(sliver[0], crossing, 1e-15);
    EXPECT_NEAR(sliver[5], crossing, 1e-15);
    for (const std::size_t e : {1U, 2U, 3U, 4U})
      EXPECT_NEAR(sliver[e] / (2 * std::atan(height) / std::sqrt(2.0)), 1, 1e-14 + height * height)
          << height;
  }
}

TEST(TetQuality, OfABox) {
  tetrahedra::TetMesh mesh = box_tetrahedra(3, 3, 3, 2);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    mesh.material.push_back(t < 6 ? 7 : 2);
  const tetrahedra::TetQuality linear = tetrahedra::tet_quality(mesh);
  EXPECT_NEAR(linear.smallest_angle, 45, 1e-12);
  EXPECT_NEAR(linear.largest_angle, 90, 1e-12);
  EXPECT_NEAR(linear.volume, 216, 1e-11);
  EXPECT_NEAR(linear.smallest_volume, 8.0 / 6, 1e-14);
  EXPECT_EQ(linear.surface_nodes, 64U - 8);
  EXPECT_EQ(linear.inner_nodes, 8U);
  ASSERT_EQ(linear.materials.size(), 2U);
  EXPECT_EQ(linear.materials[0].material, 2);
  EXPECT_EQ(linear.materials[0].tetrahedra, 156U);
  EXPECT_EQ(linear.materials[1].material, 7);
  EXPECT_NEAR(linear.materials[1].volume, 8, 1e-14);
  std::uint64_t angles = 0;
  for (const std::uint64_t count : linear.angles.counts)
    angles += count;
  EXPECT_EQ(angles, 6U * 162);
  tetrahedra::make_quadratic(mesh);
  const tetrahedra::TetQuality quadratic = tetrahedra::tet_quality(mesh);
  // The middles of a box's edges are the nodes of a lattice twice as fine that are no corners.
  EXPECT_EQ(quadratic.surface_nodes, 343U - 125);
  EXPECT_EQ(quadratic.inner_nodes, 125U);
  EXPECT_EQ(tetrahedra::tet_quality(tetrahedra::TetMesh{}).smallest_angle, 0);
}

TEST(TetQuality, FlatAndInvertedOnesSayIt) {
  const tetrahedra::TetQuality flat =
      tetrahedra::tet_quality(one({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}));
  EXPECT_EQ(flat.smallest_angle, 0);
  EXPECT_EQ(flat.largest_angle, 180);
  EXPECT_EQ(flat.radius_edge_ratio, HUGE_VAL);
  tetrahedra::TetMesh mesh = regular();
  std::swap(mesh.tetrahedra[0][1], mesh.tetrahedra[0][2]);
  EXPECT_NEAR(tetrahedra::tet_quality(mesh).smallest_volume, -8.0 / 3, 1e-15);
  EXPECT_NEAR(tetrahedra::tet_quality(mesh).smallest_angle, 70.528779365509308, 1e-12);
}

// ---- Findings

TEST(TetCheck, ASoundMeshHasNone) {
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh mesh = test::odd_tetrahedra(quadratic, true);
    const tetrahedra::TetReport report = tetrahedra::examine_tetrahedra(mesh);
    EXPECT_TRUE(report.sound() && report.manifold_boundary());
    EXPECT_EQ(report.unused_points.count + report.curved_edges.count, 0U);
    EXPECT_EQ(report.boundary_triangles, 2U * 2 * (2 + 3 + 6));
    EXPECT_NEAR(report.volume, tetrahedra::volume(mesh), 1e-12);
    EXPECT_NO_THROW(tetrahedra::require_sound(report));
  }
}

TEST(TetCheck, EachFaultIsFoundAndNamed) {
  const tetrahedra::TetMesh sound = box_tetrahedra(2, 2, 2);
  tetrahedra::TetMesh mesh = sound;
  std::swap(mesh.tetrahedra[5][0], mesh.tetrahedra[5][1]);
  std::swap(mesh.tetrahedra[9][2], mesh.tetrahedra[9][3]);
  EXPECT_EQ(complaint(mesh), "2 inverted tetrahedra (first: tetrahedron 5), expected none");

  mesh = sound;
  mesh.tetrahedra.push_back({0, 1, 2, 2});
  mesh.tetrahedra.push_back({0, 1, 3, 4}); // in a plane
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).flat.count, 2U);
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).flat.first, 48U);

  mesh = sound;
  mesh.tetrahedra.push_back(
      {mesh.tetrahedra[7][2], mesh.tetrahedra[7][0], mesh.tetrahedra[7][1], mesh.tetrahedra[7][3]});
  EXPECT_EQ(complaint(mesh), "1 repeated tetrahedra (first: tetrahedron 48), expected none");

  mesh = sound;
  mesh.points.push_back({9, 9, 9});
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).unused_points.count, 1U);
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).unused_points.first, 27U);
  EXPECT_EQ(complaint(mesh), "");

  // A third tetrahedron at an inner face, with a corner of its own.
  mesh.tetrahedra.push_back(
      {mesh.tetrahedra[7][0], mesh.tetrahedra[7][1], mesh.tetrahedra[7][3], 27});
  const tetrahedra::TetReport crowded = tetrahedra::examine_tetrahedra(mesh);
  EXPECT_EQ(crowded.crowded_faces.count, 1U);
  EXPECT_FALSE(crowded.sound());

  EXPECT_EQ(complaint(tetrahedra::TetMesh{}), "no tetrahedra, expected at least one");
}

TEST(TetCheck, TwoOnOneSideOverlap) {
  tetrahedra::TetMesh mesh = one({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  mesh.points.push_back({0.2, 0.2, 2});
  mesh.tetrahedra.push_back({0, 1, 2, 4});
  EXPECT_EQ(complaint(mesh),
            "1 faces with both tetrahedra on one side (first: at tetrahedron 0), expected none");
  // An inverted one lies where it lies.
  mesh.tetrahedra[1] = {1, 0, 2, 4};
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).overlapping_faces.count, 1U);
  mesh.points[4].z = -2;
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).overlapping_faces.count, 0U);
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).inverted.count, 0U);
}

TEST(TetCheck, WhereTheBoundaryTouchesItself) {
  // Two tetrahedra with one edge in common, and two with one point.
  tetrahedra::TetMesh mesh = one({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  mesh.points.insert(mesh.points.end(), {{1, -1, -1}, {0, -1, -2}, {-2, -1, 0}});
  mesh.tetrahedra.push_back({0, 1, 4, 5});
  tetrahedra::TetReport report = tetrahedra::examine_tetrahedra(mesh);
  EXPECT_EQ(report.nonmanifold_edges.count, 1U);
  EXPECT_EQ(report.nonmanifold_edges.first, 0U);
  EXPECT_EQ(report.boundary_triangles, 8U);
  mesh.tetrahedra.back() = {0, 4, 5, 6};
  report = tetrahedra::examine_tetrahedra(mesh);
  EXPECT_EQ(report.nonmanifold_edges.count, 0U);
  EXPECT_EQ(report.nonmanifold_points.count, 1U);
  EXPECT_EQ(report.nonmanifold_points.first, 0U);
  EXPECT_FALSE(report.manifold_boundary());
}

TEST(TetCheck, MiddlesOfEdges) {
  tetrahedra::TetMesh sound = box_tetrahedra(1, 1, 1);
  tetrahedra::make_quadratic(sound);
  EXPECT_EQ(complaint(sound), "");
  // The diagonal of the cube lies in all six tetrahedra.
  const std::uint32_t middle = sound.middles[0][3];
  tetrahedra::TetMesh mesh = sound;
  mesh.points[middle].x += 1e-6;
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).curved_edges.count, 0U);
  mesh.points[middle].x += 1e-2;
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).curved_edges.count, 1U);
  EXPECT_EQ(complaint(mesh), "");

  mesh = sound;
  mesh.middles[2][3] = static_cast<std::uint32_t>(mesh.points.size());
  mesh.points.push_back(mesh.points[middle]);
  EXPECT_EQ(complaint(mesh),
            "1 edges with several middles (first: at tetrahedron 0), expected none");

  mesh = sound;
  mesh.middles[0][0] = mesh.tetrahedra[0][2];
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).reused_middles.count, 1U);
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).reused_middles.first, mesh.tetrahedra[0][2]);
}

TEST(TetCheck, RandomOnesAsPlainCodeSays) {
  std::mt19937 random(3);
  for (int round = 0; round < 80; ++round) {
    const tetrahedra::TetMesh mesh = random_mesh(random, 1 + random() % 60, 5 + draw(random, 12));
    const tetrahedra::TetReport report = tetrahedra::examine_tetrahedra(mesh);
    std::uint64_t flat = 0, inverted = 0, duplicates = 0, crowded = 0, overlapping = 0;
    std::set<std::set<std::uint32_t>> seen;
    std::map<std::set<std::uint32_t>, std::vector<std::uint32_t>> tips;
    std::set<std::uint32_t> used;
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      const Tetrahedron& corners = mesh.tetrahedra[t];
      const std::set<std::uint32_t> key(corners.begin(), corners.end());
      used.insert(corners.begin(), corners.end());
      flat += volume_of(mesh, t) == 0; // small integers: exact
      inverted += volume_of(mesh, t) < 0;
      if (key.size() < 4)
        continue;
      if (!seen.insert(key).second) {
        ++duplicates;
        continue;
      }
      for (const std::uint32_t tip : key) {
        std::set<std::uint32_t> face = key;
        face.erase(tip);
        tips[face].push_back(tip);
      }
    }
    for (const auto& [face, at] : tips) {
      crowded += at.size() > 2;
      const std::vector<std::uint32_t> f(face.begin(), face.end());
      const auto side = [&](std::uint32_t tip) {
        return tetrahedra::tetrahedron_volume(mesh.points[f[0]], mesh.points[f[1]],
                                              mesh.points[f[2]], mesh.points[tip]);
      };
      overlapping += at.size() == 2 && side(at[0]) * side(at[1]) > 0;
    }
    EXPECT_EQ(report.flat.count, flat);
    EXPECT_EQ(report.inverted.count, inverted);
    EXPECT_EQ(report.duplicates.count, duplicates);
    EXPECT_EQ(report.crowded_faces.count, crowded);
    EXPECT_EQ(report.overlapping_faces.count, overlapping);
    EXPECT_EQ(report.unused_points.count, mesh.points.size() - used.size());
  }
}

// ---- Repair

TEST(TetRepair, TurnsAndDropsWhatWasPlanted) {
  for (const bool quadratic : {false, true}) {
    const tetrahedra::TetMesh sound = test::odd_tetrahedra(quadratic, true);
    tetrahedra::TetMesh mesh = sound;
    std::mt19937 random(5);
    std::uint64_t turned = 0;
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      if (random() % 2 == 0) {
        ++turned;
        std::swap(mesh.tetrahedra[t][0], mesh.tetrahedra[t][1]);
        if (quadratic) {
          std::swap(mesh.middles[t][1], mesh.middles[t][2]);
          std::swap(mesh.middles[t][3], mesh.middles[t][4]);
        }
      }
    ASSERT_GT(turned, 5U);
    mesh.tetrahedra.push_back(mesh.tetrahedra[4]);
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 1, 0}});
    mesh.tetrahedra.push_back({first, first + 1, first + 2, first + 3});
    mesh.material.insert(mesh.material.end(), {1, 1});
    if (quadratic)
      mesh.middles.insert(mesh.middles.end(), {mesh.middles[4], {0, 0, 0, 0, 0, 0}});
    const tetrahedra::TetRepair done = tetrahedra::repair_tetrahedra(mesh);
    EXPECT_EQ(done.turned, turned);
    EXPECT_EQ(done.dropped_flat, 1U);
    EXPECT_EQ(done.dropped_duplicates, 1U);
    EXPECT_EQ(done.dropped_points, 4U);
    EXPECT_TRUE(same_bytes(mesh, sound));
    EXPECT_EQ(complaint(mesh), "");
  }
}

TEST(TetRepair, DoesWhatIsAskedForAlone) {
  tetrahedra::TetMesh mesh = regular();
  mesh.tetrahedra.push_back(mesh.tetrahedra[0]);
  std::swap(mesh.tetrahedra[0][0], mesh.tetrahedra[0][1]);
  mesh.points.insert(mesh.points.end(), {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 1, 0}});
  mesh.tetrahedra.push_back({4, 5, 6, 7});
  const auto left = [&](tetrahedra::TetRepairOptions options) {
    tetrahedra::TetMesh copy = mesh;
    (void)tetrahedra::repair_tetrahedra(copy, options);
    const tetrahedra::TetReport found = tetrahedra::examine_tetrahedra(copy);
    return std::array{found.inverted.count, found.flat.count, found.duplicates.count};
  };
  EXPECT_EQ(left({true, false, false}), (std::array<std::uint64_t, 3>{0, 1, 1}));
  EXPECT_EQ(left({false, true, false}), (std::array<std::uint64_t, 3>{1, 0, 1}));
  EXPECT_EQ(left({false, false, true}), (std::array<std::uint64_t, 3>{1, 1, 0}));
}

TEST(TetRepair, PutsMiddlesWhereTheirEdgesAre) {
  tetrahedra::TetMesh mesh = regular();
  tetrahedra::make_quadratic(mesh);
  std::swap(mesh.points[0], mesh.points[1]);
  std::swap(mesh.points[5], mesh.points[6]);
  std::swap(mesh.points[7], mesh.points[8]);
  ASSERT_LT(tetrahedra::volume(mesh), 0);
  EXPECT_EQ(tetrahedra::repair_tetrahedra(mesh).turned, 1U);
  EXPECT_GT(tetrahedra::volume(mesh), 0);
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).curved_edges.count, 0U);
}

// ---- Order

TEST(TetOrder, GroupsFollowOneAnother) {
  tetrahedra::TetMesh mesh = box_tetrahedra(3, 3, 3);
  mesh.points.insert(mesh.points.begin(), {-1, -1, -1}); // unused
  for (Tetrahedron& t : mesh.tetrahedra)
    for (std::uint32_t& corner : t)
      ++corner;
  tetrahedra::make_quadratic(mesh);
  std::mt19937 random(7);
  std::vector<std::uint32_t> mix(mesh.points.size());
  for (std::uint32_t p = 0; p < mix.size(); ++p)
    mix[p] = p;
  std::shuffle(mix.begin(), mix.end(), random);
  tetrahedra::TetMesh mixed = mesh;
  for (std::size_t p = 0; p < mix.size(); ++p)
    mixed.points[mix[p]] = mesh.points[p];
  for (Tetrahedron& t : mixed.tetrahedra)
    for (std::uint32_t& node : t)
      node = mix[node];
  for (EdgeMiddles& m : mixed.middles)
    for (std::uint32_t& node : m)
      node = mix[node];
  tetrahedra::TetMesh ordered = mixed;
  const tetrahedra::NodeOrder order = tetrahedra::order_nodes(ordered);
  EXPECT_EQ(order.surface_corners, 56U);
  EXPECT_EQ(order.surface_middles, 343U - 125 - 56);
  EXPECT_EQ(order.surface(), 343U - 125);
  EXPECT_EQ(order.inner_corners, 8U);
  EXPECT_EQ(order.inner_middles, 125U - 8);
  EXPECT_EQ(order.unused, 1U);
  const auto on_surface = [](const Vec3& p) {
    return std::min({p.x, p.y, p.z}) == 0 || std::max({p.x, p.y, p.z}) == 3;
  };
  const auto corner = [](const Vec3& p) {
    return p.x == std::floor(p.x) && p.y == std::floor(p.y) && p.z == std::floor(p.z);
  };
  for (std::uint32_t p = 0; p + 1 < ordered.points.size(); ++p) {
    EXPECT_EQ(on_surface(ordered.points[p]), p < order.surface());
    EXPECT_EQ(corner(ordered.points[p]), p < 56 || (p >= order.surface() && p < 218 + 8));
  }
  EXPECT_EQ(ordered.points.back(), Vec3({-1, -1, -1}));
  // The same tetrahedra, and the old order within a group.
  std::array<std::int64_t, 4> last{-1, -1, -1, -1};
  for (std::size_t p = 0; p < mixed.points.size(); ++p) {
    EXPECT_EQ(ordered.points[order.number[p]], mixed.points[p]);
    if (mixed.points[p].x < 0)
      continue;
    const std::size_t group = (on_surface(mixed.points[p]) ? 0U : 2U) + !corner(mixed.points[p]);
    EXPECT_GT(order.number[p], last[group]);
    last[group] = order.number[p];
  }
  for (std::size_t t = 0; t < mixed.tetrahedra.size(); ++t) {
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_EQ(ordered.tetrahedra[t][k], order.number[mixed.tetrahedra[t][k]]);
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_EQ(ordered.middles[t][k], order.number[mixed.middles[t][k]]);
  }
  // Twice is once.
  tetrahedra::TetMesh again = ordered;
  tetrahedra::order_nodes(again);
  EXPECT_TRUE(same_bytes(again, ordered));
}

TEST(TetOrder, QuadraticNodesAreSharedAndNumberedByFirstUse) {
  const tetrahedra::TetMesh linear = box_tetrahedra(2, 3, 2);
  tetrahedra::TetMesh mesh = linear;
  tetrahedra::make_quadratic(mesh);
  EXPECT_NO_THROW(tetrahedra::check_mesh(mesh));
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (std::size_t k = 0; k < 6; ++k) {
      const std::uint32_t a = mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][0]];
      const std::uint32_t b = mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][1]];
      const auto next = static_cast<std::uint32_t>(linear.points.size() + middle.size());
      EXPECT_EQ(mesh.middles[t][k], middle.try_emplace(std::minmax(a, b), next).first->second);
      EXPECT_EQ(mesh.points[mesh.middles[t][k]], (mesh.points[a] + mesh.points[b]) * 0.5);
    }
  EXPECT_EQ(mesh.points.size(), linear.points.size() + middle.size());
  EXPECT_THROW(tetrahedra::make_quadratic(mesh), Error);
  tetrahedra::TetMesh flat = linear;
  flat.tetrahedra[3][1] = flat.tetrahedra[3][0];
  EXPECT_THROW(tetrahedra::make_quadratic(flat), Error);
}

} // namespace
} // namespace gewebe::test
