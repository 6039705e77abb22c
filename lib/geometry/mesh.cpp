#include "geometry/mesh.h"

#include "base/error.h"

#include <string>

namespace gewebe {
namespace {

std::string at_index(const char* what, std::size_t index) {
  return std::string(what) + " " + std::to_string(index);
}

void check_size(const char* what, std::size_t size, const char* unit, std::size_t expected) {
  if (size != 0 && size != expected)
    throw Error(std::to_string(size) + " " + what + ", expected none or one for each of the " +
                std::to_string(expected) + " " + unit);
}

void check_indices(const char* what, const std::vector<std::int32_t>& values) {
  for (std::size_t t = 0; t < values.size(); ++t)
    if (values[t] < 0)
      throw Error(at_index("triangle", t) + " has " + what + " " + std::to_string(values[t]) +
                  ", expected 0 or more");
}

} // namespace

Box3 bounding_box(const TriangleMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.points)
    box.add(p);
  return box;
}

double signed_volume(const TriangleMesh& mesh) {
  if (mesh.triangles.empty())
    return 0;
  // Tetrahedra to a corner of the mesh instead of the origin: a far mesh loses no digits.
  const Vec3 apex = mesh.points[mesh.triangles[0][0]];
  double six_volumes = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.points[t[0]] - apex;
    const Vec3 b = mesh.points[t[1]] - apex;
    const Vec3 c = mesh.points[t[2]] - apex;
    six_volumes += dot(a, cross(b, c));
  }
  return six_volumes / 6;
}

double surface_area(const TriangleMesh& mesh) {
  double two_areas = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.points[t[0]];
    two_areas += norm(cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a));
  }
  return two_areas / 2;
}

void check_mesh(const TriangleMesh& mesh) {
  const std::size_t points = mesh.points.size();
  const std::size_t triangles = mesh.triangles.size();
  if (points > UINT32_MAX)
    throw Error(std::to_string(points) + " points, expected at most " + std::to_string(UINT32_MAX));
  check_size("normals", mesh.normals.size(), "points", points);
  check_size("texture coordinates", mesh.texcoords.size(), "triangles", triangles);
  check_size("part numbers", mesh.part.size(), "triangles", triangles);
  check_size("material numbers", mesh.material.size(), "triangles", triangles);
  for (std::size_t p = 0; p < points; ++p)
    if (!is_finite(mesh.points[p]))
      throw Error(at_index("point", p) + " is not finite, expected finite coordinates");
  for (std::size_t t = 0; t < triangles; ++t)
    for (const std::uint32_t corner : mesh.triangles[t])
      if (corner >= points)
        throw Error(at_index("triangle", t) + " has corner " + std::to_string(corner) +
                    ", expected an index below " + std::to_string(points));
  for (std::size_t p = 0; p < mesh.normals.size(); ++p)
    for (const float value : mesh.normals[p])
      if (!std::isfinite(value))
        throw Error(at_index("normal", p) + " is not finite");
  for (std::size_t t = 0; t < mesh.texcoords.size(); ++t)
    for (const float value : mesh.texcoords[t])
      if (!std::isfinite(value))
        throw Error(at_index("triangle", t) + " has a texture coordinate that is not finite");
  check_indices("part", mesh.part);
  check_indices("material", mesh.material);
}

} // namespace gewebe
