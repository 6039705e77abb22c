#pragma once
// Meshes and helpers that the tests of voxelization share.

#include "geometry/mesh.h"
#include "volume/grid.h"
#include "voxelization/voxelize.h"

#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace gewebe::test {

/// Box with corners low and high, 12 triangles, outward.
inline TriangleMesh box_mesh(const Vec3& low, const Vec3& high) {
  TriangleMesh mesh;
  for (int c = 0; c < 8; ++c)
    mesh.points.push_back({(c & 1) != 0 ? high.x : low.x, (c & 2) != 0 ? high.y : low.y,
                           (c & 4) != 0 ? high.z : low.z});
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// Unit icosahedron whose faces are split `levels` times, points on the sphere.
inline TriangleMesh sphere_mesh(int levels, double radius, const Vec3& center) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  mesh.points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.points.size()));
      if (fresh)
        mesh.points.push_back((mesh.points[a] + mesh.points[b]) * 0.5);
      return it->second;
    };
    std::vector<Triangle> split;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      split.insert(split.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = split;
  }
  for (Vec3& p : mesh.points)
    p = center + p * (radius / norm(p));
  return mesh;
}

inline void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto base = static_cast<std::uint32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles)
    mesh.triangles.push_back({a + base, b + base, c + base});
}

/// Turns the mesh about the axis (1, 2, 3) by the angle.
inline void rotate(TriangleMesh& mesh, double angle) {
  const Vec3 n = Vec3{1, 2, 3} / std::sqrt(14.0);
  const double c = std::cos(angle), s = std::sin(angle);
  for (Vec3& p : mesh.points)
    p = p * c + cross(n, p) * s + n * (dot(n, p) * (1 - c));
}

/// All voxels inside, read from bits and tiles.
inline std::set<Int3> inside_voxels(const voxelization::InsideScan& scan) {
  std::set<Int3> inside;
  for (std::size_t n = 0; n < scan.origins.size(); ++n)
    for (std::int32_t v = 0; v < volume::leaf_voxels; ++v)
      if ((scan.bits[n][static_cast<std::size_t>(v / 64)] >> (v % 64) & 1) != 0)
        inside.insert({scan.origins[n][0] + v / 64, scan.origins[n][1] + v / 8 % 8,
                       scan.origins[n][2] + v % 8});
  for (const volume::TileView& t : scan.tiles)
    for (std::int32_t i = 0; i < t.dim; ++i)
      for (std::int32_t j = 0; j < t.dim; ++j)
        for (std::int32_t k = 0; k < t.dim; ++k)
          inside.insert({t.origin[0] + i, t.origin[1] + j, t.origin[2] + k});
  return inside;
}

inline std::string shared_folder() {
  const char* folder = std::getenv("GEWEBE_SHARED");
  return folder != nullptr ? folder : "../shared";
}

/// A Wavefront OBJ of plain `v` and `f` lines, or a binary STL with equal corners welded; empty if
/// there is no such file. For tests only: no checks.
TriangleMesh load_test_mesh(const std::string& name);

} // namespace gewebe::test
