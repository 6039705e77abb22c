#include "contact/friction.h"

#include "collision/surface_normal.h"
#include "geometry/perpendicular.h"

#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

namespace gewebe::contact {

namespace {

using Plane = std::array<double, 2>;

Vec3 relative_displacement(const FrictionPair& pair, std::span<const Vec3> x,
                           std::span<const Vec3> x_start) {
  Vec3 relative;
  for (std::size_t k = 0; k < pair.count; ++k)
    relative += pair.weight[k] * (x[pair.vertex[k]] - x_start[pair.vertex[k]]);
  return relative;
}

/// Displacement of a pair along its tangents.
Plane slip(const FrictionPair& pair, std::span<const Vec3> x, std::span<const Vec3> x_start) {
  const Vec3 relative = relative_displacement(pair, x, x_start);
  return {dot(pair.tangent[0], relative), dot(pair.tangent[1], relative)};
}

double length(const Plane& u) {
  return std::sqrt(u[0] * u[0] + u[1] * u[1]);
}

void set_tangents(FrictionPair& pair) {
  const Vec3 across = some_perpendicular(pair.normal);
  pair.tangent[0] = across / norm(across);
  pair.tangent[1] = cross(pair.normal, pair.tangent[0]);
}

/// Weight of a surface's normal at an edge, by the angle between its triangles: 0.33 at 15
/// degrees, 0.01 at 30, 4e-5 at 45.
double weight_of(double flat) {
  for (int k = 0; k < 7; ++k)
    flat *= flat;
  return flat;
}

/// Weight of the direction of a pair's distance itself, which counts where neither surface is flat.
constexpr double pair_weight = 0.003;

/// Normal of the surfaces of a pair of vertices and edges. \pre pair.normal is the direction of its
/// distance
Vec3 normal_of_surfaces(const collision::CollisionSurface& surface, std::span<const Vec3> x,
                        const FrictionPair& pair) {
  if (pair.count - pair.first > 2) // a triangle's own
    return pair.normal;
  Vec3 sum = pair_weight * pair.normal;
  const std::size_t first = pair.first;
  for (const auto& [begin, count] :
       {std::pair{std::size_t{0}, first}, {first, pair.count - first}}) {
    const collision::SurfaceNormal n =
        collision::surface_normal(surface, x, std::span(pair.vertex).subspan(begin, count),
                                  std::span(pair.weight).subspan(begin, count), pair.normal);
    if (n.normal == Vec3{}) // a sphere or a capsule is smooth
      return pair.normal;
    sum += weight_of(n.flat) * n.normal;
  }
  return sum / norm(sum);
}

double pair_gradient(const FrictionPair& pair, std::span<const Vec3> x,
                     std::span<const Vec3> x_start, double e, std::array<Vec3, 4>& gradient) {
  const Plane u = slip(pair, x, x_start);
  const FrictionValue f = smooth_friction(length(u), e + pair.added_stick);
  const Vec3 along =
      (pair.limit * f.first_over_u) * (u[0] * pair.tangent[0] + u[1] * pair.tangent[1]);
  gradient = {};
  for (std::size_t k = 0; k < pair.count; ++k)
    gradient[k] = pair.weight[k] * along;
  return pair.limit * f.value;
}

} // namespace

void lag_friction(const collision::CollisionSurface& surface, const ContactPairs& pairs,
                  std::span<const Vec3> x, double kappa, const FrictionTable& friction,
                  std::vector<FrictionPair>& result) {
  result.clear();
  std::array<Vec3, 4> copy;
  for (const ContactPair& pair : pairs.pairs) {
    // Owners of both sides: the last vertex is always of the second one.
    const std::uint32_t a = surface.owner[pair.vertex[0]],
                        b = surface.owner[pair.vertex[pair.count - std::size_t{1}]];
    const double mu = friction.at(a, b);
    if (!(mu > 0) || pair.eps_x > 0)
      continue;
    const collision::ClosestPoints closest =
        collision::closest_points(pair.feature, positions_of(pair, x, copy));
    const double distance = std::sqrt(closest.squared_distance);
    if (!(distance > 0))
      continue;
    FrictionPair lagged;
    lagged.count = pair.count;
    lagged.first = pair.count == 4 && pair.feature.type != collision::DistanceType::point_plane
                       ? std::uint8_t{2}
                       : std::uint8_t{1};
    lagged.vertex = pair.vertex;
    lagged.weight = closest.weight;
    lagged.normal = closest.difference / distance;
    set_tangents(lagged);
    const BarrierValue value = barrier(closest.squared_distance - pair.d_min * pair.d_min,
                                       barrier_range(pairs.d_hat, pair.d_min));
    lagged.normal_force = -kappa * pair.weight * value.first * 2 * distance;
    lagged.limit = mu * lagged.normal_force;
    if (lagged.limit != 0 && std::isfinite(lagged.limit))
      result.push_back(lagged);
  }
}

void align_friction(const collision::CollisionSurface& surface, std::span<const Vec3> x,
                    std::span<const Vec3> x_start, double stick_per_approach,
                    std::span<FrictionPair> pairs) {
  for (FrictionPair& pair : pairs) {
    pair.normal = normal_of_surfaces(surface, x, pair);
    set_tangents(pair);
    pair.added_stick =
        stick_per_approach * std::abs(dot(pair.normal, relative_displacement(pair, x, x_start)));
  }
}

FrictionValue smooth_friction(double u, double e) {
  if (u >= e)
    return {u, 1 / u, -1 / (u * u * u)};
  const double part = u / e;
  // f0' / u = (2 - u/e) / e; its derivative by u is -1 / e^2
  return {u * part * (1 - part / 3) + e / 3, (2 - part) / e, u > 0 ? -1 / (e * e * u) : 0};
}

double friction_energy(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                       std::span<const Vec3> x_start, double e) {
  double energy = 0;
  for (const FrictionPair& pair : pairs)
    energy +=
        pair.limit * smooth_friction(length(slip(pair, x, x_start)), e + pair.added_stick).value;
  return energy;
}

double add_friction_gradient(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                             std::span<const Vec3> x_start, double e, std::span<Vec3> gradient) {
  double energy = 0;
  std::array<Vec3, 4> part;
  for (const FrictionPair& pair : pairs) {
    energy += pair_gradient(pair, x, x_start, e, part);
    for (std::size_t k = 0; k < pair.count; ++k)
      gradient[pair.vertex[k]] += part[k];
  }
  return energy;
}

void friction_forces(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                     std::span<const Vec3> x_start, double e,
                     std::vector<std::array<Vec3, 4>>& forces) {
  forces.resize(pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    pair_gradient(pairs[k], x, x_start, e, forces[k]);
    for (Vec3& force : forces[k])
      force = -force;
  }
}

void friction_hessian(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                      std::span<const Vec3> x_start, double e, HessianMode mode,
                      std::vector<HessianBlock>& blocks) {
  blocks.resize(pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const FrictionPair& pair = pairs[p];
    HessianBlock& block = blocks[p];
    block.count = pair.count;
    block.vertex = pair.vertex;
    // Overlap is negative: without it the Hessian is positive semidefinite.
    const double limit = mode == HessianMode::exact || pair.limit > 0 ? pair.limit : 0;
    const Plane u = slip(pair, x, x_start);
    const FrictionValue f = smooth_friction(length(u), e + pair.added_stick);
    // limit T (f0'/u 1 + second (v u^T + u v^T) / 2) T^T. With v = u its eigenvalues are f0'/u
    // across u and f0'' along it, 2/e - 2u/e^2 or 0: never negative; nor are they with v the dual
    // over f0'/u, at most as long.
    Plane v = u;
    if (mode != HessianMode::exact)
      v = {dot(pair.tangent[0], pair.dual) / f.first_over_u,
           dot(pair.tangent[1], pair.dual) / f.first_over_u};
    const std::array<double, 3> m{f.first_over_u + f.second * v[0] * u[0],
                                  f.second * (v[0] * u[1] + v[1] * u[0]) / 2,
                                  f.first_over_u + f.second * v[1] * u[1]};
    std::array<std::array<double, 3>, 3> h{};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double s = pair.tangent[0][i], t = pair.tangent[1][i];
        const double a = pair.tangent[0][j], b = pair.tangent[1][j];
        h[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] =
            limit * (m[0] * (s * a) + m[1] * (s * b + t * a) + m[2] * (t * b));
      }
    const std::size_t n = 3 * std::size_t{pair.count};
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        block.entry[i * n + j] = pair.weight[i / 3] * pair.weight[j / 3] * h[i % 3][j % 3];
  }
}

