#include "volume/coverage.h"
// Based on: the divergence theorem over a polyhedron clipped to a box, after B. Mirtich, Fast and
// Accurate Computation of Polyhedral Mass Properties, 1996; sums of signed areas along one axis are
// how scan-line rasterizers anti-alias in the plane (L. Rosenberg's and D. Turner's of FreeType),
// here one dimension up. Clipping: I. Sutherland, G. Hodgman, Reentrant Polygon Clipping, 1974.

#include "volume/coverage_internal.h"
#include "volume/mesh_orient.h"
#include "volume/ray_crossings_internal.h"
#include "volume/voxelize_internal.h"

#include <algorithm>
#include <array>

namespace gewebe {
namespace {

/// A convex polygon in space: a triangle cut by up to six planes has at most nine corners, and the
/// walk keeps one plane more.
struct Polygon {
  static constexpr int capacity = 12;
  int count = 0;
  std::array<std::array<double, capacity>, 3> at; ///< per axis the corners' coordinates

  void add(double x, double y, double z) {
    const auto n = static_cast<std::size_t>(count);
    at[0][n] = x;
    at[1][n] = y;
    at[2][n] = z;
    ++count;
  }
  double min(std::size_t axis) const {
    return *std::min_element(at[axis].begin(), at[axis].begin() + count);
  }
  double max(std::size_t axis) const {
    return *std::max_element(at[axis].begin(), at[axis].begin() + count);
  }
};

/// Cuts `whole` at coordinate `h` of `axis`.
template <std::size_t axis>
void split(const Polygon& whole, double h, Polygon& below, Polygon& above) {
  below.count = above.count = 0;
  const auto count = static_cast<std::size_t>(whole.count);
  for (std::size_t n = 0, last = count - 1; n < count; last = n++) {
    const double a = whole.at[axis][last], b = whole.at[axis][n];
    if ((a < h && b > h) || (a > h && b < h)) {
      const double t = (h - a) / (b - a);
      std::array<double, 3> p;
      for (std::size_t other = 0; other < 3; ++other)
        p[other] = other == axis
                       ? h
                       : whole.at[other][last] + t * (whole.at[other][n] - whole.at[other][last]);
      below.add(p[0], p[1], p[2]);
      above.add(p[0], p[1], p[2]);
    }
    if (b <= h)
      below.add(whole.at[0][n], whole.at[1][n], whole.at[2][n]);
    if (b >= h)
      above.add(whole.at[0][n], whole.at[1][n], whole.at[2][n]);
  }
}

/// Calls `visit(cell, polygon)` for the part of `rest` in each unit cell along `axis`, from the
/// lowest up. Both polygons are used up.
template <std::size_t axis, class Visit>
void for_each_cell(Polygon& rest, Visit&& visit) {
  const double max = rest.max(axis);
  std::int32_t cell = floor_int(rest.min(axis));
  Polygon part, above;
  Polygon* from = &rest;
  Polygon* to = &above;
  while (max > cell + 1) {
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
        first_row_((mesh.first_slab + static_cast<std::int32_t>(slab)) * leaf_dim) {}

  void add(const Triangle& t) {
    const Vec3 &a = mesh_.points[t[0]], &b = mesh_.points[t[1]], &c = mesh_.points[t[2]];
    // From here on relative to a voxel nearby, which loses no bits.
    for (int axis = 0; axis < 3; ++axis)
      base_[static_cast<std::size_t>(axis)] = floor_int(std::min({a[axis], b[axis], c[axis]}));
    Polygon whole;
    for (const Vec3* p : {&a, &b, &c})
      whole.add(p->x - base_[0], p->y - base_[1], p->z - base_[2]);
    const std::int32_t begin = first_row_ - base_[0], end = begin + leaf_dim;
    if (whole.max(0) > end) {
      Polygon outside, inside;
      split<0>(whole, end, inside, outside);
      whole = inside;
    }
    if (begin > 0) {
      Polygon outside, inside;
      split<0>(whole, begin, outside, inside);
      whole = inside;
    }
    if (whole.count < 3)
      return;
    for_each_cell<0>(whole, [&](std::int32_t i, Polygon& row) {
      const auto in_slab = static_cast<std::size_t>(std::clamp(i - begin, 0, leaf_dim - 1));
      for_each_cell<1>(row, [&](std::int32_t j, Polygon& column) {
        for_each_cell<2>(column, [&](std::int32_t k, Polygon& piece) {
          add_piece(in_slab, j + base_[1], k + base_[2], k + 1, piece);
        });
      });
    });
  }

private:
  void add_piece(std::size_t i, std::int32_t j, std::int32_t k, double top, const Polygon& piece) {
    const auto& [x, y, z] = piece.at;
    double area = 0, moment = 0; // twice the area, six times the volume up to `top`
    const double h0 = top - z[0];
    for (std::size_t n = 2; n < static_cast<std::size_t>(piece.count); ++n) {
      const double twice = (x[n - 1] - x[0]) * (y[n] - y[0]) - (x[n] - x[0]) * (y[n - 1] - y[0]);
      area += twice;
      moment += twice * (h0 + (top - z[n - 1]) + (top - z[n]));
    }
    // Seen from below a face that looks down enters the solid.
    leaves_.at({j >> 3, k >> 3})
        .add(8 * i + static_cast<std::size_t>(j & 7), static_cast<std::size_t>(k & 7),
             moment * (-1.0 / 6), area * -0.5);
  }

  const SlabbedMesh& mesh_;
  DifferenceLeaves& leaves_;
  std::int32_t first_row_;
  std::array<std::int32_t, 3> base_{};
};

} // namespace

std::optional<Grid> exact_coverage(const Context& context, const TriangleMesh& mesh,
                                   const GridTransform& transform, OpenMesh on_open,
                                   CoverageReport* report) {
  check_voxelize_input(mesh, transform);
  require_memory(context, coverage_bytes(mesh, transform), "the voxelized mesh");
  CoverageReport local;
  CoverageReport& r = report != nullptr ? *report : local;
  r = {};
  r.mesh.triangles = mesh.triangles.size();
  SlabbedMesh slabbed;
  slabbed.points = coverage_points(mesh, transform);
  slabbed.triangles = mesh.triangles;
  if (!orient_closed(slabbed.points, slabbed.triangles)) {
    close_or_refuse(context, mesh, transform, on_open, slabbed.points, slabbed.triangles, r.mesh);
    if (!orient_closed(slabbed.points, slabbed.triangles))
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

} // namespace gewebe
