#include "density/density_blocks_internal.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <emmintrin.h>

namespace gewebe::density {
namespace {

constexpr std::uint64_t max_blocks = 8192;
constexpr std::uint64_t list_budget = std::uint64_t{256} << 20; // bytes of leaf lists kept
constexpr std::uint64_t block_budget = std::uint64_t{16} << 20; // of one block

struct BlockRange {
  Int3 first, last;
};

/// Blocks of 2^shift voxels that the box around the support, enlarged by `margin` voxels, meets
/// inside `clip`; false if none.
bool block_range(const IndexParticle& particle, const IndexBox& clip, int shift, double margin,
                 BlockRange& range) {
  const double center[3] = {particle.x, particle.y, particle.z};
  const double reach = particle.radius + margin;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low =
        std::max(std::ceil(center[axis] - reach), static_cast<double>(clip.min[axis]));
    const double high =
        std::min(std::floor(center[axis] + reach), static_cast<double>(clip.max[axis]));
    if (!(low <= high))
      return false;
    range.first[axis] = static_cast<std::int32_t>(low) >> shift;
    range.last[axis] = static_cast<std::int32_t>(high) >> shift;
  }
  return true;
}

/// Does the ball meet the block? Never no where it does.
bool meets(const IndexParticle& particle, const Int3& block, int shift, double margin) {
  const double center[3] = {particle.x, particle.y, particle.z};
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<double>(std::int64_t{block[axis]} * (std::int64_t{1} << shift));
    const double high = low + static_cast<double>((std::int64_t{1} << shift) - 1);
    const double d = std::max({low - center[axis], center[axis] - high, 0.0});
    sum += d * d;
  }
  const double reach = particle.radius + margin;
  return sum <= reach * reach * (1 + 1e-6);
}

template <class Visit>
void for_blocks(const IndexParticle& particle, const IndexBox& clip, int shift, double margin,
                Visit&& visit) {
  BlockRange range{};
  if (!block_range(particle, clip, shift, margin, range))
    return;
  Int3 block{};
  for (block[0] = range.first[0]; block[0] <= range.last[0]; ++block[0])
    for (block[1] = range.first[1]; block[1] <= range.last[1]; ++block[1])
      for (block[2] = range.first[2]; block[2] <= range.last[2]; ++block[2])
        if (range.first == range.last || meets(particle, block, shift, margin))
          visit(block);
}

/// Number of blocks in the boxes around the particles.
double count_pairs(std::span<const IndexParticle> particles, const IndexBox& clip, int shift,
                   double margin) {
  double pairs = 0;
  for (const IndexParticle& particle : particles) {
    BlockRange range{};
    if (!block_range(particle, clip, shift, margin, range))
      continue;
    double product = 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
      product *= 1.0 + range.last[axis] - range.first[axis];
    pairs += product;
  }
  return pairs;
}

std::uint64_t count_blocks(const IndexBox& clip, int shift) {
  double product = 1;
  for (std::size_t axis = 0; axis < 3; ++axis)
    product *= 1.0 + (clip.max[axis] >> shift) - (clip.min[axis] >> shift);
  return product < 1e15 ? static_cast<std::uint64_t>(product) : UINT64_MAX;
}

Int3 child_origin(const Int3& origin, int child, std::int32_t size) {
  return {origin[0] + (child >> 2) * size, origin[1] + (child >> 1 & 1) * size,
          origin[2] + (child & 1) * size};
}

} // namespace

DensityKernels density_kernels(CpuLevel level) {
  if (level == CpuLevel::baseline)
    return {add_density_baseline, reach_children_baseline, bound_children_baseline};
  return {level == CpuLevel::avx512 ? add_density_avx512 : add_density_avx2, reach_children_avx2,
          bound_children_avx2};
}

std::vector<IndexParticle> to_index_space(const Context& context, const Particles& particles,
                                          const volume::GridTransform& transform,
                                          const IndexBox& clip) {
  require_memory(context, static_cast<double>(particles.size()) * sizeof(IndexParticle),
                 "the particles in index space");
  const double voxel = transform.voxel_size().x;
  std::vector<IndexParticle> result;
  result.reserve(particles.size());
  for (const Particle& particle : particles) {
    const Vec3 center = transform.to_index(particle.center);
    const double radius = particle.support_radius / voxel;
    const IndexParticle local{center.x,
                              center.y,
                              center.z,
                              radius,
                              static_cast<float>(1 / std::max(radius, 1e-18)),
                              static_cast<float>(particle.weight)};
    BlockRange range{};
    if (block_range(local, clip, 3, 0, range))
      result.push_back(local);
  }
  return result;
}

