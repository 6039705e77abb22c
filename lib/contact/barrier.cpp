#include "contact/barrier.h"

#include "geometry/perpendicular.h"
#include "numeric/larger.h"
#include "numeric/logarithm.h"

#include <cmath>
#include <cstddef>
#include <limits>

namespace gewebe::contact {

namespace {

using collision::ClosestPoints;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// What energy, gradient and Hessian of a pair are made of.
struct Evaluated {
  std::array<Vec3, 4> copy{};
  ClosestPoints closest;
  BarrierValue b;
};

Evaluated evaluate(const ContactPair& pair, std::span<const Vec3> x, double d_hat) {
  Evaluated e;
  for (std::size_t k = 0; k < pair.count; ++k)
    e.copy[k] = x[pair.vertex[k]];
  e.closest =
      collision::closest_points(pair.feature, std::span<const Vec3>(e.copy).first(pair.count));
  e.b = barrier(e.closest.squared_distance - pair.d_min * pair.d_min,
                barrier_range(d_hat, pair.d_min));
  return e;
}

std::span<const Vec3, 4> edges(const std::array<Vec3, 4>& x) {
  return x;
}

/// Energy and gradient of one pair.
double pair_gradient(const ContactPair& pair, std::span<const Vec3> x, double d_hat, double kappa,
                     std::array<Vec3, 4>& gradient) {
  const Evaluated e = evaluate(pair, x, d_hat);
  const double scale = kappa * pair.weight;
  double m = 1;
  if (pair.eps_x > 0) {
    m = collision::edge_edge_mollifier_gradient(edges(e.copy), pair.eps_x, gradient);
    for (Vec3& g : gradient)
      g *= scale * e.b.value;
  } else {
    gradient = {};
  }
  const double slope = scale * m * e.b.first * 2;
  for (std::size_t k = 0; k < pair.count; ++k)
    gradient[k] += slope * e.closest.weight[k] * e.closest.difference;
  return scale * m * e.b.value;
}

/// Eigenvalues and eigenvectors of a symmetric matrix by cyclic Jacobi rotations (Golub & Van Loan,
/// Matrix Computations, section 8.5). \param a  n x n; its diagonal becomes the eigenvalues
/// \param v  becomes the eigenvectors, by column
using Square = std::array<std::array<double, 9>, 9>;
void diagonalize(Square& a, Square& v, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      v[i][j] = i == j ? 1 : 0;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0, all = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        all += a[i][j] * a[i][j];
        off += i == j ? 0 : a[i][j] * a[i][j];
      }
    if (!(off > 1e-32 * all))
      return;
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) {
        if (a[p][q] == 0)
          continue;
        const double tau = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (tau >= 0 ? 1 : -1) / (std::abs(tau) + std::sqrt(1 + tau * tau));
        const double c = 1 / std::sqrt(1 + t * t), s = t * c;
        const auto turn = [&](double& x, double& y) {
          const double old = x;
          x = c * old - s * y;
          y = s * old + c * y;
        };
        for (std::size_t k = 0; k < n; ++k)
          turn(a[k][p], a[k][q]);
        for (std::size_t k = 0; k < n; ++k)
          turn(a[p][k], a[q][k]);
        for (std::size_t k = 0; k < n; ++k)
          turn(v[k][p], v[k][q]);
      }
  }
}

/// Orthonormal vectors, row by row, that span what a pair's Hessian acts on.
struct Basis {
  std::array<std::array<double, 12>, 9> row{};
  std::size_t size = 0;
};

/// Relative motions of the vertices. Without a mollifier only those along the normal and, across
/// it, the one by the weights: motions across the normal whose weighted sum is 0 do not change the
/// distance to second order.
Basis basis_of(const ContactPair& pair, const ClosestPoints& closest) {
  // Rows of Helmert's matrix, orthonormal to translations: k + 1 equal entries, then a negative
  // one.
  std::array<std::array<double, 4>, 3> relative{};
  const std::size_t count = pair.count;
  for (std::size_t k = 0; k + 1 < count; ++k) {
    const double terms = static_cast<double>(k + 1), entry = 1 / std::sqrt(terms * (terms + 1));
    for (std::size_t i = 0; i <= k; ++i)
      relative[k][i] = entry;
    relative[k][k + 1] = -terms * entry;
  }
  Basis basis;
  const auto add = [&](const std::array<double, 4>& by_vertex, const Vec3& direction) {
    std::array<double, 12>& row = basis.row[basis.size++];
    for (std::size_t i = 0; i < 3 * count; ++i)
      row[i] = by_vertex[i / 3] * direction[static_cast<int>(i % 3)];
  };
  const double distance = std::sqrt(closest.squared_distance);
  if (pair.eps_x > 0 || !(distance > 0)) {
    for (std::size_t k = 0; k + 1 < count; ++k)
      for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
        add(relative[k], axis);
    return basis;
  }
  const Vec3 normal = closest.difference / distance;
  for (std::size_t k = 0; k + 1 < count; ++k)
    add(relative[k], normal);
  double square = 0;
  for (const double w : closest.weight)
    square += w * w;
  std::array<double, 4> weight = closest.weight;
  for (double& w : weight)
    w /= std::sqrt(square);
  Vec3 across = some_perpendicular(normal);
  across = across / norm(across);
  add(weight, across);
  add(weight, cross(normal, across));
  return basis;
}

