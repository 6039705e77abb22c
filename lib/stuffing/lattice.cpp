#include "base/error.h"
#include "base/parallel.h"
#include "geometry/index_map.h"
#include "stuffing/lattice_internal.h"
#include "text/number_text.h"
#include "volume/field.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace gewebe::stuffing {
namespace {

constexpr double index_limit = 1 << 30;

volume::GridTransform scaled(const volume::GridTransform& transform, double factor) {
  volume::GridTransform result = transform;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      result.m[4 * row + column] *= factor;
  return result;
}

/// first, then second.
volume::GridTransform after(const volume::GridTransform& second,
                            const volume::GridTransform& first) {
  volume::GridTransform result;
  const Vec3 origin = second.to_index(first.to_world({0, 0, 0}));
  for (int column = 0; column < 3; ++column) {
    Vec3 unit;
    unit[column] = 1;
    const Vec3 image = second.to_index(first.to_world(unit)) - origin;
    for (int row = 0; row < 3; ++row)
      result.m[static_cast<std::size_t>(4 * row + column)] = image[row];
  }
  for (int row = 0; row < 3; ++row)
    result.m[static_cast<std::size_t>(4 * row + 3)] = origin[row];
  return result;
}

/// Lattice places of a box of the grid's index space, grown to whole blocks, as block numbers.
struct BlockRange {
  std::array<std::int64_t, 3> min{}, max{};
  double count() const {
    double product = 1;
    for (std::size_t a = 0; a < 3; ++a)
      product *= static_cast<double>(max[a] - min[a] + 1);
    return product;
  }
};
BlockRange block_range(const volume::GridTransform& to_place, const Int3& origin, int dim) {
  // Voxel centres of the cube, and all that interpolation takes from them.
  const Vec3 low{origin[0] - 1.0, origin[1] - 1.0, origin[2] - 1.0};
  const double edge = dim + 1.0;
  Box3 box;
  for (int corner = 0; corner < 8; ++corner)
    box.add(to_place.to_world({low.x + ((corner & 1) != 0 ? edge : 0),
                               low.y + ((corner & 2) != 0 ? edge : 0),
                               low.z + ((corner & 4) != 0 ? edge : 0)}));
  BlockRange range;
  for (std::size_t a = 0; a < 3; ++a) {
    const double from = std::floor((box.min[static_cast<int>(a)] - 1) / volume::leaf_dim),
                 to = std::floor((box.max[static_cast<int>(a)] + 1) / volume::leaf_dim);
    if (!(from > -index_limit / volume::leaf_dim) || !(to < index_limit / volume::leaf_dim))
      throw Error("the volume has cells beyond index 2^30 of the lattice, expected a larger --cell "
                  "or a volume nearer to its origin");
    range.min[a] = static_cast<std::int64_t>(from);
    range.max[a] = static_cast<std::int64_t>(to);
  }
  return range;
}

std::string place_text(const Vec3& index) {
  return text::number_text(index.x) + ", " + text::number_text(index.y) + ", " +
         text::number_text(index.z);
}

bool is_inside(const StuffingLattice& lattice, double value) {
  return lattice.below ? value < lattice.isovalue : value > lattice.isovalue;
}

/// Origins of the blocks that may hold a point inside, by (i, j, k).
std::vector<Int3> candidates(const Context& context, const volume::Grid& grid,
                             const StuffingLattice& lattice) {
  const volume::GridTransform to_place =
      after(lattice.to_index, volume::GridTransform{}); // of index space
  const std::vector<volume::LeafView> leaves = grid.leaves();
  std::vector<std::uint8_t> wanted(leaves.size());
  parallel_blocks(context, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      wanted[n] =
          std::any_of(leaves[n].values, leaves[n].values + volume::leaf_voxels, [&](float value) {
            return !std::isfinite(value) || is_inside(lattice, static_cast<double>(value));
          });
  });
  std::vector<BlockRange> ranges;
  for (std::size_t n = 0; n < leaves.size(); ++n)
    if (wanted[n] != 0)
      ranges.push_back(block_range(to_place, leaves[n].origin, volume::leaf_dim));
  for (const volume::TileView& tile : grid.tiles())
    if (!std::isfinite(tile.value) || is_inside(lattice, static_cast<double>(tile.value)))
      ranges.push_back(block_range(to_place, tile.origin, tile.dim));
  double count = 0;
  for (const BlockRange& range : ranges)
    count += range.count();
  require_memory(context, count * sizeof(Int3), "the blocks of the lattice");
  if (!(count < 1e9))
    throw Error("the lattice would have over " + text::number_text(count * 512) +
                " cells, expected a larger --cell");
  std::vector<Int3> origins;
  origins.reserve(static_cast<std::size_t>(count));
  for (const BlockRange& range : ranges)
    for (std::int64_t i = range.min[0]; i <= range.max[0]; ++i)
      for (std::int64_t j = range.min[1]; j <= range.max[1]; ++j)
        for (std::int64_t k = range.min[2]; k <= range.max[2]; ++k)
          origins.push_back({static_cast<std::int32_t>(i * volume::leaf_dim),
                             static_cast<std::int32_t>(j * volume::leaf_dim),
                             static_cast<std::int32_t>(k * volume::leaf_dim)});
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  return origins;
}

