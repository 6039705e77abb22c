#pragma once
// Coarser cells inside: the cells of a block as the leaves of an octree.

#include "base/context.h"
#include "stuffing/bcc_internal.h"
#include "stuffing/lattice_internal.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::stuffing {

/// A block has cubes of 1, 2, 4, 8 cells.
inline constexpr unsigned largest_level = 3;

/// Which cubes of 2, 4 and 8 cells of a block stand as one or inside a larger one.
struct BlockLevels {
  std::uint64_t twos = 0; ///< bit 16 i + 4 j + k
  std::uint8_t fours = 0; ///< bit 4 i + 2 j + k
  bool eight = false;

  /// Of the leaf that holds cell (i, j, k), each 0 … 7; its edge is 1 << level cells.
  unsigned level(unsigned i, unsigned j, unsigned k) const {
    if (eight)
      return 3;
    if ((fours >> ((i >> 2) << 2 | (j >> 2) << 1 | k >> 2) & 1) != 0)
      return 2;
    return static_cast<unsigned>(twos >> ((i >> 1) << 4 | (j >> 1) << 2 | k >> 1) & 1);
  }
};

/// The leaves of all blocks and the lattice points that are nodes of them.
///
/// Labelle and Shewchuk 2007, section 3: a leaf is a cube. Of two neighbours across a face or an
/// edge, one is at most twice as large as the other. Lattice points with an edge to the other side
/// or to another material have only leaves of one cell around them. Warps and cuts are therefore
/// the same as on a lattice without grading.
struct Grading {
  unsigned levels = 0;             ///< of the largest leaf; 0: no grading here
  std::vector<BlockLevels> blocks; ///< empty where levels == 0

  bool none() const { return levels == 0; }
  /// Of the leaf that holds the cell at a place relative to a block, each -8 … 15.
  unsigned level(const StuffingBlock& block, const Int3& cell) const;
  /// Are all cells in and round the block leaves?
  bool is_fine(const StuffingBlock& block) const;
};

/// \pre levels <= largest_level
Grading grade_blocks(const Context& context, const StuffingBlocks& blocks, unsigned levels);

/// The points of a block that are corners or centres of leaves that meet it. \pre not is_fine
PointSet leaf_points(const Grading& grading, const StuffingBlock& block);

/// The centre of a leaf, from the first of its cells.
constexpr bcc::Point leaf_centre(unsigned level, const Int3& cell) {
  if (level == 0)
    return {1, cell};
  const int half = 1 << (level - 1);
  return {0, {cell[0] + half, cell[1] + half, cell[2] + half}};
}

using LatticeTetrahedron = std::array<bcc::Point, 4>;

/// Calls visit(tetrahedron), of positive volume, for those that a leaf and its neighbour across the
/// face in positive direction of `axis` make, where not both are single cells.
/// \param cell the leaf's first cell, relative to the block
/// \param is_node called with a corner's place: is it a node?
template <class IsNode, class Visit>
void for_each_between(const Grading& grading, const StuffingBlock& block, const Int3& cell,
                      unsigned axis, IsNode&& is_node, Visit&& visit);

// ---- how

namespace grading {

/// In halves of cells.
constexpr Int3 doubled(const bcc::Point& point) {
  const int half = point.kind == 0 ? 0 : 1;
  return {2 * point.place[0] + half, 2 * point.place[1] + half, 2 * point.place[2] + half};
}
constexpr LatticeTetrahedron turned(LatticeTetrahedron tetrahedron) {
  std::array<std::array<std::int64_t, 3>, 3> edge{};
  const Int3 from = doubled(tetrahedron[0]);
  for (std::size_t n = 0; n < 3; ++n)
    for (std::size_t a = 0; a < 3; ++a)
      edge[n][a] = doubled(tetrahedron[n + 1])[a] - from[a];
  const auto& [p, q, r] = edge;
  const std::int64_t volume = (p[1] * q[2] - p[2] * q[1]) * r[0] +
                              (p[2] * q[0] - p[0] * q[2]) * r[1] +
                              (p[0] * q[1] - p[1] * q[0]) * r[2];
  if (volume < 0)
    return {tetrahedron[0], tetrahedron[1], tetrahedron[3], tetrahedron[2]};
  return tetrahedron;
}

/// Between a leaf and one of half its edge: the diagonal of the square between goes from the middle
/// of the larger one's face, so that four tetrahedra lie round it.
/// \param coarse, fine first cells \param level of the fine leaf \param plane of the square along
/// `axis`
template <class Visit>
void step_between(const Int3& coarse, const Int3& fine, unsigned level, unsigned axis, int plane,
                  Visit&& visit) {
  const unsigned b = (axis + 1) % 3, c = (axis + 2) % 3;
  const int half = 1 << level;
  const auto corner = [&](bool far_b, bool far_c) {
    // Far from the middle of the coarse face or not, along b and c.
    Int3 place{};
    place[axis] = plane;
    const int away_b = fine[b] == coarse[b] ? -half : half,
              away_c = fine[c] == coarse[c] ? -half : half;
    place[b] = coarse[b] + half + (far_b ? away_b : 0);
    place[c] = coarse[c] + half + (far_c ? away_c : 0);
    return bcc::Point{0, place};
  };
  const bcc::Point middle = corner(false, false), end = corner(true, true);
  for (const bcc::Point& centre : {leaf_centre(level + 1, coarse), leaf_centre(level, fine)})
    for (const bool along_b : {true, false})
      visit(turned({centre, middle, corner(along_b, !along_b), end}));
}

} // namespace grading

template <class IsNode, class Visit>
void for_each_between(const Grading& grading, const StuffingBlock& block, const Int3& cell,
                      unsigned axis, IsNode&& is_node, Visit&& visit) {
  const unsigned level = grading.level(block, cell), b = (axis + 1) % 3, c = (axis + 2) % 3;
  const int edge = 1 << level;
  Int3 next = cell;
  next[axis] += edge;
  const unsigned beyond = grading.level(block, next);
  if (beyond > level) {
    Int3 coarse = next;
    coarse[b] &= ~(2 * edge - 1);
    coarse[c] &= ~(2 * edge - 1);
    grading::step_between(coarse, cell, level, axis, next[axis], visit);
  } else if (beyond < level) {
    for (const int along_b : {0, edge / 2})
      for (const int along_c : {0, edge / 2}) {
        Int3 fine = next;
        fine[b] += along_b;
        fine[c] += along_c;
        grading::step_between(cell, fine, beyond, axis, next[axis], visit);
      }
  } else {
    constexpr std::array<std::array<int, 2>, 5> ring{{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}};
    const bcc::Point here = leaf_centre(level, cell), there = leaf_centre(level, next);
    for (std::size_t n = 0; n < 4; ++n) {
      Int3 from = next, to = next, middle = next;
      from[b] += ring[n][0] * edge;
      from[c] += ring[n][1] * edge;
      to[b] += ring[n + 1][0] * edge;
      to[c] += ring[n + 1][1] * edge;
      for (std::size_t a = 0; a < 3; ++a)
        middle[a] = (from[a] + to[a]) / 2;
      if (is_node(middle)) {
        visit(grading::turned({here, there, {0, from}, {0, middle}}));
        visit(grading::turned({here, there, {0, middle}, {0, to}}));
      } else
        visit(grading::turned({here, there, {0, from}, {0, to}}));
    }
  }
}

} // namespace gewebe::stuffing
