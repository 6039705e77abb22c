#include "surface/marching_cubes.h"

#include "base/error.h"
#include "base/index_map.h"
#include "base/parallel.h"
#include "surface/marching_cubes_table.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <emmintrin.h>
#include <limits>
#include <utility>

// Based on: Lorensen and Cline, Marching Cubes: A High Resolution 3D Surface Construction
// Algorithm, 1987.

namespace gewebe {
namespace {

using Bits = std::array<std::uint64_t, leaf_dim>; // word i, bit 8 j + k: voxel (i, j, k) is inside

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

Bits inside_bits(const float* values, const Inside& inside) {
  const __m128 bound = _mm_set1_ps(inside.bound); // SSE2 is in every x86-64
  Bits bits;
  for (std::uint64_t& word : bits) {
    word = 0;
    for (unsigned n = 0; n < 64; n += 4) {
      const __m128 four = _mm_loadu_ps(values + n);
      const __m128 mask = inside.below ? _mm_cmplt_ps(four, bound) : _mm_cmpgt_ps(four, bound);
      word |= static_cast<std::uint64_t>(_mm_movemask_ps(mask)) << n;
    }
    values += 64;
  }
  return bits;
}

/// std::popcount is a library call on baseline x86-64.
std::uint32_t count_bits(std::uint64_t x) {
  x -= x >> 1 & 0x5555555555555555U;
  x = (x & 0x3333333333333333U) + (x >> 2 & 0x3333333333333333U);
  x = (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0fU;
  return static_cast<std::uint32_t>(x * 0x0101010101010101U >> 56);
}

/// An 8³ block of voxels: a leaf, or constant.
struct Content {
  const float* values = nullptr;
  const Bits* bits = nullptr; // nullptr: all voxels are on `side`
  float constant = 0;
  bool side = false;
  std::uint64_t word(std::size_t i) const { return bits ? (*bits)[i] : side ? ~0ULL : 0; }
};

/// Leaves and tiles by position, and which voxels are inside.
class Field {
public:
  Field(const Context& context, const Grid& grid, double isovalue)
      : isovalue_(isovalue), inside_(make_inside(isovalue, grid.info().level_set)),
        leaves_(grid.leaves()), tiles_(grid.tiles()) {
    background_.constant = grid.info().background;
    background_.side = inside_(background_.constant);
    check_range();
    std::array<std::size_t, 3> counts{leaves_.size(), 0, 0};
    for (const TileView& tile : tiles_)
      ++counts[level(tile.dim)];
    for (std::size_t l = 0; l < 3; ++l)
      maps_[l] = IndexMap(counts[l]);

    require_memory(context, static_cast<double>(leaves_.size()) * 150, "the index of the volume");
    contents_.resize(leaves_.size() + tiles_.size());
    bits_.resize(leaves_.size());
    Context quiet = context;
    quiet.progress = nullptr;
    parallel_blocks(quiet, leaves_.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        bits_[n] = inside_bits(leaves_[n].values, inside_);
        Content& content = contents_[n];
        content.values = leaves_[n].values;
        content.side = (bits_[n][0] & 1) != 0;
        const std::uint64_t uniform = content.side ? ~0ULL : 0;
        if (std::ranges::any_of(bits_[n], [&](std::uint64_t word) { return word != uniform; }))
          content.bits = &bits_[n];
      }
    });
    for (std::size_t n = 0; n < leaves_.size(); ++n)
      maps_[0].insert(leaves_[n].origin, static_cast<std::uint32_t>(n));
    for (std::size_t n = 0; n < tiles_.size(); ++n) {
      const TileView& tile = tiles_[n];
      const std::size_t number = leaves_.size() + n;
      contents_[number].constant = tile.value;
      contents_[number].side = inside_(tile.value);
      maps_[level(tile.dim)].insert(tile.origin, static_cast<std::uint32_t>(number));
      has_large_tiles_ = has_large_tiles_ || tile.dim > leaf_dim;
    }
  }

  double isovalue() const { return isovalue_; }
  const Content& background() const { return background_; }
  const std::vector<LeafView>& leaves() const { return leaves_; }
  const std::vector<TileView>& tiles() const { return tiles_; }
  const Content& content_of_leaf(std::size_t n) const { return contents_[n]; }
  const Content& content_of_tile(std::size_t n) const { return contents_[leaves_.size() + n]; }

