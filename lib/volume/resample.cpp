#include "volume/resample.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

// Based on: Turkowski, Filters for Common Resampling Tasks, 1990 (the tent as a prefilter).

namespace gewebe::volume {
namespace {

/// Box of index space with real corners, closed.
struct IndexBox {
  Vec3 min, max;
};

/// From the indices of one lattice to those of another: x -> A x + b, a[i] the rows of A.
struct IndexMap {
  std::array<Vec3, 3> a;
  Vec3 b;

  Vec3 operator()(const Vec3& x) const {
    return Vec3{dot(a[0], x), dot(a[1], x), dot(a[2], x)} + b;
  }
  /// The smallest box round the image of a box.
  IndexBox image(const IndexBox& box) const {
    const Vec3 center = (*this)((box.min + box.max) * 0.5), half = (box.max - box.min) * 0.5;
    Vec3 reach;
    for (int i = 0; i < 3; ++i) {
      const Vec3& row = a[static_cast<std::size_t>(i)];
      reach[i] = std::fabs(row.x) * half.x + std::fabs(row.y) * half.y + std::fabs(row.z) * half.z;
    }
    return {center - reach, center + reach};
  }
  bool is_diagonal() const {
    return a[0].y == 0 && a[0].z == 0 && a[1].x == 0 && a[1].z == 0 && a[2].x == 0 && a[2].y == 0;
  }
};

Vec3 column(const GridTransform& transform, std::size_t axis) {
  return {transform.m[axis], transform.m[4 + axis], transform.m[8 + axis]};
}

IndexMap index_map(const GridTransform& from, const GridTransform& to) {
  const Vec3 x = column(to, 0), y = column(to, 1), z = column(to, 2);
  const double volume = to.determinant();
  if (!std::isfinite(volume) || volume == 0)
    throw Error("the transform of a volume is singular, expected an invertible affine map");
  const std::array<Vec3, 3> inverse{cross(y, z) / volume, cross(z, x) / volume,
                                    cross(x, y) / volume};
  const Vec3 offset = column(from, 3) - column(to, 3);
  IndexMap map;
  for (std::size_t i = 0; i < 3; ++i) {
    map.a[i] = {dot(inverse[i], column(from, 0)), dot(inverse[i], column(from, 1)),
                dot(inverse[i], column(from, 2))};
    map.b[static_cast<int>(i)] = dot(inverse[i], offset);
  }
  return map;
}

/// A constant or leaf region of the old grid.
struct Region {
  Int3 origin{};
  std::int32_t dim = leaf_dim;
  bool is_tile = false;
  float value = 0; // of a tile
};

constexpr double leaf_bytes = leaf_voxels * sizeof(float) + 200; // of the new grid

struct Plan {
  std::vector<Int3> leaves; // of the new grid, sorted
  std::vector<TileView> tiles;
};

class Planner {
public:
  Planner(const Context& context, const Grid& grid, const GridTransform& target)
      : context_(context), to_old_(index_map(target, grid.info().transform)),
        to_new_(index_map(grid.info().transform, target)) {
    for (int i = 0; i < 3; ++i)
      half_width_[i] = std::fmax(1, norm(to_old_.a[static_cast<std::size_t>(i)]));
    for (int i = 0; i < 3; ++i)
      if (!(half_width_[i] <= 64))
        throw Error(
            "the new voxels are more than 64 times larger than the old ones, expected less");
  }

  const IndexMap& to_old() const { return to_old_; }
  const Vec3& half_width() const { return half_width_; }
  /// Box of the old regions, inclusive.
  const Int3& old_min() const { return old_min_; }
  const Int3& old_max() const { return old_max_; }

