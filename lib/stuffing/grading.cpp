#include "stuffing/grading_internal.h"

#include "base/parallel.h"

// Based on: Labelle and Shewchuk, Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
// Angles, 2007, section 3.

namespace gewebe::stuffing {
namespace {

/// Cells that may be part of a larger leaf: nothing of their own, and of the tetrahedra that they
/// share with the next cells, lies at a point with an edge to the other side or to another
/// material. Word i, bit 8 j + k. The centre needs no test of its own: the other end of such an
/// edge is one of its neighbours, and at the same surface.
using CellSet = std::array<std::uint64_t, 8>;
CellSet quiet_cells(const StuffingBlocks& blocks, const StuffingBlock& block) {
  const auto at_surface = [](const StuffingBlock& there, unsigned word) {
    return there.surface.set()[word] | there.interface.set()[word];
  };
  CellSet quiet{};
  for (int i = 0; i < volume::leaf_dim; ++i) {
    const auto centres = static_cast<unsigned>(8 + i);
    std::uint64_t loud = ~block.inside[centres];
    for (unsigned d = 0; d < bcc::directions; ++d)
      loud |=
          shifted_word(blocks, block, bcc::kind_after(1, d), i, bcc::place_step(1, d), at_surface);
    quiet[static_cast<std::size_t>(i)] = ~loud;
  }
  return quiet;
}

std::uint64_t quiet_twos(const CellSet& quiet) {
  std::uint64_t twos = 0;
  for (unsigned i = 0; i < 4; ++i) {
    std::uint64_t word = quiet[2 * std::size_t{i}] & quiet[2 * std::size_t{i} + 1];
    word &= word >> 1;
    word &= word >> 8;
    for (unsigned j = 0; j < 4; ++j)
      for (unsigned k = 0; k < 4; ++k)
        twos |= (word >> (16 * j + 2 * k) & 1) << (16 * i + 4 * j + k);
  }
  return twos;
}

/// Does holds(place) hold for all places of a cube of 2³ and those that share a face or an edge
/// with it?
template <class Holds>
bool with_neighbours(const Int3& first, Holds&& holds) {
  for (int i = -1; i < 3; ++i)
    for (int j = -1; j < 3; ++j)
      for (int k = -1; k < 3; ++k) {
        const int outside = (i < 0 || i > 1) + (j < 0 || j > 1) + (k < 0 || k > 1);
        if (outside < 3 && !holds({first[0] + i, first[1] + j, first[2] + k}))
          return false;
      }
  return true;
}

} // namespace

unsigned Grading::level(const StuffingBlock& block, const Int3& cell) const {
  const PlaceInBlock place = locate(block, 0, cell);
  if (place.block == StuffingBlock::none)
    return 0;
  return blocks[place.block].level(place.word, place.bit >> 3, place.bit & 7);
}

bool Grading::is_fine(const StuffingBlock& block) const {
  for (const std::uint32_t n : block.neighbours)
    if (n != StuffingBlock::none && blocks[n].twos != 0)
      return false;
  return true;
}

Grading grade_blocks(const Context& context, const StuffingBlocks& blocks, unsigned levels) {
  Grading grading;
  grading.levels = levels;
  if (levels == 0)
    return grading;
  grading.blocks.resize(blocks.size());
  const auto each = [&](auto&& body) {
    gewebe::parallel_blocks(context, blocks.size(), 32, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        body(blocks[n], grading.blocks[n]);
    });
  };
  each([&](const StuffingBlock& block, BlockLevels& its) {
    if (size(block.inside) != 0)
      its.twos = quiet_twos(quiet_cells(blocks, block));
  });
  if (levels > 1)
    each([&](const StuffingBlock& block, BlockLevels& its) {
      if (its.twos == 0)
        return;
      for (int n = 0; n < 8; ++n)
        if (with_neighbours({n >> 1 & 2, n & 2, n << 1 & 2}, [&](const Int3& two) {
              const PlaceInBlock place = locate(block, 0, {2 * two[0], 2 * two[1], 2 * two[2]});
              return place.block != StuffingBlock::none &&
                     (grading.blocks[place.block].twos >>
                          ((place.word >> 1) << 4 | (place.bit >> 4) << 2 | (place.bit & 7) >> 1) &
                      1) != 0;
            }))
          its.fours = static_cast<std::uint8_t>(its.fours | 1U << n);
    });
  if (levels > 2)
    each([&](const StuffingBlock& block, BlockLevels& its) {
      its.eight =
          its.fours == 0xff && with_neighbours({0, 0, 0}, [&](const Int3& four) {
            const PlaceInBlock place = locate(block, 0, {4 * four[0], 4 * four[1], 4 * four[2]});
            return place.block != StuffingBlock::none &&
                   (grading.blocks[place.block].fours >>
                        ((place.word >> 2) << 2 | (place.bit >> 5) << 1 | (place.bit & 7) >> 2) &
                    1) != 0;
          });
    });
  return grading;
}

PointSet leaf_points(const Grading& grading, const StuffingBlock& block) {
  PointSet points{};
  for (int i = 0; i < volume::leaf_dim; ++i)
    for (int j = 0; j < volume::leaf_dim; ++j)
      for (int k = 0; k < volume::leaf_dim; ++k) {
        const auto bit = static_cast<unsigned>(8 * j + k);
        if (grading.level(block, {i, j, k}) == 0)
          points[static_cast<std::size_t>(8 + i)] |= std::uint64_t{1} << bit;
        bool is_node = false;
        for (int n = 0; n < 8 && !is_node; ++n) {
          const unsigned level =
              grading.level(block, {i - (n & 1), j - (n >> 1 & 1), k - (n >> 2 & 1)});
          const int rest = (1 << level) - 1, half = (1 << level) / 2;
          is_node = ((i | j | k) & rest) == 0 ||
                    ((i & rest) == half && (j & rest) == half && (k & rest) == half);
        }
        points[static_cast<std::size_t>(i)] |= std::uint64_t{is_node} << bit;
      }
  return points;
}

} // namespace gewebe::stuffing
