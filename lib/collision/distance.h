#pragma once
// Squared distances between points, edges and triangles, with closest features and derivatives.
//
// A pair of primitives is first reduced to the features that are closest to each other, as in Li et
// al., Incremental Potential Contact, ACM TOG 39(4), 2020. What remains is one of four types of
// distance without constraints, smooth in its vertices. All positions in mm.

#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <span>

namespace gewebe::collision {

/// Distance between two flats. Order of vertices: p q | p, l0 l1 | a0 a1, b0 b1 | p, t0 t1 t2.
enum class DistanceType : std::uint8_t { point_point, point_line, line_line, point_plane };

constexpr int vertex_count(DistanceType type) {
  return type == DistanceType::point_point ? 2 : type == DistanceType::point_line ? 3 : 4;
}

/// Closest features of a pair of primitives: `type`, and which of the pair's vertices are its
/// vertices, in the order of DistanceType. Entries beyond vertex_count(type) are 0.
struct ClosestFeature {
  DistanceType type = DistanceType::point_point;
  std::array<std::uint8_t, 4> vertex{};
  bool operator==(const ClosestFeature&) const = default;
};

/// \param x  p, e0, e1
ClosestFeature point_edge_feature(std::span<const Vec3, 3> x);
/// \param x  p, t0, t1, t2. A triangle whose height is below 1e-12 of its longest edge counts as
/// its three edges.
ClosestFeature point_triangle_feature(std::span<const Vec3, 4> x);
/// \param x  a0, a1, b0, b1. Parallel edges reduce to an end of one of them.
ClosestFeature edge_edge_feature(std::span<const Vec3, 4> x);

/// Closest points of two flats: the difference of both is the sum of weight times vertex.
struct ClosestPoints {
  std::array<double, 4> weight{}; ///< of the first flat 1 together, of the second -1
  Vec3 difference;                ///< closest point of the first minus that of the second
  double squared_distance = 0;
};

/// \param x  vertices of the type, in its order
ClosestPoints closest_points(DistanceType type, std::span<const Vec3> x);

/// Closest points of a pair whose features are known; the weights belong to the pair's vertices.
/// \param x  the pair's 2 to 4 vertices
ClosestPoints closest_points(const ClosestFeature& feature, std::span<const Vec3> x);

inline double squared_distance(const ClosestFeature& feature, std::span<const Vec3> x) {
  return closest_points(feature, x).squared_distance;
}

/// Gradient of the squared distance with respect to vertex i: 2 weight_i difference.
inline Vec3 squared_distance_gradient(const ClosestPoints& closest, int i) {
  return 2 * closest.weight[static_cast<std::size_t>(i)] * closest.difference;
}

/// Hessian of the squared distance, dense, row-major, of order 3 x.size(); rows and columns of
/// vertices that are no part of the features are 0.
/// \param hessian  at least (3 x.size())^2 numbers; the rest stays
void squared_distance_hessian(const ClosestFeature& feature, std::span<const Vec3> x,
                              std::span<double> hessian);

double point_edge_squared_distance(std::span<const Vec3, 3> x);
double point_triangle_squared_distance(std::span<const Vec3, 4> x);
double edge_edge_squared_distance(std::span<const Vec3, 4> x);

// Mollifier of nearly parallel edges (Li et al. 2020, section 6.3): m = (2 - c/eps_x) c/eps_x where
// c = |u x v|^2 < eps_x, else 1; u and v are the edges.

/// Threshold eps_x = 1e-3 |u|^2 |v|^2 of the edges at rest. \param rest  a0, a1, b0, b1
double edge_edge_mollifier_threshold(std::span<const Vec3, 4> rest);
/// |u x v|^2. \param x  a0, a1, b0, b1
double edge_edge_cross_squared(std::span<const Vec3, 4> x);
double edge_edge_mollifier(std::span<const Vec3, 4> x, double eps_x);
/// Value and gradient.
double edge_edge_mollifier_gradient(std::span<const Vec3, 4> x, double eps_x,
                                    std::span<Vec3, 4> gradient);
/// Value, gradient, and the dense row-major Hessian of order 12.
double edge_edge_mollifier_hessian(std::span<const Vec3, 4> x, double eps_x,
                                   std::span<Vec3, 4> gradient, std::span<double, 144> hessian);

} // namespace gewebe::collision
