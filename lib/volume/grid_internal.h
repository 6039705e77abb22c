#pragma once
// The OpenVDB grid behind a Grid; for volume/grid.cpp and formats/volume_file.cpp only.

#include "base/zero_pages.h"
#include "volume/grid.h"

#include <openvdb/openvdb.h>

#include <memory>
#include <vector>

namespace gewebe {

using FloatTree = openvdb::FloatTree;

/// Memory that leaves of a tree borrow their values from.
struct LeafStorage {
  std::vector<ZeroPages> pages;
  std::vector<std::shared_ptr<const void>> lenders; ///< whoever owns values that are shared
};

/// The tree comes from make_tree, or from OpenVDB with values of its own. Leaves that borrow their
/// values are marked (transientData) and let go of them before the tree dies, so nothing may delete
/// or steal such a leaf behind its back; copying is safe.
struct Grid::Native {
  FloatTree::Ptr tree;
  std::shared_ptr<LeafStorage> storage; ///< null: all leaves own their values
};

/// An empty tree whose leaves may borrow from `storage`, which lives as long as the tree.
FloatTree::Ptr make_tree(float background, const std::shared_ptr<LeafStorage>& storage);

/// A Grid over a tree that nobody changes any more.
Grid make_grid(GridInfo info, FloatTree::Ptr tree, std::shared_ptr<LeafStorage> storage = nullptr);

} // namespace gewebe
