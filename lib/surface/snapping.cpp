#include "surface/snapping.h"

#include "base/error.h"
#include "base/index_map.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <vector>

// Based on: report FZKA 7190, Forschungszentrum Karlsruhe, 2006, section 3.1.4.
// Dey, Edelsbrunner, Guha and Nekhayev, Topology Preserving Edge Contraction, 1999.

namespace gewebe {
namespace {

constexpr std::uint32_t none = UINT32_MAX;

/// Lists of numbers, one after the other: list n is items[first[n]] … items[first[n + 1]].
struct Lists {
  std::vector<std::uint32_t> first, items;
  std::span<const std::uint32_t> operator[](std::size_t n) const {
    return {items.data() + first[n], items.data() + first[n + 1]};
  }
};

Lists faces_of_points(const std::vector<Triangle>& triangles, std::size_t points) {
  Lists lists{std::vector<std::uint32_t>(points + 2), {}};
  for (const Triangle& t : triangles)
    for (const std::uint32_t p : t)
      ++lists.first[p + 2];
  std::partial_sum(lists.first.begin(), lists.first.end(), lists.first.begin());
  lists.items.resize(3 * triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (const std::uint32_t p : triangles[f])
      lists.items[lists.first[p + 1]++] = static_cast<std::uint32_t>(f);
  return lists;
}

/// A closed mesh in which edges can be collapsed. A point that was collapsed into another hands
/// over its list of faces.
class CollapsingMesh {
public:
  explicit CollapsingMesh(const TriangleMesh& mesh)
      : faces_(mesh.triangles), star_(faces_of_points(faces_, mesh.points.size())),
        next_(mesh.points.size(), none), last_(mesh.points.size()), mark_(mesh.points.size(), 0),
        alive_(mesh.points.size(), 1) {
    std::iota(last_.begin(), last_.end(), 0U);
  }

  bool alive(std::uint32_t p) const { return alive_[p] != 0; }
  const std::vector<Triangle>& faces() const { return faces_; } ///< [0] is none where it is gone

  /// The points that were merged into p, p first.
  std::uint32_t next_member(std::uint32_t p) const { return next_[p]; }

  /// Calls visit(q) for each neighbour of p until it answers false. Returns whether it never did.
  template <class Visit>
  bool for_neighbours(std::uint32_t p, Visit&& visit) const {
    for (std::uint32_t member = p; member != none; member = next_[member])
      for (const std::uint32_t f : star_[member]) {
        const Triangle& t = faces_[f];
        if (t[0] == none)
          continue;
        const std::uint32_t following = t[0] == p ? t[1] : t[1] == p ? t[2] : t[0];
        if (!visit(following))
          return false;
      }
    return true;
  }

  /// Link condition for the edge p q of a closed 2-manifold.
  bool can_collapse(std::uint32_t p, std::uint32_t q) {
    ++tick_;
    std::size_t valence_p = 0, valence_q = 0, common = 0;
    for_neighbours(p, [&](std::uint32_t n) {
      mark_[n] = tick_;
      ++valence_p;
      return true;
    });
    for_neighbours(q, [&](std::uint32_t n) {
      common += mark_[n] == tick_ ? 1 : 0;
      ++valence_q;
      return common <= 2;
    });
    return common == 2 && !(valence_p == 3 && valence_q == 3);
  }

  /// Moves q into p and drops the two faces between them. \pre can_collapse(p, q)
  void collapse(std::uint32_t p, std::uint32_t q) {
    for (std::uint32_t member = q; member != none; member = next_[member])
      for (const std::uint32_t f : star_[member]) {
        Triangle& t = faces_[f];
        if (t[0] == none)
          continue;
        if (t[0] == p || t[1] == p || t[2] == p)
          t[0] = none;
        else
          (t[0] == q ? t[0] : t[1] == q ? t[1] : t[2]) = p;
      }
    next_[last_[p]] = q;
    last_[p] = last_[q];
    alive_[q] = 0;
  }

private:
  std::vector<Triangle> faces_;
  Lists star_;                             // faces of each point before any collapse
  std::vector<std::uint32_t> next_, last_; // chain of merged points, kept at its first
  std::vector<std::uint32_t> mark_;
  std::vector<std::uint8_t> alive_;
  std::uint32_t tick_ = 0;
};

struct Clusters {
  std::vector<std::uint32_t> of_point; // or none
  std::vector<Int3> corner;
  std::vector<std::uint8_t> is_fin; // of each point
};

Clusters make_clusters(const std::vector<EdgeCrossing>& crossings, double epsilon) {
  Clusters clusters;
  clusters.of_point.assign(crossings.size(), none);
  clusters.is_fin.assign(crossings.size(), 0);
  const auto snaps_low = [&](const EdgeCrossing& c) { return c.fraction <= epsilon; };
  const auto snaps_high = [&](const EdgeCrossing& c) { return 1 - c.fraction <= epsilon; };
  const auto count = std::ranges::count_if(
      crossings, [&](const EdgeCrossing& c) { return snaps_low(c) || snaps_high(c); });
  IndexMap numbers(static_cast<std::size_t>(count));
  for (std::size_t p = 0; p < crossings.size(); ++p) {
    Int3 corner = crossings[p].corner;
    if (!snaps_low(crossings[p])) {
      if (!snaps_high(crossings[p]))
        continue;
      ++corner[static_cast<std::size_t>(crossings[p].axis)];
    }
    const std::uint32_t number =
        numbers.insert(corner, static_cast<std::uint32_t>(clusters.corner.size()));
    if (number == clusters.corner.size())
      clusters.corner.push_back(corner);
    clusters.of_point[p] = number;
  }
  return clusters;
}

double squared_distance(const EdgeCrossing& crossing, const Int3& corner) {
  Vec3 d;
  for (int a = 0; a < 3; ++a)
    d[a] = static_cast<double>(crossing.corner[static_cast<std::size_t>(a)]) -
           corner[static_cast<std::size_t>(a)];
  d[crossing.axis] += crossing.fraction;
  return dot(d, d);
}

/// The cluster that a point between at most two clusters joins, or none.
std::uint32_t fin_cluster(const CollapsingMesh& mesh, const Clusters& clusters,
                          const EdgeCrossing& crossing, std::uint32_t p) {
  std::uint32_t a = none, b = none;
  const bool fin = mesh.for_neighbours(p, [&](std::uint32_t n) {
    const std::uint32_t cluster = clusters.of_point[n];
    if (cluster == none)
      return false;
    if (a == none || cluster == a)
      a = cluster;
    else if (b == none || cluster == b)
      b = cluster;
    else
      return false;
    return true;
  });
  if (!fin || a == none)
    return none;
  if (b == none)
    return a;
  if (a > b)
    std::swap(a, b);
  const double to_a = squared_distance(crossing, clusters.corner[a]),
               to_b = squared_distance(crossing, clusters.corner[b]);
  return to_b < to_a ? b : a;
}

std::uint64_t apply_fin_rule(const CollapsingMesh& mesh, const std::vector<EdgeCrossing>& crossings,
                             Clusters& clusters) {
  std::uint64_t fins = 0;
  std::vector<std::uint32_t> again; // neighbours of a fin may have become fins
  const auto examine = [&](std::uint32_t p) {
    if (clusters.of_point[p] != none)
      return;
    const std::uint32_t cluster = fin_cluster(mesh, clusters, crossings[p], p);
    if (cluster == none)
      return;
    clusters.of_point[p] = cluster;
    clusters.is_fin[p] = 1;
    ++fins;
    mesh.for_neighbours(p, [&](std::uint32_t n) {
      if (clusters.of_point[n] == none)
        again.push_back(n);
      return true;
    });
  };
  for (std::uint32_t p = 0; p < crossings.size(); ++p)
    examine(p);
  for (std::size_t n = 0; n < again.size(); ++n)
    examine(again[n]);
  return fins;
}

/// Collapses what can be collapsed among `members`; returns the edges between them that remain.
std::uint64_t collapse_cluster(CollapsingMesh& mesh, const std::vector<std::uint32_t>& cluster_of,
                               std::span<const std::uint32_t> members) {
  const std::uint32_t cluster = cluster_of[members.front()];
  std::uint64_t refused = 0;
  for (bool changed = members.size() > 1; changed;) {
    changed = false;
    refused = 0;
    for (const std::uint32_t p : members) {
      for (bool again = mesh.alive(p); again;) {
        again = false;
        std::uint32_t partner = none;
        std::uint64_t kept = 0;
        mesh.for_neighbours(p, [&](std::uint32_t q) {
          if (cluster_of[q] != cluster)
            return true;
          ++kept;
          if (!mesh.can_collapse(p, q))
            return true;
          partner = q;
          return false;
        });
        if (partner != none) {
          mesh.collapse(p, partner);
          changed = again = true;
        } else {
          refused += kept;
        }
      }
    }
  }
  return refused / 2; // seen from both ends
}

Lists members_of_clusters(const Clusters& clusters) {
  Lists lists{std::vector<std::uint32_t>(clusters.corner.size() + 2), {}};
  for (const std::uint32_t cluster : clusters.of_point)
    if (cluster != none)
      ++lists.first[cluster + 2];
  std::partial_sum(lists.first.begin(), lists.first.end(), lists.first.begin());
  lists.items.resize(lists.first.back());
  for (std::uint32_t p = 0; p < clusters.of_point.size(); ++p)
    if (clusters.of_point[p] != none)
      lists.items[lists.first[clusters.of_point[p] + 1]++] = p;
  return lists;
}

/// Index position of the points merged at p.
Vec3 merged_position(const IsoSurface& surface, const CollapsingMesh& mesh,
                     const Clusters& clusters, std::uint32_t p, SnapOptions::Place place) {
  const Vec3 own = index_position(surface.crossings[p]);
  if (clusters.of_point[p] == none)
    return own;
  bool only_fins = true;
  Vec3 sum;
  double count = 0;
  for (std::uint32_t member = p; member != none; member = mesh.next_member(member)) {
    only_fins = only_fins && clusters.is_fin[member] != 0;
    sum += index_position(surface.crossings[member]) - own;
    ++count;
  }
  if (place == SnapOptions::Place::mean || only_fins)
    return own + sum / count;
  const Int3& corner = clusters.corner[clusters.of_point[p]];
  return {static_cast<double>(corner[0]), static_cast<double>(corner[1]),
          static_cast<double>(corner[2])};
}

bool has_no_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, w = c - b;
  const double longest = std::max({dot(u, u), dot(v, v), dot(w, w)});
  return !(norm(cross(u, v)) > 1e-12 * longest);
}

} // namespace

SnapResult snap(const Context& context, const IsoSurface& surface, const SnapOptions& options) {
  if (!(options.epsilon >= 0 && options.epsilon <= 0.5))
    throw Error("epsilon must lie within 0 ... 0.5");
  const std::vector<EdgeCrossing>& crossings = surface.crossings;
  const double points = static_cast<double>(crossings.size()),
               triangles = static_cast<double>(surface.mesh.triangles.size());
  require_memory(context, points * (100 + 2 * sizeof(Vec3)) + triangles * 40, "snapping");

  SnapResult result;
  SnapReport& report = result.report;
  CollapsingMesh mesh(surface.mesh);
  Clusters clusters = make_clusters(crossings, options.epsilon);
  report.corners = clusters.corner.size();
  if (!clusters.corner.empty())
    report.fins = apply_fin_rule(mesh, crossings, clusters);
  const Lists members = members_of_clusters(clusters);
  for (std::size_t n = 0; n < clusters.corner.size(); ++n) {
    if (n % 65536 == 0 && context.cancelled && context.cancelled())
      throw Cancelled();
    report.refused += collapse_cluster(mesh, clusters.of_point, members[n]);
  }

  std::vector<std::uint32_t> number(crossings.size(), none);
  std::vector<Vec3> index_points;
  for (std::uint32_t p = 0; p < crossings.size(); ++p) {
    if (!mesh.alive(p))
      continue;
    number[p] = static_cast<std::uint32_t>(index_points.size());
    index_points.push_back(merged_position(surface, mesh, clusters, p, options.place));
    result.mesh.points.push_back(surface.transform.to_world(index_points.back()));
  }
  for (const Triangle& t : mesh.faces()) {
    if (t[0] == none)
      continue;
    const Triangle face{number[t[0]], number[t[1]], number[t[2]]};
    report.zero_area +=
        has_no_area(index_points[face[0]], index_points[face[1]], index_points[face[2]]) ? 1 : 0;
    result.mesh.triangles.push_back(face);
  }
  report.points_before = crossings.size();
  report.points_after = result.mesh.points.size();
  report.triangles_before = surface.mesh.triangles.size();
  report.triangles_after = result.mesh.triangles.size();
  return result;
}

} // namespace gewebe
