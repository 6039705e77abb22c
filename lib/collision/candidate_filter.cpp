#include "collision/candidate_filter.h"

#include "collision/distance.h"
#include "collision/pair_feature.h"

#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>

namespace gewebe::collision {

namespace {

/// Part of the candidates that were measured, from which on the reference moves.
constexpr double many = 0.05;

template <std::size_t n>
double gap_of(const CollisionSurface& surface, std::span<const Vec3> x,
              const std::array<std::uint32_t, n>& vertices, std::size_t first) {
  std::array<Vec3, n> y;
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[vertices[k]];
  return std::sqrt(squared_distance(closest_feature(y, first), y)) -
         radius_sum(surface, vertices.front(), vertices.back());
}

} // namespace

void CandidateFilter::reset(const Candidates& candidates, std::span<const std::uint32_t> vertices,
                            std::span<const Vec3> x) {
  candidates_ = &candidates;
  vertices_ = vertices;
  gap_.assign(candidates.size(), -std::numeric_limits<double>::infinity());
  reference_.clear();
  for (const std::uint32_t v : vertices)
    reference_.push_back(x[v]);
}

const Candidates& CandidateFilter::select(const CollisionSurface& surface, std::span<const Vec3> x,
                                          double range) {
  double square = 0;
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    const Vec3 way = x[vertices_[k]] - reference_[k];
    square = dot(way, way) <= square ? square : dot(way, way); // NaN stays
  }
  const double moved = 2 * std::sqrt(square);
  near_.clear();
  measured_.clear();
  std::size_t place = 0;
  const auto look = [&](const auto& list, std::size_t first, auto& to) {
    for (const auto& vertices : list) {
      const std::size_t number = place++;
      if (gap_[number] - moved > range)
        continue;
      const double gap = gap_of(surface, x, vertices, first);
      measured_.emplace_back(number, gap);
      if (!(gap > range))
        to.push_back(vertices);
    }
  };
  look(candidates_->point_point, 1, near_.point_point);
  look(candidates_->point_edge, 1, near_.point_edge);
  look(candidates_->edge_edge, 2, near_.edge_edge);
  look(candidates_->point_triangle, 1, near_.point_triangle);
  double from_here = moved; // from the reference
  if (moved > 0 &&
      static_cast<double>(measured_.size()) > many * static_cast<double>(gap_.size())) {
    for (double& bound : gap_)
      bound -= moved;
    for (std::size_t k = 0; k < vertices_.size(); ++k)
      reference_[k] = x[vertices_[k]];
    from_here = 0;
  }
  for (const auto& [number, gap] : measured_)
    gap_[number] = gap - from_here > gap_[number] ? gap - from_here : gap_[number];
  return near_;
}

} // namespace gewebe::collision