Blocks sort_into_blocks(const Context& context, std::span<const IndexParticle> particles,
                        const IndexBox& clip, double margin) {
  Blocks blocks;
  if (particles.empty())
    return blocks;
  // Small blocks share the work well and large ones keep the lists short.
  int shift = 5;
  const double max_pairs = 3.2e7 + 4 * static_cast<double>(particles.size());
  while (count_blocks(clip, shift) > max_blocks ||
         (shift < 30 && count_pairs(particles, clip, shift, margin) > max_pairs))
    ++shift;
  blocks.size = std::int32_t{1} << shift;

  Int3 low{}, extent{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = clip.min[axis] >> shift;
    extent[axis] = 1 + (clip.max[axis] >> shift) - low[axis];
  }
  const auto cell = [&](const Int3& block) {
    return (static_cast<std::size_t>(block[0] - low[0]) * static_cast<std::size_t>(extent[1]) +
            static_cast<std::size_t>(block[1] - low[1])) *
               static_cast<std::size_t>(extent[2]) +
           static_cast<std::size_t>(block[2] - low[2]);
  };
  const std::size_t cells = count_blocks(clip, shift);
  const std::size_t grain = std::max<std::size_t>(8192, particles.size() / 64 + 1);
  const std::size_t chunks = (particles.size() + grain - 1) / grain;
  Context quiet = context;
  quiet.progress = nullptr;

  // Counting sort: each chunk of particles has its own counters, so its own places.
  std::vector<std::uint64_t> place(chunks * cells);
  parallel_blocks(quiet, particles.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::uint64_t* const counts = place.data() + begin / grain * cells;
    for (std::size_t n = begin; n < end; ++n)
      for_blocks(particles[n], clip, shift, margin,
                 [&](const Int3& block) { ++counts[cell(block)]; });
  });
  std::uint64_t total = 0;
  Int3 block{};
  for (block[0] = low[0]; block[0] < low[0] + extent[0]; ++block[0])
    for (block[1] = low[1]; block[1] < low[1] + extent[1]; ++block[1])
      for (block[2] = low[2]; block[2] < low[2] + extent[2]; ++block[2]) {
        const std::uint64_t before = total;
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
          std::uint64_t& count = place[chunk * cells + cell(block)];
          const std::uint64_t here = total;
          total += count;
          count = here;
        }
        if (total == before)
          continue;
        blocks.origins.push_back(
            {block[0] * blocks.size, block[1] * blocks.size, block[2] * blocks.size});
        blocks.first.push_back(before);
      }
  blocks.first.push_back(total);
  require_memory(context, static_cast<double>(total) * sizeof(std::uint32_t),
                 "the list of blocks in reach of a particle");
  blocks.particles.resize(total);
  parallel_blocks(quiet, particles.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::uint64_t* const next = place.data() + begin / grain * cells;
    for (std::size_t n = begin; n < end; ++n)
      for_blocks(particles[n], clip, shift, margin, [&](const Int3& b) {
        blocks.particles[next[cell(b)]++] = static_cast<std::uint32_t>(n);
      });
  });
  return blocks;
}

// ---- BlockTree

BlockTree::BlockTree(const Context& context, const IndexBox& clip, std::optional<double> isovalue)
    : context_(context), kernels_(density_kernels(context.cpu)), clip_(clip), isovalue_(isovalue),
      scratch_(32), masks_(32) {}

void BlockTree::load(std::span<const IndexParticle> particles, const Blocks& blocks,
                     std::size_t n) {
  origin_ = blocks.origins[n];
  size_ = blocks.size;
  const std::size_t count = blocks.first[n + 1] - blocks.first[n];
  local_.resize(count);
  scratch_[0].resize(count);
  for (std::size_t m = 0; m < count; ++m) {
    local_[m] = particles[blocks.particles[blocks.first[n] + m]];
    scratch_[0][m] = static_cast<std::uint32_t>(m);
  }
}

void BlockTree::list_leaves(LeafLists& lists, bool with_particles) {
  lists_ = &lists;
  with_particles_ = with_particles;
  bounding_ = isovalue_.has_value();
  visit_ = nullptr;
  children_ = {};
  parts_ = {};
  lists = {};
  if (with_particles)
    lists.first.push_back(0);
  descend(origin_, size_, scratch_[0], 1);
}

