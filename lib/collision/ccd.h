#pragma once
// Continuous collision detection: how far vertices can go along straight lines before two
// primitives come too close. Additive conservative advancement (M. Li, D. Kaufman, C. Jiang,
// Codimensional Incremental Potential Contact, ACM TOG 40(4), 2021, algorithm 1) with the motion
// bounded along the line between the closest points (B. Mirtich, 1996), so that primitives that
// slide along each other are no obstacle.

#include "geometry/vec3.h"

#include <cstddef>
#include <span>

namespace gewebe::collision {

/// Separation that a step must keep. The gap of a pair is its distance minus `d_min`.
struct Separation {
  double d_min = 0; ///< mm, of this pair
  /// At the end of the step the gap is at least this share of the gap at its start …
  double share = 0.5;
  /// … or this many mm, whichever is less. Along the way the gap stays positive.
  double most = 1e300;
  /// Distances measured for a pair; the step found until then is safe too, only shorter.
  int iterations = 100;
};

// Largest step in [0, t_max] that was found: vertices may go from x0 to x0 + step (x1 - x0). The
// step is never too long: distances are bounded from below by a separating plane, and rounding
// counts against the step. It is 0 where the primitives are no further apart than d_min at x0 (to
// rounding), or a position is not finite. \param x0, x1  vertices in the order of distance.h
double point_point_step(std::span<const Vec3, 2> x0, std::span<const Vec3, 2> x1,
                        const Separation& separation, double t_max = 1);
double point_edge_step(std::span<const Vec3, 3> x0, std::span<const Vec3, 3> x1,
                       const Separation& separation, double t_max = 1);
double point_triangle_step(std::span<const Vec3, 4> x0, std::span<const Vec3, 4> x1,
                           const Separation& separation, double t_max = 1);
double edge_edge_step(std::span<const Vec3, 4> x0, std::span<const Vec3, 4> x1,
                      const Separation& separation, double t_max = 1);

/// Bound on how much the distance of two primitives can change from x0 to x1, however their
/// vertices get there within that distance: the largest displacement of each, less the mean of all.
/// \param first  number of vertices of the first primitive
double motion_bound(std::span<const Vec3> x0, std::span<const Vec3> x1, std::size_t first);

} // namespace gewebe::collision
