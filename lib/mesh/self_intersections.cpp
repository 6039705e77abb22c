#include "mesh/self_intersections.h"

#include "base/parallel.h"
#include "mesh/exact_predicates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
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

/// Of a point in the plane of the triangle: is it in it, its border included?
bool holds(const Corners& t, const Vec3& p, int axis) {
  const int a = turn(t[0], t[1], p, axis), b = turn(t[1], t[2], p, axis),
            c = turn(t[2], t[0], p, axis);
  return !((a > 0 || b > 0 || c > 0) && (a < 0 || b < 0 || c < 0));
}

/// Do two segments of one plane meet, ends included?
bool segments_meet(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, int axis) {
  const int ap = turn(p, q, a, axis), bp = turn(p, q, b, axis);
  const int pa = turn(a, b, p, axis), qa = turn(a, b, q, axis);
  if (ap * bp > 0 || pa * qa > 0)
    return false;
  if (ap != 0 || bp != 0 || pa != 0 || qa != 0)
    return true;
  // On one line: their boxes must meet.
  for (int c = 0; c < 3; ++c)
    if (std::fmax(p[c], q[c]) < std::fmin(a[c], b[c]) ||
        std::fmax(a[c], b[c]) < std::fmin(p[c], q[c]))
      return false;
  return true;
}

/// Does the segment meet the triangle, borders and ends included? \pre the triangle has area
bool segment_meets(const Corners& t, const Vec3& p, const Vec3& q) {
  const int of_p = side(t, p), of_q = side(t, q);
  if (of_p * of_q > 0)
    return false;
  if (of_p == 0 && of_q == 0) {
    const int axis = open_axis(t);
    return holds(t, p, axis) || holds(t, q, axis) || segments_meet(p, q, t[0], t[1], axis) ||
           segments_meet(p, q, t[1], t[2], axis) || segments_meet(p, q, t[2], t[0], axis);
  }
  const int a = side({p, q, t[0]}, t[1]), b = side({p, q, t[1]}, t[2]),
            c = side({p, q, t[2]}, t[0]);
  return !((a > 0 || b > 0 || c > 0) && (a < 0 || b < 0 || c < 0));
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

bool boxes_meet(const Box3& a, const Box3& b) {
  for (int n = 0; n < 3; ++n)
    if (a.max[n] < b.min[n] || b.max[n] < a.min[n])
      return false;
  return true;
}

/// A tree of boxes over faces: node n has the children 2n + 1 and 2n + 2, and a span of the order.
class BoxTree {
public:
  explicit BoxTree(std::vector<Box3> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    build(0, 0, order_.size());
  }

  /// Calls visit(g) for each face g > f whose box meets that of f.
  template <class Visit>
  void for_later(std::uint32_t f, const Visit& visit) const {
    descend(0, f, visit);
  }

private:
  struct Node {
    Box3 box;
    std::size_t begin = 0, end = 0;
    std::uint32_t last = 0; // largest face number
  };
  static constexpr std::size_t few = 4;

  void build(std::size_t n, std::size_t begin, std::size_t end) {
    if (nodes_.size() <= n)
      nodes_.resize(n + 1);
    Node node;
    node.begin = begin;
    node.end = end;
    for (std::size_t m = begin; m < end; ++m) {
      node.box.add(boxes_[order_[m]].min);
      node.box.add(boxes_[order_[m]].max);
      node.last = std::max(node.last, order_[m]);
    }
    nodes_[n] = node;
    if (end - begin <= few)
      return;
    const Vec3 size = node.box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto center = [&](std::uint32_t f) { return boxes_[f].min[axis] + boxes_[f].max[axis]; };
    std::nth_element(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                     order_.begin() + static_cast<std::ptrdiff_t>(middle),
                     order_.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](std::uint32_t a, std::uint32_t b) { return center(a) < center(b); });
    build(2 * n + 1, begin, middle);
    build(2 * n + 2, middle, end);
  }

  template <class Visit>
  void descend(std::size_t n, std::uint32_t f, const Visit& visit) const {
    const Node& node = nodes_[n];
    if (node.last <= f || !boxes_meet(node.box, boxes_[f]))
      return;
    if (node.end - node.begin > few) {
      descend(2 * n + 1, f, visit);
      descend(2 * n + 2, f, visit);
      return;
    }
    for (std::size_t m = node.begin; m < node.end; ++m)
      if (order_[m] > f && boxes_meet(boxes_[order_[m]], boxes_[f]))
        visit(order_[m]);
  }

  std::vector<Box3> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
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
  const BoxTree tree(std::move(boxes));
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
        tree.for_later(static_cast<std::uint32_t>(f), [&](std::uint32_t g) {
          if (degenerate[g] != 0)
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
