// The proof of the bounds of isosurface stuffing: every stencil, every way in which its corners may
// be warped, every place of its cut points (stuffing_angle_bounds.h).

#include "stuffing/bcc_internal.h"
#include "stuffing/stencils_internal.h"
#include "stuffing/stuffing.h"
#include "tests/unit/larger.h"
#include "tests/unit/stuffing_angle_bounds.h"
#include "tetrahedra/tet_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace gewebe::test {
namespace {

using angle_bounds::angles_are_within;
using angle_bounds::Range;

Vec3 corner(unsigned i) {
  return stuffing::bcc::position(stuffing::bcc::cell_point(stuffing::bcc::cell_tetrahedra[0][i]));
}

/// The range of a node where corner i is warped along direction warps[i].
Range range_of(const stuffing::StencilNode& node, const std::array<int, 4>& signs,
               const std::array<unsigned, 4>& warps, double alpha_long, double alpha_short) {
  const Vec3 from = corner(node.inner());
  const auto alpha = [&](unsigned d) {
    return stuffing::bcc::is_long(d) ? alpha_long : alpha_short;
  };
  if (node.is_cut()) {
    const Vec3 edge = corner(node.outer()) - from;
    const double a = alpha(stuffing::bcc::cell_directions[0][node.inner()][node.outer()]);
    return {from + edge * a, from + edge * (1 - a)};
  }
  if (signs[node.code] != 0)
    return {from, from};
  return {from, from + stuffing::bcc::step(warps[node.code]) * alpha(warps[node.code])};
}

/// Two corners never move towards each other: the cut point of their edge is nearer to one.
bool feasible(const std::array<int, 4>& signs, const std::array<unsigned, 4>& warps) {
  for (unsigned i = 0; i < 4; ++i)
    for (unsigned j = 0; j < i; ++j)
      if (signs[i] == 0 && signs[j] == 0 && warps[i] == stuffing::bcc::cell_directions[0][i][j] &&
          warps[j] == stuffing::bcc::cell_directions[0][j][i])
        return false;
  return true;
}

template <class Visit>
void for_each_stencil(Visit&& visit) {
  for (int n = 0; n < 81 * 4; ++n) {
    const std::array<int, 4> signs{n / 4 / 27 - 1, n / 4 / 9 % 3 - 1, n / 4 / 3 % 3 - 1,
                                   n / 4 % 3 - 1};
    visit(signs, stuffing::stencil(signs, (n & 1) != 0, (n & 2) != 0));
  }
}

/// Do all tetrahedra of a stencil, however its corners are warped?
bool keeps(const std::array<int, 4>& signs, const stuffing::Stencil& cut, double lowest,
           double highest, double alpha_long, double alpha_short) {
  unsigned ways = 1;
  for (const int sign : signs)
    ways *= sign == 0 ? stuffing::bcc::directions : 1;
  for (unsigned way = 0; way < ways; ++way) {
    std::array<unsigned, 4> warps{};
    for (unsigned i = 0, rest = way; i < 4; ++i)
      if (signs[i] == 0) {
        warps[i] = rest % stuffing::bcc::directions;
        rest /= stuffing::bcc::directions;
      }
    if (!feasible(signs, warps))
      continue;
    for (std::size_t t = 0; t < cut.count; ++t) {
      std::array<Range, 4> nodes;
      for (std::size_t k = 0; k < 4; ++k)
        nodes[k] = range_of(cut.tetrahedra[t][k], signs, warps, alpha_long, alpha_short);
      if (!angles_are_within(nodes, lowest, highest))
        return false;
    }
  }
  return true;
}

/// Do all stencils without a choice?
bool all_keep(double lowest, double highest, double alpha_long, double alpha_short) {
  bool result = true;
  for_each_stencil([&](const std::array<int, 4>& signs, const stuffing::Stencil& cut) {
    result = result && (cut.choice || keeps(signs, cut, lowest, highest, alpha_long, alpha_short));
  });
  return result;
}

TEST(StuffingAngles, EveryStencilKeepsTheBounds) {
  EXPECT_TRUE(all_keep(stuffing::stuffing_angle_min, stuffing::stuffing_angle_max,
                       stuffing::stuffing_alpha_long, stuffing::stuffing_alpha_short));
}

TEST(StuffingAngles, TheProofFindsWhatLeavesThem) {
  // Bounds a tenth of a degree narrower, and other shares of edges, don't hold.
  EXPECT_FALSE(all_keep(stuffing::stuffing_angle_min + 0.1, stuffing::stuffing_angle_max,
                        stuffing::stuffing_alpha_long, stuffing::stuffing_alpha_short));
  EXPECT_FALSE(all_keep(stuffing::stuffing_angle_min, stuffing::stuffing_angle_max - 0.15,
                        stuffing::stuffing_alpha_long, stuffing::stuffing_alpha_short));
  EXPECT_FALSE(
      all_keep(stuffing::stuffing_angle_min, stuffing::stuffing_angle_max, 0.24999, 0.41189));
}

double angle(const std::array<Vec3, 4>& p, std::size_t f, std::size_t g) {
  const auto normal_of = [&](std::size_t n) {
    const auto& face = tetrahedra::tetrahedron_faces[n];
    return cross(p[face[1]] - p[face[0]], p[face[2]] - p[face[0]]);
  };
  const Vec3 a = normal_of(f), b = normal_of(g);
  return std::atan2(norm(cross(a, b)), -dot(a, b)) * 180 / std::numbers::pi;
}

struct Extremes {
  double least = 180, largest = 0;
};
Extremes angles(const stuffing::Stencil& cut, const stuffing::StencilTetrahedra& tetrahedra,
                const std::array<std::array<double, 4>, 4>& shares) {
  Extremes result;
  for (std::size_t t = 0; t < cut.count; ++t) {
    std::array<Vec3, 4> p;
    for (std::size_t k = 0; k < 4; ++k) {
      const stuffing::StencilNode node = tetrahedra[t][k];
      p[k] = corner(node.inner());
      if (node.is_cut())
        p[k] += (corner(node.outer()) - p[k]) * shares[node.inner()][node.outer()];
    }
    for (std::size_t f = 0; f < 4; ++f)
      for (std::size_t g = 0; g < f; ++g) {
        result.least = test::smaller(result.least, angle(p, f, g));
        result.largest = test::larger(result.largest, angle(p, f, g));
      }
  }
  return result;
}

TEST(StuffingAngles, TheBetterOfTwoCutsKeepsThemByFar) {
  // Four cut points on short edges; each in steps of 1/12 of its range. The margin of a degree is
  // for what lies between.
  constexpr int steps = 12;
  const double a = stuffing::stuffing_alpha_short, width = 1 - 2 * a;
  int stencils = 0;
  for_each_stencil([&](const std::array<int, 4>& signs, const stuffing::Stencil& cut) {
    if (!cut.choice)
      return;
    if (++stencils > 1)
      return; // the others are this one with corners renamed
    Extremes all;
    std::vector<std::array<unsigned, 2>> edges;
    for (unsigned i = 0; i < 4; ++i)
      for (unsigned j = 0; j < 4; ++j)
        if (signs[i] > 0 && signs[j] < 0)
          edges.push_back({i, j});
    ASSERT_EQ(edges.size(), 4U);
    for (int n = 0; n < (steps + 1) * (steps + 1) * (steps + 1) * (steps + 1); ++n) {
      std::array<std::array<double, 4>, 4> shares{};
      int rest = n;
      for (const auto& [i, j] : edges) {
        shares[i][j] = a + width * (rest % (steps + 1)) / steps;
        rest /= steps + 1;
      }
      const Extremes one = angles(cut, cut.tetrahedra, shares),
                     other = angles(cut, cut.other, shares);
      const Extremes& taken = one.least >= other.least ? one : other;
      all.least = test::smaller(all.least, taken.least);
      all.largest = test::larger(all.largest, taken.largest);
    }
    EXPECT_GT(all.least, stuffing::stuffing_angle_min + 1);
    EXPECT_LT(all.largest, stuffing::stuffing_angle_max - 1);
  });
  EXPECT_EQ(stencils, 8);
}

TEST(StuffingAngles, OneDiagonalServesBothSidesOfAnInterface) {
  // As above, with the stencil of what lies beyond: it has the choice too, and its first way has
  // the diagonal of the first way here. The least is at ends of the ranges, 8.51.
  constexpr int steps = 12;
  const double a = stuffing::stuffing_alpha_short, width = 1 - 2 * a;
  const std::array<int, 4> signs{1, 1, -1, -1}, beyond{-1, -1, 1, 1};
  const stuffing::Stencil &here = stuffing::stencil(signs, true, true),
                          &there = stuffing::stencil(beyond, true, true);
  ASSERT_TRUE(here.choice && there.choice);
  Extremes all;
  for (int n = 0; n < (steps + 1) * (steps + 1) * (steps + 1) * (steps + 1); ++n) {
    std::array<std::array<double, 4>, 4> shares{};
    int rest = n;
    for (const unsigned i : {0U, 1U})
      for (const unsigned j : {2U, 3U}) {
        shares[i][j] = a + width * (rest % (steps + 1)) / steps;
        shares[j][i] = 1 - shares[i][j];
        rest /= steps + 1;
      }
    const auto both = [&](bool other) {
      const Extremes one = angles(here, other ? here.other : here.tetrahedra, shares),
                     two = angles(there, other ? there.other : there.tetrahedra, shares);
      return Extremes{test::smaller(one.least, two.least), test::larger(one.largest, two.largest)};
    };
    const Extremes one = both(false), other = both(true);
    const Extremes& taken = one.least >= other.least ? one : other;
    all.least = test::smaller(all.least, taken.least);
    all.largest = test::larger(all.largest, taken.largest);
  }
  EXPECT_GT(all.least, stuffing::stuffing_interface_angle_min);
  EXPECT_LT(all.largest, stuffing::stuffing_angle_max - 1);
}

} // namespace
} // namespace gewebe::test
