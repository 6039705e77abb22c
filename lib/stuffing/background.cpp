#include "stuffing/background_internal.h"

#include "base/error.h"
#include "stuffing/stuffing.h"

#include <array>
#include <cmath>
#include <utility>

namespace gewebe::stuffing {
namespace {

Int3 doubled(const Int3& place) {
  return {2 * place[0], 2 * place[1], 2 * place[2]};
}

Int3 centre_of(const OctreeCube& leaf) {
  const int edge = 1 << leaf.level;
  const Int3 first = doubled(leaf.first_cell());
  return {first[0] + edge, first[1] + edge, first[2] + edge};
}

class Builder {
public:
  Builder(const StuffingOctree& octree, unsigned block) : octree_(octree) {
    for (const OctreeCube& leaf : octree.leaves(block))
      for (std::size_t axis = 0; axis < 3; ++axis)
        join(leaf, axis);
  }
  Background take() { return std::move(result_); }

private:
  /// \param level of the smallest leaf that it belongs to here
  std::uint32_t node(const Int3& place, unsigned level, bool centre, bool even) {
    std::uint32_t number = numbers_.find(place);
    if (number == IndexMap::none) {
      number = static_cast<std::uint32_t>(result_.nodes.size());
      if (number >= UINT32_MAX - 1)
        throw Error("the mesh has more than 2^32 - 2 nodes, expected a larger --cell");
      numbers_.insert(place, number);
      result_.nodes.push_back({place, static_cast<std::uint8_t>(level), centre, true});
    }
    Background::Node& found = result_.nodes[number];
    found.even = found.even && even && found.level == level;
    if (level < found.level)
      found.level = static_cast<std::uint8_t>(level);
    return number;
  }

  void add(Tetrahedron corners) {
    const auto edge = [&](std::size_t n) {
      const Int3 &from = result_.nodes[corners[0]].place, &to = result_.nodes[corners[n]].place;
      return std::array<std::int64_t, 3>{std::int64_t{to[0]} - from[0],
                                         std::int64_t{to[1]} - from[1],
                                         std::int64_t{to[2]} - from[2]};
    };
    const auto p = edge(1), q = edge(2), r = edge(3);
    const std::int64_t volume = (p[1] * q[2] - p[2] * q[1]) * r[0] +
                                (p[2] * q[0] - p[0] * q[2]) * r[1] +
                                (p[0] * q[1] - p[1] * q[0]) * r[2];
    if (volume < 0)
      std::swap(corners[2], corners[3]);
    if (result_.tetrahedra.size() >= UINT32_MAX - 1)
      throw Error("the mesh has more than 2^32 - 2 tetrahedra, expected a larger --cell");
    result_.tetrahedra.push_back(corners);
  }

  /// Those between a leaf and what lies beyond its face in positive direction of an axis.
  void join(const OctreeCube& leaf, std::size_t axis) {
    OctreeCube next = leaf;
    ++next.cube[axis];
    switch (octree_.state(next)) {
    case StuffingOctree::State::leaf:
      between_equals(leaf, next, axis);
      return;
    case StuffingOctree::State::split: {
      const unsigned far = 1U << axis;
      for (unsigned n = 0; n < 8; ++n)
        if ((n & far) == 0 && octree_.state(next.child(n)) == StuffingOctree::State::leaf)
          step_between(leaf, next.child(n), axis, next.first_cell()[axis]);
      return;
    }
    case StuffingOctree::State::absent:
      if (octree_.state(next.parent()) == StuffingOctree::State::leaf)
        step_between(next.parent(), leaf, axis, next.first_cell()[axis]);
    }
  }

  /// The diagonal of the square between goes from the middle of the larger one's face, so that four
  /// tetrahedra lie round it. \param plane of the square along the axis, in cells
  void step_between(const OctreeCube& coarse, const OctreeCube& fine, std::size_t axis, int plane) {
    const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
    const int edge = 1 << fine.level;
    const Int3 large = coarse.first_cell(), small = fine.first_cell();
    const auto corner = [&](bool far_b, bool far_c) {
      Int3 place{};
      place[axis] = plane;
      const int away_b = small[b] == large[b] ? -edge : edge,
                away_c = small[c] == large[c] ? -edge : edge;
      place[b] = large[b] + edge + (far_b ? away_b : 0);
      place[c] = large[c] + edge + (far_c ? away_c : 0);
      return node(doubled(place), fine.level, false, false);
    };
    const std::uint32_t middle = corner(false, false), end = corner(true, true);
    const std::array<std::uint32_t, 2> sides{corner(true, false), corner(false, true)};
    for (const OctreeCube& leaf : {coarse, fine}) {
      const std::uint32_t centre = node(centre_of(leaf), leaf.level, true, false);
      for (const std::uint32_t side : sides)
        add({centre, middle, side, end});
    }
  }

  void between_equals(const OctreeCube& here, const OctreeCube& next, std::size_t axis) {
    const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
    const int edge = 1 << here.level;
    constexpr std::array<std::array<int, 2>, 5> ring{{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}};
    for (std::size_t n = 0; n < 4; ++n) {
      Int3 from = doubled(next.first_cell()), to = from;
      from[b] += 2 * ring[n][0] * edge;
      from[c] += 2 * ring[n][1] * edge;
      to[b] += 2 * ring[n + 1][0] * edge;
      to[c] += 2 * ring[n + 1][1] * edge;
      // Beyond the leaf's side at this edge of the face.
      const std::size_t across = n % 2 == 0 ? c : b;
      const int side = ring[n][across == b ? 0 : 1] == 0 ? -1 : 1;
      const bool halved =
          is_split_beside(here, across, side) || is_split_beside(next, across, side);
      const std::uint32_t centre = node(centre_of(here), here.level, true, !halved),
                          other = node(centre_of(next), here.level, true, !halved);
      if (!halved) {
        add({centre, other, node(from, here.level, false, true),
             node(to, here.level, false, true)});
        continue;
      }
      const Int3 between{(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2};
      const std::uint32_t middle = node(between, here.level - 1, false, false);
      for (const Int3& end : {from, to})
        add({centre, other, middle, node(end, here.level - 1, false, false)});
    }
  }
  bool is_split_beside(const OctreeCube& leaf, std::size_t axis, int side) const {
    OctreeCube beside = leaf;
    beside.cube[axis] += side;
    return octree_.state(beside) == StuffingOctree::State::split;
  }

  const StuffingOctree& octree_;
  Background result_;
  GrowingIndexMap numbers_;
};

} // namespace

Background background_of(const StuffingOctree& octree, unsigned block) {
  return Builder(octree, block).take();
}

double least_cut(const Background::Node& node, const Int3& step) {
  const std::size_t axes = static_cast<std::size_t>(step[0] != 0) +
                           static_cast<std::size_t>(step[1] != 0) +
                           static_cast<std::size_t>(step[2] != 0);
  const double edge = std::ldexp(2.0, node.level);
  if (node.even && axes != 2)
    return edge * (axes == 1 ? stuffing_alpha_long : stuffing_alpha_short * std::sqrt(0.75));
  return edge * (node.centre ? refined_alpha_centre : refined_alpha_corner)[axes - 1];
}

} // namespace gewebe::stuffing