  Plan plan(std::span<const Region> regions) {
    double blocks = 0;
    for (const Region& region : regions)
      for (std::size_t a = 0; a < 3; ++a) {
        if (region.origin[a] < -(1 << 30) || region.origin[a] > (1 << 30) - region.dim)
          throw Error("the volume has voxel indices beyond 2^30 and can't be resampled");
        old_min_[a] = std::min(old_min_[a], region.origin[a]);
        old_max_[a] = std::max(old_max_[a], region.origin[a] + region.dim - 1);
      }
    for (const Region& region : regions)
      blocks += new_blocks(region, region.is_tile && region.dim > leaf_dim ? 4096 : leaf_dim);
    require_memory(context_, blocks * sizeof(Int3), "the list of blocks of the resampled volume");
    for (const Region& region : regions) {
      if (context_.cancelled && context_.cancelled())
        throw Cancelled();
      distinct_from_ = plan_.leaves.size();
      if (region.is_tile && region.dim > leaf_dim)
        for_blocks(reach(region), 4096, [&](const Int3& p) { descend(region, p, 4096); });
      else
        for_blocks(reach(region), leaf_dim, [&](const Int3& p) { add(region, p); });
    }
    std::ranges::sort(plan_.leaves);
    plan_.leaves.erase(std::ranges::unique(plan_.leaves).begin(), plan_.leaves.end());
    std::ranges::sort(plan_.tiles, {}, &TileView::origin);
    std::erase_if(plan_.leaves, [&](const Int3& p) { return covered_by_tile(p); });
    return std::move(plan_);
  }

private:
  /// New indices that the region's voxels can influence.
  IndexBox reach(const Region& region) const {
    IndexBox box;
    for (int i = 0; i < 3; ++i) {
      const double low = region.origin[static_cast<std::size_t>(i)];
      box.min[i] = low - half_width_[i];
      box.max[i] = low + region.dim - 1 + half_width_[i];
    }
    return to_new_.image(box);
  }

  static std::int32_t block_of(double index, std::int32_t dim) {
    constexpr double limit = 1 << 30;
    if (!(std::fabs(index) < limit - 4096))
      throw Error("the resampled volume would have voxel indices beyond 2^30, expected a coarser "
                  "lattice");
    return static_cast<std::int32_t>(std::floor(index)) & ~(dim - 1);
  }

  double new_blocks(const Region& region, std::int32_t dim) const {
    const IndexBox box = reach(region);
    double count = 1;
    for (int i = 0; i < 3; ++i)
      count *=
          (static_cast<double>(block_of(box.max[i], dim)) - block_of(box.min[i], dim)) / dim + 1;
    return count;
  }

  template <class Visit>
  static void for_blocks(const IndexBox& box, std::int32_t dim, const Visit& visit) {
    std::array<std::int32_t, 3> low{}, high{};
    for (int i = 0; i < 3; ++i) {
      low[static_cast<std::size_t>(i)] = block_of(box.min[i], dim);
      high[static_cast<std::size_t>(i)] = block_of(box.max[i], dim);
    }
    for (std::int32_t i = low[0]; i <= high[0]; i += dim)
      for (std::int32_t j = low[1]; j <= high[1]; j += dim)
        for (std::int32_t k = low[2]; k <= high[2]; k += dim)
          visit(Int3{i, j, k});
  }

  /// Do the tents of all new voxels of the block lie in the region?
  bool inside(const Region& region, const Int3& block, std::int32_t dim, bool& apart) const {
    IndexBox box;
    for (int i = 0; i < 3; ++i) {
      box.min[i] = block[static_cast<std::size_t>(i)];
      box.max[i] = box.min[i] + dim - 1;
    }
    box = to_old_.image(box);
    bool within = true;
    apart = false;
    for (int i = 0; i < 3; ++i) {
      const double low = region.origin[static_cast<std::size_t>(i)], high = low + region.dim - 1;
      within = within && box.min[i] - half_width_[i] >= low && box.max[i] + half_width_[i] <= high;
      apart = apart || box.min[i] - half_width_[i] > high || box.max[i] + half_width_[i] < low;
    }
    return within;
  }

  void descend(const Region& tile, const Int3& block, std::int32_t dim) {
    bool apart = false;
    if (inside(tile, block, dim, apart)) {
      plan_.tiles.push_back({block, dim, tile.value, true});
    } else if (apart) {
      return;
    } else if (dim == leaf_dim) {
      plan_.leaves.push_back(block);
      check_size();
    } else {
      const std::int32_t child = dim == 4096 ? 128 : leaf_dim;
      for (std::int32_t i = 0; i < dim; i += child)
        for (std::int32_t j = 0; j < dim; j += child)
          for (std::int32_t k = 0; k < dim; k += child)
            descend(tile, {block[0] + i, block[1] + j, block[2] + k}, child);
    }
  }

  void add(const Region& region, const Int3& block) {
    bool apart = false;
    if (region.is_tile && inside(region, block, leaf_dim, apart))
      plan_.tiles.push_back({block, leaf_dim, region.value, true});
    else
      plan_.leaves.push_back(block);
    check_size();
  }

