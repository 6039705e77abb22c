// Skins of solids that a sheet cuts: closed, as large as before, with a rim where the sheet passes.

#include "base/error.h"
#include "cutting/cut_skin.h"
#include "mesh/check.h"
#include "model_meshes.h"
#include "tests/unit/larger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

constexpr double cell = 0.2, reach = 0.6;

model::Skin skin_of(const TriangleMesh& mesh) {
  model::Skin skin;
  skin.points = mesh.points;
  skin.triangles = mesh.triangles;
  skin.tetrahedron.assign(mesh.points.size(), 0);
  skin.material.assign(mesh.triangles.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    std::array<double, 6>& coordinates = skin.texcoords.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = mesh.points[t[k]];
      coordinates[2 * k] = p.x - 2 * p.z;
      coordinates[2 * k + 1] = p.y + p.z;
    }
  }
  return skin;
}

/// Of radius 1 about 0.
model::Skin ball_skin() {
  return skin_of(test::ball(4, 1, {0, 0, 0}));
}

TriangleMesh mesh_of(const model::Skin& skin) {
  TriangleMesh mesh;
  mesh.points = skin.points;
  mesh.triangles = skin.triangles;
  return mesh;
}

mesh::MeshReport expect_sound(const model::Skin& before, const model::Skin& after) {
  const TriangleMesh was = mesh_of(before), is = mesh_of(after);
  const double volume = signed_volume(was);
  EXPECT_NEAR(signed_volume(is), volume, 1e-12 * volume);
  const mesh::MeshReport report = mesh::examine_mesh(is);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
  EXPECT_TRUE(report.manifold());
  EXPECT_EQ(after.material.size(), after.triangles.size());
  EXPECT_EQ(after.texcoords.size(), after.triangles.size());
  EXPECT_EQ(after.tetrahedron.size(), after.points.size());
  return report;
}

TriangleMesh walls_of(const cutting::SkinCut& cut) {
  TriangleMesh walls = mesh_of(cut.skin);
  walls.triangles.clear();
  for (std::size_t t = 0; t < cut.triangle.size(); ++t)
    if (cut.triangle[t] == cutting::SkinCut::none)
      walls.triangles.push_back(cut.skin.triangles[t]);
  return walls;
}

double area_of_walls(const cutting::SkinCut& cut) {
  return surface_area(walls_of(cut));
}

cutting::SkinCut checked(const model::Skin& skin, const cutting::SkinSheet& sheet) {
  cutting::SkinCut cut = cutting::cut_skin(skin, sheet, cell, reach);
  (void)expect_sound(skin, cut.skin);
  EXPECT_NEAR(surface_area(mesh_of(cut.skin)) - area_of_walls(cut), surface_area(mesh_of(skin)),
              1e-6);
  return cut;
}

/// Rows across y, from z = above on downwards at this x.
std::vector<std::vector<Vec3>> rows_down(double x, double high, double low, int count,
                                         double half = 1.5, double slope = 0) {
  std::vector<std::vector<Vec3>> rows;
  for (int n = 0; n <= count; ++n) {
    std::vector<Vec3>& row = rows.emplace_back();
    for (int k = 0; k <= 10; ++k)
      row.push_back({x + slope * n, half * (k - 5) / 5, high + (low - high) * n / count});
  }
  return rows;
}

TEST(CutSkin, APlanePartsItInTwoClosedPieces) {
  for (const Vec3& normal : {Vec3{1, 0, 0}, Vec3{0.3, -1, 0.7}, Vec3{0, 0, 1}})
    for (const double off : {0.0, 0.3}) { // 0: through points and edges
      const model::Skin skin = ball_skin();
      const cutting::SkinCut cut =
          checked(skin, cutting::plane_sheet(skin, {off * normal / norm(normal), normal}, cell));
      EXPECT_EQ(mesh::examine_mesh(mesh_of(cut.skin)).components, 2U);
      EXPECT_NEAR(area_of_walls(cut), 2 * std::numbers::pi * (1 - off * off), 0.03);
      std::size_t above = 0, below = 0;
      for (std::size_t p = 0; p < cut.skin.points.size(); ++p) {
        const double height = dot(cut.skin.points[p], normal) / norm(normal) - off;
        if (cut.side[p] != 0) {
          EXPECT_GT(height * cut.side[p], -1e-12);
        }
        above += cut.side[p] > 0 ? 1 : 0;
        below += cut.side[p] < 0 ? 1 : 0;
        if (p >= skin.points.size()) {
          EXPECT_LT(std::abs(height), 1e-12);
        }
      }
      EXPECT_GT(above, 50U);
      EXPECT_GT(below, 50U);
      // Walls look into the wound.
      const TriangleMesh walls = walls_of(cut);
      for (std::size_t t = 0; t < walls.triangles.size(); ++t) {
        const auto& [a, b, c] = walls.triangles[t];
        const std::vector<Vec3>& at = cut.skin.points;
        const double up = dot(cross(at[b] - at[a], at[c] - at[a]), normal);
        EXPECT_GT(2 * t < walls.triangles.size() ? -up : up, -1e-12);
      }
    }
}

