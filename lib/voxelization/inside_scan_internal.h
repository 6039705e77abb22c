#pragma once
// Leaves of inside/outside states under construction, slab by slab (8 voxels along i), and how they
// become an InsideScan. Internal to the rules of the voxelizer.

#include "base/memory_account.h"
#include "voxelization/voxelize.h"

#include <algorithm>
#include <bit>
#include <span>

namespace gewebe::voxelization {

// A leaf first holds flips: where along k the state of a column changes. `integrate` sums them up
// along k, starting from what the column carries over from the leaf before.

/// One sample per voxel: bit n of word w is offset 64 w + n, a byte is a column.
struct BitLeaf {
  using Carry = std::array<std::uint64_t, 8>; ///< bytes 0x00 or 0xff
  std::array<std::uint64_t, 8> word{};

  void integrate(Carry& carry) {
    for (std::size_t w = 0; w < 8; ++w) {
      std::uint64_t x = word[w];
      x ^= (x << 1) & 0xfefefefefefefefeu;
      x ^= (x << 2) & 0xfcfcfcfcfcfcfcfcu;
      x ^= (x << 4) & 0xf0f0f0f0f0f0f0f0u;
      x ^= carry[w];
      word[w] = x;
      carry[w] = (x >> 7 & 0x0101010101010101u) * 0xff;
    }
  }
  bool is_constant(std::uint64_t value) const {
    std::uint64_t differs = 0;
    for (const std::uint64_t w : word)
      differs |= w ^ value;
    return differs == 0;
  }
  static std::uint64_t full(int) { return ~std::uint64_t{0}; }
};

/// samples³ samples per voxel: differences of the counts along k, modulo 2^32.
struct CountLeaf {
  using Carry = std::array<std::uint32_t, 64>;
  std::array<std::uint32_t, volume::leaf_voxels> count{};

  void integrate(Carry& carry) {
    for (std::size_t column = 0; column < 64; ++column)
      for (std::size_t k = 0; k < 8; ++k)
        count[8 * column + k] = carry[column] += count[8 * column + k];
  }
  bool is_constant(std::uint64_t value) const {
    return std::all_of(count.begin(), count.end(), [&](std::uint32_t c) { return c == value; });
  }
  static std::uint64_t full(int samples) {
    return static_cast<std::uint64_t>(samples) * static_cast<std::uint64_t>(samples) *
           static_cast<std::uint64_t>(samples);
  }
};

/// Place of a leaf in its slab, in units of leaves; ordered like the pair (j, k).
struct LeafKey {
  std::int32_t j, k;
  auto operator<=>(const LeafKey&) const = default;
};

/// The leaves of a slab by place: an open-addressing hash table.
template <class Leaf>
class LeafMap {
public:
  LeafMap() : slots_(512) {}
  explicit LeafMap(MemoryAccount& account) : slots_(512), memory_(account) {}

  Leaf& at(LeafKey key) {
    const std::uint64_t word = static_cast<std::uint64_t>(static_cast<std::uint32_t>(key.j)) << 32 |
                               static_cast<std::uint32_t>(key.k);
    std::size_t slot = find(word);
    if (slots_[slot].leaf == none) {
      if (2 * (keys.size() + 1) > slots_.size()) {
        grow();
        slot = find(word);
      }
      memory_.add(sizeof(Leaf) + sizeof(LeafKey) + 2 * sizeof(Slot));
      slots_[slot] = {word, static_cast<std::uint32_t>(keys.size())};
      keys.push_back(key);
      leaves.emplace_back();
    }
    return leaves[slots_[slot].leaf];
  }

  std::vector<LeafKey> keys;
  std::vector<Leaf> leaves;

private:
  static constexpr std::uint32_t none = UINT32_MAX;
  struct Slot {
    std::uint64_t word = 0;
    std::uint32_t leaf = none;
  };

  std::size_t find(std::uint64_t word) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = static_cast<std::size_t>(word * 0x9e3779b97f4a7c15u >> 32) & mask;
    while (slots_[slot].leaf != none && slots_[slot].word != word)
      slot = (slot + 1) & mask;
    return slot;
  }
  void grow() {
    const std::vector<Slot> old = std::move(slots_);
    slots_.assign(2 * old.size(), {});
    for (const Slot& s : old)
      if (s.leaf != none)
        slots_[find(s.word)] = s;
  }

  std::vector<Slot> slots_;
  MemoryShare memory_;
};

/// Maps for the slabs of a chunk.
template <class Leaf>
std::array<LeafMap<Leaf>, 4> leaf_maps(MemoryAccount& memory) {
  return {LeafMap<Leaf>(memory), LeafMap<Leaf>(memory), LeafMap<Leaf>(memory),
          LeafMap<Leaf>(memory)};
}

/// Leaves [k_begin, k_end) of a column of leaves that are wholly inside.
struct FullRun {
  std::int32_t j, k_begin, k_end;
};

