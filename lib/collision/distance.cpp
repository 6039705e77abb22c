#include "collision/distance.h"

#include <cmath>
#include <cstddef>

namespace gewebe::collision {

namespace {

// Below, height over longest edge, or sine between edges: no plane, no crossing.
constexpr double flat = 1e-12;
constexpr double parallel = 1e-15;

ClosestFeature point_point(int p, int q) {
  return {DistanceType::point_point,
          {static_cast<std::uint8_t>(p), static_cast<std::uint8_t>(q), 0, 0}};
}

ClosestFeature point_line(int p, int l0, int l1) {
  return {DistanceType::point_line,
          {static_cast<std::uint8_t>(p), static_cast<std::uint8_t>(l0),
           static_cast<std::uint8_t>(l1), 0}};
}

/// Feature of an edge that is closest to a point.
ClosestFeature point_edge(std::span<const Vec3> x, int p, int e0, int e1) {
  const auto at = [&](int k) -> const Vec3& { return x[static_cast<std::size_t>(k)]; };
  const Vec3 e = at(e1) - at(e0);
  const double along = dot(e, at(p) - at(e0)), length = dot(e, e);
  if (!(along > 0) || !(length > 0))
    return point_point(p, e0);
  if (along >= length)
    return point_point(p, e1);
  return point_line(p, e0, e1);
}

/// Parameters of the closest points a0 + s u and b0 + t v of two lines. s minimises the distance
/// after projection along v, so that its error has no first-order effect even where the lines are
/// nearly parallel. \pre v is not 0
struct LineParameters {
  double s = 0, t = 0;
  bool parallel = false;
};
LineParameters closest_on_lines(const Vec3& u, const Vec3& v, const Vec3& w) {
  const double c = dot(v, v);
  const Vec3 across = u - v * (dot(u, v) / c);
  const double a = dot(across, across);
  if (!(a > parallel * parallel * dot(u, u)))
    return {0, dot(v, w) / c, true};
  const Vec3 apart = w - v * (dot(w, v) / c);
  const double s = -dot(apart, across) / a;
  return {s, dot(v, w + s * u) / c, false};
}

ClosestPoints summed(const Vec3& difference, std::array<double, 4> weight) {
  return {weight, difference, dot(difference, difference)};
}

ClosestPoints gathered(const ClosestFeature& feature, std::span<const Vec3> x,
                       std::array<Vec3, 4>& y) {
  const std::size_t n = static_cast<std::size_t>(vertex_count(feature.type));
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[feature.vertex[k]];
  return closest_points(feature.type, std::span(y).first(n));
}

} // namespace

ClosestFeature point_edge_feature(std::span<const Vec3, 3> x) {
  return point_edge(x, 0, 1, 2);
}

ClosestFeature point_triangle_feature(std::span<const Vec3, 4> x) {
  // C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
  const Vec3 ab = x[2] - x[1], ac = x[3] - x[1], ap = x[0] - x[1];
  const Vec3 bc = x[3] - x[2], n = cross(ab, ac);
  const double longest = std::fmax(dot(ab, ab), std::fmax(dot(ac, ac), dot(bc, bc)));
  if (!(dot(n, n) > flat * flat * longest * longest)) {
    ClosestFeature best = point_edge(x, 0, 1, 2);
    double least = squared_distance(best, x);
    for (const ClosestFeature& other : {point_edge(x, 0, 2, 3), point_edge(x, 0, 3, 1)}) {
      const double d = squared_distance(other, x);
      if (d < least) {
        best = other;
        least = d;
      }
    }
    return best;
  }
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0)
    return point_point(0, 1);
  const Vec3 bp = x[0] - x[2];
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3)
    return point_point(0, 2);
  const Vec3 cp = x[0] - x[3];
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6)
    return point_point(0, 3);
  // Barycentric coordinates times |n|^2, by triple products: they keep their sign in slivers.
  if (dot(cross(ab, ap), n) <= 0 && d1 >= 0 && d3 <= 0)
    return point_line(0, 1, 2);
  if (dot(cross(ap, ac), n) <= 0 && d2 >= 0 && d6 <= 0)
    return point_line(0, 3, 1);
  if (dot(cross(bc, bp), n) <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return point_line(0, 2, 3);
  return {DistanceType::point_plane, {0, 1, 2, 3}};
}

