#include "mesh/components.h"

#include "base/disjoint_sets.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gewebe::mesh {
namespace {

/// The component of each point, by the number of its first point.
std::vector<std::uint32_t> first_points(const TriangleMesh& mesh) {
  DisjointSets sets(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
  }
  std::vector<std::uint32_t> first(mesh.points.size());
  for (std::uint32_t p = 0; p < first.size(); ++p)
    first[p] = sets.find(p);
  return first;
}

template <class Item, class Keep>
void filter(std::vector<Item>& items, const Keep& keep) {
  std::size_t kept = 0;
  for (std::size_t n = 0; n < items.size(); ++n)
    if (keep(n))
      items[kept++] = items[n];
  items.resize(kept);
}

} // namespace

Topology topology(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> first = first_points(mesh);
  Topology result;
  for (std::uint32_t p = 0; p < first.size(); ++p)
    result.components += first[p] == p ? 1 : 0;
  result.euler = static_cast<std::int64_t>(mesh.points.size()) -
                 static_cast<std::int64_t>(mesh.triangles.size() / 2);
  return result;
}

ComponentReport keep_components(TriangleMesh& mesh, const ComponentChoice& choice) {
  const std::vector<std::uint32_t> component = first_points(mesh);
  std::vector<double> volume(mesh.points.size(), 0); // by first point
  std::vector<std::uint8_t> used(mesh.points.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    const std::uint32_t first = component[t[0]];
    const Vec3& origin = mesh.points[first];
    volume[first] += dot(mesh.points[t[0]] - origin,
                         cross(mesh.points[t[1]] - origin, mesh.points[t[2]] - origin)) /
                     6;
    for (const std::uint32_t p : t)
      used[p] = 1;
  }
  std::vector<std::uint32_t> order;
  for (std::uint32_t p = 0; p < component.size(); ++p)
    if (component[p] == p && used[p] != 0)
      order.push_back(p);
  std::ranges::stable_sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return std::fabs(volume[a]) > std::fabs(volume[b]);
  });

  ComponentReport report;
  std::vector<std::uint8_t> keep(mesh.points.size(), 0); // by first point
  for (const std::uint32_t first : order) {
    const double size = std::fabs(volume[first]);
    if (report.kept < choice.largest && size >= choice.min_volume) {
      keep[first] = 1;
      ++report.kept;
    } else {
      ++report.dropped;
      report.dropped_volume += size;
      report.largest_dropped = std::fmax(report.largest_dropped, size);
    }
  }
  const std::size_t points = mesh.points.size(), triangles = mesh.triangles.size();
  const auto keep_point = [&](std::size_t p) { return used[p] != 0 && keep[component[p]] != 0; };
  std::vector<std::uint8_t> keep_face(triangles);
  for (std::size_t f = 0; f < triangles; ++f)
    keep_face[f] = keep[component[mesh.triangles[f][0]]];
  const auto stays = [&](std::size_t f) { return keep_face[f] != 0; };
  std::vector<std::uint32_t> number(points);
  std::uint32_t next = 0;
  for (std::size_t p = 0; p < points; ++p)
    number[p] = keep_point(p) ? next++ : 0;
  filter(mesh.triangles, stays);
  filter(mesh.texcoords, stays);
  filter(mesh.part, stays);
  filter(mesh.material, stays);
  filter(mesh.points, keep_point);
  filter(mesh.normals, keep_point);
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& p : t)
      p = number[p];
  report.dropped_points = points - mesh.points.size();
  report.dropped_triangles = triangles - mesh.triangles.size();
  return report;
}

} // namespace gewebe::mesh
