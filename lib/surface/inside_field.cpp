#include "surface/inside_field_internal.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <emmintrin.h>
#include <limits>
#include <string>

namespace gewebe::surface {
namespace {

/// The test "inside" on floats: equivalent to comparing with the double isovalue.
struct Inside {
  float bound = 0;
  bool below = false; // level set
  bool operator()(float value) const { return below ? value < bound : value > bound; }
};

Inside make_inside(double isovalue, bool level_set) {
  const auto nearest = static_cast<float>(isovalue);
  const float infinity = std::numeric_limits<float>::infinity();
  if (level_set) // value < isovalue  <=>  value < the smallest float not below it
    return {static_cast<double>(nearest) < isovalue ? std::nextafter(nearest, infinity) : nearest,
            true};
  return {static_cast<double>(nearest) > isovalue ? std::nextafter(nearest, -infinity) : nearest,
          false};
}

InsideBits inside_bits(const float* values, const Inside& inside) {
  const __m128 bound = _mm_set1_ps(inside.bound); // SSE2 is in every x86-64
  const auto compare = [&](const float* at) {
    const __m128 four = _mm_loadu_ps(at);
    return _mm_castps_si128(inside.below ? _mm_cmplt_ps(four, bound) : _mm_cmpgt_ps(four, bound));
  };
  InsideBits bits;
  for (std::uint64_t& word : bits) {
    word = 0;
    for (unsigned n = 0; n < 64; n += 16) {
      const __m128i low = _mm_packs_epi32(compare(values + n), compare(values + n + 4)),
                    high = _mm_packs_epi32(compare(values + n + 8), compare(values + n + 12));
      const auto mask = static_cast<unsigned>(_mm_movemask_epi8(_mm_packs_epi16(low, high)));
      word |= std::uint64_t{mask} << n;
    }
    values += 64;
  }
  return bits;
}

/// Regions of the one-region shell of a large tile, the layer at its far sides included: these hold
/// the blocks of all cells that touch both the tile and something else.
void append_shell(const volume::TileView& tile, std::vector<Int3>& regions) {
  const int last = tile.dim - region_dim;
  for (int i = -region_dim; i <= last; i += region_dim)
    for (int j = -region_dim; j <= last; j += region_dim) {
      const bool border = i < 0 || i == last || j < 0 || j == last;
      const int step = border ? region_dim : last + region_dim;
      for (int k = -region_dim; k <= last; k += step)
        regions.push_back({tile.origin[0] + i, tile.origin[1] + j, tile.origin[2] + k});
    }
}

void check_range(const Int3& origin, std::int64_t dim) {
  for (const std::int64_t low : origin)
    if (low < INT32_MIN + 16 || low + dim > INT32_MAX - 16)
      throw Error("voxel index " + std::to_string(low) +
                  " is too near the limits of 32 bits, expected 16 voxels of distance");
}

Context without_progress(const Context& context) {
  Context quiet = context;
  quiet.progress = nullptr;
  return quiet;
}

} // namespace

InsideField::InsideField(const Context& context, const volume::Grid& grid, double isovalue)
    : isovalue_(isovalue) {
  const Inside inside = make_inside(isovalue, grid.info().level_set);
  const std::vector<volume::LeafView> leaves = grid.leaves();
  const std::vector<volume::TileView> tiles = grid.tiles();
  leaves_ = leaves.size();
  std::vector<Int3> origins; // of nodes; neighbours in the tree follow each other
  std::size_t larger = 0, largest = 0;
  const auto add_node = [&](const Int3& block) {
    const Int3 origin = region_origin(block);
    if (origins.empty() || origins.back() != origin)
      origins.push_back(origin);
  };
  for (const volume::LeafView& leaf : leaves) {
    check_range(leaf.origin, volume::leaf_dim);
    add_node(leaf.origin);
  }
  for (const volume::TileView& tile : tiles) {
    check_range(tile.origin, tile.dim);
    if (tile.dim == volume::leaf_dim)
      add_node(tile.origin);
    else
      ++(tile.dim == region_dim ? larger : largest);
  }
  std::ranges::sort(origins);
  const auto rest = std::ranges::unique(origins);
  origins.erase(rest.begin(), rest.end());
  const std::size_t contents = 1 + leaves.size() + tiles.size();
  if (contents + origins.size() >= IndexMap::none)
    throw Error("the volume has too many leaves and tiles, expected fewer than 2^32");
  require_memory(context,
                 static_cast<double>(leaves.size()) * sizeof(InsideBits) +
                     static_cast<double>(contents) * sizeof(Content) +
                     static_cast<double>(origins.size()) * (sizeof(Node) + 8 * sizeof(Region)),
                 "the index of the volume");
  nodes_.resize(origins.size());
  node_numbers_ = IndexMap(origins.size() + larger);
  large_ = IndexMap(largest);
  has_large_ = largest > 0;
  for (std::size_t n = 0; n < origins.size(); ++n) {
    nodes_[n].origin = origins[n];
    node_numbers_.insert(origins[n], static_cast<std::uint32_t>(n));
  }

  bits_ = std::make_unique_for_overwrite<InsideBits[]>(leaves.size());
  contents_ = std::make_unique_for_overwrite<Content[]>(contents);
  const float background = grid.info().background;
  contents_[0] = {nullptr, nullptr, background, inside(background)};
  const auto place = [&](const Int3& origin, std::size_t number) {
    nodes_[node_numbers_.find(region_origin(origin))]
        .content[region_row(origin)][place_in_row(origin)] = static_cast<std::uint32_t>(number);
  };
  const Context quiet = without_progress(context);
  parallel_blocks(quiet, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      InsideBits& bits = bits_[n];
      bits = inside_bits(leaves[n].values, inside);
      std::uint64_t any = 0, all = ~0ULL;
      for (const std::uint64_t word : bits) {
        any |= word;
        all &= word;
      }
      contents_[1 + n] = {leaves[n].values, any == 0 || all == ~0ULL ? nullptr : &bits, 0,
                          any != 0};
      place(leaves[n].origin, 1 + n);
    }
  });
  for (std::size_t n = 0; n < tiles.size(); ++n) {
    const volume::TileView& tile = tiles[n];
    const std::size_t number = 1 + leaves.size() + n;
    contents_[number] = {nullptr, nullptr, tile.value, inside(tile.value)};
    if (tile.dim == volume::leaf_dim) {
      place(tile.origin, number);
      continue;
    }
    if (tile.dim == region_dim)
      node_numbers_.insert(tile.origin, static_cast<std::uint32_t>(nodes_.size() + number));
    else
      large_.insert(tile.origin, static_cast<std::uint32_t>(number));
    if (contents_[number].side != contents_[0].side)
      opposite_tiles_.push_back(tile);
  }
  parallel_blocks(quiet, nodes_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for (std::size_t row = 0; row < region_rows; ++row) {
        unsigned opposite = 0, other = 0;
        for (unsigned k = 0; k < 16; ++k) {
          const std::uint32_t number = nodes_[n].content[row][k];
          if (number == 0)
            continue;
          const Content& content = contents_[number];
          const bool differs = content.side != contents_[0].side;
          opposite |= (content.bits == nullptr && differs ? 1U : 0U) << k;
          other |= (content.bits != nullptr || differs ? 1U : 0U) << k;
        }
        nodes_[n].opposite[row] = static_cast<std::uint16_t>(opposite);
        nodes_[n].other[row] = static_cast<std::uint16_t>(other);
      }
  });
}

