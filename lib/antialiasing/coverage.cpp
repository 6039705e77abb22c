#include "antialiasing/coverage.h"

#include "antialiasing/coverage_internal.h"
#include "base/error.h"
#include "base/parallel.h"
#include "voxelization/ray_crossings.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

namespace gewebe::antialiasing {
namespace {

constexpr double index_limit = 1 << 30;

/// Values of a leaf that is not constant.
struct ValueLeaf {
  std::array<float, volume::leaf_voxels> values;
  std::array<std::uint64_t, 8> active;
};

/// Leaves [k_begin, k_end) of a column of leaves whose value is 1 throughout.
struct FullRun {
  std::int32_t j, k_begin, k_end;
};

struct ValueSlab {
  MemoryShare memory;
  std::vector<LeafPlace> places;
  std::vector<ValueLeaf> leaves;
  std::vector<FullRun> runs;
  std::uint64_t surface_voxels = 0, overlap_voxels = 0;
  double winding = 0, inside = 0; ///< sums over the voxels
};

/// Nearest integer, even where two are. \pre |x| < 2^51
double nearest(double x) {
  return x + 0x1.8p52 - 0x1.8p52;
}
/// Distance to the nearest even number.
double fold(double x) {
  return std::fabs(x - 2 * nearest(x / 2));
}

/// Sums of one column of leaves, from the lowest up.
class ColumnSum {
public:
  ColumnSum(SumRule rule, ValueSlab& slab) : rule_(rule), slab_(slab) {}

  void start() { carry_ = {}; }
  void add(const DifferenceLeaf& leaf, LeafPlace place) {
    values_.active = {};
    sums_ = {};
    for (std::size_t column = 0; column < 64; ++column) {
      const double* const d = &leaf.difference[9 * column];
      const std::uint64_t touched = leaf.touched[column >> 3] >> (8 * (column & 7)) & 0xff;
      if (touched == 0) {
        put_constant(column);
        continue;
      }
      double sum = carry_[column];
      float* const to = &values_.values[8 * column];
      std::uint64_t active = 0;
      for (std::size_t k = 0; k < 8; ++k) {
        sum += d[k];
        double w = sum;
        const double level = nearest(sum);
        if (rule_ == SumRule::fold && (touched >> k & 1) == 0)
          w = sum = level; // no surface here: what was summed is a whole number, rounding ends
        else if (std::fabs(sum - level) < tolerance)
          w = level;
        const double value = value_of(w);
        slab_.overlap_voxels += value != w;
        slab_.surface_voxels += touched >> k & 1;
        sums_.winding += w;
        sums_.inside += value;
        sums_.all_one = sums_.all_one && value == 1;
        to[k] = static_cast<float>(value);
        active |= static_cast<std::uint64_t>(to[k] > 0) << k;
      }
      carry_[column] = sum + d[8];
      values_.active[column >> 3] |= active << (8 * (column & 7));
    }
    emit(place, place.k + 1);
  }
  /// Leaves without a patch from `place` up to k_end.
  void add_gap(LeafPlace place, std::int32_t k_end) {
    values_.active = {};
    sums_ = {};
    for (std::size_t column = 0; column < 64; ++column)
      put_constant(column);
    emit(place, k_end);
  }

private:
  static constexpr double tolerance = 1e-12; ///< rounding of a voxel's sum

  double value_of(double w) const {
    return rule_ == SumRule::fold ? fold(w) : std::clamp(w, 0.0, 1.0);
  }
  /// A column without a patch.
  void put_constant(std::size_t column) {
    double& w = carry_[column];
    const double level = nearest(w);
    if (rule_ == SumRule::fold || std::fabs(w - level) < tolerance)
      w = level;
    const double value = value_of(w);
    sums_.winding += 8 * w;
    sums_.inside += 8 * value;
    sums_.all_one = sums_.all_one && value == 1;
    std::fill_n(&values_.values[8 * column], 8, static_cast<float>(value));
    if (value > 0)
      values_.active[column >> 3] |= std::uint64_t{0xff} << (8 * (column & 7));
  }
  void emit(LeafPlace place, std::int32_t k_end) {
    slab_.winding += sums_.winding * (k_end - place.k);
    slab_.inside += sums_.inside * (k_end - place.k);
    if (sums_.all_one) {
      if (!slab_.runs.empty() && slab_.runs.back().j == place.j &&
          slab_.runs.back().k_end == place.k)
        slab_.runs.back().k_end = k_end;
      else
        slab_.runs.push_back({place.j, place.k, k_end});
      return;
    }
    if (std::ranges::all_of(values_.active, [](std::uint64_t word) { return word == 0; }))
      return;
    const auto count = static_cast<std::uint64_t>(k_end - place.k);
    slab_.memory.add(count * (sizeof(ValueLeaf) + sizeof(LeafPlace)));
    for (std::int32_t k = place.k; k < k_end; ++k) {
      slab_.places.push_back({place.j, k});
      slab_.leaves.push_back(values_);
    }
  }

