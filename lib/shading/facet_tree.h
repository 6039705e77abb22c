#pragma once
// Which of many triangles a ray meets first: a tree of boxes, four children a node and four
// triangles a leaf, so that a ray looks at four at once. The walk is compiled once per CPU level;
// every level gives the same bits, for there is no fused multiplication.

#include "base/cpu.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::shading {

struct FacetTree {
  /// Children that are there come first.
  struct alignas(64) Node {
    double low[3][4], high[3][4]; ///< by axis, then child
    std::uint32_t child[4];       ///< number of a node, or leaf_bit and that of a leaf
    std::uint32_t children;
  };
  /// A corner and the edges from it to the others, by axis, then facet; what is left over has no
  /// edges.
  struct alignas(32) Leaf {
    double corner[3][4], edge1[3][4], edge2[3][4];
  };
  static constexpr std::uint32_t leaf_bit = std::uint32_t{1} << 31;

  std::vector<Node> nodes; ///< the root first; none without facets
  std::vector<Leaf> leaves;
};

using FacetCorners = std::array<Vec3, 3>;

/// Halves at the median along the longest side of the middles' box. \pre fewer than 2^31 facets
FacetTree facet_tree(std::span<const FacetCorners> facets);

/// The distance from `from` to the first facet along a unit vector, from either side, `most` if
/// none is nearer (Möller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997).
using FirstHit = double (*)(const FacetTree& tree, const Vec3& from, const Vec3& along,
                            double most);

double first_hit_baseline(const FacetTree& tree, const Vec3& from, const Vec3& along, double most);
double first_hit_avx2(const FacetTree& tree, const Vec3& from, const Vec3& along, double most);

inline FirstHit first_hit(CpuLevel level) {
  return level == CpuLevel::baseline ? &first_hit_baseline : &first_hit_avx2;
}

/// Bytes that the tree of so many facets needs while it is made, without the facets.
double facet_tree_bytes(double facets);

} // namespace gewebe::shading
