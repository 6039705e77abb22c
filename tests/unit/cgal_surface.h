#pragma once
// What CGAL says of a mesh. For units compiled with -frounding-math.

#include "geometry/mesh.h"

#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/helpers.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::test {

using CgalKernel = CGAL::Simple_cartesian<double>;
using CgalMesh = CGAL::Surface_mesh<CgalKernel::Point_3>;

struct CgalVerdict {
  bool manifold = false; ///< edges and points, consistently oriented, no face twice
  bool closed = false;
  std::int64_t euler = 0;
  std::uint64_t components = 0;
  bool operator==(const CgalVerdict&) const = default;
};

/// Topology alone; `mesh`, if there, receives what CGAL made of it.
inline CgalVerdict cgal_verdict(const TriangleMesh& mesh, CgalMesh* result = nullptr) {
  std::vector<CgalKernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> faces;
  for (const Vec3& p : mesh.points)
    points.emplace_back(p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles)
    faces.push_back({t[0], t[1], t[2]});
  namespace pmp = CGAL::Polygon_mesh_processing;
  CgalVerdict verdict;
  if (!pmp::is_polygon_soup_a_polygon_mesh(faces))
    return verdict;
  CgalMesh own;
  CgalMesh& surface = result != nullptr ? *result : own;
  pmp::polygon_soup_to_polygon_mesh(points, faces, surface);
  verdict.manifold = CGAL::is_valid_polygon_mesh(surface) && surface.is_valid(false) &&
                     surface.number_of_vertices() == mesh.points.size() &&
                     surface.number_of_faces() == mesh.triangles.size();
  verdict.closed = CGAL::is_closed(surface) && CGAL::is_triangle_mesh(surface);
  verdict.euler = static_cast<std::int64_t>(surface.number_of_vertices()) -
                  static_cast<std::int64_t>(surface.number_of_edges()) +
                  static_cast<std::int64_t>(surface.number_of_faces());
  const auto component =
      surface.add_property_map<CgalMesh::Face_index, std::size_t>("f:component").first;
  verdict.components = pmp::connected_components(surface, component);
  return verdict;
}

} // namespace gewebe::test
