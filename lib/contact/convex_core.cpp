#include "contact/convex_core.h"

#include "base/error.h"
#include "mesh/edges.h"
#include "text/rounded_text.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

namespace gewebe::contact {

namespace {

constexpr std::size_t most_triangles = 20000; // each point is compared with each face
constexpr double flat = 1e-6;                 // of the size: so near to a plane is on it
constexpr double convex = 1e-5;
constexpr double thin = 1e-3;
constexpr double straight = 1e-9;
constexpr double rounding = 1e-12;

std::string text_of(const Vec3& p) {
  return text::rounded_text(p.x) + " " + text::rounded_text(p.y) + " " + text::rounded_text(p.z);
}

struct Plane {
  Vec3 normal;
  double offset = 0;
  double height(const Vec3& p) const { return dot(normal, p) - offset; }
};

/// The triangles of a mesh, outward, with their neighbours: what a core is made of.
class Triangles {
public:
  explicit Triangles(const TriangleMesh& mesh) : points_(mesh.points), all_(mesh.triangles) {
    if (all_.empty())
      throw Error("has no triangle, expected a closed convex surface");
    if (all_.size() > most_triangles)
      throw Error("has " + std::to_string(all_.size()) +
                  " triangles, expected at most 20000 of a convex surface");
    Box3 box;
    Vec3 sum;
    for (const Triangle& t : all_)
      for (const std::uint32_t corner : t) {
        box.add(points_[corner]);
        sum += points_[corner];
      }
    size_ = norm(box.size());
    turn_out(sum / (3 * static_cast<double>(all_.size())));
    edges_ = mesh::edge_table(all_, points_.size());
    require_closed();
    require_convex();
  }

  double size() const { return size_; }
  const std::vector<Vec3>& points() const { return points_; }

  /// Triangles that make one face each.
  std::vector<std::vector<std::uint32_t>> faces() const {
    std::vector<std::uint32_t> order(all_.size());
    for (std::uint32_t k = 0; k < order.size(); ++k)
      order[k] = k;
    std::ranges::stable_sort(order,
                             [&](std::uint32_t a, std::uint32_t b) { return area_[a] > area_[b]; });
    const std::vector<std::vector<std::uint32_t>> beside = neighbours();
    std::vector<bool> taken(all_.size());
    std::vector<std::vector<std::uint32_t>> found;
    for (const std::uint32_t seed : order) {
      if (taken[seed])
        continue;
      taken[seed] = true;
      std::vector<std::uint32_t> face{seed};
      for (std::size_t k = 0; k < face.size(); ++k)
        for (const std::uint32_t next : beside[face[k]])
          if (!taken[next] && in_plane(plane_[seed], next)) {
            taken[next] = true;
            face.push_back(next);
          }
      if (outline(face).empty()) // not one polygon: each for itself
        for (const std::uint32_t one : face)
          found.push_back({one});
      else
        found.push_back(std::move(face));
    }
    return found;
  }

  /// The polygon around them, counter-clockwise; empty if it isn't one.
  std::vector<std::uint32_t> outline(const std::vector<std::uint32_t>& face) const {
    std::map<std::uint32_t, std::uint32_t> next;
    std::map<std::pair<std::uint32_t, std::uint32_t>, bool> side;
    for (const std::uint32_t k : face)
      for (std::size_t c = 0; c < 3; ++c)
        side[{all_[k][c], all_[k][(c + 1) % 3]}] = true;
    for (const auto& [ends, there] : side)
      if (!side.contains({ends.second, ends.first}) && !next.insert(ends).second)
        return {};
    std::vector<std::uint32_t> loop;
    for (std::uint32_t at = next.begin()->first; loop.empty() || at != loop[0]; at = next.at(at))
      loop.push_back(at);
    return loop.size() == next.size() ? loop : std::vector<std::uint32_t>{};
  }

