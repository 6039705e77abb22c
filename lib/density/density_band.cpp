#include "base/parallel.h"
#include "density/density_blocks_internal.h"
#include "geometry/index_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace gewebe::density {
namespace {

constexpr std::size_t batch_leaves = 1024; // a thread's, whose values wait for their place: 2 MiB

/// What the neighbours of an evaluated leaf need to know. Face 2 axis + (far ? 1 : 0).
struct Sides {
  std::uint8_t background = 0; ///< faces where some voxel is on the background's side
  std::uint8_t opposite = 0;   ///< on the other
  bool mixed = false;
};

/// The largest float not above the isovalue: value > isovalue is value > bound.
float float_bound(double isovalue) {
  const auto nearest = static_cast<float>(isovalue);
  return static_cast<double>(nearest) > isovalue ? std::nextafter(nearest, -HUGE_VALF) : nearest;
}

Sides sides_of(const float* values, float bound, bool background_above) {
  const std::array<std::uint64_t, 8> above = compare_leaf(values, bound);
  std::uint64_t some = 0, all = ~std::uint64_t{0};
  for (const std::uint64_t word : above) {
    some |= word;
    all &= word;
  }
  constexpr std::uint64_t row = 0xff, column = 0x0101010101010101U;
  const std::array<std::uint64_t, 6> some_at{above[0],   above[7],      some & row,
                                             some >> 56, some & column, some & column << 7};
  const std::array<bool, 6> all_at{above[0] == ~std::uint64_t{0},
                                   above[7] == ~std::uint64_t{0},
                                   (all & row) == row,
                                   all >> 56 == row,
                                   (all & column) == column,
                                   (all & column << 7) == column << 7};
  std::uint8_t faces_above = 0, faces_below = 0;
  for (unsigned face = 0; face < 6; ++face) {
    faces_above = static_cast<std::uint8_t>(faces_above | (some_at[face] != 0 ? 1U : 0U) << face);
    faces_below = static_cast<std::uint8_t>(faces_below | (all_at[face] ? 0U : 1U) << face);
  }
  Sides sides;
  sides.background = background_above ? faces_above : faces_below;
  sides.opposite = background_above ? faces_below : faces_above;
  sides.mixed = some != 0 && all != ~std::uint64_t{0};
  return sides;
}

Int3 neighbour(const Int3& origin, unsigned face) {
  Int3 other = origin;
  other[face / 2] += (face & 1) != 0 ? volume::leaf_dim : -volume::leaf_dim;
  return other;
}

/// Puts evaluated leaves into the grid. `slots` are the places of each leaf in `values`.
void store(const Context& context, volume::GridBuilder& builder, std::span<const Int3> origins,
           std::span<const std::size_t> slots, const std::vector<float>& values) {
  const std::vector<volume::LeafRef> refs = builder.add_leaves(context, origins);
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, refs.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      std::memcpy(refs[n].values, values.data() + slots[n] * volume::leaf_voxels,
                  volume::leaf_voxels * sizeof(float));
      (void)activate(refs[n]);
    }
  });
}

/// The constant on the side where the background isn't.
float opposite_value(double isovalue) {
  if (isovalue < 0)
    return static_cast<float>(isovalue >= -1 ? -1 : 2 * isovalue);
  return static_cast<float>(isovalue < 1 ? 1 : 2 * isovalue);
}

/// The cubes proven to lie on the opposite side, and leaves found to.
class OppositeRegion {
public:
  explicit OppositeRegion(const std::vector<LeafLists>& plans) {
    std::array<std::size_t, 32> counts{};
    for (const LeafLists& plan : plans)
      for (const ConstantCube& cube : plan.opposite)
        ++counts[level(cube.dim)];
    for (const std::size_t count : counts)
      maps_.emplace_back(count);
    for (std::size_t l = 0; l < counts.size(); ++l)
      used_[l] = counts[l] > 0;
    for (const LeafLists& plan : plans)
      for (const ConstantCube& cube : plan.opposite)
        maps_[level(cube.dim)].insert(cube.origin, 0);
  }
  bool contains(const Int3& origin) const {
    for (std::size_t l = 0; l < maps_.size(); ++l) {
      if (!used_[l])
        continue;
      const std::int32_t mask = -(std::int32_t{1} << l);
      if (maps_[l].find({origin[0] & mask, origin[1] & mask, origin[2] & mask}) != IndexMap::none)
        return true;
    }
    return false;
  }

private:
  static std::size_t level(std::int32_t dim) {
    std::size_t l = 0;
    while (std::int32_t{1} << l < dim)
      ++l;
    return l;
  }
  std::vector<IndexMap> maps_;
  std::array<bool, 32> used_{};
};

