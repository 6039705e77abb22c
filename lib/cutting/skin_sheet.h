#pragma once
// Sheets that blades sweep, to cut skins with.

#include "cutting/cut_select.h"
#include "geometry/mesh.h"
#include "model/model.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::cutting {

/// What a blade has swept, at rest. Above it is where its triangles appear counter-clockwise.
struct SkinSheet {
  TriangleMesh surface;
  /// Of its border, in its direction: points from the first to the last one where the blade stands
  /// now, and may go on. Two at least, or none.
  std::vector<std::uint32_t> end;
};

/// A grid in the plane, as wide as the skin is there. Above it is where the normal points. \param
/// shift of a cell, by which its lines are moved, and a millionth of it along the normal: where the
/// lines pass the skin's own edges or points within rounding, no curve is common to both surfaces
SkinSheet plane_sheet(const model::Skin& skin, const CutPlane& plane, double cell,
                      double shift = 0);

/// Between rows of points, one after the other, which need not have as many: what lies between two
/// is as far along one as along the other. Above it is where a row of points to the right that
/// moves upwards is counter-clockwise: the first, its next, the following row.
SkinSheet strip_sheet(std::span<const std::vector<Vec3>> rows);

} // namespace gewebe::cutting
