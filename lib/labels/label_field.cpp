#include "labels/label_field_internal.h"
// Based on: V. Lempitsky, Surface extraction from binary volumes with higher-order smoothness,
// 2010; Y. Nesterov, A method for solving the convex programming problem with convergence rate
// O(1/k²), 1983.

#include "base/error.h"
#include "base/parallel.h"
#include "labels/label_step_kernel_internal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>

namespace gewebe::labels {
namespace {

constexpr std::size_t block_voxels = 512;
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
constexpr int max_steps = 120;
constexpr double pull = 1.0 / 128;

std::size_t offset_of(const Int3& v) {
  return static_cast<std::size_t>((v[0] & 7) | (v[1] & 7) << 3 | (v[2] & 7) << 6);
}

/// Bits of voxels [i, i + count) of row (j, k); those outside the box are 0. \pre count <= 32
std::uint64_t bits_of(const LabelMask& mask, std::int32_t i, int count, std::int32_t j,
                      std::int32_t k) {
  if (j < 0 || j >= mask.size[1] || k < 0 || k >= mask.size[2])
    return 0;
  const std::uint64_t* const row = mask.bits.data() + mask.row(j, k);
  const std::int32_t words = static_cast<std::int32_t>(mask.row_words());
  const std::int32_t first = i >> 6;
  const auto word = [&](std::int32_t w) { return w < 0 || w >= words ? 0 : row[w]; };
  const int shift = i & 63;
  std::uint64_t bits = word(first) >> shift;
  if (shift + count > 64)
    bits |= word(first + 1) << (64 - shift);
  return bits & ((std::uint64_t{1} << count) - 1);
}

/// Is all of the block and `halo` voxels around it of one kind?
std::int32_t kind_of_block(const LabelMask& mask, const Int3& first, const Int3& halo) {
  const int count = 8 + 2 * halo[0];
  const std::uint64_t full = (std::uint64_t{1} << count) - 1;
  bool any = false, all = true;
  for (std::int32_t k = first[2] - halo[2]; k < first[2] + 8 + halo[2]; ++k)
    for (std::int32_t j = first[1] - halo[1]; j < first[1] + 8 + halo[1]; ++j) {
      const std::uint64_t bits = bits_of(mask, first[0] - halo[0], count, j, k);
      any = any || bits != 0;
      all = all && bits == full;
      if (any && !all)
        return 0;
    }
  return all ? LabelField::inside : LabelField::outside;
}

/// Squared distances of a block's centres to the nearest voxel of one kind, each a box.
class DistanceToKind {
public:
  explicit DistanceToKind(const LabelField& field) : field_(field) {
    for (std::size_t a = 0; a < 3; ++a)
      for (std::int32_t d = 0; d <= field.reach[a]; ++d) {
        const double gap = d == 0 ? 0 : (d - 0.5) * field.spacing[a];
        square_.at(a).push_back(static_cast<float>(gap * gap));
      }
    const std::size_t rows = static_cast<std::size_t>(8 + 2 * field.reach[2]);
    along_i_.resize(rows * static_cast<std::size_t>(8 + 2 * field.reach[1]) * 8);
    along_j_.resize(rows * 64);
  }

  void find(const Int3& first, bool kind, std::array<float, block_voxels>& result) {
    const Int3& r = field_.reach;
    const std::size_t tall = static_cast<std::size_t>(8 + 2 * r[1]),
                      deep = static_cast<std::size_t>(8 + 2 * r[2]);
    for (std::size_t k = 0; k < deep; ++k)
      for (std::size_t j = 0; j < tall; ++j)
        row(first, static_cast<std::int32_t>(j) - r[1], static_cast<std::int32_t>(k) - r[2], kind,
            &along_i_[(k * tall + j) * 8]);
    for (std::size_t k = 0; k < deep; ++k)
      for (std::size_t j = 0; j < 8; ++j)
        nearest(1, &along_i_[(k * tall + j) * 8], 8, 8, &along_j_[k * 64 + 8 * j]);
    for (std::size_t k = 0; k < 8; ++k)
      nearest(2, &along_j_[k * 64], 64, 64, &result[64 * k]);
  }

private:
  /// The row of 8 at (j, k) relative to the block, by its bits alone.
  void row(const Int3& first, std::int32_t j, std::int32_t k, bool kind, float* to) const {
    const int r = field_.reach[0];
    std::uint64_t bits = bits_of(field_.mask, first[0] - r, 8 + 2 * r, first[1] + j, first[2] + k);
    if (!kind)
      bits = ~bits;
    const std::uint64_t window = (std::uint64_t{2} << r) - 1; // 0 … r
    for (int i = 0; i < 8; ++i) {
      const std::uint64_t up = (bits >> (i + r)) & window;
      const std::uint64_t down = (bits >> i) & window;
      const int d = std::min(up == 0 ? 64 : std::countr_zero(up),
                             down == 0 ? 64 : r - (63 - std::countl_zero(down)));
      to[i] = d > r ? HUGE_VALF : square_[0][static_cast<std::size_t>(d)];
    }
  }

