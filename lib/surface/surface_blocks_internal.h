#pragma once
// Where an isosurface crosses its lattice, block by block: what marching cubes finds before it
// makes a mesh, and the input of snapping; for surface/marching_cubes.cpp and
// surface/snapping.cpp.
//
// Blocks are of 8³ corners and of the 8³ cells that start there. A set of corners of a block is 8
// words, word i with bit 8 j + k for corner (i, j, k); a set of edges is 24, word 3 i + axis for
// the edges that start there along `axis`.

#include "surface/inside_field_internal.h"
#include "surface/marching_cubes.h"
#include "surface/marching_cubes_table.h"

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

namespace gewebe::surface {

using CornerWords = std::array<std::uint64_t, volume::leaf_dim>;
using EdgeWords = std::array<std::uint64_t, std::size_t{3} * volume::leaf_dim>;

/// An edge of a block as one number, to go through its points without searching words for bits.
struct BlockEdge {
  std::uint16_t number = 0; ///< i, axis, j, k from the top, in 3, 2, 3, 3 bits

  static constexpr BlockEdge at(unsigned i, unsigned axis, unsigned bit) {
    return {static_cast<std::uint16_t>(i << 8 | axis << 6 | bit)};
  }
  constexpr unsigned i() const { return number >> 8; }
  constexpr unsigned axis() const { return number >> 6 & 3U; }
  constexpr unsigned bit() const { return number & 63U; }
  constexpr unsigned j() const { return number >> 3 & 7U; }
  constexpr unsigned k() const { return number & 7U; }
  constexpr unsigned word() const { return 3 * i() + axis(); }
  constexpr unsigned place() const; ///< see edge_place
};

/// A block with a crossed cell. Points lie on crossed edges and are numbered by block, word and
/// bit; triangles by block, cell and place in the table of cases.
struct SurfaceBlock {
  static constexpr std::uint32_t none = UINT32_MAX;

  Int3 origin{};
  std::uint32_t first_point = 0, points = 0;
  std::uint32_t first_triangle = 0, triangles = 0;
  std::uint32_t cells = 0;
  const std::uint8_t* cases = nullptr;         ///< of each crossed cell in turn
  std::array<std::uint16_t, 24> before{};      ///< crossed edges in earlier words
  std::array<std::uint16_t, 8> cells_before{}; ///< crossed cells in earlier words
  EdgeWords crossed{};                         ///< edges with a point
  CornerWords active{};                        ///< crossed cells
  CornerWords inside{};                        ///< corners
  std::uint8_t outer = 0;                      ///< bit n: shifted(origin, n, 8) is inside
  std::array<std::uint32_t, 27> neighbours = no_neighbours(); ///< by neighbour_place, or none

  static constexpr std::array<std::uint32_t, 27> no_neighbours() {
    std::array<std::uint32_t, 27> numbers{};
    numbers.fill(none);
    return numbers;
  }
  /// Of the block at origin + 8 (x, y, z), -1 … 1.
  static constexpr std::size_t neighbour_place(int x, int y, int z) {
    return static_cast<std::size_t>(9 * x + 3 * y + z + 13);
  }
  std::uint32_t first_of_word(std::size_t w) const { return first_point + before[w]; }
  /// The point on a crossed edge.
  std::uint32_t point(std::size_t w, unsigned bit) const {
    return first_of_word(w) + count_bits(crossed[w] & ((std::uint64_t{1} << bit) - 1));
  }
  /// The case of a cell; 0 where it isn't crossed.
  unsigned cell_case(std::size_t i, unsigned bit) const {
    const std::uint64_t here = std::uint64_t{1} << bit;
    return (active[i] & here) == 0 ? 0
                                   : cases[cells_before[i] + count_bits(active[i] & (here - 1))];
  }
};

struct SurfaceBlocks {
  struct Part {
    std::uint32_t first = 0; ///< number of its first block
    std::vector<SurfaceBlock> blocks;
    std::vector<std::array<std::uint32_t, 8>> contents; ///< of each block: InsideField::octants
    std::vector<std::uint8_t> cases;
  };
  std::vector<Part> parts;                 ///< what is held
  std::vector<const SurfaceBlock*> blocks; ///< in order of their origins
  std::vector<double> fractions;           ///< of each point, along its edge
  std::vector<BlockEdge> edges;            ///< of each point in its block
  std::uint64_t points = 0, triangles = 0;
};

/// Places of the edges of a block's cells, those on its far sides included.
inline constexpr std::size_t edge_places = std::size_t{3} * 9 * 9 * 9;
constexpr unsigned edge_place(unsigned i, unsigned j, unsigned k, unsigned axis = 0) {
  return ((axis * 9 + i) * 9 + j) * 9 + k;
}
constexpr unsigned BlockEdge::place() const {
  return (axis() * 9 + i()) * 81 + bit() + j();
}

/// Calls visit(block, number, word, bit, place) for the crossed edges of blocks on the far sides
/// that cells of `block` share; their place is that in `block`.
template <class Visit>
void for_far_edges(const SurfaceBlocks& surface, const SurfaceBlock& block, Visit&& visit) {
  constexpr std::uint64_t first_row = 0xff, first_column = 0x0101010101010101U;
  for (unsigned octant = 1; octant < 7; ++octant) {
    const unsigned far_i = octant & 1, far_j = octant >> 1 & 1, far_k = octant >> 2;
    const std::uint32_t number = block.neighbours[13 + 9 * far_i + 3 * far_j + far_k];
    if (number == SurfaceBlock::none)
      continue;
    const SurfaceBlock& far = *surface.blocks[number];
    const std::uint64_t mask =
        (far_j != 0 ? first_row : ~0ULL) & (far_k != 0 ? first_column : ~0ULL);
    for (unsigned axis = 0; axis < 3; ++axis) {
      if ((octant >> axis & 1) != 0)
        continue; // this edge leads away
      // A row or a column of each slice makes one word, since short loops are badly predicted.
      std::uint64_t all = 0;
      if (far_i != 0)
        all = far.crossed[axis] & mask;
      else
        for (unsigned i = 0; i < 8; ++i)
          all |= (far.crossed[3 * i + axis] & mask) << (far_k != 0 ? i : 8 * i);
      for (; all != 0; all &= all - 1) {
        const auto n = static_cast<unsigned>(std::countr_zero(all));
        const unsigned i = far_i != 0   ? 0
                           : far_k != 0 ? n & 7
                                        : n >> 3,
                       bit = far_i != 0   ? n
                             : far_k != 0 ? n & 56
                                          : n & 7;
        visit(far, number, 3 * i + axis, bit,
              edge_place(i + 8 * far_i, (bit >> 3) + 8 * far_j, (bit & 7) + 8 * far_k, axis));
      }
    }
  }
}

/// The table of cases with edge_place(own cell) + corner for the edges; triangles are turned where
/// the transform mirrors.
struct CellPlan {
  std::uint8_t triangles = 0;
  std::array<std::uint16_t, std::size_t{3} * max_cell_triangles> corner{};
};
using CellPlans = std::array<CellPlan, 256>;
CellPlans make_plans(bool mirrored);

/// GridTransform::to_world, the same sums, where it can be inlined.
inline Vec3 world_position(const std::array<double, 12>& m, const Vec3& p) {
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

} // namespace gewebe::surface
