// What examine_mesh finds in passes over fans and faces, against edges, corners and angles one by
// one.

#include "mesh/check.h"

#include "base/disjoint_sets.h"
#include "mesh/edges.h"
#include "mesh/quality.h"
#include "mesh/repeated_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

/// By sets over all corners: those of a point that edges join are one fan.
mesh::MeshReport counted(const TriangleMesh& mesh) {
  mesh::MeshReport report;
  DisjointSets corners(3 * mesh.triangles.size()), connected(mesh.points.size());
  mesh::EdgeSides(mesh.points.size(), mesh.triangles)
      .for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
        ++report.edges;
        report.boundary_edges += edge.size() == 1 ? 1 : 0;
        report.nonmanifold_edges += edge.size() > 2 ? 1 : 0;
        report.misoriented_edges += edge.size() == 2 && mesh::surplus(edge) != 0 ? 1 : 0;
        for (const mesh::EdgeSide& other : edge.subspan(1)) {
          corners.join(edge[0].low_corner(), other.low_corner());
          corners.join(edge[0].high_corner(), other.high_corner());
        }
      });
  std::vector<std::set<std::uint32_t>> fans(mesh.points.size());
  const std::vector<bool> repeated =
      mesh::repeated_faces(mesh.points.size(), mesh.triangles, mesh::SameFace::corners);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    if (mesh::has_equal_corners(t)) {
      ++report.degenerate_faces;
      continue;
    }
    report.duplicate_faces += repeated[f] ? 1 : 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      fans[t[k]].insert(corners.find(3 * f + k));
      connected.join(t[0], t[k]);
    }
  }
  for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
    report.unused_points += fans[p].empty() ? 1 : 0;
    report.nonmanifold_points += fans[p].size() > 1 ? 1 : 0;
    report.components += !fans[p].empty() && connected.find(p) == p ? 1 : 0;
  }
  return report;
}

void expect_counted(const TriangleMesh& mesh, const Context& context = {}) {
  const mesh::MeshReport found = mesh::examine_mesh(mesh, context), expected = counted(mesh);
  EXPECT_EQ(found.edges, expected.edges);
  EXPECT_EQ(found.boundary_edges, expected.boundary_edges);
  EXPECT_EQ(found.nonmanifold_edges, expected.nonmanifold_edges);
  EXPECT_EQ(found.misoriented_edges, expected.misoriented_edges);
  EXPECT_EQ(found.nonmanifold_points, expected.nonmanifold_points);
  EXPECT_EQ(found.degenerate_faces, expected.degenerate_faces);
  EXPECT_EQ(found.duplicate_faces, expected.duplicate_faces);
  EXPECT_EQ(found.unused_points, expected.unused_points);
  EXPECT_EQ(found.components, expected.components);
}

/// A torus of n × n points, each in six faces.
TriangleMesh torus(std::uint32_t n) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = 0; j < n; ++j) {
      const double u = 6.283185307179586 * i / n, v = 6.283185307179586 * j / n;
      mesh.points.push_back(
          {(3 + std::cos(v)) * std::cos(u), (3 + std::cos(v)) * std::sin(u), std::sin(v)});
      const auto at = [n](std::uint32_t a, std::uint32_t b) { return a % n * n + b % n; };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

std::uint32_t below(std::mt19937& random, std::size_t end) {
  return static_cast<std::uint32_t>(random() % end);
}

TEST(MeshExamined, SoupsOfTriangles) {
  std::mt19937 random(11);
  for (int round = 0; round < 300; ++round) {
    TriangleMesh mesh;
    const std::uint32_t points = 3 + below(random, 12);
    for (std::uint32_t p = 0; p < points; ++p)
      mesh.points.push_back({1.0 * p, 1.0 * below(random, 5), 1.0 * below(random, 5)});
    mesh.triangles.resize(1 + below(random, 60));
    for (Triangle& t : mesh.triangles)
      for (std::uint32_t& corner : t)
        corner = below(random, points);
    expect_counted(mesh);
    ASSERT_FALSE(HasFailure()) << round;
  }
}

TEST(MeshExamined, SurfacesWithFaults) {
  std::mt19937 random(12);
  for (int round = 0; round < 100; ++round) {
    TriangleMesh mesh = torus(12);
    for (int fault = 0; fault < 6; ++fault) {
      const std::uint32_t f = below(random, mesh.triangles.size());
      Triangle& t = mesh.triangles[f];
      switch (below(random, 5)) {
      case 0:
        std::swap(t[0], t[1]);
        break;
      case 1:
        mesh.triangles.erase(mesh.triangles.begin() + f);
        break;
      case 2:
        mesh.triangles.push_back({t[1], t[2], t[0]});
        break;
      case 3: // two points become one: pinched, or an edge without length
        t[below(random, 3)] = below(random, mesh.points.size());
        break;
      default: { // all faces at a point turned
        const std::uint32_t p = t[0];
        for (Triangle& other : mesh.triangles)
          if (std::ranges::find(other, p) != other.end())
            std::swap(other[0], other[1]);
      }
      }
    }
    expect_counted(mesh);
    ASSERT_FALSE(HasFailure()) << round;
  }
}

TEST(MeshExamined, TwoRingsAtAPoint) {
  TriangleMesh mesh; // two tetrahedra that share a corner
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3},
                    {0, 4, 5}, {0, 5, 6}, {0, 6, 4}, {4, 6, 5}};
  EXPECT_EQ(mesh::examine_mesh(mesh).nonmanifold_points, 1U);
  EXPECT_TRUE(mesh::examine_mesh(mesh).closed());
  expect_counted(mesh);
}

