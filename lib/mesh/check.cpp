#include "mesh/check.h"

#include "base/disjoint_sets.h"
#include "mesh/edges.h"
#include "mesh/repeated_faces.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace gewebe {
namespace {

/// Examines all edges, joins the corners of faces that meet at an edge (corner 3 f + n).
void examine_edges(const TriangleMesh& mesh, DisjointSets& corners, MeshReport& report) {
  report.edge_min = HUGE_VAL;
  double length_sum = 0;
  const EdgeSides sides(mesh.points.size(), mesh.triangles);
  sides.for_each_edge([&](std::uint32_t low, std::span<const EdgeSide> edge) {
    ++report.edges;
    const double length = norm(mesh.points[edge[0].high()] - mesh.points[low]);
    length_sum += length;
    report.edge_min = std::fmin(report.edge_min, length);
    report.edge_max = std::fmax(report.edge_max, length);
    report.boundary_edges += edge.size() == 1 ? 1 : 0;
    report.nonmanifold_edges += edge.size() > 2 ? 1 : 0;
    report.misoriented_edges += edge.size() == 2 && surplus(edge) != 0 ? 1 : 0;
    for (const EdgeSide& other : edge.subspan(1)) {
      corners.join(edge[0].low_corner(), other.low_corner());
      corners.join(edge[0].high_corner(), other.high_corner());
    }
  });
  report.edge_mean = report.edges > 0 ? length_sum / static_cast<double>(report.edges) : 0;
  if (report.edges == 0)
    report.edge_min = 0;
}

/// Points whose corners fall into more than one set, and points in no face.
void examine_points(const TriangleMesh& mesh, DisjointSets& corners, MeshReport& report) {
  constexpr std::uint32_t unseen = UINT32_MAX, split = UINT32_MAX - 1;
  std::vector<std::uint32_t> fan(mesh.points.size(), unseen);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    if (has_equal_corners(t))
      continue;
    for (std::uint32_t n = 0; n < 3; ++n) {
      std::uint32_t& seen = fan[t[n]];
      const std::uint32_t root = corners.find(3 * f + n);
      if (seen == unseen) {
        seen = root;
      } else if (seen != split && seen != root) {
        seen = split;
        ++report.nonmanifold_points;
      }
    }
  }
  report.unused_points = static_cast<std::uint64_t>(std::ranges::count(fan, unseen));
}

void count_duplicates(const TriangleMesh& mesh, MeshReport& report) {
  const std::vector<bool> repeated =
      repeated_faces(mesh.points.size(), mesh.triangles, SameFace::corners);
  for (std::size_t f = 0; f < repeated.size(); ++f)
    report.duplicate_faces += repeated[f] && !has_equal_corners(mesh.triangles[f]) ? 1 : 0;
}

void examine_shapes(const TriangleMesh& mesh, MeshReport& report) {
  double largest_cosine = -1; // of the smallest angle
  for (const Triangle& t : mesh.triangles) {
    if (has_equal_corners(t)) {
      ++report.degenerate_faces;
      continue;
    }
    const Vec3& a = mesh.points[t[0]];
    const Vec3 u = mesh.points[t[1]] - a, v = mesh.points[t[2]] - a, w = v - u;
    const double uu = dot(u, u), vv = dot(v, v), ww = dot(w, w);
    const double twice_area = norm(cross(u, v));
    report.area += twice_area / 2;
    if (!(twice_area > 2e-12 * std::fmax(uu, std::fmax(vv, ww)))) {
      ++report.zero_area_faces;
      largest_cosine = 1;
      continue;
    }
    // The smallest angle lies between the two longer sides.
    const double shortest = std::fmin(uu, std::fmin(vv, ww));
    const double cosine = shortest == ww   ? dot(u, v) / std::sqrt(uu * vv)
                          : shortest == uu ? dot(v, w) / std::sqrt(vv * ww)
                                           : -dot(u, w) / std::sqrt(uu * ww);
    largest_cosine = std::fmax(largest_cosine, std::fmin(cosine, 1));
  }
  report.smallest_angle = std::acos(largest_cosine) * 57.295779513082320877;
}

struct Component {
  double volume = 0;
  bool wrapped = false; // inside an odd number of other shells
  Vec3 probe;           // beside the centroid of its largest face, on the side of the body
  double largest = -1;  // squared length of that face's normal
  std::uint32_t root = 0;
};

