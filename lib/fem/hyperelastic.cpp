#include "fem/hyperelastic.h"

#include "base/cpu.h"
#include "fem/hyperelastic_kernel_internal.h"
#include "fem/hyperelastic_points_internal.h"
#include "fem/matrix3_internal.h"
#include "fem/modified_law_internal.h"
#include "tetrahedra/tet_mesh.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <vector>

namespace gewebe::fem {

namespace {

Eigen::Vector3d eigen(const Vec3& v) {
  return {v.x, v.y, v.z};
}

std::vector<IntegrationPoint> degree_6() {
  std::vector<IntegrationPoint> points;
  const auto corners = [&](double a, double weight) {
    for (std::size_t k = 0; k < 4; ++k) {
      points.push_back({{a, a, a, a}, 6 * weight});
      points.back().at[k] = 1 - 3 * a;
    }
  };
  corners(0.214602871259151684, 0.00665379170969464506);
  corners(0.0406739585346113397, 0.00167953517588677620);
  corners(0.322337890142275646, 0.00922619692394239843);
  const double a = 0.0636610018750175299, b = 0.269672331458315867;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      if (i != j) {
        points.push_back({{a, a, a, a}, 6 * 0.00803571428571428248});
        points.back().at[i] = b;
        points.back().at[j] = 1 - 2 * a - b;
      }
  return points;
}

} // namespace

const std::vector<IntegrationPoint>& quadratic_points() {
  static const std::vector<IntegrationPoint> all = degree_6();
  return all;
}

namespace {

/// Of J: below it a point's stress S has no bounds.
constexpr double least_sound_volume = 0.1;

std::span<const IntegrationPoint> points_of(bool quadratic) {
  static const std::vector<IntegrationPoint> one{{{0.25, 0.25, 0.25, 0.25}, 1}};
  return quadratic ? quadratic_points() : one;
}

using Gradients = std::array<Vec3, HyperelasticResponse::nodes>;

/// Of the shape functions at a point; of the bubble as the eleventh.
Gradients gradients_at(const SolidElement& e, const std::array<double, 4>& l, bool quadratic) {
  Gradients g{};
  if (!quadratic) {
    for (std::size_t a = 0; a < 4; ++a)
      g[a] = e.gradient[a];
    return g;
  }
  for (std::size_t a = 0; a < 4; ++a)
    g[a] = e.gradient[a] * (4 * l[a] - 1);
  for (std::size_t k = 0; k < 6; ++k) {
    const auto [i, j] = tetrahedra::tetrahedron_edges[k];
    g[4 + k] = e.gradient[j] * (4 * l[i]) + e.gradient[i] * (4 * l[j]);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    double others = 256;
    for (std::size_t m = 0; m < 4; ++m)
      others *= m == k ? 1 : l[m];
    g[10] += e.gradient[k] * others;
  }
  return g;
}

Vec3 product(const SolidBlock& a, const Vec3& v) {
  return {a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
          a[6] * v.x + a[7] * v.y + a[8] * v.z};
}

/// dJ/dF
SolidBlock cofactors(const SolidBlock& f) {
  return {f[4] * f[8] - f[5] * f[7], f[5] * f[6] - f[3] * f[8], f[3] * f[7] - f[4] * f[6],
          f[2] * f[7] - f[1] * f[8], f[0] * f[8] - f[2] * f[6], f[1] * f[6] - f[0] * f[7],
          f[1] * f[5] - f[2] * f[4], f[2] * f[3] - f[0] * f[5], f[0] * f[4] - f[1] * f[3]};
}

/// What is known of a point before it is summed.
struct Point {
  double weight = 0; ///< times the volume
  Gradients gradient;
  SolidBlock f, cofactor;
  NeoHookeanLaw w;
};

/// The second derivative by F, its pressure held.
SecondDerivative second_derivative(const Point& q, double d) {
  SecondDerivative m = SecondDerivative::Identity() * q.w.a;
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> f(q.f.data()), cofactor(q.cofactor.data());
  m += q.w.b * f * f.transpose() + q.w.c * cofactor * cofactor.transpose();
  add_cofactor_slope(q.f, d, m);
  return m;
}

/// The same with eigenvalues of at least `least`.
SecondDerivative positive(const SecondDerivative& m, double least) {
  SecondDerivative shifted = m;
  shifted.diagonal().array() -= least;
  if (Eigen::LLT<SecondDerivative>(shifted).info() == Eigen::Success)
    return m;
  const Eigen::SelfAdjointEigenSolver<SecondDerivative> solver(m);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(least).asDiagonal() *
         solver.eigenvectors().transpose();
}

static_assert(tangent_nodes == HyperelasticResponse::nodes);

void add_tangent(const Point& q, double d, std::size_t count, TangentSums& sums) {
  static const AddTangent add =
      best_cpu_level() == CpuLevel::baseline ? &add_tangent_baseline : &add_tangent_avx2;
  TangentPoint point{.weight = q.weight,
                     .a = q.w.a,
                     .b = q.w.b,
                     .c = q.w.c,
                     .d = d,
                     .f = q.f,
                     .cofactor = q.cofactor};
  for (std::size_t n = 0; n < count; ++n)
    for (int i = 0; i < 3; ++i)
      point.gradient[static_cast<std::size_t>(i)][n] = q.gradient[n][i];
  add(point, count, sums);
}

void add_tangent(const Point& q, const SecondDerivative& m, std::size_t count,
                 HyperelasticResponse& response) {
  for (std::size_t b = 0; b < count; ++b) {
    Eigen::Matrix<double, 9, 3> columns;
    for (int k = 0; k < 3; ++k)
      columns.col(k) = m.col(3 * k) * q.gradient[b].x + m.col(3 * k + 1) * q.gradient[b].y +
                       m.col(3 * k + 2) * q.gradient[b].z;
    for (std::size_t a = 0; a <= b; ++a)
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          response.tangent[33 * (3 * a + static_cast<std::size_t>(i)) + 3 * b +
                           static_cast<std::size_t>(k)] +=
              q.weight *
              (q.gradient[a].x * columns(3 * i, k) + q.gradient[a].y * columns(3 * i + 1, k) +
               q.gradient[a].z * columns(3 * i + 2, k));
  }
}

} // namespace

std::array<double, 4> projected_pressure(const SolidElement& element, bool quadratic,
                                         const std::array<double, 4>& moment) {
  // By the inverse of 1/20 (1 + δpq); of linear elements J itself.
  std::array<double, 4> pressure{};
  const double sum = moment[0] + moment[1] + moment[2] + moment[3];
  for (std::size_t p = 0; p < 4; ++p)
    pressure[p] = element.material.lambda * (quadratic ? 20 * (moment[p] - sum / 5) : sum);
  return pressure;
}

void hyperelastic_response(const SolidElement& element, std::span<const Vec3> u, const Vec3& bubble,
                           HyperelasticPart part, HyperelasticResponse& response,
                           const std::array<double, 4>* own) {
  const bool quadratic = u.size() == 10;
  const std::size_t count = quadratic ? 11 : 4;
  const double mu = element.material.mu;
  const std::span<const IntegrationPoint> at = points_of(quadratic);
  const model::HyperelasticLaw& law = element.law;
  const bool neo_hookean = is_neo_hookean(law) && !element.memory.acts(),
             wants_second = part >= HyperelasticPart::tangent;
  std::array<Point, 24> points;
  std::vector<LawResponse> modified(neo_hookean ? 0 : at.size());
  std::array<double, 4> moment{}; // ∫ λp J over the volume
  response.energy = 0;
  for (std::size_t n = 0; n < at.size(); ++n) {
    Point& q = points[n];
    q.weight = at[n].weight * element.volume;
    q.gradient = gradients_at(element, at[n].at, quadratic);
    q.f = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (std::size_t a = 0; a < count; ++a)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          q.f[static_cast<std::size_t>(3 * i + j)] +=
              (a < 10 && a < u.size() ? u[a] : bubble)[i] * q.gradient[a][j];
    q.cofactor = cofactors(q.f);
    const double j = q.f[0] * q.cofactor[0] + q.f[1] * q.cofactor[1] + q.f[2] * q.cofactor[2];
    if (neo_hookean) {
      double i_c = 0;
      for (const double value : q.f)
        i_c += value * value;
      q.w = neo_hookean_law(law, mu, i_c, j);
    } else {
      law_at(law, mu, q.f, q.cofactor, j, wants_second, modified[n]);
      if (element.memory.acts())
        remember(element.memory, n, mu, q.f, q.cofactor, j, wants_second, modified[n]);
      q.w.energy = modified[n].energy;
    }
    if (q.w.energy == HUGE_VAL) {
      response.energy = HUGE_VAL;
      return;
    }
    response.energy += q.weight * q.w.energy;
    for (std::size_t p = 0; p < 4; ++p)
      moment[p] += at[n].weight * at[n].at[p] * (j - 1);
  }

  response.pressure = projected_pressure(element, quadratic, moment);
  for (std::size_t p = 0; p < 4; ++p)
    response.energy += element.volume / 2 * response.pressure[p] * moment[p];
  if (part == HyperelasticPart::energy)
    return;

  response.force.fill({});
  if (part != HyperelasticPart::force)
    response.tangent.fill(0);
  TangentSums sums;
  if (part == HyperelasticPart::tangent)
    sums = {};
  const std::array<double, 4>& pressure = own != nullptr ? *own : response.pressure;
  std::array<Gradients, 4>& slope = response.volume_slope;
  if (part != HyperelasticPart::force)
    slope = {};
  for (std::size_t n = 0; n < at.size(); ++n) {
    const Point& q = points[n];
    double d = q.w.d;
    for (std::size_t p = 0; p < 4; ++p)
      d += at[n].at[p] * pressure[p];
    SolidBlock stress = neo_hookean ? SolidBlock{} : modified[n].stress;
    for (std::size_t k = 0; k < 9; ++k)
      stress[k] = neo_hookean ? q.w.a * q.f[k] + d * q.cofactor[k] : stress[k] + d * q.cofactor[k];
    for (std::size_t a = 0; a < count; ++a)
      response.force[a] -= q.weight * product(stress, q.gradient[a]);
    if (part == HyperelasticPart::force)
      continue;
    if (part == HyperelasticPart::tangent && neo_hookean) {
      add_tangent(q, d, count, sums);
    } else {
      SecondDerivative m = neo_hookean ? second_derivative(q, d) : modified[n].second;
      if (!neo_hookean)
        add_cofactor_slope(q.f, d, m);
      add_tangent(q, part == HyperelasticPart::tangent ? m : positive(m, 1e-3 * mu), count,
                  response);
    }
    for (std::size_t a = 0; a < count; ++a) {
      const Vec3 of_j = product(q.cofactor, q.gradient[a]) * at[n].weight;
      for (std::size_t p = 0; p < 4; ++p)
        slope[p][a] += at[n].at[p] * of_j;
    }
  }
  if (part == HyperelasticPart::force)
    return;
  if (part == HyperelasticPart::tangent && neo_hookean)
    for (std::size_t k = 0; k < 9; ++k)
      for (std::size_t a = 0; a < count; ++a)
        for (std::size_t b = a; b < count; ++b)
          response.tangent[33 * (3 * a + k / 3) + 3 * b + k % 3] = sums[k][a][b];

  for (std::size_t b = 0; b < count; ++b)
    for (std::size_t j = 0; j < 3; ++j) {
      std::array<double, 4> moments{}; // per displacement of b along j
      for (std::size_t p = 0; p < 4; ++p)
        moments[p] = slope[p][b][static_cast<int>(j)];
      const std::array<double, 4> of_pressure = projected_pressure(element, quadratic, moments);
      for (std::size_t a = 0; a <= b; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t p = 0; p < 4; ++p)
            response.tangent[33 * (3 * a + i) + 3 * b + j] +=
                element.volume * slope[p][a][static_cast<int>(i)] * of_pressure[p];
    }
  for (std::size_t row = 0; row < 3 * count; ++row)
    for (std::size_t column = 0; column < row; ++column)
      if (row / 3 != column / 3)
        response.tangent[33 * row + column] = response.tangent[33 * column + row];
}

namespace {

/// What the energy of an element is by its bubble w. With g the bubble's gradient F is F0 + w gᵀ,
/// and so J = J0 + w · cof F0 g: the projected part is quadratic, and W needs two products a point.
class BubbleEnergy {
public:
  BubbleEnergy(const SolidElement& element, std::span<const Vec3> u)
      : mu_(element.material.mu), law_(element.law), memory_(element.memory),
        neo_hookean_(is_neo_hookean(law_) && !memory_.acts()) {
    const std::span<const IntegrationPoint> at = points_of(true);
    std::array<double, 4> moment{};
    std::array<Eigen::Vector3d, 4> slope;
    slope.fill(Eigen::Vector3d::Zero());
    for (std::size_t n = 0; n < at.size(); ++n) {
      Part& q = parts_[n];
      const Gradients gradient = gradients_at(element, at[n].at, true);
      SolidBlock& f = q.f;
      for (std::size_t a = 0; a < 10; ++a)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j)
            f[static_cast<std::size_t>(3 * i + j)] += u[a][i] * gradient[a][j];
      const SolidBlock cofactor = cofactors(f);
      q.weight = at[n].weight * element.volume;
      q.gradient = gradient[10];
      q.square = dot(gradient[10], gradient[10]);
      q.along = eigen(product(f, gradient[10]));
      q.of_j = eigen(product(cofactor, gradient[10]));
      q.j = f[0] * cofactor[0] + f[1] * cofactor[1] + f[2] * cofactor[2];
      for (const double value : f)
        q.i_c += value * value;
      for (std::size_t p = 0; p < 4; ++p) {
        moment[p] += at[n].weight * at[n].at[p] * (q.j - 1);
        slope[p] += at[n].weight * at[n].at[p] * q.of_j;
      }
    }
    // As in hyperelastic_response: 20 (1 - 1/5) of the moments and their sum.
    const double scale = 20 * element.material.lambda * element.volume;
    const auto add = [&](double factor, double m, const Eigen::Vector3d& by) {
      constant_ += factor / 2 * m * m;
      linear_ += factor * m * by;
      square_ += factor * by * by.transpose();
    };
    for (std::size_t p = 0; p < 4; ++p)
      add(scale, moment[p], slope[p]);
    add(-scale / 5, moment[0] + moment[1] + moment[2] + moment[3],
        slope[0] + slope[1] + slope[2] + slope[3]);
  }