  /// The block whose origin is `origin`.
  const Content& at(const Int3& origin) const {
    std::uint32_t number = maps_[0].find(origin);
    if (number == IndexMap::none && has_large_tiles_) {
      number = maps_[1].find({origin[0] & ~127, origin[1] & ~127, origin[2] & ~127});
      if (number == IndexMap::none)
        number = maps_[2].find({origin[0] & ~4095, origin[1] & ~4095, origin[2] & ~4095});
    }
    return number == IndexMap::none ? background_ : contents_[number];
  }
  /// All voxels of the block are on the side where the background is not.
  bool wholly_opposite(const Int3& origin) const {
    const Content& content = at(origin);
    return content.bits == nullptr && content.side != background_.side;
  }

private:
  static std::size_t level(std::int32_t dim) { return dim == 8 ? 0 : dim == 128 ? 1 : 2; }

  void check_range() const {
    const auto check = [](const Int3& origin, std::int64_t dim) {
      for (const std::int64_t low : origin)
        if (low < INT32_MIN + 16 || low + dim > INT32_MAX - 16)
          throw Error("voxel index " + std::to_string(low) +
                      " is too near the limits of 32 bits, expected 16 voxels of distance");
    };
    for (const LeafView& leaf : leaves_)
      check(leaf.origin, leaf_dim);
    for (const TileView& tile : tiles_)
      check(tile.origin, tile.dim);
    if (leaves_.size() + tiles_.size() >= IndexMap::none)
      throw Error("the volume has too many leaves and tiles, expected fewer than 2^32");
  }

  double isovalue_;
  Inside inside_;
  std::vector<LeafView> leaves_;
  std::vector<TileView> tiles_;
  std::vector<Bits> bits_;        // of each leaf
  std::vector<Content> contents_; // of leaves, then of tiles
  Content background_;
  std::array<IndexMap, 3> maps_; // by level: leaves and tiles of 8³, tiles of 128³, of 4096³
  bool has_large_tiles_ = false;
};

Int3 shifted(const Int3& origin, unsigned octant, int step) {
  const auto part = [&](unsigned axis) { return (octant >> axis & 1) != 0 ? step : 0; };
  return {origin[0] + part(0), origin[1] + part(1), origin[2] + part(2)};
}

// ---- which blocks to visit

/// The voxels of layer 0 along the axes of `octant` (all axes: one voxel) that differ from `side`.
bool layer_differs(const Content& content, unsigned octant, bool side) {
  if (content.bits == nullptr)
    return content.side != side;
  const std::uint64_t mask =
      ((octant & 2) != 0 ? 0xffULL : ~0ULL) & ((octant & 4) != 0 ? 0x0101010101010101ULL : ~0ULL);
  const std::size_t words = (octant & 1) != 0 ? 1 : leaf_dim;
  for (std::size_t i = 0; i < words; ++i)
    if (((content.word(i) ^ (side ? ~0ULL : 0)) & mask) != 0)
      return true;
  return false;
}

/// Do all voxels that the cells of this block touch lie in blocks that are wholly opposite?
bool all_opposite(const Field& field, const Int3& origin) {
  for (unsigned octant = 0; octant < 8; ++octant)
    if (!field.wholly_opposite(shifted(origin, octant, leaf_dim)))
      return false;
  return true;
}

/// Calls `visit` for the blocks of the one-block shell of a tile, the layer at its far sides
/// included: these hold all cells that touch both the tile and something else.
template <class Visit>
void for_shell(const TileView& tile, Visit&& visit) {
  const int last = tile.dim - leaf_dim;
  for (int i = -leaf_dim; i <= last; i += leaf_dim)
    for (int j = -leaf_dim; j <= last; j += leaf_dim) {
      const bool border = i < 0 || i == last || j < 0 || j == last;
      const int step = border ? leaf_dim : last + leaf_dim;
      for (int k = -leaf_dim; k <= last; k += step)
        visit(Int3{tile.origin[0] + i, tile.origin[1] + j, tile.origin[2] + k});
    }
}

/// Origins of the blocks whose cells may be crossed, sorted. A crossed cell touches a voxel on the
/// side opposite to the background, so it suffices to go round those.
std::vector<Int3> candidate_blocks(const Context& context, const Field& field) {
  const bool side = field.background().side;
  Context quiet = context;
  quiet.progress = nullptr;
  const std::size_t leaves = field.leaves().size(), tiles = field.tiles().size();
  std::vector<std::uint8_t> wanted(leaves + tiles); // bit n: the block at origin - 8 octant n
  parallel_blocks(quiet, leaves + tiles, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const bool is_leaf = n < leaves;
      const Content& content =
          is_leaf ? field.content_of_leaf(n) : field.content_of_tile(n - leaves);
      if (content.bits == nullptr && content.side == side)
        continue;
      if (!is_leaf && field.tiles()[n - leaves].dim > leaf_dim)
        continue; // below
      const Int3& origin = is_leaf ? field.leaves()[n].origin : field.tiles()[n - leaves].origin;
      unsigned octants = 0;
      for (unsigned octant = 0; octant < 8; ++octant)
        if (layer_differs(content, octant, side) &&
            (content.bits != nullptr || !all_opposite(field, shifted(origin, octant, -leaf_dim))))
          octants |= 1U << octant;
      wanted[n] = static_cast<std::uint8_t>(octants);
    }
  });
  std::size_t count = 0;
  for (const std::uint8_t octants : wanted)
    count += count_bits(octants);
  require_memory(context, static_cast<double>(count) * sizeof(Int3), "the list of blocks");
  std::vector<Int3> blocks;
  blocks.reserve(count);
  for (std::size_t n = 0; n < leaves + tiles; ++n)
    for (unsigned octant = 0; octant < 8; ++octant)
      if ((wanted[n] >> octant & 1) != 0)
        blocks.push_back(
            shifted(n < leaves ? field.leaves()[n].origin : field.tiles()[n - leaves].origin,
                    octant, -leaf_dim));
  for (std::size_t n = 0; n < tiles; ++n) {
    const TileView& tile = field.tiles()[n];
    if (tile.dim == leaf_dim || field.content_of_tile(n).side == side)
      continue;
    for_shell(tile, [&](const Int3& origin) {
      if (all_opposite(field, origin))
        return;
      blocks.push_back(origin);
      if (blocks.size() % (1 << 20) == 0) {
        // Nearly every one of these blocks is crossed by 64 cells or more.
        require_memory(context, static_cast<double>(blocks.size()) * 64 * sizeof(EdgeCrossing),
                       "the surface of the volume's tiles");
        if (context.cancelled && context.cancelled())
          throw Cancelled();
      }
    });
  }
  std::ranges::sort(blocks);
  const auto rest = std::ranges::unique(blocks);
  blocks.erase(rest.begin(), rest.end());
  return blocks;
}

