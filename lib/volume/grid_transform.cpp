#include "volume/grid.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace gewebe::volume {
namespace {

Vec3 column(const GridTransform& transform, std::size_t axis) {
  return {transform.m[axis], transform.m[4 + axis], transform.m[8 + axis]};
}

} // namespace

Vec3 GridTransform::to_world(const Vec3& index) const {
  const Vec3& p = index;
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

double GridTransform::determinant() const {
  return dot(column(*this, 0), cross(column(*this, 1), column(*this, 2)));
}

Vec3 GridTransform::to_index(const Vec3& world) const {
  const Vec3 a = column(*this, 0);
  const Vec3 b = column(*this, 1);
  const Vec3 c = column(*this, 2);
  const Vec3 p = world - Vec3{m[3], m[7], m[11]};
  // An axis-aligned lattice is inverted by one division an axis, so that centres come back exactly
  // wherever the division does.
  if (a.y == 0 && a.z == 0 && b.x == 0 && b.z == 0 && c.x == 0 && c.y == 0)
    return {p.x / a.x, p.y / b.y, p.z / c.z};
  const double volume = determinant();
  return {dot(p, cross(b, c)) / volume, dot(p, cross(c, a)) / volume, dot(p, cross(a, b)) / volume};
}

Vec3 GridTransform::voxel_size() const {
  return {norm(column(*this, 0)), norm(column(*this, 1)), norm(column(*this, 2))};
}

bool GridTransform::is_cubic() const {
  const Vec3 size = voxel_size();
  const double tolerance = 1e-9 * size.x;
  if (!(std::fabs(size.y - size.x) <= tolerance && std::fabs(size.z - size.x) <= tolerance))
    return false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(std::fabs(dot(column(*this, axis), column(*this, (axis + 1) % 3))) <= tolerance * size.x))
      return false;
  return size.x > 0;
}

std::string GridTransform::describe() const {
  std::array<char, 512> text{};
  const Vec3 size = voxel_size();
  const bool aligned = m[1] == 0 && m[2] == 0 && m[4] == 0 && m[6] == 0 && m[8] == 0 && m[9] == 0;
  if (aligned && m[0] == size.x && m[5] == size.x && m[10] == size.x) {
    (void)std::snprintf(text.data(), text.size(), "voxel %.9g, origin (%.9g, %.9g, %.9g)", size.x,
                        m[3], m[7], m[11]);
  } else {
    (void)std::snprintf(text.data(), text.size(),
                        "axes (%.9g, %.9g, %.9g) (%.9g, %.9g, %.9g) (%.9g, %.9g, %.9g), "
                        "origin (%.9g, %.9g, %.9g)",
                        m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10], m[3], m[7], m[11]);
  }
  return text.data();
}

GridTransform uniform_transform(double size) {
  GridTransform transform;
  transform.m = {size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0};
  return transform;
}

bool same_lattice(const GridTransform& a, const GridTransform& b, const Int3& min,
                  const Int3& max) {
  for (int corner = 0; corner < 8; ++corner) {
    const auto pick = [&](std::size_t axis) {
      return static_cast<double>((corner >> axis & 1) != 0 ? max[axis] : min[axis]);
    };
    const Vec3 index{pick(0), pick(1), pick(2)};
    if (!(norm(a.to_index(b.to_world(index)) - index) < 1e-6))
      return false;
  }
  return true;
}

} // namespace gewebe::volume
