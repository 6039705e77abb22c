#include "model/build.h"

#include "base/parallel.h"

#include <algorithm>
#include <limits>

// Based on:
// Gonzalez, Clustering to Minimize the Maximum Intercluster Distance, 1985 (farthest-point seeds).
// Lloyd, Least Squares Quantization in PCM, 1982.

namespace gewebe {

namespace {

constexpr std::size_t grain = 8192;
constexpr int most_rounds = 100;

double square_distance(const Vec3& a, const Vec3& b) {
  const Vec3 d = a - b;
  return dot(d, d);
}

Vec3 mean(const std::vector<Vec3>& points) {
  Vec3 sum;
  for (const Vec3& p : points)
    sum += p;
  return sum / static_cast<double>(points.size());
}

std::size_t index_of_largest(const std::vector<double>& values) {
  return static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
}

std::vector<Vec3> farthest_points(const std::vector<Vec3>& points, std::size_t count,
                                  const Context& context) {
  std::vector<double> distance(points.size());
  const auto lower_to = [&](const Vec3& seed) {
    parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        distance[i] = std::min(distance[i], square_distance(points[i], seed));
    });
  };
  std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
  lower_to(mean(points));
  std::vector<Vec3> seeds{points[index_of_largest(distance)]};
  std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
  while (seeds.size() < count) {
    lower_to(seeds.back());
    const std::size_t farthest = index_of_largest(distance);
    if (!(distance[farthest] > 0))
      break; // all points are taken
    seeds.push_back(points[farthest]);
  }
  return seeds;
}

/// Ties the points to their nearest centers; true if a tie changed.
bool assign(const std::vector<Vec3>& points, Clusters& clusters, const Context& context) {
  std::vector<std::uint8_t> changed(points.size() / grain + 1);
  parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::uint32_t best = 0;
      double best_distance = square_distance(points[i], clusters.centers[0]);
      for (std::uint32_t c = 1; c < clusters.centers.size(); ++c) {
        const double distance = square_distance(points[i], clusters.centers[c]);
        if (distance < best_distance) {
          best_distance = distance;
          best = c;
        }
      }
      if (clusters.of_point[i] != best)
        changed[begin / grain] = 1;
      clusters.of_point[i] = best;
    }
  });
  return std::find(changed.begin(), changed.end(), std::uint8_t{1}) != changed.end();
}

/// Moves each center to the mean of its points; centers without points vanish.
void move_centers(const std::vector<Vec3>& points, Clusters& clusters) {
  std::vector<Vec3> sum(clusters.centers.size());
  std::vector<std::size_t> size(clusters.centers.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum[clusters.of_point[i]] += points[i];
    ++size[clusters.of_point[i]];
  }
  std::vector<std::uint32_t> renumbered(size.size());
  std::uint32_t kept = 0;
  for (std::size_t c = 0; c < size.size(); ++c) {
    renumbered[c] = kept;
    if (size[c] != 0)
      clusters.centers[kept++] = sum[c] / static_cast<double>(size[c]);
  }
  if (kept == size.size())
    return;
  clusters.centers.resize(kept);
  for (std::uint32_t& c : clusters.of_point)
    c = renumbered[c];
}

} // namespace

Clusters cluster_points(const std::vector<Vec3>& points, std::size_t count,
                        const Context& context) {
  Clusters clusters;
  if (points.empty() || count == 0)
    return clusters;
  clusters.centers = farthest_points(points, count, context);
  clusters.of_point.assign(points.size(), 0);
  assign(points, clusters, context);
  for (int round = 0; round < most_rounds; ++round) {
    move_centers(points, clusters);
    if (!assign(points, clusters, context))
      break;
  }
  move_centers(points, clusters); // after the last round a center may be behind, or without points
  return clusters;
}

} // namespace gewebe