/// The value of all of a block's surroundings where they are one tile or the background.
bool is_constant(const StuffingLattice& lattice, volume::GridAccessor& values, const Int3& origin,
                 float& value) {
  Box3 box;
  for (int corner = 0; corner < 8; ++corner)
    box.add(lattice.to_index.to_world(
        {origin[0] + ((corner & 1) != 0 ? volume::leaf_dim + 0.5 : -0.5),
         origin[1] + ((corner & 2) != 0 ? volume::leaf_dim + 0.5 : -0.5),
         origin[2] + ((corner & 4) != 0 ? volume::leaf_dim + 0.5 : -0.5)}));
  Int3 low{}, high{};
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = static_cast<std::int32_t>(std::floor(box.min[static_cast<int>(a)])) &
             ~(volume::leaf_dim - 1);
    high[a] = static_cast<std::int32_t>(std::floor(box.max[static_cast<int>(a)])) + 1;
  }
  bool first = true;
  for (std::int32_t i = low[0]; i <= high[0]; i += volume::leaf_dim)
    for (std::int32_t j = low[1]; j <= high[1]; j += volume::leaf_dim)
      for (std::int32_t k = low[2]; k <= high[2]; k += volume::leaf_dim) {
        float here = 0;
        if (values.leaf_at({i, j, k}, here).values != nullptr)
          return false;
        if (!first && here != value)
          return false;
        value = here;
        first = false;
      }
  return true;
}

void sample(const StuffingLattice& lattice, volume::GridAccessor& values, volume::Field& field,
            StuffingBlock& block) {
  float constant = 0;
  if (is_constant(lattice, values, block.origin, constant) && std::isfinite(constant)) {
    block.inside.fill(is_inside(lattice, static_cast<double>(constant)) ? ~std::uint64_t{0} : 0);
    return;
  }
  for (unsigned w = 0; w < 16; ++w) {
    std::uint64_t word = 0;
    for (unsigned bit = 0; bit < 64; ++bit) {
      const Vec3 index = lattice.to_index.to_world(bcc::position(point_at(block, w, bit)));
      const double value = field.value(index);
      if (!std::isfinite(value))
        throw Error("the volume has a value that is not finite near voxel (" + place_text(index) +
                    ")");
      word |= std::uint64_t{is_inside(lattice, value)} << bit;
    }
    block.inside[w] = word;
  }
}

void link_blocks(StuffingBlocks& blocks) {
  IndexMap numbers(blocks.size());
  for (std::size_t n = 0; n < blocks.size(); ++n)
    numbers.insert(blocks[n].origin, static_cast<std::uint32_t>(n));
  for (StuffingBlock& block : blocks)
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          block.neighbours[static_cast<std::size_t>(9 * x + 3 * y + z + 13)] = numbers.find(
              {block.origin[0] + volume::leaf_dim * x, block.origin[1] + volume::leaf_dim * y,
               block.origin[2] + volume::leaf_dim * z});
}

void find_surface(const StuffingBlocks& blocks, StuffingBlock& block) {
  const auto inside_word = [](const StuffingBlock& there, unsigned word) {
    return there.inside[word];
  };
  PointSet surface{};
  for (unsigned w = 0; w < 16; ++w) {
    const unsigned kind = w / 8;
    std::uint64_t differs = 0;
    for (unsigned d = 0; d < bcc::directions; ++d)
      differs |= block.inside[w] ^ shifted_word(blocks, block, bcc::kind_after(kind, d),
                                                static_cast<int>(w % 8), bcc::place_step(kind, d),
                                                inside_word);
    surface[w] = differs;
  }
  block.surface = PointRanks(surface);
}

} // namespace

