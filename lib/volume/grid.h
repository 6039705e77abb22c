#pragma once
// A sparse volume of float values: our narrow view of an OpenVDB float grid. Everything that
// computes on volumes goes through this header, so that OpenVDB is compiled in three units only
// (volume/grid.cpp, volume/grid_fold.cpp and formats/volume/volume_file.cpp).
//
// Voxel (i,j,k) has its centre at world T(i,j,k) and covers ±½ in index space. Values live in
// leaves of 8×8×8 voxels whose origin is a multiple of 8; offset of a voxel in its leaf: (i&7)*64 +
// (j&7)*8 + (k&7), so k runs fastest. Larger constant regions are tiles of 8³ (dim 8), 128³ or
// 4096³ voxels; all else has the background value.

#include "base/context.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gewebe::volume {

inline constexpr int leaf_dim = 8;
inline constexpr int leaf_voxels = 512;

/// Offset of voxel `ijk` in its leaf.
inline int leaf_offset(const Int3& ijk) {
  return ((ijk[0] & 7) << 6) | ((ijk[1] & 7) << 3) | (ijk[2] & 7);
}
/// Origin of the leaf that holds `ijk` (rounds down, for negative indices too).
inline Int3 leaf_origin(const Int3& ijk) {
  return {ijk[0] & ~7, ijk[1] & ~7, ijk[2] & ~7};
}

/// Affine map from index space to the world in mm: world = A·index + b, m = [A | b] by rows.
struct GridTransform {
  std::array<double, 12> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  bool operator==(const GridTransform&) const = default;
  Vec3 to_world(const Vec3& index) const;
  /// \pre determinant() != 0
  Vec3 to_index(const Vec3& world) const;
  double determinant() const;
  /// Lengths of the three columns of A: the voxel's edges.
  Vec3 voxel_size() const;
  /// Edges of equal length and at right angles, each to a relative 1e-9; axes may be rotated or
  /// mirrored.
  bool is_cubic() const;
  /// "voxel 0.5, origin (0, 0, 0)" or the full matrix where it is not axis-aligned; for messages.
  std::string describe() const;
};

/// Transform with voxel edge `size` and centres at integer multiples of it. \pre size > 0
GridTransform uniform_transform(double size);

/// Equal up to rounding: the two maps differ by less than 1e-6 voxels at every corner of `box`
/// (index space).
bool same_lattice(const GridTransform& a, const GridTransform& b, const Int3& min, const Int3& max);

/// What a volume says about itself beside its values.
struct GridInfo {
  GridTransform transform;
  float background = 0;
  double isovalue = 0.5;               ///< metadata gewebe_iso
  std::optional<double> band_isovalue; ///< metadata gewebe_band_iso: exact only near this isovalue
  bool level_set = false;              ///< signed distance: inside is value < isovalue (0)
  std::string name = "density";

  bool operator==(const GridInfo&) const = default;
};

/// Read-only view of a leaf; valid as long as its grid.
struct LeafView {
  Int3 origin{};
  const float* values = nullptr;         ///< 512 values
  const std::uint64_t* active = nullptr; ///< 8 words; bit n of word w is offset 64 w + n
};

/// A constant cube of dim³ voxels from `origin` on.
struct TileView {
  Int3 origin{};
  std::int32_t dim = 0; ///< 8, 128 or 4096
  float value = 0;
  bool active = false;
};

/// What the values of a grid have in common, those of inactive voxels included.
struct ValueSummary {
  bool finite = true;             ///< no infinity, no NaN
  float min = 0, max = 0;         ///< over leaves and tiles; background if there are none
  bool active_where_not_0 = true; ///< a voxel or tile is active exactly if its value isn't 0
  bool varied_leaves = true;      ///< no leaf's values are all equal
};

/// Writable leaf of a grid under construction.
struct LeafRef {
  Int3 origin{};
  float* values = nullptr;
  std::uint64_t* active = nullptr;
};

class GridAccessor;

/// An immutable sparse volume; copies share their content.
class Grid {
public:
  Grid(); ///< empty, default GridInfo
  const GridInfo& info() const { return info_; }

  /// All leaves, in an order that depends on the content alone.
  std::vector<LeafView> leaves() const;
  /// All tiles that are active or differ from the background, in an order that depends on the
  /// content alone.
  std::vector<TileView> tiles() const;
  /// Found at the first call, which looks at all values, and kept.
  const ValueSummary& summary(const Context& context) const;
  /// Number of active voxels, those of tiles included.
  std::uint64_t active_voxels() const;
  /// Bytes of memory that the tree holds.
  std::uint64_t memory_bytes() const;
  /// Index box of all active voxels, inclusive; false if there are none.
  bool active_box(Int3& min, Int3& max) const;
  /// XXH3 over transform, isovalues, class, background, and every leaf and tile in order. Found at
  /// the first call and kept.
  std::uint64_t digest() const;

  /// Opaque OpenVDB grid for formats/volume_file and volume/grid.
  struct Native;
  const std::shared_ptr<Native>& native() const { return native_; }
  Grid(GridInfo info, std::shared_ptr<Native> native);

private:
  friend class GridAccessor;
  GridInfo info_;
  std::shared_ptr<Native> native_;
};

/// Random access to one grid from one thread, fast for neighbouring voxels.
class GridAccessor {
public:
  explicit GridAccessor(const Grid& grid);
  ~GridAccessor();
  GridAccessor(GridAccessor&&) noexcept;

  float value(const Int3& ijk) {
    if (leaf_origin(ijk) == origin_ && values_ != nullptr)
      return values_[leaf_offset(ijk)];
    return lookup(ijk);
  }
  /// The leaf that holds `ijk` (values != nullptr), or a view with values == nullptr and in `tile`
  /// the constant of the region around it.
  LeafView leaf_at(const Int3& ijk, float& tile);

private:
  float lookup(const Int3& ijk);
  struct Cache;
  std::unique_ptr<Cache> cache_;
  Int3 origin_{1, 1, 1}; // no leaf has this origin
  const float* values_ = nullptr;
};

/// Builds a Grid: leaves are allocated here and filled by the caller, in parallel if it likes.
class GridBuilder {
public:
  explicit GridBuilder(GridInfo info);
  ~GridBuilder();
  GridBuilder(GridBuilder&&) noexcept;

  /// One new leaf per origin, all values background, all voxels inactive. References stay valid
  /// until `finish`. The leaves of one call lie together in ZeroPages, untouched if the background
  /// is 0, so few calls with many leaves each are cheap and the caller's first write is the first
  /// one. \pre origins are distinct multiples of 8 where no leaf exists yet
  std::vector<LeafRef> add_leaves(const Context& context, std::span<const Int3> origins);
  /// \pre dim is 8, 128 or 4096, origin a multiple of it, no leaf inside
  void add_tile(const TileView& tile);
  /// A tile in the place of a leaf. \pre dim is 8, add_leaves made the leaf
  void replace_leaf(const TileView& tile);
  /// A leaf with the values of another grid's, which stay where they are: this grid keeps the other
  /// one's memory alive. \pre no leaf exists there yet
  void share_leaf(const Grid& from, const LeafView& leaf);
  /// The grid. With `prune`, leaves whose values are all equal and all active or all inactive
  /// become tiles (nothing, if background and inactive), and so do larger blocks of equal
  /// tiles. Costs a look at each leaf: not needed where the caller knows that there are none.
  Grid finish(bool prune = true);

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::volume