// ---- one block

/// Inside bits of the 9³ corners of a block's cells: word[i][n] holds for each (j, k) the corner
/// (i, j + (n & 1), k + (n >> 1)).
struct CornerBits {
  std::array<std::array<std::uint64_t, 4>, leaf_dim + 1> word;
};

using Octants = std::array<const Content*, 8>; // the block and its neighbours on the far sides

Octants octants_of(const Field& field, const Int3& origin) {
  Octants octants{};
  for (unsigned n = 0; n < 8; ++n)
    octants[n] = &field.at(shifted(origin, n, leaf_dim));
  return octants;
}

CornerBits corner_bits(const Octants& octants) {
  constexpr std::uint64_t column = 0x0101010101010101U;
  CornerBits bits;
  for (std::size_t i = 0; i <= leaf_dim; ++i) {
    const std::size_t x = i / leaf_dim, slice = i % leaf_dim;
    const std::uint64_t here = octants[x]->word(slice), y = octants[x | 2]->word(slice),
                        z = octants[x | 4]->word(slice), yz = octants[x | 6]->word(slice);
    const std::uint64_t next_z = (here >> 1 & ~(column << 7)) | (z & column) << 7;
    const std::uint64_t y_next_z = (y >> 1 & ~(column << 7)) | (yz & column) << 7;
    bits.word[i] = {here, here >> 8 | y << 56, next_z, next_z >> 8 | y_next_z << 56};
  }
  return bits;
}

/// Bit 8 j + k: the surface crosses cell (i, j, k).
std::uint64_t active_cells(const CornerBits& bits, std::size_t i) {
  const auto& a = bits.word[i];
  const auto& b = bits.word[i + 1];
  return (a[0] | a[1] | a[2] | a[3] | b[0] | b[1] | b[2] | b[3]) &
         ~(a[0] & a[1] & a[2] & a[3] & b[0] & b[1] & b[2] & b[3]);
}

/// Which corners of the cell at bit n of slice i are inside: the index of the table.
unsigned cell_case(const CornerBits& bits, std::size_t i, unsigned n) {
  unsigned result = 0;
  for (unsigned corner = 0; corner < 8; ++corner)
    result |= static_cast<unsigned>(bits.word[i + (corner & 1)][corner >> 1] >> n & 1) << corner;
  return result;
}

