// The proof of the bounds of stuffing with cells of several sizes at the surface, as in
// test_stuffing_angles.cpp: four tetrahedra of the background, every stencil, every direction in
// which its corners may be warped, every place of its cut points. A corner may have round it cells
// of the size of the tetrahedron's or smaller ones, which allows for longer warps or nearer cuts;
// both are taken at once.

#include "base/parallel.h"
#include "stuffing/background_internal.h"
#include "stuffing/stencils_internal.h"
#include "stuffing/stuffing.h"
#include "tests/unit/stuffing_angle_bounds.h"
#include "tetrahedra/tet_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <vector>

namespace gewebe::test {
namespace {

using angle_bounds::angles_are_within;
using angle_bounds::Range;

struct Corner {
  Int3 place; ///< in quarters of the larger cell
  bool centre = false;
  std::vector<stuffing::Background::Node> kinds; ///< as which it may occur
};
using Shape = std::array<Corner, 4>;

/// In quarters of a cell of level 1 (halves of finest cells).
std::vector<Shape> shapes() {
  const auto node = [](unsigned level, bool centre, bool even) {
    return stuffing::Background::Node{{}, static_cast<std::uint8_t>(level), centre, even};
  };
  const std::vector<stuffing::Background::Node> centre{node(1, true, false)},
      small{node(0, false, false)}, any_centre{node(1, true, true), node(1, true, false)},
      any{node(1, false, true), node(1, false, false), node(0, false, false)},
      mixed{node(1, false, false)};
  const Int3 middle{2, 2, 2}, next{6, 2, 2};
  return {
      // Of the body-centred lattice, and half of one.
      {{{middle, true, any_centre},
        {next, true, any_centre},
        {{4, 0, 0}, false, any},
        {{4, 4, 0}, false, any}}},
      {{{middle, true, centre},
        {next, true, centre},
        {{4, 0, 0}, false, small},
        {{4, 2, 0}, false, small}}},
      // From the centre of a large leaf to a quarter of its face; of a small one to all of it.
      {{{middle, true, centre},
        {{4, 2, 2}, false, small},
        {{4, 0, 2}, false, small},
        {{4, 0, 0}, false, small}}},
      {{{middle, true, centre},
        {{4, 4, 4}, false, mixed},
        {{4, 0, 4}, false, mixed},
        {{4, 0, 0}, false, mixed}}},
  };
}

std::vector<Int3> directions() {
  std::vector<Int3> result;
  for (int n = 0; n < 27; ++n)
    if (n != 13)
      result.push_back({n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1});
  return result;
}

Vec3 vec(const Int3& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}
Int3 minus(const Int3& a, const Int3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double reach(const Corner& corner, const Int3& step, bool longest) {
  double result = stuffing::least_cut(corner.kinds[0], step);
  for (const stuffing::Background::Node& kind : corner.kinds) {
    const double here = stuffing::least_cut(kind, step);
    result = longest ? test::larger(result, here) : test::smaller(result, here);
  }
  return result;
}

/// Two corners never move towards each other: the cut point of their edge is nearer to one.
bool towards(const Int3& step, const Int3& direction) {
  const Vec3 a = vec(step), b = vec(direction);
  return dot(a, b) > 0 && dot(cross(a, b), cross(a, b)) == 0;
}

struct Proof {
  const Shape& shape;
  std::array<int, 4> signs;
  double lowest, highest;

  Range range_of(const stuffing::StencilNode& node, const std::array<Int3, 4>& warps) const {
    const Corner& corner = shape[node.inner()];
    const Vec3 from = vec(corner.place);
    if (node.is_cut()) {
      const Int3 step = minus(shape[node.outer()].place, corner.place);
      const double size = norm(vec(step));
      return {from + vec(step) * (reach(corner, step, false) / size),
              from + vec(step) * (1 - reach(shape[node.outer()], step, false) / size)};
    }
    if (signs[node.code] != 0)
      return {from, from};
    const Vec3 along = vec(warps[node.code]);
    return {from, from + along * (reach(corner, warps[node.code], true) / norm(along))};
  }

  bool feasible(const std::array<Int3, 4>& warps) const {
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (signs[i] == 0 && signs[j] == 0) {
          const Int3 step = minus(shape[j].place, shape[i].place);
          if (towards(step, warps[i]) && towards(minus({}, step), warps[j]))
            return false;
        }
    return true;
  }

  /// \param first  direction of the first warped corner, so that this is a share of the work
  bool holds(const std::vector<const stuffing::Stencil*>& cuts, std::size_t first) const {
    static const std::vector<Int3> all = directions();
    std::size_t zeros = 0, ways = 1;
    for (const int sign : signs)
      zeros += sign == 0 ? 1 : 0;
    for (std::size_t n = 1; n < zeros; ++n)
      ways *= all.size();
    for (std::size_t way = 0; way < ways; ++way) {
      std::array<Int3, 4> warps{};
      std::size_t rest = way * all.size() + first;
      for (std::size_t i = 0; i < 4; ++i)
        if (signs[i] == 0) {
          warps[i] = all[rest % all.size()];
          rest /= all.size();
        }
      if (!feasible(warps))
        continue;
      for (const stuffing::Stencil* const cut : cuts)
        for (std::size_t t = 0; t < cut->count; ++t) {
          std::array<Range, 4> nodes;
          for (std::size_t k = 0; k < 4; ++k)
            nodes[k] = range_of(cut->tetrahedra[t][k], warps);
          if (!angles_are_within(nodes, lowest, highest))
            return false;
        }
    }
    return true;
  }
};

/// The stencils without a choice for a tetrahedron, with every order of edges of one length.
std::vector<const stuffing::Stencil*> stencils(const Shape& shape,
                                               const std::array<int, 4>& signs) {
  std::vector<const stuffing::Stencil*> result;
  std::array<std::uint8_t, 4> rank{0, 1, 2, 3};
  do {
    stuffing::DiagonalOrder order{};
    for (std::size_t n = 0; n < 4; ++n)
      for (std::size_t p = 0; p < 4; ++p)
        for (std::size_t q = 0; q < 4; ++q) {
          const Vec3 a = vec(minus(shape[p].place, shape[n].place)),
                     b = vec(minus(shape[q].place, shape[n].place));
          order[n][p] = static_cast<std::uint8_t>(
              order[n][p] +
              (dot(b, b) < dot(a, a) || (dot(b, b) == dot(a, a) && rank[q] < rank[p])));
        }
    const stuffing::Stencil* const found = &stuffing::stencil(signs, order);
    if (found->count != 0 && !found->choice && std::ranges::find(result, found) == result.end())
      result.push_back(found);
  } while (std::ranges::next_permutation(rank).found);
  return result;
}

/// Do all stencils without a choice?
bool all_keep(double lowest, double highest) {
  struct Task {
    Proof proof;
    std::vector<const stuffing::Stencil*> cuts;
    std::size_t first;
  };
  const std::vector<Shape> all = shapes();
  std::vector<Task> tasks;
  for (const Shape& shape : all)
    for (int n = 0; n < 81; ++n) {
      const std::array<int, 4> signs{n / 27 - 1, n / 9 % 3 - 1, n / 3 % 3 - 1, n % 3 - 1};
      std::vector<const stuffing::Stencil*> cuts = stencils(shape, signs);
      if (cuts.empty())
        continue;
      const bool warped = std::ranges::find(signs, 0) != signs.end();
      for (std::size_t first = 0; first < (warped ? 26U : 1U); ++first)
        tasks.push_back({{shape, signs, lowest, highest}, cuts, first});
    }
  std::atomic<bool> result = true;
  parallel_blocks({}, tasks.size(), 1, [&](std::size_t begin, std::size_t) {
    if (result && !tasks[begin].proof.holds(tasks[begin].cuts, tasks[begin].first))
      result = false;
  });
  return result;
}

TEST(RefinedStuffingAngles, EveryStencilKeepsTheBounds) {
  EXPECT_TRUE(all_keep(stuffing::stuffing_refined_angle_min, stuffing::stuffing_refined_angle_max));
}

TEST(RefinedStuffingAngles, TheProofFindsWhatLeavesThem) {
  EXPECT_FALSE(
      all_keep(stuffing::stuffing_refined_angle_min + 0.1, stuffing::stuffing_refined_angle_max));
  EXPECT_FALSE(
      all_keep(stuffing::stuffing_refined_angle_min, stuffing::stuffing_refined_angle_max - 0.15));
}

} // namespace
} // namespace gewebe::test
