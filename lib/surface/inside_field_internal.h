#pragma once
// Which voxels of a volume are inside, block by block, and which blocks a surface may cross; for
// surface/marching_cubes.cpp.
//
// Blocks are of 8³ voxels (a leaf, or constant), regions of 16³ blocks, as OpenVDB's nodes. In a
// region everything is found by index; only regions are hashed.

#include "base/context.h"
#include "geometry/index_map.h"
#include "volume/grid.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace gewebe::surface {

/// Word i, bit 8 j + k: voxel (i, j, k) of a block is inside.
using InsideBits = std::array<std::uint64_t, volume::leaf_dim>;

/// std::popcount is a library call on baseline x86-64.
inline std::uint32_t count_bits(std::uint64_t x) {
  x -= x >> 1 & 0x5555555555555555U;
  x = (x & 0x3333333333333333U) + (x >> 2 & 0x3333333333333333U);
  x = (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0fU;
  return static_cast<std::uint32_t>(x * 0x0101010101010101U >> 56);
}

inline Int3 shifted(const Int3& origin, unsigned octant, int step) {
  const auto part = [&](unsigned axis) { return (octant >> axis & 1) != 0 ? step : 0; };
  return {origin[0] + part(0), origin[1] + part(1), origin[2] + part(2)};
}

/// The 16³ blocks of a region, 16 in a row along k.
inline constexpr int region_dim = 16 * volume::leaf_dim;
inline constexpr std::size_t region_rows = 256;
inline Int3 region_origin(const Int3& block) {
  constexpr std::int32_t mask = ~(region_dim - 1);
  return {block[0] & mask, block[1] & mask, block[2] & mask};
}
inline std::size_t region_row(const Int3& block) {
  return static_cast<std::size_t>((block[0] >> 3 & 15) << 4 | (block[1] >> 3 & 15));
}
inline unsigned place_in_row(const Int3& block) {
  return static_cast<unsigned>(block[2] >> 3 & 15);
}

/// Leaves and tiles by position.
class InsideField {
public:
  /// A block of voxels: a leaf, or constant.
  struct Content {
    const float* values;    ///< nullptr: all are `constant`
    const InsideBits* bits; ///< nullptr: all voxels are on `side`
    float constant;
    bool side;
    std::uint64_t word(std::size_t i) const { return bits ? (*bits)[i] : side ? ~0ULL : 0; }
  };

  InsideField(const Context& context, const volume::Grid& grid, double isovalue);

  double isovalue() const { return isovalue_; }
  std::size_t leaves() const { return leaves_; }
  bool is_leaf(std::uint32_t number) const { return number >= 1 && number <= leaves_; }
  const Content& content(std::uint32_t number) const { return contents_[number]; }

  /// Number of the content of the block whose origin is `origin`.
  std::uint32_t at(const Int3& origin) const {
    const std::uint32_t n = node_numbers_.find(region_origin(origin));
    return n < nodes_.size() ? nodes_[n].content[region_row(origin)][place_in_row(origin)]
                             : outside_nodes(n, origin);
  }
  /// The same for a block and its neighbours on the far sides, n for shifted(origin, n, 8).
  std::array<std::uint32_t, 8> octants(const Int3& origin) const;

  /// Blocks by place: those whose cells may be crossed, numbered by (i, j, k) of their origin.
  struct Region {
    Int3 origin{};
    std::array<std::uint16_t, region_rows> blocks{}; ///< bit k of word 16 i + j
    std::array<std::uint32_t, region_rows> first{};  ///< number of the first block in the row
  };
  struct Candidates {
    std::vector<Region> regions; ///< by origin
    IndexMap numbers;            ///< of regions
    std::vector<Int3> blocks;    ///< origins in order
    /// The block's number, or IndexMap::none.
    std::uint32_t find(const Int3& origin) const {
      const std::uint32_t n = numbers.find(region_origin(origin));
      if (n == IndexMap::none)
        return n;
      const Region& region = regions[n];
      const std::size_t row = region_row(origin);
      const unsigned k = place_in_row(origin), blocks_of_row = region.blocks[row];
      if ((blocks_of_row >> k & 1) == 0)
        return IndexMap::none;
      return region.first[row] + count_bits(blocks_of_row & ((1U << k) - 1));
    }
  };
  /// A crossed cell touches a voxel on the side opposite to the background, so it suffices to go
  /// round those.
  Candidates candidates(const Context& context) const;

private:
  /// A region with leaves or tiles of 8³.
  struct Node {
    Int3 origin{};
    std::array<std::array<std::uint32_t, 16>, region_rows> content{}; ///< 0: the background
    std::array<std::uint16_t, region_rows> opposite{}; ///< wholly on the other side than it
    std::array<std::uint16_t, region_rows> other{};    ///< not wholly on its side
  };

  std::uint32_t outside_nodes(std::uint32_t number, const Int3& origin) const;
  void mark_blocks(Region& region) const;

  double isovalue_;
  std::size_t leaves_ = 0;
  std::unique_ptr<InsideBits[]> bits_;           // of each leaf
  std::unique_ptr<Content[]> contents_;          // background, leaves, tiles
  std::vector<volume::TileView> opposite_tiles_; // those larger than 8³ on the other side than it
  std::vector<Node> nodes_;
  IndexMap node_numbers_; // and, from nodes_.size() on, of the contents of tiles of 128³
  IndexMap large_;        // contents of tiles of 4096³
  bool has_large_ = false;
};

} // namespace gewebe::surface
