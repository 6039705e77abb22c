#include "mesh/self_intersections.h"

#include "base/exact_predicates.h"
#include "base/parallel.h"
#include "collision/bvh.h"
#include "collision/edge_triangle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gewebe {
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

class Tester {
public:
  explicit Tester(const TriangleMesh& mesh) : mesh_(mesh), points_(mesh.points) {
    // To a magnitude that the predicates take; a power of two changes no digit.
    double largest = 0;
    for (const Vec3& p : points_)
      largest =
          std::fmax(largest, std::fmax(std::fabs(p.x), std::fmax(std::fabs(p.y), std::fabs(p.z))));
    int exponent = 0;
    std::frexp(largest, &exponent);
    for (Vec3& p : points_)
      for (int a = 0; a < 3; ++a)
        p[a] = predicate_coordinate(std::ldexp(p[a], -exponent));
  }

  const std::vector<Vec3>& points() const { return points_; }
  bool degenerate(std::size_t face) const { return open_axis(corners(face)) < 0; }

  /// \pre neither is degenerate
  bool meet(std::size_t f, std::size_t g) const {
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

private:
  Corners corners(std::size_t face) const {
    const Triangle& t = mesh_.triangles[face];
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }
  const TriangleMesh& mesh_;
  std::vector<Vec3> points_;
};

} // namespace

SelfIntersections self_intersections(const Context& context, const TriangleMesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  require_memory(context,
                 static_cast<double>(count) * 200 +
                     static_cast<double>(mesh.points.size()) * sizeof(Vec3),
                 "the search for self-intersections");
  SelfIntersections result;
  if (count == 0)
    return result;
  const Tester tester(mesh);
  std::vector<Box3> boxes(count);
  std::vector<std::uint8_t> degenerate(count);
  for (std::size_t f = 0; f < count; ++f) {
    for (const std::uint32_t p : mesh.triangles[f])
      boxes[f].add(tester.points()[p]);
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

} // namespace gewebe
