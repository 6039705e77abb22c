#pragma once
// Two wavy sheets close to each other, for tests of candidates and contact potentials.

#include "collision/surface.h"
#include "geometry/vec3.h"

#include <cmath>
#include <cstdint>
#include <random>

namespace gewebe::test {

/// Two sheets of side x side nodes, 1 mm apart within each, `gap` between them, disturbed by
/// `noise`; a sphere (owner 2) and a capsule (owner 3) of the given radius close to the upper one.
inline collision::CollisionSurface two_sheets(std::uint32_t side, double gap, double noise,
                                              double radius, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> off(-noise, noise);
  collision::CollisionSurface surface;
  for (std::uint32_t sheet = 0; sheet < 2; ++sheet)
    for (std::uint32_t j = 0; j < side; ++j)
      for (std::uint32_t i = 0; i < side; ++i) {
        const double x = i + 0.37 * sheet + off(random), y = j + 0.06 * sheet + off(random);
        surface.rest.push_back({x, y, gap * sheet + off(random)});
        surface.owner.push_back(sheet);
        surface.radius.push_back(0);
        if (i + 1 == side || j + 1 == side)
          continue;
        const std::uint32_t a = (sheet * side + j) * side + i;
        surface.triangles.push_back({a, a + 1, a + side});
        surface.triangles.push_back({a + 1, a + side + 1, a + side});
      }
  const auto add = [&](const Vec3& p, std::uint32_t owner) {
    surface.rest.push_back(p);
    surface.owner.push_back(owner);
    surface.radius.push_back(radius);
    surface.points.push_back(static_cast<std::uint32_t>(surface.size()) - 1);
  };
  const double above = gap + radius + 0.5 * gap, middle = 0.5 * side;
  add({middle, middle, above}, 2);
  add({0.3, 0.8, above}, 3);
  add({middle, 0.6, above}, 3);
  surface.edges.push_back({surface.points[1], surface.points[2]});
  complete_surface(surface);
  return surface;
}

} // namespace gewebe::test
