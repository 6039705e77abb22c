#pragma once
// Volumes and helpers for the tests of the surface stage.

#include "base/parallel.h"
#include "mesh/check.h"
#include "surface/marching_cubes.h"
#include "surface/snapping.h"
#include "volume/grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

namespace gewebe::scenes {

/// A grid with the values of `function(i, j, k)` on the box min … max (inclusive), else background.
template <class Function>
volume::Grid sample(const volume::GridInfo& info, const Int3& min, const Int3& max,
                    const Function& function, bool prune = true) {
  std::vector<Int3> origins;
  for (int i = min[0] & ~7; i <= max[0]; i += 8)
    for (int j = min[1] & ~7; j <= max[1]; j += 8)
      for (int k = min[2] & ~7; k <= max[2]; k += 8)
        origins.push_back({i, j, k});
  volume::GridBuilder builder(info);
  for (const volume::LeafRef& leaf : builder.add_leaves({}, origins))
    for (int n = 0; n < volume::leaf_voxels; ++n) {
      const Int3 p{leaf.origin[0] + (n >> 6), leaf.origin[1] + (n >> 3 & 7),
                   leaf.origin[2] + (n & 7)};
      bool in = true;
      for (std::size_t a = 0; a < 3; ++a)
        in = in && p[a] >= min[a] && p[a] <= max[a];
      if (!in)
        continue;
      leaf.values[n] = static_cast<float>(function(p[0], p[1], p[2]));
      if (leaf.values[n] != info.background)
        leaf.active[n >> 6] |= std::uint64_t{1} << (n & 63);
    }
  return builder.finish(prune);
}

/// Density of soft objects (Wyvill et al. 1986, report eq. 3.1): (1-t)² (1 - 4t/9), t = r²/R².
struct Ball {
  Vec3 center;
  double radius;
};
inline double density(const std::vector<Ball>& balls, const Vec3& p) {
  double sum = 0;
  for (const Ball& ball : balls) {
    const double t = dot(p - ball.center, p - ball.center) / (ball.radius * ball.radius);
    if (t < 1)
      sum += (1 - t) * (1 - t) * (1 - 4 * t / 9);
  }
  return sum;
}
/// Five balls in n³ voxels, as in figure 3-3 of the report.
inline std::vector<Ball> five_balls(double n, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
  };
  std::vector<Ball> balls;
  for (int b = 0; b < 5; ++b) {
    const double radius = n * uniform(0.18, 0.3);
    Ball ball{{}, radius};
    for (int a = 0; a < 3; ++a)
      ball.center[a] = uniform(radius + 1, n - radius - 1);
    balls.push_back(ball);
  }
  return balls;
}
inline volume::Grid metaballs(int n, std::uint32_t seed, double voxel = 1) {
  const std::vector<Ball> balls = five_balls(n, seed);
  volume::GridInfo info;
  info.transform = volume::uniform_transform(voxel);
  return sample(info, {0, 0, 0}, {n, n, n}, [&](int i, int j, int k) {
    return density(balls, {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
  });
}

/// n³ random values around the isovalue 0.5 at a random offset; with levels > 0 quantised to
/// multiples of 1/levels, so that many values meet the isovalue exactly.
inline volume::Grid noise(int n, std::uint32_t seed, int levels = 0) {
  std::mt19937 random(seed);
  const auto offset = [&] { return static_cast<int>(random() % 16) - 8; };
  const Int3 min{offset(), offset(), offset()};
  return sample({}, min, {min[0] + n - 1, min[1] + n - 1, min[2] + n - 1}, [&](int, int, int) {
    const double value = static_cast<double>(random()) / 4294967296.0;
    return levels > 0 ? std::floor(value * levels + 0.5) / levels : value;
  });
}

/// Snapping as the report tells it, without fin rule and link condition: every crossing near a
/// corner goes there, faces with equal corners vanish. Breaks meshes; a negative control.
inline TriangleMesh snap_naively(const surface::IsoSurface& surface, double epsilon) {
  std::map<Int3, std::uint32_t> corners;
  const std::vector<surface::EdgeCrossing> crossings = surface::edge_crossings(surface);
  std::vector<std::uint32_t> number(crossings.size());
  TriangleMesh mesh;
  for (std::size_t p = 0; p < number.size(); ++p) {
    const surface::EdgeCrossing& c = crossings[p];
    Int3 corner = c.corner;
    if (1 - c.fraction <= epsilon)
      ++corner[static_cast<std::size_t>(c.axis)];
    number[p] = static_cast<std::uint32_t>(mesh.points.size());
    if (c.fraction <= epsilon || 1 - c.fraction <= epsilon)
      number[p] = corners.emplace(corner, number[p]).first->second;
    if (number[p] == mesh.points.size())
      mesh.points.push_back(surface.mesh.points[p]);
  }
  for (const Triangle& t : surface.mesh.triangles) {
    const Triangle face{number[t[0]], number[t[1]], number[t[2]]};
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0])
      mesh.triangles.push_back(face);
  }
  return mesh;
}

/// Closed, 2-manifold, oriented, no point unused.
inline bool is_sound(const mesh::MeshReport& report) {
  return report.closed() && report.manifold() && report.oriented() && report.unused_points == 0;
}

/// A sound mesh of the same topology as before the snap.
inline bool keeps_topology(const mesh::MeshReport& before, const mesh::MeshReport& after) {
  return is_sound(before) && is_sound(after) && before.euler == after.euler &&
         before.components == after.components;
}

} // namespace gewebe::scenes
