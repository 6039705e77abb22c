#pragma once
// Where a sheet passes through the skin of a solid, and what of it lies inside.

#include "cutting/skin_sheet.h"
#include "geometry/vec3.h"
#include "mesh/crossing.h"
#include "model/model.h"

#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace gewebe::cutting::skins {

inline constexpr std::uint32_t none = UINT32_MAX;

inline constexpr const char* not_closed =
    "the skin is not closed, expected one with an inside to cut";

/// An edge as one key, with its direction.
inline std::uint64_t directed(std::uint32_t from, std::uint32_t to) {
  return std::uint64_t{from} << 32 | to;
}

inline Box3 box_of(std::span<const Vec3> points, const Triangle& t) {
  Box3 box;
  for (const std::uint32_t corner : t)
    box.add(points[corner]);
  return box;
}

/// A sheet whose triangles are numbered by the region that curves enclose: 0 outside of all.
struct RegionSheet {
  TriangleMesh surface;
  std::vector<std::uint32_t> region, end;
  /// Of each region: that of the shell in it, if it lies in another one, or -1.
  std::vector<std::int32_t> material{-1};
};

/// What hangs together as skin, by how many surfaces lie round it, which is the shell of each
/// triangle: 1, or more where tissue lies in tissue. A cavity is of the shell that it is in.
std::vector<std::uint32_t> shells_of(const model::Skin& skin);

struct SkinCrossing {
  std::vector<std::uint32_t> local; ///< triangles of the skin that may meet the sheet
  std::vector<std::uint32_t> point; ///< of crossing.a: of places
  std::vector<Vec3> places;         ///< of the skin's points, some held apart, and of new ones
  mesh::SurfaceCrossing crossing;   ///< of `local` with the sheet
  /// Of the sheet's edges on the curve, in both directions: the skin's, in `places`.
  std::unordered_map<std::uint64_t, std::pair<std::uint32_t, std::uint32_t>> on_skin;
  std::vector<bool> inside;          ///< of triangles of the sheet
  std::vector<std::uint32_t> region; ///< of them
  RegionSheet refined;               ///< the sheet, split along the curve

  bool cut() const;
};

/// Crosses the triangles of one shell. No edge of the sheet inside runs between two points of a
/// front, where the sheet ends inside, but those of the front.
/// \param gap between walls that lie on each other
/// \throw Error as cut_skin
SkinCrossing cross_skin(const model::Skin& skin, std::span<const std::uint32_t> shell,
                        std::uint32_t cut, const RegionSheet& sheet, double gap);

} // namespace gewebe::cutting::skins
