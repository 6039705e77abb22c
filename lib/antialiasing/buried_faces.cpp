#include "antialiasing/buried_faces_internal.h"

#include "base/disjoint_sets.h"
#include "geometry/exact_predicates.h"
#include "mesh/edges.h"
#include "mesh/nearest_point.h"
#include "repair/oriented_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gewebe::antialiasing {
namespace {

/// Faces closer than this touch, in voxels; and how far from a face its two sides are judged.
constexpr double touching = 0.002;

struct NearFace {
  double squared = 0; ///< distance from p
  std::uint32_t triangle = 0;
  Vec3 nearest, normal; ///< unit normal, outward; zero if the face has no area
  Box3 box;
};

int sign_or(int sign, int otherwise) {
  return sign != 0 ? sign : otherwise;
}

/// What is added to the winding number along the segment from p to x by triangle t. Segments
/// through a common edge or corner of triangles meet one of them.
int crossing(std::span<const Vec3> points, const Triangle& t, const Vec3& p, const Vec3& x) {
  std::uint64_t exact_tests = 0;
  const Vec3 &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
  const int from = sign_or(side_sign(a, b, c, p, exact_tests), 1);
  if (from == sign_or(side_sign(a, b, c, x, exact_tests), 1))
    return 0;
  int turns = 0;
  for (std::size_t n = 0; n < 3; ++n) {
    const std::uint32_t u = t[n], v = t[(n + 1) % 3];
    turns += sign_or(side_sign(p, x, points[u], points[v], exact_tests), u < v ? 1 : -1);
  }
  return std::abs(turns) == 3 ? from : 0;
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b, Vec3& nearest) {
  const Vec3 edge = b - a;
  const double length2 = dot(edge, edge);
  nearest = a + edge * (length2 > 0 ? std::clamp(dot(p - a, edge) / length2, 0.0, 1.0) : 0);
  return norm(p - nearest);
}

/// Searches for the boundary about one point.
class BoundarySearch {
public:
  BoundarySearch(std::span<const Vec3> points, const OrientedFaces& faces, const Vec3& p,
                 int winding, std::span<const std::uint32_t> near, double reach)
      : points_(points), faces_(faces), p_(p),
        // Moved as the scan moves its samples, so that p lies on no face.
        start_(p + Vec3{4e-7, 2e-7, 1e-7}), winding_(winding), reach_(reach) {
    for (const std::uint32_t n : near)
      add(n);
    std::ranges::sort(near_, [](const NearFace& a, const NearFace& b) {
      return a.squared != b.squared ? a.squared < b.squared : a.triangle < b.triangle;
    });
  }

  std::optional<BoundaryPoint> find() {
    if (near_.empty())
      return std::nullopt;
    if (at_boundary(near_[0]))
      return BoundaryPoint{near_[0].nearest, near_[0].triangle, OrientedFaces::none};
    find_pairs();
    std::optional<BoundaryPoint> best;
    double squared = reach_ * reach_;
    const std::vector<std::uint32_t> cluster = clusters();
    std::vector<std::int8_t> known(near_.size(), -1); // of clusters
    for (std::size_t n = 0; n < near_.size(); ++n) {
      if (!(near_[n].squared < squared))
        break;
      if (near_[n].normal == Vec3{})
        continue; // its neighbours have the same nearest point
      std::int8_t& state = known[cluster[n]];
      if (state < 0)
        state = at_boundary(near_[n]) ? 1 : 0;
      if (state == 1) {
        best = {near_[n].nearest, near_[n].triangle, OrientedFaces::none};
        squared = near_[n].squared;
      }
    }
    for (const auto& [a, b] : pairs_)
      if (near_[a].squared < squared && near_[b].squared < squared)
        try_curve(near_[a], near_[b], best, squared);
    return best;
  }

private:
  void add(std::uint32_t n) {
    if (faces_.patch[n] == OrientedFaces::none)
      return;
    const Triangle& t = faces_.triangles[n];
    const Vec3 &a = points_[t[0]], &b = points_[t[1]], &c = points_[t[2]];
    NearFace face;
    for (const Vec3& corner : {a, b, c})
      face.box.add(corner);
    for (int axis = 0; axis < 3; ++axis)
      if (face.box.min[axis] > p_[axis] + reach_ || face.box.max[axis] < p_[axis] - reach_)
        return;
    face.nearest = mesh::nearest_on_triangle(p_, a, b, c).point;
    face.squared = dot(p_ - face.nearest, p_ - face.nearest);
    if (!(face.squared < reach_ * reach_))
      return;
    face.triangle = n;
    face.normal = cross(b - a, c - a);
    const double length = norm(face.normal);
    face.normal = length > 1e-9 * norm(b - a) * norm(c - a) ? face.normal / length : Vec3{};
    near_.push_back(face);
  }