  struct Sums { // of one leaf
    double winding = 0, inside = 0;
    bool all_one = true;
  };
  SumRule rule_;
  ValueSlab& slab_;
  Sums sums_;
  std::array<double, 64> carry_{};
  ValueLeaf values_{};
};

ValueSlab sum_slab(const DifferenceLeaves& map, SumRule rule, MemoryAccount& account) {
  std::vector<std::uint32_t> order(map.places.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, {}, [&](std::uint32_t n) { return map.places[n]; });
  ValueSlab slab;
  slab.memory = MemoryShare(account);
  slab.places.reserve(order.size());
  slab.leaves.reserve(order.size());
  ColumnSum sum(rule, slab);
  const LeafPlace* last = nullptr;
  for (const std::uint32_t n : order) {
    const LeafPlace& place = map.places[n];
    if (last == nullptr || last->j != place.j)
      sum.start();
    else if (last->k + 1 < place.k)
      sum.add_gap({place.j, last->k + 1}, place.k);
    sum.add(map.leaf(n), place);
    last = &place;
  }
  return slab;
}

/// Keeps the memory of leaves from slab to slab: touching it for the first time costs as much as
/// the sums.
class LeavesPool {
public:
  explicit LeavesPool(MemoryAccount& account) : account_(account) {}
  std::unique_ptr<DifferenceLeaves> take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty())
      return std::make_unique<DifferenceLeaves>(account_);
    std::unique_ptr<DifferenceLeaves> leaves = std::move(free_.back());
    free_.pop_back();
    return leaves;
  }
  void give_back(std::unique_ptr<DifferenceLeaves> leaves) {
    leaves->clear();
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(leaves));
  }

private:
  MemoryAccount& account_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<DifferenceLeaves>> free_;
};

/// Adds the runs as tiles of 8³ and, where all 256 columns of a node of 128³ are full, of 128³.
void add_tiles(const std::vector<ValueSlab>& slabs, std::int32_t first_slab,
               volume::GridBuilder& builder) {
  std::vector<Int3> covered;
  for (std::size_t s = 0; s < slabs.size(); ++s)
    for (const FullRun& run : slabs[s].runs)
      for (std::int32_t k = (run.k_begin + 15) >> 4; k < run.k_end >> 4; ++k)
        covered.push_back({(first_slab + static_cast<std::int32_t>(s)) >> 4, run.j >> 4, k});
  std::ranges::sort(covered);
  std::vector<Int3> full;
  for (std::size_t n = 0; n + 256 <= covered.size(); ++n)
    if (covered[n] == covered[n + 255]) {
      full.push_back(covered[n]);
      builder.add_tile(
          {{covered[n][0] * 128, covered[n][1] * 128, covered[n][2] * 128}, 128, 1.0f, true});
      n += 255;
    }
  for (std::size_t s = 0; s < slabs.size(); ++s) {
    const std::int32_t i = first_slab + static_cast<std::int32_t>(s);
    for (const FullRun& run : slabs[s].runs)
      for (std::int32_t k = run.k_begin; k < run.k_end; ++k)
        if (!std::ranges::binary_search(full, Int3{i >> 4, run.j >> 4, k >> 4}))
          builder.add_tile({{i * 8, run.j * 8, k * 8}, 8, 1.0f, true});
  }
}

} // namespace

std::size_t DifferenceLeaves::slot_of(LeafPlace place) const {
  const std::uint64_t word = static_cast<std::uint64_t>(static_cast<std::uint32_t>(place.j)) << 32 |
                             static_cast<std::uint32_t>(place.k);
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = static_cast<std::size_t>(word * 0x9e3779b97f4a7c15u >> 20) & mask;
  while (slots_[slot] != empty && places[slots_[slot]] != place)
    slot = (slot + 1) & mask;
  return slot;
}

void DifferenceLeaves::clear() {
  std::ranges::fill(slots_, empty);
  places.clear();
  last_ = nullptr;
}

DifferenceLeaf& DifferenceLeaves::find(LeafPlace place) {
  std::size_t slot = slot_of(place);
  if (slots_[slot] == empty) {
    if (2 * (places.size() + 1) > slots_.size()) {
      slots_.assign(2 * slots_.size(), empty);
      for (std::size_t n = 0; n < places.size(); ++n)
        slots_[slot_of(places[n])] = static_cast<std::uint32_t>(n);
      slot = slot_of(place);
    }
    slots_[slot] = static_cast<std::uint32_t>(places.size());
    if (places.size() < leaves_.size()) {
      leaves_[places.size()] = {};
    } else {
      memory_.add(sizeof(DifferenceLeaf) + sizeof(LeafPlace) + 16);
      leaves_.emplace_back();
    }
    places.push_back(place);
  }
  last_place_ = place;
  last_ = &leaves_[slots_[slot]];
  return *last_;
}

