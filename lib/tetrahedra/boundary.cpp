#include "tetrahedra/boundary.h"

#include "tetrahedra/faces.h"

#include <cstddef>
#include <span>
#include <utility>

namespace gewebe::tetrahedra {
namespace {

/// The edge of a tetrahedron between its corners a and b, in the order of EdgeMiddles.
std::size_t edge_between(std::uint8_t a, std::uint8_t b) {
  constexpr std::array<std::array<std::uint8_t, 4>, 4> number{
      {{0, 0, 2, 3}, {0, 0, 1, 4}, {2, 1, 0, 5}, {3, 4, 5, 0}}};
  return number[a][b];
}

/// The numbers 4 t + k of the faces of one tetrahedron, ascending.
std::vector<std::uint32_t> boundary_faces(const TetMesh& mesh) {
  std::vector<bool> outer(4 * mesh.tetrahedra.size());
  std::size_t count = 0;
  TetFaces(mesh.points.size(), mesh.tetrahedra)
      .for_each_face([&](std::uint32_t, std::span<const TetFace> face) {
        if (face.size() == 1) {
          outer[face[0].number] = true;
          ++count;
        }
      });
  std::vector<std::uint32_t> numbers;
  numbers.reserve(count);
  for (std::size_t n = 0; n < outer.size(); ++n)
    if (outer[n])
      numbers.push_back(static_cast<std::uint32_t>(n));
  return numbers;
}

} // namespace

TetBoundary boundary(const TetMesh& mesh) {
  const std::vector<std::uint32_t> faces = boundary_faces(mesh);
  TetBoundary result;
  result.mesh.triangles.reserve(faces.size());
  result.tetrahedron.reserve(faces.size());
  constexpr std::uint32_t unused = UINT32_MAX;
  std::vector<std::uint32_t> point(mesh.points.size(), unused);
  for (const std::uint32_t number : faces) {
    const Tetrahedron& t = mesh.tetrahedra[number / 4];
    std::array<std::uint8_t, 3> face = tetrahedron_faces[number % 4];
    if (tetrahedron_volume(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]],
                           mesh.points[t[3]]) < 0)
      std::swap(face[1], face[2]);
    result.mesh.triangles.push_back({t[face[0]], t[face[1]], t[face[2]]});
    result.tetrahedron.push_back(number / 4);
    if (!mesh.material.empty())
      result.mesh.material.push_back(mesh.material[number / 4]);
    if (!mesh.middles.empty()) {
      const EdgeMiddles& m = mesh.middles[number / 4];
      result.middles.push_back({m[edge_between(face[0], face[1])],
                                m[edge_between(face[1], face[2])],
                                m[edge_between(face[2], face[0])]});
    }
    for (const std::uint8_t corner : face)
      point[t[corner]] = 0;
  }
  for (std::size_t p = 0; p < point.size(); ++p)
    if (point[p] != unused) {
      point[p] = static_cast<std::uint32_t>(result.node.size());
      result.node.push_back(static_cast<std::uint32_t>(p));
      result.mesh.points.push_back(mesh.points[p]);
    }
  for (Triangle& triangle : result.mesh.triangles)
    for (std::uint32_t& corner : triangle)
      corner = point[corner];
  return result;
}

} // namespace gewebe::tetrahedra
