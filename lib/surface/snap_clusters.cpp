#include "surface/snap_clusters_internal.h"

#include "base/error.h"
#include "base/parallel.h"
#include "surface/inside_field_internal.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>
#include <utility>

// Based on: report FZKA 7190, Forschungszentrum Karlsruhe, 2006, section 3.1.4.

namespace gewebe {
namespace {

constexpr std::uint64_t first_column = 0x0101010101010101U;

/// The points of a block of 8³ corners, by the edge where they lie, as marching_cubes numbers them.
struct Block {
  Int3 origin{};
  std::uint32_t first_point = 0;
  std::array<std::uint16_t, 24> before{};         // points of the block in earlier words
  std::array<std::uint64_t, 24> points{};         // word 3 i + axis, bit 8 j + k
  std::array<std::uint64_t, 24> low{}, high{};    // those that snap
  std::array<std::uint64_t, leaf_dim> fin_here{}; // corners that drew a fin: word i
};

/// By corner.
struct FinPoint {
  Int3 corner{};
  std::uint32_t point = 0;
  auto operator<=>(const FinPoint&) const = default;
};

class Lattice {
public:
  Lattice(const Context& context, const IsoSurface& surface, double epsilon, SnapClusters& clusters)
      : context_(context), crossings_(surface.crossings), clusters_(clusters) {
    context_.progress = nullptr;
    classify(epsilon);
    add_far_blocks();
  }

  void apply_fin_rule(const std::vector<Triangle>& triangles);
  void gather();

private:
  struct Part {
    std::vector<Block> blocks;
    std::vector<std::uint32_t> members, sizes, first_members;
    std::uint64_t corners = 0;
  };
  /// Those of a block's corners that a point on an edge of one axis snaps to from below.
  std::uint64_t from_below(std::size_t n, std::size_t i, unsigned axis) const;
  void classify(double epsilon);
  void add_far_blocks();
  void gather_block(std::size_t n, Part& part) const;
  std::uint32_t point_on(std::uint32_t n, const Int3& corner, unsigned axis, bool high) const;
  std::uint32_t first_member(const Int3& corner) const;
  bool find_fin_corner(std::uint32_t p, std::span<const std::uint32_t> neighbours,
                       Int3& corner) const;

