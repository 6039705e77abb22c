#pragma once
// Several grids combined into one, block by block from the largest to the leaf: what a rule decides
// for a whole block is done at once, and leaves that stay as they are keep their place in memory.

#include "volume/grid.h"

#include <array>
#include <functional>

namespace gewebe::volume {

/// One of the grids in a cubic block of 8, 128 or 4096 voxels' edge.
struct BlockSource {
  bool detail = false; ///< not constant: a leaf, or something finer inside
  float constant = 0;  ///< else the value
  LeafView leaf{};     ///< of a leaf: its values
};

struct BlockDecision {
  enum class Kind {
    look_inside, ///< decide for the parts; of a leaf: compute its values
    constant,    ///< all `value`, active if that isn't 0
    take,        ///< equal to that of grid `operand`
  };
  Kind kind = Kind::look_inside;
  float value = 0;
  std::size_t operand = 0;
};

/// Decides from the constants alone. \pre of the rule: without any detail it decides `constant`;
/// with all constants 0 it decides 0
using BlockRule = std::function<BlockDecision(std::span<const BlockSource>)>;

using LeafValues = std::array<float, leaf_voxels>;

/// Computes a leaf; `look_inside` means that `values` are the result, active where not 0. Called
/// from several threads.
using LeafRule = std::function<BlockDecision(std::span<const BlockSource>, LeafValues& values)>;

struct FoldReport {
  std::uint64_t leaves_computed = 0; ///< with values of their own
  std::uint64_t leaves_taken = 0;    ///< equal to an operand's leaf
  std::uint64_t leaves_constant = 0; ///< decided by the leaf rule: tiles, or nothing where 0
  std::uint64_t leaves_skipped = 0;  ///< operands', in blocks decided constant without a look
  std::uint64_t tiles_combined = 0;  ///< constant regions, not all 0, decided in O(1) each
};

/// Combines `grids`; the result has `info`. A grid without other owners is taken apart: if it is
/// the largest such one, its tree becomes the result's and only the blocks in which something
/// happens are touched. Of the others the leaves that are taken are shared. The result's leaves and
/// tiles are the same in each case and for any number of threads.
/// \pre all grids and `info` have background 0
/// \throw Error beyond context.max_memory
Grid fold_grids(const Context& context, const GridInfo& info, std::vector<Grid> grids,
                const BlockRule& block_rule, const LeafRule& leaf_rule, FoldReport& report);

} // namespace gewebe::volume