ClosestFeature edge_edge_feature(std::span<const Vec3, 4> x) {
  const Vec3 u = x[1] - x[0], v = x[3] - x[2], w = x[0] - x[2];
  const double a = dot(u, u), c = dot(v, v);
  if (!(c > 0)) { // the second edge is a point
    const ClosestFeature f = point_edge(x, 2, 0, 1);
    return f.type == DistanceType::point_point ? point_point(f.vertex[1], 2) : f;
  }
  // 0 and 1: the ends of the edge, 2: between them
  int on_a = 0, on_b = 2;
  double t = dot(v, w) / c;
  if (a > 0) {
    const LineParameters closest = closest_on_lines(u, v, w);
    if (!closest.parallel && closest.s > 0) {
      on_a = closest.s >= 1 ? 1 : 2;
      t = on_a == 1 ? dot(v, x[1] - x[2]) / c : closest.t;
    }
  }
  if (!(t > 0) || t >= 1) {
    on_b = t >= 1 ? 1 : 0;
    const double along = dot(u, x[2 + static_cast<std::size_t>(on_b)] - x[0]);
    on_a = !(along > 0) ? 0 : along >= a ? 1 : 2;
  }
  if (on_a < 2 && on_b < 2)
    return point_point(on_a, 2 + on_b);
  if (on_a < 2)
    return point_line(on_a, 2, 3);
  if (on_b < 2)
    return point_line(2 + on_b, 0, 1);
  return {DistanceType::line_line, {0, 1, 2, 3}};
}

ClosestPoints closest_points(DistanceType type, std::span<const Vec3> x) {
  const Vec3 first = x[0] - x[1];
  switch (type) {
  case DistanceType::point_point:
    return summed(first, {1, -1, 0, 0});
  case DistanceType::point_line: {
    const Vec3 e = x[2] - x[1];
    const double length = dot(e, e), t = length > 0 ? dot(e, first) / length : 0;
    return summed(first - t * e, {1, t - 1, -t, 0});
  }
  case DistanceType::point_plane: {
    const Vec3 b = x[2] - x[1], c = x[3] - x[1], n = cross(b, c);
    const double square = dot(n, n);
    if (!(square > 0))
      return summed(first, {1, -1, 0, 0});
    const double to_b = dot(cross(first, c), n) / square, to_c = dot(cross(b, first), n) / square;
    return summed(first - to_b * b - to_c * c, {1, to_b + to_c - 1, -to_b, -to_c});
  }
  case DistanceType::line_line:
    break;
  }
  const Vec3 u = x[1] - x[0], v = x[3] - x[2], w = x[0] - x[2];
  const LineParameters closest =
      dot(v, v) > 0 ? closest_on_lines(u, v, w) : LineParameters{.parallel = true};
  const double s = closest.s, t = closest.t;
  return summed(w + s * u - t * v, {1 - s, s, t - 1, -t});
}

ClosestPoints closest_points(const ClosestFeature& feature, std::span<const Vec3> x) {
  std::array<Vec3, 4> y;
  ClosestPoints closest = gathered(feature, x, y);
  const std::array<double, 4> weight = closest.weight;
  closest.weight = {};
  for (std::size_t k = 0; k < static_cast<std::size_t>(vertex_count(feature.type)); ++k)
    closest.weight[feature.vertex[k]] = weight[k];
  return closest;
}

void squared_distance_hessian(const ClosestFeature& feature, std::span<const Vec3> x,
                              std::span<double> hessian) {
  // d^2 = min over q of |r|^2, where r = sum of weight_i(q) x_i is linear in the parameters q:
  // H = 2 (w w^T (x) 1 - sum over k, l of N_kl b_k b_l^T) with r_k = dr/dq_k, N = (r_k . r_l)^-1
  // and b_k = w (x) r_k + dw/dq_k (x) r, by implicit differentiation.
  std::array<Vec3, 4> y;
  const ClosestPoints closest = gathered(feature, x, y);
  const std::size_t count = static_cast<std::size_t>(vertex_count(feature.type));
  std::array<std::array<double, 4>, 2> slope{}; // dw/dq
  std::array<Vec3, 2> direction;                // dr/dq
  int parameters = 0;
  switch (feature.type) {
  case DistanceType::point_point:
    break;
  case DistanceType::point_line:
    slope[0] = {0, 1, -1, 0};
    direction[0] = y[1] - y[2];
    parameters = 1;
    break;
  case DistanceType::point_plane:
    slope = {{{0, 1, -1, 0}, {0, 1, 0, -1}}};
    direction = {y[1] - y[2], y[1] - y[3]};
    parameters = 2;
    break;
  case DistanceType::line_line:
    slope = {{{-1, 1, 0, 0}, {0, 0, 1, -1}}};
    direction = {y[1] - y[0], y[2] - y[3]};
    parameters = 2;
    break;
  }
  std::array<std::array<double, 2>, 2> inverse{};
  if (parameters == 1) {
    const double a = dot(direction[0], direction[0]);
    inverse[0][0] = a > 0 ? 1 / a : 0;
  } else if (parameters == 2) {
    const Vec3 n = cross(direction[0], direction[1]);
    const double determinant = dot(n, n);
    const double scale = determinant > 0 ? 1 / determinant : 0;
    inverse[0][0] = dot(direction[1], direction[1]) * scale;
    inverse[1][1] = dot(direction[0], direction[0]) * scale;
    inverse[0][1] = inverse[1][0] = -dot(direction[0], direction[1]) * scale;
  }
  std::array<std::array<double, 12>, 2> b{};
  for (std::size_t k = 0; k < static_cast<std::size_t>(parameters); ++k)
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 part = closest.weight[i] * direction[k] + slope[k][i] * closest.difference;
      for (int axis = 0; axis < 3; ++axis)
        b[k][3 * i + static_cast<std::size_t>(axis)] = part[axis];
    }
  const std::size_t order = 3 * x.size();
  for (std::size_t k = 0; k < order * order; ++k)
    hessian[k] = 0;
  for (std::size_t row = 0; row < 3 * count; ++row)
    for (std::size_t column = 0; column < 3 * count; ++column) {
      double sum =
          row % 3 == column % 3 ? closest.weight[row / 3] * closest.weight[column / 3] : 0.0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(parameters); ++k)
        for (std::size_t l = 0; l < static_cast<std::size_t>(parameters); ++l)
          sum -= inverse[k][l] * (b[k][row] * b[l][column]);
      const std::size_t to = std::size_t{3} * feature.vertex[row / 3] + row % 3,
                        across = std::size_t{3} * feature.vertex[column / 3] + column % 3;
      hessian[to * order + across] = 2 * sum;
    }
}