  void check_size() const {
    if ((plan_.leaves.size() + plan_.tiles.size()) % (1 << 16) != 0)
      return;
    require_memory(context_, static_cast<double>(plan_.leaves.size()) * sizeof(Int3),
                   "the list of blocks of the resampled volume");
    require_memory(context_, static_cast<double>(plan_.leaves.size() - distinct_from_) * leaf_bytes,
                   "the resampled volume");
  }

  bool covered_by_tile(const Int3& leaf) const {
    return std::ranges::any_of(std::array{8, 128, 4096}, [&](std::int32_t dim) {
      const Int3 block{leaf[0] & ~(dim - 1), leaf[1] & ~(dim - 1), leaf[2] & ~(dim - 1)};
      const auto same = std::ranges::equal_range(plan_.tiles, block, {}, &TileView::origin);
      return std::ranges::any_of(same, [&](const TileView& tile) { return tile.dim == dim; });
    });
  }

  const Context& context_;
  IndexMap to_old_, to_new_;
  Vec3 half_width_; // of the tent along the old axes, in old voxels
  Int3 old_min_{INT32_MAX, INT32_MAX, INT32_MAX}, old_max_{INT32_MIN, INT32_MIN, INT32_MIN};
  Plan plan_;
  std::size_t distinct_from_ = 0; ///< leaves from here on are of one region, thus distinct
};

/// Old indices first, first + 1, … along an axis with their weights.
struct Weights {
  std::int32_t first = 0;
  std::vector<double> weight;
  double sum = 1; ///< of what is left; the rest falls on background

  /// The tent about `center`, cut to min … max.
  void set(double center, double half_width, std::int32_t min, std::int32_t max) {
    const double whole = std::nearbyint(center);
    if (std::fabs(center - whole) <= 1e-9)
      center = whole; // rounding of the transforms must not smear exact hits
    first = static_cast<std::int32_t>(std::floor(center - half_width)) + 1;
    const auto end = static_cast<std::int32_t>(std::ceil(center + half_width));
    weight.clear();
    double total = 0;
    for (std::int32_t i = first; i < end; ++i) {
      weight.push_back(1 - std::fabs(i - center) / half_width);
      total += weight.back();
    }
    for (double& w : weight)
      w /= total;
    sum = 1;
    if (first >= min && end <= max + 1)
      return;
    const std::int32_t low = std::clamp(min, first, end), high = std::clamp(max + 1, low, end);
    weight.erase(weight.begin() + (high - first), weight.end());
    weight.erase(weight.begin(), weight.begin() + (low - first));
    first = low;
    sum = 0;
    for (const double w : weight)
      sum += w;
  }
  std::int32_t end() const { return first + static_cast<std::int32_t>(weight.size()); }
};

/// A box of old values.
struct Window {
  Int3 min{}, size{};
  std::vector<float> values; // k fastest

  void gather(GridAccessor& old, const Int3& low, const Int3& end) {
    min = low;
    std::size_t count = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      size[a] = std::max(0, end[a] - low[a]);
      count *= static_cast<std::size_t>(size[a]);
    }
    values.resize(count);
    if (count == 0)
      return;
    for (std::int32_t i = low[0]; i < end[0]; i = (i | 7) + 1)
      for (std::int32_t j = low[1]; j < end[1]; j = (j | 7) + 1)
        for (std::int32_t k = low[2]; k < end[2]; k = (k | 7) + 1)
          copy_block(old, {i, j, k}, end);
  }
  float* at(std::int32_t i, std::int32_t j, std::int32_t k) {
    return values.data() +
           ((static_cast<std::ptrdiff_t>(i - min[0]) * size[1] + (j - min[1])) * size[2] +
            (k - min[2]));
  }

private:
  /// The part from `low` on of the leaf or tile that holds it.
  void copy_block(GridAccessor& old, const Int3& low, const Int3& end) {
    float tile = 0;
    const LeafView leaf = old.leaf_at(low, tile);
    const auto last = [&](std::size_t a) { return std::min(end[a], (low[a] | 7) + 1); };
    for (std::int32_t i = low[0]; i < last(0); ++i)
      for (std::int32_t j = low[1]; j < last(1); ++j) {
        const std::int32_t count = last(2) - low[2];
        if (leaf.values != nullptr)
          std::copy_n(leaf.values + leaf_offset({i, j, low[2]}), count, at(i, j, low[2]));
        else
          std::fill_n(at(i, j, low[2]), count, tile);
      }
  }
};

/// Fills leaves of the new grid. Sums are in double: of equal floats they round to that float.
class Sampler {
public:
  Sampler(const Grid& grid, const Planner& planner)
      : info_(grid.info()), map_(planner.to_old()), half_width_(planner.half_width()),
        min_(planner.old_min()), max_(planner.old_max()), old_(grid) {
    // As many new voxels at a time as keep the window of old ones small.
    const auto window = [&] {
      double count = 1;
      for (int a = 0; a < 3; ++a)
        count *= (block_ + 2) * half_width_[a];
      return count;
    };
    while (block_ > 1 && window() > (1 << 21))
      block_ /= 2;
  }

