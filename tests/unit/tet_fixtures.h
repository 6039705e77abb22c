#pragma once
// Tetrahedral meshes that tests share.

#include "tetrahedra/order.h"
#include "tetrahedra/tet_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

namespace gewebe::test {

/// A box of nx × ny × nz cubes of side `cell`, each cut into six tetrahedra about its diagonal (of
/// Kuhn): volume cell³ / 6 each, dihedral angles 45, 60, 90 degrees.
inline tetrahedra::TetMesh box_tetrahedra(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz,
                                          double cell = 1) {
  tetrahedra::TetMesh mesh;
  for (std::uint32_t k = 0; k <= nz; ++k)
    for (std::uint32_t j = 0; j <= ny; ++j)
      for (std::uint32_t i = 0; i <= nx; ++i)
        mesh.points.push_back({i * cell, j * cell, k * cell});
  const std::array<std::uint32_t, 3> step{1, nx + 1, (nx + 1) * (ny + 1)};
  for (std::uint32_t k = 0; k < nz; ++k)
    for (std::uint32_t j = 0; j < ny; ++j)
      for (std::uint32_t i = 0; i < nx; ++i) {
        const std::uint32_t corner = i + step[1] * j + step[2] * k;
        std::array<std::uint32_t, 3> axes{0, 1, 2};
        bool even = true; // next_permutation: xyz xzy yxz yzx zxy zyx
        do {
          const std::uint32_t a = corner + step[axes[0]], b = a + step[axes[1]],
                              c = b + step[axes[2]];
          even = (axes[0] + 1) % 3 == axes[1];
          mesh.tetrahedra.push_back(even ? Tetrahedron{corner, a, b, c}
                                         : Tetrahedron{corner, b, a, c});
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
  return mesh;
}

/// A box 2 × 2 × 2 whose inner nodes stand anywhere.
inline tetrahedra::TetMesh distorted_box() {
  tetrahedra::TetMesh mesh = box_tetrahedra(3, 3, 3, 2.0 / 3);
  for (Vec3& p : mesh.points)
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(p[axis] - 2) < 1e-9)
        p[axis] = 2;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shift(-0.12, 0.12);
  for (Vec3& p : mesh.points)
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] > 0.1 && p[axis] < 1.9)
        p[axis] += shift(random);
  return mesh;
}

/// The same with coordinates that fill a double, some odd materials if asked for, and quadratic.
inline tetrahedra::TetMesh odd_tetrahedra(bool quadratic, bool material) {
  tetrahedra::TetMesh mesh = box_tetrahedra(2, 1, 3);
  for (Vec3& p : mesh.points)
    p = {p.x / 3 + 1e-17, p.y * 1.1 - p.x * 0.1, -p.z * 0.7 + p.x * 1e-9 + 100};
  for (Tetrahedron& t : mesh.tetrahedra) // z was mirrored
    std::swap(t[2], t[3]);
  if (quadratic)
    tetrahedra::make_quadratic(mesh);
  if (material)
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      mesh.material.push_back(t % 5 == 0 ? 1000000 : static_cast<std::int32_t>(t % 3));
  return mesh;
}

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

inline bool same_bytes(const tetrahedra::TetMesh& a, const tetrahedra::TetMesh& b) {
  return same_bytes(a.points, b.points) && same_bytes(a.tetrahedra, b.tetrahedra) &&
         same_bytes(a.middles, b.middles) && same_bytes(a.material, b.material);
}

} // namespace gewebe::test
