#include "tools/cli/transform_option.h"

#include "base/error.h"
#include "formats/stream/stream.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace gewebe::cli {
namespace {

void move_points(const Affine& map, std::vector<Vec3>& points) {
  for (std::size_t n = 0; n < points.size(); ++n) {
    points[n] = map(points[n]);
    if (!is_finite(points[n]))
      throw Error("--transform: point " + std::to_string(n) + " is not finite afterwards");
  }
}

/// The other order of corners, which turns a face over.
void turn_over(std::vector<Triangle>& triangles) {
  for (Triangle& t : triangles)
    std::swap(t[1], t[2]);
}
template <class Real>
void turn_over(std::vector<std::array<Real, 6>>& texcoords) {
  for (std::array<Real, 6>& st : texcoords) {
    std::swap(st[2], st[4]);
    std::swap(st[3], st[5]);
  }
}
void turn_over(std::vector<Tetrahedron>& tetrahedra, std::vector<EdgeMiddles>& middles) {
  for (Tetrahedron& t : tetrahedra)
    std::swap(t[2], t[3]);
  for (EdgeMiddles& m : middles) {
    std::swap(m[1], m[4]);
    std::swap(m[2], m[3]);
  }
}

/// A normal: by the inverse of the transpose, up to its length.
Vec3 normal_of(const Affine& map, const Vec3& n) {
  const std::array<double, 12>& m = map.m;
  const Vec3 x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]}; // columns
  const double sign = map.determinant() < 0 ? -1 : 1;
  const Vec3 turned = (cross(y, z) * n.x + cross(z, x) * n.y + cross(x, y) * n.z) * sign;
  const double length = norm(turned);
  return length > 0 ? turned / length : n;
}

std::uint8_t turned_axes(const Affine& map, std::uint8_t fixed) {
  constexpr std::uint8_t all = 7;
  if (fixed == 0 || fixed == all)
    return fixed;
  std::uint8_t turned = 0;
  for (std::size_t from = 0; from < 3; ++from) {
    if ((fixed >> from & 1) == 0)
      continue;
    std::size_t to = 0;
    while (to < 3 && !(std::fabs(std::fabs(map.m[4 * to + from]) - 1) <= 1e-9))
      ++to;
    if (to == 3)
      throw Error("--transform: a node is held along some axes alone, which the rotation turns out "
                  "of the axes, expected multiples of 90 degrees or --fix afterwards");
    turned = static_cast<std::uint8_t>(turned | 1U << to);
  }
  return turned;
}

} // namespace

void declare_transform(cli::Program& program, std::string& transform) {
  program.option("--transform", transform, "STEPS|FILE",
                 "move the input: translate X Y Z; rotate AXIS DEGREES; scale S; mirror AXIS; or a "
                 "file with a 4 x 4 matrix");
}

Affine transform_from_text(const std::string& text) {
  for (const char* const word : {"translate", "rotate", "scale", "mirror"})
    if (text.find_first_not_of(" \t") == text.find(word))
      try {
        return parse_affine(text);
      } catch (const Error& error) {
        throw UsageError(std::string("--transform: ") + error.what());
      }
  formats::Input input(text, false);
  return at(input.name(), [&] { return parse_affine_matrix(input.read_all(1U << 20U)); });
}

void apply(const Affine& map, TriangleMesh& mesh) {
  move_points(map, mesh.points);
  for (std::array<float, 3>& n : mesh.normals) {
    const Vec3 turned = normal_of(
        map, {static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2])});
    n = {static_cast<float>(turned.x), static_cast<float>(turned.y), static_cast<float>(turned.z)};
  }
  if (map.determinant() < 0) {
    turn_over(mesh.triangles);
    turn_over(mesh.texcoords);
  }
}

void apply(const Affine& map, tetrahedra::TetMesh& mesh) {
  move_points(map, mesh.points);
  if (map.determinant() < 0)
    turn_over(mesh.tetrahedra, mesh.middles);
}

void apply(const Affine& map, model::Model& model) {
  if (!map.is_rigid())
    throw Error("--transform: the masses and stiffness of a model depend on its size, expected no "
                "scale or shear, or the transform of the mesh that it is made of");
  for (model::Node& node : model.nodes) {
    node.position = map(node.position);
    node.fixed = turned_axes(map, node.fixed);
    if (!is_finite(node.position))
      throw Error("--transform: a node is not finite afterwards");
  }
  for (Vec3& n : model.normals)
    n = n == Vec3{} ? n : normal_of(map, n);
  move_points(map, model.skin.points);
  if (map.determinant() < 0) {
    turn_over(model.triangles);
    turn_over(model.texcoords);
    turn_over(model.tetrahedra, model.middles);
    turn_over(model.skin.triangles);
    turn_over(model.skin.texcoords);
  }
}

} // namespace gewebe::cli
