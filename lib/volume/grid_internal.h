#pragma once
// Implementation of Grid by an OpenVDB tree. Only volume/grid.cpp, grid_fold.cpp and
// formats/volume/volume_file.cpp include this header.

#include "base/zero_pages.h"
#include "volume/grid.h"

#include <openvdb/openvdb.h>

#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe::volume {

using FloatTree = openvdb::FloatTree;

/// Memory that holds values of a tree's leaves.
struct LeafStorage {
  std::vector<ZeroPages> pages;
  std::vector<std::shared_ptr<const void>> lenders; ///< owners of shared values
};

/// State of a Grid. Leaves can borrow their values from `storage`. Such leaves are marked
/// (transientData) and give their values back before the tree is destroyed. So no other code may
/// delete a borrowing leaf or move it to another tree; to copy it is safe.
struct Grid::Native {
  FloatTree::Ptr tree; ///< from make_tree
  std::shared_ptr<LeafStorage> storage;
  std::once_flag summary_once;
  ValueSummary summary;
  std::mutex digest_mutex;
  std::optional<std::pair<GridInfo, std::uint64_t>> digest; ///< the last one computed
};

/// An empty tree whose leaves may borrow from `storage`, which lives as long as the tree.
FloatTree::Ptr make_tree(float background, const std::shared_ptr<LeafStorage>& storage);

/// A Grid over a tree that no longer changes, from make_tree with `storage`.
Grid make_grid(GridInfo info, FloatTree::Ptr tree, std::shared_ptr<LeafStorage> storage);

using FloatLeaf = FloatTree::LeafNodeType;

/// Deletes a borrowing leaf that no tree has taken.
struct DeleteBorrowing {
  void operator()(FloatLeaf* leaf) const;
};
using BorrowingLeaf = std::unique_ptr<FloatLeaf, DeleteBorrowing>;
/// A leaf, all voxels inactive, whose values lie at `values`.
BorrowingLeaf borrowing_leaf(const openvdb::Coord& origin, float* values);
/// Gives `leaf` these values instead of those that it has.
void borrow_values(FloatLeaf& leaf, float* values);
/// A borrowing leaf forgets its values, so that it may be deleted.
void give_back(FloatLeaf& leaf);

inline Int3 to_int3(const openvdb::Coord& c) {
  return {c.x(), c.y(), c.z()};
}
inline openvdb::Coord to_coord(const Int3& i) {
  return {i[0], i[1], i[2]};
}

/// The eight words of a leaf's mask.
std::uint64_t* mask_words(FloatLeaf& leaf);
LeafView view_of(const FloatLeaf& leaf);

} // namespace gewebe::volume
