#pragma once
// Hyperelastic laws for tests, and their stresses by principal stretches.

#include "fem/element.h"
#include "model/hyperelastic_law.h"

#include <Eigen/Dense>

#include <array>
#include <cmath>

namespace gewebe::test {

inline constexpr model::HyperelasticLaw stable_neo_hookean{},
    neo_hookean{model::HyperelasticLaw::neo_hookean, {}};

/// In modified invariants.
inline constexpr std::array<model::HyperelasticLaw, 8> modified_laws{{
    {model::HyperelasticLaw::mooney_rivlin, {}},
    {model::HyperelasticLaw::mooney_rivlin, {0.2}},
    {model::HyperelasticLaw::yeoh, {0.1, 0.05}},
    {model::HyperelasticLaw::yeoh, {-0.04, 0.02}},
    {model::HyperelasticLaw::ogden, {7}},
    {model::HyperelasticLaw::ogden, {-3.5}},
    {model::HyperelasticLaw::ogden, {1.3}},
    {model::HyperelasticLaw::ogden, {5, -2.6, 0.4}},
}};

/// dW/ds_i of principal stretches s, W with all of the volume's energy: the isochoric part by
/// W' (s'_i), s'_i = J^(-1/3) s_i, and K/2 (J - 1)².
inline Eigen::Vector3d principal_stress(const model::HyperelasticLaw& law, const fem::Elasticity& m,
                                        const Eigen::Vector3d& s) {
  const double mu = m.mu, k = m.lambda + 2 * mu / 3, j = s.prod();
  const Eigen::Vector3d t = s / std::cbrt(j);
  Eigen::Vector3d slope; // of W' by t_i, times t_i
  const double x = t.squaredNorm() - 3;
  for (int i = 0; i < 3; ++i)
    switch (law.kind) {
    case model::HyperelasticLaw::mooney_rivlin:
      slope[i] =
          (1 - 2 * law.parameter[0]) * mu * t[i] * t[i] - 2 * law.parameter[0] * mu / (t[i] * t[i]);
      break;
    case model::HyperelasticLaw::yeoh:
      slope[i] =
          2 * t[i] * t[i] * mu * (0.5 + 2 * law.parameter[0] * x + 3 * law.parameter[1] * x * x);
      break;
    default: // Ogden's
      slope[i] =
          2 * mu * (1 - law.parameter[2]) / law.parameter[0] * std::pow(t[i], law.parameter[0]);
      if (law.parameter[2] != 0)
        slope[i] += 2 * mu * law.parameter[2] / law.parameter[1] * std::pow(t[i], law.parameter[1]);
    }
  const double mean = slope.sum() / 3;
  return ((slope.array() - mean + k * (j - 1) * j) / s.array()).matrix();
}

/// First Piola-Kirchhoff stress by the definitions of the laws. \pre det F > 0
inline Eigen::Matrix3d first_piola(const model::HyperelasticLaw& law, const fem::Elasticity& m,
                                   const Eigen::Matrix3d& f) {
  const double j = f.determinant(), i_c = f.squaredNorm();
  const Eigen::Matrix3d cofactor = j * f.inverse().transpose();
  if (law.kind == model::HyperelasticLaw::neo_hookean)
    return m.mu * (f - cofactor / j) + m.lambda * (j - 1) * cofactor;
  if (law.kind == model::HyperelasticLaw::stable_neo_hookean) {
    const double mu = 4.0 / 3 * m.mu, lambda = m.lambda + 5.0 / 6 * m.mu,
                 alpha = 1 + mu / lambda - mu / (4 * lambda);
    return mu * (1 - 1 / (i_c + 1)) * f + lambda * (j - alpha) * cofactor;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * principal_stress(law, m, svd.singularValues()).asDiagonal() *
         svd.matrixV().transpose();
}

} // namespace gewebe::test