  Context context_;
  const std::vector<EdgeCrossing>& crossings_;
  SnapClusters& clusters_;
  std::vector<Block> blocks_; // with points in their order, then others with corners that draw some
  IndexMap numbers_;
  std::vector<std::array<std::uint32_t, 3>> below_; // of each block its neighbours, or none
  std::vector<FinPoint> fins_;
};

Int3 block_origin(const EdgeCrossing& crossing) {
  return leaf_origin(crossing.corner);
}

/// operator== of arrays calls memcmp.
bool in_block(const EdgeCrossing& crossing, const Int3& origin) {
  const Int3 own = block_origin(crossing);
  return own[0] == origin[0] && own[1] == origin[1] && own[2] == origin[2];
}

/// Finds flags and blocks in one go through the points, in parallel from the first block that
/// begins in a part of them.
void Lattice::classify(double epsilon) {
  constexpr std::size_t grain = 16384;
  const std::size_t count = crossings_.size();
  std::vector<Part> parts((count + grain - 1) / grain);
  std::atomic<bool> ordered{true};
  parallel_blocks(context_, count, grain, [&](std::size_t begin, std::size_t end) {
    std::vector<Block>& blocks = parts[begin / grain].blocks;
    const auto starts_block = [&](std::size_t p) {
      return p == 0 || !in_block(crossings_[p - 1], block_origin(crossings_[p]));
    };
    std::size_t p = begin;
    while (p < end && !starts_block(p))
      ++p;
    std::int64_t last = 0; // place of the last point in its block
    for (; p < count && (p < end || !starts_block(p)); ++p) {
      const EdgeCrossing& crossing = crossings_[p];
      if (blocks.empty() || !in_block(crossing, blocks.back().origin)) {
        const Int3 origin = block_origin(crossing);
        if (p > 0 && !(block_origin(crossings_[p - 1]) < origin))
          ordered = false;
        Block& block = blocks.emplace_back();
        block.origin = origin;
        block.first_point = static_cast<std::uint32_t>(p);
        last = -1;
      }
      const unsigned offset = static_cast<unsigned>(leaf_offset(crossing.corner));
      const unsigned w = 3 * (offset >> 6) + static_cast<unsigned>(crossing.axis),
                     bit = offset & 63;
      if (last >= static_cast<std::int64_t>(64 * w + bit))
        ordered = false;
      last = 64 * w + bit;
      const double fraction = crossing.fraction;
      const bool low = fraction <= epsilon, high = !low && 1 - fraction <= epsilon;
      // Two of these near a corner can make a face without area; see `snap`.
      const bool extreme = !(fraction >= 1e-3 && fraction <= 1 - 1e-3);
      const unsigned flags =
          (low ? snaps_low : 0U) | (high ? snaps_high : 0U) | (extreme ? looked_at : 0U);
      clusters_.flags[p] = static_cast<std::uint8_t>(flags);
      Block& block = blocks.back();
      block.points[w] |= std::uint64_t{1} << bit;
      block.low[w] |= std::uint64_t{low} << bit;
      block.high[w] |= std::uint64_t{high} << bit;
    }
    for (Block& block : blocks) {
      std::uint32_t before = 0;
      for (std::size_t w = 0; w < 24; ++w) {
        block.before[w] = static_cast<std::uint16_t>(before);
        before += count_bits(block.points[w]);
      }
    }
  });
  if (!ordered)
    throw Error("the surface's points are not in the order of marching cubes");
  std::size_t blocks = 0;
  for (const Part& part : parts)
    blocks += part.blocks.size();
  blocks_.reserve(blocks + blocks / 8);
  for (Part& part : parts) {
    blocks_.insert(blocks_.end(), part.blocks.begin(), part.blocks.end());
    part = {};
  }
}

/// Blocks without points whose corners draw points of the blocks before them.
void Lattice::add_far_blocks() {
  const std::size_t count = blocks_.size();
  IndexMap numbers(count);
  for (std::size_t n = 0; n < count; ++n)
    numbers.insert(blocks_[n].origin, static_cast<std::uint32_t>(n));
  std::vector<Int3> missing;
  for (const Block& block : blocks_) {
    std::array<std::uint64_t, 3> last{block.high[21], 0, 0};
    for (std::size_t i = 0; i < leaf_dim; ++i) {
      last[1] |= block.high[3 * i + 1] >> 56;
      last[2] |= block.high[3 * i + 2] & first_column << 7;
    }
    for (unsigned axis = 0; axis < 3; ++axis)
      if (last.at(axis) != 0) {
        const Int3 origin = shifted(block.origin, 1U << axis, leaf_dim);
        if (numbers.find(origin) == IndexMap::none)
          missing.push_back(origin);
      }
  }
  std::ranges::sort(missing);
  const auto rest = std::ranges::unique(missing);
  missing.erase(rest.begin(), rest.end());
  blocks_.resize(count + missing.size());
  numbers_ = missing.empty() ? std::move(numbers) : IndexMap(blocks_.size());
  if (!missing.empty())
    for (std::size_t n = 0; n < blocks_.size(); ++n) {
      if (n >= count)
        blocks_[n].origin = missing[n - count];
      numbers_.insert(blocks_[n].origin, static_cast<std::uint32_t>(n));
    }
  below_.resize(blocks_.size());
  parallel_blocks(context_, blocks_.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for (unsigned axis = 0; axis < 3; ++axis)
        below_[n].at(axis) = numbers_.find(shifted(blocks_[n].origin, 1U << axis, -leaf_dim));
  });
}

std::uint64_t Lattice::from_below(std::size_t n, std::size_t i, unsigned axis) const {
  const std::uint32_t below = below_[n].at(axis);
  const auto high = [&](std::uint32_t block, std::size_t slice) {
    return block == IndexMap::none ? 0 : blocks_[block].high[3 * slice + axis];
  };
  const auto here = static_cast<std::uint32_t>(n);
  if (axis == 0)
    return i > 0 ? high(here, i - 1) : high(below, 7);
  if (axis == 1)
    return high(here, i) << 8 | high(below, i) >> 56;
  return (high(here, i) & ~(first_column << 7)) << 1 | (high(below, i) >> 7 & first_column);
}

/// The point on the edge from `corner`, which is in block n, along `axis` if it snaps to that end,
/// or none.
std::uint32_t Lattice::point_on(std::uint32_t n, const Int3& corner, unsigned axis,
                                bool high) const {
  if (n == IndexMap::none)
    return IndexMap::none;
  const Block& block = blocks_[n];
  const auto offset = static_cast<unsigned>(leaf_offset(corner));
  const std::size_t w = 3 * (offset >> 6) + axis;
  const std::uint64_t bit = std::uint64_t{1} << (offset & 63);
  if (((high ? block.high[w] : block.low[w]) & bit) == 0)
    return IndexMap::none;
  return block.first_point + block.before[w] + count_bits(block.points[w] & (bit - 1));
}

std::uint32_t Lattice::first_member(const Int3& corner) const {
  std::uint32_t first = IndexMap::none;
  const auto block_of = [&](const Int3& c) { return numbers_.find(leaf_origin(c)); };
  for (unsigned axis = 0; axis < 3; ++axis) {
    const Int3 start = shifted(corner, 1U << axis, -1);
    first = std::min({first, point_on(block_of(corner), corner, axis, false),
                      point_on(block_of(start), start, axis, true)});
  }
  return first;
}

double squared_distance(const EdgeCrossing& crossing, const Int3& corner) {
  Vec3 d;
  for (int a = 0; a < 3; ++a)
    d[a] = static_cast<double>(crossing.corner[static_cast<std::size_t>(a)]) -
           corner[static_cast<std::size_t>(a)];
  d[crossing.axis] += crossing.fraction;
  return dot(d, d);
}

/// The corner that a point joins whose neighbours all snap to some, if to two at most.
bool Lattice::find_fin_corner(std::uint32_t p, std::span<const std::uint32_t> neighbours,
                              Int3& corner) const {
  std::array<Int3, 2> found{};
  std::size_t count = 0;
  for (const std::uint32_t n : neighbours) {
    const Int3 c = snap_corner(crossings_[n], clusters_.flags[n]);
    if ((count > 0 && c == found[0]) || (count > 1 && c == found[1]))
      continue;
    if (count == 2)
      return false;
    found.at(count++) = c;
  }
  corner = found[0];
  if (count == 2) {
    const double a = squared_distance(crossings_[p], found[0]),
                 b = squared_distance(crossings_[p], found[1]);
    if (b < a || (!(a < b) && first_member(found[1]) < first_member(found[0])))
      corner = found[1];
  }
  return true;
}

void Lattice::apply_fin_rule(const std::vector<Triangle>& triangles) {
  // A fin has no neighbour outside the clusters, so no fin makes or unmakes another: all at once.
  constexpr std::size_t grain = 16384;
  constexpr unsigned snaps = snaps_low | snaps_high;
  std::uint8_t* const flags = clusters_.flags.get();
  // A byte of its own for each point, so that nothing but the same 1 is written by several threads.
  const std::size_t count = crossings_.size();
  std::vector<std::uint8_t> stays(count);
  parallel_blocks(context_, triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::uint8_t nowhere = 0;
    for (std::size_t f = begin; f < end; ++f) {
      const Triangle& t = triangles[f];
      const bool a = (flags[t[0]] & snaps) == 0, b = (flags[t[1]] & snaps) == 0,
                 c = (flags[t[2]] & snaps) == 0;
      const auto mark = [&](bool both, std::uint32_t p) { // without a branch
        std::uint8_t* const place = both ? &stays[p] : &nowhere;
        std::atomic_ref(*place).store(1, std::memory_order_relaxed);
      };
      mark(a && (b || c), t[0]);
      mark(b && (c || a), t[1]);
      mark(c && (a || b), t[2]);
    }
  });
  std::vector<std::vector<std::uint32_t>> found((crossings_.size() + grain - 1) / grain);
  parallel_blocks(context_, crossings_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      if ((flags[p] & snaps) == 0 && stays[p] == 0) {
        flags[p] |= may_be_fin;
        found[begin / grain].push_back(static_cast<std::uint32_t>(p));
      }
  });
  std::vector<std::uint32_t> candidates;
  for (const auto& part : found)
    candidates.insert(candidates.end(), part.begin(), part.end());
  if (candidates.empty())
    return;

  // Their neighbours: (candidate, the point that follows it in a face).
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> pairs(
      (triangles.size() + grain - 1) / grain);
  parallel_blocks(context_, triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f)
      for (std::size_t n = 0; n < 3; ++n) {
        const std::uint32_t p = triangles[f].at(n);
        if ((flags[p] & may_be_fin) != 0)
          pairs[begin / grain].emplace_back(p, triangles[f].at((n + 1) % 3));
      }
  });
  std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
  for (const auto& part : pairs)
    all.insert(all.end(), part.begin(), part.end());
  std::ranges::sort(all);
  std::vector<std::uint32_t> neighbours;
  for (std::size_t n = 0; n < all.size();) {
    const std::uint32_t p = all[n].first;
    neighbours.clear();
    for (; n < all.size() && all[n].first == p; ++n)
      neighbours.push_back(all[n].second);
    Int3 corner{};
    if (!find_fin_corner(p, neighbours, corner))
      continue;
    flags[p] |= fin;
    fins_.push_back({corner, p});
    const auto offset = static_cast<unsigned>(leaf_offset(corner));
    blocks_[numbers_.find(leaf_origin(corner))].fin_here.at(offset >> 6) |= std::uint64_t{1}
                                                                            << (offset & 63);
  }
  std::ranges::sort(fins_);
  clusters_.fins = fins_.size();
}