  double evaluate(const Eigen::Vector3d& w) {
    energy_ = constant_ + w.dot(linear_) + w.dot(square_ * w) / 2;
    gradient_ = linear_ + square_ * w;
    second_ = square_;
    for (std::size_t n = 0; n < parts_.size(); ++n)
      if (neo_hookean_)
        add_neo_hookean(parts_[n], w);
      else
        add_modified(parts_[n], n, w);
    if (!std::isfinite(energy_))
      energy_ = HUGE_VAL;
    else if (!neo_hookean_)
      make_positive();
    return energy_;
  }
  const Eigen::Vector3d& gradient() const { return gradient_; }
  const Matrix3& second() const { return second_; }

private:
  struct Part {
    double weight = 0, square = 0, j = 0, i_c = 0; ///< times the volume; |g|²; of w = 0
    Eigen::Vector3d along, of_j;                   ///< F0 g, cof F0 g
    Vec3 gradient;                                 ///< g
    SolidBlock f{1, 0, 0, 0, 1, 0, 0, 0, 1};       ///< F0
  };

  void add_neo_hookean(const Part& q, const Eigen::Vector3d& w) {
    const Eigen::Vector3d along = q.along + q.square * w;
    const NeoHookeanLaw d =
        neo_hookean_law(law_, mu_, q.i_c + w.dot(q.along + along), q.j + w.dot(q.of_j));
    energy_ += q.weight * d.energy;
    gradient_ += q.weight * (d.a * along + d.d * q.of_j);
    second_ += q.weight * (d.b * along * along.transpose() + d.c * q.of_j * q.of_j.transpose());
    second_.diagonal().array() += q.weight * q.square * (d.a + 1e-9 * mu_); // definite if flat
  }

