#include "labels/label_density.h"

#include "base/error.h"
#include "base/parallel.h"
#include "labels/label_field_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace gewebe::labels {
namespace {

constexpr double largest_ratio = 6;

using Matrix = std::array<Vec3, 3>; // columns

Matrix columns_of(const volume::GridTransform& t) {
  return {Vec3{t.m[0], t.m[4], t.m[8]}, Vec3{t.m[1], t.m[5], t.m[9]},
          Vec3{t.m[2], t.m[6], t.m[10]}};
}

/// The orthogonal matrix nearest to three unit columns: Newton's iteration X <- (X + X⁻ᵀ)/2 for the
/// polar decomposition (Higham 1986). Leaves an orthogonal matrix with entries 0 and ±1 unchanged.
Matrix nearest_rotation(Matrix x) {
  for (int n = 0; n < 60; ++n) {
    const double volume = dot(x[0], cross(x[1], x[2]));
    const Matrix inverse_transposed{cross(x[1], x[2]) / volume, cross(x[2], x[0]) / volume,
                                    cross(x[0], x[1]) / volume};
    double change = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const Vec3 next = (x.at(a) + inverse_transposed.at(a)) * 0.5;
      change = std::fmax(change, norm(next - x.at(a)));
      x.at(a) = next;
    }
    if (!(change > 1e-15))
      break;
  }
  return x;
}

/// The label lattice in index units of its own: file voxel = index · ratio.
struct Sampling {
  std::array<double, 3> ratio{};
  double voxel = 0;
};

std::int32_t floor_int(double x) {
  return static_cast<std::int32_t>(std::floor(x));
}

/// Weights of the four values about a place between the second and the third, Catmull and Rom 1974.
/// They reproduce quadratics, and values at the file's own centres.
std::array<double, 4> cubic_weights(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2,
          (t3 - t2) / 2};
}

/// F at the 8 x 8 x 8 centres of leaves.
class LeafSampler {
public:
  LeafSampler(const LabelField& field, const Sampling& sampling)
      : field_(field), sampling_(sampling), far_(static_cast<float>(field.far())) {}

  /// values[64 i + 8 j + k] of the leaf at `origin`: densities.
  void sample(const Int3& origin, float* values) {
    std::array<Axis, 3> axes;
    for (std::size_t a = 0; a < 3; ++a)
      axes.at(a) = axis(origin[a], sampling_.ratio[a]);
    gather(axes);
    // i, then j, then k: each pass leaves 8 of its axis.
    const std::size_t n0 = axes[0].count, n1 = axes[1].count, n2 = axes[2].count;
    pass_.resize(8 * n1 * n2);
    for (std::size_t r = 0; r < n1 * n2; ++r)
      for (std::size_t i = 0; i < 8; ++i) {
        double sum = 0;
        for (std::size_t t = 0; t < 4; ++t)
          sum += axes[0].weight[i][t] * block_[r * n0 + axes[0].first[i] + t];
        pass_[r * 8 + i] = sum;
      }
    second_.resize(64 * n2);
    for (std::size_t k = 0; k < n2; ++k)
      for (std::size_t j = 0; j < 8; ++j)
        for (std::size_t i = 0; i < 8; ++i) {
          double sum = 0;
          for (std::size_t t = 0; t < 4; ++t)
            sum += axes[1].weight[j][t] * pass_[(k * n1 + axes[1].first[j] + t) * 8 + i];
          second_[k * 64 + j * 8 + i] = sum;
        }
    const double half = 0.5 / sampling_.voxel;
    for (std::size_t k = 0; k < 8; ++k)
      for (std::size_t j = 0; j < 8; ++j)
        for (std::size_t i = 0; i < 8; ++i) {
          double sum = 0;
          for (std::size_t t = 0; t < 4; ++t)
            sum += axes[2].weight[k][t] * second_[(axes[2].first[k] + t) * 64 + j * 8 + i];
          values[64 * i + 8 * j + k] = static_cast<float>(std::clamp(0.5 + half * sum, 0.0, 1.0));
        }
  }

private:
  struct Axis {
    std::int32_t begin = 0; ///< first file voxel
    std::size_t count = 0;
    std::array<std::size_t, 8> first{}; ///< of four, from begin on
    std::array<std::array<double, 4>, 8> weight{};
  };

