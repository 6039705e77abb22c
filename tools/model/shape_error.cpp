#include "tools/model/shape_error.h"

#include "fem/stress_error.h"
#include "mesh/nearest_point.h"
#include "tetrahedra/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace gewebe::cli {

namespace {

constexpr double contact_share = 1.2;        // see the header
constexpr double steepest = 0.5;             // cosine of the largest angle between both surfaces
constexpr double near = 1;                   // edges of a triangle: what is farther is a wound
constexpr std::uint32_t inside = UINT32_MAX; // a node that is not on the surface

std::vector<Box3> boxes_of(const TriangleMesh& mesh) {
  std::vector<Box3> boxes(mesh.triangles.size());
  for (std::size_t k = 0; k < boxes.size(); ++k)
    for (const std::uint32_t corner : mesh.triangles[k])
      boxes[k].add(mesh.points[corner]);
  return boxes;
}

/// How far out the surface lies along a normal, where `way` leads to its nearest point.
double distance_along(const Vec3& way, const Vec3& normal) {
  const double distance = norm(way);
  if (!(distance > 0))
    return 0;
  const double cosine = dot(way, normal) / distance;
  return std::copysign(distance / std::fmax(std::abs(cosine), steepest), cosine);
}

} // namespace

ShapeError::ShapeError(const TriangleMesh& surface) : surface_(surface), tree_(boxes_of(surface)) {}

Vec3 ShapeError::way_from(const Vec3& p) const {
  const auto to_box = [&](const Box3& box) {
    double squared = 0;
    for (int a = 0; a < 3; ++a) {
      const double away = std::max({box.min[a] - p[a], p[a] - box.max[a], 0.0});
      squared += away * away;
    }
    return squared * (1 - 1e-12); // rounding of the distance
  };
  const auto way_to = [&](std::size_t k) {
    const Triangle& t = surface_.triangles[k];
    return mesh::nearest_on_triangle(p, surface_.points[t[0]], surface_.points[t[1]],
                                     surface_.points[t[2]])
               .point -
           p;
  };
  const auto to_triangle = [&](std::uint32_t k) {
    const Vec3 way = way_to(k);
    return dot(way, way);
  };
  const std::size_t item = tree_.nearest(to_box, to_triangle, HUGE_VAL).first;
  return item < tree_.size() ? way_to(item) : Vec3{};
}

std::vector<double> ShapeError::energies(const ElementErrors& solid,
                                         std::span<const contact::NodeVector> touched) const {
  const tetrahedra::TetMesh& mesh = *solid.mesh;
  std::vector<double> energy(mesh.tetrahedra.size());
  const tetrahedra::TetBoundary faces = boundary(mesh);
  // A tetrahedron of each surface node.
  std::vector<std::uint32_t> owner(mesh.points.size(), inside);
  for (std::size_t k = 0; k < faces.mesh.triangles.size(); ++k) {
    const Triangle& triangle = faces.mesh.triangles[k];
    const std::uint32_t t = faces.tetrahedron[k];
    std::array<Vec3, 3> p;
    std::array<double, 4> middle{}; // barycentric
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = faces.mesh.points[triangle[i]];
      const std::uint32_t node = faces.node[triangle[i]];
      owner[node] = t;
      for (std::size_t a = 0; a < 4; ++a)
        if (mesh.tetrahedra[t][a] == node)
          middle[a] = 1.0 / 3;
    }
    if (!faces.middles.empty())
      for (const std::uint32_t node : faces.middles[k])
        owner[node] = t;
    const Vec3 normal = cross(p[1] - p[0], p[2] - p[0]); // twice the area
    const double size = norm(normal);
    if (!(size > 0))
      continue;
    const Vec3 centre = (p[0] + p[1] + p[2]) / 3;
    const Vec3 way = way_from(centre);
    if (!(norm(way) <= near * norm(p[1] - p[0]) + near * norm(p[2] - p[0])))
      continue;
    energy[t] +=
        size / 2 * distance_along(way, normal / size) *
        energy_density(solid.elements[t].material, fem::tensor_at(solid.stresses[t], middle));
  }
  for (const contact::NodeVector& f : touched) // forces point into the body
    if (owner[f.node] != inside) // else it is a displaced node, which no instrument touches
      energy[owner[f.node]] -= contact_share * dot(f.value, way_from(mesh.points[f.node]));
  return energy;
}

} // namespace gewebe::cli