TEST(CutSkin, TextureCoordinatesStayWhereTheyAre) {
  const model::Skin skin = ball_skin();
  const cutting::SkinCut cut =
      checked(skin, cutting::plane_sheet(skin, {{0.11, 0, 0}, {1, 0.2, 0.4}}, cell));
  for (std::size_t t = 0; t < cut.skin.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = cut.skin.points[cut.skin.triangles[t][k]];
      if (cut.triangle[t] == cutting::SkinCut::none)
        continue;
      EXPECT_NEAR(cut.skin.texcoords[t][2 * k], p.x - 2 * p.z, 1e-9);
      EXPECT_NEAR(cut.skin.texcoords[t][2 * k + 1], p.y + p.z, 1e-9);
    }
}

TEST(CutSkin, AWoundThatEndsInsideLeavesItOnePiece) {
  for (const double half : {1.5, 0.4}) {
    const model::Skin skin = ball_skin();
    const cutting::SkinCut cut =
        checked(skin, cutting::strip_sheet(rows_down(0.123, 1.5, 0.1, 7, half, 0.01)));
    const mesh::MeshReport report = mesh::examine_mesh(mesh_of(cut.skin));
    EXPECT_EQ(report.components, 1U);
    EXPECT_GT(walls_of(cut).triangles.size(), 50U);
    std::size_t fronts = 0;
    for (std::size_t p = skin.points.size(); p < cut.skin.points.size(); ++p)
      fronts += cut.side[p] == 0 ? 1 : 0;
    EXPECT_GT(fronts, 3U);
  }
}

TEST(CutSkin, GoesOnWhereItEnded) {
  const model::Skin skin = ball_skin();
  const std::vector<std::vector<Vec3>> rows = rows_down(0.123, 1.5, -1.5, 24, 1.5, 0.013);
  const model::Skin at_once = checked(skin, cutting::strip_sheet(rows)).skin;
  for (const std::size_t each : {1U, 3U, 8U}) {
    model::Skin now = skin;
    std::vector<Vec3> start = rows[0];
    for (std::size_t n = 0; n + each < rows.size(); n += each) {
      std::vector<std::vector<Vec3>> step{start};
      for (std::size_t k = 1; k <= each; ++k)
        step.push_back(rows[n + k]);
      cutting::SkinCut cut = checked(now, cutting::strip_sheet(step));
      now = std::move(cut.skin);
      start = std::move(cut.end);
    }
    const mesh::MeshReport report = mesh::examine_mesh(mesh_of(now));
    EXPECT_EQ(report.components, 2U) << each;
    EXPECT_NEAR(surface_area(mesh_of(now)), surface_area(mesh_of(at_once)), 1e-9);
  }
}

TEST(CutSkin, ABladeThatSawsGoesOnToo) {
  model::Skin now = ball_skin();
  std::vector<Vec3> start = rows_down(0.1, 1.5, 1.5, 1)[0];
  double z = 1.5;
  for (int n = 0; n < 30; ++n) {
    const double to = z + (n % 3 == 2 ? 0.15 : -0.2);
    std::vector<std::vector<Vec3>> rows{start, rows_down(0.1, to, to, 1)[0]};
    cutting::SkinCut cut = checked(now, cutting::strip_sheet(rows));
    now = std::move(cut.skin);
    start = std::move(cut.end);
    z = to;
  }
  EXPECT_EQ(mesh::examine_mesh(mesh_of(now)).components, 2U);
}

