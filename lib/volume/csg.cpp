#include "volume/csg.h"
// Based on: A. Ricci, A Constructive Geometry for Computer Graphics, 1973 (max, min and
// complement); B. Wyvill, C. McPheeters, G. Wyvill, Data Structure for Soft Objects, 1986 (sums of
// densities).

#include "base/error.h"
#include "base/parallel.h"
#include "volume/resample.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>

namespace gewebe {
namespace {

std::string number(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

// ---- what an operation does to values

// Written so that NaN becomes 0.
float at_least_0(float a) {
  return a > 0 ? a : 0.0f;
}
float clamp_01(float a) {
  return a > 0 ? (a < 1 ? a : 1.0f) : 0.0f;
}

/// An operand in one leaf: 512 values, or one for all.
struct Source {
  const float* values = nullptr;
  float constant = 0;
};

template <std::size_t N, class Function>
void apply(std::array<float, N>& a, const Source& b, Function&& function) {
  if (b.values != nullptr)
    for (std::size_t n = 0; n < N; ++n)
      a[n] = function(a[n], b.values[n]);
  else
    for (std::size_t n = 0; n < N; ++n)
      a[n] = function(a[n], b.constant);
}

/// Folds N values of each source.
template <std::size_t N>
void fold(CsgOperation operation, std::span<const Source> sources, std::array<float, N>& a) {
  const bool sum = operation == CsgOperation::add || operation == CsgOperation::subtract;
  apply(a, sources[0], [&](float, float b) { return sum ? b : clamp_01(b); });
  for (const Source& source : sources.subspan(1))
    switch (operation) {
    case CsgOperation::add:
      apply(a, source, [](float x, float y) { return x + y; });
      break;
    case CsgOperation::subtract:
      apply(a, source, [](float x, float y) { return x - y; });
      break;
    case CsgOperation::unite:
      apply(a, source, [](float x, float y) { return std::max(x, clamp_01(y)); });
      break;
    case CsgOperation::intersect:
      apply(a, source, [](float x, float y) { return std::min(x, clamp_01(y)); });
      break;
    case CsgOperation::difference:
      apply(a, source, [](float x, float y) { return std::min(x, 1 - clamp_01(y)); });
      break;
    case CsgOperation::exclusive_or:
      apply(a, source, [](float x, float y) {
        const float b = clamp_01(y);
        return std::max(std::min(x, 1 - b), std::min(1 - x, b));
      });
      break;
    }
  if (sum)
    apply(a, {}, [](float x, float) { return at_least_0(x); });
  if (!std::all_of(a.begin(), a.end(),
                   [](float x) { return x <= std::numeric_limits<float>::max(); }))
    throw Error("the sum of the densities leaves the range of single precision");
}

// ---- what may be combined

void check_operand(const CsgOperand& operand) {
  const GridInfo& info = operand.grid.info();
  if (info.level_set)
    throw Error(operand.name, "is a level set, expected a density volume");
  if (info.background != 0)
    throw Error(operand.name, "has the background " + number(info.background) + ", expected 0");
  if (!info.transform.is_cubic())
    throw Error(operand.name, "has " + info.transform.describe() + ", expected cubic voxels");
}

/// The band that the result has.
std::optional<double> common_band(CsgOperation operation, std::span<const CsgOperand> operands) {
  const CsgOperand* first = nullptr;
  for (const CsgOperand& operand : operands) {
    const std::optional<double>& band = operand.grid.info().band_isovalue;
    if (!band)
      continue;
    const std::string what = "is exact only near the isovalue " + number(*band);
    switch (operation) {
    case CsgOperation::add:
    case CsgOperation::subtract:
      throw Error(operand.name, what + ", expected a volume without band to add or subtract");
    case CsgOperation::difference:
    case CsgOperation::exclusive_or: // the complement is exact near 1 - v
      if (*band != 0.5)
        throw Error(operand.name, what + ", expected 0.5 or no band");
      break;
    case CsgOperation::unite:
    case CsgOperation::intersect:
      break;
    }
    if (first == nullptr)
      first = &operand;
    else if (*band != *first->grid.info().band_isovalue)
      throw Error("bands differ: " + first->name + " is exact near " +
                  number(*first->grid.info().band_isovalue) + ", " + operand.name + " near " +
                  number(*band) + ", expected one isovalue");
  }
  return first == nullptr ? std::nullopt : first->grid.info().band_isovalue;
}

/// Box of the active voxels of both grids, for the comparison of their lattices.
void common_box(const Grid& a, const Grid& b, Int3& min, Int3& max) {
  min = max = {0, 0, 0};
  bool some = a.active_box(min, max);
  Int3 b_min{}, b_max{};
  if (!b.active_box(b_min, b_max))
    return;
  for (std::size_t n = 0; n < 3; ++n) {
    min[n] = some ? std::min(min[n], b_min[n]) : b_min[n];
    max[n] = some ? std::max(max[n], b_max[n]) : b_max[n];
  }
}

/// Grids of all operands on the first one's lattice.
std::vector<Grid> on_one_lattice(const Context& context, std::span<const CsgOperand> operands,
                                 const CsgOptions& options, CsgReport& report) {
  const CsgOperand& first = operands[0];
  std::vector<Grid> grids{first.grid};
  for (const CsgOperand& operand : operands.subspan(1)) {
    const GridInfo &a = first.grid.info(), &b = operand.grid.info();
    if (a.isovalue != b.isovalue)
      throw Error("isovalues differ: " + first.name + " has " + number(a.isovalue) + ", " +
                  operand.name + " has " + number(b.isovalue) + ", expected equal ones");
    Int3 min{}, max{};
    common_box(first.grid, operand.grid, min, max);
    if (same_lattice(a.transform, b.transform, min, max)) {
      grids.push_back(operand.grid);
    } else if (options.resample) {
      grids.push_back(
          at(operand.name, [&] { return resample(context, operand.grid, a.transform); }));
      ++report.resampled;
    } else {
      throw Error("lattices differ: " + first.name + " has " + a.transform.describe() + ", " +
                  operand.name + " has " + b.transform.describe() +
                  ", expected equal ones or --resample");
    }
  }
  return grids;
}

// ---- where there is something to combine

/// All operands' leaves in one place.
struct LeafGroup {
  Int3 origin;
  std::size_t begin, end; ///< in Regions::leaves
};

struct OperandLeaf {
  std::size_t operand;
  LeafView view;
};

/// Disjoint regions that cover all leaves and tiles of the operands.
struct Regions {
  std::vector<OperandLeaf> leaves; ///< by origin, then operand
  std::vector<LeafGroup> groups;   ///< by origin
  std::vector<TileView> constant;  ///< regions in which every operand is constant; values unset
};

Int3 corner_of(const Int3& ijk, std::int32_t dim) {
  return {ijk[0] & -dim, ijk[1] & -dim, ijk[2] & -dim};
}

void sort_unique(std::vector<Int3>& origins) {
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
}

bool contains(const std::vector<Int3>& sorted, const Int3& origin) {
  return std::binary_search(sorted.begin(), sorted.end(), origin);
}

/// Cuts those `tiles` of edge `dim` that hold some of `taken` (sorted origins of blocks of edge
/// `part`) into blocks of that edge; returns the blocks that aren't taken and leaves the whole
/// tiles.
std::vector<Int3> split_tiles(std::vector<Int3>& tiles, std::int32_t dim,
                              const std::vector<Int3>& taken, std::int32_t part) {
  std::vector<Int3> occupied;
  for (const Int3& origin : taken)
    occupied.push_back(corner_of(origin, dim));
  sort_unique(occupied);
  std::vector<Int3> blocks;
  std::erase_if(tiles, [&](const Int3& tile) {
    if (!contains(occupied, tile))
      return false;
    for (std::int32_t i = 0; i < dim; i += part)
      for (std::int32_t j = 0; j < dim; j += part)
        for (std::int32_t k = 0; k < dim; k += part)
          if (const Int3 block{tile[0] + i, tile[1] + j, tile[2] + k}; !contains(taken, block))
            blocks.push_back(block);
    return true;
  });
  return blocks;
}

Regions find_regions(std::span<const Grid> grids) {
  Regions regions;
  std::vector<Int3> tiles_8, tiles_128, tiles_4096, leaf_origins;
  for (std::size_t g = 0; g < grids.size(); ++g) {
    for (const LeafView& leaf : grids[g].leaves())
      regions.leaves.push_back({g, leaf});
    for (const TileView& tile : grids[g].tiles())
      (tile.dim == 8 ? tiles_8 : tile.dim == 128 ? tiles_128 : tiles_4096).push_back(tile.origin);
  }
  std::sort(regions.leaves.begin(), regions.leaves.end(),
            [](const OperandLeaf& a, const OperandLeaf& b) {
              return a.view.origin != b.view.origin ? a.view.origin < b.view.origin
                                                    : a.operand < b.operand;
            });
  for (std::size_t n = 0; n < regions.leaves.size(); ++n) {
    const Int3& origin = regions.leaves[n].view.origin;
    if (n == 0 || regions.groups.back().origin != origin) {
      regions.groups.push_back({origin, n, n});
      leaf_origins.push_back(origin);
    }
    regions.groups.back().end = n + 1;
  }

  sort_unique(tiles_8);
  sort_unique(tiles_128);
  sort_unique(tiles_4096);
  std::erase_if(tiles_8, [&](const Int3& origin) { return contains(leaf_origins, origin); });
  std::vector<Int3> taken_8 = leaf_origins; // blocks of 8³ that are leaves or tiles
  taken_8.insert(taken_8.end(), tiles_8.begin(), tiles_8.end());
  sort_unique(taken_8);
  std::vector<Int3> taken_128 = tiles_128;
  for (const Int3& origin : taken_8)
    taken_128.push_back(corner_of(origin, 128));
  sort_unique(taken_128);

  // A large tile that holds smaller things is cut; what is taken of it then may itself have to be
  // cut.
  std::vector<Int3> cut_4096 = tiles_4096;
  const std::vector<Int3> new_128 = split_tiles(tiles_4096, 4096, taken_128, 128);
  std::erase_if(cut_4096, [&](const Int3& tile) { return contains(tiles_4096, tile); });
  for (const Int3& block : taken_128)
    if (contains(cut_4096, corner_of(block, 4096)))
      tiles_128.push_back(block);
  tiles_128.insert(tiles_128.end(), new_128.begin(), new_128.end());
  sort_unique(tiles_128);
  const std::vector<Int3> new_8 = split_tiles(tiles_128, 128, taken_8, 8);
  tiles_8.insert(tiles_8.end(), new_8.begin(), new_8.end());
  sort_unique(tiles_8);

  for (const Int3& origin : tiles_4096)
    regions.constant.push_back({origin, 4096, 0, false});
  for (const Int3& origin : tiles_128)
    regions.constant.push_back({origin, 128, 0, false});
  for (const Int3& origin : tiles_8)
    regions.constant.push_back({origin, 8, 0, false});
  return regions;
}

// ---- combining

using LeafValues = std::array<float, leaf_voxels>;

struct Folder {
  CsgOperation operation;
  std::vector<GridAccessor> accessors;
  std::vector<Source> sources;

  Folder(CsgOperation op, std::span<const Grid> grids) : operation(op), sources(grids.size()) {
    for (const Grid& grid : grids)
      accessors.emplace_back(grid);
  }
  /// \pre every operand is constant around `origin`
  float constant(const Int3& origin) {
    for (std::size_t g = 0; g < sources.size(); ++g) {
      sources[g] = {};
      (void)accessors[g].leaf_at(origin, sources[g].constant);
    }
    std::array<float, 1> value{};
    fold(operation, sources, value);
    return value[0];
  }
  void leaf(const Regions& regions, const LeafGroup& group, LeafValues& values) {
    std::size_t n = group.begin;
    for (std::size_t g = 0; g < sources.size(); ++g) {
      sources[g] = {};
      if (n < group.end && regions.leaves[n].operand == g)
        sources[g].values = regions.leaves[n++].view.values;
      else
        (void)accessors[g].leaf_at(group.origin, sources[g].constant);
    }
    fold(operation, sources, values);
  }
};

std::array<std::uint64_t, 8> active_bits(const LeafValues& values) {
  std::array<std::uint64_t, 8> active{};
  for (std::size_t n = 0; n < values.size(); ++n)
    active[n / 64] |= static_cast<std::uint64_t>(values[n] != 0) << (n % 64);
  return active;
}

/// What becomes of a group of leaves.
struct Outcome {
  enum class Kind { computed, shared, constant } kind = Kind::computed;
  std::size_t leaf = 0; ///< shared: in Regions::leaves
  float value = 0;      ///< constant
};

Outcome outcome_of(const Regions& regions, const LeafGroup& group, const LeafValues& values) {
  if (std::all_of(values.begin(), values.end(), [&](float v) { return v == values[0]; }))
    return {Outcome::Kind::constant, 0, values[0]};
  const std::array<std::uint64_t, 8> active = active_bits(values);
  for (std::size_t n = group.begin; n < group.end; ++n) {
    const LeafView& view = regions.leaves[n].view;
    if (std::memcmp(view.values, values.data(), sizeof values) == 0 &&
        std::memcmp(view.active, active.data(), sizeof active) == 0)
      return {Outcome::Kind::shared, n, 0};
  }
  return {};
}

} // namespace

const std::vector<std::string>& csg_operation_names() {
  static const std::vector<std::string> names{"add",       "subtract",   "union",
                                              "intersect", "difference", "xor"};
  return names;
}

CsgOperation csg_operation_from_name(std::string_view name) {
  const std::vector<std::string>& names = csg_operation_names();
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) {
    std::string expected;
    for (const std::string& n : names)
      expected += (expected.empty() ? "" : ", ") + n;
    throw UsageError("unknown operation '" + std::string(name) + "', expected one of " + expected);
  }
  return static_cast<CsgOperation>(it - names.begin());
}

Grid csg(const Context& context, CsgOperation operation, std::span<const CsgOperand> operands,
         const CsgOptions& options, CsgReport* report) {
  if (operands.size() < 2)
    throw Error("csg: " + std::to_string(operands.size()) + " volumes, expected at least 2");
  CsgReport local;
  CsgReport& r = report != nullptr ? *report : local;
  r = {};
  for (const CsgOperand& operand : operands)
    check_operand(operand);
  GridInfo info = operands[0].grid.info();
  info.band_isovalue = common_band(operation, operands);
  const std::vector<Grid> grids = on_one_lattice(context, operands, options, r);
  const Regions regions = find_regions(grids);

  // First what becomes of each leaf, so that no more memory is taken than the result needs; those
  // with values of their own are computed again in place.
  Context quiet = context;
  quiet.progress = nullptr;
  std::vector<Outcome> outcomes(regions.groups.size());
  parallel_blocks(quiet, outcomes.size(), 256, [&](std::size_t begin, std::size_t end) {
    Folder folder(operation, grids);
    LeafValues values{};
    for (std::size_t n = begin; n < end; ++n) {
      folder.leaf(regions, regions.groups[n], values);
      outcomes[n] = outcome_of(regions, regions.groups[n], values);
    }
  });

  GridBuilder builder(info);
  Folder folder(operation, grids);
  const auto add_tile = [&](const Int3& origin, std::int32_t dim, float value) {
    if (value != 0)
      builder.add_tile({origin, dim, value, true});
  };
  r.tiles_combined = regions.constant.size();
  for (const TileView& tile : regions.constant) // large ones first
    add_tile(tile.origin, tile.dim, folder.constant(tile.origin));
  std::vector<Int3> computed_origins;
  std::vector<std::size_t> computed;
  for (std::size_t n = 0; n < outcomes.size(); ++n) {
    if (outcomes[n].kind == Outcome::Kind::constant) {
      add_tile(regions.groups[n].origin, leaf_dim, outcomes[n].value);
      ++r.leaves_constant;
    } else if (outcomes[n].kind == Outcome::Kind::shared) {
      ++r.leaves_shared;
    } else {
      computed.push_back(n);
      computed_origins.push_back(regions.groups[n].origin);
    }
  }
  r.leaves_computed = computed.size();
  require_memory(context, 2400.0 * static_cast<double>(r.leaves_computed + r.leaves_shared),
                 "the combined volume");
  for (const Outcome& outcome : outcomes)
    if (outcome.kind == Outcome::Kind::shared) {
      const OperandLeaf& leaf = regions.leaves[outcome.leaf];
      builder.share_leaf(grids[leaf.operand], leaf.view);
    }
  const std::vector<LeafRef> leaves = builder.add_leaves(context, computed_origins);
  parallel_blocks(context, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    Folder block_folder(operation, grids);
    LeafValues values{};
    for (std::size_t n = begin; n < end; ++n) {
      block_folder.leaf(regions, regions.groups[computed[n]], values);
      std::copy(values.begin(), values.end(), leaves[n].values);
      const std::array<std::uint64_t, 8> active = active_bits(values);
      std::copy(active.begin(), active.end(), leaves[n].active);
    }
  });
  return builder.finish(false);
}

} // namespace gewebe
