#pragma once
// The body of facet_tree_*.cpp; each of them compiles it for its instruction set.

#include "numeric/four_lanes.h"
#include "shading/facet_tree.h"

#include <cmath>
#include <cstddef>
#include <immintrin.h>

namespace gewebe::shading {
namespace {

using FourBits = long long __attribute__((vector_size(32)));

/// A bit for each lane.
inline unsigned bits_of(const FourBits& mask) {
#ifdef __AVX__
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<const __m256d&>(mask)));
#else
  return (mask[0] != 0 ? 1U : 0U) | (mask[1] != 0 ? 2U : 0U) | (mask[2] != 0 ? 4U : 0U) |
         (mask[3] != 0 ? 8U : 0U);
#endif
}

struct Ray {
  Vec3 from, along;
};

/// Query of boxes.
struct Slabs {
  numeric::Four from[3], inverse[3]; ///< by axis: four equal numbers, infinite along an axis
  std::size_t near[3], far[3]; ///< numbers from the first of the node's to the sides met first
};

inline const double* numbers_of(const FacetTree::Node& node) {
  static_assert(offsetof(FacetTree::Node, low) == 0 && offsetof(FacetTree::Node, high) == 96);
  return node.low[0];
}

/// Where the ray comes into each of the boxes, 0 from inside. \return a bit for each that it meets
/// nearer than `nearest`, with slack for rounding: a facet may lie in a side of its box
inline unsigned entries(const FacetTree::Node& node, const Slabs& slabs, double nearest,
                        numeric::Four& enter) {
  const double* const numbers = numbers_of(node);
  numeric::Four e{}, leave = numeric::Four{} + HUGE_VAL;
  for (int a = 0; a < 3; ++a) {
    const numeric::Four low =
        (numeric::four(numbers + slabs.near[a]) - slabs.from[a]) * slabs.inverse[a];
    const numeric::Four high =
        (numeric::four(numbers + slabs.far[a]) - slabs.from[a]) * slabs.inverse[a];
    e = low > e ? low : e; // not where the ray runs in a side: 0 · ∞
    leave = high < leave ? high : leave;
  }
  enter = e;
  const unsigned all = (1U << node.children) - 1;
  return bits_of((e <= leave * (1 + 1e-12)) & (e < nearest)) & all;
}

inline void minus(const Vec3& a, const double (&b)[3][4], numeric::Four (&to)[3]) {
  for (int k = 0; k < 3; ++k)
    to[k] = a[k] - numeric::four(b[k]);
}

/// The nearest of `most` and where the ray meets the facets.
inline double nearest_of(const FacetTree::Leaf& leaf, const Ray& ray, double most) {
  constexpr double slack = 1e-9; // so that no ray slips through between two facets
  const Vec3& d = ray.along;
  const numeric::Four &e1x = numeric::four(leaf.edge1[0]), &e1y = numeric::four(leaf.edge1[1]),
                      &e1z = numeric::four(leaf.edge1[2]);
  const numeric::Four &e2x = numeric::four(leaf.edge2[0]), &e2y = numeric::four(leaf.edge2[1]),
                      &e2z = numeric::four(leaf.edge2[2]);
  const numeric::Four px = d.y * e2z - d.z * e2y, py = d.z * e2x - d.x * e2z,
                      pz = d.x * e2y - d.y * e2x;
  const numeric::Four det = e1x * px + e1y * py + e1z * pz;
  numeric::Four to[3];
  minus(ray.from, leaf.corner, to);
  const numeric::Four u = (to[0] * px + to[1] * py + to[2] * pz) / det;
  const FourBits along1 = (det != 0) & (u >= -slack) & (u <= 1 + slack);
  if (bits_of(along1) == 0)
    return most;
  const numeric::Four qx = to[1] * e1z - to[2] * e1y, qy = to[2] * e1x - to[0] * e1z,
                      qz = to[0] * e1y - to[1] * e1x;
  const numeric::Four v = (d.x * qx + d.y * qy + d.z * qz) / det;
  const numeric::Four t = (e2x * qx + e2y * qy + e2z * qz) / det;
  const unsigned met =
      bits_of(along1 & (v >= -slack) & (u + v <= 1 + slack) & (t > 0) & (t < most));
  for (unsigned k = 0; k < 4; ++k)
    if ((met >> k & 1) != 0 && t[k] < most)
      most = t[k];
  return most;
}

/// What is still to be looked at, if nothing nearer is met before.
struct Later {
  double enter;
  std::uint32_t child;
};

inline double walk(const FacetTree& tree, const Ray& ray, const Slabs& slabs, double nearest) {
  const FacetTree::Node* const nodes = tree.nodes.data();
  const FacetTree::Leaf* const leaves = tree.leaves.data();
  Later later[64]; // three per level, at most 16 levels
  Later* end = later;
  std::uint32_t at = 0;
  for (;;) {
    if ((at & FacetTree::leaf_bit) == 0) {
      numeric::Four enter;
      unsigned met = entries(nodes[at], slabs, nearest, enter);
      Later* const first = end;
      for (; met != 0; met &= met - 1) { // the nearest last
        const auto k = static_cast<unsigned>(__builtin_ctz(met));
        const double key = enter[k];
        Later* to = end++;
        for (; to > first && to[-1].enter < key; --to)
          to[0] = to[-1];
        *to = {key, nodes[at].child[k]};
      }
    } else {
      nearest = nearest_of(leaves[at & ~FacetTree::leaf_bit], ray, nearest);
    }
    do {
      if (end == later)
        return nearest;
      --end;
    } while (!(end->enter < nearest));
    at = end->child;
  }
}

inline double first_hit_of(const FacetTree& tree, const Vec3& from, const Vec3& along,
                           double most) {
  if (tree.nodes.empty() || !(most > 0))
    return most;
  const Vec3 inverse{1 / along.x, 1 / along.y, 1 / along.z};
  Slabs slabs;
  for (int a = 0; a < 3; ++a) {
    slabs.from[a] = numeric::Four{} + from[a];
    slabs.inverse[a] = numeric::Four{} + inverse[a];
    const std::size_t low = 4 * static_cast<std::size_t>(a), high = low + 12;
    slabs.near[a] = inverse[a] < 0 ? high : low;
    slabs.far[a] = inverse[a] < 0 ? low : high;
  }
  return walk(tree, {from, along}, slabs, most);
}

} // namespace
} // namespace gewebe::shading