  static Axis axis(std::int32_t origin, double ratio) {
    Axis a;
    for (std::size_t n = 0; n < 8; ++n) {
      double x = (origin + static_cast<double>(n)) * ratio;
      // A centre of the file stays one in spite of rounding.
      if (std::fabs(x - std::round(x)) < 1e-9)
        x = std::round(x);
      const std::int32_t cell = floor_int(x);
      if (n == 0)
        a.begin = cell - 1;
      a.first.at(n) = static_cast<std::size_t>(cell - 1 - a.begin);
      a.weight.at(n) = cubic_weights(x - cell);
    }
    a.count = a.first[7] + 4;
    return a;
  }

  /// Copies F of all file voxels that count; beyond the band its sign times far.
  void gather(const std::array<Axis, 3>& axes) {
    block_.resize(axes[0].count * axes[1].count * axes[2].count);
    std::size_t n = 0;
    for (std::size_t k = 0; k < axes[2].count; ++k)
      for (std::size_t j = 0; j < axes[1].count; ++j)
        for (std::size_t i = 0; i < axes[0].count; ++i) {
          const Int3 v{axes[0].begin + static_cast<std::int32_t>(i),
                       axes[1].begin + static_cast<std::int32_t>(j),
                       axes[2].begin + static_cast<std::int32_t>(k)};
          const float f = field_.value_at(v);
          block_[n++] = f == f ? f : field_.mask.inside(v) ? far_ : -far_;
        }
  }

  const LabelField& field_;
  const Sampling& sampling_;
  float far_;
  std::vector<float> block_;
  std::vector<double> pass_, second_;
};

/// What the blocks of file voxels are that the cube of `dim` grid voxels at `origin` meets:
/// outside, inside, or 0 if the band is among them.
std::int32_t kind_of_cube(const LabelField& field, const Sampling& sampling, const Int3& origin,
                          std::int32_t dim) {
  Int3 low{}, high{};
  for (std::size_t a = 0; a < 3; ++a) {
    // A voxel more on each side for the interpolation and what is between centres.
    const double begin = origin[a] * sampling.ratio[a] - 1;
    const double end = (origin[a] + static_cast<double>(dim) - 1) * sampling.ratio[a] + 1;
    low[a] = floor_int(begin - field.origin[a]) >> 3;
    high[a] = floor_int(end - field.origin[a]) >> 3;
  }
  bool some_inside = false, some_outside = false;
  for (std::int32_t k = low[2]; k <= high[2]; ++k)
    for (std::int32_t j = low[1]; j <= high[1]; ++j)
      for (std::int32_t i = low[0]; i <= high[0]; ++i) {
        const std::int32_t kind = field.block_at(
            {field.origin[0] + 8 * i, field.origin[1] + 8 * j, field.origin[2] + 8 * k});
        if (kind >= 0)
          return 0;
        (kind == LabelField::inside ? some_inside : some_outside) = true;
        if (some_inside && some_outside)
          return 0;
      }
  return some_inside ? LabelField::inside : LabelField::outside;
}

/// Where the grid has tiles, and which of its leaves the band meets.
struct Plan {
  std::vector<volume::TileView> tiles;
  std::vector<Int3> leaves;
};

/// The cubes of 128 voxels of the grid that a field meets.
struct Nodes {
  Int3 low{}, count{};
  double bytes() const {
    return static_cast<double>(sizeof(Plan)) * count[0] * static_cast<double>(count[1]) * count[2];
  }
};

