#include "contact/contact_pairs.h"

#include "collision/pair_feature.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <type_traits>

namespace gewebe::contact {

namespace {

using collision::ClosestFeature;
using collision::DistanceType;

/// Whether the boxes of both primitives are further apart than `range` along an axis: most
/// candidates are.
template <std::size_t n>
bool are_apart(const std::array<Vec3, n>& x, std::size_t first, double range) {
  for (int axis = 0; axis < 3; ++axis) {
    double a_min = x[0][axis], a_max = a_min, b_min = x[first][axis], b_max = b_min;
    for (std::size_t k = 1; k < first; ++k) {
      a_min = x[k][axis] < a_min ? x[k][axis] : a_min;
      a_max = x[k][axis] > a_max ? x[k][axis] : a_max;
    }
    for (std::size_t k = first + 1; k < n; ++k) {
      b_min = x[k][axis] < b_min ? x[k][axis] : b_min;
      b_max = x[k][axis] > b_max ? x[k][axis] : b_max;
    }
    if (a_min - b_max > range || b_min - a_max > range)
      return true;
  }
  return false;
}

/// The pair of closest features, its vertices in an order that depends on them alone.
template <std::size_t n>
ContactPair reduced(const ClosestFeature& feature, const std::array<std::uint32_t, n>& vertices) {
  ContactPair pair;
  pair.feature = {feature.type, {0, 1, 2, 3}};
  pair.count = static_cast<std::uint8_t>(collision::vertex_count(feature.type));
  for (std::size_t k = 0; k < pair.count; ++k)
    pair.vertex[k] = vertices[feature.vertex[k]];
  for (std::size_t k = pair.count; k < 4; ++k)
    pair.feature.vertex[k] = 0;
  auto& v = pair.vertex;
  if (feature.type == DistanceType::point_point && v[0] > v[1])
    std::swap(v[0], v[1]);
  if (feature.type == DistanceType::point_line && v[1] > v[2])
    std::swap(v[1], v[2]);
  return pair;
}

/// Adds the closest feature of a point and one feature of a triangle that is within range, with a
/// weight.
template <std::size_t n>
void add_overlap(const std::array<std::uint32_t, n>& vertices, std::span<const Vec3> x,
                 double weight, double d_min, double range, std::vector<ContactPair>& pairs) {
  if (weight == 0)
    return;
  std::array<Vec3, n> y;
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[vertices[k]];
  const ClosestFeature feature = collision::closest_feature(y, 1);
  if (!(collision::squared_distance(feature, y) < range * range))
    return;
  ContactPair pair = reduced(feature, vertices);
  pair.weight = weight;
  pair.d_min = d_min;
  pairs.push_back(pair);
}

/// Adds the edges and vertices of a triangle that a point is in contact with.
void add_overlaps(const collision::CollisionSurface& surface,
                  const std::array<std::uint32_t, 4>& vertices, std::span<const Vec3> x,
                  double d_min, double range, std::vector<ContactPair>& pairs) {
  const auto& [p, a, b, c] = vertices;
  for (const std::uint32_t number : surface.triangles_of(a)) {
    const auto& triangle = surface.triangles[number];
    if (std::ranges::find(triangle, b) == triangle.end() ||
        std::ranges::find(triangle, c) == triangle.end())
      continue;
    const std::array<double, 6>& overlap = surface.overlap[number];
    for (std::size_t k = 0; k < 3; ++k) {
      add_overlap(std::array{p, triangle[k], triangle[(k + 1) % 3]}, x, overlap[k], d_min, range,
                  pairs);
      add_overlap(std::array{p, triangle[k]}, x, overlap[3 + k], d_min, range, pairs);
    }
    return;
  }
}

/// Weights below this part are rounding: they cancel.
constexpr double no_weight = 1e-9;

} // namespace

void find_active_pairs(const collision::CollisionSurface& surface,
                       const collision::Candidates& candidates, std::span<const Vec3> x,
                       double d_hat, ContactPairs& result) {
  result.d_hat = d_hat;
  std::vector<ContactPair>& pairs = result.pairs;
  pairs.clear();
  const auto look = [&](const auto& list, std::size_t first) {
    for (const auto& vertices : list) {
      constexpr std::size_t n = std::tuple_size_v<std::remove_cvref_t<decltype(vertices)>>;
      const double d_min = collision::radius_sum(surface, vertices.front(), vertices.back());
      const double range = d_min + d_hat;
      std::array<gewebe::Vec3, n> y;
      for (std::size_t k = 0; k < n; ++k)
        y[k] = x[vertices[k]];
      if (are_apart(y, first, range))
        continue;
      const ClosestFeature feature = collision::closest_feature(y, first);
      if (!(collision::squared_distance(feature, y) < range * range))
        continue;
      ContactPair pair;
      bool mollified = false;
      if constexpr (n == 4) {
        if (first == 2) {
          std::array<gewebe::Vec3, 4> rest;
          for (std::size_t k = 0; k < n; ++k)
            rest[k] = surface.rest[vertices[k]];
          const double eps_x = collision::edge_edge_mollifier_threshold(rest);
          mollified = collision::edge_edge_cross_squared(y) < eps_x;
          if (mollified) {
            pair.feature = feature;
            pair.count = 4;
            pair.vertex = vertices;
            pair.eps_x = eps_x;
          }
        }
      }
      if (!mollified)
        pair = reduced(feature, vertices);
      pair.d_min = d_min;
      pairs.push_back(pair);
      if constexpr (n == 4)
        if (first == 1 && d_min == 0 && !surface.overlap.empty())
          add_overlaps(surface, vertices, x, d_min, range, pairs);
    }
  };
  look(candidates.point_point, 1);
  look(candidates.point_edge, 1);
  look(candidates.edge_edge, 2);
  look(candidates.point_triangle, 1);

  // Equal pairs become one. Pairs of edges and of a point and a triangle come once each; they
  // differ in kind.
  const auto kind = [](const ContactPair& p) {
    return p.feature.type == DistanceType::point_plane ? 4 : p.eps_x > 0 ? 3 : p.count;
  };
  std::sort(pairs.begin(), pairs.end(), [&](const ContactPair& a, const ContactPair& b) {
    const int of_a = kind(a), of_b = kind(b);
    return of_a != of_b ? of_a < of_b : a.vertex < b.vertex;
  });
  std::size_t kept = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k)
    if (kept > 0 && kind(pairs[kept - 1]) == kind(pairs[k]) &&
        pairs[kept - 1].vertex == pairs[k].vertex)
      pairs[kept - 1].weight += pairs[k].weight;
    else
      pairs[kept++] = pairs[k];
  pairs.resize(kept);
  std::erase_if(pairs, [](const ContactPair& p) { return std::abs(p.weight) < no_weight; });
}

} // namespace gewebe::contact
