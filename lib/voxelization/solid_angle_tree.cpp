#include "voxelization/solid_angle_tree_internal.h"
// Based on: A. Jacobson, L. Kavan, O. Sorkine-Hornung, Robust Inside-Outside Segmentation using
// Generalized Winding Numbers, 2013; G. Barill et al., Fast Winding Numbers for Soups and Clouds,
// 2018; A. van Oosterom, J. Strackee, The Solid Angle of a Plane Triangle, 1983.

#include "geometry/exact_predicates.h"
#include "mesh/edges.h"

#include <algorithm>
#include <cstdlib>

namespace gewebe::voxelization {
namespace {

constexpr double pi = 3.14159265358979323846;

/// Twice the area, along the normal.
Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  return cross(b - a, c - a);
}

/// Sign of the solid angle of a, b, c from p: 1 if p, moved, lies behind the triangle.
int sign_from(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  std::uint64_t exact_tests = 0;
  int side = side_sign(a, b, c, p, exact_tests);
  if (side == 0)
    side = turn_sign(a.y, a.z, b.y, b.z, c.y, c.z, exact_tests);
  if (side == 0)
    side = turn_sign(a.z, a.x, b.z, b.x, c.z, c.x, exact_tests);
  if (side == 0)
    side = turn_sign(a.x, a.y, b.x, b.y, c.x, c.y, exact_tests);
  return -side;
}

/// Half the solid angle (van Oosterom and Strackee, eq. 8); its sign is exact.
double half_solid_angle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 u = a - p, v = b - p, w = c - p;
  const double lu = norm(u), lv = norm(v), lw = norm(w);
  const double numerator = std::fabs(dot(u, cross(v, w)));
  const double denominator = lu * lv * lw + dot(u, v) * lw + dot(v, w) * lu + dot(w, u) * lv;
  return sign_from(a, b, c, p) * angle_of(denominator, numerator);
}

/// Distance of p from the segment a b.
double segment_distance(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 edge = b - a, to = p - a;
  const double length2 = dot(edge, edge);
  const double t = length2 > 0 ? std::clamp(dot(to, edge) / length2, 0.0, 1.0) : 0;
  return norm(to - t * edge);
}

/// Distance of p from the triangle: from its plane where p lies over it, else from its edges.
double triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = cross(b - a, c - a);
  const auto left_of = [&](const Vec3& from, const Vec3& to) {
    return dot(cross(to - from, p - from), normal) > 0;
  };
  const double area = norm(normal);
  if (area > 0 && left_of(a, b) && left_of(b, c) && left_of(c, a))
    return std::fabs(dot(normal, p - a)) / area;
  return std::min(
      {segment_distance(p, a, b), segment_distance(p, b, c), segment_distance(p, c, a)});
}

} // namespace

double angle_of(double x, double y) {
  return angle(x, y);
}

SolidAngleTree::SolidAngleTree(std::span<const Vec3> points, std::span<const Triangle> triangles,
                               std::span<const Triangle> pieces, CpuLevel cpu)
    : points_(points), exact_(triangles), triangles_(pieces.begin(), pieces.end()),
      kernel_(cpu == CpuLevel::baseline ? solid_angles_baseline : solid_angles_avx2) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (t % solid_angle_lanes == 0)
      blocks_.emplace_back();
    for (std::size_t c = 0; c < 3; ++c)
      for (int a = 0; a < 3; ++a)
        blocks_.back().corner[c][a][t % solid_angle_lanes] = points[triangles[t][c]][a];
  }
  if (triangles_.empty())
    return;
  mesh::EdgeSides(points.size(), triangles)
      .for_each_edge([&](std::uint32_t low, std::span<const mesh::EdgeSide> edge) {
        for (int n = std::abs(mesh::surplus(edge)); n > 0; --n)
          border_.push_back({points[low], points[edge[0].high()]});
      });
  nodes_.emplace_back();
  nodes_[0].end = static_cast<std::uint32_t>(triangles_.size());
  build(0);
}

void SolidAngleTree::build(std::uint32_t n) {
  constexpr std::uint32_t leaf_size = 1;
  Node node = nodes_[n];
  Vec3 sum;
  Box3 middles;
  const auto middle = [&](const Triangle& t) {
    return (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3;
  };
  for (std::uint32_t t = node.begin; t < node.end; ++t) {
    const auto& [a, b, c] = triangles_[t];
    const Vec3 normal = normal_of(points_[a], points_[b], points_[c]) / 2;
    node.normal += normal;
    node.area += norm(normal);
    sum += norm(normal) * middle(triangles_[t]);
    middles.add(middle(triangles_[t]));
  }
  node.center = node.area > 0 ? sum / node.area : (middles.min + middles.max) / 2;
  for (std::uint32_t t = node.begin; t < node.end; ++t)
    for (const std::uint32_t corner : triangles_[t])
      node.radius = std::max(node.radius, norm(points_[corner] - node.center));
  node.radius *= 1 + 0x1p-40; // rounding
  for (std::uint32_t t = node.begin; t < node.end; ++t) {
    const auto& [a, b, c] = triangles_[t];
    const Vec3 normal = normal_of(points_[a], points_[b], points_[c]) / 2;
    for (int i = 0; i < 3; ++i)
      node.moment[static_cast<std::size_t>(i)] += normal[i] * (middle(triangles_[t]) - node.center);
  }
  if (node.end - node.begin > leaf_size) {
    const Vec3 size = middles.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t half = node.begin + (node.end - node.begin) / 2;
    const auto at = [&](std::uint32_t t) {
      return triangles_.begin() + static_cast<std::ptrdiff_t>(t);
    };
    std::sort(at(node.begin), at(node.end), [&](const Triangle& a, const Triangle& b) {
      const double x = middle(a)[axis], y = middle(b)[axis];
      return x != y ? x < y : a < b;
    });
    node.children = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node.children].begin = node.begin;
    nodes_[node.children].end = nodes_[node.children + 1].begin = half;
    nodes_[node.children + 1].end = node.end;
  }
  nodes_[n] = node;
  if (node.children != 0) {
    build(node.children);
    build(node.children + 1);
  }
}