Nodes nodes_of(const LabelField& field, const Sampling& sampling) {
  Nodes nodes;
  for (std::size_t a = 0; a < 3; ++a) {
    const double begin = field.origin[a] / sampling.ratio[a],
                 end = (field.origin[a] + 8.0 * field.blocks[a]) / sampling.ratio[a];
    if (!(begin > -0x1p30 && end < 0x1p30))
      throw Error("an index of the volume would leave ±2^30, expected a larger voxel");
    nodes.low[a] = floor_int(begin / 128);
    nodes.count[a] = floor_int(end / 128) + 1 - nodes.low[a];
  }
  return nodes;
}

Plan plan_grid(const Context& context, const LabelField& field, const Sampling& sampling) {
  const auto [low, count] = nodes_of(field, sampling);
  const std::size_t nodes = static_cast<std::size_t>(count[0]) *
                            static_cast<std::size_t>(count[1]) * static_cast<std::size_t>(count[2]);
  std::vector<Plan> parts(nodes);
  parallel_blocks(context, nodes, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto m = static_cast<std::int64_t>(n);
      const Int3 node{128 * (low[0] + static_cast<std::int32_t>(m / count[2] / count[1])),
                      128 * (low[1] + static_cast<std::int32_t>(m / count[2] % count[1])),
                      128 * (low[2] + static_cast<std::int32_t>(m % count[2]))};
      const std::int32_t kind = kind_of_cube(field, sampling, node, 128);
      if (kind == LabelField::inside)
        parts[n].tiles.push_back({node, 128, 1.0F, true});
      if (kind < 0)
        continue;
      for (std::int32_t i = 0; i < 128; i += 8)
        for (std::int32_t j = 0; j < 128; j += 8)
          for (std::int32_t k = 0; k < 128; k += 8) {
            const Int3 leaf{node[0] + i, node[1] + j, node[2] + k};
            const std::int32_t part = kind_of_cube(field, sampling, leaf, 8);
            if (part == LabelField::inside)
              parts[n].tiles.push_back({leaf, 8, 1.0F, true});
            else if (part != LabelField::outside)
              parts[n].leaves.push_back(leaf);
          }
    }
  });
  Plan plan;
  for (Plan& part : parts) {
    plan.tiles.insert(plan.tiles.end(), part.tiles.begin(), part.tiles.end());
    plan.leaves.insert(plan.leaves.end(), part.leaves.begin(), part.leaves.end());
  }
  return plan;
}

std::uint64_t count_bits(const LabelMask& mask) {
  std::uint64_t count = 0;
  for (const std::uint64_t word : mask.bits)
    count += static_cast<std::uint64_t>(std::popcount(word));
  return count;
}

} // namespace

volume::GridTransform label_lattice(const LabelMask& mask, double voxel, double* shear) {
  const Matrix file = columns_of(mask.transform);
  Matrix unit{};
  std::array<double, 3> spacing{};
  for (std::size_t a = 0; a < 3; ++a) {
    spacing.at(a) = norm(file.at(a));
    unit.at(a) = file.at(a) / spacing.at(a);
  }
  const Matrix rotation = nearest_rotation(unit);
  // The centre stays; how far does a corner move?
  Vec3 shift;
  double farthest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 moved;
    for (std::size_t a = 0; a < 3; ++a) {
      const double half = (mask.size[a] - 1) / 2.0;
      const Vec3 difference = file.at(a) - rotation.at(a) * spacing.at(a);
      moved += difference * ((corner >> a & 1) != 0 ? half : -half);
      if (corner == 0)
        shift += difference * half;
    }
    farthest = std::fmax(farthest, norm(moved));
  }
  if (shear != nullptr)
    *shear = farthest;
  const double smallest = *std::min_element(spacing.begin(), spacing.end());
  if (!(farthest <= 0.1 * smallest))
    throw Error("the axes are oblique: right angles would move a corner by " +
                text::six_digits(farthest) + " mm, expected at most a tenth of the spacing of " +
                text::six_digits(smallest) + " mm");
  volume::GridTransform t;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t a = 0; a < 3; ++a)
      t.m[4 * row + a] = rotation.at(a)[static_cast<int>(row)] * voxel;
    t.m[4 * row + 3] = mask.transform.m[4 * row + 3] + shift[static_cast<int>(row)];
  }
  return t;
}