double point_edge_squared_distance(std::span<const Vec3, 3> x) {
  return squared_distance(point_edge_feature(x), x);
}

double point_triangle_squared_distance(std::span<const Vec3, 4> x) {
  return squared_distance(point_triangle_feature(x), x);
}

double edge_edge_squared_distance(std::span<const Vec3, 4> x) {
  return squared_distance(edge_edge_feature(x), x);
}

double edge_edge_mollifier_threshold(std::span<const Vec3, 4> rest) {
  const Vec3 u = rest[1] - rest[0], v = rest[3] - rest[2];
  return 1e-3 * dot(u, u) * dot(v, v);
}

double edge_edge_cross_squared(std::span<const Vec3, 4> x) {
  const Vec3 n = cross(x[1] - x[0], x[3] - x[2]);
  return dot(n, n);
}

double edge_edge_mollifier(std::span<const Vec3, 4> x, double eps_x) {
  const double c = edge_edge_cross_squared(x);
  return c < eps_x ? (2 - c / eps_x) * (c / eps_x) : 1;
}

double edge_edge_mollifier_gradient(std::span<const Vec3, 4> x, double eps_x,
                                    std::span<Vec3, 4> gradient) {
  const Vec3 u = x[1] - x[0], v = x[3] - x[2], n = cross(u, v);
  const double c = dot(n, n);
  if (!(c < eps_x)) {
    gradient[0] = gradient[1] = gradient[2] = gradient[3] = {};
    return 1;
  }
  const double slope = 2 / eps_x * (1 - c / eps_x);
  const Vec3 by_u = 2 * slope * cross(v, n), by_v = 2 * slope * cross(n, u);
  gradient[0] = -by_u;
  gradient[1] = by_u;
  gradient[2] = -by_v;
  gradient[3] = by_v;
  return (2 - c / eps_x) * (c / eps_x);
}

double edge_edge_mollifier_hessian(std::span<const Vec3, 4> x, double eps_x,
                                   std::span<Vec3, 4> gradient, std::span<double, 144> hessian) {
  const double value = edge_edge_mollifier_gradient(x, eps_x, gradient);
  for (double& entry : hessian)
    entry = 0;
  const Vec3 u = x[1] - x[0], v = x[3] - x[2], n = cross(u, v);
  const double c = dot(n, n);
  if (!(c < eps_x))
    return value;
  // Of c = |u|^2 |v|^2 - (u.v)^2: blocks by u and v; m'' c' c'^T + m' c''.
  const double slope = 2 / eps_x * (1 - c / eps_x), curvature = -2 / (eps_x * eps_x);
  const Vec3 by_u = 2 * cross(v, n), by_v = 2 * cross(n, u);
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const double sign = (i % 2 == j % 2) ? 1 : -1;
      const Vec3 &left = i < 2 ? by_u : by_v, &right = j < 2 ? by_u : by_v;
      for (int p = 0; p < 3; ++p)
        for (int q = 0; q < 3; ++q) {
          const double unit = p == q ? 1 : 0;
          double second = 0;
          if (i < 2 && j < 2)
            second = 2 * (vv * unit - v[p] * v[q]);
          else if (i >= 2 && j >= 2)
            second = 2 * (uu * unit - u[p] * u[q]);
          else if (i < 2)
            second = 4 * u[p] * v[q] - 2 * v[p] * u[q] - 2 * uv * unit;
          else
            second = 4 * v[p] * u[q] - 2 * u[p] * v[q] - 2 * uv * unit;
          hessian[(3 * i + static_cast<std::size_t>(p)) * 12 + 3 * j +
                  static_cast<std::size_t>(q)] =
              sign * (curvature * left[p] * right[q] + slope * second);
        }
    }
  return value;
}

} // namespace gewebe::collision