/// What is kept of a block: its crossed edges, numbered.
struct Block {
  Int3 origin{};
  std::uint32_t first_point = 0, points = 0;
  std::uint32_t first_triangle = 0, triangles = 0;
  std::uint32_t cells = 0;
  std::array<std::uint16_t, 24> before{};  // crossed edges of this block in earlier words
  std::array<std::uint64_t, 24> crossed{}; // word 3 i + axis, bit 8 j + k

  /// Number of the point on the edge from local (i, j, k), bit n = 8 j + k, along `axis`.
  std::uint32_t point(std::size_t i, unsigned n, unsigned axis) const {
    const std::size_t w = 3 * i + axis;
    return first_point + before[w] + count_bits(crossed[w] & ((std::uint64_t{1} << n) - 1));
  }
};

Block examine_block(const Field& field, const Int3& origin) {
  Block block;
  block.origin = origin;
  const CornerBits bits = corner_bits(octants_of(field, origin));
  const auto& table = marching_cubes_table();
  for (std::size_t i = 0; i < leaf_dim; ++i) {
    std::uint64_t active = active_cells(bits, i);
    if (active == 0) {
      for (std::size_t w = 3 * i; w < 3 * i + 3; ++w)
        block.before[w] = static_cast<std::uint16_t>(block.points);
      continue;
    }
    const std::uint64_t here = bits.word[i][0];
    const std::array<std::uint64_t, 3> crossed{here ^ bits.word[i + 1][0], here ^ bits.word[i][1],
                                               here ^ bits.word[i][2]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      block.before[3 * i + axis] = static_cast<std::uint16_t>(block.points);
      block.crossed[3 * i + axis] = crossed[axis];
      block.points += count_bits(crossed[axis]);
    }
    for (; active != 0; active &= active - 1) {
      const auto n = static_cast<unsigned>(std::countr_zero(active));
      block.triangles += table[cell_case(bits, i, n)].count;
      ++block.cells;
    }
  }
  return block;
}

float value_at(const Octants& octants, unsigned i, unsigned j, unsigned k) {
  const Content& content = *octants[i >> 3 | j >> 3 << 1 | k >> 3 << 2];
  return content.values ? content.values[(i & 7) << 6 | (j & 7) << 3 | (k & 7)] : content.constant;
}

[[noreturn]] void throw_not_finite(const EdgeCrossing& crossing) {
  const Int3& c = crossing.corner;
  throw Error("the volume has a value beside the surface that is not finite, at voxel (" +
              std::to_string(c[0]) + ", " + std::to_string(c[1]) + ", " + std::to_string(c[2]) +
              ") or its neighbour");
}

void write_points(const Field& field, const Block& block, IsoSurface& surface) {
  const Octants octants = octants_of(field, block.origin);
  std::size_t point = block.first_point;
  for (unsigned w = 0; w < 24; ++w) {
    const unsigned i = w / 3, axis = w % 3;
    for (std::uint64_t crossed = block.crossed[w]; crossed != 0; crossed &= crossed - 1) {
      const auto n = static_cast<unsigned>(std::countr_zero(crossed));
      const unsigned j = n >> 3, k = n & 7;
      const double a = value_at(octants, i, j, k),
                   b = value_at(octants, i + (axis == 0), j + (axis == 1), k + (axis == 2));
      EdgeCrossing& crossing = surface.crossings[point];
      crossing.corner = {block.origin[0] + static_cast<int>(i),
                         block.origin[1] + static_cast<int>(j),
                         block.origin[2] + static_cast<int>(k)};
      crossing.axis = static_cast<std::int32_t>(axis);
      crossing.fraction = (field.isovalue() - a) / (b - a);
      if (!std::isfinite(a) || !std::isfinite(b))
        throw_not_finite(crossing);
      surface.mesh.points[point++] = surface.transform.to_world(index_position(crossing));
    }
  }
}