  /// Winding number at x, at most about `reach` from p.
  int winding_at(const Vec3& x) const {
    const double length = norm(x - start_) + 1e-6;
    int winding = winding_;
    for (const NearFace& face : near_) {
      if (face.squared > length * length)
        break;
      winding += crossing(points_, faces_.triangles[face.triangle], start_, x);
    }
    return winding;
  }

  /// Does a side of the face have winding number 0 at its nearest point?
  bool at_boundary(const NearFace& face) const {
    if (face.normal == Vec3{})
      return false;
    const Triangle& t = faces_.triangles[face.triangle];
    // A little off its edges.
    const Vec3 middle = (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3 - face.nearest;
    const double far = norm(middle);
    const Vec3 at = face.nearest + middle * (far > 0 ? std::fmin(0.5, 2 * touching / far) : 0);
    return winding_at(at + touching * face.normal) == 0 ||
           winding_at(at - touching * face.normal) == 0;
  }

  bool share_a_point(const Triangle& a, const Triangle& b) const {
    return std::ranges::any_of(
        a, [&](std::uint32_t corner) { return std::ranges::find(b, corner) != b.end(); });
  }
  /// Do all corners of b lie on one side of the plane of a, and off it?
  bool is_beside(const NearFace& a, const NearFace& b) const {
    const Vec3& origin = points_[faces_.triangles[a.triangle][0]];
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const std::uint32_t corner : faces_.triangles[b.triangle]) {
      const double height = dot(a.normal, points_[corner] - origin);
      low = std::fmin(low, height);
      high = std::fmax(high, height);
    }
    return low > touching || high < -touching;
  }

