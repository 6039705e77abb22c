#include "mesh/check.h"

#include "base/joint_sets.h"
#include "base/parallel.h"
#include "mesh/edges.h"
#include "mesh/face_figures.h"
#include "mesh/fans.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::mesh {
namespace {

constexpr std::size_t grain = 1 << 15;

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

void find_wrapped(const TriangleMesh& mesh, const std::vector<std::uint32_t>& component_of,
                  std::vector<Component>& components, const Context& context) {
  if (components.size() < 2)
    return;
  std::vector<std::size_t> by_x(components.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  const auto probe_x = [&](std::size_t n) { return components[n].probe.x; };
  std::ranges::sort(by_x, {}, probe_x);
  const auto between = [&](double low, double high) { // probes
    const auto first = std::ranges::lower_bound(by_x, low, {}, probe_x);
    auto stop = first;
    while (stop != by_x.end() && probe_x(*stop) <= high)
      ++stop;
    return std::span<const std::size_t>(first, stop);
  };
  constexpr std::size_t few = 64; // faces that may lie beside all probes
  std::vector<std::vector<std::size_t>> met((mesh.triangles.size() + grain - 1) / grain);
  parallel_blocks(context, mesh.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t first = begin; first < end; first += few) {
      const std::size_t stop = std::min(end, first + few);
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (std::size_t f = first; f < stop; ++f)
        for (const std::uint32_t p : mesh.triangles[f]) {
          low = std::min(low, mesh.points[p].x);
          high = std::max(high, mesh.points[p].x);
        }
      if (between(low, high).empty())
        continue;
      for (std::size_t f = first; f < stop; ++f) {
        const Triangle& t = mesh.triangles[f];
        if (has_equal_corners(t))
          continue;
        const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        for (const std::size_t n :
             between(std::min(a.x, std::min(b.x, c.x)), std::max(a.x, std::max(b.x, c.x))))
          if (components[n].root != component_of[t[0]] && ray_meets(a, b, c, components[n].probe))
            met[begin / grain].push_back(n);
      }
    }
  });
  for (const std::vector<std::size_t>& some : met)
    for (const std::size_t n : some)
      components[n].wrapped = !components[n].wrapped;
}

/// For each point the first of the points that faces connect it to.
std::vector<std::uint32_t> connected(const TriangleMesh& mesh, std::vector<std::uint32_t> joined_to,
                                     const Context& context) {
  JointSets sets(std::move(joined_to));
  sets.flatten(context); // now most faces join nothing
  parallel_blocks(context, mesh.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const Triangle& t = mesh.triangles[f];
      if (has_equal_corners(t))
        continue;
      sets.join(t[0], t[1]);
      sets.join(t[1], t[2]);
    }
  });
  return std::move(sets).smallest(context);
}

void examine_components(const TriangleMesh& mesh, const FaceFigures& faces,
                        const std::vector<std::uint32_t>& component_of, const Context& context,
                        MeshReport& report) {
  constexpr std::uint32_t none = UINT32_MAX;
  std::vector<std::uint32_t> number(mesh.points.size(), none); // by root
  std::vector<Component> components;
  std::vector<std::uint32_t> largest; // face of each
  for (const FaceFigures::Run& one : faces.runs) {
    if (number[one.component] == none) {
      number[one.component] = static_cast<std::uint32_t>(components.size());
      components.push_back({});
      components.back().root = one.component;
      largest.push_back(one.largest);
    }
    const std::uint32_t n = number[one.component];
    components[n].volume += one.six_volumes / 6;
    if (one.square > components[n].largest) {
      components[n].largest = one.square;
      largest[n] = one.largest;
    }
  }
  for (std::size_t n = 0; n < components.size(); ++n) {
    const Triangle& t = mesh.triangles[largest[n]];
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    // The step keeps apart shells that touch there: normal / sqrt|normal| has the face's size.
    components[n].probe = (a + b + c) / 3;
    if (components[n].largest > 0)
      components[n].probe -=
          cross(b - a, c - a) * (1e-6 / std::sqrt(std::sqrt(components[n].largest)));
  }
  find_wrapped(mesh, component_of, components, context);
  report.components = components.size();
  for (const Component& component : components) {
    report.volume += component.volume;
    if (component.wrapped ? !(component.volume <= 0) : !(component.volume >= 0))
      ++report.inverted_components;
  }
}

} // namespace

MeshReport examine_mesh(const TriangleMesh& mesh, const Context& context, MeshQuality* quality) {
  Context quiet = context;
  quiet.progress = nullptr; // that of parts means nothing
  MeshReport report;
  report.points = mesh.points.size();
  report.triangles = mesh.triangles.size();
  FanFigures fans = examine_fans(mesh, quiet);
  report.unused_points = fans.unused_points;
  report.nonmanifold_points = fans.nonmanifold_points;
  report.duplicate_faces = fans.duplicate_faces;
  report.edges = fans.edges;
  report.boundary_edges = fans.boundary_edges;
  report.nonmanifold_edges = fans.nonmanifold_edges;
  report.misoriented_edges = fans.misoriented_edges;
  report.edge_min = fans.edge_min;
  report.edge_mean = fans.edges > 0 ? fans.length_sum / static_cast<double>(fans.edges) : 0;
  report.edge_max = fans.edge_max;
  const std::vector<std::uint32_t> component_of = connected(mesh, std::move(fans.joined_to), quiet);
  const FaceFigures faces = examine_faces(mesh, component_of, quiet);
  report.degenerate_faces = faces.degenerate;
  report.zero_area_faces = faces.zero_area;
  report.area = faces.area;
  report.smallest_angle = faces.smallest_angle;
  examine_components(mesh, faces, component_of, quiet, report);
  report.euler = static_cast<std::int64_t>(report.points - report.unused_points) -
                 static_cast<std::int64_t>(report.edges) +
                 static_cast<std::int64_t>(report.triangles - report.degenerate_faces);
  if (quality != nullptr)
    *quality = quality_of(faces, fans, quiet);
  return report;
}

} // namespace gewebe::mesh
