#pragma once
// The skin of a solid, cut by a sheet that a blade has swept.
//
// The skin comes apart along the curve in which the sheet passes through it; what of the sheet lies
// inside becomes the walls of the wound, once for the tissue above and once for that below, joined
// to the skin along its rim. Where the sheet ends inside, both walls are joined: the wound's front.
// So a closed skin stays closed, each edge has two triangles, and each point one fan; its volume is
// the same, for the walls enclose none, and so is the area beside them. A surface inside another,
// as of a tumour, is cut and closed by itself: there walls lie on walls.

#include "cutting/skin_sheet.h"
#include "mesh/crossing.h" // MeetingOfNoSheets
#include "model/model.h"

#include <cstdint>
#include <vector>

namespace gewebe::cutting {

struct SkinCut {
  model::Skin skin; ///< points before keep their numbers
  /// Of each triangle: the one before in which it lies, or none of a wall.
  std::vector<std::uint32_t> triangle;
  static constexpr std::uint32_t none = UINT32_MAX;
  /// Of each point: 1 above the sheet, -1 below it, 0 on a front, or farther from the cut than
  /// `reach`.
  std::vector<std::int8_t> side;
  std::vector<bool> fresh; ///< of each point: it has no tetrahedron yet, or may need another
  /// Of each triangle, if of a wall: what curves enclose of the sheet, a number for each region.
  std::vector<std::uint32_t> region;
  /// Of each region: in a surface inside another one that of its triangles, else -1.
  std::vector<std::int32_t> material{-1};
  std::vector<Vec3> end; ///< the sheet's end with the points that the skin has there
};

/// A sheet that begins with the points of an earlier one's end goes on with its wound. Walls of an
/// earlier wound lie on each other at rest. During the cut they are held apart by 1e-6 of `cell`,
/// so new points in them have this error.
/// \param cell the size of the sheet's triangles, mm  \param reach mm
/// \pre check_model passes for the skin's model
/// \throw Error if the skin is not a surface of one inside where the sheet comes;
/// MeetingOfNoSheets (mesh/crossing.h), of some 5 in 1,000 random ways of a blade through earlier
/// wounds
SkinCut cut_skin(const model::Skin& skin, const SkinSheet& sheet, double cell, double reach);

} // namespace gewebe::cutting
