#include "stuffing/surface_distance.h"

#include "base/parallel.h"
#include "stuffing/cut_finder_internal.h"
#include "stuffing/lattice_internal.h"

#include <cmath>
#include <vector>

namespace gewebe::stuffing {
namespace {

constexpr std::size_t grain = 1024;

struct Sum {
  double largest = 0, weighted = 0, area = 0;
  std::uint64_t beyond = 0;
};

/// Distance in mm along ±`normal` (unit) from `place` to a change of side, or infinite.
double distance(CutFinder& finder, const StuffingLattice& lattice,
                const volume::GridTransform& to_world, const Vec3& place, const Vec3& normal) {
  const auto index = [&](double t) { return to_world.to_index(place + normal * t); };
  const double here = finder.excess(index(0));
  if (here == 0)
    return 0;
  for (int halvings = 6; halvings >= 0; --halvings)
    for (const double sign : {1.0, -1.0}) {
      const double reach = std::ldexp(lattice.cell, -halvings), t = sign * reach;
      const double there = finder.excess(index(t));
      if ((here > 0) == (there > 0))
        continue;
      const double share = here > 0 ? finder.find(index(0), index(t), here)
                                    : 1 - finder.find(index(t), index(0), there);
      return share * reach;
    }
  return HUGE_VAL;
}

} // namespace

SurfaceDistance surface_distance(const Context& context, const volume::Grid& grid,
                                 const StuffingOptions& options, const TriangleMesh& surface) {
  const StuffingLattice lattice = stuffing_lattice(grid, options.isovalue, options.cell);
  const std::size_t count = surface.triangles.size();
  std::vector<Sum> sums((count + grain - 1) / grain);
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    CutFinder finder(grid, lattice);
    Sum& sum = sums[begin / grain];
    for (std::size_t t = begin; t < end; ++t) {
      const auto& [a, b, c] = surface.triangles[t];
      const Vec3 p = surface.points[a], q = surface.points[b], r = surface.points[c];
      const Vec3 normal = cross(q - p, r - p);
      const double size = norm(normal);
      const double far =
          distance(finder, lattice, grid.info().transform, (p + q + r) / 3, normal / size);
      if (!std::isfinite(far)) {
        ++sum.beyond;
        continue;
      }
      sum.largest = std::fmax(sum.largest, far);
      sum.weighted += far * size;
      sum.area += size;
    }
  });
  Sum all;
  for (const Sum& sum : sums) {
    all.largest = std::fmax(all.largest, sum.largest);
    all.weighted += sum.weighted;
    all.area += sum.area;
    all.beyond += sum.beyond;
  }
  return {all.largest, all.area > 0 ? all.weighted / all.area : 0, all.beyond};
}

} // namespace gewebe::stuffing
