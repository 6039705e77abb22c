// The clusters that are taken in parallel end as if all were taken one after the other.

#include "surface/snap_collapse_internal.h"

#include "base/error.h"
#include "tests/unit/surface_scenes.h"

#include <gtest/gtest.h>

#include <utility>

namespace gewebe {
namespace {

using namespace scenes;

Context with_threads(int threads) {
  Context context;
  context.threads = threads;
  return context;
}

struct Compared {
  std::size_t clusters = 0, careful = 0;
};

Compared compare(const Grid& grid, double epsilon, const std::string& name) {
  const IsoSurface surface = marching_cubes({}, grid);
  const SnapClusters clusters = find_snap_clusters({}, surface, epsilon);
  const SnapMerges fast = merge_snap_clusters(with_threads(2), surface.mesh.triangles, clusters);
  const SnapMerges slow =
      merge_snap_clusters(with_threads(1), surface.mesh.triangles, clusters, true);
  EXPECT_EQ(fast.target, slow.target) << name << ", epsilon " << epsilon;
  EXPECT_EQ(fast.next, slow.next) << name << ", epsilon " << epsilon;
  EXPECT_EQ(fast.dropped, slow.dropped) << name << ", epsilon " << epsilon;
  EXPECT_EQ(fast.refused, slow.refused) << name << ", epsilon " << epsilon;
  EXPECT_EQ(slow.careful, clusters.count());
  return {clusters.count(), fast.careful};
}

TEST(SnapCollapse, ParallelClustersEndAsInOrder) {
  Compared noises, balls;
  for (std::uint32_t seed = 0; seed < 40; ++seed)
    for (const double epsilon : {0.0, 0.1, 0.15, 0.25, 0.35, 0.45, 0.5}) {
      const Compared a =
          compare(noise(12, seed, seed % 2 == 0 ? 0 : 2 + static_cast<int>(seed % 7)), epsilon,
                  "noise " + std::to_string(seed));
      noises = {noises.clusters + a.clusters, noises.careful + a.careful};
      if (seed % 4 != 0)
        continue;
      const Compared b = compare(metaballs(24, seed), epsilon, "metaballs " + std::to_string(seed));
      balls = {balls.clusters + b.clusters, balls.careful + b.careful};
    }
  // Both ways are tried, and smooth surfaces hardly need the slow one.
  EXPECT_GT(noises.careful, noises.clusters / 20);
  EXPECT_LT(noises.careful, noises.clusters);
  EXPECT_GT(balls.clusters, 1000U);
  EXPECT_LT(balls.careful, balls.clusters / 5);
}

TEST(SnapCollapse, ThreadsGiveEqualBytes) {
  for (const double epsilon : {0.0, 0.15, 0.5}) {
    const IsoSurface surface = marching_cubes(with_threads(1), metaballs(64, 3));
    const SnapResult one = snap(with_threads(1), surface, {.epsilon = epsilon});
    for (const int threads : {2, 3, 7}) {
      const SnapResult more = snap(with_threads(threads), surface, {.epsilon = epsilon});
      EXPECT_EQ(one.mesh.points, more.mesh.points);
      EXPECT_EQ(one.mesh.triangles, more.mesh.triangles);
    }
  }
}

TEST(SnapCollapse, ClustersAreThoseOfAPlainSearch) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const IsoSurface surface = marching_cubes({}, noise(14, seed, seed % 3 == 0 ? 4 : 0));
    const SnapClusters clusters = find_snap_clusters({}, surface, 0.3);
    std::map<Int3, std::vector<std::uint32_t>> corners;
    for (std::uint32_t p = 0; p < surface.crossings.size(); ++p)
      if ((clusters.flags[p] & (snaps_low | snaps_high)) != 0)
        corners[snap_corner(surface.crossings[p], clusters.flags[p])].push_back(p);
    EXPECT_EQ(clusters.corners, corners.size());
    std::size_t found = 0, fins = 0;
    for (std::size_t n = 0; n < clusters.count(); ++n) {
      std::vector<std::uint32_t> members;
      for (const std::uint32_t p : clusters.members_of(n))
        if ((clusters.flags[p] & fin) == 0)
          members.push_back(p);
        else
          ++fins;
      const std::uint32_t first = clusters.first_member[n];
      EXPECT_EQ(members, corners[snap_corner(surface.crossings[first], clusters.flags[first])]);
      EXPECT_EQ(members.front(), first);
      found += members.size() > 1 ? 1 : 0;
    }
    EXPECT_EQ(fins, clusters.fins);
    EXPECT_EQ(found, static_cast<std::size_t>(std::ranges::count_if(
                         corners, [](const auto& corner) { return corner.second.size() > 1; })));
  }
}

TEST(SnapCollapse, RefusesPointsInAnotherOrder) {
  IsoSurface surface = marching_cubes({}, metaballs(24, 1));
  std::swap(surface.crossings[10], surface.crossings[11]);
  EXPECT_THROW(snap({}, surface, {}), Error);
}

} // namespace
} // namespace gewebe
