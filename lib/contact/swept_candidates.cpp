#include "contact/swept_candidates.h"

#include <algorithm>
#include <cstddef>

namespace gewebe::contact {

namespace {

/// Iterations of conservative advancement.
constexpr int max_advances = 1000;

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& way) {
  const double square = dot(way, way);
  const double t = square > 0 ? std::clamp(dot(p - a, way) / square, 0.0, 1.0) : 0;
  return norm(p - a - t * way);
}

} // namespace

void SweptCandidates::search(std::span<const Vec3> from, std::span<const Vec3> to, double reach,
                             std::span<const std::uint32_t> also) {
  const std::size_t count = from.size();
  broad_phase_.find(island_.surface, from, to, reach, island_.allowed, candidates_);
  ++searches_;
  from_.assign(from.begin(), from.end());
  way_.resize(count);
  for (std::size_t v = 0; v < count; ++v)
    way_[v] = to[v] - from[v];
  std::vector<std::uint8_t> used(count);
  const auto use = [&](const auto& lists) {
    for (const auto& list : lists)
      for (const std::uint32_t v : list)
        used[v] = 1;
  };
  use(candidates_.point_point);
  use(candidates_.point_edge);
  use(candidates_.edge_edge);
  use(candidates_.point_triangle);
  for (const std::uint32_t v : also)
    used[v] = 1;
  vertices_.clear();
  for (std::uint32_t v = 0; v < count; ++v)
    if (used[v] != 0)
      vertices_.push_back(v);
  filter_.reset(island_.surface, candidates_, broad_phase_.gaps(), vertices_, from_);
}

collision::Separation SweptCandidates::kept_gaps() const {
  // Surfaces that slide along each other meet new pairs at gaps that are smaller than d_hat: these
  // may come as near as the others.
  return {0, parameters_.lengths.kept_gap,
          parameters_.lengths.kept_gap * island_.activation_distance, max_advances};
}

double SweptCandidates::free_part(std::span<const Vec3> from, std::span<const Vec3> to) {
  return filter_.free_step(from, to, kept_gaps());
}

bool SweptCandidates::keep_gaps(std::span<const Vec3> from, std::span<const Vec3> to) {
  return free_part(from, to) >= 1;
}

bool SweptCandidates::are_free(std::span<const Vec3> from, std::span<const Vec3> to) {
  return filter_.free_step(from, to, {0, 0, island_.activation_distance, max_advances}) >= 1;
}

bool SweptCandidates::covers(std::uint32_t vertex, const Vec3& x, double room) const {
  const Vec3 gone = x - from_[vertex]; // most go less far than that
  return dot(gone, gone) <= room * room ||
         distance_to_segment(x, from_[vertex], way_[vertex]) <= room;
}

bool SweptCandidates::cover(std::span<const Vec3> x, double room) const {
  for (std::uint32_t v = 0; v < x.size(); ++v)
    if (!covers(v, x[v], room))
      return false;
  return true;
}

bool SweptCandidates::cover_own(std::span<const Vec3> x, double room) const {
  return std::ranges::all_of(vertices_, [&](std::uint32_t v) { return covers(v, x[v], room); });
}

} // namespace gewebe::contact