namespace {

/// A field without mask and band, as far as a mask's size and place tell it.
void lay_out(const LabelMask& mask, const LabelDensityOptions& options, LabelField& field,
             Sampling& sampling) {
  const Vec3 size = mask.transform.voxel_size();
  const double smallest = std::fmin(size.x, std::fmin(size.y, size.z));
  sampling.voxel = options.voxel.value_or(smallest);
  if (!(sampling.voxel <= largest_ratio * smallest))
    throw Error("a voxel of " + text::six_digits(sampling.voxel) + " mm over labels every " +
                text::six_digits(smallest) + " mm, expected at most " +
                text::six_digits(largest_ratio * smallest));
  for (std::size_t a = 0; a < 3; ++a) {
    field.spacing[a] = size[static_cast<int>(a)];
    sampling.ratio[a] = sampling.voxel / field.spacing[a];
    field.reach[a] = std::max(4, floor_int(1.5 * sampling.ratio[a]) + 2);
  }
  place_blocks(mask.size, field);
}

} // namespace

void check_label_density(const Context& context, const LabelMask& mask,
                         const LabelDensityOptions& options) {
  (void)label_lattice(mask, 1);
  LabelField field;
  Sampling sampling;
  lay_out(mask, options, field, sampling);
  const double words =
      static_cast<double>(mask.row_words()) * mask.size[1] * static_cast<double>(mask.size[2]);
  const double blocks =
      field.blocks[0] * static_cast<double>(field.blocks[1]) * static_cast<double>(field.blocks[2]);
  require_memory(context, 16 * words + 4 * blocks + nodes_of(field, sampling).bytes(),
                 "the lattice of the labels");
}

volume::Grid label_density(const Context& context, const LabelMask& mask,
                           const LabelDensityOptions& options, LabelDensityReport* report) {
  LabelDensityReport local;
  LabelDensityReport& r = report != nullptr ? *report : local;
  r = {};
  Context quiet = context; // all but the solution is quick
  quiet.progress = nullptr;
  const Vec3 size = mask.transform.voxel_size();
  check_label_density(context, mask, options);
  LabelField field;
  Sampling sampling;
  lay_out(mask, options, field, sampling);
  volume::GridInfo info;
  info.transform = label_lattice(mask, sampling.voxel, &r.shear);
  r.voxels = count_bits(mask);
  r.volume = static_cast<double>(r.voxels) * size.x * size.y * size.z;
  field.mask = mask;
  find_band(quiet, field);
  r.band_voxels = field.band.size() * volume::leaf_voxels;
  r.leaves_skipped = field.directory.size() - field.band.size();
  double finer = 1; // leaves of the grid for each block
  for (const double ratio : sampling.ratio)
    finer *= 1 / ratio + 0.5;
  require_memory(context,
                 label_field_bytes(field) + static_cast<double>(field.band.size()) * finer *
                                                (volume::leaf_voxels * 4.0 + 200),
                 "the density of the labels");
  const Plan plan = plan_grid(quiet, field, sampling);
  solve_label_field(context, field, r);

  volume::GridBuilder builder(info);
  for (const volume::TileView& tile : plan.tiles)
    builder.add_tile(tile);
  const std::vector<volume::LeafRef> leaves = builder.add_leaves(quiet, plan.leaves);
  parallel_blocks(quiet, leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
    LeafSampler sampler(field, sampling);
    for (std::size_t n = begin; n < end; ++n) {
      sampler.sample(leaves[n].origin, leaves[n].values);
      for (std::size_t v = 0; v < volume::leaf_voxels; ++v)
        if (leaves[n].values[v] != 0)
          leaves[n].active[v / 64] |= std::uint64_t{1} << (v % 64);
    }
  });
  return builder.finish();
}

} // namespace gewebe::labels