TEST(MeshExamined, PointsUnderManyFaces) {
  for (const std::uint32_t count : {3U, 7U, 8U, 9U, 31U, 32U, 33U, 5000U}) {
    TriangleMesh mesh; // a double cone, closed
    mesh.points = {{0, 0, 1}, {0, 0, -1}};
    for (std::uint32_t n = 0; n < count; ++n) {
      const double angle = 6.283185307179586 * n / count;
      mesh.points.push_back({std::cos(angle), std::sin(angle), 0});
      const std::uint32_t a = 2 + n, b = 2 + (n + 1) % count;
      mesh.triangles.push_back({0, a, b});
      mesh.triangles.push_back({1, b, a});
    }
    const mesh::MeshReport report = mesh::examine_mesh(mesh);
    EXPECT_TRUE(report.closed() && report.manifold() && report.outward()) << count;
    EXPECT_EQ(report.euler, 2) << count;
    expect_counted(mesh);
    mesh.triangles.pop_back();
    expect_counted(mesh);
  }
}

Context on_threads(int count) {
  Context context;
  context.threads = count;
  return context;
}

/// Of one that several ranges of points are cut of, its points numbered along it or at random.
TEST(MeshExamined, LargeOnesOnAnyNumberOfThreads) {
  for (const bool shuffled : {false, true}) {
    TriangleMesh mesh = torus(300);
    if (shuffled) {
      std::vector<std::uint32_t> place(mesh.points.size());
      std::iota(place.begin(), place.end(), 0U);
      std::ranges::shuffle(place, std::mt19937(3));
      TriangleMesh other = mesh;
      for (std::size_t p = 0; p < place.size(); ++p)
        other.points[place[p]] = mesh.points[p];
      for (Triangle& t : other.triangles)
        for (std::uint32_t& corner : t)
          corner = place[corner];
      mesh = std::move(other);
    }
    mesh.triangles.pop_back();
    expect_counted(mesh, on_threads(2));
    mesh::MeshQuality one, two;
    const mesh::MeshReport a = mesh::examine_mesh(mesh, on_threads(1), &one),
                           b = mesh::examine_mesh(mesh, on_threads(2), &two);
    EXPECT_EQ(a.volume, b.volume);
    EXPECT_EQ(a.area, b.area);
    EXPECT_EQ(a.edge_mean, b.edge_mean);
    EXPECT_EQ(one.edge_lengths.counts, two.edge_lengths.counts);
    EXPECT_EQ(one.explicit_step, two.explicit_step);
    EXPECT_NEAR(a.area, surface_area(mesh), 1e-9 * a.area);
    EXPECT_NEAR(a.volume, signed_volume(mesh), 1e-3 * a.volume); // a face is missing
  }
}

double degrees_between(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * 57.295779513082320877;
}

/// A torus of several blocks of points and faces, whose points are shifted by up to `most`.
void expect_shapes(double most) {
  std::mt19937 random(13);
  TriangleMesh mesh = torus(200);
  std::uniform_real_distribution<double> shift(-most, most);
  for (Vec3& p : mesh.points)
    p += Vec3{shift(random), shift(random), shift(random)};
  mesh::MeshQuality quality;
  const mesh::MeshReport report = mesh::examine_mesh(mesh, {}, &quality);
  std::vector<double> angles;
  std::vector<std::uint64_t> counts(12);
  std::vector<double> stiffness(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    angles.push_back(std::min({degrees_between(b - a, c - a), degrees_between(c - b, a - b),
                               degrees_between(a - c, b - c)}));
    ++counts[static_cast<std::size_t>(angles.back() / 5)];
    for (std::size_t k = 0; k < 3; ++k) // each edge is of two faces, once in each direction
      stiffness[t[k]] += 1 / norm(mesh.points[t[(k + 1) % 3]] - mesh.points[t[k]]);
  }
  std::ranges::sort(angles);
  EXPECT_EQ(quality.smallest_angles.counts, counts);
  EXPECT_NEAR(quality.angle_1_percent, angles[angles.size() / 100], 1e-9);
  EXPECT_NEAR(quality.angle_5_percent, angles[angles.size() / 20], 1e-9);
  EXPECT_NEAR(quality.angle_median, angles[angles.size() / 2], 1e-9);
  EXPECT_NEAR(report.smallest_angle, angles[0], 1e-9);
  EXPECT_NEAR(quality.share_below_10,
              static_cast<double>(counts[0] + counts[1]) / static_cast<double>(angles.size()),
              1e-12);
  EXPECT_NEAR(quality.explicit_step, 2 / std::sqrt(2 * *std::ranges::max_element(stiffness)),
              1e-12);
}

TEST(MeshExamined, ShapesEqualThoseOfEachFace) {
  expect_shapes(1e-4);
  expect_shapes(0.02);
}

} // namespace
} // namespace gewebe::test
