#include "contact/fit_radii.h"

#include "collision/distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace gewebe::contact {

namespace {

/// Of d_hat: what is nearer when a step begins, stands too near, and how far it is to stand then.
constexpr double too_near = 0.002, room = 0.01;
/// Of a radius, by which it is made smaller at most.
constexpr double most = 1e-2;

template <std::size_t n>
double distance_of(std::span<const Vec3> x, const std::array<std::uint32_t, n>& vertex,
                   bool edges) {
  std::array<Vec3, n> y;
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[vertex[k]];
  if constexpr (n == 2)
    return norm(y[0] - y[1]);
  else if constexpr (n == 3)
    return std::sqrt(collision::point_edge_squared_distance(y));
  else
    return std::sqrt(edges ? collision::edge_edge_squared_distance(y)
                           : collision::point_triangle_squared_distance(y));
}

} // namespace

RadiusFit::RadiusFit(Island& island)
    : island_(island), radius_(island.surface.radius), broad_phase_(island.surface),
      allowed_(island.allowed.owners(), 0) {
  std::vector<std::uint8_t> round(allowed_.owners());
  for (std::size_t v = 0; v < radius_.size(); ++v)
    if (radius_[v] > 0)
      round[island.surface.owner[v]] = 1;
  for (std::size_t a = 0; a < round.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b)
      if ((round[a] != 0 || round[b] != 0) && island.allowed.at(a, b) != 0) {
        allowed_.set(a, b, 1);
        any_ = true;
      }
}

void RadiusFit::fit(std::span<const Vec3> x) {
  if (!any_)
    return;
  collision::CollisionSurface& surface = island_.surface;
  surface.radius = radius_;
  const double d_hat = island_.activation_distance;
  broad_phase_.find(surface, x, x, too_near * d_hat, allowed_, candidates_);
  std::vector<double> of_owner(allowed_.owners());
  for (std::size_t v = 0; v < radius_.size(); ++v)
    of_owner[surface.owner[v]] = radius_[v];
  std::vector<double> fitting = of_owner;
  const auto look = [&](const auto& list, bool edges) {
    for (const auto& pair : list) {
      const std::uint32_t a = surface.owner[pair.front()], b = surface.owner[pair.back()];
      const double gap = distance_of(x, pair, edges) - of_owner[a] - of_owner[b];
      if (gap > too_near * d_hat)
        continue;
      const double short_by = room * d_hat - gap;
      const std::uint32_t which = of_owner[a] > of_owner[b] ? a : b;
      fitting[which] = std::min(fitting[which],
                                std::max(of_owner[which] - short_by, (1 - most) * of_owner[which]));
    }
  };
  look(candidates_.point_point, false);
  look(candidates_.point_edge, false);
  look(candidates_.point_triangle, false);
  look(candidates_.edge_edge, true);
  for (std::size_t v = 0; v < radius_.size(); ++v)
    surface.radius[v] = fitting[surface.owner[v]];
}

} // namespace gewebe::contact
