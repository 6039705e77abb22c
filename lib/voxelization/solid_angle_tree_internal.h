#pragma once
// The winding number of a few triangles, by a tree whose far nodes are taken as dipoles. Internal
// to the winding rule.

#include "base/cpu.h"
#include "geometry/mesh.h"
#include "voxelization/solid_angle_kernel_internal.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::voxelization {

/// Sum of solid angles / 4 pi with a bound of its error.
struct WindingSum {
  double value = 0, error = 0;
};

/// arg(x + i y) in [0, pi] for y >= 0, by +, -, x, / alone, so that every machine has the same
/// bits; errs by less than 1e-15. 0 for x = y = 0.
double angle_of(double x, double y);

/// (Jacobson et al. 2013; the tree after Barill et al. 2018, with a bound of the error instead of
/// their ratio of distances.)
class SolidAngleTree {
public:
  /// `pieces` make up the same surface as `triangles`, up to rounding; they are for the tree.
  /// \pre the points stay as they are as long as the tree, and so do the triangles
  SolidAngleTree(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 std::span<const Triangle> pieces, CpuLevel cpu);

  /// Sum over all triangles at sample p, moved by the infinitesimals of the scan; right up to
  /// rounding. The sign of each angle is exact.
  double exact_at(const Vec3& p) const;

  /// The same by pieces. Nodes whose expansion errs by at most `tolerance` are not opened.
  WindingSum at(const Vec3& p, double tolerance) const;

  /// The cheaper of the two.
  WindingSum quick_at(const Vec3& p) const;

  /// Value at p, with an error that holds for all points within `radius` of it: infinite if the
  /// surface or its border may be as near.
  WindingSum within(const Vec3& p, double radius) const;

  /// Farther from `box()` than this the magnitude is below 1/2.
  double reach() const;
  Box3 box() const;

private:
  struct Node {
    Vec3 center, normal;        ///< normals of length area, added
    std::array<Vec3, 3> moment; ///< row i: integral of normal_i (x - center)
    double area = 0, radius = 0;
    std::uint32_t begin = 0, end = 0; ///< triangles
    std::uint32_t children = 0;       ///< the first of two; 0: a leaf
  };
  void build(std::uint32_t node);
  bool is_far(const Vec3& p, double radius) const;

  std::span<const Vec3> points_;
  std::span<const Triangle> exact_;
  std::vector<Triangle> triangles_; ///< pieces
  std::vector<Node> nodes_;
  SolidAngleKernel kernel_;
  std::vector<SolidAngleTriangles> blocks_; ///< the triangles, by eight
  std::vector<std::array<Vec3, 2>> border_; ///< edges that the triangles leave unbalanced
};

} // namespace gewebe::voxelization
