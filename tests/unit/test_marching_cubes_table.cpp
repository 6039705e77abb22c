// The table of marching cubes, over all 256 cases.

#include "geometry/vec3.h"
#include "surface/marching_cubes_table.h"
#include "tests/unit/larger.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <map>
#include <set>
#include <utility>

namespace gewebe::test {
namespace {

using Segment = std::pair<int, int>; // from edge to edge

bool crossed(int inside, int e) {
  const surface::CellEdge edge = surface::cell_edges[static_cast<std::size_t>(e)];
  return ((inside >> edge.corner ^ inside >> (edge.corner | 1 << edge.axis)) & 1) != 0;
}

/// Does edge e lie in the face of `axis` at `side`?
bool in_face(int e, int axis, int side) {
  const surface::CellEdge edge = surface::cell_edges[static_cast<std::size_t>(e)];
  return edge.axis != axis && (edge.corner >> axis & 1) == side;
}

/// The directed sides of a case's triangles whose reverse is not a side too.
std::set<Segment> border(const surface::CellCase& cell) {
  std::set<Segment> sides;
  for (std::size_t t = 0; t < cell.count; ++t)
    for (std::size_t n = 0; n < 3; ++n)
      EXPECT_TRUE(sides.insert({cell.triangles[t][n], cell.triangles[t][(n + 1) % 3]}).second);
  std::set<Segment> open;
  for (const Segment& s : sides)
    if (!sides.contains({s.second, s.first}))
      open.insert(s);
  return open;
}

/// The border segments in a face, as pairs of edges of that face named by (axis, corner without the
/// face's own bit), so that the two cells at a face name them alike.
std::set<std::pair<Int3, Int3>> face_segments(const surface::CellCase& cell, int axis, int side) {
  const auto name = [&](int e) {
    const surface::CellEdge edge = surface::cell_edges[static_cast<std::size_t>(e)];
    return Int3{edge.axis, edge.corner & ~(1 << axis), 0};
  };
  std::set<std::pair<Int3, Int3>> result;
  for (const auto& [a, b] : border(cell))
    if (in_face(a, axis, side) && in_face(b, axis, side))
      result.insert({name(a), name(b)});
  return result;
}

Vec3 corner_position(int c) {
  return {static_cast<double>(c & 1), static_cast<double>(c >> 1 & 1), static_cast<double>(c >> 2)};
}
Vec3 middle(int e) {
  const surface::CellEdge edge = surface::cell_edges[static_cast<std::size_t>(e)];
  return (corner_position(edge.corner) + corner_position(edge.corner | 1 << edge.axis)) / 2;
}

TEST(MarchingCubesTable, EdgesStartAtTheLowerCorner) {
  std::set<std::pair<int, int>> ends;
  for (const surface::CellEdge& edge : surface::cell_edges) {
    EXPECT_EQ(edge.corner >> edge.axis & 1, 0);
    ends.insert({edge.corner, edge.axis});
  }
  EXPECT_EQ(ends.size(), 12U);
}

TEST(MarchingCubesTable, UsesExactlyTheCrossedEdges) {
  for (int inside = 0; inside < 256; ++inside) {
    const surface::CellCase& cell =
        surface::marching_cubes_table()[static_cast<std::size_t>(inside)];
    ASSERT_LE(cell.count, surface::max_cell_triangles);
    std::set<int> used;
    for (std::size_t t = 0; t < cell.count; ++t)
      used.insert(cell.triangles[t].begin(), cell.triangles[t].end());
    for (int e = 0; e < 12; ++e) {
      EXPECT_EQ(crossed(inside, e), used.contains(e)) << "case " << inside << " edge " << e;
      EXPECT_EQ(crossed(inside, e), (cell.edges >> e & 1) != 0);
    }
  }
}

TEST(MarchingCubesTable, BorderIsClosedLoopsInTheFaces) {
  for (int inside = 0; inside < 256; ++inside) {
    const surface::CellCase& cell =
        surface::marching_cubes_table()[static_cast<std::size_t>(inside)];
    std::map<int, int> out, in;
    for (const auto& [a, b] : border(cell)) {
      ++out[a];
      ++in[b];
      int faces = 0;
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
          faces += in_face(a, axis, side) && in_face(b, axis, side) ? 1 : 0;
      EXPECT_EQ(faces, 1) << "case " << inside;
    }
    for (int e = 0; e < 12; ++e) {
      EXPECT_EQ(out[e], crossed(inside, e) ? 1 : 0) << "case " << inside;
      EXPECT_EQ(in[e], crossed(inside, e) ? 1 : 0) << "case " << inside;
    }
  }
}

TEST(MarchingCubesTable, NoDiagonalLiesInAFace) {
  for (int inside = 0; inside < 256; ++inside) {
    const surface::CellCase& cell =
        surface::marching_cubes_table()[static_cast<std::size_t>(inside)];
    const std::set<Segment> open = border(cell);
    for (std::size_t t = 0; t < cell.count; ++t)
      for (std::size_t n = 0; n < 3; ++n) {
        const int a = cell.triangles[t][n], b = cell.triangles[t][(n + 1) % 3];
        if (open.contains({a, b}))
          continue;
        for (int axis = 0; axis < 3; ++axis)
          for (int side = 0; side < 2; ++side)
            EXPECT_FALSE(in_face(a, axis, side) && in_face(b, axis, side)) << "case " << inside;
      }
  }
}

/// Neighbouring cells agree on their common face for all pairs of cases. Returns the disagreements.
int disagreements(const std::array<surface::CellCase, 256>& table) {
  int count = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int a = 0; a < 256; ++a)
      for (int b = 0; b < 256; ++b) {
        bool fit = true;
        for (int c = 0; c < 8; ++c)
          if ((c >> axis & 1) == 0)
            fit = fit && (a >> (c | 1 << axis) & 1) == (b >> c & 1);
        if (!fit)
          continue;
        std::set<std::pair<Int3, Int3>> reversed;
        for (const auto& [from, to] : face_segments(table[static_cast<std::size_t>(b)], axis, 0))
          reversed.insert({to, from});
        count += face_segments(table[static_cast<std::size_t>(a)], axis, 1) != reversed ? 1 : 0;
      }
  return count;
}

TEST(MarchingCubesTable, NeighboursAgreeForAllPairs) {
  EXPECT_EQ(disagreements(surface::marching_cubes_table()), 0);
}

TEST(MarchingCubesTable, NeighboursOfATableByComplementDisagree) {
  // The table of 1987 takes a case with more than four inside corners from its complement.
  std::array<surface::CellCase, 256> table = surface::marching_cubes_table();
  for (unsigned inside = 0; inside < 256; ++inside)
    if (std::popcount(inside) > 4) {
      table[inside] = table[255 - inside];
      for (auto& triangle : table[inside].triangles)
        std::swap(triangle[1], triangle[2]);
    }
  EXPECT_GT(disagreements(table), 0);
}

TEST(MarchingCubesTable, FacesOutward) {
  for (int inside = 0; inside < 256; ++inside) {
    const surface::CellCase& cell =
        surface::marching_cubes_table()[static_cast<std::size_t>(inside)];
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side)
        for (const auto& [a, b] : border(cell)) {
          if (!in_face(a, axis, side) || !in_face(b, axis, side))
            continue;
          // The face's normal times the segment's direction points to the outside of the body.
          Vec3 normal;
          normal[axis] = side == 1 ? 1 : -1;
          const Vec3 outward = cross(normal, middle(b) - middle(a));
          for (const int e : {a, b}) {
            const surface::CellEdge edge = surface::cell_edges[static_cast<std::size_t>(e)];
            for (const int c : {int{edge.corner}, edge.corner | 1 << edge.axis}) {
              const double distance = dot(corner_position(c) - middle(e), outward);
              EXPECT_NE(distance, 0);
              EXPECT_EQ(distance < 0, (inside >> c & 1) != 0) << "case " << inside;
            }
          }
        }
  }
}

