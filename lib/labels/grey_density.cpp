#include "labels/grey_density.h"

#include "base/error.h"
#include "base/parallel.h"
#include "labels/label_density.h"
#include "text/number_text.h"
#include "volume/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace gewebe::labels {
namespace {

double depth(double value, const GreyDensityOptions& options) {
  return std::fmin(value - options.low, options.high - value);
}

/// Of what kinds the voxels about a row are: of each of its voxels the nine at its place along i.
class Sides {
public:
  Sides(const GreyVolume& scan, const GreyDensityOptions& options)
      : scan_(scan), options_(options), length_(static_cast<std::size_t>(scan.size[0])) {}

  /// The largest |depth| in row (j, k) next to the other kind.
  double width(std::int32_t j, std::int32_t k) {
    some_.assign(length_, 0);
    for (std::int32_t dk = -1; dk <= 1; ++dk)
      for (std::int32_t dj = -1; dj <= 1; ++dj)
        if (j + dj >= 0 && j + dj < scan_.size[1] && k + dk >= 0 && k + dk < scan_.size[2]) {
          const float* const row = scan_.values.data() + scan_.row(j + dj, k + dk);
          for (std::size_t i = 0; i < length_; ++i)
            some_[i] |= kind(row[i]);
        }
    const float* const row = scan_.values.data() + scan_.row(j, k);
    double largest = 0;
    for (std::size_t i = 0; i < length_; ++i) {
      const int around =
          some_[i] | (i > 0 ? some_[i - 1] : 0) | (i + 1 < length_ ? some_[i + 1] : 0);
      const double d = std::fabs(depth(static_cast<double>(row[i]), options_));
      if (around == 3 && d > largest && std::isfinite(d))
        largest = d;
    }
    return largest;
  }

private:
  /// 1 inside, 2 outside (NaN too).
  int kind(float value) const { return depth(static_cast<double>(value), options_) > 0 ? 1 : 2; }

  const GreyVolume& scan_;
  const GreyDensityOptions& options_;
  std::size_t length_;
  std::vector<int> some_; ///< kinds of the nine voxels (i, j ± 1, k ± 1)
};

void look(const GreyVolume& scan, const GreyDensityOptions& options, GreyDensityReport& r) {
  bool first = true;
  for (const float value : scan.values) {
    if (value != value) {
      ++r.missing;
      continue;
    }
    r.min = first ? value : std::min(r.min, value);
    r.max = first ? value : std::max(r.max, value);
    first = false;
    r.voxels += depth(static_cast<double>(value), options) > 0 ? 1 : 0;
  }
  if (first)
    throw Error("no voxel has a value");
  if (r.voxels == 0 || r.voxels == scan.values.size())
    throw Error(std::string(r.voxels == 0 ? "no" : "every") +
                " voxel lies within the thresholds; values go from " +
                text::six_digits(static_cast<double>(r.min)) + " to " +
                text::six_digits(static_cast<double>(r.max)));
}

double width_of(const Context& context, const GreyVolume& scan, const GreyDensityOptions& options) {
  const std::size_t slices = static_cast<std::size_t>(scan.size[2]);
  std::vector<double> widths(slices);
  parallel_blocks(context, slices, 1, [&](std::size_t begin, std::size_t end) {
    Sides sides(scan, options);
    for (std::size_t k = begin; k < end; ++k)
      for (std::int32_t j = 0; j < scan.size[1]; ++j)
        widths[k] = std::fmax(widths[k], sides.width(j, static_cast<std::int32_t>(k)));
  });
  return *std::max_element(widths.begin(), widths.end());
}

/// The densities on the scan's own lattice.
volume::Grid own_density(const Context& context, const GreyVolume& scan,
                         const GreyDensityOptions& options, double width) {
  volume::GridInfo info;
  info.transform = scan.transform;
  const Int3 leaves_of{(scan.size[0] + 7) / 8, (scan.size[1] + 7) / 8, (scan.size[2] + 7) / 8};
  std::vector<Int3> origins;
  for (std::int32_t i = 0; i < leaves_of[0]; ++i)
    for (std::int32_t j = 0; j < leaves_of[1]; ++j)
      for (std::int32_t k = 0; k < leaves_of[2]; ++k)
        origins.push_back({8 * i, 8 * j, 8 * k});
  volume::GridBuilder builder(info);
  const std::vector<volume::LeafRef> leaves = builder.add_leaves(context, origins);
  parallel_blocks(context, leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const volume::LeafRef& leaf = leaves[n];
      Int3 last{};
      for (std::size_t a = 0; a < 3; ++a)
        last[a] = std::min(leaf.origin[a] + 8, scan.size[a]);
      for (std::int32_t k = leaf.origin[2]; k < last[2]; ++k)
        for (std::int32_t j = leaf.origin[1]; j < last[1]; ++j) {
          const float* const row = scan.values.data() + scan.row(j, k);
          for (std::int32_t i = leaf.origin[0]; i < last[0]; ++i) {
            const double d = depth(static_cast<double>(row[i]), options);
            const double density = d == d ? std::clamp(0.5 + d / (2 * width), 0.0, 1.0) : 0;
            if (density == 0)
              continue;
            const auto offset = static_cast<std::size_t>(volume::leaf_offset({i, j, k}));
            leaf.values[offset] = static_cast<float>(density);
            leaf.active[offset / 64] |= std::uint64_t{1} << (offset % 64);
          }
        }
    }
  });
  return builder.finish();
}

} // namespace

volume::Grid grey_density(const Context& context, const GreyVolume& scan,
                          const GreyDensityOptions& options, GreyDensityReport* report) {
  GreyDensityReport local;
  GreyDensityReport& r = report != nullptr ? *report : local;
  r = {};
  const Vec3 spacing = scan.transform.voxel_size();
  const double smallest = std::fmin(spacing.x, std::fmin(spacing.y, spacing.z));
  LabelMask box;
  box.size = scan.size;
  box.transform = scan.transform;
  const volume::GridTransform lattice =
      label_lattice(box, options.voxel.value_or(smallest), &r.shear);
  look(scan, options, r);
  require_memory(context, 6.0 * sizeof(float) * static_cast<double>(scan.values.size()),
                 "the density of the scan");
  r.width = width_of(context, scan, options);
  if (!(r.width > 0))
    throw Error("no finite value lies next to the thresholds");
  const volume::Grid own = own_density(context, scan, options, r.width);
  Int3 last{};
  for (std::size_t a = 0; a < 3; ++a)
    last[a] = scan.size[a] - 1;
  return volume::same_lattice(scan.transform, lattice, {}, last)
             ? own
             : volume::resample(context, own, lattice);
}

} // namespace gewebe::labels