void BlockTree::visit_leaves(std::span<const Int3> wanted, const Visit& visit) {
  lists_ = nullptr;
  bounding_ = false;
  visit_ = &visit;
  wanted_ = wanted;
  visited_ = 0;
  descend(origin_, size_, scratch_[0], 1);
}

bool BlockTree::is_wanted(const Int3& origin, std::int32_t size) const {
  if (visit_ == nullptr)
    return true;
  if (visited_ == wanted_.size())
    return false;
  const Int3& next = wanted_[visited_];
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (next[axis] < origin[axis] || std::int64_t{next[axis]} - origin[axis] >= size)
      return false;
  return true;
}

bool BlockTree::in_clip(const Int3& origin, std::int32_t size, std::int32_t margin) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (origin[axis] - margin < clip_.min[axis] ||
        std::int64_t{origin[axis]} + size - 1 + margin > clip_.max[axis])
      return false;
  return true;
}

bool BlockTree::outside_clip(const Int3& origin, std::int32_t size) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (origin[axis] > clip_.max[axis] || std::int64_t{origin[axis]} + size - 1 < clip_.min[axis])
      return true;
  return false;
}

/// The background is 0; what the clip box cuts off has it too.
Side BlockTree::prove(const Int3& origin, std::int32_t size, float lower, float upper) const {
  double min = static_cast<double>(lower), max = static_cast<double>(upper);
  if (!in_clip(origin, size, 1)) {
    min = std::min(min, 0.0);
    max = std::max(max, 0.0);
  }
  const bool background_above = 0 > *isovalue_;
  if (min > *isovalue_)
    return background_above ? Side::background : Side::opposite;
  if (max < *isovalue_)
    return background_above ? Side::opposite : Side::background;
  return Side::unknown;
}

/// Counts are in tenths of a nanosecond, roughly. After a few trials bounding goes on only where it
/// has saved what it cost; now and then it gets another chance.
bool BlockTree::Tally::pays() const {
  return tried < 16 || saved >= spent || tried % 32 == 0;
}

Side BlockTree::prove_leaf(const Int3& origin, std::span<const std::uint32_t> list) {
  ++parts_.tried;
  if (!parts_.pays())
    return Side::unknown;
  constexpr std::int32_t half = volume::leaf_dim / 2;
  std::vector<std::uint8_t>& masks = masks_[0];
  masks.resize(std::max(masks.size(), list.size()));
  ChildBounds bounds{};
  const Children children{{static_cast<double>(origin[0]), static_cast<double>(origin[1]),
                           static_cast<double>(origin[2])},
                          half};
  kernels_.bound(local_.data(), list.data(), list.size(), children, masks.data(), bounds);
  parts_.spent += list.size() * 150;
  const Side side = prove(origin, half, bounds.lower[0], bounds.upper[0]);
  for (int part = 1; part < 8; ++part)
    if (prove(child_origin(origin, part, half), half, bounds.lower[part], bounds.upper[part]) !=
        side)
      return Side::unknown;
  if (side != Side::unknown)
    parts_.saved += list.size() * 350 + 2000;
  return side;
}

void BlockTree::emit(const Int3& origin, std::span<const std::uint32_t> list) {
  if (visit_ != nullptr) {
    (*visit_)(visited_++, list);
    return;
  }
  lists_->leaves.push_back(origin);
  if (lists_->leaves.size() % 65536 == 0) {
    require_memory(context_, static_cast<double>(lists_->leaves.size()) * leaf_bytes,
                   "the volume, at the least,");
    if (context_.cancelled && context_.cancelled())
      throw Cancelled();
  }
  if (!with_particles_)
    return;
  lists_->pairs.insert(lists_->pairs.end(), list.begin(), list.end());
  lists_->first.push_back(static_cast<std::uint32_t>(lists_->pairs.size()));
  if (lists_->pairs.size() * sizeof(std::uint32_t) > block_budget) {
    with_particles_ = false;
    lists_->first = {};
    lists_->pairs = {};
  }
}

