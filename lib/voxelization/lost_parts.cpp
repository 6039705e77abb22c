#include "voxelization/lost_parts.h"

#include "base/disjoint_sets.h"
#include "repair/weld.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace gewebe::voxelization {
namespace {

class VoxelSearch {
public:
  explicit VoxelSearch(const volume::Grid& grid)
      : info_(grid.info()), values_(grid), largest_(0x1p30) {}

  /// Is a voxel inside near the face?
  bool finds_inside(const TriangleMesh& mesh, const Triangle& t) {
    std::array<Vec3, 3> p;
    double longest = 0;
    for (std::size_t n = 0; n < 3; ++n)
      p.at(n) = info_.transform.to_index(mesh.points[t.at(n)]);
    for (std::size_t n = 0; n < 3; ++n) {
      if (!can_index(p.at(n)))
        return false;
      longest = std::fmax(longest, norm(p.at(n) - p.at((n + 1) % 3)));
    }
    const int steps = std::max(1, static_cast<int>(std::ceil(2 * longest)));
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j)
        if (has_inside_near(p[0] + (p[1] - p[0]) * (static_cast<double>(i) / steps) +
                                (p[2] - p[0]) * (static_cast<double>(j) / steps),
                            1))
          return true;
    return false;
  }

  /// Of the voxels that are nearer to a place than `reach` along each axis; with 1 those of its
  /// cell. One that lies in the faces of cells has those of all of them. \pre can_index(at)
  bool has_inside_near(const Vec3& at, int reach) {
    constexpr double rounding = 1e-6;
    Int3 first{}, last{};
    for (int a = 0; a < 3; ++a) {
      first.at(static_cast<std::size_t>(a)) =
          static_cast<std::int32_t>(std::ceil(at[a] - reach - rounding));
      last.at(static_cast<std::size_t>(a)) =
          static_cast<std::int32_t>(std::floor(at[a] + reach + rounding));
    }
    for (std::int32_t x = first[0]; x <= last[0]; ++x)
      for (std::int32_t y = first[1]; y <= last[1]; ++y)
        for (std::int32_t z = first[2]; z <= last[2]; ++z)
          if (const double value = values_.value({x, y, z});
              info_.level_set ? value < info_.isovalue : value > info_.isovalue)
            return true;
    return false;
  }

  Vec3 to_index(const Vec3& place) const { return info_.transform.to_index(place); }
  bool can_index(const Vec3& at) const {
    return std::fabs(at.x) < largest_ && std::fabs(at.y) < largest_ && std::fabs(at.z) < largest_;
  }

private:
  const volume::GridInfo& info_;
  volume::GridAccessor values_;
  double largest_; // coordinate that an index can have
};

LostParts count(const TriangleMesh& mesh, const volume::Grid& grid) {
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

LostParts find_lost_parts(const TriangleMesh& mesh, const volume::Grid& grid) {
  const LostParts as_stored = count(mesh, grid);
  if (as_stored.lost == 0) // nor is any that several of these make
    return as_stored;
  TriangleMesh welded;
  welded.points = mesh.points;
  welded.triangles = mesh.triangles;
  repair::weld(welded, {.mode = repair::Weld::all, .drop_degenerate = true, .drop_unused = true});
  return count(welded, grid);
}

double lost_surface(const TriangleMesh& mesh, const volume::Grid& grid) {
  constexpr std::uint64_t samples = 5000;
  // The next place in a triangle: a sequence that fills the square evenly, by the plastic number
  // (Roberts 2018), folded.
  constexpr double step_u = 0.7548776662466927, step_v = 0.5698402909980532;
  std::vector<double> areas;
  areas.reserve(mesh.triangles.size());
  double whole = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3& p = mesh.points[a];
    areas.push_back(norm(cross(mesh.points[b] - p, mesh.points[c] - p)));
    whole += areas.back();
  }
  if (!(whole > 0 && std::isfinite(whole)))
    return 0;
  VoxelSearch search(grid);
  double before = 0;
  std::uint64_t taken = 0, lost = 0;
  for (std::size_t t = 0; t < areas.size(); ++t) {
    before += areas[t];
    for (; taken < samples && (static_cast<double>(taken) + 0.5) * whole < before * samples;
         ++taken) {
      double u = std::fmod(static_cast<double>(taken) * step_u, 1.0);
      double v = std::fmod(static_cast<double>(taken) * step_v, 1.0);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      const auto& [a, b, c] = mesh.triangles[t];
      const Vec3& p = mesh.points[a];
      const Vec3 at = search.to_index(p + (mesh.points[b] - p) * u + (mesh.points[c] - p) * v);
      lost += search.can_index(at) && !search.has_inside_near(at, 2);
    }
  }
  return static_cast<double>(lost) / samples;
}

} // namespace gewebe::voxelization
