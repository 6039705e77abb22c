// The clusters that are taken in parallel end as if all were taken one after the other.

#include "surface/snap_collapse_internal.h"

#include "tests/unit/surface_scenes.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using namespace scenes;

Context with_threads(int threads) {
  Context context;
  context.threads = threads;
  return context;
}

using Place = surface::SnapOptions::Place;

/// All that merge_snap_clusters tells, in an order of its own.
struct Outcome {
  std::map<std::uint32_t, std::uint32_t> targets; // of points that were merged
  std::map<std::uint32_t, std::array<double, 3>> places;
  std::vector<std::uint32_t> dropped;
  std::uint64_t clusters = 0, corners = 0, refused = 0, careful = 0, marked = 0;

  bool ends_as(const Outcome& o) const {
    return targets == o.targets && places == o.places && dropped == o.dropped &&
           clusters == o.clusters && corners == o.corners && refused == o.refused &&
           marked == o.marked;
  }
};

surface::SnapLattice lattice_of(const surface::IsoSurface& surface, double epsilon) {
  return surface::SnapLattice({}, *surface.lattice, epsilon, surface.transform.determinant() < 0);
}

Outcome merge(const surface::IsoSurface& surface, double epsilon, Place place, int threads,
              bool always_careful) {
  surface::SnapLattice lattice = lattice_of(surface, epsilon);
  const surface::SnapMerges merges =
      surface::merge_snap_clusters(with_threads(threads), lattice, place, always_careful);
  Outcome result{
      {}, {}, merges.dropped, merges.clusters, merges.corners, merges.refused, merges.careful};
  for (const auto& part : merges.places)
    for (const surface::SnapMerges::Place& p : part)
      result.places[p.point] = {p.position.x, p.position.y, p.position.z};
  for (std::size_t n = 0; n < surface.lattice->blocks.size(); ++n)
    for (std::size_t w = 0; w < 24; ++w) {
      result.marked += surface::count_bits(lattice.snaps(n).looked_at[w]);
      for (std::uint64_t bits = lattice.snaps(n).merged[w]; bits != 0; bits &= bits - 1) {
        const std::uint32_t p =
            lattice.block(n).point(w, static_cast<unsigned>(std::countr_zero(bits)));
        result.targets[p] = merges.target[p];
      }
    }
  return result;
}

struct Compared {
  std::size_t clusters = 0, careful = 0;
};

Compared compare(const volume::Grid& grid, double epsilon, const std::string& name) {
  const surface::IsoSurface surface = surface::marching_cubes_to_snap({}, grid);
  const Place place = name.size() % 2 == 0 ? Place::mean : Place::corner;
  const Outcome fast = merge(surface, epsilon, place, 2, false),
                slow = merge(surface, epsilon, place, 1, true);
  EXPECT_TRUE(fast.ends_as(slow)) << name << ", epsilon " << epsilon;
  EXPECT_EQ(slow.careful, slow.clusters);
  return {fast.clusters, fast.careful};
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
    const surface::IsoSurface surface = surface::marching_cubes(with_threads(1), metaballs(64, 3));
    const surface::SnapResult one = surface::snap(with_threads(1), surface, {.epsilon = epsilon});
    for (const int threads : {2, 3, 7}) {
      const surface::SnapResult more =
          surface::snap(with_threads(threads), surface, {.epsilon = epsilon});
      EXPECT_EQ(one.mesh.points, more.mesh.points);
      EXPECT_EQ(one.mesh.triangles, more.mesh.triangles);
    }
  }
}

TEST(SnapCollapse, AnotherOutcomeIsSeen) {
  // Negative control of the comparison: each thing told counts.
  const surface::IsoSurface surface = surface::marching_cubes_to_snap({}, metaballs(24, 3));
  const Outcome outcome = merge(surface, 0.3, Place::mean, 1, false);
  ASSERT_FALSE(outcome.targets.empty());
  EXPECT_TRUE(outcome.ends_as(merge(surface, 0.3, Place::mean, 1, true)));
  EXPECT_FALSE(outcome.ends_as(merge(surface, 0.31, Place::mean, 1, false)));
  EXPECT_FALSE(outcome.ends_as(merge(surface, 0.3, Place::corner, 1, false)));
  Outcome other = outcome;
  ++other.targets.begin()->second;
  EXPECT_FALSE(outcome.ends_as(other));
  other = outcome;
  other.places.begin()->second[1] += 1e-15 * other.places.begin()->second[1];
  EXPECT_FALSE(outcome.ends_as(other));
  other = outcome;
  ++other.dropped.front();
  EXPECT_FALSE(outcome.ends_as(other));
}

Int3 corner_of(const surface::EdgeCrossing& crossing, double epsilon) {
  Int3 corner = crossing.corner;
  if (!(crossing.fraction <= epsilon))
    ++corner[static_cast<std::size_t>(crossing.axis)];
  return corner;
}