void add_tiles(volume::GridBuilder& builder, const ConstantCube& cube, float value) {
  const std::int32_t step = cube.dim >= 4096 ? 4096 : cube.dim >= 128 ? 128 : 8;
  for (std::int32_t i = 0; i < cube.dim; i += step)
    for (std::int32_t j = 0; j < cube.dim; j += step)
      for (std::int32_t k = 0; k < cube.dim; k += step)
        builder.add_tile({{cube.origin[0] + i, cube.origin[1] + j, cube.origin[2] + k},
                          step,
                          value,
                          value != 0});
}

/// What becomes of an evaluated leaf.
enum class Fate : std::uint8_t {
  mixed,      ///< has voxels on both sides
  crossed,    ///< on one side, but an edge to a neighbour's voxel crosses: stored too
  opposite,   ///< a tile of the opposite side's constant
  background, ///< nothing
};

/// Leaf m of block n has the number first[n] + m.
std::vector<std::size_t> leaf_numbers(const std::vector<LeafLists>& plans) {
  std::vector<std::size_t> first{0};
  for (const LeafLists& plan : plans)
    first.push_back(first.back() + plan.leaves.size());
  return first;
}

/// The numbers of one block's leaves by position: most neighbours are found here.
class BlockNumbers {
public:
  BlockNumbers(std::int32_t block_size, std::size_t first, const LeafLists& plan)
      : mask_(-block_size), edge_(block_size / volume::leaf_dim) {
    if (plan.leaves.empty() || edge_ > 16)
      return; // a hash costs less than so large a table
    numbers_.assign(static_cast<std::size_t>(edge_ * edge_ * edge_), IndexMap::none);
    origin_ = block_of(plan.leaves.front());
    for (std::size_t m = 0; m < plan.leaves.size(); ++m)
      numbers_[slot(plan.leaves[m])] = static_cast<std::uint32_t>(first + m);
  }
  bool covers(const Int3& leaf) const { return !numbers_.empty() && block_of(leaf) == origin_; }
  std::uint32_t find(const Int3& leaf) const { return numbers_[slot(leaf)]; }

private:
  Int3 block_of(const Int3& leaf) const {
    return {leaf[0] & mask_, leaf[1] & mask_, leaf[2] & mask_};
  }
  std::size_t slot(const Int3& leaf) const {
    const std::int32_t i = (leaf[0] & ~mask_) / volume::leaf_dim,
                       j = (leaf[1] & ~mask_) / volume::leaf_dim,
                       k = (leaf[2] & ~mask_) / volume::leaf_dim;
    return static_cast<std::size_t>((i * edge_ + j) * edge_ + k);
  }
  std::int32_t mask_, edge_;
  Int3 origin_{};
  std::vector<std::uint32_t> numbers_;
};

/// A leaf on one side is needed where a neighbour's facing layer isn't wholly on this side.
std::vector<Fate> find_fates(const Context& quiet, std::int32_t block_size,
                             const std::vector<LeafLists>& plans,
                             std::span<const std::size_t> first, std::span<const Sides> sides) {
  IndexMap numbers(first.back());
  for (std::size_t n = 0; n < plans.size(); ++n)
    for (std::size_t m = 0; m < plans[n].leaves.size(); ++m)
      numbers.insert(plans[n].leaves[m], static_cast<std::uint32_t>(first[n] + m));
  const OppositeRegion region(plans);
  std::vector<Fate> fates(first.back(), Fate::mixed);
  parallel_blocks(quiet, plans.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const BlockNumbers near(block_size, first[n], plans[n]);
      for (std::size_t m = 0; m < plans[n].leaves.size(); ++m) {
        const Sides& own = sides[first[n] + m];
        if (own.mixed)
          continue;
        const bool opposite = own.opposite != 0;
        bool crossed = false;
        for (unsigned face = 0; face < 6 && !crossed; ++face) {
          const Int3 origin = neighbour(plans[n].leaves[m], face);
          const std::uint32_t number =
              near.covers(origin) ? near.find(origin) : numbers.find(origin);
          if (number != IndexMap::none) {
            const Sides& other = sides[number];
            crossed = ((opposite ? other.background : other.opposite) >> (face ^ 1U) & 1) != 0;
          } else { // proven, or out of reach
            crossed = opposite && !region.contains(origin);
          }
        }
        fates[first[n] + m] = crossed    ? Fate::crossed
                              : opposite ? Fate::opposite
                                         : Fate::background;
      }
    }
  });
  return fates;
}

