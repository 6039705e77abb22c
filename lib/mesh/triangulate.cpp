#include "mesh/triangulate.h"

#include "base/error.h"

#include <string>
// Based on: Meisters, Polygons have ears, 1975.
// Based on: Sutherland, Sproull, Schumacker, A characterization of ten hidden-surface algorithms
// (Newell's normal), 1974.

namespace gewebe::mesh {
namespace {

struct Point2 {
  double u, v;
  bool operator==(const Point2&) const = default;
};

// Twice the signed area of a, b, c.
double orientation(const Point2& a, const Point2& b, const Point2& c) {
  return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
}

// The polygon in the coordinate plane where its area is largest, counter-clockwise.
std::vector<Point2> project(std::span<const Vec3> polygon) {
  Vec3 normal;
  const Vec3 origin = polygon[0];
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    normal += cross(polygon[i] - origin, polygon[i + 1] - origin);
  int axis = 0;
  for (int a = 1; a < 3; ++a)
    if (std::fabs(normal[a]) > std::fabs(normal[axis]))
      axis = a;
  int u = (axis + 1) % 3;
  int v = (axis + 2) % 3;
  if (normal[axis] < 0)
    std::swap(u, v);
  std::vector<Point2> flat;
  flat.reserve(polygon.size());
  for (const Vec3& p : polygon)
    flat.push_back({p[u], p[v]});
  return flat;
}

class EarClipper {
public:
  explicit EarClipper(std::vector<Point2> flat) : flat_(std::move(flat)) {
    const std::uint32_t n = static_cast<std::uint32_t>(flat_.size());
    next_.resize(n);
    previous_.resize(n);
    convex_.resize(n);
    ear_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      next_[i] = i + 1 == n ? 0 : i + 1;
      previous_[i] = i == 0 ? n - 1 : i - 1;
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      convex_[i] = turn(i) > 0;
      if (!convex_[i])
        blockers_.push_back(i);
    }
  }

  bool strictly_convex() const { return blockers_.empty(); }

  void clip(std::vector<Triangle>& out) {
    const std::uint32_t n = static_cast<std::uint32_t>(flat_.size());
    for (std::uint32_t i = 0; i < n; ++i)
      ear_[i] = is_ear(i);
    std::uint32_t at = 0;
    for (std::uint32_t left = n; left > 3; --left) {
      const std::uint32_t cut = find_ear(at, left);
      const std::uint32_t before = previous_[cut];
      const std::uint32_t after = next_[cut];
      out.push_back({before, cut, after});
      next_[before] = after;
      previous_[after] = before;
      if (!convex_[cut])
        std::erase(blockers_, cut);
      for (const std::uint32_t i : {before, after})
        if (!convex_[i] && turn(i) > 0) {
          convex_[i] = true;
          std::erase(blockers_, i);
        }
      for (const std::uint32_t i : {before, after})
        ear_[i] = is_ear(i);
      // Going on behind the neighbour spreads the cuts instead of making a fan of slivers.
      at = next_[after];
    }
    out.push_back({previous_[at], at, next_[at]});
  }

private:
  double turn(std::uint32_t i) const {
    return orientation(flat_[previous_[i]], flat_[i], flat_[next_[i]]);
  }

  bool is_ear(std::uint32_t i) const {
    if (!(turn(i) > 0))
      return false;
    const Point2 a = flat_[previous_[i]], b = flat_[i], c = flat_[next_[i]];
    for (const std::uint32_t k : blockers_) {
      const Point2& p = flat_[k];
      if (p == a || p == b || p == c)
        continue; // also a bridge to a hole, which passes twice
      if (orientation(a, b, p) >= 0 && orientation(b, c, p) >= 0 && orientation(c, a, p) >= 0)
        return false;
    }
    return true;
  }

  // The next ear; without one (no area, crossing itself) a corner without area, else just the next.
  std::uint32_t find_ear(std::uint32_t at, std::uint32_t left) const {
    std::uint32_t i = at;
    for (std::uint32_t k = 0; k < left; ++k, i = next_[i])
      if (ear_[i])
        return i;
    for (std::uint32_t k = 0; k < left; ++k, i = next_[i])
      if (turn(i) == 0)
        return i;
    return at;
  }

  std::vector<Point2> flat_;
  std::vector<std::uint32_t> next_, previous_;
  std::vector<char> convex_, ear_;
  std::vector<std::uint32_t> blockers_; // corners that can lie in another corner's ear
};

} // namespace

void triangulate_polygon(std::span<const Vec3> polygon, std::vector<Triangle>& out) {
  const std::size_t n = polygon.size();
  if (n > max_polygon_corners)
    throw Error("a polygon with " + std::to_string(n) + " corners, expected at most " +
                std::to_string(max_polygon_corners));
  if (n == 3) {
    out.push_back({0, 1, 2});
    return;
  }
  EarClipper clipper(project(polygon));
  if (clipper.strictly_convex()) {
    for (std::uint32_t i = 1; i + 1 < n; ++i)
      out.push_back({0, i, i + 1});
    return;
  }
  clipper.clip(out);
}

} // namespace gewebe::mesh