void Lattice::gather_block(std::size_t n, Part& part) const {
  const Block& block = blocks_[n];
  const auto here = static_cast<std::uint32_t>(n);
  for (std::size_t i = 0; i < leaf_dim; ++i) {
    std::uint64_t some = 0, several = block.fin_here.at(i);
    for (unsigned axis = 0; axis < 3; ++axis)
      for (const std::uint64_t word : {block.low.at(3 * i + axis), from_below(n, i, axis)}) {
        several |= some & word;
        some |= word;
      }
    part.corners += count_bits(some);
    for (; several != 0; several &= several - 1) {
      const auto bit = static_cast<unsigned>(std::countr_zero(several));
      const Int3 corner{block.origin[0] + static_cast<int>(i),
                        block.origin[1] + static_cast<int>(bit >> 3),
                        block.origin[2] + static_cast<int>(bit & 7)};
      const std::size_t first = part.members.size();
      for (unsigned axis = 0; axis < 3; ++axis) {
        const Int3 start = shifted(corner, 1U << axis, -1);
        const bool in_here = (corner.at(axis) & 7) != 0;
        for (const std::uint32_t p :
             {point_on(here, corner, axis, false),
              point_on(in_here ? here : below_[n].at(axis), start, axis, true)})
          if (p != IndexMap::none)
            part.members.push_back(p);
      }
      const auto begin = part.members.begin() + static_cast<std::ptrdiff_t>(first);
      part.first_members.push_back(*std::min_element(begin, part.members.end()));
      if ((block.fin_here.at(i) >> bit & 1) != 0)
        for (auto f = std::ranges::lower_bound(fins_, FinPoint{corner, 0});
             f != fins_.end() && f->corner == corner; ++f)
          part.members.push_back(f->point);
      std::sort(part.members.begin() + static_cast<std::ptrdiff_t>(first), part.members.end());
      part.sizes.push_back(static_cast<std::uint32_t>(part.members.size() - first));
    }
  }
}

