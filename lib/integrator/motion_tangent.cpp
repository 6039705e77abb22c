#include "integrator/motion_tangent_internal.h"

#include "base/parallel.h"
#include "base/unique_number.h"
#include "fem/assembly_blocks.h"
#include "fem/hyperelastic.h"
#include "fem/matrix3_internal.h"
#include "integrator/motion_quick_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace gewebe::integrator {

namespace {

// Elements from where on other threads are worth it, see parallel_blocks_if.
constexpr std::size_t worth_linear = 128, worth_quadratic = 32;

/// What the turning of the frame adds to the tangent of a corotational element: the energy aᵀ m a
/// of a = Rᵀ curl of the displacement, over twice the volume. Exact for linear elements without
/// damping. \param positive  only where it is positive
fem::Matrix3 turning(const fem::SolidElement& element, const fem::ElementFrame& frame,
                     bool positive) {
  const auto [lambda, mu] = element.material;
  const linalg::SymmetricBlock& s = frame.stretch;
  const double trace = s[0] + s[3] + s[5];
  fem::Matrix3 g;
  g << trace - s[0], -s[1], -s[2], -s[1], trace - s[3], -s[4], -s[2], -s[4], trace - s[5];
  const Eigen::SelfAdjointEigenSolver<fem::Matrix3> solver(g);
  Eigen::Vector3d value;
  for (int k = 0; k < 3; ++k) {
    const double pair = solver.eigenvalues()[k];
    const double own = mu + (lambda * (trace - 3) - 2 * mu) / pair;
    value[k] = pair > 0 && (own > 0 || !positive) ? own : 0;
  }
  return solver.eigenvectors() * value.asDiagonal() * solver.eigenvectors().transpose();
}

fem::Matrix3 cross_matrix(const Vec3& v) {
  fem::Matrix3 m;
  m << 0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0;
  return m;
}

/// Gradient of a node's shape function in the middle of the element.
Vec3 middle_gradient(const fem::SolidElement& e, std::size_t a, bool quadratic) {
  if (!quadratic)
    return e.gradient[a];
  if (a < 4)
    return {};
  const auto [i, j] = tetrahedra::tetrahedron_edges[a - 4];
  return e.gradient[i] + e.gradient[j];
}

/// Tangents of Neo-Hookean elements, bubbles eliminated. \param positive  of the positive part of
/// the energy's second derivative
std::vector<Numbers> hyperelastic_tangents(const MotionBody& body, const SolidEnergy& energy,
                                           const Numbers& at, bool positive,
                                           const Context& context) {
  const std::size_t count = fem::solid_nodes(body.mesh);
  const auto order = static_cast<Eigen::Index>(3 * count);
  std::vector<Numbers> of_element(body.elements.size());
  const bool worth = body.elements.size() >= (count == 10 ? worth_quadratic : worth_linear);
  const auto respond = [&](std::size_t begin, std::size_t end) {
    fem::HyperelasticResponse response;
    for (std::size_t t = begin; t < end; ++t) {
      const std::array<Vec3, 10> u = energy.displacements(at, t);
      fem::hyperelastic_response(body.elements[t], std::span(u).first(count), energy.bubble(t),
                                 positive ? fem::HyperelasticPart::positive_tangent
                                          : fem::HyperelasticPart::tangent,
                                 response);
      const Eigen::Map<const Eigen::Matrix<double, 33, 33, Eigen::RowMajor>> k(
          response.tangent.data());
      of_element[t].resize(9 * count * count);
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> own(
          of_element[t].data(), order, order);
      own = k.topLeftCorner(order, order);
      if (count == 10) {
        const Eigen::Matrix<double, 3, 30> between = k.bottomLeftCorner<3, 30>();
        own.noalias() -= between.transpose() * k.bottomRightCorner<3, 3>().llt().solve(between);
      }
    }
  };
  parallel_blocks_if(worth, context, body.elements.size(), 16, respond);
  return of_element;
}

} // namespace