/// Where bounds spare little, most leaves are stored anyway: all are evaluated in their place, and
/// those that no edge crosses are taken out again.
void evaluate_in_place(const Context& context, volume::GridBuilder& builder,
                       std::span<const IndexParticle> particles, const Blocks& blocks,
                       const std::vector<LeafLists>& plans, const IndexBox& clip, double isovalue,
                       DensityReport& report) {
  const float bound = float_bound(isovalue);
  const std::vector<std::size_t> first = leaf_numbers(plans);
  std::vector<Sides> sides(first.back());
  const EvaluatedLeaves evaluated =
      evaluate_plans(context, builder, particles, blocks, plans, clip,
                     [&](std::size_t leaf, const volume::LeafRef& ref) {
                       sides[leaf] = sides_of(ref.values, bound, isovalue < 0);
                       (void)activate(ref);
                     });
  Context quiet = context;
  quiet.progress = nullptr;
  const std::vector<Fate> fates = find_fates(quiet, blocks.size, plans, first, sides);
  const float value = opposite_value(isovalue);
  for (std::size_t n = 0; n < fates.size(); ++n) {
    if (fates[n] == Fate::opposite)
      builder.replace_leaf({evaluated.leaves[n].origin, volume::leaf_dim, value, true});
    else if (fates[n] == Fate::background)
      builder.replace_leaf({evaluated.leaves[n].origin, volume::leaf_dim, 0, false});
    else
      ++report.leaves;
  }
  report.leaves_evaluated += fates.size();
  report.leaf_particle_pairs += evaluated.pairs;
}

/// By block.
std::vector<std::vector<std::uint32_t>> crossed_leaves(const std::vector<LeafLists>& plans,
                                                       const std::vector<std::size_t>& first,
                                                       const std::vector<Fate>& fates) {
  std::vector<std::vector<std::uint32_t>> crossed(plans.size());
  for (std::size_t n = 0; n < plans.size(); ++n)
    for (std::size_t m = 0; m < plans[n].leaves.size(); ++m)
      if (fates[first[n] + m] == Fate::crossed)
        crossed[n].push_back(static_cast<std::uint32_t>(m));
  return crossed;
}

