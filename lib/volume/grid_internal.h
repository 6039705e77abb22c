#pragma once
// The OpenVDB grid behind a Grid; for volume/grid.cpp and formats/volume_file.cpp only.

#include "volume/grid.h"

#include <openvdb/openvdb.h>

namespace gewebe {

using FloatTree = openvdb::FloatTree;

struct Grid::Native {
  openvdb::FloatTree::Ptr tree;
};

/// A Grid over a tree that nobody changes any more.
Grid make_grid(GridInfo info, openvdb::FloatTree::Ptr tree);

} // namespace gewebe