  /// Pairs of near faces that may meet, those that share a point left out.
  void find_pairs() {
    touched_.assign(near_.size(), false);
    std::vector<std::uint32_t> order(near_.size());
    for (std::uint32_t n = 0; n < order.size(); ++n)
      order[n] = n;
    std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
      return near_[a].box.min.x != near_[b].box.min.x ? near_[a].box.min.x < near_[b].box.min.x
                                                      : a < b;
    });
    for (std::size_t n = 0; n < order.size(); ++n) {
      const NearFace& a = near_[order[n]];
      for (std::size_t m = n + 1; m < order.size(); ++m) {
        const NearFace& b = near_[order[m]];
        if (b.box.min.x > a.box.max.x + touching)
          break;
        if (b.box.min.y > a.box.max.y + touching || a.box.min.y > b.box.max.y + touching ||
            b.box.min.z > a.box.max.z + touching || a.box.min.z > b.box.max.z + touching ||
            share_a_point(faces_.triangles[a.triangle], faces_.triangles[b.triangle]) ||
            is_beside(a, b) || is_beside(b, a))
          continue;
        touched_[order[n]] = touched_[order[m]] = true;
        pairs_.push_back({std::min(order[n], order[m]), std::max(order[n], order[m])});
      }
    }
    std::ranges::sort(pairs_);
  }

  /// Near faces that no other touches, connected by edges within reach: all of them are at the
  /// boundary or none is. A face that another touches stands alone.
  std::vector<std::uint32_t> clusters() const {
    struct Side {
      std::uint32_t low, high, face;
      auto operator<=>(const Side&) const = default;
    };
    std::vector<Side> sides;
    for (std::uint32_t n = 0; n < near_.size(); ++n) {
      const Triangle& t = faces_.triangles[near_[n].triangle];
      for (std::size_t c = 0; c < 3; ++c) {
        const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
        sides.push_back({low, high, n});
      }
    }
    std::ranges::sort(sides);
    DisjointSets sets(near_.size());
    for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
      while (end < sides.size() && sides[end].low == sides[begin].low &&
             sides[end].high == sides[begin].high)
        ++end;
      Vec3 ignored;
      if (end - begin == 2 && !touched_[sides[begin].face] && !touched_[sides[begin + 1].face] &&
          distance_to_segment(p_, points_[sides[begin].low], points_[sides[begin].high], ignored) <
              reach_)
        sets.join(sides[begin].face, sides[begin + 1].face);
    }
    std::vector<std::uint32_t> cluster;
    sets.number(cluster);
    return cluster;
  }

  /// Ends of the segment in which two faces pass through each other.
  std::optional<std::array<Vec3, 2>> segment(const NearFace& a, const NearFace& b) const {
    std::vector<Vec3> ends;
    const auto add_ends = [&](const NearFace& edges, const NearFace& face) {
      const Triangle &e = faces_.triangles[edges.triangle], &f = faces_.triangles[face.triangle];
      for (std::size_t n = 0; n < 3; ++n) {
        const Vec3 &u = points_[e[n]], &v = points_[e[(n + 1) % 3]], &origin = points_[f[0]];
        const double from = dot(face.normal, u - origin), to = dot(face.normal, v - origin);
        if (!((from <= 0 && to > 0) || (from > 0 && to <= 0)))
          continue;
        const Vec3 x = u + (v - u) * (from / (from - to));
        bool within = true;
        for (std::size_t c = 0; within && c < 3; ++c) {
          const Vec3 &s = points_[f[c]], &d = points_[f[(c + 1) % 3]];
          within = dot(cross(d - s, x - s), face.normal) >= -1e-9;
        }
        if (within)
          ends.push_back(x);
      }
    };
    add_ends(a, b);
    add_ends(b, a);
    std::optional<std::array<Vec3, 2>> longest;
    for (std::size_t n = 0; n < ends.size(); ++n)
      for (std::size_t m = n; m < ends.size(); ++m)
        if (!longest || norm(ends[m] - ends[n]) > norm((*longest)[1] - (*longest)[0]))
          longest = {ends[n], ends[m]};
    return longest;
  }

  /// Offers the curve in which two faces meet, where a quadrant about it has winding number 0.
  void try_curve(const NearFace& a, const NearFace& b, std::optional<BoundaryPoint>& best,
                 double& squared) const {
    if (a.normal == Vec3{} || b.normal == Vec3{})
      return;
    const auto ends = segment(a, b);
    if (!ends)
      return;
    Vec3 nearest;
    const double distance = distance_to_segment(p_, (*ends)[0], (*ends)[1], nearest);
    if (!(distance * distance < squared))
      return;
    for (const double s : {touching, -touching})
      for (const double t : {touching, -touching})
        if (winding_at(nearest + s * a.normal + t * b.normal) == 0) {
          best = {nearest, a.triangle, b.triangle};
          squared = distance * distance;
          return;
        }
  }

  std::span<const Vec3> points_;
  const OrientedFaces& faces_;
  Vec3 p_, start_;
  int winding_;
  double reach_;
  std::vector<NearFace> near_; ///< ascending by distance
  std::vector<std::array<std::uint32_t, 2>> pairs_;
  std::vector<bool> touched_;
};

} // namespace

OrientedFaces orient_faces(std::span<const Vec3> points, std::span<const Triangle> triangles,
                           std::span<const std::int32_t> part) {
  const repair::OrientedSurface surface = repair::orient_surface(points, triangles, part);
  DisjointSets patches(surface.triangles.size());
  mesh::EdgeSides(points.size(), surface.triangles)
      .for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
        if (edge.size() == 2)
          patches.join(edge[0].face(), edge[1].face());
      });
  OrientedFaces faces;
  faces.triangles.assign(triangles.begin(), triangles.end());
  faces.patch.assign(triangles.size(), OrientedFaces::none);
  for (std::uint32_t n = 0; n < surface.triangles.size(); ++n) {
    faces.triangles[surface.source[n]] = surface.triangles[n];
    faces.patch[surface.source[n]] = patches.find(n);
  }
  return faces;
}

std::optional<BoundaryPoint> nearest_boundary(std::span<const Vec3> points,
                                              const OrientedFaces& faces, const Vec3& p,
                                              int winding, std::span<const std::uint32_t> near,
                                              double reach) {
  return BoundarySearch(points, faces, p, winding, near, reach).find();
}

} // namespace gewebe::antialiasing