  /// By how much a point is beyond a face of this plane, where that isn't rounding.
  void require_behind(const Plane& plane, std::uint32_t triangle) const {
    for (const Triangle& t : all_)
      for (const std::uint32_t corner : t)
        if (const double height = plane.height(points_[corner]); !(height <= convex * size_))
          throw Error("is not convex: the point " + text_of(points_[corner]) + " is " +
                      text::rounded_text(height) + " mm beyond the plane of the triangle " +
                      std::to_string(triangle));
  }
  /// How deep it is behind a plane.
  double depth_behind(const Plane& plane) const {
    double deepest = 0;
    for (const Triangle& t : all_)
      for (const std::uint32_t corner : t)
        deepest = std::max(deepest, -plane.height(points_[corner]));
    return deepest;
  }

private:
  void turn_out(const Vec3& middle) {
    for (std::size_t k = 0; k < all_.size(); ++k) {
      Triangle& t = all_[k];
      Vec3 normal = cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]);
      const double twice = norm(normal);
      if (!(twice > rounding * size_ * size_))
        throw Error("the triangle " + std::to_string(k) + " has no area");
      normal = normal / twice;
      if (dot(normal, points_[t[0]] - middle) < 0) {
        std::swap(t[1], t[2]);
        normal = -normal;
      }
      plane_.push_back({normal, dot(normal, points_[t[0]])});
      area_.push_back(twice);
    }
  }
  std::string ends_of(std::size_t edge) const {
    const auto [a, b] = edges_.ends[edge];
    return "the edge from " + text_of(points_[a]) + " to " + text_of(points_[b]);
  }
  void require_closed() const {
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (const std::size_t count = edges_.around(e).size(); count != 2)
        throw Error(ends_of(e) + " has " + std::to_string(count) +
                    (count == 1 ? " triangle" : " triangles") +
                    ", expected two, of a closed surface");
  }
  void require_convex() const {
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      std::uint32_t one = edges_.around(e)[0], other = edges_.around(e)[1];
      if (area_[one / 3] < area_[other / 3]) // whose plane is known worse
        std::swap(one, other);
      const double height = plane_[one / 3].height(points_[all_[other / 3][other % 3]]);
      if (!(height <= convex * size_))
        throw Error("is not convex at " + ends_of(e) + ": one of its triangles is " +
                    text::rounded_text(height) + " mm beyond the other's plane");
    }
  }
  bool in_plane(const Plane& plane, std::uint32_t triangle) const {
    return dot(plane.normal, plane_[triangle].normal) > 0.9 &&
           std::ranges::all_of(all_[triangle], [&](std::uint32_t corner) {
             return std::abs(plane.height(points_[corner])) <= flat * size_;
           });
  }
  std::vector<std::vector<std::uint32_t>> neighbours() const {
    std::vector<std::vector<std::uint32_t>> beside(all_.size());
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const std::uint32_t one = edges_.around(e)[0] / 3, other = edges_.around(e)[1] / 3;
      beside[one].push_back(other);
      beside[other].push_back(one);
    }
    return beside;
  }

  std::vector<Vec3> points_;
  std::vector<Triangle> all_;
  std::vector<Plane> plane_;
  std::vector<double> area_; ///< twice
  mesh::EdgeTable edges_;
  double size_ = 0;
};

/// Normal of a polygon, as long as twice its area.
Vec3 area_of(const std::vector<std::uint32_t>& loop, const std::vector<Vec3>& points) {
  Vec3 sum;
  for (std::size_t k = 1; k + 1 < loop.size(); ++k)
    sum += cross(points[loop[k]] - points[loop[0]], points[loop[k + 1]] - points[loop[0]]);
  return sum;
}

bool inside_polygon(const ConvexCore::Face& face, std::span<const Vec3> corners, const Vec3& p) {
  for (std::size_t k = 0; k < face.corners.size(); ++k) {
    const Vec3 &a = corners[face.corners[k]],
               &b = corners[face.corners[(k + 1) % face.corners.size()]];
    if (dot(cross(face.normal, b - a), p - a) < 0)
      return false;
  }
  return true;
}

} // namespace

std::array<double, 2> weights_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double along = dot(p - a, ab), square = dot(ab, ab);
  if (!(along > 0))
    return {1, 0};
  if (!(along < square))
    return {0, 1};
  return {1 - along / square, along / square};
}

