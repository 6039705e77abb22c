#include "collision/ccd.h"

#include "collision/distance.h"
#include "numeric/larger.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace gewebe::collision {

namespace {

// Error of a distance as a multiple of the largest coordinate.
constexpr double rounding = 128 * std::numeric_limits<double>::epsilon();
// Progress of an iteration, as a share of the whole step, that is not worth another one.
constexpr double enough = 1e-3;
// Squared sine of an angle below which edges count as parallel.
constexpr double thin = 1e-12;

double largest_coordinate(std::span<const Vec3> x) {
  double largest = 0;
  for (const Vec3& p : x)
    for (int axis = 0; axis < 3; ++axis)
      largest = numeric::larger(largest, std::abs(p[axis]));
  return largest;
}

/// Two primitives and a plane between them, on their way.
template <std::size_t n>
class Advancement {
public:
  Advancement(std::span<const Vec3, n> x0, std::span<const Vec3, n> x1, std::size_t first,
              double d_min)
      : first_(first), x0_(x0) {
    const double size = numeric::larger(largest_coordinate(x0), largest_coordinate(x1));
    offset_ = d_min + rounding * size;
    finite_ = std::isfinite(offset_);
    for (std::size_t k = 0; k < n; ++k)
      way_[k] = x1[k] - x0[k];
  }

  bool finite() const { return finite_; }

  /// Whether a plane across an axis shows that the gap is no less than `gap` until t_max.
  bool keeps_apart(double gap, double t_max) const {
    for (int axis = 0; axis < 3; ++axis) {
      double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
      for (std::size_t k = 0; k < n; ++k) {
        const std::size_t side = k < first_ ? 0 : 1;
        const double from = x0_[k][axis], to = from + t_max * way_[k][axis];
        low[side] = std::min({low[side], from, to});
        high[side] = std::max({high[side], from, to});
      }
      if (low[0] - high[1] >= gap + offset_ || low[1] - high[0] >= gap + offset_)
        return true;
    }
    return false;
  }

  /// Goes to t; the gap there is at least the result. Any plane bounds the distance from below, so
  /// that the bound holds even where the features were misjudged.
  template <class Feature>
  double go_to(double t, Feature&& closest_feature) {
    for (std::size_t k = 0; k < n; ++k)
      x_[k] = x0_[k] + t * way_[k];
    const std::span<const Vec3, n> x(x_);
    const ClosestFeature feature = closest_feature(x);
    const ClosestPoints closest = closest_points(feature, x);
    // Zero between equal points, where no plane is between them and the gap is not positive.
    const double length = std::sqrt(closest.squared_distance);
    // Towards the first primitive; the features may come in the other order.
    const double sign = feature.vertex[0] < first_ ? 1 : -1;
    const Vec3 normal = length > 0 ? closest.difference * (sign / length) : Vec3{};
    feature_ = feature;
    normal_ = normal;
    for (std::size_t k = 0; k < n; ++k) {
      height_[k] = dot(normal, x_[k] - x_[0]);
      speed_[k] = dot(normal, way_[k]);
    }
    double lower = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < first_; ++i)
      for (std::size_t j = first_; j < n; ++j)
        lower = numeric::smaller(lower, height_[i] - height_[j]);
    return lower - offset_;
  }