bool snaps(const surface::EdgeCrossing& crossing, double epsilon) {
  return crossing.fraction <= epsilon || 1 - crossing.fraction <= epsilon;
}

TEST(SnapLattice, CornersAreThoseOfAPlainSearch) {
  constexpr double epsilon = 0.3;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const surface::IsoSurface surface =
        surface::marching_cubes_to_snap({}, noise(14, seed, seed % 3 == 0 ? 4 : 0));
    const std::vector<surface::EdgeCrossing> crossings = surface::edge_crossings(surface);
    const surface::SnapLattice lattice = lattice_of(surface, epsilon);
    std::map<Int3, std::vector<std::uint32_t>> corners;
    for (std::uint32_t p = 0; p < crossings.size(); ++p)
      if (snaps(crossings[p], epsilon))
        corners[corner_of(crossings[p], epsilon)].push_back(p);
    std::size_t some = 0;
    for (std::size_t n = 0; n < lattice.count(); ++n) {
      const surface::SnapLattice::Corners drawn = lattice.corners(n);
      for (int bit = 0; bit < volume::leaf_voxels; ++bit) {
        const Int3 corner{bit >> 6, bit >> 3 & 7, bit & 7};
        const auto found = corners.find(lattice.absolute(n, corner));
        const auto slice = static_cast<std::size_t>(corner[0]);
        ASSERT_EQ((drawn.some.at(slice) >> (bit & 63) & 1) != 0, found != corners.end());
        if (found == corners.end())
          continue;
        ++some;
        const bool draws_fin = !lattice.fins_at(found->first).empty();
        EXPECT_EQ((drawn.several.at(slice) >> (bit & 63) & 1) != 0,
                  found->second.size() > 1 || draws_fin);
        std::vector<std::uint32_t> members;
        lattice.for_members(n, corner, [&](const surface::LatticeEdge& edge) {
          members.push_back(lattice.point_on(lattice.spot(n, edge.start), edge.axis));
        });
        std::ranges::sort(members);
        EXPECT_EQ(members, found->second);
        EXPECT_EQ(lattice.first_member(n, corner), found->second.front());
      }
    }
    EXPECT_EQ(some, corners.size());
  }
}

/// The points that snap nowhere, as opposed to all their neighbours, which snap to two corners at
/// most, or to `max` of them.
std::set<std::uint32_t> plain_fins(const surface::IsoSurface& surface, double epsilon,
                                   std::size_t max) {
  const std::vector<surface::EdgeCrossing> crossings = surface::edge_crossings(surface);
  std::map<std::uint32_t, std::set<std::uint32_t>> neighbours;
  for (const Triangle& t : surface.mesh.triangles)
    for (const std::uint32_t p : t)
      if (!snaps(crossings[p], epsilon))
        neighbours[p].insert(t.begin(), t.end());
  std::set<std::uint32_t> fins;
  for (auto& [p, around] : neighbours) {
    around.erase(p);
    std::set<Int3> corners;
    bool all = true;
    for (const std::uint32_t q : around) {
      all = all && snaps(crossings[q], epsilon);
      corners.insert(corner_of(crossings[q], epsilon));
    }
    if (all && corners.size() <= max)
      fins.insert(p);
  }
  return fins;
}

TEST(SnapLattice, FinsAreThoseOfAPlainSearch) {
  std::size_t found = 0, with_three = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed)
    for (const double epsilon : {0.15, 0.3, 0.4}) {
      const surface::IsoSurface surface =
          surface::marching_cubes({}, noise(14, seed, seed % 3 == 0 ? 4 : 0));
      std::set<std::uint32_t> fins;
      const surface::SnapLattice lattice = lattice_of(surface, epsilon);
      for (const surface::SnapFin& f : lattice.fins())
        fins.insert(f.point);
      EXPECT_EQ(fins, plain_fins(surface, epsilon, 2));
      found += fins.size();
      with_three += plain_fins(surface, epsilon, 3).size();
    }
  EXPECT_GT(found, 100U);
  EXPECT_GT(with_three, found); // negative control: another rule finds others
}

TEST(SnapCollapse, MeshIsNotLookedAt) {
  const volume::Grid grid = metaballs(24, 1);
  const surface::IsoSurface plain = surface::marching_cubes({}, grid),
                            bare = surface::marching_cubes_to_snap({}, grid);
  EXPECT_FALSE(plain.mesh.triangles.empty());
  EXPECT_TRUE(bare.mesh.points.empty() && bare.mesh.triangles.empty());
  const surface::SnapResult a = surface::snap({}, plain, {}), b = surface::snap({}, bare, {});
  EXPECT_EQ(a.mesh.points, b.mesh.points);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.report.triangles_before, plain.mesh.triangles.size());
  EXPECT_EQ(b.report.triangles_before, plain.mesh.triangles.size());
}

} // namespace
} // namespace gewebe::test
