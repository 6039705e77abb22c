#include "base/error.h"
#include "geometry/exact_predicates.h"
#include "incision/cut_blade_internal.h"
#include "mesh/edges.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

namespace gewebe::incision {
namespace {

std::string edge_name(std::uint32_t a, std::uint32_t b) {
  return "the blade's edge from point " + std::to_string(a) + " to " + std::to_string(b);
}

/// Sign of the component of (b - a) x (c - a) along an axis.
int normal_sign(const Vec3& a, const Vec3& b, const Vec3& c, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::uint64_t exact = 0;
  return turn_sign(a[u], a[v], b[u], b[v], c[u], c[v], exact);
}

/// On which side of the plane through a, b, c a point lies after a step (1, e, e²) e, e -> 0; 0
/// only if they lie on a line.
int side_after_step(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  std::uint64_t exact = 0;
  int sign = side_sign(a, b, c, p, exact);
  for (int axis = 0; sign == 0 && axis < 3; ++axis)
    sign = normal_sign(a, b, c, axis);
  return sign;
}

/// Sign of (q - p) . ((a - p) x (b - p)) after the step of p and q, if it is 0 before: that of the
/// step times (q - p) x (b - a). It is right if the line through p and q meets the edge from a to
/// b, and is not parallel to it. Else it is at least the same for all callers.
int turn_after_step(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b) {
  for (int axis = 0; axis < 3; ++axis) {
    // Their difference is meant: of equal signs it is not known, but the edge isn't met then.
    const int at_a = normal_sign(p, q, a, axis), at_b = normal_sign(p, q, b, axis);
    if (at_a != 0 || at_b != 0)
      return at_b != 0 ? at_b : -at_a;
  }
  return 1;
}

Vec3 predicate_point(const Vec3& p) {
  return {predicate_coordinate(p.x), predicate_coordinate(p.y), predicate_coordinate(p.z)};
}

} // namespace

Blade::Blade(const TriangleMesh& surface) {
  check_mesh(surface);
  for (const Vec3& p : surface.points) {
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::fabs(p[axis]) <= predicate_largest))
        throw Error("a point of the blade is farther away than 2^40 mm");
    points_.push_back(predicate_point(p));
  }
  for (const Triangle& corners : surface.triangles) {
    Leaf leaf{corners, {}};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = corners[k], b = corners[(k + 1) % 3];
      leaf.sides[k] = {std::min(a, b), std::max(a, b), a > b, false};
    }
    leaves_.push_back(leaf);
  }
  mesh::EdgeSides(points_.size(), surface.triangles)
      .for_each_edge([&](std::uint32_t low, std::span<const mesh::EdgeSide> sides) {
        const std::uint32_t high = sides.front().high();
        if (sides.size() > 2)
          throw Error(edge_name(low, high) + " has " + std::to_string(sides.size()) +
                      " triangles, expected one or two");
        if (sides.size() == 2 && mesh::surplus(sides) != 0)
          throw Error(edge_name(low, high) +
                      " has two triangles that run along it the same way, expected one sheet with "
                      "one upper side");
        if (sides.size() == 1)
          for (Side& side : leaves_[sides.front().face()].sides)
            side.border = side.border || (side.low == low && side.high == high);
      });
  std::vector<Box3> boxes(leaves_.size());
  for (std::size_t n = 0; n < leaves_.size(); ++n)
    for (const std::uint32_t corner : leaves_[n].corners)
      boxes[n].add(points_[corner]);
  tree_ = collision::Bvh(boxes);
}

bool Blade::meets(const Box3& box) const {
  return tree_.any_overlapping(box, [](std::uint32_t) { return true; });
}

/// Triangles of a sheet are passed once where they meet, for ties are broken as if all that is cut
/// were a step beside its place: small along x, smaller along y, smallest along z. Through a border
/// is within.
std::optional<Blade::Pass> Blade::pass(const Leaf& leaf, const Vec3& p, const Vec3& q) const {
  const Vec3 &a = points_[leaf.corners[0]], &b = points_[leaf.corners[1]],
             &c = points_[leaf.corners[2]];
  const int at_p_side = side_after_step(a, b, c, p), direction = side_after_step(a, b, c, q);
  if (at_p_side * direction >= 0) // 0 of a triangle without area
    return std::nullopt;
  for (const Side& side : leaf.sides) {
    const Vec3 &low = points_[side.low], &high = points_[side.high];
    std::uint64_t exact = 0;
    int turn = side_sign(p, q, low, high, exact);
    if (turn == 0 && side.border)
      continue;
    if (turn == 0)
      turn = turn_after_step(p, q, low, high);
    if (turn * (side.backward ? -1 : 1) != direction)
      return std::nullopt;
  }
  const Vec3 normal = cross(b - a, c - a);
  const double at_p = dot(normal, p - a), at_q = dot(normal, q - a);
  const double share = at_p / (at_p - at_q);
  // Both distances can be lost in rounding, when any place is as good.
  return Pass{share >= 0 && share <= 1 ? share : share > 1 ? 1 : 0, direction};
}

BladeCrossing Blade::crossing(const Vec3& from, const Vec3& to) const {
  const Vec3 p = predicate_point(from), q = predicate_point(to);
  Box3 box;
  box.add(p);
  box.add(q);
  std::vector<Pass> passes;
  BladeCrossing crossing;
  tree_.for_each_overlapping(box, [&](std::uint32_t leaf) {
    if (const std::optional<Pass> found = pass(leaves_[leaf], p, q)) {
      passes.push_back(*found);
      crossing.direction += found->direction;
    }
  });
  crossing.passes = passes.size();
  if (passes.empty())
    return crossing;
  std::ranges::sort(passes, {}, &Pass::share);
  crossing.share = passes[passes.size() / 2].share;
  return crossing;
}

} // namespace gewebe::incision
