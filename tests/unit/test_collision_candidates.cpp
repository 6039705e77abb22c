#include "collision/candidates.h"

#include "base/error.h"
#include "collision/bvh.h"
#include "collision/candidate_filter.h"
#include "collision/distance.h"
#include "collision/edge_triangle.h"
#include "collision/inside.h"
#include "collision_pairs.h"
#include "collision_scene.h"
#include "numeric/larger.h"
#include "rational_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::collision {
namespace {

using test::random_point;

std::vector<Box3> random_boxes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Box3> boxes(count);
  for (Box3& box : boxes) {
    const Vec3 p = random_point(random, 5);
    box.add(p);
    box.add(p + random_point(random, 0.5));
  }
  return boxes;
}

using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

TEST(Bvh, FindsWhatABruteSearchFinds) {
  for (const std::size_t count : {0U, 1U, 3U, 5U, 64U, 700U}) {
    std::vector<Box3> boxes = random_boxes(count, 1), others = random_boxes(200, 2);
    Bvh tree(boxes);
    const Bvh other(others);
    for (int round = 0; round < 2; ++round) {
      ASSERT_EQ(tree.size(), count);
      Pairs found, expected, own, own_expected;
      tree.for_each_pair(other, [&](std::uint32_t a, std::uint32_t b) {
        EXPECT_TRUE(found.insert({a, b}).second);
      });
      tree.for_each_own_pair([&](std::uint32_t a, std::uint32_t b) {
        EXPECT_TRUE(own.insert({a, b}).second);
      });
      for (std::uint32_t a = 0; a < count; ++a) {
        for (std::uint32_t b = 0; b < others.size(); ++b)
          if (meet(boxes[a], others[b]))
            expected.insert({a, b});
        for (std::uint32_t b = a + 1; b < count; ++b)
          if (meet(boxes[a], boxes[b]))
            own_expected.insert({a, b});
      }
      EXPECT_EQ(found, expected);
      EXPECT_EQ(own, own_expected);
      for (std::uint32_t b = 0; b < 20; ++b) {
        std::vector<std::uint32_t> met;
        tree.for_each_overlapping(others[b], [&](std::uint32_t a) { met.push_back(a); });
        std::sort(met.begin(), met.end());
        std::vector<std::uint32_t> met_expected;
        for (std::uint32_t a = 0; a < count; ++a)
          if (meet(boxes[a], others[b]))
            met_expected.push_back(a);
        EXPECT_EQ(met, met_expected);
      }
      boxes = random_boxes(count, 3); // all go elsewhere
      tree.refit(boxes);
    }
  }
}

TEST(Bvh, NearestIsTheNearest) {
  const std::vector<Box3> boxes = random_boxes(500, 4);
  const Bvh tree(boxes);
  std::mt19937 random(5);
  for (int k = 0; k < 200; ++k) {
    const Vec3 p = random_point(random, 7);
    const auto to = [&](const Box3& box) {
      double sum = 0;
      for (int a = 0; a < 3; ++a) {
        const double off = std::max({box.min[a] - p[a], 0.0, p[a] - box.max[a]});
        sum += off * off;
      }
      return sum;
    };
    std::size_t measured = 0;
    const auto [item, distance] = tree.nearest(
        to,
        [&](std::uint32_t item_) {
          ++measured;
          return to(boxes[item_]);
        },
        std::numeric_limits<double>::infinity());
    std::size_t best = 0;
    for (std::size_t b = 1; b < boxes.size(); ++b)
      if (to(boxes[b]) < to(boxes[best]))
        best = b;
    EXPECT_EQ(item, best);
    EXPECT_EQ(distance, to(boxes[best]));
    EXPECT_LT(measured, 50U);
    EXPECT_EQ(tree.nearest(
                      to, [&](std::uint32_t i) { return to(boxes[i]); }, 0)
                  .first,
              boxes.size());
  }
}

