#pragma once
// Constructive solid geometry on volumes: FZKA 7190, 3.1.5 (densities added to and subtracted from
// a voxelized model), and set operations on grey values.

#include "volume/grid.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::volume {

/// With A the result so far and B the next operand. The set operations clamp each operand to [0,
/// 1]; add and subtract clamp nothing but the end result, which is at least 0.
enum class CsgOperation {
  add,          ///< A + B
  subtract,     ///< A - B
  unite,        ///< max(A, B)
  intersect,    ///< min(A, B)
  difference,   ///< min(A, 1 - B)
  exclusive_or, ///< max(min(A, 1 - B), min(1 - A, B))
};

/// "add", "subtract", "union", "intersect", "difference", "xor", in this order.
const std::vector<std::string>& csg_operation_names();
/// \throw UsageError if `name` is none of them
CsgOperation csg_operation_from_name(std::string_view name);

struct CsgOperand {
  Grid grid;
  std::string name; ///< for messages: the file
};

struct CsgOptions {
  bool resample = false; ///< operands on another lattice than the first's are resampled to it
};

struct CsgReport {
  std::uint64_t leaves_computed = 0; ///< with values of their own
  std::uint64_t leaves_shared = 0;   ///< equal to an operand's leaf
  std::uint64_t leaves_constant = 0; ///< that came out constant: tiles, or nothing where 0
  std::uint64_t leaves_skipped = 0;  ///< operands', in blocks constant whatever they hold
  std::uint64_t tiles_combined = 0;  ///< constant regions, not all 0, combined in O(1) each
  std::uint64_t resampled = 0;       ///< operands
};

/// Folds the operands from left to right, voxel by voxel in single precision. The result has the
/// first one's lattice, isovalue and name, and is active where its value isn't 0. Work follows the
/// operands' leaves and tiles; the result is the same for any number of threads.
///
/// Operands without other owners (move them in) are used up: the largest one's tree becomes the
/// result's, and then the cost follows the other operands, not this one, where they leave it
/// untouched. Leaves taken over from operands that live on are shared, never copied.
///
/// A band volume (exact only near one isovalue v) can be united and intersected, and with v = ½
/// used in the other set operations, together with volumes that have no band or the same; the
/// result is a band volume again. Every voxel is then on the side of v where it would be without
/// the band; on a lattice edge that both surfaces cross or touch, the crossing may lie elsewhere,
/// since a constant beside the band stands for the value there.
///
/// \throw Error, with the operand's name as place or both names in the text: fewer than two
/// operands, a level set, a background other than 0, voxels that aren't cubic, different isovalues,
/// a band where it can't be used, different lattices without options.resample, a sum beyond single
/// precision, context.max_memory
Grid csg(const Context& context, CsgOperation operation, std::vector<CsgOperand> operands,
         const CsgOptions& options = {}, CsgReport* report = nullptr);

} // namespace gewebe::volume