  /// Minimum over 2 reach + 1 slices from `from` on, `stride` apart, of value + square of the gap.
  void nearest(std::size_t axis, const float* from, std::size_t stride, std::size_t count,
               float* to) const {
    const std::int32_t r = field_.reach[axis];
    std::fill_n(to, count, HUGE_VALF);
    for (std::int32_t d = -r; d <= r; ++d, from += stride) {
      const float square = square_.at(axis)[static_cast<std::size_t>(std::abs(d))];
      for (std::size_t n = 0; n < count; ++n)
        to[n] = std::min(to[n], from[n] + square);
    }
  }

  const LabelField& field_;
  std::array<std::vector<float>, 3> square_;
  std::vector<float> along_i_, along_j_;
};

/// Every stride-th voxel, from voxel 0 on.
LabelField coarser(const Context& context, const LabelField& fine, const Int3& stride) {
  LabelField field;
  field.reach = {4, 4, 4};
  for (std::size_t a = 0; a < 3; ++a) {
    field.spacing[a] = fine.spacing[a] * stride[a];
    field.mask.size[a] = (fine.mask.size[a] + stride[a] - 1) / stride[a];
  }
  const Int3& size = field.mask.size;
  field.mask.bits.resize(field.mask.row_words() * static_cast<std::size_t>(size[1]) *
                         static_cast<std::size_t>(size[2]));
  for (std::int32_t k = 0; k < size[2]; ++k)
    for (std::int32_t j = 0; j < size[1]; ++j) {
      const std::uint64_t* const from =
          fine.mask.bits.data() + fine.mask.row(j * stride[1], k * stride[2]);
      std::uint64_t* const to = field.mask.bits.data() + field.mask.row(j, k);
      if (stride[0] == 1)
        std::copy_n(from, field.mask.row_words(), to);
      else
        for (std::int32_t i = 0; i < size[0]; ++i)
          to[i >> 6] |= (from[i >> 5] >> ((2 * i) & 63) & 1) << (i & 63);
    }
  find_band(context, field);
  return field;
}

/// Which axes are merged next: the finer ones until all are alike, then all.
Int3 next_stride(const std::array<double, 3>& spacing) {
  const double largest = *std::max_element(spacing.begin(), spacing.end());
  Int3 stride{1, 1, 1};
  bool any = false;
  for (std::size_t a = 0; a < 3; ++a)
    if (1.5 * spacing[a] <= largest) {
      stride[a] = 2;
      any = true;
    }
  return any ? stride : Int3{2, 2, 2};
}

/// How many more levels help: until the spacings are alike, then one.
std::vector<Int3> strides_of(const LabelField& finest) {
  std::vector<Int3> strides;
  std::array<double, 3> spacing = finest.spacing;
  Int3 size = finest.mask.size;
  int whole = 0;
  while (whole < 1 && strides.size() < 8) {
    const Int3 stride = next_stride(spacing);
    whole += stride == Int3{2, 2, 2} ? 1 : 0;
    for (std::size_t a = 0; a < 3; ++a) {
      spacing[a] *= stride[a];
      size[a] = (size[a] + stride[a] - 1) / stride[a];
    }
    if (std::max({size[0], size[1], size[2]}) < 4)
      break;
    strides.push_back(stride);
  }
  return strides;
}

/// Starts `fine` from the coarser F, interpolated linearly, wherever that respects the bounds.
void prolong(const Context& context, const LabelField& coarse, const Int3& stride,
             LabelField& fine) {
  const LabelBounds bounds = label_bounds(fine);
  const float slack =
      static_cast<float>(0.25 * *std::min_element(fine.spacing.begin(), fine.spacing.end()));
  parallel_blocks(context, fine.band.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      for (std::size_t n = 0; n < block_voxels; ++n) {
        const float d = fine.distance[b * block_voxels + n];
        if (!(d == d))
          continue;
        const Int3 v{fine.band[b][0] + static_cast<std::int32_t>(n & 7),
                     fine.band[b][1] + static_cast<std::int32_t>(n >> 3 & 7),
                     fine.band[b][2] + static_cast<std::int32_t>(n >> 6)};
        Int3 low{}, high{};
        for (std::size_t a = 0; a < 3; ++a) {
          low[a] = stride[a] == 1 ? v[a] : v[a] >> 1;
          high[a] = stride[a] == 1 ? v[a] : (v[a] + 1) >> 1;
        }
        float sum = 0;
        for (int c = 0; c < 8; ++c)
          sum += coarse.value_at({(c & 1) != 0 ? high[0] : low[0], (c & 2) != 0 ? high[1] : low[1],
                                  (c & 4) != 0 ? high[2] : low[2]});
        const float size = std::fabs(d), f = std::copysign(1.0F, d) * sum / 8;
        const float min = bounds.min(size), max = bounds.max(size);
        if (f >= min - slack && f <= max + slack)
          fine.value[b * block_voxels + n] = std::copysign(std::clamp(f, min, max), d);
      }
  });
}

/// Minimises on one level, beginning with and drawn to field.value. The finest takes most of the
/// time, so that only its steps are reported.
void minimise(const Context& context, LabelField& field, LabelDensityReport& report,
              const std::function<void(double)>& progress) {
  const std::size_t blocks = field.band.size();
  const double finest = *std::min_element(field.spacing.begin(), field.spacing.end());
  LabelStep step{};
  double bound = pull;
  for (std::size_t a = 0; a < 3; ++a) {
    const double ratio = finest / field.spacing[a];
    step.weight[a] = static_cast<float>(ratio * ratio * ratio * ratio);
    bound += 16.0 * static_cast<double>(step.weight[a]);
  }
  step.pull = static_cast<float>(pull);
  step.size = static_cast<float>(1 / bound);
  step.half_diagonal = label_bounds(field).half_diagonal;
  const double root = std::sqrt(bound / pull);
  const float momentum = static_cast<float>((root - 1) / (root + 1));
  const LabelStepKernel kernel =
      context.cpu == CpuLevel::baseline ? label_step_baseline : label_step_avx2;

  const std::array<float, block_voxels> none = [] {
    std::array<float, block_voxels> values{};
    values.fill(unknown);
    return values;
  }();
  const std::vector<float> target = field.value;
  std::vector<float> y(target.size()), old = target;
  std::vector<float> changes(blocks);
  const double enough = 2e-3 * finest;
  for (int n = 0; n < max_steps; ++n) {
    parallel_blocks(context, blocks, 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin * block_voxels; v < end * block_voxels; ++v) {
        y[v] = field.value[v] + momentum * (field.value[v] - old[v]);
        old[v] = field.value[v];
      }
    });
    parallel_blocks(context, blocks, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        std::array<const float*, 6> neighbours{};
        for (std::size_t a = 0; a < 6; ++a) {
          Int3 v = field.band[b];
          v[a / 2] += a % 2 == 0 ? -8 : 8;
          const std::int32_t other = field.block_at(v);
          neighbours.at(a) =
              other < 0 ? none.data() : y.data() + static_cast<std::size_t>(other) * block_voxels;
        }
        const std::size_t at = b * block_voxels;
        changes[b] = kernel(step, y.data() + at, neighbours, target.data() + at,
                            field.distance.data() + at, field.value.data() + at);
      }
    });
    ++report.steps;
    if (progress)
      progress(static_cast<double>(n + 1) / max_steps);
    report.last_change = blocks == 0 ? 0 : *std::max_element(changes.begin(), changes.end());
    if (report.last_change <= enough)
      break;
  }
}

} // namespace