TEST(Bvh, EmptyAndInfiniteBoxes) {
  std::vector<Box3> boxes = random_boxes(20, 6);
  boxes[3] = {};
  boxes[7].min.x = std::nan("");
  boxes[9].max.y = std::numeric_limits<double>::infinity();
  const Bvh tree(boxes);
  std::set<std::uint32_t> found;
  tree.for_each_overlapping({{-9, -9, -9}, {9, 9, 9}},
                            [&](std::uint32_t item) { found.insert(item); });
  EXPECT_EQ(found.size(), 18U);
  EXPECT_FALSE(found.contains(3) || found.contains(7));
}

TEST(CollisionSurface, CompletesEdgesPointsAndOwners) {
  CollisionSurface surface;
  surface.rest.resize(8);
  surface.triangles = {{0, 2, 1}, {1, 2, 3}};
  surface.edges = {{2, 1}, {5, 4}};
  surface.points = {6};
  complete_surface(surface);
  EXPECT_EQ(surface.edges, (std::vector<std::array<std::uint32_t, 2>>{
                               {0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}, {4, 5}}));
  EXPECT_EQ(surface.points, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(surface.lone_edges, (std::vector<std::uint32_t>{5}));
  EXPECT_EQ(surface.lone_points, (std::vector<std::uint32_t>{6}));
  surface.edges.push_back({1, 8});
  EXPECT_THROW(complete_surface(surface), Error);
  surface.edges.back() = {1, 1};
  EXPECT_THROW(complete_surface(surface), Error);
  surface.edges.back() = {1, 4};
  surface.owner[4] = surface.owner[5] = 1;
  EXPECT_THROW(complete_surface(surface), Error);
}

AllowedPairs all_but_self(std::size_t owners) {
  AllowedPairs allowed(owners, 1);
  for (std::size_t k = 0; k < owners; ++k)
    allowed.set(k, k, 0);
  return allowed;
}

TEST(Candidates, HoldAllPairsThatComeCloseOnTheWay) {
  for (unsigned seed = 1; seed < 4; ++seed) {
    const CollisionSurface surface = test::two_sheets(5, 0.25, 0.1, 0.2, seed);
    std::mt19937 random(seed);
    std::vector<Vec3> x1 = surface.rest;
    for (Vec3& p : x1)
      p += random_point(random, 0.3);
    AllowedPairs allowed = all_but_self(4);
    if (seed == 2)
      allowed.set(0, 0, 1);
    if (seed == 3)
      allowed.set(0, 1, 0);
    const double reach = 0.15;
    BroadPhase phase(surface);
    Candidates candidates, again;
    phase.find(surface, x1, surface.rest, reach, allowed, again); // another tree
    phase.find(surface, surface.rest, x1, reach, allowed, candidates);
    BroadPhase(surface).find(surface, surface.rest, x1, reach, allowed, again);
    EXPECT_EQ(candidates.edge_edge, again.edge_edge);
    EXPECT_EQ(candidates.point_triangle, again.point_triangle);
    std::set<std::array<std::uint32_t, 4>> edges(candidates.edge_edge.begin(),
                                                 candidates.edge_edge.end()),
        triangles(candidates.point_triangle.begin(), candidates.point_triangle.end());
    EXPECT_EQ(edges.size(), candidates.edge_edge.size());
    EXPECT_EQ(triangles.size(), candidates.point_triangle.size());
    const auto comes_close = [&](const std::array<std::uint32_t, 4>& v, auto&& squared) {
      for (int step = 0; step <= 10; ++step) {
        std::array<gewebe::Vec3, 4> x;
        for (std::size_t k = 0; k < 4; ++k)
          x[k] = surface.rest[v[k]] + step / 10.0 * (x1[v[k]] - surface.rest[v[k]]);
        if (std::sqrt(squared(x)) < reach + radius_sum(surface, v[0], v[3]))
          return true;
      }
      return false;
    };
    const auto may_meet = [&](const std::array<std::uint32_t, 4>& v) {
      return allowed.at(surface.owner[v[0]], surface.owner[v[3]]) != 0 &&
             std::set<std::uint32_t>(v.begin(), v.end()).size() == 4;
    };
    std::size_t close = 0;
    for (std::size_t i = 0; i < surface.edges.size(); ++i)
      for (std::size_t j = i + 1; j < surface.edges.size(); ++j) {
        const auto &a = surface.edges[i], &b = surface.edges[j];
        const std::array<std::uint32_t, 4> v{a[0], a[1], b[0], b[1]};
        const std::array<std::uint32_t, 4> w{b[0], b[1], a[0], a[1]};
        const bool listed = edges.contains(v) || edges.contains(w);
        if (!may_meet(v))
          EXPECT_FALSE(listed);
        else if (comes_close(v, [](const auto& x) { return edge_edge_squared_distance(x); })) {
          ++close;
          EXPECT_TRUE(listed) << i << " " << j;
        }
      }
    for (const std::uint32_t p : surface.points)
      for (const auto& t : surface.triangles) {
        const std::array<std::uint32_t, 4> v{p, t[0], t[1], t[2]};
        if (!may_meet(v))
          EXPECT_FALSE(triangles.contains(v));
        else if (comes_close(v, [](const auto& x) { return point_triangle_squared_distance(x); })) {
          ++close;
          EXPECT_TRUE(triangles.contains(v));
        }
      }
    const std::vector<std::uint32_t> vertices = vertices_of(candidates);
    std::set<std::uint32_t> all;
    for (const auto& pair : candidates.edge_edge)
      all.insert(pair.begin(), pair.end());
    for (const auto& pair : candidates.point_triangle)
      all.insert(pair.begin(), pair.end());
    EXPECT_TRUE(std::equal(all.begin(), all.end(), vertices.begin(), vertices.end()));
    EXPECT_GT(close, seed == 3 ? 5U : 100U);
    EXPECT_LT(candidates.size(), 30 * close);
  }
}

// Of a large surface only the groups of primitives near the box of the other owner are looked at.
TEST(Candidates, OfALargeSurfaceAreThoseNearTheOther) {
  const CollisionSurface surface = test::two_sheets(40, 0.25, 0.1, 0.2, 7);
  ASSERT_GT(surface.triangles.size(), 2048U);
  BroadPhase phase(surface);
  Candidates candidates;
  const double reach = 0.15;
  std::mt19937 random(5);
  for (int round = 0; round < 4; ++round) {
    // All goes elsewhere in each round, so that boxes of the last one are wrong.
    std::vector<Vec3> x0 = surface.rest, x1;
    for (std::size_t v = 0; v < x0.size(); ++v)
      x0[v] += surface.owner[v] < 2 ? Vec3{9.0 * round, 0, 0} : Vec3{8.0 * round, 3.0 * round, 0};
    x1 = x0;
    for (Vec3& p : x1)
      p += random_point(random, 0.3);
    phase.find(surface, x0, x1, reach, all_but_self(4), candidates);
    const std::set<std::array<std::uint32_t, 4>> found(candidates.point_triangle.begin(),
                                                       candidates.point_triangle.end());
    EXPECT_EQ(found.size(), candidates.point_triangle.size());
    std::size_t close = 0;
    for (const std::uint32_t p : surface.points)
      for (const auto& t : surface.triangles) {
        if (surface.owner[p] < 2)
          continue;
        const std::array<std::uint32_t, 4> v{p, t[0], t[1], t[2]};
        for (int step = 0; step <= 10; ++step) {
          std::array<Vec3, 4> x;
          for (std::size_t k = 0; k < 4; ++k)
            x[k] = x0[v[k]] + step / 10.0 * (x1[v[k]] - x0[v[k]]);
          if (std::sqrt(point_triangle_squared_distance(x)) >= reach + surface.radius[p])
            continue;
          ++close;
          EXPECT_TRUE(found.contains(v)) << round << " " << p;
          break;
        }
      }
    EXPECT_GT(close, 2U) << round;
    const auto of_round = [&](const auto& pair) { return surface.owner[pair[0]] > 1; };
    EXPECT_LT(std::ranges::count_if(candidates.point_triangle, of_round), 400) << round;
  }
}

TEST(Candidates, LonePointsAndEdgesAndFixedOnes) {
  CollisionSurface surface;
  surface.rest = {{0, 0, 0}, {0.05, 0, 0}, {0, 1, 0.05}, {0, -1, 0.05}, {9, 9, 9}, {9, 9, 9.05}};
  surface.owner = {0, 1, 2, 2, 3, 3};
  surface.points = {0, 1};
  surface.edges = {{2, 3}, {4, 5}};
  complete_surface(surface);
  const AllowedPairs allowed = all_but_self(4);
  Candidates found;
  const auto find = [&] {
    BroadPhase(surface).find(surface, surface.rest, surface.rest, 0.1, allowed, found);
  };
  find();
  EXPECT_EQ(found.point_point.size(), 1U);
  EXPECT_EQ(found.point_edge.size(), 2U);
  EXPECT_EQ(found.size(), 3U);
  surface.fixed = {1, 1, 0, 0, 0, 0};
  find();
  EXPECT_EQ(found.point_point.size(), 0U);
  EXPECT_EQ(found.point_edge.size(), 2U);
  surface.fixed = {1, 1, 1, 1, 0, 0};
  find();
  EXPECT_EQ(found.size(), 0U);
}

TEST(Candidates, AStepNeverEndsInAnIntersection) {
  int cut = 0;
  for (unsigned seed = 1; seed < 40; ++seed) {
    const CollisionSurface surface = test::two_sheets(4, 0.3, 0.1, 0.1, seed);
    std::mt19937 random(seed);
    std::vector<Vec3> x1 = surface.rest, x = surface.rest;
    for (std::size_t k = 0; k < x1.size(); ++k) {
      x1[k] += random_point(random, 0.6);
      if (surface.owner[k] == 0)
        x1[k].z += 0.5;
    }
    AllowedPairs allowed = all_but_self(4);
    allowed.set(0, 0, 1);
    allowed.set(1, 1, 1);
    Candidates candidates;
    BroadPhase(surface).find(surface, surface.rest, x1, 0.1, allowed, candidates);
    const double step = collision_free_step(surface, candidates, surface.rest, x1, {.share = 0.1});
    EXPECT_GT(step, 0);
    cut += step < 1;
    for (std::size_t k = 0; k < x.size(); ++k)
      x[k] += step * (x1[k] - x[k]);
    for (const auto& [a, b] : surface.edges)
      for (const auto& [p, q, r] : surface.triangles)
        if (a != p && a != q && a != r && b != p && b != q && b != r) {
          ASSERT_FALSE(test::passes(x[a], x[b], x[p], x[q], x[r]));
        }
    // Instruments keep their radius.
    for (const std::uint32_t p : surface.points)
      for (const auto& t : surface.triangles)
        if (surface.owner[p] > 1) {
          const std::array<Vec3, 4> y{x[p], x[t[0]], x[t[1]], x[t[2]]};
          EXPECT_GT(std::sqrt(point_triangle_squared_distance(y)), surface.radius[p]);
        }
  }
  EXPECT_GT(cut, 30);
}

TEST(Intersections, EdgeMeetsTriangleExactly) {
  std::mt19937 random(8);
  int meets = 0, coplanar = 0;
  for (int k = 0; k < 3000; ++k) {
    const bool lattice = k % 2 == 0;
    std::array<Vec3, 5> x;
    for (Vec3& p : x) {
      p = random_point(random, 2);
      if (lattice)
        p = {std::round(p.x), std::round(p.y), k % 4 == 0 ? 0 : std::round(p.z)};
    }
    std::array<test::Vector, 5> e;
    for (std::size_t i = 0; i < 5; ++i)
      e[i] = test::exact(x[i]);
    const test::Vector n = test::cross(test::minus(e[3], e[2]), test::minus(e[4], e[2]));
    if (test::squared(n) == 0) {
      EXPECT_FALSE(edge_meets_triangle(x[0], x[1], x[2], x[3], x[4]));
      continue;
    }
    // No distance from its ends, none from the sides, or a point within.
    bool expected = test::of_triangle({e[0], e[2], e[3], e[4]}) == 0 ||
                    test::of_triangle({e[1], e[2], e[3], e[4]}) == 0 ||
                    test::of_edges({e[0], e[1], e[2], e[3]}) == 0 ||
                    test::of_edges({e[0], e[1], e[3], e[4]}) == 0 ||
                    test::of_edges({e[0], e[1], e[4], e[2]}) == 0;
    const test::Number hp = test::dot(test::minus(e[0], e[2]), n),
                       hq = test::dot(test::minus(e[1], e[2]), n);
    coplanar += hp == 0 && hq == 0;
    if (sgn(hp) * sgn(hq) < 0) {
      const test::Number t = hp / (hp - hq);
      const test::Vector at = test::along(e[0], t, test::minus(e[1], e[0]));
      expected = expected || test::of_triangle({at, e[2], e[3], e[4]}) == 0;
    }
    EXPECT_EQ(edge_meets_triangle(x[0], x[1], x[2], x[3], x[4]), expected) << k;
    meets += expected;
  }
  EXPECT_GT(meets, 300);
  EXPECT_GT(coplanar, 150);
}

TEST(Intersections, AreThoseOfABruteSearch) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const CollisionSurface surface = test::two_sheets(8, 0.02, 0.05, 0.2, seed);
    std::mt19937 random(seed);
    std::vector<Vec3> x = surface.rest;
    for (Vec3& p : x)
      p += random_point(random, seed == 5 ? 0 : 0.2);
    AllowedPairs allowed = all_but_self(4);
    allowed.set(0, 0, 1);
    std::vector<Intersection> expected;
    for (std::uint32_t e = 0; e < surface.edges.size(); ++e)
      for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
        const auto [p, q] = surface.edges[e];
        const auto [a, b, c] = surface.triangles[t];
        if (allowed.at(surface.owner[p], surface.owner[a]) != 0 && surface.owner[p] < 2 &&
            std::set<std::uint32_t>{p, q, a, b, c}.size() == 5 &&
            edge_meets_triangle(x[p], x[q], x[a], x[b], x[c]))
          expected.push_back({e, t});
      }
    std::vector<Intersection> found =
        BroadPhase(surface).find_intersections(surface, x, allowed, 10000);
    std::sort(found.begin(), found.end(), [](const Intersection& a, const Intersection& b) {
      return std::pair(a.edge, a.triangle) < std::pair(b.edge, b.triangle);
    });
    EXPECT_EQ(found, expected);
    EXPECT_GT(expected.size(), 10U);
    EXPECT_EQ(BroadPhase(surface).find_intersections(surface, x, allowed, 3).size(), 3U);
  }
}

