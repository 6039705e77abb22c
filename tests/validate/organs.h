#pragma once
// Real organs under a load on a patch of their surface, each definition by places and not by nodes.

#include "tests/validate/checks.h"

#include "geometry/mesh.h"
#include "volume/grid.h"

#include <string>

namespace gewebe::validate {

/// Held below a plane, loaded on a patch.
struct Organ {
  TriangleMesh surface; ///< mm
  double plane = 0;     ///< z
  Vec3 patch;           ///< centre
  Vec3 direction;       ///< of the force, of length 1
};
inline constexpr double patch_radius = 6;  ///< mm
inline constexpr double patch_force = 1e5; ///< g mm/s²: 0.1 N

/// Of a file of $GEWEBE_SHARED/data in units of `unit` mm, without triangles where it is absent:
/// held below a share of its height; the patch lies where a line from the mean of its points leaves
/// it outwards, and is pressed back along it. \throw Error if it doesn't
Organ load_organ(const std::string& file, double unit, double held, const Vec3& outwards);

/// Its density on voxels of an edge, mm, as `voxelize` makes it.
volume::Grid organ_volume(const Organ& organ, double voxel);

enum class Hold {
  cut,   ///< tetrahedra are cut along the plane: all below is still
  nodes, ///< nodes below the plane
};
/// The organ as tetrahedra (as `mc-opt --tets` makes them), held below the plane. The load is a
/// traction t w(r) on the surface within the radius of the patch's centre, w = (1 - (r/R)²)², whose
/// total is the force; the figure is the mean displacement along it, mm, weighted by w too: the
/// work of the force over it.
test::SolidCase organ_case(const Organ& organ, const volume::Grid& volume, double cell,
                           unsigned grade, bool quadratic, const fem::SolidMaterial& material,
                           Hold hold = Hold::cut);

} // namespace gewebe::validate
