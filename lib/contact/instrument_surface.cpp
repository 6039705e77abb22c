#include "contact/instrument_surface.h"

#include "contact/convex_core.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

namespace gewebe::contact {

namespace {

using Direction = std::array<double, 2>; // cosine and sine

/// From 0 to 90 degrees, both included, by halves.
std::vector<Direction> quarter_turn(std::size_t parts) {
  std::vector<Direction> all(parts + 1);
  all.front() = {1, 0};
  all.back() = {0, 1};
  for (std::size_t step = parts; step > 1; step /= 2)
    for (std::size_t at = 0; at < parts; at += step) {
      const Direction &a = all[at], &b = all[at + step];
      const double x = a[0] + b[0], y = a[1] + b[1], size = std::sqrt(x * x + y * y);
      all[at + step / 2] = {x / size, y / size};
    }
  return all;
}

/// Two unit vectors that make a right-handed frame with a unit vector, in front of it.
std::pair<Vec3, Vec3> across(const Vec3& d) {
  const double x = std::fabs(d.x), y = std::fabs(d.y), z = std::fabs(d.z);
  const Vec3 other = x <= y && x <= z ? Vec3{1, 0, 0} : y <= z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  const Vec3 u = other - dot(other, d) * d;
  const Vec3 unit = u / norm(u);
  return {unit, cross(d, unit)};
}

} // namespace

InstrumentSurface round_surface(double radius, const Vec3& axis, std::size_t around,
                                std::size_t along) {
  const bool straight = norm(axis) > 0;
  const Vec3 up = straight ? axis / norm(axis) : Vec3{0, 0, 1};
  const auto [u, v] = straight ? across(up) : std::pair{Vec3{1, 0, 0}, Vec3{0, 1, 0}};
  const std::size_t quarter = around / 4;
  const std::vector<Direction> turn = quarter_turn(quarter);
  std::vector<Vec3> ring; // directions
  for (std::size_t j = 0; j < around; ++j) {
    const auto [c, s] = turn[j % quarter];
    const std::array<Direction, 4> quadrants{{{c, s}, {-s, c}, {-c, -s}, {s, -c}}};
    const auto [x, y] = quadrants[j / quarter];
    ring.push_back(x * u + y * v);
  }

  InstrumentSurface surface;
  const auto add = [&](const Vec3& core, const Vec3& normal) {
    surface.points.push_back(core + radius * normal);
    surface.normals.push_back(normal);
  };
  std::size_t rings = 0;
  const auto add_ring = [&](const Vec3& core, double out, double height) {
    for (const Vec3& direction : ring)
      add(core, out * direction + height * up);
    ++rings;
  };
  add({}, -1.0 * up);
  for (std::size_t k = 1; k <= quarter; ++k)
    add_ring({}, turn[k][1], -turn[k][0]);
  for (std::size_t k = 1; straight && k <= along; ++k)
    add_ring(static_cast<double>(k) / static_cast<double>(along) * axis, 1, 0);
  for (std::size_t k = quarter - 1; k >= 1; --k)
    add_ring(axis, turn[k][1], turn[k][0]);
  add(axis, up);

  const auto corner = [&](std::size_t r, std::size_t j) {
    return static_cast<std::uint32_t>(1 + r * around + j % around);
  };
  const auto last = static_cast<std::uint32_t>(surface.points.size() - 1);
  for (std::size_t j = 0; j < around; ++j)
    surface.triangles.push_back({0, corner(0, j + 1), corner(0, j)});
  for (std::size_t r = 0; r + 1 < rings; ++r)
    for (std::size_t j = 0; j < around; ++j) {
      surface.triangles.push_back({corner(r, j), corner(r, j + 1), corner(r + 1, j + 1)});
      surface.triangles.push_back({corner(r, j), corner(r + 1, j + 1), corner(r + 1, j)});
    }
  for (std::size_t j = 0; j < around; ++j)
    surface.triangles.push_back({corner(rings - 1, j), corner(rings - 1, j + 1), last});
  return surface;
}

InstrumentSurface hull_surface(const ConvexCore& core, double radius) {
  InstrumentSurface surface;
  std::vector<std::uint32_t> first; // point of each face
  const auto point_of = [&](std::uint32_t face, std::uint32_t corner) {
    const std::vector<std::uint32_t>& loop = core.faces()[face].corners;
    return first[face] + static_cast<std::uint32_t>(std::ranges::find(loop, corner) - loop.begin());
  };
  for (const ConvexCore::Face& face : core.faces()) {
    const auto at = static_cast<std::uint32_t>(surface.points.size());
    first.push_back(at);
    for (const std::uint32_t corner : face.corners) {
      surface.points.push_back(core.corners()[corner] + radius * face.normal);
      surface.normals.push_back(face.normal);
    }
    for (std::uint32_t k = 1; k + 1 < face.corners.size(); ++k)
      surface.triangles.push_back({at, at + k, at + k + 1});
  }
  // Around a corner each edge goes from a face to the next one.
  std::vector<std::vector<std::array<std::uint32_t, 2>>> around(core.corners().size());
  for (const ConvexCore::Edge& e : core.edges()) {
    const std::uint32_t a = point_of(e.left, e.a), b = point_of(e.left, e.b),
                        c = point_of(e.right, e.b), d = point_of(e.right, e.a);
    surface.triangles.push_back({b, a, d});
    surface.triangles.push_back({b, d, c});
    around[e.a].push_back({d, a});
    around[e.b].push_back({b, c});
  }
  for (const std::vector<std::array<std::uint32_t, 2>>& steps : around) {
    std::vector<std::uint32_t> loop{steps[0][0]};
    for (std::size_t k = 1; k < steps.size(); ++k)
      for (const auto& [from, to] : steps)
        if (from == loop.back()) {
          loop.push_back(to);
          break;
        }
    for (std::size_t k = 1; k + 1 < loop.size(); ++k)
      surface.triangles.push_back({loop[0], loop[k], loop[k + 1]});
  }
  return surface;
}

InstrumentSurface shown_surface(const InstrumentShape& shape, std::size_t around,
                                std::size_t along) {
  if (shape.core)
    return hull_surface(*shape.core, shape.radius);
  const double radius = shown_radius(shape);
  return radius > 0 ? round_surface(radius, shape.axis, around, along) : InstrumentSurface{};
}

double shown_radius(const InstrumentShape& shape) {
  return shape.blade ? norm(shape.axis) / 100 : shape.radius;
}

bool same_surface(const InstrumentShape& a, const InstrumentShape& b) {
  return a.radius == b.radius && a.axis == b.axis && a.blade == b.blade &&
         (a.core == b.core || (a.core && b.core && *a.core == *b.core));
}

} // namespace gewebe::contact