TEST(Inside, WindingNumberOfAClosedSurface) {
  // An octahedron, and a smaller one within it that faces inwards.
  std::vector<Vec3> x;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const double r : {1.0, -0.5}) {
    const std::uint32_t at = static_cast<std::uint32_t>(x.size());
    const double size = std::abs(r);
    x.insert(
        x.end(),
        {{size, 0, 0}, {-size, 0, 0}, {0, size, 0}, {0, -size, 0}, {0, 0, size}, {0, 0, -size}});
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const std::uint32_t a = at + octant % 2, b = at + 2 + octant / 2 % 2, c = at + 4 + octant / 4;
      const bool outward = dot(x[a], cross(x[b], x[c])) > 0;
      triangles.push_back(outward == (r > 0) ? std::array{a, b, c} : std::array{a, c, b});
    }
  }
  std::mt19937 random(9);
  for (int k = 0; k < 1000; ++k) {
    const Vec3 p = random_point(random, 1.2);
    const double size = std::abs(p.x) + std::abs(p.y) + std::abs(p.z);
    EXPECT_NEAR(winding_number(triangles, x, p), size < 1 && size > 0.5 ? 1 : 0, 1e-12);
  }
}

/// Gap of a pair, from its closest features.
template <std::size_t n>
double gap_at(const CollisionSurface& surface, std::span<const Vec3> x,
              const std::array<std::uint32_t, n>& vertices, bool edges) {
  std::array<Vec3, n> y;
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[vertices[k]];
  double square = 0;
  if constexpr (n == 2)
    square = dot(y[0] - y[1], y[0] - y[1]);
  else if constexpr (n == 3)
    square = point_edge_squared_distance(y);
  else
    square = edges ? edge_edge_squared_distance(y) : point_triangle_squared_distance(y);
  return std::sqrt(square) - radius_sum(surface, vertices.front(), vertices.back());
}