// The kernel n.q/|q|³ is a first derivative of 1/|q|, whose derivatives of order m along unit
// vectors are at most m!/|q|^(m+1). Expanded to first order over displacements of at most r, it
// errs by at most 3 r²/(d - r)⁴.

/// Value of a node, by a dipole and its first moments; q from the point to the centre, d = |q|.
template <class Node>
double expansion(const Node& node, const Vec3& q, double d) {
  const auto& m = node.moment;
  const double trace = m[0].x + m[1].y + m[2].z;
  const double along = q.x * dot(m[0], q) + q.y * dot(m[1], q) + q.z * dot(m[2], q);
  return (dot(node.normal, q) + trace - 3 * along / (d * d)) / (4 * pi * d * d * d);
}

double SolidAngleTree::exact_at(const Vec3& p) const {
  const double point[3] = {p.x, p.y, p.z};
  double sum = 0;
  for (std::size_t first = 0, block = 0; first < exact_.size();
       first += solid_angle_lanes, ++block) {
    double half[solid_angle_lanes];
    const std::uint32_t certain = kernel_(blocks_[block], point, half);
    const std::size_t count = std::min(solid_angle_lanes, exact_.size() - first);
    for (std::size_t n = 0; n < count; ++n) {
      const auto& [a, b, c] = exact_[first + n];
      sum += (certain >> n & 1) != 0 ? half[n]
                                     : half_solid_angle(points_[a], points_[b], points_[c], p);
    }
  }
  return sum / (2 * pi);
}

WindingSum SolidAngleTree::at(const Vec3& p, double tolerance) const {
  WindingSum sum;
  std::uint32_t stack[128];
  int depth = 0;
  if (!nodes_.empty())
    stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    const Vec3 q = node.center - p;
    const double d = norm(q), gap = d - node.radius;
    if (gap > 0 && tolerance > 0) {
      const double error =
          3 * node.area * node.radius * node.radius / (4 * pi * gap * gap * gap * gap);
      if (error < tolerance) {
        sum.value += expansion(node, q, d);
        sum.error += error;
        continue;
      }
    }
    if (node.children != 0) {
      stack[depth++] = node.children + 1;
      stack[depth++] = node.children;
      continue;
    }
    for (std::uint32_t t = node.begin; t < node.end; ++t) {
      const auto& [a, b, c] = triangles_[t];
      sum.value += half_solid_angle(points_[a], points_[b], points_[c], p) / (2 * pi);
      sum.error += 1e-12; // the corners of pieces are rounded
    }
  }
  return sum;
}

WindingSum SolidAngleTree::quick_at(const Vec3& p) const {
  constexpr std::size_t few = 4096; // no tree beats as many angles
  return exact_.size() <= few ? WindingSum{exact_at(p), 1e-12} : at(p, 1e-4);
}

bool SolidAngleTree::is_far(const Vec3& p, double radius) const {
  std::uint32_t stack[128];
  int depth = 0;
  if (!nodes_.empty())
    stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (norm(node.center - p) > node.radius + radius)
      continue;
    if (node.children == 0) {
      for (std::uint32_t t = node.begin; t < node.end; ++t) {
        const auto& [a, b, c] = triangles_[t];
        // The slack is more than the rounding.
        if (!(triangle_distance(p, points_[a], points_[b], points_[c]) * (1 - 0x1p-20) >
              radius + node.radius * 0x1p-20))
          return false;
      }
      continue;
    }
    stack[depth++] = node.children + 1;
    stack[depth++] = node.children;
  }
  return true;
}

// Off the surface the solid angle's gradient is the integral of (x - p) x dx / |x - p|³ along the
// border (Biot and Savart), so an edge at distance d adds at most its length / d².

WindingSum SolidAngleTree::within(const Vec3& p, double radius) const {
  double slope = 0;
  for (const auto& [a, b] : border_) {
    const double gap = segment_distance(p, a, b) - radius;
    if (!(gap > 0))
      return {0, HUGE_VAL};
    slope += norm(b - a) / (gap * gap);
  }
  if (!is_far(p, radius))
    return {0, HUGE_VAL};
  WindingSum sum = quick_at(p);
  sum.error += 1.000001 * radius * slope / (4 * pi);
  return sum;
}

double SolidAngleTree::reach() const {
  return nodes_.empty() ? 0 : std::sqrt(nodes_[0].area / (2 * pi)) * (1 + 0x1p-40);
}

Box3 SolidAngleTree::box() const {
  Box3 box;
  for (const Triangle& t : triangles_)
    for (const std::uint32_t corner : t)
      box.add(points_[corner]);
  return box;
}

} // namespace gewebe::voxelization