  void add_modified(const Part& q, std::size_t n, const Eigen::Vector3d& w) {
    SolidBlock f = q.f;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        f[static_cast<std::size_t>(3 * i + j)] += w[i] * q.gradient[j];
    const SolidBlock cofactor = cofactors(f);
    const double j = q.j + w.dot(q.of_j);
    law_at(law_, mu_, f, cofactor, j, true, modified_);
    if (memory_.acts())
      remember(memory_, n, mu_, f, cofactor, j, true, modified_);
    energy_ += q.weight * modified_.energy;
    gradient_ += q.weight * eigen(product(modified_.stress, q.gradient));
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        const auto block = modified_.second.block<3, 3>(3 * i, 3 * k);
        second_(i, k) += q.weight * eigen(q.gradient).dot(block * eigen(q.gradient));
      }
  }

  /// Takes the sizes of eigenvalues, at least a thousandth of the stiffness that mu gives: steps of
  /// Newton's method along negative ones are as long as along positive ones.
  void make_positive() {
    double least = 0;
    for (const Part& q : parts_)
      least += 1e-3 * mu_ * q.weight * q.square;
    const Eigen::SelfAdjointEigenSolver<Matrix3> solver(second_);
    if (!(solver.eigenvalues()[0] >= least))
      second_ = solver.eigenvectors() *
                solver.eigenvalues().cwiseAbs().cwiseMax(least).asDiagonal() *
                solver.eigenvectors().transpose();
  }

