#include "mesh/quality.h"

#include "mesh/edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

// Based on: Gershgorin's circle theorem for the springs' stiffness matrix, whose off-diagonal
// blocks have the norm of their springs' stiffness.

namespace gewebe {
namespace {

constexpr double degrees = 57.295779513082320877;

Histogram histogram(const std::vector<double>& values, std::size_t bins, double top) {
  Histogram result{top, std::vector<std::uint64_t>(bins, 0)};
  for (const double value : values) {
    const double bin = top > 0 ? std::floor(value / top * static_cast<double>(bins)) : 0;
    ++result.counts[std::min(bins - 1, static_cast<std::size_t>(std::fmax(bin, 0)))];
  }
  return result;
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::ranges::max_element(values);
}

/// Degrees; 0 where the face has no area.
double smallest_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, w = c - b;
  const double twice_area = norm(cross(u, v));
  const double uu = dot(u, u), vv = dot(v, v), ww = dot(w, w);
  // The smallest angle lies between the two longer sides.
  const double along = uu <= vv && uu <= ww ? dot(v, w) : vv <= ww ? -dot(u, w) : dot(u, v);
  return twice_area > 0 ? std::atan2(twice_area, along) * degrees : 0;
}

} // namespace

MeshQuality mesh_quality(const TriangleMesh& mesh) {
  std::vector<double> angles, areas, lengths;
  for (const Triangle& t : mesh.triangles) {
    if (has_equal_corners(t))
      continue;
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    angles.push_back(smallest_angle(a, b, c));
    areas.push_back(norm(cross(b - a, c - a)) / 2);
  }
  std::vector<double> stiffness(mesh.points.size(), 0); // sum of 1/L at each node
  EdgeSides(mesh.points.size(), mesh.triangles)
      .for_each_edge([&](std::uint32_t a, std::span<const EdgeSide> edge) {
        const std::uint32_t b = edge[0].high();
        lengths.push_back(norm(mesh.points[a] - mesh.points[b]));
        stiffness[a] += 1 / lengths.back();
        stiffness[b] += 1 / lengths.back();
      });
  MeshQuality quality;
  quality.smallest_angles = histogram(angles, 12, 60);
  quality.edge_lengths = histogram(lengths, 20, largest(lengths));
  quality.areas = histogram(areas, 20, largest(areas));
  if (angles.empty())
    return quality;
  const auto below = std::ranges::count_if(angles, [](double angle) { return angle < 10; });
  quality.share_below_10 = static_cast<double>(below) / static_cast<double>(angles.size());
  std::ranges::sort(angles);
  quality.angle_1_percent = angles[angles.size() / 100];
  quality.angle_5_percent = angles[angles.size() / 20];
  quality.angle_median = angles[angles.size() / 2];
  quality.edge_ratio = largest(lengths) / *std::ranges::min_element(lengths);
  quality.explicit_step = 2 / std::sqrt(2 * largest(stiffness));
  return quality;
}

} // namespace gewebe
