#pragma once
// The boundary of the solid that the winding rule fills, where solids overlap or touch: the faces
// less those parts that have the inside on both sides. Internal to the voxelizer.

#include "geometry/mesh.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::antialiasing {

/// A mesh with the orientation of the winding rule (orient_surface).
struct OrientedFaces {
  static constexpr std::uint32_t none = UINT32_MAX;
  std::vector<Triangle> triangles;  ///< one per triangle of the mesh
  std::vector<std::uint32_t> patch; ///< connected by edges of two faces; `none`: no area, or twice
};

/// \param part as orient_surface takes it
OrientedFaces orient_faces(std::span<const Vec3> points, std::span<const Triangle> triangles,
                           std::span<const std::int32_t> part);

/// A point of the boundary: on `triangle`, or on the curve where it passes through `other`.
struct BoundaryPoint {
  Vec3 point;
  std::uint32_t triangle = 0, other = OrientedFaces::none;
};

/// The point of the boundary nearest to p; nothing if none is nearer than `reach`. A face belongs
/// to the boundary where one of its sides has winding number 0. Faces closer to each other than
/// 0.002 count as touching.
/// \param winding  winding number at p, not 0
/// \param near     at least all triangles nearer to p than `reach`
std::optional<BoundaryPoint> nearest_boundary(std::span<const Vec3> points,
                                              const OrientedFaces& faces, const Vec3& p,
                                              int winding, std::span<const std::uint32_t> near,
                                              double reach);

} // namespace gewebe::antialiasing
