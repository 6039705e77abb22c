#include "volume/value_summary_internal.h"

#include "base/parallel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace gewebe::volume {
namespace {

// Floats as integers in the same order (-0 just below +0), so that smallest and largest are found
// by integer arithmetic, which needs no care for NaN: NaNs lie beyond the infinities.
using Key = std::int32_t;

Key key_of(float value) {
  const auto bits = std::bit_cast<Key>(value);
  return bits ^ ((bits >> 31) & 0x7fffffff);
}
float value_of(Key key) {
  return std::bit_cast<float>(key ^ ((key >> 31) & 0x7fffffff));
}

struct Range {
  Key min = std::numeric_limits<Key>::max(), max = std::numeric_limits<Key>::min();
  bool active_where_not_0 = true, varied = true;

  void add(const Range& other) {
    min = std::min(min, other.min);
    max = std::max(max, other.max);
    active_where_not_0 = active_where_not_0 && other.active_where_not_0;
    varied = varied && other.varied;
  }
};

/// Which of 64 values aren't 0, as bits.
std::uint64_t not_0(const float* values) {
  std::uint64_t bits = 0;
  for (unsigned n = 0; n < 64; ++n)
    bits |= static_cast<std::uint64_t>(values[n] != 0) << n;
  return bits;
}

Range range_of(const LeafView& leaf) {
  Key min = std::numeric_limits<Key>::max(), max = std::numeric_limits<Key>::min();
  for (int n = 0; n < leaf_voxels; ++n) {
    const Key key = key_of(leaf.values[n]);
    min = key < min ? key : min;
    max = key > max ? key : max;
  }
  Range range;
  range.min = min;
  range.max = max;
  range.varied = range.min != range.max;
  for (int word = 0; word < 8; ++word) {
    const std::uint64_t active = leaf.active[word];
    // Where nothing is 0 the mask must be full: the usual case inside, and cheap.
    const std::uint64_t expected =
        range.min > 0 ? ~std::uint64_t{0} : not_0(leaf.values + std::ptrdiff_t{64} * word);
    range.active_where_not_0 = range.active_where_not_0 && active == expected;
  }
  return range;
}

} // namespace

ValueSummary summarize_values(const Context& context, std::span<const LeafView> leaves,
                              std::span<const TileView> tiles, const GridInfo& info) {
  constexpr std::size_t grain = 256;
  std::vector<Range> ranges((leaves.size() + grain - 1) / grain);
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, leaves.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      ranges[begin / grain].add(range_of(leaves[n]));
  });
  Range all;
  for (const Range& range : ranges)
    all.add(range);
  for (const TileView& tile : tiles) {
    const Key key = key_of(tile.value);
    all.add({key, key, tile.active == (tile.value != 0), true});
  }
  ValueSummary summary;
  const bool some = all.min <= all.max;
  summary.min = some ? value_of(all.min) : info.background;
  summary.max = some ? value_of(all.max) : info.background;
  summary.finite =
      std::isfinite(summary.min) && std::isfinite(summary.max) && std::isfinite(info.background);
  summary.active_where_not_0 = all.active_where_not_0;
  summary.varied_leaves = all.varied;
  return summary;
}

} // namespace gewebe::volume
