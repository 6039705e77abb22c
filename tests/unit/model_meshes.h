#pragma once
// Small meshes for the tests of the model.

#include "geometry/mesh.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

namespace gewebe::test {

inline TriangleMesh octahedron() {
  TriangleMesh m;
  m.points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                 {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  return m;
}

/// An octahedron whose faces are split `rounds` times, on a sphere.
inline TriangleMesh ball(int rounds, double radius = 1, Vec3 center = {}) {
  TriangleMesh m = octahedron();
  for (int r = 0; r < rounds; ++r) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
    const auto split = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, added] = middle.try_emplace({std::min(a, b), std::max(a, b)},
                                                  static_cast<std::uint32_t>(m.points.size()));
      if (added) {
        const Vec3 p = m.points[a] + m.points[b];
        m.points.push_back(p / norm(p));
      }
      return at->second;
    };
    std::vector<Triangle> fine;
    for (const Triangle& t : m.triangles) {
      const std::uint32_t a = split(t[1], t[2]), b = split(t[2], t[0]), c = split(t[0], t[1]);
      fine.insert(fine.end(), {{t[0], c, b}, {c, t[1], a}, {b, a, t[2]}, {a, b, c}});
    }
    m.triangles = fine;
  }
  for (Vec3& p : m.points)
    p = center + p * radius;
  return m;
}

/// A flat sheet of nx × ny squares of the given width, each cut in two.
inline TriangleMesh sheet(std::uint32_t nx, std::uint32_t ny, double width = 1) {
  TriangleMesh m;
  for (std::uint32_t y = 0; y <= ny; ++y)
    for (std::uint32_t x = 0; x <= nx; ++x)
      m.points.push_back({x * width, y * width, 0});
  for (std::uint32_t y = 0; y < ny; ++y)
    for (std::uint32_t x = 0; x < nx; ++x) {
      const std::uint32_t a = y * (nx + 1) + x, b = a + 1, c = a + nx + 1, d = c + 1;
      m.triangles.push_back({a, b, d});
      m.triangles.push_back({a, d, c});
    }
  return m;
}

/// Both meshes in one; the second becomes part 1.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto shift = static_cast<std::uint32_t>(a.points.size());
  a.part.assign(a.triangles.size(), 0);
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (Triangle t : b.triangles) {
    for (std::uint32_t& corner : t)
      corner += shift;
    a.triangles.push_back(t);
    a.part.push_back(1);
  }
  return a;
}

inline double area(const TriangleMesh& m) {
  double sum = 0;
  for (const Triangle& t : m.triangles)
    sum += norm(cross(m.points[t[1]] - m.points[t[0]], m.points[t[2]] - m.points[t[0]])) / 2;
  return sum;
}

} // namespace gewebe::test