  void fill(const LeafRef& leaf) {
    for (int i = 0; i < leaf_dim; i += block_)
      for (int j = 0; j < leaf_dim; j += block_)
        for (int k = 0; k < leaf_dim; k += block_)
          fill_block(leaf, {i, j, k});
    for (int n = 0; n < leaf_voxels; ++n) {
      const float value = leaf.values[n], background = info_.background;
      if (info_.level_set ? std::fabs(value) < std::fabs(background) : value != background)
        leaf.active[n >> 6] |= std::uint64_t{1} << (n & 63);
    }
  }

private:
  Vec3 center(const LeafRef& leaf, int i, int j, int k) const {
    return map_({static_cast<double>(leaf.origin[0] + i), static_cast<double>(leaf.origin[1] + j),
                 static_cast<double>(leaf.origin[2] + k)});
  }
  void set_weights(std::size_t axis, std::size_t n, const Vec3& at) {
    const int a = static_cast<int>(axis);
    weights_[axis][n].set(at[a], half_width_[a], min_[axis], max_[axis]);
  }

  void fill_block(const LeafRef& leaf, const Int3& from) {
    const auto block = static_cast<std::size_t>(block_);
    if (map_.is_diagonal()) {
      Int3 low{}, end{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = INT32_MAX;
        end[axis] = INT32_MIN;
        for (std::size_t n = 0; n < block; ++n) {
          const int step = static_cast<int>(n);
          set_weights(axis, n, center(leaf, from[0] + step, from[1] + step, from[2] + step));
          if (weights_[axis][n].weight.empty())
            continue;
          low[axis] = std::min(low[axis], weights_[axis][n].first);
          end[axis] = std::max(end[axis], weights_[axis][n].end());
        }
        if (end[axis] < low[axis])
          low[axis] = end[axis] = 0; // all on background
      }
      window_.gather(old_, low, end);
      separable_sums(leaf, from);
      return;
    }
    Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = -low;
    for (int corner = 0; corner < 8; ++corner) {
      const auto part = [&](std::size_t a) {
        return from[a] + ((corner >> a & 1) != 0 ? block_ - 1 : 0);
      };
      const Vec3 c = center(leaf, part(0), part(1), part(2));
      for (int a = 0; a < 3; ++a) {
        low[a] = std::fmin(low[a], c[a] - half_width_[a]);
        high[a] = std::fmax(high[a], c[a] + half_width_[a]);
      }
    }
    Int3 first{}, end{};
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = std::max(min_[a], static_cast<std::int32_t>(std::floor(low[static_cast<int>(a)])));
      end[a] =
          std::min(max_[a], static_cast<std::int32_t>(std::ceil(high[static_cast<int>(a)]))) + 1;
    }
    window_.gather(old_, first, end);
    for (int i = from[0]; i < from[0] + block_; ++i)
      for (int j = from[1]; j < from[1] + block_; ++j)
        for (int k = from[2]; k < from[2] + block_; ++k) {
          for (std::size_t axis = 0; axis < 3; ++axis)
            set_weights(axis, 0, center(leaf, i, j, k));
          leaf.values[leaf_offset({i, j, k})] = direct_sum();
        }
  }

  float direct_sum() {
    const Weights &x = weights_[0][0], &y = weights_[1][0], &z = weights_[2][0];
    double sum = 0;
    if (!z.weight.empty())
      for (std::size_t i = 0; i < x.weight.size(); ++i)
        for (std::size_t j = 0; j < y.weight.size(); ++j) {
          const float* row = window_.at(x.first + static_cast<std::int32_t>(i),
                                        y.first + static_cast<std::int32_t>(j), z.first);
          double row_sum = 0;
          for (std::size_t k = 0; k < z.weight.size(); ++k)
            row_sum += z.weight[k] * static_cast<double>(row[k]);
          sum += x.weight[i] * y.weight[j] * row_sum;
        }
    return with_background(sum, x, y, z);
  }

