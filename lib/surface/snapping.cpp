#include "surface/snapping.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "surface/snap_clusters_internal.h"
#include "surface/snap_collapse_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

// Based on: report FZKA 7190, Forschungszentrum Karlsruhe, 2006, section 3.1.4.

namespace gewebe {
namespace {

bool has_no_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, w = c - b;
  const double longest = std::max({dot(u, u), dot(v, v), dot(w, w)});
  return !(norm(cross(u, v)) > 1e-12 * longest);
}

/// A quick test. \pre enough is the square of what the area may be at least, for sides of 1
bool has_much_area(const Vec3& a, const Vec3& b, const Vec3& c, double enough) {
  const Vec3 u = b - a, v = c - a, w = c - b, normal = cross(u, v);
  const double longest = std::max({dot(u, u), dot(v, v), dot(w, w)});
  return dot(normal, normal) > enough * longest * longest;
}

/// What has_no_area asks in index space, asked in the world: an affine map changes the ratio of an
/// area to a square by no more than its condition, which is below the product of the norms of the
/// matrix and its inverse; infinite where that tells nothing.
double enough_area(const GridTransform& transform) {
  const auto& m = transform.m;
  const Vec3 rows[3]{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}};
  const Vec3 minors[3]{cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])};
  double norm2 = 0, minors2 = 0;
  for (int a = 0; a < 3; ++a) {
    norm2 += dot(rows[a], rows[a]);
    minors2 += dot(minors[a], minors[a]);
  }
  const double determinant = transform.determinant(),
               condition2 = norm2 * minors2 / (determinant * determinant);
  const double ratio = 1e-9 * condition2;
  return ratio < 1e-3 ? ratio * ratio : HUGE_VAL;
}

/// The mesh that is left when points have been merged.
class SnappedMesh {
public:
  SnappedMesh(const Context& context, const IsoSurface& surface, SnapClusters& clusters,
              const SnapMerges& merges, SnapOptions::Place place)
      : context_(context), surface_(surface), clusters_(clusters), merges_(merges), place_(place) {
    context_.progress = nullptr;
  }

  void make(SnapResult& result) {
    place_clusters();
    write_points(result.mesh.points, result.mesh.triangles);
    write_triangles(result.mesh.points, result.mesh.triangles);
    for (const std::uint64_t count : zero_area_)
      result.report.zero_area += count;
  }

private:
  static constexpr std::size_t points_at_once = 16384;

  /// Index position of the points that were merged at p, whose slot this is.
  Vec3 merged_position(std::uint32_t p, std::uint32_t slot) const;
  Vec3 position(std::uint32_t p) const;
  void place_clusters();
  void write_points(std::vector<Vec3>& points, std::vector<Triangle>& triangles);
  void write_triangles(const std::vector<Vec3>& points, std::vector<Triangle>& triangles);

  Context context_;
  const IsoSurface& surface_;
  SnapClusters& clusters_;
  const SnapMerges& merges_;
  SnapOptions::Place place_;
  std::vector<Vec3> of_slot_;            // index positions of points that are left
  std::unique_ptr<std::uint32_t[]> new_; // number of each point, of what it was merged into
  std::vector<std::uint64_t> zero_area_; // faces of each part
};

Vec3 SnappedMesh::merged_position(std::uint32_t p, std::uint32_t slot) const {
  const std::vector<EdgeCrossing>& crossings = surface_.crossings;
  const Vec3 own = index_position(crossings[p]);
  bool only_fins = true;
  Vec3 sum;
  double weights = 0;
  for (std::uint32_t at = slot; at != SnapMerges::none; at = merges_.next[at]) {
    const std::uint32_t member = clusters_.members[at];
    only_fins = only_fins && (clusters_.flags[member] & fin) != 0;
    const double fraction = crossings[member].fraction,
                 weight = 1 - 1.5 * std::min(fraction, 1 - fraction);
    sum += (index_position(crossings[member]) - own) * weight;
    weights += weight;
  }
  if (place_ == SnapOptions::Place::mean || only_fins)
    return own + sum / weights;
  const std::uint32_t first = clusters_.first_member[clusters_.cluster[slot]];
  const Int3 corner = snap_corner(crossings[first], clusters_.flags[first]);
  return {static_cast<double>(corner[0]), static_cast<double>(corner[1]),
          static_cast<double>(corner[2])};
}

void SnappedMesh::place_clusters() {
  const std::size_t slots = clusters_.members.size();
  of_slot_.resize(slots);
  parallel_blocks(context_, slots, 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const std::uint32_t p = clusters_.members[slot];
      std::uint8_t& flags = clusters_.flags[p];
      if (merges_.target[slot] != p)
        flags |= merged | looked_at;
      else
        of_slot_[slot] = merged_position(p, static_cast<std::uint32_t>(slot));
      if (merges_.next[slot] != SnapMerges::none)
        flags |= looked_at;
    }
  });
}

/// Index position of a point of the surface after snapping.
Vec3 SnappedMesh::position(std::uint32_t p) const {
  const unsigned flags = clusters_.flags[p];
  if ((flags & merged) != 0)
    p = merges_.target[clusters_.slot[p]];
  if ((flags & clustered) != 0)
    return of_slot_[clusters_.slot[p]];
  if (place_ == SnapOptions::Place::corner && (flags & (snaps_low | snaps_high)) != 0) {
    const Int3 corner = snap_corner(surface_.crossings[p], flags);
    return {static_cast<double>(corner[0]), static_cast<double>(corner[1]),
            static_cast<double>(corner[2])};
  }
  return index_position(surface_.crossings[p]);
}