std::vector<Vec3> coverage_points(const TriangleMesh& mesh,
                                  const volume::GridTransform& transform) {
  std::vector<Vec3> points(mesh.points.size());
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vec3 p = transform.to_index(mesh.points[n]);
    for (int a = 0; a < 3; ++a) {
      if (!(std::fabs(p[a]) < index_limit))
        throw Error("point " + std::to_string(n) + " lies " + std::to_string(std::fabs(p[a])) +
                    " voxels from the lattice's origin, expected less than 2^30: choose a larger "
                    "voxel");
      points[n][a] = p[a] + 0.5;
    }
  }
  return points;
}

void sort_into_slabs(const Context& context, SlabbedMesh& mesh, double margin) {
  struct Range {
    std::int32_t first, last;
  };
  std::vector<Range> slabs_of(mesh.triangles.size());
  std::int32_t low = INT32_MAX, high = INT32_MIN;
  std::size_t total = 0;
  for (std::size_t n = 0; n < slabs_of.size(); ++n) {
    const Triangle& t = mesh.triangles[n];
    const double a = mesh.points[t[0]].x, b = mesh.points[t[1]].x, c = mesh.points[t[2]].x;
    const double x_min = std::min(std::min(a, b), c), x_max = std::max(std::max(a, b), c);
    slabs_of[n] = {voxelization::floor_int(x_min - margin) >> 3,
                   voxelization::floor_int(x_max + margin) >> 3};
    low = std::min(low, slabs_of[n].first);
    high = std::max(high, slabs_of[n].last);
    total += static_cast<std::size_t>(slabs_of[n].last - slabs_of[n].first + 1);
  }
  const std::size_t slabs = low <= high ? static_cast<std::size_t>(high - low + 1) : 0;
  require_memory(context, 16.0 * static_cast<double>(slabs) + 4.0 * static_cast<double>(total),
                 "sorting the triangles into slabs");
  mesh.first_slab = slabs == 0 ? 0 : low;
  mesh.slab_begin.assign(slabs + 1, 0);
  const auto for_each_pair = [&](auto&& visit) {
    for (std::size_t n = 0; n < slabs_of.size(); ++n)
      for (std::int32_t s = slabs_of[n].first; s <= slabs_of[n].last; ++s)
        visit(static_cast<std::size_t>(s - low), static_cast<std::uint32_t>(n));
  };
  for_each_pair([&](std::size_t slab, std::uint32_t) { ++mesh.slab_begin[slab + 1]; });
  std::partial_sum(mesh.slab_begin.begin(), mesh.slab_begin.end(), mesh.slab_begin.begin());
  mesh.members.resize(total);
  std::vector<std::size_t> next(mesh.slab_begin.begin(), mesh.slab_begin.end() - 1);
  for_each_pair([&](std::size_t slab, std::uint32_t n) { mesh.members[next[slab]++] = n; });
}

volume::Grid sum_slabs(const Context& context, const SlabbedMesh& mesh,
                       const volume::GridTransform& transform, SumRule rule, CoverageReport& report,
                       const std::function<void(std::size_t, DifferenceLeaves&)>& fill) {
  MemoryAccount memory(context, "the voxelized mesh");
  std::vector<ValueSlab> slabs(mesh.slab_begin.size() - 1);
  std::optional<LeavesPool> pool(std::in_place, memory);
  parallel_blocks(context, slabs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      std::unique_ptr<DifferenceLeaves> leaves = pool->take();
      fill(s, *leaves);
      slabs[s] = sum_slab(*leaves, rule, memory);
      pool->give_back(std::move(leaves));
    }
  });
  pool.reset();
  volume::GridInfo info;
  info.transform = transform;
  volume::GridBuilder builder(info);
  add_tiles(slabs, mesh.first_slab, builder);
  std::vector<Int3> origins;
  std::vector<const ValueLeaf*> values;
  double winding = 0, inside = 0;
  for (std::size_t s = 0; s < slabs.size(); ++s) {
    const std::int32_t i = (mesh.first_slab + static_cast<std::int32_t>(s)) * volume::leaf_dim;
    for (std::size_t n = 0; n < slabs[s].places.size(); ++n) {
      origins.push_back(
          {i, slabs[s].places[n].j * volume::leaf_dim, slabs[s].places[n].k * volume::leaf_dim});
      values.push_back(&slabs[s].leaves[n]);
    }
    report.surface_voxels += slabs[s].surface_voxels;
    report.overlap_voxels += slabs[s].overlap_voxels;
    winding += slabs[s].winding;
    inside += slabs[s].inside;
  }
  const double voxel = std::fabs(transform.determinant());
  report.volume = inside * voxel;
  report.winding_volume = winding * voxel;
  const std::vector<volume::LeafRef> leaves = builder.add_leaves(context, origins);
  parallel_blocks(context, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      std::ranges::copy(values[n]->values, leaves[n].values);
      std::ranges::copy(values[n]->active, leaves[n].active);
    }
  });
  return builder.finish(false);
}

double coverage_bytes(const TriangleMesh& mesh, const volume::GridTransform& transform) {
  return voxelization::voxelize_bytes(mesh, transform, 2) +
         100.0 * static_cast<double>(mesh.triangles.size());
}

} // namespace gewebe::antialiasing
