#include "tetrahedra/tet_mesh.h"

#include "base/error.h"

#include <string>

namespace gewebe::tetrahedra {
namespace {

void check_size(const char* what, std::size_t size, std::size_t tetrahedra) {
  if (size != 0 && size != tetrahedra)
    throw Error(std::to_string(size) + " " + what + ", expected none or one for each of the " +
                std::to_string(tetrahedra) + " tetrahedra");
}

template <class Element>
void check_corners(const std::vector<Element>& elements, std::size_t points, const char* what) {
  for (std::size_t t = 0; t < elements.size(); ++t)
    for (const std::uint32_t node : elements[t])
      if (node >= points)
        throw Error("tetrahedron " + std::to_string(t) + " has " + what + " " +
                    std::to_string(node) + ", expected an index below " + std::to_string(points));
}

} // namespace

Box3 bounding_box(const TetMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.points)
    box.add(p);
  return box;
}

double volume(const TetMesh& mesh) {
  double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    sum += tetrahedron_volume(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]],
                              mesh.points[t[3]]);
  return sum;
}

void check_mesh(const TetMesh& mesh) {
  const std::size_t points = mesh.points.size();
  if (points > UINT32_MAX)
    throw Error(std::to_string(points) + " points, expected at most " + std::to_string(UINT32_MAX));
  check_size("rows of edge middles", mesh.middles.size(), mesh.tetrahedra.size());
  check_size("material numbers", mesh.material.size(), mesh.tetrahedra.size());
  for (std::size_t p = 0; p < points; ++p)
    if (!is_finite(mesh.points[p]))
      throw Error("point " + std::to_string(p) + " is not finite, expected finite coordinates");
  check_corners(mesh.tetrahedra, points, "corner");
  check_corners(mesh.middles, points, "an edge's middle");
  for (std::size_t t = 0; t < mesh.material.size(); ++t)
    if (mesh.material[t] < 0)
      throw Error("tetrahedron " + std::to_string(t) + " has material " +
                  std::to_string(mesh.material[t]) + ", expected 0 or more");
}

} // namespace gewebe::tetrahedra