void write_triangles(const Field& field, const std::vector<Block>& blocks, const IndexMap& numbers,
                     const Block& block, bool mirrored, IsoSurface& surface) {
  const CornerBits bits = corner_bits(octants_of(field, block.origin));
  const auto& table = marching_cubes_table();
  std::array<const Block*, 8> near{};
  for (unsigned n = 0; n < 8; ++n) {
    const std::uint32_t number = numbers.find(shifted(block.origin, n, leaf_dim));
    near[n] =
        number == IndexMap::none ? nullptr : &blocks[number]; // nullptr: no crossed edge there
  }
  std::size_t triangle = block.first_triangle;
  std::array<std::uint32_t, 12> points{};
  for (unsigned i = 0; i < leaf_dim; ++i)
    for (std::uint64_t active = active_cells(bits, i); active != 0; active &= active - 1) {
      const auto n = static_cast<unsigned>(std::countr_zero(active));
      const CellCase& cell = table[cell_case(bits, i, n)];
      for (unsigned edges = cell.edges; edges != 0; edges &= edges - 1) {
        const auto e = static_cast<std::size_t>(std::countr_zero(edges));
        const unsigned corner = cell_edges[e].corner;
        const unsigned x = i + (corner & 1), y = (n >> 3) + (corner >> 1 & 1),
                       z = (n & 7) + (corner >> 2);
        points[e] = near[x >> 3 | y >> 3 << 1 | z >> 3 << 2]->point(x & 7, (y & 7) << 3 | (z & 7),
                                                                    cell_edges[e].axis);
      }
      for (std::size_t t = 0; t < cell.count; ++t) {
        const auto& corners = cell.triangles[t];
        Triangle& out = surface.mesh.triangles[triangle++];
        out = {points[corners[0]], points[corners[1]], points[corners[2]]};
        if (mirrored)
          std::swap(out[1], out[2]);
      }
    }
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

void check_input(const GridInfo& info, double isovalue) {
  if (!std::isfinite(isovalue))
    throw Error("the isovalue is not finite");
  const double determinant = info.transform.determinant();
  if (!std::isfinite(determinant) || determinant == 0)
    throw Error("the volume's transform is singular, expected an invertible affine map");
  if (info.band_isovalue && *info.band_isovalue != isovalue)
    throw Error("the volume is exact only near isovalue " + number_text(*info.band_isovalue) +
                " (made with --band), expected that one, not " + number_text(isovalue));
}

} // namespace

double default_isovalue(const GridInfo& info) {
  return info.level_set ? 0 : info.isovalue;
}

Vec3 index_position(const EdgeCrossing& crossing) {
  Vec3 p{static_cast<double>(crossing.corner[0]), static_cast<double>(crossing.corner[1]),
         static_cast<double>(crossing.corner[2])};
  p[crossing.axis] += crossing.fraction;
  return p;
}

IsoSurface marching_cubes(const Context& context, const Grid& grid,
                          std::optional<double> wanted_isovalue) {
  const double isovalue = wanted_isovalue.value_or(default_isovalue(grid.info()));
  check_input(grid.info(), isovalue);
  const Field field(context, grid, isovalue);
  Context quiet = context;
  quiet.progress = nullptr;

  const std::vector<Int3> candidates = candidate_blocks(context, field);
  require_memory(context, static_cast<double>(candidates.size()) * sizeof(Block),
                 "the crossed blocks");
  std::vector<Block> blocks(candidates.size());
  parallel_blocks(quiet, candidates.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      blocks[n] = examine_block(field, candidates[n]);
  });
  std::erase_if(blocks, [](const Block& block) { return block.cells == 0; });

  IsoSurface surface;
  surface.transform = grid.info().transform;
  surface.leaves = field.leaves().size();
  surface.blocks = blocks.size();
  std::uint64_t points = 0, triangles = 0;
  IndexMap numbers(blocks.size());
  for (std::size_t n = 0; n < blocks.size(); ++n) {
    Block& block = blocks[n];
    numbers.insert(block.origin, static_cast<std::uint32_t>(n));
    block.first_point = static_cast<std::uint32_t>(points);
    block.first_triangle = static_cast<std::uint32_t>(triangles);
    points += block.points;
    triangles += block.triangles;
    surface.active_cells += block.cells;
    if (points >= UINT32_MAX || triangles >= UINT32_MAX)
      throw Error("the surface has more than 2^32 - 2 points or triangles, expected fewer");
  }
  for (const LeafView& leaf : field.leaves())
    surface.leaves_visited += numbers.find(leaf.origin) != IndexMap::none ? 1 : 0;

  require_memory(context,
                 static_cast<double>(points) * (sizeof(Vec3) + sizeof(EdgeCrossing)) +
                     static_cast<double>(triangles) * sizeof(Triangle),
                 "the mesh of the isosurface");
  surface.mesh.points.resize(points);
  surface.crossings.resize(points);
  surface.mesh.triangles.resize(triangles);
  const bool mirrored = surface.transform.determinant() < 0;
  parallel_blocks(context, blocks.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      write_points(field, blocks[n], surface);
      write_triangles(field, blocks, numbers, blocks[n], mirrored, surface);
    }
  });
  return surface;
}

} // namespace gewebe