TEST(CutSkin, CutsOfCutsAreClosedToo) {
  const model::Skin skin = ball_skin();
  model::Skin now = skin;
  std::size_t pieces = 1;
  const std::vector<cutting::CutPlane> planes{
      {{0.1, 0, 0}, {1, 0, 0}}, {{0, 0.05, 0}, {0.2, 1, 0}}, {{0, 0, 0.12}, {0.1, 0.1, 1}}};
  for (const cutting::CutPlane& plane : planes) {
    cutting::SkinCut cut =
        cutting::cut_skin(now, cutting::plane_sheet(now, plane, cell), cell, reach);
    const TriangleMesh is = mesh_of(cut.skin);
    const mesh::MeshReport report = mesh::examine_mesh(is);
    EXPECT_TRUE(report.closed() && report.oriented() && report.manifold());
    pieces *= 2;
    EXPECT_EQ(report.components, pieces);
    EXPECT_NEAR(signed_volume(is), signed_volume(mesh_of(skin)), 1e-6);
    now = std::move(cut.skin);
  }
}

TEST(CutSkin, ASurfaceInsideIsCutByItself) {
  TriangleMesh both = test::ball(4, 1, {0, 0, 0});
  const auto first = static_cast<std::uint32_t>(both.points.size());
  const TriangleMesh inner = test::ball(3, 0.4, {0.1, 0.2, 0});
  both.points.insert(both.points.end(), inner.points.begin(), inner.points.end());
  for (const Triangle& t : inner.triangles)
    both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  model::Skin skin = skin_of(both);
  std::fill(skin.material.end() - static_cast<std::ptrdiff_t>(inner.triangles.size()),
            skin.material.end(), 3);
  const cutting::SkinCut whole =
      checked(skin, cutting::plane_sheet(skin, {{0.15, 0, 0}, {1, 0.1, 0}}, cell));
  EXPECT_EQ(mesh::examine_mesh(mesh_of(whole.skin)).components, 4U);
  // Of the walls: what is in the inner one, of both shells, and what is round it; 0 of the skin.
  EXPECT_EQ(std::set<std::uint32_t>(whole.region.begin(), whole.region.end()).size(), 4U);
  // All that lies in the inner one has its material, of either shell.
  for (std::size_t t = 0; t < whole.triangle.size(); ++t) {
    if (whole.triangle[t] != cutting::SkinCut::none)
      continue;
    Vec3 middle;
    for (const std::uint32_t p : whole.skin.triangles[t])
      middle += whole.skin.points[p] / 3;
    EXPECT_EQ(whole.material[whole.region[t]], norm(middle - Vec3{0.1, 0.2, 0}) < 0.4 ? 3 : -1);
  }
  model::Skin now = skin;
  std::vector<Vec3> start = rows_down(0.123, 1.5, 1.5, 1)[0];
  for (const double z : {0.7, 0.3, 0.0, -0.3, -1.5}) {
    const std::vector<std::vector<Vec3>> rows{start, rows_down(0.123, z, z, 1)[0]};
    cutting::SkinCut cut = checked(now, cutting::strip_sheet(rows));
    now = std::move(cut.skin);
    start = std::move(cut.end);
  }
  EXPECT_EQ(mesh::examine_mesh(mesh_of(now)).components, 4U);
}

TEST(CutSkin, ASheetBesideItChangesNothing) {
  const model::Skin skin = ball_skin();
  const cutting::SkinCut cut = cutting::cut_skin(
      skin, cutting::plane_sheet(skin, {{3, 0, 0}, {1, 0, 0}}, cell), cell, reach);
  EXPECT_EQ(cut.skin, skin);
  EXPECT_TRUE(walls_of(cut).triangles.empty());
}

TEST(CutSkin, WhatIsOpenIsRefused) {
  model::Skin skin = ball_skin();
  skin.triangles.erase(skin.triangles.begin() + 5, skin.triangles.begin() + 900);
  skin.material.resize(skin.triangles.size());
  skin.texcoords.resize(skin.triangles.size());
  EXPECT_THROW(cutting::cut_skin(skin, cutting::plane_sheet(skin, {{0, 0, 0.01}, {0, 0, 1}}, cell),
                                 cell, reach),
               Error);
}

} // namespace
} // namespace gewebe::test