std::uint32_t InsideField::outside_nodes(std::uint32_t number, const Int3& origin) const {
  if (number != IndexMap::none)
    return static_cast<std::uint32_t>(number - nodes_.size());
  if (!has_large_)
    return 0;
  const std::uint32_t tile = large_.find({origin[0] & ~4095, origin[1] & ~4095, origin[2] & ~4095});
  return tile == IndexMap::none ? 0 : tile;
}

std::array<std::uint32_t, 8> InsideField::octants(const Int3& origin) const {
  std::array<std::uint32_t, 8> numbers{};
  const std::size_t row = region_row(origin);
  const unsigned k = place_in_row(origin);
  if (row >> 4 < 15 && (row & 15) < 15 && k < 15) { // all in one region
    const std::uint32_t n = node_numbers_.find(region_origin(origin));
    if (n < nodes_.size()) {
      const auto& content = nodes_[n].content;
      for (unsigned octant = 0; octant < 8; ++octant)
        numbers[octant] = content[row + ((octant & 1) << 4) + (octant >> 1 & 1)][k + (octant >> 2)];
      return numbers;
    }
  }
  for (unsigned octant = 0; octant < 8; ++octant)
    numbers[octant] = at(shifted(origin, octant, volume::leaf_dim));
  return numbers;
}