void advance_duals(std::span<FrictionPair> pairs, std::span<const Vec3> x, std::span<const Vec3> to,
                   std::span<const Vec3> x_start, double e, double part) {
  for (FrictionPair& pair : pairs) {
    const Plane u = slip(pair, x, x_start), step = slip(pair, to, x);
    const FrictionValue f = smooth_friction(length(u), e + pair.added_stick);
    const Plane dual{dot(pair.tangent[0], pair.dual), dot(pair.tangent[1], pair.dual)};
    const double along = f.second / f.first_over_u * (u[0] * step[0] + u[1] * step[1]);
    Plane next;
    for (std::size_t k = 0; k < 2; ++k) {
      const double full = f.first_over_u * (u[k] + step[k]) + along * dual[k];
      next[k] = dual[k] + part * (full - dual[k]);
    }
    if (const double size = length(next); size > 1)
      next = {next[0] / size, next[1] / size};
    pair.dual = next[0] * pair.tangent[0] + next[1] * pair.tangent[1];
  }
}

void keep_duals(std::span<const FrictionPair> before, std::span<FrictionPair> pairs) {
  std::map<std::array<std::uint32_t, 4>, Vec3> duals;
  for (const FrictionPair& pair : before)
    duals[pair.vertex] = pair.dual;
  for (FrictionPair& pair : pairs)
    if (const auto found = duals.find(pair.vertex); found != duals.end())
      pair.dual = found->second - dot(found->second, pair.normal) * pair.normal;
}

} // namespace gewebe::contact
