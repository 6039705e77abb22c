#include "voxelize/lost_parts.h"

#include "base/disjoint_sets.h"
#include "mesh/weld.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace gewebe {
namespace {

class VoxelSearch {
public:
  explicit VoxelSearch(const Grid& grid) : info_(grid.info()), values_(grid), largest_(0x1p30) {}

  /// Is a voxel inside near the face?
  bool finds_inside(const TriangleMesh& mesh, const Triangle& t) {
    std::array<Vec3, 3> p;
    double longest = 0;
    for (std::size_t n = 0; n < 3; ++n)
      p.at(n) = info_.transform.to_index(mesh.points[t.at(n)]);
    for (std::size_t n = 0; n < 3; ++n)
      for (int a = 0; a < 3; ++a) {
        if (!(std::fabs(p.at(n)[a]) < largest_))
          return false;
        longest = std::fmax(longest, norm(p.at(n) - p.at((n + 1) % 3)));
      }
    const int steps = std::max(1, static_cast<int>(std::ceil(2 * longest)));
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j)
        if (cell_has_inside(p[0] + (p[1] - p[0]) * (static_cast<double>(i) / steps) +
                            (p[2] - p[0]) * (static_cast<double>(j) / steps)))
          return true;
    return false;
  }

private:
  bool cell_has_inside(const Vec3& at) {
    const Int3 first{static_cast<std::int32_t>(std::floor(at.x)),
                     static_cast<std::int32_t>(std::floor(at.y)),
                     static_cast<std::int32_t>(std::floor(at.z))};
    for (unsigned corner = 0; corner < 8; ++corner) {
      Int3 voxel = first;
      for (std::size_t a = 0; a < 3; ++a)
        voxel.at(a) += static_cast<int>(corner >> a & 1);
      const double value = values_.value(voxel);
      if (info_.level_set ? value < info_.isovalue : value > info_.isovalue)
        return true;
    }
    return false;
  }

  const GridInfo& info_;
  GridAccessor values_;
  double largest_; // coordinate that an index can have
};

LostParts count(const TriangleMesh& mesh, const Grid& grid) {
  DisjointSets sets(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  VoxelSearch search(grid);
  enum : std::uint8_t { unused, lost, found };
  std::vector<std::uint8_t> state(mesh.points.size(), unused); // of each part, by its first point
  for (const Triangle& t : mesh.triangles) {
    std::uint8_t& part = state[sets.find(t[0])];
    if (part != found)
      part = search.finds_inside(mesh, t) ? found : lost;
  }
  const auto lost_parts = static_cast<std::uint64_t>(std::ranges::count(state, lost));
  return {lost_parts + static_cast<std::uint64_t>(std::ranges::count(state, found)), lost_parts};
}

} // namespace

LostParts find_lost_parts(const TriangleMesh& mesh, const Grid& grid) {
  const LostParts as_stored = count(mesh, grid);
  if (as_stored.lost == 0) // nor is any that several of these make
    return as_stored;
  TriangleMesh welded;
  welded.points = mesh.points;
  welded.triangles = mesh.triangles;
  weld(welded, {.mode = Weld::all, .drop_degenerate = true, .drop_unused = true});
  return count(welded, grid);
}

} // namespace gewebe
