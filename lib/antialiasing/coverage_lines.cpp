#include "antialiasing/coverage.h"
// Based on: rays along one axis as in the exact scan (voxelization/voxelize.h); lengths instead of
// samples along them, as J. Amanatides, Ray Tracing with Cones, 1984, weighs area in the plane.

#include "antialiasing/coverage_internal.h"
#include "base/error.h"
#include "geometry/exact_predicates.h"
#include "voxelization/ray_crossings.h"
#include "voxelization/voxelize_input.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace gewebe::antialiasing {
namespace {

/// Where an edge meets the plane of a row of rays.
struct EdgePlace {
  std::int32_t first; ///< smallest j past the edge, exact
  double y, z;        ///< approximate place
};

/// \pre p.x <= i < q.x
EdgePlace place_on_edge(const Vec3& p, const Vec3& q, std::int32_t i, std::uint64_t& exact_tests) {
  // y errs by at most 6 u |q.y - p.y| + u |p.y| to first order, u = 2^-53.
  const double t = (i - p.x) / (q.x - p.x);
  const double y = p.y + t * (q.y - p.y), z = p.z + t * (q.z - p.z);
  const double error = 0x1p-49 * (std::fabs(p.y) + std::fabs(q.y - p.y));
  const std::int32_t below = voxelization::floor_int(y);
  const double rest = y - below;
  if (rest > error && rest < 1 - error)
    return {below + 1, y, z};
  const std::int32_t nearest = rest < 0.5 ? below : below + 1;
  return {voxelization::past_edge(p, q, i, nearest, exact_tests) ? nearest : nearest + 1, y, z};
}

/// Calls `emit(i, j, z)` for each ray (i, j) with row_begin <= i < row_end that crosses the
/// triangle at height z. Which rays do is exact, as in cross_triangle; z is rounded. \pre as there
template <class Emit>
void heights_on_triangle(Vec3 a, Vec3 b, Vec3 c, std::int32_t row_begin, std::int32_t row_end,
                         std::uint64_t& exact_tests, Emit&& emit) {
  if (b.x < a.x)
    std::swap(a, b);
  if (c.x < b.x)
    std::swap(b, c);
  if (b.x < a.x)
    std::swap(a, b);
  row_begin = std::max(row_begin, voxelization::ceil_int(a.x));
  row_end = std::min(row_end, voxelization::ceil_int(c.x));
  for (std::int32_t i = row_begin; i < row_end; ++i) {
    const EdgePlace long_edge = place_on_edge(a, c, i, exact_tests);
    const EdgePlace short_edge =
        i < b.x ? place_on_edge(a, b, i, exact_tests) : place_on_edge(b, c, i, exact_tests);
    const bool long_is_low = long_edge.first < short_edge.first;
    const EdgePlace& low = long_is_low ? long_edge : short_edge;
    const EdgePlace& high = long_is_low ? short_edge : long_edge;
    const double width = high.y - low.y, rise = high.z - low.z;
    for (std::int32_t j = low.first; j < high.first; ++j) {
      const double t = width > 0 ? std::clamp((j - low.y) / width, 0.0, 1.0) : 0.5;
      emit(i, j, low.z + t * rise);
    }
  }
}

/// A crossing of ray (j, row) at z.
struct Crossing {
  std::int32_t j;
  double z;
  auto operator<=>(const Crossing&) const = default;
};

class SlabLines {
public:
  SlabLines(int rays, DifferenceLeaves& leaves)
      : rays_(rays), weight_(1.0 / (rays * rays)), leaves_(leaves) {}

  /// Adds the crossings of row `fine` (of the slab), sorted.
  void add_row(std::int32_t fine, const std::vector<Crossing>& row, std::uint64_t& odd_rays) {
    const auto i = static_cast<std::size_t>(fine / rays_);
    for (std::size_t n = 0; n < row.size();) {
      std::size_t end = n;
      while (end < row.size() && row[end].j == row[n].j)
        ++end;
      if ((end - n) % 2 != 0) {
        ++odd_rays;
      } else {
        const std::int32_t j = row[n].j / rays_ - (row[n].j % rays_ < 0 ? 1 : 0);
        for (std::size_t m = n; m < end; ++m)
          add(i, j, row[m].z, (m - n) % 2 == 0 ? weight_ : -weight_);
      }
      n = end;
    }
  }

private:
  void add(std::size_t i, std::int32_t j, double z, double area) {
    const std::int32_t k = voxelization::floor_int(z);
    leaves_.at({j >> 3, k >> 3})
        .add(8 * i + static_cast<std::size_t>(j & 7), static_cast<std::size_t>(k & 7),
             area * (k + 1 - z), area);
  }
  std::int32_t rays_;
  double weight_;
  DifferenceLeaves& leaves_;
};

} // namespace