/// A cell may be crossed if its block and the seven on its far sides are neither all wholly on the
/// background's side nor all wholly on the other.
void InsideField::mark_blocks(Region& region) const {
  // With the first layer of the neighbours: word 17 i + j, bit k.
  std::array<std::uint32_t, 289> other{}, opposite{};
  for (unsigned octant = 0; octant < 8; ++octant) {
    bool exists = true; // no voxel lies so near the limits of 32 bits
    for (unsigned a = 0; a < 3; ++a)
      exists = exists && ((octant >> a & 1) == 0 || region.origin[a] <= INT32_MAX - region_dim);
    if (!exists)
      continue;
    const Int3 origin = shifted(region.origin, octant, region_dim);
    const std::uint32_t n = node_numbers_.find(origin);
    const Node* const node = n < nodes_.size() ? &nodes_[n] : nullptr;
    std::uint32_t constant = 0;
    if (node == nullptr) {
      if (contents_[outside_nodes(n, origin)].side == contents_[0].side)
        continue;
      constant = 0xffff;
    }
    const unsigned far_i = octant & 1, far_j = octant >> 1 & 1, far_k = octant >> 2;
    for (unsigned i = 0; i < (far_i != 0 ? 1U : 16U); ++i)
      for (unsigned j = 0; j < (far_j != 0 ? 1U : 16U); ++j) {
        const unsigned at = 17 * (i + 16 * far_i) + j + 16 * far_j, row = 16 * i + j;
        const std::uint32_t a = node != nullptr ? node->other[row] : constant,
                            b = node != nullptr ? node->opposite[row] : constant;
        other[at] |= far_k != 0 ? (a & 1) << 16 : a;
        opposite[at] |= far_k != 0 ? (b & 1) << 16 : b;
      }
  }
  for (unsigned i = 0; i < 16; ++i)
    for (unsigned j = 0; j < 16; ++j) {
      const unsigned at = 17 * i + j;
      const std::uint32_t any = other[at] | other[at + 1] | other[at + 17] | other[at + 18],
                          all = opposite[at] & opposite[at + 1] & opposite[at + 17] &
                                opposite[at + 18];
      region.blocks[16 * i + j] = static_cast<std::uint16_t>((any | any >> 1) & ~(all & all >> 1));
    }
}

InsideField::Candidates InsideField::candidates(const Context& context) const {
  std::vector<Int3> origins;
  for (const Node& node : nodes_)
    for (unsigned octant = 0; octant < 8; ++octant) {
      bool exists = true; // else the node's voxels are 16 from the limits of 32 bits or more
      for (unsigned a = 0; a < 3; ++a)
        exists = exists && ((octant >> a & 1) == 0 || node.origin[a] >= INT32_MIN + region_dim);
      if (exists)
        origins.push_back(shifted(node.origin, octant, -region_dim));
    }
  for (const volume::TileView& tile : opposite_tiles_)
    append_shell(tile, origins);
  std::ranges::sort(origins);
  const auto rest = std::ranges::unique(origins);
  origins.erase(rest.begin(), rest.end());
  require_memory(context, static_cast<double>(origins.size()) * (sizeof(Region) + 40),
                 "the index of blocks");

  Candidates result{std::vector<Region>(origins.size()), IndexMap(origins.size()), {}};
  std::vector<Region>& regions = result.regions;
  parallel_blocks(without_progress(context), regions.size(), 16,
                  [&](std::size_t begin, std::size_t end) {
                    for (std::size_t n = begin; n < end; ++n) {
                      regions[n].origin = origins[n];
                      mark_blocks(regions[n]);
                    }
                  });
  std::size_t count = 0;
  for (std::size_t n = 0; n < regions.size(); ++n) {
    result.numbers.insert(regions[n].origin, static_cast<std::uint32_t>(n));
    for (const std::uint16_t row : regions[n].blocks)
      count += count_bits(row);
  }
  if (count >= IndexMap::none)
    throw Error("the surface crosses too many blocks, expected fewer than 2^32");
  require_memory(context, static_cast<double>(count) * sizeof(Int3), "the list of blocks");
  result.blocks.reserve(count);
  // By (i, j, k): through the regions of one i together, of these through those of one j together.
  const auto same = [&](std::size_t first, std::size_t axes) {
    std::size_t last = first;
    while (last < regions.size() &&
           std::equal(regions[last].origin.begin(), regions[last].origin.begin() + axes,
                      regions[first].origin.begin()))
      ++last;
    return last;
  };
  for (std::size_t slab = 0, slab_end = 0; slab < regions.size(); slab = slab_end) {
    slab_end = same(slab, 1);
    for (std::size_t i = 0; i < 16; ++i)
      for (std::size_t column = slab, column_end = slab; column < slab_end; column = column_end) {
        column_end = same(column, 2);
        for (std::size_t row = 16 * i; row < 16 * i + 16; ++row)
          for (std::size_t n = column; n < column_end; ++n) {
            Region& region = regions[n];
            region.first[row] = static_cast<std::uint32_t>(result.blocks.size());
            for (unsigned bits = region.blocks[row]; bits != 0; bits &= bits - 1)
              result.blocks.push_back(
                  {region.origin[0] + volume::leaf_dim * static_cast<int>(row >> 4),
                   region.origin[1] + volume::leaf_dim * static_cast<int>(row & 15),
                   region.origin[2] + volume::leaf_dim * std::countr_zero(bits)});
          }
      }
  }
  return result;
}

} // namespace gewebe::surface