StuffingLattice stuffing_lattice(const volume::Grid& grid, std::optional<double> isovalue,
                                 std::optional<double> cell) {
  const volume::GridInfo& info = grid.info();
  StuffingLattice lattice;
  lattice.isovalue = isovalue.value_or(info.level_set ? 0 : info.isovalue);
  lattice.below = info.level_set;
  const double determinant = info.transform.determinant();
  if (!std::isfinite(lattice.isovalue))
    throw Error("the isovalue is not finite");
  if (!std::isfinite(determinant) || determinant == 0)
    throw Error("the volume's transform is singular, expected an invertible affine map");
  if (info.band_isovalue && *info.band_isovalue != lattice.isovalue)
    throw Error("the volume is exact only near isovalue " + text::number_text(*info.band_isovalue) +
                " (made with --band), expected that one, not " +
                text::number_text(lattice.isovalue));
  if (is_inside(lattice, static_cast<double>(info.background)))
    throw Error("the volume's background is inside, so that nothing bounds the solid, expected it "
                "outside");
  const bool cubic = info.transform.is_cubic();
  const double voxel = cubic ? info.transform.voxel_size().x : std::cbrt(std::fabs(determinant));
  lattice.cell = cell.value_or(voxel);
  if (!std::isfinite(lattice.cell) || !(lattice.cell > 0))
    throw Error("a cell of " + text::number_text(lattice.cell) + " mm, expected more than 0");
  if (cubic) {
    const double factor = lattice.cell / voxel;
    lattice.to_world = scaled(info.transform, factor);
    lattice.to_index = scaled(volume::GridTransform{}, factor);
  } else {
    lattice.to_world = volume::uniform_transform(lattice.cell);
    lattice.to_index = after(info.transform, lattice.to_world);
  }
  return lattice;
}

StuffingBlocks stuffing_blocks(const Context& context, const volume::Grid& grid,
                               const StuffingLattice& lattice,
                               const std::function<bool(const Int3&)>& keep) {
  Context quiet = context;
  quiet.progress = nullptr;
  const std::vector<Int3> origins = candidates(quiet, grid, lattice);
  require_memory(context, static_cast<double>(origins.size()) * 2 * sizeof(StuffingBlock),
                 "the blocks of the lattice");
  StuffingBlocks sampled(origins.size());
  parallel_blocks(quiet, origins.size(), 8, [&](std::size_t begin, std::size_t end) {
    volume::GridAccessor values(grid);
    volume::Field field(grid);
    for (std::size_t n = begin; n < end; ++n) {
      sampled[n].origin = origins[n];
      sample(lattice, values, field, sampled[n]);
    }
  });
  // Those with a point inside, and their neighbours, which own the other ends of its edges.
  std::vector<Int3> kept;
  for (const StuffingBlock& block : sampled)
    if (size(block.inside) != 0 || (keep && keep(block.origin)))
      for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
          for (int z = -1; z <= 1; ++z)
            kept.push_back({block.origin[0] + volume::leaf_dim * x,
                            block.origin[1] + volume::leaf_dim * y,
                            block.origin[2] + volume::leaf_dim * z});
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  StuffingBlocks blocks(kept.size());
  for (std::size_t n = 0, from = 0; n < kept.size(); ++n) {
    blocks[n].origin = kept[n];
    while (from < sampled.size() && sampled[from].origin < kept[n])
      ++from;
    if (from < sampled.size() && sampled[from].origin == kept[n])
      blocks[n].inside = sampled[from].inside;
  }
  link_blocks(blocks);
  parallel_blocks(quiet, blocks.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      find_surface(blocks, blocks[n]);
  });
  std::uint64_t count = 0;
  for (StuffingBlock& block : blocks) {
    block.first_surface = static_cast<std::uint32_t>(count);
    count += size(block.surface.set());
    if (count >= UINT32_MAX)
      throw Error("the surface passes 2^32 - 1 lattice points, expected fewer");
  }
  return blocks;
}

} // namespace gewebe::stuffing
