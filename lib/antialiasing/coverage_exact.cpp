#include "antialiasing/coverage.h"
// Based on: the divergence theorem over a polyhedron clipped to a box, after B. Mirtich, Fast and
// Accurate Computation of Polyhedral Mass Properties, 1996; sums of signed areas along one axis are
// how scan-line rasterizers anti-alias in the plane (R. Levien's of LibArt, after it D. Turner's of
// FreeType), here one dimension up: triangles are clipped to columns of voxels, along which the
// integral of their height is known in closed form. Clipping: I. Sutherland, G. Hodgman, Reentrant
// Polygon Clipping, 1974.

#include "antialiasing/coverage_internal.h"
#include "repair/orient_closed.h"
#include "voxelization/ray_crossings.h"
#include "voxelization/voxelize_input.h"

#include <algorithm>
#include <array>

namespace gewebe::antialiasing {
namespace {

/// A corner, padded so that it is copied in two moves.
struct alignas(16) Corner {
  std::array<double, 4> at;
};

/// A convex polygon in space: a triangle cut by up to four planes has at most seven corners, and
/// the walk keeps one plane more; a place to spare is written by `split`.
struct Polygon {
  static constexpr std::size_t capacity = 10;
  std::size_t count = 0;
  std::array<Corner, capacity> corners;

  struct Range {
    double min, max;
  };
  Range range(std::size_t axis) const {
    Range r{corners[0].at[axis], corners[0].at[axis]};
    for (std::size_t n = 1; n < count; ++n) {
      const double x = corners[n].at[axis];
      r.min = x < r.min ? x : r.min;
      r.max = x > r.max ? x : r.max;
    }
    return r;
  }
};

/// Cuts `whole` at coordinate `h` of `axis`.
template <std::size_t axis>
void split(const Polygon& whole, double h, Polygon& below, Polygon& above) {
  std::size_t low = 0, high = 0;
  const Corner* last = &whole.corners[whole.count - 1];
  for (std::size_t n = 0; n < whole.count; ++n) {
    const Corner* const corner = &whole.corners[n];
    const double a = last->at[axis], b = corner->at[axis];
    if ((a < h) != (b < h) && a != h && b != h) {
      const double t = (h - a) / (b - a);
      Corner cut;
      for (std::size_t other = 0; other < 3; ++other)
        cut.at[other] = last->at[other] + t * (corner->at[other] - last->at[other]);
      cut.at[axis] = h;
      cut.at[3] = 0;
      below.corners[low++] = cut;
      above.corners[high++] = cut;
    }
    // Written always and kept or not: which side a corner lies on cannot be predicted.
    below.corners[low] = *corner;
    low += b <= h;
    above.corners[high] = *corner;
    high += b >= h;
    last = corner;
  }
  below.count = low;
  above.count = high;
}

/// Calls `visit(cell, polygon)` for the part of `rest` in each unit cell along `axis`, from the
/// lowest up. `rest` is used up.
template <std::size_t axis, class Visit>
void for_each_cell(Polygon& rest, Visit&& visit) {
  const Polygon::Range range = rest.range(axis);
  std::int32_t cell = voxelization::floor_int(range.min);
  if (range.max <= cell + 1) { // the usual case
    visit(cell, rest);
    return;
  }
  Polygon part, above;
  Polygon* from = &rest;
  Polygon* to = &above;
  while (range.max > cell + 1) {
    split<axis>(*from, cell + 1, part, *to);
    if (part.count > 2)
      visit(cell, part);
    std::swap(from, to);
    ++cell;
  }
  if (from->count > 2)
    visit(cell, *from);
}

/// Adds the triangles of one slab.
class SlabClipper {
public:
  SlabClipper(const SlabbedMesh& mesh, std::size_t slab, DifferenceLeaves& leaves)
      : mesh_(mesh), leaves_(leaves),
        first_row_((mesh.first_slab + static_cast<std::int32_t>(slab)) * volume::leaf_dim) {}