  double mu_, constant_ = 0, energy_ = 0;
  model::HyperelasticLaw law_;
  ElementMemory memory_;
  bool neo_hookean_;
  LawResponse modified_;
  std::array<Part, 24> parts_;
  Eigen::Vector3d linear_ = Eigen::Vector3d::Zero(), gradient_;
  Matrix3 square_ = Matrix3::Zero(), second_;
};

} // namespace

Vec3 settled_bubble(const SolidElement& element, std::span<const Vec3> u, const Vec3& start) {
  BubbleEnergy bubble(element, u);
  Eigen::Vector3d w = eigen(start);
  double energy = bubble.evaluate(w);
  for (int round = 0; round < 60 && std::isfinite(energy); ++round) {
    const Eigen::Vector3d by = -bubble.second().ldlt().solve(bubble.gradient());
    const double slope = -by.dot(bubble.gradient()),
                 unsure = 1e-14 * (std::abs(energy) + element.material.mu * element.volume);
    // Of the second order in what the bubble is off by: what is left changes no force.
    if (!(slope > 1e-10 * unsure))
      break;
    double s = 1, next = bubble.evaluate(w + by);
    while (!(next <= energy - 1e-4 * s * slope + unsure) && s > 1e-6) {
      s /= 2;
      next = bubble.evaluate(w + s * by);
    }
    if (!(s > 1e-6))
      break;
    w += s * by;
    energy = next;
  }
  return {w[0], w[1], w[2]};
}