  float with_background(double sum, const Weights& x, const Weights& y, const Weights& z) const {
    const double outside = 1 - x.sum * y.sum * z.sum;
    return static_cast<float>(outside > 0 ? sum + outside * info_.background : sum);
  }

  /// Along k, then j, then i.
  void separable_sums(const LeafRef& leaf, const Int3& from) {
    const auto block = static_cast<std::size_t>(block_),
               rows = static_cast<std::size_t>(window_.size[1]),
               slices = static_cast<std::size_t>(window_.size[0]);
    const auto offset = [&](std::size_t axis, std::size_t n) {
      return static_cast<std::size_t>(weights_[axis][n].first - window_.min[axis]);
    };
    along_k_.assign(slices * rows * block, 0);
    const bool some = !window_.values.empty();
    for (std::size_t row = 0; some && row < slices * rows; ++row) {
      const float* values = window_.values.data() + row * static_cast<std::size_t>(window_.size[2]);
      for (std::size_t n = 0; n < block; ++n) {
        const std::vector<double>& weight = weights_[2][n].weight;
        double sum = 0;
        for (std::size_t k = 0; k < weight.size(); ++k)
          sum += weight[k] * static_cast<double>(values[offset(2, n) + k]);
        along_k_[row * block + n] = sum;
      }
    }
    along_j_.assign(slices * block * block, 0);
    for (std::size_t i = 0; some && i < slices; ++i)
      for (std::size_t m = 0; m < block; ++m) {
        const std::vector<double>& weight = weights_[1][m].weight;
        double* out = along_j_.data() + (i * block + m) * block;
        for (std::size_t j = 0; j < weight.size(); ++j) {
          const double* in = along_k_.data() + (i * rows + offset(1, m) + j) * block;
          for (std::size_t n = 0; n < block; ++n)
            out[n] += weight[j] * in[n];
        }
      }
    for (std::size_t l = 0; l < block; ++l) {
      const std::vector<double>& weight = weights_[0][l].weight;
      for (std::size_t m = 0; m < block; ++m)
        for (std::size_t n = 0; n < block; ++n) {
          double sum = 0;
          for (std::size_t i = 0; some && i < weight.size(); ++i)
            sum += weight[i] * along_j_[((offset(0, l) + i) * block + m) * block + n];
          leaf.values[leaf_offset({from[0] + static_cast<int>(l), from[1] + static_cast<int>(m),
                                   from[2] + static_cast<int>(n)})] =
              with_background(sum, weights_[0][l], weights_[1][m], weights_[2][n]);
        }
    }
  }

  const GridInfo& info_;
  IndexMap map_;
  Vec3 half_width_;
  Int3 min_, max_; // outside this box all old values are background
  GridAccessor old_;
  int block_ = leaf_dim;
  Window window_;
  std::array<std::array<Weights, leaf_dim>, 3> weights_; // [axis][new index in the block]
  std::vector<double> along_k_, along_j_;
};

std::vector<Region> regions_of(const Grid& grid) {
  std::vector<Region> regions;
  const float background = grid.info().background;
  for (const LeafView& leaf : grid.leaves())
    if (std::any_of(leaf.values, leaf.values + leaf_voxels,
                    [&](float value) { return value != background; }))
      regions.push_back({leaf.origin, leaf_dim, false, 0});
  for (const TileView& tile : grid.tiles())
    if (tile.value != background)
      regions.push_back({tile.origin, tile.dim, true, tile.value});
  return regions;
}

} // namespace

Grid resample(const Context& context, const Grid& grid, const GridTransform& target) {
  if (grid.info().band_isovalue)
    throw Error("the volume is exact only near one isovalue (made with --band) and can't be "
                "resampled, expected one made without");
  Planner planner(context, grid, target);
  Plan plan = planner.plan(regions_of(grid));
  require_memory(context, static_cast<double>(plan.leaves.size()) * leaf_bytes,
                 "the resampled volume");

  GridInfo info = grid.info();
  info.transform = target;
  GridBuilder builder(info);
  for (TileView& tile : plan.tiles) {
    tile.active = !info.level_set; // the inner tiles of a level set are inactive
    builder.add_tile(tile);
  }
  const std::vector<LeafRef> leaves = builder.add_leaves(context, plan.leaves);
  parallel_blocks(context, leaves.size(), 64, [&](std::size_t begin, std::size_t end) {
    Sampler sampler(grid, planner);
    for (std::size_t n = begin; n < end; ++n)
      sampler.fill(leaves[n]);
  });
  return builder.finish();
}

} // namespace gewebe::volume