/// Twice the area of (a, b, p) in the plane z = 0, computed in one order of a and b for both faces
/// of an edge, so that a ray passes on the same side for both.
double side_of(const Vec3& a, const Vec3& b, const Vec3& p) {
  const bool swapped = b.x < a.x || (b.x == a.x && b.y < a.y);
  const Vec3 &s = swapped ? b : a, &e = swapped ? a : b;
  const double area = (e.x - s.x) * (p.y - s.y) - (e.y - s.y) * (p.x - s.x);
  return swapped ? -area : area;
}

/// Does the ray from p along +z meet the triangle? Half-open at its edges.
bool ray_meets(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const auto crosses = [&](const Vec3& s, const Vec3& e) {
    // the edge passes p.y from below (+1), above (-1) or not (0), at an x beyond p.x
    if ((s.y <= p.y) == (e.y <= p.y))
      return false;
    const double side = side_of(s, e, p);
    return e.y > s.y ? side > 0 : side < 0;
  };
  if ((crosses(a, b) + crosses(b, c) + crosses(c, a)) % 2 == 0)
    return false;
  const Vec3 normal = cross(b - a, c - a);
  return normal.z != 0 && dot(normal, a - p) / normal.z > 0;
}

void find_wrapped(const TriangleMesh& mesh, DisjointSets& connected,
                  std::vector<Component>& components) {
  if (components.size() < 2)
    return;
  std::vector<std::size_t> by_x(components.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  std::ranges::sort(by_x, {}, [&](std::size_t n) { return components[n].probe.x; });
  for (const Triangle& t : mesh.triangles) {
    if (has_equal_corners(t))
      continue;
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    const double low = std::fmin(a.x, std::fmin(b.x, c.x)),
                 high = std::fmax(a.x, std::fmax(b.x, c.x));
    const auto probe_x = [&](std::size_t n) { return components[n].probe.x; };
    const std::uint32_t root = connected.find(t[0]);
    for (auto n = std::ranges::lower_bound(by_x, low, {}, probe_x);
         n != by_x.end() && probe_x(*n) <= high; ++n) {
      Component& component = components[*n];
      if (component.root != root && ray_meets(a, b, c, component.probe))
        component.wrapped = !component.wrapped;
    }
  }
}

void examine_components(const TriangleMesh& mesh, MeshReport& report) {
  DisjointSets connected(mesh.points.size());
  for (const Triangle& t : mesh.triangles)
    if (!has_equal_corners(t)) {
      connected.join(t[0], t[1]);
      connected.join(t[1], t[2]);
    }
  std::vector<std::size_t> number(mesh.points.size(), SIZE_MAX); // by root
  std::vector<Component> components;
  for (const Triangle& t : mesh.triangles) {
    if (has_equal_corners(t))
      continue;
    const std::uint32_t root = connected.find(t[0]);
    if (number[root] == SIZE_MAX) {
      number[root] = components.size();
      components.push_back({});
      components.back().root = root;
    }
    Component& component = components[number[root]];
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    const Vec3 normal = cross(b - a, c - a);
    if (dot(normal, normal) > component.largest) {
      component.largest = dot(normal, normal);
      // The step keeps apart shells that touch there: normal / sqrt|normal| has the face's size.
      component.probe = (a + b + c) / 3;
      if (component.largest > 0)
        component.probe -= normal * (1e-6 / std::sqrt(std::sqrt(component.largest)));
    }
    const Vec3& origin = mesh.points[root];
    component.volume += dot(a - origin, cross(b - origin, c - origin)) / 6;
  }
  find_wrapped(mesh, connected, components);
  report.components = components.size();
  for (const Component& component : components) {
    report.volume += component.volume;
    if (component.wrapped ? !(component.volume <= 0) : !(component.volume >= 0))
      ++report.inverted_components;
  }
}

} // namespace

MeshReport examine_mesh(const TriangleMesh& mesh) {
  MeshReport report;
  report.points = mesh.points.size();
  report.triangles = mesh.triangles.size();
  DisjointSets corners(3 * mesh.triangles.size());
  examine_edges(mesh, corners, report);
  examine_points(mesh, corners, report);
  count_duplicates(mesh, report);
  examine_shapes(mesh, report);
  examine_components(mesh, report);
  report.euler = static_cast<std::int64_t>(report.points - report.unused_points) -
                 static_cast<std::int64_t>(report.edges) +
                 static_cast<std::int64_t>(report.triangles - report.degenerate_faces);
  return report;
}

} // namespace gewebe