  /// From here on, how long planes show that the gap stays no less than `kept`: this one, or one
  /// that turns with the closest features. Deep in contact the gap is much smaller than the
  /// differences of the ways of one primitive, and a plane that stands would serve for next to
  /// nothing.
  double time_until(double kept, double longest) const {
    const double still = time_of_plane(kept);
    return still >= longest ? still : numeric::larger(still, time_of_turning_plane(kept));
  }

private:
  double time_of_plane(double kept) const {
    double time = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < first_; ++i)
      for (std::size_t j = first_; j < n; ++j) {
        const double closing = speed_[j] - speed_[i];
        const double more = height_[i] - height_[j] - offset_ - kept;
        if (!(more >= 0))
          return 0;
        if (closing > 0)
          time = numeric::smaller(time, more / closing);
      }
    return time;
  }

  /// Change of the normal over time, across it, by which the vertices of each closest feature keep
  /// equal heights.
  Vec3 turn() const {
    std::array<Vec3, 2> edge{};
    std::array<double, 2> speed{};
    std::size_t edges = 0;
    for (int side = 0; side < 2; ++side) {
      std::size_t base = n;
      for (int k = 0; k < vertex_count(feature_.type); ++k) {
        const std::size_t v = feature_.vertex[static_cast<std::size_t>(k)];
        if ((v < first_) != (side == 0))
          continue;
        if (base == n) {
          base = v;
        } else if (edges < 2) {
          edge[edges] = x_[v] - x_[base];
          speed[edges++] = speed_[base] - speed_[v];
        }
      }
    }
    if (edges == 0)
      return {};
    const double aa = dot(edge[0], edge[0]), ab = dot(edge[0], edge[1]), bb = dot(edge[1], edge[1]);
    const double det = aa * bb - ab * ab;
    if (edges == 2 && det > thin * aa * bb)
      return ((bb * speed[0] - ab * speed[1]) / det) * edge[0] +
             ((aa * speed[1] - ab * speed[0]) / det) * edge[1];
    return aa > 0 ? (speed[0] / aa) * edge[0] : Vec3{};
  }

  /// With the normal n + s m at the time s, |n| = 1, n m = 0: its length is at most 1 + s^2 m^2 /
  /// 2, so that heights remain apart while a quadratic function of s is positive.
  double time_of_turning_plane(double kept) const {
    Vec3 m = turn();
    m -= dot(normal_, m) * normal_; // across it even where the feature was misjudged
    const double square = dot(m, m), least = offset_ + kept;
    if (!(square > 0) || !std::isfinite(square))
      return 0;
    double time = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < first_; ++i)
      for (std::size_t j = first_; j < n; ++j) {
        const double more = height_[i] - height_[j] - least;
        if (!(more >= 0))
          return 0;
        const double opening = speed_[i] - speed_[j] + dot(m, x_[i] - x_[j]);
        const double bend = dot(m, way_[i] - way_[j]) - 0.5 * least * square;
        const double discriminant = opening * opening - 4 * bend * more;
        if ((bend >= 0 && opening >= 0) || (bend > 0 && discriminant < 0))
          continue;
        time = numeric::smaller(time, 2 * more / (std::sqrt(discriminant) - opening));
      }
    return time;
  }

  std::size_t first_;
  std::span<const Vec3, n> x0_;
  double offset_ = 0;
  bool finite_ = false;
  std::array<Vec3, n> way_, x_;
  ClosestFeature feature_{};
  Vec3 normal_;
  std::array<double, n> height_{}, speed_{}; ///< along the normal
};

template <std::size_t n, class Feature>
double step_of(std::span<const Vec3, n> x0, std::span<const Vec3, n> x1, std::size_t first,
               const Separation& separation, double t_max, Feature&& closest_feature) {
  Advancement<n> pair(x0, x1, first, separation.d_min);
  if (!pair.finite())
    return 0;
  if (pair.keeps_apart(separation.most, t_max))
    return t_max;
  const double gap = pair.go_to(0, closest_feature);
  if (!(gap > 0))
    return 0;
  const double kept = numeric::smaller(separation.share * gap, separation.most);
  // Newton's method from below: each plane shows how long its gap lasts.
  double t = 0;
  for (int iteration = 1;; ++iteration) {
    const double safe = pair.time_until(kept, t_max - t);
    if (t + safe >= t_max)
      return t_max;
    t += safe;
    if (iteration >= separation.iterations || safe <= enough * t)
      return t;
    pair.go_to(t, closest_feature);
  }
}

} // namespace

double point_point_step(std::span<const Vec3, 2> x0, std::span<const Vec3, 2> x1,
                        const Separation& separation, double t_max) {
  return step_of(x0, x1, 1, separation, t_max, [](std::span<const Vec3, 2>) {
    return ClosestFeature{DistanceType::point_point, {0, 1, 0, 0}};
  });
}

double point_edge_step(std::span<const Vec3, 3> x0, std::span<const Vec3, 3> x1,
                       const Separation& separation, double t_max) {
  return step_of(x0, x1, 1, separation, t_max, point_edge_feature);
}

double point_triangle_step(std::span<const Vec3, 4> x0, std::span<const Vec3, 4> x1,
                           const Separation& separation, double t_max) {
  return step_of(x0, x1, 1, separation, t_max, point_triangle_feature);
}

double edge_edge_step(std::span<const Vec3, 4> x0, std::span<const Vec3, 4> x1,
                      const Separation& separation, double t_max) {
  return step_of(x0, x1, 2, separation, t_max, edge_edge_feature);
}

double motion_bound(std::span<const Vec3> x0, std::span<const Vec3> x1, std::size_t first) {
  Vec3 mean;
  for (std::size_t k = 0; k < x0.size(); ++k)
    mean += x1[k] - x0[k];
  mean *= 1 / static_cast<double>(x0.size());
  double of_first = 0, of_second = 0;
  for (std::size_t k = 0; k < x0.size(); ++k) {
    const double way = norm(x1[k] - x0[k] - mean);
    double& most = k < first ? of_first : of_second;
    most = numeric::larger(most, way);
  }
  return of_first + of_second;
}

} // namespace gewebe::collision
