#include "mesh/quality.h"

#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/surface_scenes.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <numeric>

namespace gewebe::test {
namespace {

/// The true largest frequency of unit masses with springs 1/L on the edges.
double omega_max(const TriangleMesh& mesh) {
  const auto n = static_cast<Eigen::Index>(3 * mesh.points.size());
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(n, n);
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      edges.insert(std::minmax(t[c], t[(c + 1) % 3]));
  for (const auto& [a, b] : edges) {
    const Vec3 d = mesh.points[b] - mesh.points[a];
    const double length = norm(d);
    const Eigen::Vector3d u(d.x / length, d.y / length, d.z / length);
    const Eigen::Matrix3d spring = u * u.transpose() / length;
    k.block<3, 3>(3 * a, 3 * a) += spring;
    k.block<3, 3>(3 * b, 3 * b) += spring;
    k.block<3, 3>(3 * a, 3 * b) -= spring;
    k.block<3, 3>(3 * b, 3 * a) -= spring;
  }
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k, Eigen::EigenvaluesOnly)
                       .eigenvalues()
                       .maxCoeff());
}

TEST(MeshQuality, ExplicitStepIsABound) {
  for (const double epsilon : {0.0, 0.15, 0.5}) {
    const TriangleMesh mesh =
        surface::snap({}, surface::marching_cubes({}, scenes::metaballs(12, 2)), {epsilon}).mesh;
    ASSERT_LT(mesh.points.size(), 400U);
    const double limit = 2 / omega_max(mesh), step = mesh::mesh_quality(mesh).explicit_step;
    EXPECT_LE(step, limit * (1 + 1e-12)) << epsilon;
    EXPECT_GT(step, limit / 1.7) << epsilon;
  }
}

TEST(MeshQuality, OfABox) {
  const mesh::MeshQuality quality = mesh::mesh_quality(test::box_mesh({0, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(quality.smallest_angles.counts[9], 12U); // 45 degrees
  EXPECT_EQ(quality.share_below_10, 0);
  EXPECT_NEAR(quality.angle_1_percent, 45, 1e-12);
  EXPECT_NEAR(quality.edge_ratio, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(quality.areas.top, 0.5, 1e-12);
  EXPECT_EQ(quality.areas.counts.back(), 12U);
  EXPECT_EQ(quality.edge_lengths.counts[14], 12U); // 1 of sqrt 2
  EXPECT_EQ(quality.edge_lengths.counts.back(), 6U);
}

TEST(MeshQuality, SeesSlivers) {
  TriangleMesh mesh;
  mesh.points = {{0, 0, 0}, {10, 0, 0}, {5, 0.1, 0}, {5, 8, 0}, {20, 0, 0}, {10, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 1, 2}, {1, 5, 3}};
  const mesh::MeshQuality quality = mesh::mesh_quality(mesh);
  EXPECT_EQ(quality.smallest_angles.counts[0], 3U); // 1.1 degrees, and two without area
  EXPECT_NEAR(quality.share_below_10, 3.0 / 4, 1e-12);
  EXPECT_EQ(quality.angle_1_percent, 0);
  EXPECT_EQ(quality.explicit_step, 0);
  EXPECT_EQ(quality.edge_ratio, HUGE_VAL);
}

TEST(MeshQuality, HistogramsCountEverything) {
  const TriangleMesh mesh = surface::marching_cubes({}, scenes::metaballs(24, 4)).mesh;
  const mesh::MeshQuality quality = mesh::mesh_quality(mesh);
  const auto total = [](const mesh::Histogram& h) {
    return std::accumulate(h.counts.begin(), h.counts.end(), std::uint64_t{0});
  };
  EXPECT_EQ(total(quality.smallest_angles), mesh.triangles.size());
  EXPECT_EQ(total(quality.areas), mesh.triangles.size());
  EXPECT_EQ(total(quality.edge_lengths), mesh.triangles.size() * 3 / 2);
  EXPECT_EQ(total(mesh::mesh_quality({}).areas), 0U);
}

} // namespace
} // namespace gewebe::test
