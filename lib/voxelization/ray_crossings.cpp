#include "voxelization/ray_crossings.h"
// Based on: H. Edelsbrunner, E. P. Mücke, Simulation of Simplicity, 1990 (here the query points
// move, not the mesh, so three infinitesimals do for all of them).

#include "geometry/exact_predicates.h"

namespace gewebe::voxelization {

bool past_edge(const Vec3& p, const Vec3& q, std::int32_t i, std::int32_t j,
               std::uint64_t& exact_tests) {
  const int turn = turn_sign(p.x, p.y, q.x, q.y, i, j, exact_tests);
  // The move adds (q.x - p.x) e2 - (q.y - p.y) e1, and q.x > p.x.
  return turn != 0 ? turn > 0 : q.y <= p.y;
}

std::int32_t first_past_plane(const Vec3& a, const Vec3& b, const Vec3& c, Ray ray,
                              std::int32_t low, std::int32_t high, TieOrder ties,
                              std::uint64_t& exact_tests) {
  // The normal's z is not 0: some ray crosses the triangle.
  const int normal_z = turn_sign(a.x, a.y, b.x, b.y, c.x, c.y, exact_tests);
  const auto past = [&](std::int32_t k) {
    const Vec3 sample{static_cast<double>(ray.i), static_cast<double>(ray.j),
                      static_cast<double>(k)};
    int side = side_sign(a, b, c, sample, exact_tests);
    // The move adds normal_x, normal_y and normal_z times their infinitesimals.
    if (side == 0 && ties != TieOrder::zxy)
      side = turn_sign(a.y, a.z, b.y, b.z, c.y, c.z, exact_tests);
    if (side == 0 && ties == TieOrder::xyz)
      side = turn_sign(a.z, a.x, b.z, b.x, c.z, c.x, exact_tests);
    return side == 0 || side == normal_z;
  };
  while (low < high) {
    const auto middle = static_cast<std::int32_t>((std::int64_t{low} + std::int64_t{high}) >> 1);
    if (past(middle))
      high = middle;
    else
      low = middle + 1;
  }
  return high;
}

} // namespace gewebe::voxelization