void BlockTree::descend(const Int3& origin, std::int32_t size, std::span<const std::uint32_t> list,
                        std::size_t level) {
  const std::int32_t half = size / 2;
  std::vector<std::uint8_t>& masks = masks_[level];
  masks.resize(std::max(masks.size(), list.size()));
  const Children children{{static_cast<double>(origin[0]), static_cast<double>(origin[1]),
                           static_cast<double>(origin[2])},
                          static_cast<float>(half)};
  bool bounding = bounding_;
  if (bounding) { // no bound holds over a cube much larger than the particles
    double largest = 0;
    for (const std::uint32_t n : list)
      largest = std::max(largest, local_[n].radius);
    bounding = largest > 0.5 * half;
    if (half == volume::leaf_dim) {
      ++children_.tried;
      bounding = bounding && children_.pays();
    }
  }
  ChildBounds bounds{};
  if (bounding)
    kernels_.bound(local_.data(), list.data(), list.size(), children, masks.data(), bounds);
  else
    kernels_.reach(local_.data(), list.data(), list.size(), children,
                   bounding_ && half > volume::leaf_dim ? 1 : 0, masks.data());
  if (bounding && half == volume::leaf_dim)
    children_.spent += list.size() * 150;

  std::vector<std::uint32_t>& part = scratch_[level];
  for (int c = 0; c < 8; ++c) {
    const Int3 child = child_origin(origin, c, half);
    if (outside_clip(child, half) || !is_wanted(child, half))
      continue;
    part.resize(list.size() + 1);
    std::size_t count = 0;
    for (std::size_t n = 0; n < list.size(); ++n) {
      part[count] = list[n];
      count += masks[n] >> c & 1;
    }
    const std::span<const std::uint32_t> reaching(part.data(), count);
    if (reaching.empty() && visit_ == nullptr)
      continue;
    Side side = Side::unknown;
    if (bounding) {
      side = prove(child, half, bounds.lower[c], bounds.upper[c]);
      if (half == volume::leaf_dim && side != Side::unknown)
        children_.saved += count * 350 + 2000;
    }
    if (bounding && side == Side::unknown && half == volume::leaf_dim)
      side = prove_leaf(child, reaching);
    if (side != Side::unknown) {
      const auto leaves = static_cast<std::uint64_t>(half / volume::leaf_dim);
      lists_->skipped += leaves * leaves * leaves;
      if (side == Side::opposite)
        lists_->opposite.push_back({child, half});
    } else if (half == volume::leaf_dim) {
      emit(child, reaching);
    } else {
      descend(child, half, reaching, level + 1);
    }
  }
}

BlockTrees::Lent BlockTrees::lend() {
  const std::lock_guard lock(mutex_);
  if (idle_.empty())
    return {*this, std::make_unique<BlockTree>(context_, clip_, isovalue_)};
  std::unique_ptr<BlockTree> tree = std::move(idle_.back());
  idle_.pop_back();
  return {*this, std::move(tree)};
}

BlockTrees::Lent::~Lent() {
  const std::lock_guard lock(owner.mutex_);
  owner.idle_.push_back(std::move(tree));
}

// ---- all blocks

std::vector<LeafLists> plan_blocks(const Context& context, std::span<const IndexParticle> particles,
                                   const Blocks& blocks, const IndexBox& clip,
                                   std::optional<double> isovalue) {
  std::vector<LeafLists> plans(blocks.origins.size());
  std::atomic<std::uint64_t> bytes = 0, leaves = 0;
  Context quiet = context;
  quiet.progress = nullptr;
  BlockTrees trees(context, clip, isovalue);
  parallel_blocks(quiet, plans.size(), 1, [&](std::size_t begin, std::size_t end) {
    const BlockTrees::Lent lent = trees.lend();
    BlockTree& tree = *lent.tree;
    for (std::size_t n = begin; n < end; ++n) {
      tree.load(particles, blocks, n);
      tree.list_leaves(plans[n], bytes < list_budget);
      require_memory(context, static_cast<double>(leaves += plans[n].leaves.size()) * leaf_bytes,
                     "the volume, at the least,");
      const std::uint64_t kept = plans[n].pairs.size() * sizeof(std::uint32_t);
      if (bytes.fetch_add(kept) + kept > list_budget) {
        plans[n].first = {};
        plans[n].pairs = {};
      }
    }
  });
  return plans;
}

void visit_plan(BlockTree& tree, const LeafLists& plan, const BlockTree::Visit& visit) {
  if (!plan.has_lists()) {
    tree.visit_leaves(plan.leaves, visit);
    return;
  }
  const std::span<const std::uint32_t> pairs = plan.pairs;
  for (std::size_t n = 0; n < plan.leaves.size(); ++n)
    visit(n, pairs.subspan(plan.first[n], plan.first[n + 1] - plan.first[n]));
}

