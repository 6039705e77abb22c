#include "model/build.h"

#include "base/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

// Based on:
// Gonzalez, Clustering to Minimize the Maximum Intercluster Distance, 1985 (farthest-point seeds).
// Lloyd, Least Squares Quantization in PCM, 1982.
// Hamerly, Making k-means even faster, 2010 (a bound on the distance of all other centers).

namespace gewebe::model {

namespace {

constexpr std::size_t grain = 8192;
constexpr int max_rounds = 100;
constexpr double alike = 0.98;        // of the largest squared distance: what is as far
constexpr double clearly = 1 + 1e-10; // beyond what rounding does to distances

double square_distance(const Vec3& a, const Vec3& b) {
  const Vec3 d = a - b;
  return dot(d, d);
}

double weight(std::span<const double> weights, std::size_t i) {
  return weights.empty() ? 1 : weights[i];
}

Vec3 mean(const std::vector<Vec3>& points, std::span<const double> weights) {
  Vec3 sum;
  double total = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += weight(weights, i) * points[i];
    total += weight(weights, i);
  }
  return sum / total;
}

/// Among the points about as far as the farthest, the one that lies farthest along a direction of
/// its own: on round bodies, where rounding would choose, fine and coarse nets get the same seeds.
std::size_t farthest(const std::vector<Vec3>& points, const std::vector<double>& distance,
                     std::size_t seed) {
  const double min = alike * *std::max_element(distance.begin(), distance.end());
  const double turn = 2.4 * static_cast<double>(seed);
  const Vec3 along{std::cos(turn), std::sin(turn), std::cos(0.5 * turn + 1)};
  std::size_t best = points.size();
  for (std::size_t i = 0; i < points.size(); ++i)
    if (distance[i] >= min &&
        (best == points.size() || dot(points[i], along) > dot(points[best], along)))
      best = i;
  return best;
}

std::vector<Vec3> farthest_points(const std::vector<Vec3>& points, std::size_t count,
                                  const Context& context, std::span<const double> weights) {
  std::vector<double> distance(points.size());
  const auto lower_to = [&](const Vec3& seed) {
    parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        distance[i] = std::min(distance[i], square_distance(points[i], seed));
    });
  };
  std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
  lower_to(mean(points, weights));
  std::vector<Vec3> seeds{points[farthest(points, distance, 0)]};
  std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
  while (seeds.size() < count) {
    lower_to(seeds.back());
    const std::size_t next = farthest(points, distance, seeds.size());
    if (!(distance[next] > 0))
      break; // all points are taken
    seeds.push_back(points[next]);
  }
  return seeds;
}

/// Assigns the points to their nearest centers; ties go to the first.
/// \param others  by point: lower bound of its distance to other centers than its own, before the
/// centers moved; points for which it decides are not compared with all centers
/// \param moved  largest displacement of a center since
/// \return whether an assignment changed
bool assign(const std::vector<Vec3>& points, Clusters& clusters, std::span<double> others,
            double moved, const Context& context) {
  std::vector<std::uint8_t> changed(points.size() / grain + 1);
  parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      others[i] -= moved;
      const double own = square_distance(points[i], clusters.centers[clusters.of_point[i]]);
      if (others[i] > 0 && own * clearly < others[i] * others[i])
        continue;
      std::uint32_t best = 0;
      double best_distance = square_distance(points[i], clusters.centers[0]);
      double next_distance = std::numeric_limits<double>::infinity();
      for (std::uint32_t c = 1; c < clusters.centers.size(); ++c) {
        const double distance = square_distance(points[i], clusters.centers[c]);
        if (distance < best_distance) {
          next_distance = best_distance;
          best_distance = distance;
          best = c;
        } else {
          next_distance = std::min(next_distance, distance);
        }
      }
      others[i] = std::sqrt(next_distance);
      if (clusters.of_point[i] != best)
        changed[begin / grain] = 1;
      clusters.of_point[i] = best;
    }
  });
  return std::find(changed.begin(), changed.end(), std::uint8_t{1}) != changed.end();
}

/// Moves each center to the mean of its points; centers without points vanish.
/// \return how far one has moved at most, infinity if some have vanished
double move_centers(const std::vector<Vec3>& points, Clusters& clusters,
                    std::span<const double> weights) {
  std::vector<Vec3> sum(clusters.centers.size());
  std::vector<double> size(clusters.centers.size());
  for (std::size_t i = 0; i < points.size();) {
    // Neighbours often have one center: their sum stays where it is quick to add to.
    const std::uint32_t c = clusters.of_point[i];
    Vec3 sum_here = sum[c];
    double size_here = size[c];
    for (; i < points.size() && clusters.of_point[i] == c; ++i) {
      sum_here += weight(weights, i) * points[i];
      size_here += weight(weights, i);
    }
    sum[c] = sum_here;
    size[c] = size_here;
  }
  std::vector<std::uint32_t> renumbered(size.size());
  std::uint32_t kept = 0;
  double farthest = 0; // squared
  for (std::size_t c = 0; c < size.size(); ++c) {
    renumbered[c] = kept;
    if (!(size[c] > 0))
      continue;
    const Vec3 to = sum[c] / size[c];
    farthest = std::max(farthest, square_distance(clusters.centers[c], to));
    clusters.centers[kept++] = to;
  }
  if (kept == size.size())
    return std::sqrt(farthest) * clearly;
  clusters.centers.resize(kept);
  for (std::uint32_t& c : clusters.of_point)
    c = renumbered[c];
  return std::numeric_limits<double>::infinity();
}

/// Centers without points vanish.
void drop_empty(Clusters& clusters) {
  std::vector<std::uint32_t> renumbered(clusters.centers.size());
  for (const std::uint32_t c : clusters.of_point)
    renumbered[c] = 1;
  std::uint32_t kept = 0;
  for (std::size_t c = 0; c < renumbered.size(); ++c)
    if (renumbered[c] != 0) {
      clusters.centers[kept] = clusters.centers[c];
      renumbered[c] = kept++;
    }
  clusters.centers.resize(kept);
  for (std::uint32_t& c : clusters.of_point)
    c = renumbered[c];
}

} // namespace

Clusters nearest_clusters(const std::vector<Vec3>& points, const std::vector<Vec3>& centers,
                          const Context& context) {
  Clusters clusters{centers, std::vector<std::uint32_t>(points.size())};
  std::vector<double> others(points.size());
  assign(points, clusters, others, 0, context);
  drop_empty(clusters);
  return clusters;
}

Clusters cluster_points(const std::vector<Vec3>& points, std::size_t count, const Context& context,
                        std::span<const double> weights) {
  Clusters clusters;
  if (points.empty() || count == 0)
    return clusters;
  clusters.centers = farthest_points(points, count, context, weights);
  clusters.of_point.assign(points.size(), 0);
  std::vector<double> others(points.size());
  assign(points, clusters, others, 0, context);
  for (int round = 0; round < max_rounds; ++round) {
    const double moved = move_centers(points, clusters, weights);
    if (!assign(points, clusters, others, moved, context))
      break;
  }
  // After the last round a center may be behind, or without points.
  (void)move_centers(points, clusters, weights);
  return clusters;
}

} // namespace gewebe::model
