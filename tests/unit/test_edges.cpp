// Edges, borders and repeated faces against maps and pairwise comparison.

#include "mesh/border.h"
#include "mesh/edges.h"
#include "mesh/repeated_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using Ends = std::array<std::uint32_t, 2>;

/// Corners below `points`; some triangles have equal ones.
std::vector<Triangle> random_triangles(std::mt19937& random, std::size_t count,
                                       std::uint32_t points) {
  std::vector<Triangle> triangles(count);
  for (Triangle& t : triangles)
    for (std::uint32_t& corner : t)
      corner = static_cast<std::uint32_t>(random() % points);
  return triangles;
}

/// A hub under many triangles, more than a short sort is for, and some beside it.
std::vector<Triangle> fan(std::uint32_t count) {
  std::vector<Triangle> triangles;
  for (std::uint32_t n = 0; n < count; ++n)
    triangles.push_back({0, count - n, (count - n) % count + 1});
  triangles.push_back({1, 2, count + 1});
  return triangles;
}

struct SideOfFace {
  std::uint32_t face, low_corner, high_corner, opposite;
  bool backward;
  bool operator==(const SideOfFace&) const = default;
};

/// Who meets in each edge, by faces in turn.
std::map<Ends, std::vector<SideOfFace>> edges_by_map(const std::vector<Triangle>& triangles) {
  std::map<Ends, std::vector<SideOfFace>> edges;
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    if (std::set<std::uint32_t>(t.begin(), t.end()).size() < 3)
      continue;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t from = 3 * f + k, to = 3 * f + (k + 1) % 3, off = 3 * f + (k + 2) % 3;
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      edges[{std::min(a, b), std::max(a, b)}].push_back(a < b ? SideOfFace{f, from, to, off, false}
                                                              : SideOfFace{f, to, from, off, true});
    }
  }
  return edges;
}

void expect_equal(const mesh::EdgeSides& sides,
                  const std::map<Ends, std::vector<SideOfFace>>& expected) {
  auto at = expected.begin();
  sides.for_each_edge([&](std::uint32_t low, std::span<const mesh::EdgeSide> edge) {
    ASSERT_NE(at, expected.end());
    EXPECT_EQ((Ends{low, edge[0].high()}), at->first);
    std::vector<SideOfFace> runs;
    int forward = 0;
    for (const mesh::EdgeSide& s : edge) {
      runs.push_back({s.face(), s.low_corner(), s.high_corner(), s.corner(), s.backward()});
      forward += s.backward() ? -1 : 1;
    }
    EXPECT_EQ(runs, at->second);
    EXPECT_EQ(mesh::surplus(edge), forward);
    ++at;
  });
  EXPECT_EQ(at, expected.end());
}

TEST(Edges, SidesAndTableEqualAMap) {
  std::mt19937 random(7);
  for (int round = 0; round < 23; ++round) {
    const std::uint32_t points = round < 20 ? 15 : 70000; // more than one range
    const std::vector<Triangle> triangles =
        round == 0 ? std::vector<Triangle>()
                   : random_triangles(random, round < 20 ? 60 : 9000, points);
    const auto expected = edges_by_map(triangles);
    expect_equal(mesh::EdgeSides(points, triangles), expected);
    Context two;
    two.threads = 2;
    expect_equal(mesh::EdgeSides(points, triangles, two), expected);

    const mesh::EdgeTable table = mesh::edge_table(triangles, points, two);
    ASSERT_EQ(table.size(), expected.size());
    std::size_t e = 0;
    for (const auto& [ends, runs] : expected) {
      EXPECT_EQ(table.ends[e], ends);
      std::vector<std::uint32_t> corners;
      for (const SideOfFace& run : runs)
        corners.push_back(run.opposite);
      EXPECT_TRUE(std::ranges::equal(table.around(e), corners));
      ++e;
    }
  }
  expect_equal(mesh::EdgeSides(1002, fan(1000)), edges_by_map(fan(1000)));
}

TEST(Edges, BordersEqualThoseOfAMap) {
  std::mt19937 random(8);
  for (int round = 0; round < 20; ++round) {
    const std::vector<Triangle> triangles = random_triangles(random, 40, 20);
    std::set<std::uint32_t> open;
    for (const auto& [ends, runs] : edges_by_map(triangles))
      if (runs.size() == 1)
        open.insert(ends.begin(), ends.end());
    EXPECT_EQ(mesh::border_points(20, triangles),
              std::vector<std::uint32_t>(open.begin(), open.end()));
  }
}

TEST(Edges, OppositeSidesJoinFaces) {
  const std::vector<Triangle> tetrahedron{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  std::vector<Triangle> two = tetrahedron;
  for (const Triangle& t : tetrahedron)
    two.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  std::vector<std::uint32_t> set;
  DisjointSets faces(8);
  EXPECT_TRUE(mesh::join_opposite_sides(8, two, faces));
  EXPECT_EQ(faces.number(set), 2U);
  EXPECT_TRUE(mesh::closed_by_index(8, two));

  std::swap(two[5][0], two[5][1]); // closed, but one face disagrees
  DisjointSets again(8);
  EXPECT_FALSE(mesh::join_opposite_sides(8, two, again));
  EXPECT_TRUE(mesh::closed_by_index(8, two));
  two.pop_back();
  EXPECT_FALSE(mesh::closed_by_index(8, two));
}

TEST(RepeatedFaces, EqualThoseOfPairwiseComparison) {
  std::mt19937 random(9);
  const auto rotated = [](Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  const auto sorted = [](Triangle t) {
    std::sort(t.begin(), t.end());
    return t;
  };
  for (int round = 0; round < 30; ++round) {
    std::vector<Triangle> triangles = random_triangles(random, 200, 6);
    std::vector<std::int32_t> part;
    for (std::size_t f = 0; f < triangles.size() && round % 2 != 0; ++f)
      part.push_back(static_cast<std::int32_t>(random() % 3));
    for (const mesh::SameFace same : {mesh::SameFace::corners, mesh::SameFace::orientation}) {
      if (same == mesh::SameFace::orientation) {
        std::erase_if(triangles, mesh::has_equal_corners);
        part.resize(part.empty() ? 0 : triangles.size());
      }
      std::vector<bool> expected(triangles.size());
      for (std::size_t g = 0; g < triangles.size(); ++g)
        for (std::size_t f = 0; f < g; ++f) {
          const Triangle &a = triangles[f], &b = triangles[g];
          const bool equal =
              same == mesh::SameFace::corners ? sorted(a) == sorted(b) : rotated(a) == rotated(b);
          if (equal && (part.empty() || part[f] == part[g]))
            expected[g] = true;
        }
      EXPECT_EQ(mesh::repeated_faces(6, triangles, same, part), expected);
    }
  }
}

} // namespace
} // namespace gewebe::test
