#pragma once
// Grids drawn by chance and a short way to combine them, for the tests of CSG.

#include "volume/csg.h"

#include <random>
#include <string>
#include <vector>

namespace gewebe::test {

/// The operands live on: their leaves are shared.
inline volume::Grid combine(volume::CsgOperation operation, const std::vector<volume::Grid>& grids,
                            volume::CsgReport* report = nullptr, int threads = 1) {
  std::vector<volume::CsgOperand> operands;
  for (const volume::Grid& grid : grids)
    operands.push_back({grid, "volume " + std::to_string(operands.size())});
  Context context;
  context.threads = threads;
  return volume::csg(context, operation, std::move(operands), {}, report);
}

/// Leaves and 8³ tiles drawn by chance in [-16, 16)³, values from `min` to `max`, a quarter of the
/// leaves' values 0.
inline volume::Grid random_grid(std::mt19937& random, float min = -0.5f, float max = 1.5f) {
  volume::GridBuilder builder{volume::GridInfo{}};
  std::uniform_real_distribution<float> value(min, max);
  std::uniform_int_distribution<int> three(0, 2);
  std::vector<Int3> leaves;
  for (std::int32_t i = -16; i < 16; i += 8)
    for (std::int32_t j = -16; j < 16; j += 8)
      for (std::int32_t k = -16; k < 16; k += 8)
        switch (three(random)) {
        case 0:
          leaves.push_back({i, j, k});
          break;
        case 1:
          builder.add_tile({{i, j, k}, 8, value(random), true});
          break;
        default:
          break;
        }
  for (const volume::LeafRef& leaf : builder.add_leaves(Context{}, leaves))
    for (std::size_t n = 0; n < volume::leaf_voxels; ++n) {
      leaf.values[n] = random() % 4 == 0 ? 0.0f : value(random);
      if (leaf.values[n] != 0)
        leaf.active[n / 64] |= std::uint64_t{1} << (n % 64);
    }
  return builder.finish(false);
}

} // namespace gewebe::test