void Lattice::gather() {
  constexpr std::size_t grain = 256;
  std::vector<Part> parts((blocks_.size() + grain - 1) / grain);
  parallel_blocks(context_, blocks_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      gather_block(n, parts[begin / grain]);
  });
  std::vector<std::size_t> members(parts.size() + 1), counts(parts.size() + 1);
  for (std::size_t n = 0; n < parts.size(); ++n) {
    members[n + 1] = members[n] + parts[n].members.size();
    counts[n + 1] = counts[n] + parts[n].sizes.size();
    clusters_.corners += parts[n].corners;
  }
  clusters_.members.resize(members.back());
  clusters_.cluster.resize(members.back());
  clusters_.first_member.resize(counts.back());
  clusters_.begin.resize(counts.back() + 1);
  clusters_.begin[counts.back()] = static_cast<std::uint32_t>(members.back());
  parallel_blocks(context_, parts.size(), 1, [&](std::size_t n, std::size_t) {
    const Part& part = parts[n];
    std::size_t slot = members[n], local = 0;
    for (std::size_t c = 0; c < part.sizes.size(); ++c) {
      clusters_.begin[counts[n] + c] = static_cast<std::uint32_t>(slot);
      clusters_.first_member[counts[n] + c] = part.first_members[c];
      for (std::size_t m = 0; m < part.sizes[c]; ++m, ++slot) {
        const std::uint32_t p = part.members[local++];
        clusters_.members[slot] = p;
        clusters_.cluster[slot] = static_cast<std::uint32_t>(counts[n] + c);
        clusters_.slot[p] = static_cast<std::uint32_t>(slot);
        clusters_.flags[p] |= clustered;
      }
    }
  });
}

} // namespace

SnapClusters find_snap_clusters(const Context& context, const IsoSurface& surface, double epsilon) {
  SnapClusters clusters;
  clusters.flags = std::make_unique_for_overwrite<std::uint8_t[]>(surface.crossings.size());
  clusters.slot = std::make_unique_for_overwrite<std::uint32_t[]>(surface.crossings.size());
  Lattice lattice(context, surface, epsilon, clusters);
  lattice.apply_fin_rule(surface.mesh.triangles);
  lattice.gather();
  return clusters;
}

} // namespace gewebe
