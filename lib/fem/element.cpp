#include "fem/element.h"

#include "base/error.h"
#include "tetrahedra/tet_mesh.h"

#include <cmath>

namespace gewebe::fem {

namespace {

constexpr std::array<std::array<std::size_t, 3>, 3> entry{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};

void add_outer(SolidBlock& sum, const Vec3& a, const Vec3& b, double factor) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      sum[static_cast<std::size_t>(3 * i + j)] += factor * a[i] * b[j];
}

double trace(const SolidBlock& m) {
  return m[0] + m[4] + m[8];
}

SolidBlock product(const SolidBlock& a, const SolidBlock& b) {
  SolidBlock c{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  return c;
}

Vec3 product(const SolidBlock& a, const Vec3& v) {
  return {a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
          a[6] * v.x + a[7] * v.y + a[8] * v.z};
}

SolidBlock full(const linalg::SymmetricBlock& s) {
  return {s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]};
}

/// \pre positive definite
linalg::SymmetricBlock inverse(const linalg::SymmetricBlock& m) {
  const linalg::SymmetricBlock cofactor{m[3] * m[5] - m[4] * m[4], m[2] * m[4] - m[1] * m[5],
                                        m[1] * m[4] - m[2] * m[3], m[0] * m[5] - m[2] * m[2],
                                        m[1] * m[2] - m[0] * m[4], m[0] * m[3] - m[1] * m[1]};
  const double determinant = m[0] * cofactor[0] + m[1] * cofactor[1] + m[2] * cofactor[2];
  linalg::SymmetricBlock result{};
  for (std::size_t k = 0; k < 6; ++k)
    result[k] = cofactor[k] / determinant;
  return result;
}

/// The gradient of a shape function of a quadratic element at each corner, linear in between.
std::array<Vec3, 4> corner_gradients(const SolidElement& e, std::size_t a) {
  std::array<Vec3, 4> result{};
  if (a < 4) { // λ (2 λ - 1)
    for (std::size_t p = 0; p < 4; ++p)
      result[p] = e.gradient[a] * (p == a ? 3.0 : -1.0);
  } else { // 4 λi λj
    const auto [i, j] = tetrahedra::tetrahedron_edges[a - 4];
    result[i] = e.gradient[j] * 4;
    result[j] = e.gradient[i] * 4;
  }
  return result;
}

/// Its second derivatives, which are constant.
SolidBlock second_derivatives(const SolidElement& e, std::size_t a) {
  SolidBlock result{};
  if (a < 4) {
    add_outer(result, e.gradient[a], e.gradient[a], 4);
  } else {
    const auto [i, j] = tetrahedra::tetrahedron_edges[a - 4];
    add_outer(result, e.gradient[i], e.gradient[j], 4);
    add_outer(result, e.gradient[j], e.gradient[i], 4);
  }
  return result;
}

/// div(stress) where node a moves by 1 along each axis, which are the columns; times -∫b the
/// stiffness between the node and the bubble, by parts, for the bubble ends at the sides.
SolidBlock divergence_of_stress(const SolidElement& e, std::size_t a) {
  SolidBlock result = second_derivatives(e, a);
  const double diagonal = e.material.mu * trace(result);
  for (double& value : result)
    value *= e.material.mu + e.material.lambda;
  for (std::size_t k = 0; k < 9; k += 4)
    result[k] += diagonal;
  return result;
}

/// lambda ∫ ∂i Na ∂j Nb + mu ∫ (δij ∇Na·∇Nb + ∂j Na ∂i Nb) of the integrals ∫ ∂i Na ∂j Nb.
SolidBlock isotropic(const Elasticity& material, const SolidBlock& integral) {
  SolidBlock result{};
  const double diagonal = material.mu * trace(integral);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      result[3 * i + j] = material.lambda * integral[3 * i + j] +
                          material.mu * integral[3 * j + i] + (i == j ? diagonal : 0);
  return result;
}

/// (∫b) times the amplitude of the bubble: it takes what stress and load leave unbalanced.
Vec3 bubble(const SolidElement& e, std::span<const Vec3> u, const Vec3& force_density) {
  Vec3 unbalanced = force_density;
  for (std::size_t a = 0; a < 10; ++a)
    unbalanced += product(divergence_of_stress(e, a), u[a]);
  return product(full(e.bubble_flexibility), unbalanced);
}

} // namespace

Elasticity elasticity(double young, double poisson) {
  if (!(young > 0 && std::isfinite(young)))
    throw Error("Young's modulus is not a positive number");
  if (!(poisson >= 0 && poisson < 0.5))
    throw Error("Poisson's ratio is outside 0 to below 0.5");
  return {young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))};
}

