#include "dynamics/contact_impulses_internal.h"

#include "contact/surface_parts.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

// Based on: J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988
// (contact by velocities); M. Jean, The non-smooth contact dynamics method, 1999.

namespace gewebe {

namespace {

std::array<Vec3, 3> corners_of(const Facet& piece, std::span<const Vec3> at) {
  return {at[piece[0]], at[piece[1]], at[piece[2]]};
}

Vec3 scaled(const Vec3& v, const Vec3& by) {
  return {v.x * by.x, v.y * by.y, v.z * by.z};
}

Vec3 way_out(const PlacedInstrument& instrument, const MassPoints& points, const Facet& piece,
             const SurfacePoint& point) {
  if (point.has_normal(1e-9 * instrument.radius))
    return point.normal({});
  Vec3 wish;
  for (std::size_t c = 0; c < 3; ++c)
    wish += point.weights[c] * points.inward[piece[c]];
  return instrument.normal(point.core, wish);
}

/// Velocity of the point by an impulse on it, by axis.
Vec3 answer_of(const MassPoints& points, const Facet& piece, const SurfacePoint& point) {
  Vec3 sum;
  for (std::size_t c = 0; c < 3; ++c)
    sum += point.weights[c] * point.weights[c] * points.inverse_mass[piece[c]];
  return sum;
}

bool held(const MassPoints& points, const Facet& piece) {
  return std::ranges::all_of(piece,
                             [&](std::uint32_t i) { return points.inverse_mass[i] == Vec3{}; });
}

/// Whether the box of a piece reaches into the instrument's.
bool may_touch(const Box3& box, const std::array<Vec3, 3>& corners) {
  for (int a = 0; a < 3; ++a)
    if (std::min({corners[0][a], corners[1][a], corners[2][a]}) > box.max[a] ||
        std::max({corners[0][a], corners[1][a], corners[2][a]}) < box.min[a])
      return false;
  return true;
}

/// Calls visit(instrument, part, piece, point) for all that are nearer than the radius and
/// `margin` of it, with the places as they are then.
template <class Visit>
void for_near(const MassPoints& points, std::span<const MovingCore> cores, double margin,
              Visit&& visit) {
  for (std::uint32_t k = 0; k < cores.size(); ++k) {
    const PlacedInstrument& instrument = cores[k].placed;
    Box3 box = instrument.box();
    const double more = std::max(0.0, margin) * instrument.radius;
    box.min -= {more, more, more};
    box.max += {more, more, more};
    std::vector<char> seen(instrument.core ? points.place.size() : 0); // by the whole of a mesh
    for (const Facet& whole : points.pieces) {
      if (!may_touch(box, corners_of(whole, points.place)))
        continue;
      // A piece can't be moved out while a corner that is held is in.
      const std::optional<Facet> left = part_of(whole, [&](std::uint32_t i) {
        return points.inverse_mass[i] != Vec3{} || !(instrument.distance(points.place[i]) < 0);
      });
      if (!left || held(points, *left))
        continue;
      for_parts(instrument, *left, corners_of(*left, points.place),
                (1 + std::max(0.0, margin)) * instrument.radius,
                [&](CorePart part, const Facet& piece) {
                  if (part == CorePart::whole && std::exchange(seen[piece[0]], 1) != 0)
                    return;
                  const auto point = nearest_points(
                      instrument, part, corners_of(piece, points.place), corner_count(piece));
                  if (point && !point->behind &&
                      point->distance < (1 + margin) * instrument.radius && !held(points, piece))
                    visit(k, part, piece, *point);
                });
    }
  }
}

} // namespace

std::vector<PieceTouch> touches_of(const MassPoints& points, std::span<const MovingCore> cores,
                                   double margin) {
  std::vector<PieceTouch> all;
  for_near(
      points, cores, margin,
      [&](std::uint32_t k, CorePart part, const Facet& piece, const SurfacePoint& point) {
        all.push_back({k, part, piece, point, way_out(cores[k].placed, points, piece, point), {}});
      });
  return all;
}

void locate(const MassPoints& points, std::span<const MovingCore> cores, PieceTouch& touch) {
  const PlacedInstrument& instrument = cores[touch.instrument].placed;
  const auto point = nearest_points(instrument, touch.part, corners_of(touch.piece, points.place),
                                    corner_count(touch.piece));
  if (!point)
    return;
  touch.point = *point;
  touch.normal = way_out(instrument, points, touch.piece, *point);
}

bool move_out(MassPoints& points, std::span<const MovingCore> cores, double depth, int sweeps) {
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    bool clear = true;
    for_near(points, cores, -depth,
             [&](std::uint32_t k, CorePart, const Facet& piece, const SurfacePoint& point) {
               const PlacedInstrument& instrument = cores[k].placed;
               const Vec3 n = way_out(instrument, points, piece, point);
               const double answer = dot(n, scaled(n, answer_of(points, piece, point)));
               const double largest =
                   std::max({points.inverse_mass[piece[0]].x, points.inverse_mass[piece[1]].x,
                             points.inverse_mass[piece[2]].x});
               if (!(answer > 1e-6 * largest)) // held along n
                 return;
               clear = false;
               const double by = (instrument.radius - point.distance) / answer;
               for (std::size_t c = 0; c < 3; ++c)
                 if (point.weights[c] > 0)
                   points.place[piece[c]] +=
                       by * point.weights[c] * scaled(n, points.inverse_mass[piece[c]]);
             });
    if (clear)
      return true;
  }
  return false;
}