/// Two sheets, all that may meet on them, and a filter of that.
struct FilteredSheets {
  CollisionSurface surface = test::two_sheets(9, 0.3, 0.1, 0.4, 5);
  std::vector<Vec3> x = surface.rest;
  Candidates all;
  std::vector<std::uint32_t> vertices;
  CandidateFilter filter;

  FilteredSheets() {
    BroadPhase broad_phase(surface);
    broad_phase.find(surface, x, x, 2, AllowedPairs(4, 1), all);
    vertices = vertices_of(all);
    filter.reset(surface, all, broad_phase.gaps(), vertices, x);
  }
};

TEST(CandidateFilter, SelectsWhatMeasuringAllSelects) {
  FilteredSheets sheets;
  auto& [surface, x, all, vertices, filter] = sheets;
  std::mt19937 random(3);
  std::size_t selected = 0, calls = 0;
  for (int step = 0; step < 200; ++step) {
    const double size = step % 17 == 0 ? 0.3 : 1e-3; // far at times, so that the reference moves
    for (Vec3& p : x)
      p += size * random_point(random, 1);
    const double range = step % 3 == 0 ? 0.5 : 0.05;
    Candidates expected;
    const auto look = [&](const auto& list, bool edges, auto& to) {
      for (const auto& pair : list)
        if (gap_at(surface, x, pair, edges) <= range)
          to.push_back(pair);
    };
    look(all.point_point, false, expected.point_point);
    look(all.point_edge, false, expected.point_edge);
    look(all.edge_edge, true, expected.edge_edge);
    look(all.point_triangle, false, expected.point_triangle);
    const Candidates& near = filter.select(x, range);
    EXPECT_EQ(near.point_point, expected.point_point) << step;
    EXPECT_EQ(near.point_edge, expected.point_edge) << step;
    EXPECT_EQ(near.edge_edge, expected.edge_edge) << step;
    EXPECT_EQ(near.point_triangle, expected.point_triangle) << step;
    selected += near.size();
    ++calls;
  }
  EXPECT_GT(selected, 10 * calls);
  EXPECT_LT(selected, calls * all.size() / 2);
}

TEST(CandidateFilter, GoesAsFarAsAllCandidatesAllow) {
  FilteredSheets sheets;
  auto& [surface, x, all, vertices, filter] = sheets;
  std::mt19937 random(4);
  const Separation separation{0, 0.5, 0.02, 1000};
  std::size_t stopped = 0, passed = 0;
  for (int step = 0; step < 200; ++step) {
    const double size = step % 17 == 0 ? 1 : 0.03;
    const Vec3 together = random_point(random, 1);
    std::vector<Vec3> to = x;
    for (const std::uint32_t v : vertices)
      to[v] += together + size * random_point(random, 1);
    const double expected = collision_free_step(surface, all, x, to, separation);
    const double found = filter.free_step(x, to, separation);
    EXPECT_EQ(found, expected) << step;
    (found < 1 ? stopped : passed) += 1;
    for (const std::uint32_t v : vertices)
      x[v] += 0.5 * found * (to[v] - x[v]);
    if (step % 3 == 0)
      (void)filter.select(x, 0.05);
  }
  EXPECT_GT(stopped, 20U);
  EXPECT_GT(passed, 20U);
}

} // namespace
} // namespace gewebe::collision
