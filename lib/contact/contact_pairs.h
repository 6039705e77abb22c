#pragma once
// Active contact pairs: what of the candidates is closer than d_hat, reduced to closest features,
// each once with a weight (NormalCollisions of ipc-toolkit with collision set type IPC).
//
// A point above an edge of a flat surface is near both triangles, one above a vertex near all
// around it. Their sum would push the point aside. Edges are therefore subtracted and vertices
// added, so that a surface counts once wherever the point is (Li and others, Convergent incremental
// potential contact, arXiv 2307.15908, 2023). Weights of concave edges are negative. Surfaces with
// a radius are smooth and turn little within d_hat: there each triangle counts.

#include "collision/candidates.h"
#include "collision/distance.h"
#include "collision/surface.h"
#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::contact {

/// Pair of features. Nearly parallel edges stay a pair of edges, whose barrier is mollified; all
/// others are the closest features themselves, so that `feature` lists all vertices in order.
struct ContactPair {
  collision::ClosestFeature feature; ///< in terms of `vertex`
  std::uint8_t count = 0;            ///< vertices: 2 to 4
  std::array<std::uint32_t, 4> vertex{};
  double weight = 1; ///< number of candidates that reduce to this pair, less the overlap
  double d_min = 0;  ///< sum of both radii, mm
  double eps_x = 0;  ///< threshold of the mollifier; 0: edges are not nearly parallel
};

struct ContactPairs {
  std::vector<ContactPair> pairs; ///< ascending by number and list of vertices
  double d_hat = 0;               ///< mm
};

/// Pairs closer than their d_min + d_hat at x. \param result  overwritten; keeps its memory
void find_active_pairs(const collision::CollisionSurface& surface,
                       const collision::Candidates& candidates, std::span<const Vec3> x,
                       double d_hat, ContactPairs& result);

/// Copies the positions of a pair's vertices.
inline std::span<const Vec3> positions_of(const ContactPair& pair, std::span<const Vec3> x,
                                          std::array<Vec3, 4>& copy) {
  for (std::size_t k = 0; k < pair.count; ++k)
    copy[k] = x[pair.vertex[k]];
  return std::span<const Vec3>(copy).first(pair.count);
}

} // namespace gewebe::contact
