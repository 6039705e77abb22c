#pragma once
// Ambient occlusion of surfaces.

#include "base/context.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <span>
#include <vector>

namespace gewebe::shading {

/// A surface that occludes others and itself. There is one normal per point, of unit length or 0.
struct Occluder {
  std::span<const Vec3> points;
  std::span<const Vec3> normals;
  std::span<const Triangle> triangles;
};

/// Number of rays from a point. Their directions are the same for all points in the frame of the
/// normal.
constexpr std::size_t occlusion_rays = 64;
inline constexpr double occlusion_lift = 0.01;

/// For each point of each surface its openness, 0 … 1:
///   1 - mean of max(0, 1 - t / radius)
/// over `occlusion_rays` directions on the normal's side (Zhukov, Iones and Kronin, An Ambient
/// Light Illumination Model, 1998, with a linear fall-off). The density of directions is the cosine
/// of their angle with the normal (Vogel's spiral on the disk, raised to the hemisphere). t is the
/// distance to the first triangle of any surface, seen from either side. Rays start at
/// `occlusion_lift` of the radius above the point, so that folds of slivers beside it don't count.
///
/// The openness is 1 for points without triangle or normal, and if the radius is 0. Rays traverse a
/// bounding volume hierarchy over all triangles (median splits) from near to far. The result is the
/// same bytes for any number of threads.
/// \pre the triangles' corners index the points; as many normals as points   \throw Cancelled
std::vector<std::vector<float>> openness(std::span<const Occluder> surfaces, double radius,
                                         const Context& context);

/// Memory of openness() for a number of triangles, bytes.
double occlusion_bytes(double triangles);

} // namespace gewebe::shading
