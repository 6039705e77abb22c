#pragma once
// Accumulates the covered volume of voxels from patches of the surface, for exact_coverage and
// line_coverage. Internal to the voxelizer.
//
// Coordinates are those of index space moved by ½, so that voxel (i, j, k) is [i, i+1) x [j, j+1) x
// [k, k+1). Consider a patch of surface in voxel k of a column, with the area A projected along k
// and the volume V between it and the voxel's top. It adds V to voxel k and A to each voxel above.
// Only the differences along k are stored: V at k, A - V at k + 1. Their prefix sums are the
// covered volumes.

#include "antialiasing/coverage.h"
#include "base/memory_account.h"

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

namespace gewebe::antialiasing {

/// A leaf of differences along k. Entry 8 of a column goes to the leaf above.
struct DifferenceLeaf {
  std::array<double, std::size_t{64} * 9> difference{};
  std::array<std::uint64_t, 8> touched{}; ///< voxels with a patch, as bits of a leaf

  /// \pre column = 8 (i & 7) + (j & 7), k in [0, 8)
  void add(std::size_t column, std::size_t k, double volume, double area) {
    double* const d = &difference[9 * column + k];
    d[0] += volume;
    d[1] += area - volume;
    touched[column >> 3] |= std::uint64_t{1} << ((column & 7) * 8 + k);
  }
};

/// Place of a leaf in its slab, in units of leaves.
struct LeafPlace {
  std::int32_t j, k;
  auto operator<=>(const LeafPlace&) const = default;
};

/// The leaves of a slab by place: an open-addressing hash table that remembers the last answer.
class DifferenceLeaves {
public:
  explicit DifferenceLeaves(MemoryAccount& account) : slots_(256, empty), memory_(account) {}
  DifferenceLeaf& at(LeafPlace place) {
    if (last_ != nullptr && place == last_place_)
      return *last_;
    return find(place);
  }
  /// Empties it but keeps its memory.
  void clear();
  const DifferenceLeaf& leaf(std::size_t n) const { return leaves_[n]; }
  std::vector<LeafPlace> places; ///< of leaf 0, 1, …

private:
  static constexpr std::uint32_t empty = UINT32_MAX;
  DifferenceLeaf& find(LeafPlace place);
  std::size_t slot_of(LeafPlace place) const;
  std::vector<std::uint32_t> slots_;
  std::deque<DifferenceLeaf> leaves_; ///< the first places.size() are in use
  MemoryShare memory_;
  LeafPlace last_place_{};
  DifferenceLeaf* last_ = nullptr;
};

/// How the sum of a voxel becomes its value in [0, 1].
enum class SumRule {
  fold, ///< a mean winding number: the distance to the nearest even number
  clamp ///< a fraction: rounding alone can leave [0, 1]
};

/// A mesh in index space moved by ½, its triangles sorted to the slabs (8 voxels along i) that
/// their boxes meet.
struct SlabbedMesh {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::int32_t first_slab = 0;
  std::vector<std::size_t> slab_begin; ///< per slab and one more: place in `members`
  std::vector<std::uint32_t> members;  ///< ascending in each slab
};

/// Points moved to index space and by ½. \throw Error if one would leave ±2^30
std::vector<Vec3> coverage_points(const TriangleMesh& mesh, const volume::GridTransform& transform);

/// Fills the slabs of `mesh`. Triangles whose box, widened by `margin`, meets no voxel's slab are
/// in none.
void sort_into_slabs(const Context& context, SlabbedMesh& mesh, double margin = 0);

/// Calls `fill(slab, leaves)` for each slab, in parallel, sums along k and builds the volume.
volume::Grid sum_slabs(const Context& context, const SlabbedMesh& mesh,
                       const volume::GridTransform& transform, SumRule rule, CoverageReport& report,
                       const std::function<void(std::size_t slab, DifferenceLeaves& leaves)>& fill);

} // namespace gewebe::antialiasing