float LabelField::value_at(const Int3& v) const {
  const std::int32_t block = block_at(v);
  return block < 0 ? unknown : value[static_cast<std::size_t>(block) * block_voxels + offset_of(v)];
}

LabelBounds label_bounds(const LabelField& field) {
  const auto& s = field.spacing;
  return {static_cast<float>(0.5 * std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]))};
}

double LabelField::far() const {
  double min = HUGE_VAL;
  for (std::size_t a = 0; a < 3; ++a)
    min = std::min(min, (reach[a] + 0.5) * spacing[a]);
  return min;
}

void place_blocks(const Int3& size, LabelField& field) {
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int32_t margin = (field.reach[a] + 7) & ~7;
    field.origin[a] = -margin;
    field.blocks[a] = (size[a] + 2 * margin + 7) / 8;
  }
}

void find_band(const Context& context, LabelField& field) {
  place_blocks(field.mask.size, field);
  Int3 halo{};
  for (std::size_t a = 0; a < 3; ++a)
    halo[a] = field.reach[a] - 1;
  const std::size_t row = static_cast<std::size_t>(field.blocks[0]);
  const std::size_t rows =
      static_cast<std::size_t>(field.blocks[1]) * static_cast<std::size_t>(field.blocks[2]);
  field.directory.assign(row * rows, LabelField::outside);
  parallel_blocks(context, rows, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin * row; n < end * row; ++n)
      field.directory[n] = kind_of_block(
          field.mask,
          {field.origin[0] + 8 * static_cast<std::int32_t>(n % row),
           field.origin[1] + 8 * (static_cast<std::int32_t>(n / row) % field.blocks[1]),
           field.origin[2] + 8 * (static_cast<std::int32_t>(n / row) / field.blocks[1])},
          halo);
  });
  field.band.clear();
  for (std::size_t n = 0; n < field.directory.size(); ++n)
    if (field.directory[n] == 0) {
      field.directory[n] = static_cast<std::int32_t>(field.band.size());
      field.band.push_back(
          {field.origin[0] + 8 * static_cast<std::int32_t>(n % row),
           field.origin[1] + 8 * (static_cast<std::int32_t>(n / row) % field.blocks[1]),
           field.origin[2] + 8 * (static_cast<std::int32_t>(n / row) / field.blocks[1])});
    }
}

