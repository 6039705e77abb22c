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

/// Sum of the largest values of both sides of a pair. \param first  vertices of its first side
template <std::size_t n>
double both_sides(const std::array<std::uint32_t, n>& vertices, std::size_t first,
                  std::span<const double> values) {
  std::array<double, 2> most{0, 0};
  for (std::size_t k = 0; k < n; ++k) {
    double& side = most[k < first ? 0 : 1];
    side = values[vertices[k]] <= side ? side : values[vertices[k]]; // NaN stays
  }
  return most[0] + most[1];
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
                                          double range, std::span<const double> steps) {
  moved_.resize(x.size());
  double any = range; // bound that serves for most pairs
  {
    double moved = 0, step = 0;
    for (std::size_t k = 0; k < vertices_.size(); ++k) {
      const std::uint32_t v = vertices_[k];
      moved_[v] = norm(x[v] - reference_[k]);
      moved = moved_[v] <= moved ? moved : moved_[v]; // NaN stays
      if (!steps.empty())
        step = steps[v] <= step ? step : steps[v];
    }
    any += 2 * (moved + step);
  }
  near_.clear();
  measured_.clear();
  const auto each = [&](const auto& act) {
    std::size_t place = 0;
    act(candidates_->point_point, 1, near_.point_point, place);
    act(candidates_->point_edge, 1, near_.point_edge, place);
    act(candidates_->edge_edge, 2, near_.edge_edge, place);
    act(candidates_->point_triangle, 1, near_.point_triangle, place);
  };
  each([&](const auto& list, std::size_t first, auto& to, std::size_t& place) {
    for (const auto& vertices : list) {
      const std::size_t number = place++;
      if (gap_[number] > any)
        continue;
      const double moved = both_sides(vertices, first, moved_);
      const double far = steps.empty() ? range : range + both_sides(vertices, first, steps);
      if (gap_[number] - moved > far)
        continue;
      const double gap = gap_of(surface, x, vertices, first);
      measured_.push_back({number, gap, moved});
      if (!(gap > far))
        to.push_back(vertices);
    }
  });
  const bool follows =
      static_cast<double>(measured_.size()) > many * static_cast<double>(gap_.size());
  if (follows) {
    each([&](const auto& list, std::size_t first, auto& /*to*/, std::size_t& place) {
      for (const auto& vertices : list)
        gap_[place++] -= both_sides(vertices, first, moved_);
    });
    for (std::size_t k = 0; k < vertices_.size(); ++k)
      reference_[k] = x[vertices_[k]];
  }
  for (const auto& [number, gap, moved] : measured_) {
    const double bound = follows ? gap : gap - moved;
    gap_[number] = bound > gap_[number] ? bound : gap_[number];
  }
  return near_;
}

} // namespace gewebe::collision
