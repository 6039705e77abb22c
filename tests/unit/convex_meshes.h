#pragma once
// Convex meshes for tests of instruments that are one.

#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {

/// The convex hull of a few points in general position: each triangle that has all others behind.
inline TriangleMesh convex_hull_of(std::span<const Vec3> points) {
  TriangleMesh mesh;
  std::map<std::uint32_t, std::uint32_t> number;
  const auto count = static_cast<std::uint32_t>(points.size());
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t j = i + 1; j < count; ++j)
      for (std::uint32_t k = j + 1; k < count; ++k) {
        const Vec3 n = cross(points[j] - points[i], points[k] - points[i]);
        std::size_t above = 0, below = 0;
        for (std::uint32_t l = 0; l < count; ++l)
          if (l != i && l != j && l != k)
            ++(dot(n, points[l] - points[i]) > 0 ? above : below);
        if (above > 0 && below > 0)
          continue;
        Triangle t{i, j, k};
        if (above > 0)
          t = {i, k, j};
        for (std::uint32_t& corner : t) {
          const auto [at, added] =
              number.emplace(corner, static_cast<std::uint32_t>(mesh.points.size()));
          if (added)
            mesh.points.push_back(points[corner]);
          corner = at->second;
        }
        mesh.triangles.push_back(t);
      }
  return mesh;
}

/// A box from the origin on, each of whose sides is divided into parts x parts squares.
inline TriangleMesh divided_box(const Vec3& size, std::uint32_t parts) {
  TriangleMesh mesh;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> number;
  const auto point = [&](const std::array<std::uint32_t, 3>& at) {
    const auto [there, added] = number.emplace(at, static_cast<std::uint32_t>(mesh.points.size()));
    if (added)
      mesh.points.push_back(
          {size.x * at[0] / parts, size.y * at[1] / parts, size.z * at[2] / parts});
    return there->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const bool far : {false, true})
      for (std::uint32_t i = 0; i < parts; ++i)
        for (std::uint32_t j = 0; j < parts; ++j) {
          const auto at = [&](std::uint32_t u, std::uint32_t v) {
            std::array<std::uint32_t, 3> p{};
            p[axis] = far ? parts : 0;
            p[(axis + 1) % 3] = u;
            p[(axis + 2) % 3] = v;
            return point(p);
          };
          const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1),
                              d = at(i, j + 1);
          mesh.triangles.push_back(far ? Triangle{a, b, c} : Triangle{a, c, b});
          mesh.triangles.push_back(far ? Triangle{a, c, d} : Triangle{a, d, c});
        }
  return mesh;
}

} // namespace gewebe::test