EvaluatedLeaves
evaluate_plans(const Context& context, volume::GridBuilder& builder,
               std::span<const IndexParticle> particles, const Blocks& blocks,
               const std::vector<LeafLists>& plans, const IndexBox& clip,
               const std::function<void(std::size_t, const volume::LeafRef&)>& done) {
  std::vector<Int3> origins;
  std::vector<std::size_t> first{0};
  for (const LeafLists& plan : plans) {
    origins.insert(origins.end(), plan.leaves.begin(), plan.leaves.end());
    first.push_back(origins.size());
  }
  EvaluatedLeaves result{builder.add_leaves(context, origins), 0};
  const DensityKernels kernels = density_kernels(context.cpu);
  std::vector<std::uint64_t> pairs(plans.size());
  BlockTrees trees(context, clip, {});
  parallel_blocks(context, plans.size(), 1, [&](std::size_t begin, std::size_t end) {
    const BlockTrees::Lent lent = trees.lend();
    BlockTree& tree = *lent.tree;
    std::vector<LeafParticle> scratch;
    for (std::size_t n = begin; n < end; ++n) {
      tree.load(particles, blocks, n);
      visit_plan(tree, plans[n], [&](std::size_t leaf, std::span<const std::uint32_t> list) {
        const volume::LeafRef& ref = result.leaves[first[n] + leaf];
        evaluate_leaf(kernels, clip, tree.particles(), list, ref.origin, scratch, ref.values);
        pairs[n] += list.size();
        done(first[n] + leaf, ref);
      });
    }
  });
  for (const std::uint64_t count : pairs)
    result.pairs += count;
  return result;
}

bool contains(const IndexBox& box, const Int3& origin) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (origin[axis] < box.min[axis] || origin[axis] + volume::leaf_dim - 1 > box.max[axis])
      return false;
  return true;
}

std::array<std::uint64_t, 8> compare_leaf(const float* values, float bound, bool unequal) {
  const __m128 limit = _mm_set1_ps(bound); // SSE2 is in every x86-64
  const auto four = [&](const float* at) {
    const __m128 v = _mm_loadu_ps(at);
    return _mm_castps_si128(unequal ? _mm_cmpneq_ps(v, limit) : _mm_cmpgt_ps(v, limit));
  };
  std::array<std::uint64_t, 8> words{};
  for (std::uint64_t& word : words)
    for (unsigned n = 0; n < 64; n += 16, values += 16) {
      const __m128i low = _mm_packs_epi32(four(values), four(values + 4));
      const __m128i high = _mm_packs_epi32(four(values + 8), four(values + 12));
      const int bits = _mm_movemask_epi8(_mm_packs_epi16(low, high));
      word |= static_cast<std::uint64_t>(static_cast<std::uint32_t>(bits)) << n;
    }
  return words;
}

bool activate(const volume::LeafRef& leaf) {
  const std::array<std::uint64_t, 8> words = compare_leaf(leaf.values, 0, /*unequal=*/true);
  std::uint64_t any = 0;
  for (std::size_t word = 0; word < 8; ++word) {
    leaf.active[word] = words[word];
    any |= words[word];
  }
  return any != 0;
}

void evaluate_leaf(const DensityKernels& kernels, const IndexBox& clip,
                   std::span<const IndexParticle> particles, std::span<const std::uint32_t> list,
                   const Int3& origin, std::vector<LeafParticle>& scratch, float* values) {
  scratch.clear();
  for (const std::uint32_t n : list) {
    const IndexParticle& p = particles[n];
    scratch.push_back({static_cast<float>(p.x - origin[0]), static_cast<float>(p.y - origin[1]),
                       static_cast<float>(p.z - origin[2]), p.inverse_radius, p.weight});
  }
  kernels.add(scratch.data(), scratch.size(), values);
  if (contains(clip, origin))
    return;
  for (int offset = 0; offset < volume::leaf_voxels; ++offset) {
    const Int3 ijk{origin[0] + (offset >> 6), origin[1] + (offset >> 3 & 7),
                   origin[2] + (offset & 7)};
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (ijk[axis] < clip.min[axis] || ijk[axis] > clip.max[axis])
        values[offset] = 0;
  }
}

} // namespace gewebe::density