void find_distance(const Context& context, LabelField& field) {
  field.distance.resize(field.band.size() * block_voxels);
  parallel_blocks(context, field.band.size(), 16, [&](std::size_t begin, std::size_t end) {
    DistanceToKind distance(field);
    std::array<float, block_voxels> to_inside{}, to_outside{};
    for (std::size_t b = begin; b < end; ++b) {
      distance.find(field.band[b], true, to_inside);
      distance.find(field.band[b], false, to_outside);
      for (std::size_t n = 0; n < block_voxels; ++n) {
        const bool is_inside = to_inside[n] == 0;
        const float square = is_inside ? to_outside[n] : to_inside[n];
        field.distance[b * block_voxels + n] =
            square == HUGE_VALF ? unknown : (is_inside ? std::sqrt(square) : -std::sqrt(square));
      }
    }
  });
  field.value = field.distance;
}

void solve_label_field(const Context& context, LabelField& field, LabelDensityReport& report) {
  Context quiet = context;
  quiet.progress = nullptr;
  const std::vector<Int3> strides = strides_of(field);
  std::vector<LabelField> levels; // all but the finest
  levels.reserve(strides.size());
  for (const Int3& stride : strides) {
    LabelField next = coarser(quiet, levels.empty() ? field : levels.back(), stride);
    if (next.band.empty()) // none of its centres is labelled
      break;
    levels.push_back(std::move(next));
  }
  report.levels = levels.size() + 1;
  for (std::size_t n = levels.size() + 1; n-- > 0;) {
    LabelField& level = n == 0 ? field : levels[n - 1];
    find_distance(quiet, level);
    if (n < levels.size())
      prolong(quiet, levels[n], strides[n], level);
    minimise(quiet, level, report, n == 0 ? context.progress : nullptr);
    if (n < levels.size())
      levels.pop_back();
  }
  for (int n = 0; n < 3; ++n)
    keep_volume(quiet, field);
}

double label_field_bytes(const LabelField& field) {
  const double blocks = static_cast<double>(field.band.size());
  // F, the old F, y, target, D; the coarser levels have a quarter of the blocks each, or half where
  // two axes are merged, and a part of the bits.
  return 2 * blocks * (block_voxels * 4.0 * 5 + sizeof(Int3) + 4) +
         8.0 * static_cast<double>(field.mask.bits.size());
}

} // namespace gewebe::labels