void point_states(const SolidElement& element, std::span<const Vec3> u, const Vec3& bubble,
                  std::span<HyperelasticPointState> to) {
  const bool quadratic = u.size() == 10;
  const std::span<const IntegrationPoint> at = points_of(quadratic);
  const double mu = element.material.mu;
  LawResponse law;
  for (std::size_t n = 0; n < at.size(); ++n) {
    HyperelasticPointState& q = to[n];
    q.weight = at[n].weight * element.volume;
    const Gradients gradient = gradients_at(element, at[n].at, quadratic);
    SolidBlock f{1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (std::size_t a = 0; a < (quadratic ? 11 : 4); ++a)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          f[static_cast<std::size_t>(3 * i + j)] += (a < 10 ? u[a] : bubble)[i] * gradient[a][j];
    const SolidBlock cofactor = cofactors(f);
    const double j = f[0] * cofactor[0] + f[1] * cofactor[1] + f[2] * cofactor[2];
    law_at(element.law, mu, f, cofactor, j, false, law);
    q.energy = law.energy - mu / 3 * (j - 1) * (j - 1);
    q.is_sound = j >= least_sound_volume && std::isfinite(q.energy);
    constexpr std::array<std::array<std::size_t, 2>, 6> axes{
        {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};
    // S = F⁻¹ dW_d/dF, F⁻¹ = (cof F)ᵀ / J.
    const auto s = [&](std::size_t a, std::size_t b) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k)
        sum += cofactor[3 * k + a] *
               (law.stress[3 * k + b] - 2 * mu / 3 * (j - 1) * cofactor[3 * k + b]);
      return sum / j;
    };
    for (std::size_t k = 0; k < 6; ++k) {
      const auto [a, b] = axes[k];
      q.stress[k] = q.is_sound ? (s(a, b) + s(b, a)) / 2 : 0;
      q.strain[k] = f[a] * f[b] + f[3 + a] * f[3 + b] + f[6 + a] * f[6 + b] - (a == b ? 1 : 0);
    }
  }
}

void hyperelastic_body_load(const SolidElement& element, const Vec3& force_density,
                            std::span<Vec3> force) {
  for (std::size_t a = 0; a < force.size(); ++a) {
    const double share = force.size() == 4 ? 1.0 / 4
                         : a < 4           ? -1.0 / 20
                         : a < 10          ? 1.0 / 5
                                           : 32.0 / 105;
    force[a] = force_density * (element.volume * share);
  }
}

} // namespace gewebe::fem