void SnappedMesh::write_points(std::vector<Vec3>& points, std::vector<Triangle>& triangles) {
  const std::size_t count = surface_.crossings.size();
  const std::uint8_t* const flags = clusters_.flags.get();
  new_ = std::make_unique_for_overwrite<std::uint32_t[]>(count);
  prefer_huge_pages(new_.get(), count * sizeof(std::uint32_t));
  std::vector<std::size_t> first((count + points_at_once - 1) / points_at_once + 1);
  parallel_blocks(context_, count, points_at_once, [&](std::size_t begin, std::size_t end) {
    std::size_t left = 0;
    for (std::size_t p = begin; p < end; ++p)
      left += (flags[p] & merged) == 0 ? 1 : 0;
    first[begin / points_at_once + 1] = left;
  });
  for (std::size_t n = 1; n < first.size(); ++n)
    first[n] += first[n - 1];
  std::size_t faces = surface_.mesh.triangles.size();
  for (const std::uint32_t dropped : merges_.dropped)
    faces -= dropped;
  resize_all(context_, resizing(points, first.back()), resizing(triangles, faces));

  // A point that stays where it was is copied.
  const unsigned moves =
      clustered | (place_ == SnapOptions::Place::corner ? snaps_low | snaps_high : 0U);
  parallel_blocks(context_, count, points_at_once, [&](std::size_t begin, std::size_t end) {
    std::size_t number = first[begin / points_at_once];
    for (std::size_t p = begin; p < end; ++p) {
      if ((flags[p] & merged) != 0)
        continue;
      new_[p] = static_cast<std::uint32_t>(number);
      points[number++] = (flags[p] & moves) == 0
                             ? surface_.mesh.points[p]
                             : surface_.transform.to_world(position(static_cast<std::uint32_t>(p)));
    }
  });
  parallel_blocks(context_, clusters_.members.size(), 8192,
                  [&](std::size_t begin, std::size_t end) {
                    for (std::size_t slot = begin; slot < end; ++slot) {
                      const std::uint32_t p = clusters_.members[slot];
                      if ((flags[p] & merged) != 0)
                        new_[p] = new_[merges_.target[slot]];
                    }
                  });
}

void SnappedMesh::write_triangles(const std::vector<Vec3>& points,
                                  std::vector<Triangle>& triangles) {
  const double enough = enough_area(surface_.transform);
  constexpr std::size_t at_once = SnapMerges::faces_at_once;
  const std::vector<Triangle>& old = surface_.mesh.triangles;
  const std::uint8_t* const flags = clusters_.flags.get();
  const std::size_t parts = (old.size() + at_once - 1) / at_once;
  std::vector<std::size_t> first(parts);
  for (std::size_t n = 1; n < parts; ++n)
    first[n] = first[n - 1] + at_once - merges_.dropped[n - 1];
  zero_area_.resize(parts);
  // Faces between points that stayed in place at 0.001 or more from the ends of their edges have an
  // area (see the test of the table): three edges of a cell that lie in no face of it in common.
  const unsigned doubtful =
      looked_at | (place_ == SnapOptions::Place::corner ? snaps_low | snaps_high : 0U);
  parallel_blocks(context_, old.size(), at_once, [&](std::size_t begin, std::size_t end) {
    Triangle* out = triangles.data() + first[begin / at_once];
    Triangle* const out_end = out + (end - begin - merges_.dropped[begin / at_once]);
    // Which faces vanish or may have no area can't be predicted: they are picked without a branch.
    std::array<std::uint32_t, 1025> picked;
    std::uint64_t zero_area = 0;
    for (std::size_t f = begin; f < end;) {
      std::size_t count = 0;
      for (const std::size_t stop = std::min(end, f + picked.size() - 1); f < stop; ++f) {
        const Triangle& t = old[f];
        const Triangle face{new_[t[0]], new_[t[1]], new_[t[2]]};
        const bool stays = face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
        const unsigned all = static_cast<unsigned>(flags[t[0]] | flags[t[1]] | flags[t[2]]);
        picked[count] = static_cast<std::uint32_t>(f);
        count += stays && (all & doubtful) != 0 ? 1 : 0;
        if (out != out_end) // only faces that vanish follow
          *out = face;
        out += stays ? 1 : 0;
      }
      for (std::size_t n = 0; n < count; ++n) {
        const Triangle& t = old[picked[n]];
        if (!has_much_area(points[new_[t[0]]], points[new_[t[1]]], points[new_[t[2]]], enough))
          zero_area += has_no_area(position(t[0]), position(t[1]), position(t[2])) ? 1 : 0;
      }
    }
    zero_area_[begin / at_once] = zero_area;
  });
}

} // namespace

SnapResult snap(const Context& context, const IsoSurface& surface, const SnapOptions& options) {
  if (!(options.epsilon >= 0 && options.epsilon <= 0.5))
    throw Error("epsilon must lie within 0 ... 0.5");
  const double points = static_cast<double>(surface.crossings.size()),
               triangles = static_cast<double>(surface.mesh.triangles.size());
  require_memory(context, points * (100 + 2 * sizeof(Vec3)) + triangles * 40, "snapping");

  SnapResult result;
  SnapReport& report = result.report;
  SnapClusters clusters = find_snap_clusters(context, surface, options.epsilon);
  const SnapMerges merges = merge_snap_clusters(context, surface.mesh.triangles, clusters);
  SnappedMesh(context, surface, clusters, merges, options.place).make(result);
  report.corners = clusters.corners;
  report.fins = clusters.fins;
  report.refused = merges.refused;
  report.points_before = surface.crossings.size();
  report.points_after = result.mesh.points.size();
  report.triangles_before = surface.mesh.triangles.size();
  report.triangles_after = result.mesh.triangles.size();
  return result;
}

} // namespace gewebe
