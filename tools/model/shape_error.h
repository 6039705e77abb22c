#pragma once
// Error of a solid's answers that comes from its surface, which is not quite the one that it fills.

#include "collision/bvh.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "scene/simulation.h"
#include "tools/results/scene_estimate.h"

#include <cstddef>
#include <span>
#include <vector>

namespace gewebe::cli {

/// Energies that a body would have in addition if its boundary were the given surface, to first
/// order, 1e-9 J.
///
/// Where the boundary is free and moves outward by d, the energy σ : ε of the body changes by
/// ∫ σ : ε d dA (Hadamard; Sokolowski and Zolesio, Introduction to shape optimization, 1992). Where
/// something touches it with a force f, and the surface lies farther out by g, the force changes by
/// 1.5 g over the depth, as a ball's does (Hertz): the energy by 1.2 f g, as the depth is 5/2 of
/// the ball's work over f.
class ShapeError {
public:
  explicit ShapeError(const TriangleMesh& surface);

  /// Of each tetrahedron.
  /// \param touched  forces on nodes that something touches
  std::vector<double> energies(const ElementErrors& solid,
                               std::span<const contact::NodeVector> touched) const;

private:
  /// From a point to the nearest one of the surface.
  Vec3 way_from(const Vec3& p) const;

  const TriangleMesh& surface_;
  collision::Bvh tree_;
};

} // namespace gewebe::cli
