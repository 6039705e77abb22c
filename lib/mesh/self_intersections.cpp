#include "mesh/self_intersections.h"

#include "base/parallel.h"
#include "collision/bvh.h"
#include "collision/edge_triangle.h"
#include "geometry/exact_predicates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gewebe::mesh {
namespace {

using Corners = std::array<Vec3, 3>;

int side(const Corners& t, const Vec3& p) {
  std::uint64_t exact = 0;
  return side_sign(t[0], t[1], t[2], p, exact);
}

/// Turn of a, b, c seen along an axis.
int turn(const Vec3& a, const Vec3& b, const Vec3& c, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::uint64_t exact = 0;
  return turn_sign(a[u], a[v], b[u], b[v], c[u], c[v], exact);
}

/// An axis along which the triangle is seen with area, or -1.
int open_axis(const Corners& t) {
  for (int axis = 0; axis < 3; ++axis)
    if (turn(t[0], t[1], t[2], axis) != 0)
      return axis;
  return -1;
}

/// Does the segment meet the triangle, borders and ends included? \pre the triangle has area
bool segment_meets(const Corners& t, const Vec3& p, const Vec3& q) {
  return collision::edge_meets_triangle(p, q, t[0], t[1], t[2]);
}

/// Do all corners of b but one lie on one side of a's plane? \param but  or 3
bool lies_apart(const Corners& a, const Corners& b, std::size_t but) {
  int sides = 0, count = 0;
  for (std::size_t n = 0; n < 3; ++n)
    if (n != but) {
      const int s = side(a, b[n]);
      if (s == 0)
        return false;
      sides += s;
      ++count;
    }
  return sides == count || sides == -count;
}

} // namespace

FaceIntersections::FaceIntersections(const TriangleMesh& mesh) : mesh_(mesh) {
  // To a magnitude that the predicates take; a power of two changes no digit.
  double largest = 0;
  for (const Vec3& p : mesh.points)
    largest =
        std::fmax(largest, std::fmax(std::fabs(p.x), std::fmax(std::fabs(p.y), std::fabs(p.z))));
  int exponent = 0;
  std::frexp(largest, &exponent);
  scale_ = std::ldexp(1.0, -std::max(exponent, -1000));
}

std::array<Vec3, 3> FaceIntersections::corners(std::size_t face) const {
  Corners corners;
  for (std::size_t n = 0; n < 3; ++n)
    for (int a = 0; a < 3; ++a)
      corners[n][a] = predicate_coordinate(mesh_.points[mesh_.triangles[face][n]][a] * scale_);
  return corners;
}

bool FaceIntersections::degenerate(std::size_t face) const {
  return open_axis(corners(face)) < 0;
}

bool FaceIntersections::meet(std::size_t f, std::size_t g) const {
  const Triangle &s = mesh_.triangles[f], &t = mesh_.triangles[g];
  std::array<std::size_t, 3> in_s{}, in_t{};
  std::size_t shared = 0;
  for (std::size_t n = 0; n < 3; ++n)
    for (std::size_t m = 0; m < 3; ++m)
      if (s[n] == t[m]) {
        in_s[shared] = n;
        in_t[shared++] = m;
      }
  const Corners a = corners(f), b = corners(g);
  if (shared == 3)
    return true;
  if (shared == 2) {
    // A fold: coplanar, and both third corners on one side of the edge.
    const Vec3 &p = a[in_s[0]], &q = a[in_s[1]];
    const Vec3 &c = a[3 - in_s[0] - in_s[1]], &d = b[3 - in_t[0] - in_t[1]];
    if (side(a, d) != 0)
      return false;
    const int axis = open_axis(a);
    return turn(p, q, c, axis) == turn(p, q, d, axis);
  }
  if (lies_apart(a, b, shared == 1 ? in_t[0] : 3) || lies_apart(b, a, shared == 1 ? in_s[0] : 3))
    return false;
  if (shared == 1) {
    const std::size_t n = in_s[0], m = in_t[0];
    return segment_meets(b, a[(n + 1) % 3], a[(n + 2) % 3]) ||
           segment_meets(a, b[(m + 1) % 3], b[(m + 2) % 3]);
  }
  for (std::size_t n = 0; n < 3; ++n)
    if (segment_meets(b, a[n], a[(n + 1) % 3]) || segment_meets(a, b[n], b[(n + 1) % 3]))
      return true;
  return false;
}

SelfIntersections self_intersections(const Context& context, const TriangleMesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  require_memory(context, static_cast<double>(count) * 200, "the search for self-intersections");
  SelfIntersections result;
  if (count == 0)
    return result;
  const FaceIntersections tester(mesh);
  std::vector<Box3> boxes(count);
  std::vector<std::uint8_t> degenerate(count);
  for (std::size_t f = 0; f < count; ++f) {
    for (const std::uint32_t p : mesh.triangles[f])
      boxes[f].add(mesh.points[p]);
    degenerate[f] = tester.degenerate(f) ? 1 : 0;
    result.degenerate_faces += degenerate[f];
  }
  const collision::Bvh tree(boxes);
  constexpr std::size_t grain = 2048;
  struct Block {
    std::uint64_t tested = 0;
    std::vector<std::array<std::uint32_t, 2>> pairs;
  };
  std::vector<Block> blocks((count + grain - 1) / grain);
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    Block& block = blocks[begin / grain];
    for (std::size_t f = begin; f < end; ++f)
      if (degenerate[f] == 0)
        tree.for_each_overlapping(boxes[f], [&](std::uint32_t g) {
          if (g <= f || degenerate[g] != 0)
            return;
          ++block.tested;
          if (tester.meet(f, g))
            block.pairs.push_back({static_cast<std::uint32_t>(f), g});
        });
  });
  std::vector<std::uint8_t> involved(count, 0);
  for (const Block& block : blocks) {
    result.pairs_tested += block.tested;
    result.pairs += block.pairs.size();
    for (const auto& [f, g] : block.pairs)
      involved[f] = involved[g] = 1;
  }
  for (std::size_t f = 0; f < count; ++f)
    if (involved[f] != 0)
      result.faces.push_back(static_cast<std::uint32_t>(f));
  return result;
}

} // namespace gewebe::mesh