/// Where bounds spare most, values wait outside the grid until it is known that they are needed;
/// leaves on one side that are needed for a neighbour are evaluated again.
void evaluate_in_batches(const Context& context, volume::GridBuilder& builder,
                         std::span<const IndexParticle> particles, const Blocks& blocks,
                         const std::vector<LeafLists>& plans, const IndexBox& clip, double isovalue,
                         DensityReport& report) {
  const float bound = float_bound(isovalue);
  const DensityKernels kernels = density_kernels(context.cpu);
  Context quiet = context;
  quiet.progress = nullptr;

  const std::vector<std::size_t> first = leaf_numbers(plans);
  std::vector<Sides> sides(first.back());
  std::vector<std::uint64_t> pairs(plans.size());

  BlockTrees trees(context, clip, {});
  // Evaluates the leaves of some blocks, all of them for an empty list.
  std::vector<float> values;
  std::vector<Int3> origins;
  std::vector<std::size_t> slots;
  const auto evaluate = [&](std::size_t begin, std::size_t end,
                            const std::vector<std::vector<std::uint32_t>>& wanted) {
    std::vector<std::size_t> slot{0}; // of the first leaf of block begin + n
    for (std::size_t n = begin; n < end; ++n)
      slot.push_back(slot.back() + (wanted.empty() ? plans[n].leaves.size() : wanted[n].size()));
    values.resize(std::max(values.size(), slot.back() * volume::leaf_voxels));
    parallel_blocks(quiet, end - begin, 1, [&](std::size_t low, std::size_t high) {
      const BlockTrees::Lent lent = trees.lend();
      BlockTree& tree = *lent.tree;
      std::vector<LeafParticle> scratch;
      for (std::size_t b = low; b < high; ++b) {
        const std::size_t n = begin + b;
        const LeafLists& plan = plans[n];
        if (slot[b] == slot[b + 1])
          continue;
        tree.load(particles, blocks, n);
        const auto work = [&](std::size_t leaf, std::size_t place,
                              std::span<const std::uint32_t> list) {
          float* const here = values.data() + place * volume::leaf_voxels;
          std::fill_n(here, volume::leaf_voxels, 0.0F);
          evaluate_leaf(kernels, clip, tree.particles(), list, plan.leaves[leaf], scratch, here);
          sides[first[n] + leaf] = sides_of(here, bound, isovalue < 0);
          pairs[n] += list.size();
        };
        if (wanted.empty()) {
          visit_plan(tree, plan, [&](std::size_t leaf, std::span<const std::uint32_t> list) {
            work(leaf, slot[b] + leaf, list);
          });
          continue;
        }
        std::vector<Int3> some;
        for (const std::uint32_t leaf : wanted[n])
          some.push_back(plan.leaves[leaf]);
        tree.visit_leaves(some, [&](std::size_t m, std::span<const std::uint32_t> list) {
          work(wanted[n][m], slot[b] + m, list);
        });
      }
    });
    origins.clear();
    slots.clear();
    for (std::size_t n = begin; n < end; ++n)
      for (std::size_t m = 0; m < slot[n - begin + 1] - slot[n - begin]; ++m) {
        const std::size_t leaf = wanted.empty() ? m : wanted[n][m];
        if (wanted.empty() && !sides[first[n] + leaf].mixed)
          continue;
        origins.push_back(plans[n].leaves[leaf]);
        slots.push_back(slot[n - begin] + m);
      }
    store(context, builder, origins, slots, values);
    report.leaves += origins.size();
    report.leaves_evaluated += slot.back();
  };
  const std::size_t batch = batch_leaves * static_cast<std::size_t>(thread_count(context));
  const auto in_batches = [&](const std::vector<std::vector<std::uint32_t>>& wanted) {
    for (std::size_t begin = 0, end = 0; begin < plans.size(); begin = end) {
      std::size_t leaves = 0;
      while (end < plans.size() && (leaves < batch || end == begin)) {
        leaves += wanted.empty() ? plans[end].leaves.size() : wanted[end].size();
        ++end;
      }
      evaluate(begin, end, wanted);
      if (context.progress && wanted.empty())
        context.progress(static_cast<double>(end) / static_cast<double>(plans.size()));
    }
  };
  in_batches({});

  const std::vector<Fate> fates = find_fates(quiet, blocks.size, plans, first, sides);
  in_batches(crossed_leaves(plans, first, fates));

  const float value = opposite_value(isovalue);
  for (std::size_t n = 0; n < plans.size(); ++n)
    for (std::size_t m = 0; m < plans[n].leaves.size(); ++m)
      if (fates[first[n] + m] == Fate::opposite)
        builder.add_tile({plans[n].leaves[m], volume::leaf_dim, value, true});
  for (const std::uint64_t count : pairs)
    report.leaf_particle_pairs += count;
}

} // namespace

volume::Grid band_grid(const Context& context, std::span<const IndexParticle> particles,
                       const Blocks& blocks, const std::vector<LeafLists>& plans,
                       const IndexBox& clip, const volume::GridInfo& info, DensityReport& report) {
  const double isovalue = *info.band_isovalue;
  volume::GridBuilder builder(info);
  std::uint64_t planned = 0, skipped = 0;
  for (const LeafLists& plan : plans) {
    planned += plan.leaves.size();
    skipped += plan.skipped;
  }
  if (!plans.empty()) // both give the same grid
    (planned > skipped ? evaluate_in_place : evaluate_in_batches)(
        context, builder, particles, blocks, plans, clip, isovalue, report);
  for (const LeafLists& plan : plans)
    for (const ConstantCube& cube : plan.opposite)
      add_tiles(builder, cube, opposite_value(isovalue));
  return builder.finish();
}

} // namespace gewebe::density