volume::Grid line_coverage(const Context& context, const TriangleMesh& mesh,
                           const volume::GridTransform& transform, int rays,
                           voxelization::OpenMesh on_open, CoverageReport* report) {
  if (rays < 1 || rays > 64)
    throw Error("voxelize: " + std::to_string(rays) + " rays along an edge, expected 1 to 64");
  voxelization::check_voxelize_input(mesh, transform);
  require_memory(context, coverage_bytes(mesh, transform), "the voxelized mesh");
  CoverageReport local;
  CoverageReport& r = report != nullptr ? *report : local;
  r = {};
  r.mesh.triangles = mesh.triangles.size();
  SlabbedMesh slabbed;
  slabbed.points = coverage_points(mesh, transform);
  slabbed.triangles = mesh.triangles;
  voxelization::close_or_refuse(context, mesh, transform, on_open, slabbed.points,
                                slabbed.triangles, r.mesh);
  sort_into_slabs(context, slabbed);
  // Rays lie at ((a + ½)/rays) in each voxel: whole numbers of x rays - ½.
  std::vector<Vec3> fine(slabbed.points.size());
  for (std::size_t n = 0; n < fine.size(); ++n) {
    const Vec3& p = slabbed.points[n];
    fine[n] = {predicate_coordinate(std::fma(p.x, rays, -0.5)),
               predicate_coordinate(std::fma(p.y, rays, -0.5)), p.z};
    if (!(std::fabs(fine[n].x) < 1 << 30 && std::fabs(fine[n].y) < 1 << 30))
      throw Error("point " + std::to_string(n) +
                  " lies 2^30 rays or more from the lattice's origin: choose a larger voxel");
  }
  std::vector<voxelization::VoxelizeReport> counts(slabbed.slab_begin.size() - 1);
  volume::Grid grid = sum_slabs(
      context, slabbed, transform, SumRule::clamp, r,
      [&](std::size_t slab, DifferenceLeaves& leaves) {
        constexpr std::int32_t rows_at_once = 64;
        SlabLines lines(rays, leaves);
        const std::int32_t first =
            (slabbed.first_slab + static_cast<std::int32_t>(slab)) * volume::leaf_dim * rays;
        std::array<std::vector<Crossing>, rows_at_once> rows;
        for (std::int32_t row = first; row < first + volume::leaf_dim * rays; row += rows_at_once) {
          const std::int32_t row_end =
              std::min(first + volume::leaf_dim * rays, row + rows_at_once);
          for (std::size_t n = slabbed.slab_begin[slab]; n < slabbed.slab_begin[slab + 1]; ++n) {
            const Triangle& t = slabbed.triangles[slabbed.members[n]];
            heights_on_triangle(fine[t[0]], fine[t[1]], fine[t[2]], row, row_end,
                                counts[slab].exact_tests,
                                [&](std::int32_t i, std::int32_t j, double z) {
                                  rows[static_cast<std::size_t>(i - row)].push_back({j, z});
                                });
          }
          for (std::int32_t i = row; i < row_end; ++i) {
            std::vector<Crossing>& crossings = rows[static_cast<std::size_t>(i - row)];
            std::sort(crossings.begin(), crossings.end());
            counts[slab].crossings += crossings.size();
            lines.add_row(i - first, crossings, counts[slab].odd_rays);
            crossings.clear();
          }
        }
      });
  for (const voxelization::VoxelizeReport& c : counts) {
    r.mesh.crossings += c.crossings;
    r.mesh.odd_rays += c.odd_rays;
    r.mesh.exact_tests += c.exact_tests;
  }
  return grid;
}

} // namespace gewebe::antialiasing