/// Result of one slab.
template <class Leaf>
struct Slab {
  MemoryShare memory;
  std::vector<LeafKey> keys;
  std::vector<Leaf> leaves;
  std::vector<FullRun> runs;

  /// `leaf` stands at `from` and above it up to k_end. \param full of what a leaf wholly inside is
  void put(const Leaf& leaf, LeafKey from, std::int32_t k_end, std::uint64_t full) {
    if (leaf.is_constant(0))
      return;
    if (leaf.is_constant(full)) {
      if (!runs.empty() && runs.back().j == from.j && runs.back().k_end == from.k)
        runs.back().k_end = k_end;
      else
        runs.push_back({from.j, from.k, k_end});
      return;
    }
    memory.add(static_cast<std::uint64_t>(k_end - from.k) * (sizeof(Leaf) + sizeof(LeafKey)));
    for (std::int32_t k = from.k; k < k_end; ++k) {
      keys.push_back({from.j, k});
      leaves.push_back(leaf);
    }
  }
};

/// Takes the flips of rays with an odd number of them out of a column of leaves; returns how many
/// rays that are.
inline std::uint64_t drop_odd_rays(LeafMap<BitLeaf>& map, const std::vector<std::uint32_t>& order,
                                   std::size_t begin, std::size_t end) {
  BitLeaf sum;
  for (std::size_t n = begin; n < end; ++n)
    for (std::size_t w = 0; w < 8; ++w)
      sum.word[w] ^= map.leaves[order[n]].word[w];
  std::uint64_t odd = 0;
  for (std::uint64_t& x : sum.word) {
    x ^= x >> 4;
    x ^= x >> 2;
    x ^= x >> 1;
    x &= 0x0101010101010101u;
    odd += static_cast<std::uint64_t>(std::popcount(x));
    x *= 0xff;
  }
  if (odd > 0)
    for (std::size_t n = begin; n < end; ++n)
      for (std::size_t w = 0; w < 8; ++w)
        map.leaves[order[n]].word[w] &= ~sum.word[w];
  return odd;
}
/// Counts come from pairs of crossings, so there is none.
inline std::uint64_t drop_odd_rays(LeafMap<CountLeaf>&, const std::vector<std::uint32_t>&,
                                   std::size_t, std::size_t) {
  return 0;
}

/// Sums flips to states, column of leaves by column of leaves, and fills the gaps between leaves.
/// Returns how many rays had an odd number of flips; they are empty.
template <class Leaf>
std::uint64_t integrate_slab(LeafMap<Leaf>& map, int samples, Slab<Leaf>& slab) {
  struct Item {
    LeafKey key;
    std::uint32_t leaf;
  };
  std::vector<Item> sorted(map.keys.size());
  for (std::size_t n = 0; n < sorted.size(); ++n)
    sorted[n] = {map.keys[n], static_cast<std::uint32_t>(n)};
  std::sort(sorted.begin(), sorted.end(),
            [](const Item& a, const Item& b) { return a.key < b.key; });
  std::vector<std::uint32_t> order(sorted.size());
  std::transform(sorted.begin(), sorted.end(), order.begin(), [](const Item& i) { return i.leaf; });

  slab.keys.reserve(sorted.size());
  slab.leaves.reserve(sorted.size());
  const std::uint64_t full = Leaf::full(samples);
  std::uint64_t odd = 0;
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    while (end < sorted.size() && sorted[end].key.j == sorted[begin].key.j)
      ++end;
    odd += drop_odd_rays(map, order, begin, end);
    typename Leaf::Carry carry{}; // 0 again after the last leaf, since all counts are even
    for (std::size_t n = begin; n < end; ++n) {
      const LeafKey key = sorted[n].key;
      if (n > begin && sorted[n - 1].key.k + 1 < key.k) {
        Leaf gap;
        gap.integrate(carry);
        slab.put(gap, {key.j, sorted[n - 1].key.k + 1}, key.k, full);
      }
      Leaf& leaf = map.leaves[order[n]];
      leaf.integrate(carry);
      slab.put(leaf, key, key.k + 1, full);
    }
  }
  return odd;
}

/// The runs of slab n (leaves with i = 8 (first_slab + n)) as tiles of 8³ and, where all 256
/// columns of a node of 128³ are full, of 128³.
std::vector<volume::TileView> tiles_of_runs(const std::vector<std::span<const FullRun>>& runs,
                                            std::int32_t first_slab);

/// Joins the slabs, which are emptied, to a scan.
InsideScan join_slabs(std::vector<Slab<BitLeaf>>& slabs, std::int32_t first_slab);
InsideScan join_slabs(std::vector<Slab<CountLeaf>>& slabs, std::int32_t first_slab, int samples);

/// Counts for each voxel the samples inside, samples³ of them in a voxel, of a scan of bits on
/// their own lattice.
InsideScan count_samples(const Context& context, const InsideScan& fine, int samples);

} // namespace gewebe::voxelization
