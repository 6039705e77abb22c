#include "solid/solid_place.h"

#include "solid/assembly_internal.h"

#include <algorithm>
#include <cmath>

namespace gewebe {

namespace {

using Barycentric = std::array<double, 4>;

/// The point of a triangle nearest to p, by its corners' weights (Ericson, Real-time collision
/// detection, 2005, 5.1.5).
std::array<double, 3> nearest_of_triangle(const Vec3& p, const Vec3& a, const Vec3& b,
                                          const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = dot(ab, p - a), d2 = dot(ac, p - a), d3 = dot(ab, p - b), d4 = dot(ac, p - b),
               d5 = dot(ab, p - c), d6 = dot(ac, p - c);
  if (d1 <= 0 && d2 <= 0)
    return {1, 0, 0};
  if (d3 >= 0 && d4 <= d3)
    return {0, 1, 0};
  if (d6 >= 0 && d5 <= d6)
    return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0)
    return {d3 / (d3 - d1), d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0)
    return {d6 / (d6 - d2), 0, d2 / (d2 - d6)};
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double s = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - s, s};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

struct Nearest {
  double distance = HUGE_VAL;
  std::size_t element = 0;
  Barycentric at{};
  std::array<Vec3, 4> gradient{}; ///< of the barycentric coordinates
};

Nearest nearest_of(const TetMesh& mesh, std::size_t t, const Vec3& place) {
  const Tetrahedron& tet = mesh.tetrahedra[t];
  std::array<Vec3, 4> corner;
  for (std::size_t k = 0; k < 4; ++k)
    corner[k] = mesh.points[tet[k]];
  const double six = 6 * tetrahedron_volume(corner[0], corner[1], corner[2], corner[3]);
  Nearest found;
  found.element = t;
  bool inside = true;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& face = tetrahedron_faces[k];
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
    const auto& face = tetrahedron_faces[k];
    const auto w = nearest_of_triangle(place, corner[face[0]], corner[face[1]], corner[face[2]]);
    const Vec3 there = w[0] * corner[face[0]] + w[1] * corner[face[1]] + w[2] * corner[face[2]];
    const double distance = norm(place - there);
    if (distance < found.distance) {
      found.distance = distance;
      found.at = {};
      for (std::size_t c = 0; c < 3; ++c)
        found.at[face[c]] = w[c];
    }
  }
  return found;
}

} // namespace

SolidPlace find_place(const TetMesh& mesh, const Vec3& place) {
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
  result.count = solid_nodes(mesh);
  result.outside = nearest.distance;
  Barycentric slope{}; // of each coordinate along `off`
  for (std::size_t k = 0; k < 4; ++k)
    slope[k] = dot(nearest.gradient[k], off);
  for (std::size_t a = 0; a < result.count; ++a) {
    result.node[a] = solid_node(mesh, nearest.element, a);
    const Barycentric& l = nearest.at;
    if (result.count == 4) {
      result.weight[a] = l[a] + slope[a];
    } else if (a < 4) {
      result.weight[a] = l[a] * (2 * l[a] - 1) + (4 * l[a] - 1) * slope[a];
    } else {
      const auto [i, j] = tetrahedron_edges[a - 4];
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

} // namespace gewebe