TEST(MarchingCubesTable, FacesAwayFromCornersHaveAnArea) {
  // With crossings at 0.001 or more from the ends of their edges. The normal a×b + b×c + c×a of a
  // face is linear in each of its three fractions, so a component of one sign at the eight ends of
  // their ranges is nowhere smaller than at these.
  constexpr double margin = 1e-3;
  for (const surface::CellCase& cell : surface::marching_cubes_table())
    for (std::size_t t = 0; t < cell.count; ++t) {
      double best = 0; // over directions
      for (int direction = 1; direction < 27; ++direction) {
        const int j = direction / 3 % 3, k = direction / 9;
        const Vec3 d{direction % 3 - 1.0, j - 1.0, k - 1.0};
        if (d == Vec3{})
          continue;
        double smallest = HUGE_VAL;
        for (unsigned ends = 0; ends < 8; ++ends) {
          std::array<Vec3, 3> p;
          for (std::size_t n = 0; n < 3; ++n) {
            const surface::CellEdge& edge = surface::cell_edges[cell.triangles[t][n]];
            p[n] = {1.0 * (edge.corner & 1), 1.0 * (edge.corner >> 1 & 1),
                    1.0 * (edge.corner >> 2)};
            p[n][edge.axis] += (ends >> n & 1) != 0 ? 1 - margin : margin;
          }
          smallest = test::smaller(smallest, dot(d, cross(p[1] - p[0], p[2] - p[0])));
        }
        best = test::larger(best, smallest / norm(d));
      }
      EXPECT_GT(best, 1e-7); // the longest side's square is 3 at most; no area means 1e-12 of it
    }
}

} // namespace
} // namespace gewebe::test
