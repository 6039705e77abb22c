#pragma once
// How open surfaces are to what surrounds them: ambient occlusion.

#include "base/context.h"
#include "base/mesh.h"
#include "base/vec3.h"

#include <cstddef>
#include <span>
#include <vector>

namespace gewebe {

/// A surface that hides others and itself. Normals are one a point, of unit length or 0.
struct Occluder {
  std::span<const Vec3> points;
  std::span<const Vec3> normals;
  std::span<const Triangle> triangles;
};

/// Directions from a point, always the same ones in the frame of its normal.
constexpr std::size_t occlusion_rays = 64;
inline constexpr double occlusion_lift = 0.01;

/// For each point of each surface its openness, 0 … 1:
///   1 - mean of max(0, 1 - t / radius)
/// over `occlusion_rays` directions on the normal's side, distributed as the cosine of their angle
/// with it (Vogel's spiral on the disk, raised to the hemisphere), with t the distance to the first
/// triangle of any surface, from `occlusion_lift` of the radius above the point, so that folds of
/// slivers beside it don't count, and seen from either side (Zhukov, Iones and Kronin, An Ambient
/// Light Illumination Model, 1998, with a linear fall-off). 1 for points without triangle or
/// normal, and where the radius is 0. Cost: a tree of boxes over all triangles (median splits),
/// which rays walk from near to far. The same bytes for any number of threads. \pre the triangles'
/// corners index the points; as many normals as points   \throw Cancelled
std::vector<std::vector<float>> openness(std::span<const Occluder> surfaces, double radius,
                                         const Context& context);

/// Bytes that it needs for so many triangles.
double occlusion_bytes(double triangles);

} // namespace gewebe
