#include "embedding/solid_place.h"

#include "fem/assembly_blocks.h"
#include "mesh/nearest_point.h"

#include <algorithm>
#include <cmath>

namespace gewebe::embedding {

namespace {

using Barycentric = std::array<double, 4>;

struct Nearest {
  double distance = HUGE_VAL;
  std::size_t element = 0;
  Barycentric at{};
  std::array<Vec3, 4> gradient{}; ///< of the barycentric coordinates
};

Nearest nearest_of(const tetrahedra::TetMesh& mesh, std::size_t t, const Vec3& place) {
  const Tetrahedron& tet = mesh.tetrahedra[t];
  std::array<Vec3, 4> corner;
  for (std::size_t k = 0; k < 4; ++k)
    corner[k] = mesh.points[tet[k]];
  const double six = 6 * tetrahedra::tetrahedron_volume(corner[0], corner[1], corner[2], corner[3]);
  Nearest found;
  found.element = t;
  bool inside = true;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& face = tetrahedra::tetrahedron_faces[k];
    const Vec3 &a = corner[face[0]], &b = corner[face[1]], &c = corner[face[2]];
    found.gradient[k] = cross(c - a, b - a) / six; // inwards
    found.at[k] = dot(found.gradient[k], place - a);
    inside = inside && found.at[k] >= 0;
  }
  if (inside) {
    found.distance = 0;
    return found;
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& face = tetrahedra::tetrahedron_faces[k];
    const Vec3 there =
        mesh::nearest_on_triangle(place, corner[face[0]], corner[face[1]], corner[face[2]]).point;
    const double distance = norm(place - there);
    if (distance < found.distance) {
      found.distance = distance;
      for (std::size_t c = 0; c < 4; ++c)
        found.at[c] =
            c == k ? 0
                   : dot(found.gradient[c], there - corner[tetrahedra::tetrahedron_faces[c][0]]);
    }
  }
  return found;
}

} // namespace

SolidPlace find_place(const tetrahedra::TetMesh& mesh, const Vec3& place) {
  Nearest nearest;
  for (std::size_t t = 0; t < mesh.tetrahedra.size() && nearest.distance > 0; ++t) {
    // The circle around it is far cheaper than its faces.
    const Tetrahedron& tet = mesh.tetrahedra[t];
    const Vec3& a = mesh.points[tet[0]];
    double reach = 0;
    for (std::size_t k = 1; k < 4; ++k)
      reach = std::max(reach, norm(mesh.points[tet[k]] - a));
    if (norm(place - a) - reach > nearest.distance)
      continue;
    const Nearest here = nearest_of(mesh, t, place);
    if (here.distance < nearest.distance)
      nearest = here;
  }
  const Tetrahedron& tet = mesh.tetrahedra[nearest.element];
  Vec3 foot;
  for (std::size_t k = 0; k < 4; ++k)
    foot = foot + nearest.at[k] * mesh.points[tet[k]];
  const Vec3 off = place - foot;
  SolidPlace result;
  result.count = fem::solid_nodes(mesh);
  result.outside = nearest.distance;
  Barycentric slope{}; // of each coordinate along `off`
  for (std::size_t k = 0; k < 4; ++k)
    slope[k] = dot(nearest.gradient[k], off);
  for (std::size_t a = 0; a < result.count; ++a) {
    result.node[a] = fem::solid_node(mesh, nearest.element, a);
    const Barycentric& l = nearest.at;
    if (result.count == 4) {
      result.weight[a] = l[a] + slope[a];
    } else if (a < 4) {
      result.weight[a] = l[a] * (2 * l[a] - 1) + (4 * l[a] - 1) * slope[a];
    } else {
      const auto [i, j] = tetrahedra::tetrahedron_edges[a - 4];
      result.weight[a] = 4 * l[i] * l[j] + 4 * (l[i] * slope[j] + l[j] * slope[i]);
    }
  }
  return result;
}

Vec3 displacement_at(const SolidPlace& place, std::span<const double> u) {
  Vec3 sum;
  for (std::size_t k = 0; k < place.count; ++k)
    for (int i = 0; i < 3; ++i)
      sum[i] += place.weight[k] * u[3 * std::size_t{place.node[k]} + static_cast<std::size_t>(i)];
  return sum;
}

} // namespace gewebe::embedding