namespace {

constexpr int max_rounds = 30;

/// \param gave what each instrument's velocity is beside its way's
void sweep_impulses(MassPoints& points, std::span<const MovingCore> cores,
                    std::span<const Vec3> gave, std::span<PieceTouch> touches, double exact,
                    int sweeps) {
  std::vector<Vec3> own;       // velocity of the instrument there
  std::vector<double> allowed; // by which a point that was outside may come in
  for (const PieceTouch& t : touches) {
    const MovingCore& core = cores[t.instrument];
    // Its way as it was foreseen is what the gap is told by.
    const Vec3 way = core.step > 0
                         ? (t.point.place - carried(core.to, core.from, t.point.place)) / core.step
                         : Vec3{};
    const double gap = t.point.distance - core.placed.radius; // of where the step begins
    own.push_back(way + gave[t.instrument]);
    allowed.push_back(core.step > 0 ? std::max(0.0, gap / core.step + dot(way, t.normal)) : 0);
  }
  for (const PieceTouch& t : touches)
    for (std::size_t c = 0; c < 3; ++c)
      points.velocity[t.piece[c]] +=
          t.point.weights[c] * scaled(t.impulse, points.inverse_mass[t.piece[c]]);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    double largest = 0, change = 0;
    for (std::size_t k = 0; k < touches.size(); ++k) {
      PieceTouch& t = touches[k];
      const Vec3 &n = t.normal, answer = answer_of(points, t.piece, t.point);
      const double along = dot(n, scaled(n, answer));
      const double across = std::max({answer.x, answer.y, answer.z});
      if (!(along > 1e-6 * across))
        continue;
      const auto velocity = [&] {
        Vec3 v = -own[k];
        for (std::size_t c = 0; c < 3; ++c)
          v += t.point.weights[c] * points.velocity[t.piece[c]];
        return v;
      };
      const auto push = [&](const Vec3& by) {
        t.impulse += by;
        for (std::size_t c = 0; c < 3; ++c)
          points.velocity[t.piece[c]] +=
              t.point.weights[c] * scaled(by, points.inverse_mass[t.piece[c]]);
      };
      const Vec3 before = t.impulse;
      const double old = dot(before, n);
      const double now = old - (dot(velocity(), n) + allowed[k]) / along;
      push(now > 0 ? (now - old) * n : -t.impulse); // all of it, or a rounding is left
      const double friction = cores[t.instrument].placed.friction;
      if (friction > 0) {
        const double most = friction * dot(t.impulse, n);
        const Vec3 v = velocity(), slip = v - dot(v, n) * n;
        const Vec3 drag = t.impulse - dot(t.impulse, n) * n;
        Vec3 wanted = drag - slip / across;
        if (const double size = norm(wanted); size > most)
          wanted *= most / size;
        push(wanted - drag);
      }
      largest = std::max(largest, norm(t.impulse));
      change = std::max(change, norm(t.impulse - before));
    }
    if (!(change > exact * largest))
      return;
  }
}

} // namespace

void exchange_impulses(MassPoints& points, std::span<const MovingCore> cores,
                       std::span<PieceTouch> touches, double exact, int sweeps) {
  std::vector<Vec3> gave(cores.size());
  const bool gives = std::ranges::any_of(cores, [](const auto& c) { return c.gives > 0; });
  const std::vector<Vec3> velocity = gives ? points.velocity : std::vector<Vec3>{};
  for (int round = 0;; ++round) {
    sweep_impulses(points, cores, gave, touches, exact, sweeps);
    if (!gives || round == max_rounds)
      return;
    bool met = true;
    for (std::uint32_t k = 0; k < cores.size(); ++k) {
      if (!(cores[k].gives > 0))
        continue;
      Vec3 felt;
      double largest = 0;
      // What it would feel more if it were quicker, of all that it touches.
      Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
      for (const PieceTouch& t : touches) {
        if (t.instrument != k || t.impulse == Vec3{})
          continue;
        felt -= t.impulse;
        largest = std::max(largest, norm(t.impulse));
        const Eigen::Vector3d n(t.normal.x, t.normal.y, t.normal.z);
        const double own = dot(t.normal, scaled(t.normal, answer_of(points, t.piece, t.point)));
        stiffness += (cores[k].placed.friction > 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity())
                                                   : n * n.transpose()) /
                     own;
      }
      const Vec3 miss = cores[k].gives * (felt - cores[k].expected) - gave[k];
      if (norm(miss) <= exact * cores[k].gives * largest)
        continue;
      met = false;
      const Eigen::Vector3d by = (Eigen::Matrix3d::Identity() + cores[k].gives * stiffness)
                                     .ldlt()
                                     .solve(Eigen::Vector3d(miss.x, miss.y, miss.z));
      gave[k] += {by[0], by[1], by[2]};
    }
    if (met)
      return;
    points.velocity = velocity;
  }
}

} // namespace gewebe