ConvexCore::ConvexCore(const TriangleMesh& mesh) {
  const Triangles triangles(mesh);
  const double size = triangles.size();
  const std::vector<Vec3>& points = triangles.points();
  std::vector<std::vector<std::uint32_t>> loops;
  double thickness = HUGE_VAL;
  for (const std::vector<std::uint32_t>& face : triangles.faces()) {
    std::vector<std::uint32_t> loop = triangles.outline(face);
    Vec3 normal = area_of(loop, points);
    normal = normal / norm(normal);
    Plane plane{normal, -HUGE_VAL};
    for (const std::uint32_t corner : loop)
      plane.offset = std::max(plane.offset, dot(normal, points[corner]));
    triangles.require_behind(plane, face[0]);
    thickness = std::min(thickness, triangles.depth_behind(plane));
    faces_.push_back({plane.normal, plane.offset, {}});
    loops.push_back(std::move(loop));
  }
  if (!(thickness >= thin * size))
    throw Error("is flat, " + text::rounded_text(thickness) +
                " mm thick, expected at least a thousandth of its size, " +
                text::rounded_text(size) + " mm");
  // Points between two faces on a straight edge are no corners.
  std::map<std::uint32_t, std::vector<std::array<std::uint32_t, 2>>> around; // neighbours by face
  for (const std::vector<std::uint32_t>& loop : loops)
    for (std::size_t k = 0; k < loop.size(); ++k)
      around[loop[k]].push_back(
          {loop[(k + loop.size() - 1) % loop.size()], loop[(k + 1) % loop.size()]});
  std::map<std::uint32_t, std::uint32_t> number;
  for (const auto& [point, sides] : around) {
    if (sides.size() == 2) {
      const Vec3 &a = points[sides[0][0]], &b = points[sides[0][1]], &p = points[point];
      if (norm(cross(p - a, b - a)) <= straight * size * norm(b - a))
        continue;
    }
    number[point] = static_cast<std::uint32_t>(corners_.size());
    corners_.push_back(points[point]);
  }
  faces_at_.resize(corners_.size());
  std::map<std::array<std::uint32_t, 2>, std::vector<std::uint32_t>> sides;
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    std::vector<std::uint32_t>& own = faces_[f].corners;
    for (const std::uint32_t point : loops[f])
      if (const auto there = number.find(point); there != number.end())
        own.push_back(there->second);
    for (std::size_t k = 0; k < own.size(); ++k) {
      const std::uint32_t a = own[k], b = own[(k + 1) % own.size()];
      sides[{std::min(a, b), std::max(a, b)}].push_back(f);
      faces_at_[a].push_back(f);
    }
  }
  for (const auto& [ends, both] : sides) {
    if (both.size() != 2 || ends[0] == ends[1])
      throw Error("has faces that no edge joins, expected a convex surface without slivers");
    const std::vector<std::uint32_t>& loop = faces_[both[0]].corners;
    const auto at = std::ranges::find(loop, ends[0]);
    const bool forward = (at + 1 == loop.end() ? loop.front() : *(at + 1)) == ends[1];
    edges_.push_back({ends[0], ends[1], both[forward ? 0 : 1], both[forward ? 1 : 0]});
  }
  for (const Vec3& p : corners_) {
    box_.add(p);
    reach_ = std::max(reach_, norm(p));
  }
}

ConvexCore::Nearest ConvexCore::nearest(const Vec3& p) const {
  double highest = -HUGE_VAL;
  const Face* top = faces_.data();
  for (const Face& f : faces_)
    if (const double height = dot(f.normal, p) - f.offset; height > highest) {
      highest = height;
      top = &f;
    }
  Nearest found{p - highest * top->normal, top->normal, highest};
  if (!(highest > 0) || inside_polygon(*top, corners_, found.point))
    return found;
  double best = HUGE_VAL;
  for (const Face& f : faces_) {
    const double height = dot(f.normal, p) - f.offset;
    if (!(height > 0) || !(height < best)) // it faces away, or is farther
      continue;
    if (const Vec3 foot = p - height * f.normal; inside_polygon(f, corners_, foot)) {
      best = height;
      found = {foot, f.normal, height};
      continue;
    }
    for (std::size_t k = 0; k < f.corners.size(); ++k) {
      const Vec3 &a = corners_[f.corners[k]], &b = corners_[f.corners[(k + 1) % f.corners.size()]];
      const auto [wa, wb] = weights_on_segment(p, a, b);
      const Vec3 point = wa * a + wb * b, way = p - point;
      const double distance = norm(way);
      if (distance < best) {
        best = distance;
        found = {point, distance > rounding * size() ? way / distance : f.normal, distance};
      }
    }
  }
  return found;
}

} // namespace gewebe::contact