/// Sets negative eigenvalues of a pair's Hessian to 0. \param h  dense, order x order
void project_to_psd(std::span<double> h, std::size_t order, const Basis& basis) {
  const std::size_t n = basis.size;
  Square a{}, v{};
  for (std::size_t i = 0; i < n; ++i) {
    std::array<double, 12> image{}; // h times the row
    for (std::size_t j = 0; j < order; ++j)
      for (std::size_t k = 0; k < order; ++k)
        image[j] += h[j * order + k] * basis.row[i][k];
    for (std::size_t j = 0; j <= i; ++j) {
      for (std::size_t k = 0; k < order; ++k)
        a[i][j] += image[k] * basis.row[j][k];
      a[j][i] = a[i][j];
    }
  }
  diagonalize(a, v, n);
  for (std::size_t e = 0; e < n; ++e) {
    if (!(a[e][e] < 0))
      continue;
    std::array<double, 12> vector{};
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < order; ++k)
        vector[k] += basis.row[i][k] * v[i][e];
    for (std::size_t i = 0; i < order; ++i)
      for (std::size_t j = 0; j < order; ++j)
        h[i * order + j] -= a[e][e] * (vector[i] * vector[j]);
  }
}

void pair_hessian(const ContactPair& pair, std::span<const Vec3> x, double d_hat, double kappa,
                  HessianMode mode, HessianBlock& block) {
  block.count = pair.count;
  block.vertex = pair.vertex;
  const Evaluated e = evaluate(pair, x, d_hat);
  const std::size_t n = 3 * std::size_t{pair.count};
  const double scale = kappa * pair.weight;
  std::array<double, 12> g{}; // of the squared distance
  for (std::size_t k = 0; k < n; ++k)
    g[k] = 2 * e.closest.weight[k / 3] * e.closest.difference[static_cast<int>(k % 3)];
  const std::span<double> h = std::span(block.entry).first(n * n);
  if (mode == HessianMode::gauss_newton) {
    // By d instead of its square: grad d = g / (2 d), d2b/dd2 = 4 d^2 b'' + 2 b'.
    const double m = pair.eps_x > 0 ? collision::edge_edge_mollifier(edges(e.copy), pair.eps_x) : 1;
    const double curvature = e.b.second + e.b.first / (2 * e.closest.squared_distance);
    const double factor = curvature > 0 && scale > 0 ? scale * m * curvature : 0;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        h[i * n + j] = factor * (g[i] * g[j]);
    return;
  }
  collision::squared_distance_hessian(pair.feature, std::span(e.copy).first(pair.count), h);
  double m = 1;
  std::array<Vec3, 4> by_m;
  std::array<double, 144> second_m{};
  if (pair.eps_x > 0)
    m = collision::edge_edge_mollifier_hessian(edges(e.copy), pair.eps_x, by_m, second_m);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      double& entry = h[i * n + j];
      entry = m * (e.b.second * (g[i] * g[j]) + e.b.first * entry);
      if (pair.eps_x > 0) {
        const double mi = by_m[i / 3][static_cast<int>(i % 3)],
                     mj = by_m[j / 3][static_cast<int>(j % 3)];
        entry += e.b.value * second_m[i * n + j] + e.b.first * (mi * g[j] + g[i] * mj);
      }
      entry *= scale;
    }
  if (mode == HessianMode::projected)
    project_to_psd(h, n, basis_of(pair, e.closest));
}

} // namespace

BarrierValue barrier(double s, double range) {
  if (!(s > 0))
    return {infinity, -infinity, infinity};
  if (s >= range)
    return {};
  const double away = s - range, log = numeric::natural_logarithm(s / range), part = away / s;
  return {-away * away * log, -away * (2 * log + part), -2 * log - part * 4 + part * part};
}

double barrier_energy(const ContactPairs& pairs, std::span<const Vec3> x, double kappa) {
  double energy = 0;
  for (const ContactPair& pair : pairs.pairs) {
    const Evaluated e = evaluate(pair, x, pairs.d_hat);
    if (e.b.value == infinity)
      return infinity;
    const double m = pair.eps_x > 0 ? collision::edge_edge_mollifier(edges(e.copy), pair.eps_x) : 1;
    energy += kappa * pair.weight * m * e.b.value;
  }
  return energy;
}

double add_barrier_gradient(const ContactPairs& pairs, std::span<const Vec3> x, double kappa,
                            std::span<Vec3> gradient) {
  double energy = 0;
  std::array<Vec3, 4> part;
  for (const ContactPair& pair : pairs.pairs) {
    energy += pair_gradient(pair, x, pairs.d_hat, kappa, part);
    for (std::size_t k = 0; k < pair.count; ++k)
      gradient[pair.vertex[k]] += part[k];
  }
  return energy;
}

void barrier_forces(const ContactPairs& pairs, std::span<const Vec3> x, double kappa,
                    std::vector<std::array<Vec3, 4>>& forces) {
  forces.resize(pairs.pairs.size());
  for (std::size_t k = 0; k < forces.size(); ++k) {
    pair_gradient(pairs.pairs[k], x, pairs.d_hat, kappa, forces[k]);
    for (Vec3& force : forces[k])
      force = -force;
  }
}

void barrier_hessian(const ContactPairs& pairs, std::span<const Vec3> x, double kappa,
                     HessianMode mode, std::vector<HessianBlock>& blocks) {
  blocks.resize(pairs.pairs.size());
  for (std::size_t k = 0; k < blocks.size(); ++k)
    pair_hessian(pairs.pairs[k], x, pairs.d_hat, kappa, mode, blocks[k]);
}

SmallestGap find_smallest_gap(const ContactPairs& pairs, std::span<const Vec3> x) {
  SmallestGap least{infinity, {}};
  for (const ContactPair& pair : pairs.pairs) {
    const Evaluated e = evaluate(pair, x, pairs.d_hat);
    const double gap = std::sqrt(e.closest.squared_distance) - pair.d_min;
    if (!std::isnan(least.gap) && !(gap >= least.gap)) // a NaN stays
      least = {gap, x[pair.vertex[pair.count - std::size_t{1}]]};
  }
  return least;
}

} // namespace gewebe::contact