void MotionTangent::make(const MotionObjective& objective, const Numbers& at,
                         const Context& context) {
  made_ = false;
  // At rest nothing but the tangent itself converges fast; inertia hides what is missing of it.
  if (!std::isfinite(objective.step())) {
    try {
      make(objective, at, false, context);
      return;
    } catch (const linalg::NotPositiveDefinite&) {
      // The shape here isn't stable.
    }
  }
  make(objective, at, true, context);
}

void MotionTangent::make(const MotionObjective& objective, const Numbers& at, bool positive,
                         const Context& context) {
  const MotionBody& body = objective.body();
  const SolidEnergy& energy = objective.energy();
  const std::size_t count = fem::solid_nodes(body.mesh);
  const bool corotational = energy.law() == SolidLaw::corotational;
  std::vector<Numbers> of_element;
  if (!corotational)
    of_element = hyperelastic_tangents(body, energy, at, positive, context);
  const double scale = (corotational ? 1 : 0) + objective.damping();
  std::vector<fem::Matrix3> turns(body.elements.size()), frames(body.elements.size());
  for (std::size_t t = 0; t < body.elements.size(); ++t) {
    const fem::ElementFrame frame = energy.frame(t);
    frames[t] = fem::matrix(frame.rotation);
    turns[t] = corotational ? turning(body.elements[t], frame, positive)
                            : fem::Matrix3(fem::Matrix3::Zero());
  }
  const auto block_of = [&](std::size_t t, std::size_t a, std::size_t b) {
    fem::SolidBlock block{};
    if (!corotational)
      for (std::size_t n = 0; n < 9; ++n)
        block[n] = of_element[t][3 * count * (3 * a + n / 3) + 3 * b + n % 3];
    if (scale == 0)
      return block;
    const fem::SolidElement& e = body.elements[t];
    const fem::SolidBlock small =
        count == 4 ? fem::linear_block(e, a, b) : fem::quadratic_block(e, a, b);
    const fem::Matrix3 ga = cross_matrix(middle_gradient(e, a, count == 10)),
                       gb = cross_matrix(middle_gradient(e, b, count == 10));
    const fem::Matrix3 local =
        scale * fem::matrix(small) + e.volume * ga.transpose() * turns[t] * gb;
    const fem::Matrix3 turned = frames[t] * local * frames[t].transpose();
    for (std::size_t n = 0; n < 9; ++n)
      block[n] =
          turned(static_cast<Eigen::Index>(n / 3), static_cast<Eigen::Index>(n % 3)) + block[n];
    return block;
  };
  linalg::StiffnessMatrix matrix =
      fem::assembled_matrix(body.mesh, block_of, objective.state().held, context);
  if (!energy.springs().empty())
    matrix = energy.springs().with_tangent(matrix, at, 1 / objective.step());
  add_masses(body, objective.step(), matrix);
  make(std::move(matrix), context);
}

void MotionTangent::make(linalg::StiffnessMatrix matrix, const Context& context) {
  made_ = false;
  tangent_ = std::make_shared<const linalg::StiffnessMatrix>(std::move(matrix));
  factorise(context);
  made_ = true;
  version_ = unique_number();
}

void MotionTangent::factorise(const Context& context) {
  if (factor_ && factor_->order() == tangent_->order() && !renewed_) {
    factor_->refactor(*tangent_, context);
  } else {
    factor_.reset();
    factor_.emplace(*tangent_, context);
  }
  renewed_ = false;
}

void MotionTangent::restore(const Past& past, const Context& context) {
  const bool same = made_ && past.version == version_;
  tangent_ = past.matrix;
  version_ = past.version;
  made_ = past.made;
  renewed_ = true;
  if (made_ && !same)
    factorise(context);
}

void MotionTangent::unit_responses(std::span<const std::size_t> axes,
                                   std::span<double> columns) const {
  linalg::solve_unit_axes(*tangent_, *factor_, axes, columns);
}

void MotionTangent::solve(Numbers& v) const {
  const Numbers f = v;
  linalg::solve_axes(*tangent_, *factor_, f, v);
}

} // namespace gewebe::integrator
