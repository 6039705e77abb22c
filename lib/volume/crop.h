#pragma once
// The part of a volume that lies in a box of the world.

#include "base/context.h"
#include "volume/grid.h"

namespace gewebe::volume {

/// Cuts a box out of what is inside: voxels with their centre in `box` keep their value, all others
/// become outside. A voxel next to the box, beside one that is inside, gets the value with which
/// the surface between the two, interpolated linearly, lies on the box: its isosurface is the old
/// one within the box, closed by the faces of the box. These lie exactly there (to 1/1000 voxel)
/// where an axis of the lattice meets them at right angles, else within a voxel; edges of the box
/// are bevelled by less than a voxel. Leaves away from the box's faces are shared, not copied.
///
/// \throw Error if the box is empty, or the transform singular; if the background is inside at this
/// isovalue (there is no part to cut out); if context.max_memory would not do
Grid crop(const Context& context, const Grid& grid, const Box3& box, double isovalue);

} // namespace gewebe::volume