  void add(const Triangle& t) {
    const Vec3 &a = mesh_.points[t[0]], &b = mesh_.points[t[1]], &c = mesh_.points[t[2]];
    // From here on relative to a voxel nearby, which loses no bits.
    for (int axis = 0; axis < 3; ++axis)
      base_[static_cast<std::size_t>(axis)] =
          voxelization::floor_int(std::min({a[axis], b[axis], c[axis]}));
    Polygon whole, cut, outside;
    for (const Vec3* p : {&a, &b, &c})
      whole.corners[whole.count++].at = {p->x - base_[0], p->y - base_[1], p->z - base_[2], 0};
    const std::int32_t begin = first_row_ - base_[0], end = begin + volume::leaf_dim;
    if (whole.range(0).max > end) {
      split<0>(whole, end, cut, outside);
      whole = cut;
    }
    if (begin > 0 && whole.count > 2) {
      split<0>(whole, begin, outside, cut);
      whole = cut;
    }
    if (whole.count < 3)
      return;
    for_each_cell<0>(whole, [&](std::int32_t i, Polygon& row) {
      const auto in_slab = static_cast<std::size_t>(std::clamp(i - begin, 0, volume::leaf_dim - 1));
      for_each_cell<1>(
          row, [&](std::int32_t j, Polygon& column) { add_column(in_slab, j + base_[1], column); });
    });
  }

private:
  /// Adds a polygon that lies in one column of voxels.
  void add_column(std::size_t i, std::int32_t j, const Polygon& polygon) {
    const Polygon::Range range = polygon.range(2);
    const std::int32_t bottom = voxelization::floor_int(range.min);
    const std::int32_t top = std::max(voxelization::ceil_int(range.max) - 1, bottom);
    const std::size_t column = 8 * i + static_cast<std::size_t>(j & 7);
    const auto add = [&](std::int32_t k, double volume, double area) {
      k += base_[2];
      // Seen from below a face that looks down enters the solid.
      leaves_.at({j >> 3, k >> 3}).add(column, static_cast<std::size_t>(k & 7), -volume, -area);
    };
    // A fan of triangles: twice their areas seen from below, and of all of them six times the
    // volume up to `top + 1`.
    const auto corner = [&](std::size_t n) -> const std::array<double, 4>& {
      return polygon.corners[n].at;
    };
    std::array<double, Polygon::capacity> twice;
    double area = 0, volume = 0;
    const double end = top + 1, x0 = corner(0)[0], y0 = corner(0)[1], h0 = end - corner(0)[2];
    double x1 = corner(1)[0] - x0, y1 = corner(1)[1] - y0, h1 = end - corner(1)[2];
    for (std::size_t n = 2; n < polygon.count; ++n) {
      const double x2 = corner(n)[0] - x0, y2 = corner(n)[1] - y0, h2 = end - corner(n)[2];
      twice[n] = x1 * y2 - x2 * y1;
      area += twice[n];
      volume += twice[n] * (h0 + h1 + h2);
      x1 = x2;
      y1 = y2;
      h1 = h2;
    }
    area *= 0.5;
    volume *= 1.0 / 6;
    double below = 0;  // volume up to the voxel's bottom
    double before = 0; // of the voxel before
    for (std::int32_t k = bottom; k < top; ++k) {
      double sum = 0;
      for (std::size_t n = 2; n < polygon.count; ++n)
        sum += twice[n] * volume_below(k + 1, corner(0)[2], corner(n - 1)[2], corner(n)[2]);
      sum *= 0.5;
      const double of_voxel = sum - below;
      add(k, of_voxel - before, of_voxel - before);
      below = sum;
      before = of_voxel;
    }
    add(top, volume - below - before, area - before);
  }

  /// The mean of max(h - z, 0) over a triangle whose corners have the heights z0, z1, z2: a cubic
  /// below the middle one, the mean of h - z and a cubic above it.
  static double volume_below(double h, double z0, double z1, double z2) {
    const double low = std::min(std::min(z0, z1), z2), high = std::max(std::max(z0, z1), z2);
    const double mean = ((h - z0) + (h - z1) + (h - z2)) / 3;
    if (h >= high)
      return mean;
    if (h <= low)
      return 0;
    const double middle = std::max(std::min(z0, z1), std::min(std::max(z0, z1), z2));
    const bool lower = h <= middle;
    const double d = lower ? h - low : high - h;
    const double cubic = d * d * d / (3 * (lower ? middle - low : high - middle) * (high - low));
    return lower ? cubic : mean + cubic;
  }

  const SlabbedMesh& mesh_;
  DifferenceLeaves& leaves_;
  std::int32_t first_row_;
  std::array<std::int32_t, 3> base_{};
};

} // namespace

std::optional<volume::Grid> exact_coverage(const Context& context, const TriangleMesh& mesh,
                                           const volume::GridTransform& transform,
                                           voxelization::OpenMesh on_open, CoverageReport* report) {
  voxelization::check_voxelize_input(mesh, transform);
  require_memory(context, coverage_bytes(mesh, transform), "the voxelized mesh");
  CoverageReport local;
  CoverageReport& r = report != nullptr ? *report : local;
  r = {};
  r.mesh.triangles = mesh.triangles.size();
  SlabbedMesh slabbed;
  slabbed.points = coverage_points(mesh, transform);
  slabbed.triangles = mesh.triangles;
  if (!repair::orient_closed(slabbed.points, slabbed.triangles)) {
    voxelization::close_or_refuse(context, mesh, transform, on_open, slabbed.points,
                                  slabbed.triangles, r.mesh);
    if (!repair::orient_closed(slabbed.points, slabbed.triangles))
      return std::nullopt;
  }
  sort_into_slabs(context, slabbed);
  return sum_slabs(context, slabbed, transform, SumRule::fold, r,
                   [&](std::size_t slab, DifferenceLeaves& leaves) {
                     SlabClipper clipper(slabbed, slab, leaves);
                     for (std::size_t n = slabbed.slab_begin[slab];
                          n < slabbed.slab_begin[slab + 1]; ++n)
                       clipper.add(slabbed.triangles[slabbed.members[n]]);
                   });
}

} // namespace gewebe::antialiasing