SolidElement solid_element(const std::array<Vec3, 4>& corners, const Elasticity& material) {
  SolidElement e;
  e.material = material;
  const Vec3 u = corners[1] - corners[0], v = corners[2] - corners[0], w = corners[3] - corners[0];
  const double six_volumes = dot(cross(u, v), w);
  e.volume = six_volumes / 6;
  if (!(e.volume > 0 && std::isfinite(e.volume)))
    throw Error("a tetrahedron has no positive volume");
  e.gradient[1] = cross(v, w) / six_volumes;
  e.gradient[2] = cross(w, u) / six_volumes;
  e.gradient[3] = cross(u, v) / six_volumes;
  e.gradient[0] = -(e.gradient[1] + e.gradient[2] + e.gradient[3]);

  // With H = Σ ∇λ ∇λᵀ: ∫ ∇b ∇bᵀ = 4096/945 V H, and div b projected on linear functions has
  // the square 4096/2205 V H; ∫b = 32/105 V.
  SolidBlock h{};
  for (const Vec3& g : e.gradient)
    add_outer(h, g, g, 1);
  linalg::SymmetricBlock stiffness{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j)
      stiffness[entry[i][j]] = (material.mu + 3.0 / 7 * material.lambda) * h[3 * i + j] +
                               (i == j ? material.mu * trace(h) : 0);
  e.bubble_flexibility = inverse(stiffness);
  for (double& value : e.bubble_flexibility)
    value *= 3.0 / 140 * e.volume;
  return e;
}

SolidBlock linear_block(const SolidElement& element, std::size_t a, std::size_t b) {
  SolidBlock integral{};
  add_outer(integral, element.gradient[a], element.gradient[b], element.volume);
  return isotropic(element.material, integral);
}

SolidBlock plain_quadratic_block(const SolidElement& element, std::size_t a, std::size_t b) {
  // ∫ λp λq = V/20 (1 + δpq).
  const auto of_a = corner_gradients(element, a), of_b = corner_gradients(element, b);
  SolidBlock integral{};
  Vec3 sum_a, sum_b;
  for (std::size_t p = 0; p < 4; ++p) {
    add_outer(integral, of_a[p], of_b[p], element.volume / 20);
    sum_a += of_a[p];
    sum_b += of_b[p];
  }
  add_outer(integral, sum_a, sum_b, element.volume / 20);
  return isotropic(element.material, integral);
}

SolidBlock quadratic_block(const SolidElement& element, std::size_t a, std::size_t b) {
  SolidBlock result = plain_quadratic_block(element, a, b);
  const SolidBlock handed =
      product(divergence_of_stress(element, a),
              product(full(element.bubble_flexibility), divergence_of_stress(element, b)));
  for (std::size_t k = 0; k < 9; ++k)
    result[k] -= handed[k];
  return result;
}

void body_load(const SolidElement& element, const Vec3& force_density, std::span<Vec3> force) {
  if (force.size() == 4) {
    for (Vec3& f : force)
      f = force_density * (element.volume / 4);
    return;
  }
  const Vec3 w = product(full(element.bubble_flexibility), force_density);
  for (std::size_t a = 0; a < force.size(); ++a)
    force[a] = force_density * (element.volume * (a < 4 ? -1.0 / 20 : 1.0 / 5)) +
               product(divergence_of_stress(element, a), w);
}

std::array<SolidBlock, 4> displacement_gradients(const SolidElement& element,
                                                 std::span<const Vec3> u,
                                                 const Vec3& force_density) {
  std::array<SolidBlock, 4> result{};
  if (u.size() == 4) {
    for (std::size_t a = 0; a < 4; ++a)
      add_outer(result[0], u[a], element.gradient[a], 1);
    result.fill(result[0]);
    return result;
  }
  for (std::size_t a = 0; a < u.size(); ++a) {
    const auto of_a = corner_gradients(element, a);
    for (std::size_t p = 0; p < 4; ++p)
      add_outer(result[p], u[a], of_a[p], 1);
  }
  // ∫ λp ∇b = -∇λp ∫b; the inverse of V/20 (1 + δpq) takes 20/V of it, for the ∇λ sum to 0.
  const Vec3 w = bubble(element, u, force_density);
  for (std::size_t p = 0; p < 4; ++p)
    add_outer(result[p], w, element.gradient[p], -20 / element.volume);
  return result;
}

} // namespace gewebe::fem
