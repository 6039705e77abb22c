#pragma once
// The lattice that a volume is stuffed on, in blocks of 8³ cells: which of its points are inside.
// For the room alone.

#include "base/context.h"
#include "geometry/vec3.h"
#include "stuffing/bcc_internal.h"
#include "volume/grid.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace gewebe::stuffing {

/// Where lattice points lie, and what is inside.
struct StuffingLattice {
  volume::GridTransform
      to_world; ///< of places of the lattice; its columns are orthogonal and equally long
  volume::GridTransform to_index; ///< of places of the lattice to the grid's index space
  double cell = 0;                ///< mm
  double isovalue = 0;
  bool below = false; ///< inside is value < isovalue
};

/// \throw Error as stuff() for transform, isovalue, background and cell
StuffingLattice stuffing_lattice(const volume::Grid& grid, std::optional<double> isovalue,
                                 std::optional<double> cell);

/// A set of the points of a block: word i of the corners, then of the centres, bit 8 j + k.
using PointSet = std::array<std::uint64_t, 16>;

struct PlaceInBlock {
  std::uint32_t block = 0;
  std::uint32_t word = 0, bit = 0;
};

/// The points of a set by number.
class PointRanks {
public:
  PointRanks() = default;
  explicit PointRanks(const PointSet& set) : set_(set) {
    for (std::size_t w = 1; w < 16; ++w)
      before_[w] = static_cast<std::uint16_t>(before_[w - 1] + std::popcount(set[w - 1]));
  }
  bool contains(unsigned word, unsigned bit) const { return (set_[word] >> bit & 1) != 0; }
  /// How many points of the set come before this one.
  std::uint32_t rank(unsigned word, unsigned bit) const {
    return before_[word] +
           static_cast<std::uint32_t>(std::popcount(set_[word] & ((std::uint64_t{1} << bit) - 1)));
  }
  const PointSet& set() const { return set_; }

private:
  PointSet set_{};
  std::array<std::uint16_t, 16> before_{};
};
inline std::uint32_t size(const PointSet& set) {
  std::uint32_t count = 0;
  for (const std::uint64_t word : set)
    count += static_cast<std::uint32_t>(std::popcount(word));
  return count;
}
struct StuffingBlock {
  static constexpr std::uint32_t none = UINT32_MAX;

  Int3 origin{};
  std::array<std::uint32_t, 27> neighbours{}; ///< at origin + 8 (x, y, z) in 9 x + 3 y + z + 13
  PointSet inside{};
  PointRanks surface; ///< points with an edge to the other side
  std::uint32_t first_surface = 0;
  PointRanks interface; ///< points inside with an edge to another material, if requested
  std::uint32_t first_interface = 0;

  /// \pre it is in `surface`
  std::uint32_t surface_point(unsigned word, unsigned bit) const {
    return first_surface + surface.rank(word, bit);
  }
  /// \pre it is in `interface`
  std::uint32_t interface_point(unsigned word, unsigned bit) const {
    return first_interface + interface.rank(word, bit);
  }
  bool in(unsigned word, unsigned bit) const { return (inside[word] >> bit & 1) != 0; }
};

/// Calls visit(word, bit) for the points of a set in order.
template <class Visit>
void for_each_point(const PointSet& set, Visit&& visit) {
  for (unsigned w = 0; w < 16; ++w)
    for (std::uint64_t rest = set[w]; rest != 0; rest &= rest - 1)
      visit(w, static_cast<unsigned>(std::countr_zero(rest)));
}

inline bcc::Point point_at(const StuffingBlock& block, unsigned word, unsigned bit) {
  return {word / 8,
          {block.origin[0] + static_cast<int>(word % 8),
           block.origin[1] + static_cast<int>(bit / 8),
           block.origin[2] + static_cast<int>(bit % 8)}};
}

/// Blocks with a point inside and all round them, by (i, j, k) of their origin.
using StuffingBlocks = std::vector<StuffingBlock>;

/// Where place (i, j, k) relative to a block's origin, each -8 … 15, lies. \return block none where
/// there is none: all outside
inline PlaceInBlock locate(const StuffingBlock& block, unsigned kind, const Int3& place) {
  const auto side = [](std::int32_t x) { return (x >> 3) + 1; };
  const auto neighbour =
      static_cast<std::size_t>(9 * side(place[0]) + 3 * side(place[1]) + side(place[2]));
  return {block.neighbours[neighbour], 8 * kind + static_cast<unsigned>(place[0] & 7),
          static_cast<unsigned>((place[1] & 7) << 3 | (place[2] & 7))};
}

/// Where the neighbour of a block's point in a direction lies.
inline PlaceInBlock neighbour(const StuffingBlock& block, unsigned word, unsigned bit,
                              unsigned direction) {
  const unsigned kind = word / 8;
  const Int3 step = bcc::place_step(kind, direction);
  return locate(block, bcc::kind_after(kind, direction),
                {static_cast<int>(word % 8) + step[0], static_cast<int>(bit / 8) + step[1],
                 static_cast<int>(bit % 8) + step[2]});
}

/// Word i of a set of the points of `kind` at a step of -1, 0 or 1 along each axis from those of a
/// block. \param word_of called with a block and a number of word \return 0 bits for points of
/// blocks that are not there
template <class WordOf>
std::uint64_t shifted_word(const StuffingBlocks& blocks, const StuffingBlock& block, unsigned kind,
                           int i, const Int3& step, WordOf&& word_of) {
  constexpr std::uint64_t column = 0x0101010101010101U;
  const int slice = i + step[0];
  const int x = slice < 0 ? -1 : slice >= volume::leaf_dim ? 1 : 0;
  const auto word = [&](int y, int z) -> std::uint64_t {
    const std::uint32_t n = block.neighbours[static_cast<std::size_t>(9 * x + 3 * y + z + 13)];
    return n == StuffingBlock::none
               ? 0
               : word_of(blocks[n], 8 * kind + static_cast<unsigned>(slice & 7));
  };
  const auto row = [&](int y) {
    if (step[2] == 0)
      return word(y, 0);
    return step[2] > 0 ? (word(y, 0) >> 1 & ~(column << 7)) | (word(y, 1) & column) << 7
                       : (word(y, 0) << 1 & ~column) | (word(y, -1) >> 7 & column);
  };
  if (step[1] == 0)
    return row(0);
  return step[1] > 0 ? row(0) >> 8 | row(1) << 56 : row(0) << 8 | row(-1) >> 56;
}

/// \param keep  if given, selects blocks near the volume by their origins that are kept without a
/// point inside
/// \throw Error if a value that is looked at is not finite; if indices come near the limits of 32
/// bits; beyond context.max_memory
StuffingBlocks stuffing_blocks(const Context& context, const volume::Grid& grid,
                               const StuffingLattice& lattice,
                               const std::function<bool(const Int3&)>& keep = {});

} // namespace gewebe::stuffing
