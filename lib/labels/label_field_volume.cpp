#include "labels/label_field_internal.h"

#include "base/parallel.h"

#include <algorithm>
#include <cmath>

namespace gewebe::labels {
namespace {

constexpr std::size_t block_voxels = 512;

/// What a block lacks, and how much of that a shift by 1 mm would bring, in voxels.
struct Lack {
  double lack = 0, gain = 0;
};

Int3 voxel_of(const Int3& first, std::size_t n) {
  return {first[0] + static_cast<std::int32_t>(n & 7),
          first[1] + static_cast<std::int32_t>(n >> 3 & 7),
          first[2] + static_cast<std::int32_t>(n >> 6)};
}

/// F at the neighbour before and after v along axis a; where one is unknown, by extrapolation.
std::array<double, 2> neighbours(const LabelField& field, const Int3& v, float f, std::size_t a) {
  Int3 low = v, high = v;
  --low[a];
  ++high[a];
  const float before = field.value_at(low), after = field.value_at(high);
  const bool has_before = before == before, has_after = after == after;
  if (!has_before && !has_after)
    return {f, f};
  return {has_before ? before : 2.0 * f - after, has_after ? after : 2.0 * f - before};
}

Lack lack_of(const LabelField& field, std::size_t block, double reach) {
  Lack sum;
  for (std::size_t n = 0; n < block_voxels; ++n) {
    const float f = field.value[block * block_voxels + n];
    if (!(std::fabs(static_cast<double>(f)) <= reach))
      continue;
    std::array<std::array<double, 2>, 3> change{}; // of F over half a voxel, by side
    for (std::size_t a = 0; a < 3; ++a) {
      const auto next = neighbours(field, voxel_of(field.band[block], n), f, a);
      for (std::size_t side = 0; side < 2; ++side)
        change.at(a).at(side) = (next.at(side) - static_cast<double>(f)) / 2;
    }
    // In each octant F is linear, so that a sheet of one voxel has its two sides.
    double fraction = 0;
    for (std::size_t octant = 0; octant < 8; ++octant) {
      double centre = f, width = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double c = change.at(a).at(octant >> a & 1);
        centre += c / 2;
        width += std::fabs(c);
      }
      const double part = width > 0 ? 0.5 + centre / width : centre > 0 ? 1 : 0;
      fraction += std::clamp(part, 0.0, 1.0) / 8;
      if (part > 0 && part < 1)
        sum.gain += 0.125 / width;
    }
    sum.lack += (f > 0 ? 1 : 0) - fraction;
  }
  return sum;
}

/// Weights 1 2 1 along an axis.
std::vector<Lack> spread(const Context& context, const LabelField& field,
                         const std::vector<Lack>& from, std::size_t axis) {
  std::vector<Lack> to(from.size());
  parallel_blocks(context, from.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      Lack sum{2 * from[b].lack, 2 * from[b].gain};
      for (const std::int32_t step : {-8, 8}) {
        Int3 v = field.band[b];
        v[axis] += step;
        const std::int32_t other = field.block_at(v);
        if (other < 0)
          continue;
        sum.lack += from[static_cast<std::size_t>(other)].lack;
        sum.gain += from[static_cast<std::size_t>(other)].gain;
      }
      to[b] = {sum.lack / 4, sum.gain / 4};
    }
  });
  return to;
}

/// How often: each pass adds half a squared block to the variance. The deviation shall be a block,
/// and four of the largest spacings, lest the shift follow the terraces of the slices.
int passes(const LabelField& field, std::size_t axis) {
  const double largest = *std::max_element(field.spacing.begin(), field.spacing.end());
  const double deviation = std::fmax(1, 4 * largest / (8 * field.spacing[axis]));
  return static_cast<int>(std::fmin(16, std::ceil(2 * deviation * deviation)));
}

} // namespace

void keep_volume(const Context& context, LabelField& field) {
  const LabelBounds bounds = label_bounds(field);
  const std::size_t blocks = field.band.size();
  std::vector<Lack> lacks(blocks);
  parallel_blocks(context, blocks, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      lacks[b] = lack_of(field, b, bounds.half_diagonal);
  });
  for (std::size_t a = 0; a < 3; ++a)
    for (int pass = 0; pass < passes(field, a); ++pass)
      lacks = spread(context, field, lacks, a);
  std::vector<float> shift(blocks);
  for (std::size_t b = 0; b < blocks; ++b)
    shift[b] = lacks[b].gain > 0 ? static_cast<float>(lacks[b].lack / lacks[b].gain) : 0.0F;
  parallel_blocks(context, blocks, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      // Shifts of the 27 blocks around, the block's own where there is none.
      std::array<float, 27> around{};
      for (int n = 0; n < 27; ++n) {
        const std::int32_t other = field.block_at({field.band[b][0] + 8 * (n % 3 - 1),
                                                   field.band[b][1] + 8 * (n / 3 % 3 - 1),
                                                   field.band[b][2] + 8 * (n / 9 - 1)});
        around.at(static_cast<std::size_t>(n)) =
            shift[other < 0 ? b : static_cast<std::size_t>(other)];
      }
      for (std::size_t n = 0; n < block_voxels; ++n) {
        float& f = field.value[b * block_voxels + n];
        if (!(f == f))
          continue;
        std::array<std::size_t, 3> low{};
        std::array<float, 3> part{};
        for (std::size_t a = 0; a < 3; ++a) {
          const std::size_t place = n >> (3 * a) & 7;
          low.at(a) = place < 4 ? 0 : 1;
          part.at(a) = (static_cast<float>(place) + 4.5F) / 8 - static_cast<float>(low.at(a));
        }
        float c = 0;
        for (std::size_t corner = 0; corner < 8; ++corner) {
          float weight = 1;
          std::size_t at = 0, stride = 1;
          for (std::size_t a = 0; a < 3; ++a, stride *= 3) {
            const bool high = (corner >> a & 1) != 0;
            weight *= high ? part.at(a) : 1 - part.at(a);
            at += stride * (low.at(a) + (high ? 1 : 0));
          }
          c += weight * around.at(at);
        }
        const float d = field.distance[b * block_voxels + n], size = std::fabs(d);
        const float moved = std::copysign(1.0F, d) * (f + c);
        f = std::copysign(1.0F, d) * std::clamp(moved, bounds.min(size), bounds.max(size));
      }
    }
  });
}

} // namespace gewebe::labels
