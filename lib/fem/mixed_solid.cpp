#include "fem/mixed_solid.h"

#include "base/parallel.h"
#include "fem/assembly_blocks.h"
#include "fem/matrix3_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace gewebe::fem {

namespace {

// Elements from where on other threads are worth it, see parallel_blocks_if, and those of a block.
constexpr std::size_t worth = 32, together = 16;
/// Negative eigenvalues of an element's matrix that count as rounding, over its largest entry.
constexpr double negligible = 1e-9;
/// Smallest curvature of a bubble's energy, over the largest.
constexpr double least_curvature = 1e-3;

using ElementMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using FullMatrix = Eigen::Matrix<double, 33, 33, Eigen::RowMajor>;
using Between = Eigen::Matrix<double, 3, 30, Eigen::RowMajor>;

/// The inverse of a symmetric matrix with eigenvalues of their own sizes.
Matrix3 flexibility_of(const Matrix3& curvature) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(curvature);
  const Eigen::Vector3d size = solver.eigenvalues().cwiseAbs();
  return solver.eigenvectors() *
         size.cwiseMax(least_curvature * size.maxCoeff()).cwiseInverse().asDiagonal() *
         solver.eigenvectors().transpose();
}

bool is_positive(const Eigen::Map<const FullMatrix>& k, Eigen::Index order) {
  ElementMatrix shifted = k.topLeftCorner(order, order);
  shifted.diagonal().array() += negligible * shifted.diagonal().cwiseAbs().maxCoeff();
  return Eigen::LLT<ElementMatrix>(shifted).info() == Eigen::Success;
}

} // namespace

MixedSolid::MixedSolid(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements)
    : mesh_(mesh), elements_(elements), nodes_(solid_nodes(mesh)), parts_(elements.size()) {}

std::array<Vec3, 10> MixedSolid::of_nodes(std::span<const double> v, std::size_t t) const {
  std::array<Vec3, 10> all;
  for (std::size_t a = 0; a < nodes_; ++a) {
    const std::size_t axis = 3 * std::size_t{solid_node(mesh_, t, a)};
    all[a] = {v[axis], v[axis + 1], v[axis + 2]};
  }
  return all;
}

MixedUnknowns MixedSolid::balanced(std::span<const double> u, std::span<const Vec3> start,
                                   const Context& context) const {
  MixedUnknowns own{std::vector<Vec3>(parts_.size()),
                    std::vector<std::array<double, 4>>(parts_.size())};
  const auto balance = [&](std::size_t begin, std::size_t end) {
    HyperelasticResponse response;
    for (std::size_t t = begin; t < end; ++t) {
      const std::array<Vec3, 10> all = of_nodes(u, t);
      if (nodes_ == 10)
        own.bubble[t] = settled_bubble(elements_[t], all, start.empty() ? Vec3{} : start[t]);
      hyperelastic_response(elements_[t], std::span(all).first(nodes_), own.bubble[t],
                            HyperelasticPart::energy, response);
      own.pressure[t] = response.pressure;
    }
  };
  parallel_blocks_if(parts_.size() >= worth, context, parts_.size(), together, balance);
  return own;
}

/// What is out of balance: the nodes' and the bubble's forces under their own pressure, and those
/// of the jump that the round is to close, by the slope of J in the system.
void MixedSolid::set_forces(std::size_t t, const std::array<double, 4>& own,
                            const std::array<Vec3, HyperelasticResponse::nodes>& force,
                            const std::array<double, 4>& pressure) {
  Part& part = parts_[t];
  for (std::size_t p = 0; p < 4; ++p)
    part.pressure_jump[p] = pressure[p] - own[p];
  for (std::size_t a = 0; a < HyperelasticResponse::nodes; ++a) {
    part.force[a] = force[a];
    for (std::size_t p = 0; p < 4; ++p)
      part.force[a] -= (elements_[t].volume * part.pressure_jump[p]) * part.volume[p][a];
  }
}

double MixedSolid::linearise_element(std::size_t t, std::span<const double> u,
                                     const MixedUnknowns& own, double positive) {
  Part& part = parts_[t];
  const std::array<Vec3, 10> all = of_nodes(u, t);
  HyperelasticResponse response;
  const auto respond = [&](HyperelasticPart what) {
    hyperelastic_response(elements_[t], std::span(all).first(nodes_), own.bubble[t], what, response,
                          &own.pressure[t]);
  };
  respond(HyperelasticPart::tangent);
  const bool quadratic = nodes_ == 10;
  const auto order = static_cast<Eigen::Index>(3 * nodes_);
  const Eigen::Map<const FullMatrix> k(response.tangent.data());
  if (positive > 0 && !is_positive(k, order + (quadratic ? 3 : 0))) {
    const auto tangent = response.tangent;
    respond(HyperelasticPart::positive_tangent);
    for (std::size_t n = 0; n < tangent.size(); ++n)
      response.tangent[n] = (1 - positive) * tangent[n] + positive * response.tangent[n];
  }
  part.matrix.resize(9 * nodes_ * nodes_);
  Eigen::Map<ElementMatrix> nodes(part.matrix.data(), order, order);
  nodes = k.topLeftCorner(order, order);
  if (quadratic) {
    Eigen::Map<Between> between(part.between.data());
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> flexibility(part.flexibility.data());
    between = k.bottomLeftCorner<3, 30>();
    flexibility = flexibility_of(k.bottomRightCorner<3, 3>());
    nodes.noalias() -= between.transpose() * (flexibility * between);
  }
  part.volume = response.volume_slope;
  set_forces(t, own.pressure[t], response.force, response.pressure);
  return response.energy;
}

double MixedSolid::linearise(std::span<const double> u, const MixedUnknowns& own, double positive,
                             const Context& context) {
  std::vector<double> energy(parts_.size());
  parallel_blocks_if(parts_.size() >= worth, context, parts_.size(), together,
                     [&](std::size_t begin, std::size_t end) {
                       for (std::size_t t = begin; t < end; ++t)
                         energy[t] = linearise_element(t, u, own, positive);
                     });
  double sum = 0;
  for (const double e : energy)
    sum += e;
  return sum;
}

linalg::StiffnessMatrix MixedSolid::matrix(std::span<const std::uint8_t> held,
                                           const Context& context) const {
  const auto block_of = [&](std::size_t t, std::size_t a, std::size_t b) {
    SolidBlock block{};
    for (std::size_t n = 0; n < 9; ++n)
      block[n] = parts_[t].matrix[3 * nodes_ * (3 * a + n / 3) + 3 * b + n % 3];
    return block;
  };
  return assembled_matrix(mesh_, block_of, held, context);
}

double MixedSolid::evaluate(std::span<const double> u, const MixedUnknowns& own,
                            const Context& context) {
  std::vector<double> energy(parts_.size());
  const auto respond = [&](std::size_t begin, std::size_t end) {
    std::array<std::array<Vec3, 10>, 4> all;
    std::array<HyperelasticForces, 4> forces;
    std::array<Vec3, 4> bubbles;
    for (std::size_t t = begin; t < end; t += 4) {
      const std::size_t count = std::min<std::size_t>(4, end - t);
      for (std::size_t k = 0; k < count; ++k) {
        all[k] = of_nodes(u, t + k);
        bubbles[k] = own.bubble[t + k];
      }
      hyperelastic_forces(elements_.subspan(t, count), nodes_, all, bubbles,
                          std::span(own.pressure).subspan(t, count), forces);
      for (std::size_t k = 0; k < count; ++k) {
        energy[t + k] = forces[k].energy;
        set_forces(t + k, own.pressure[t + k], forces[k].force, forces[k].pressure);
      }
    }
  };
  parallel_blocks_if(parts_.size() >= worth, context, parts_.size(), together, respond);
  double sum = 0;
  for (const double e : energy)
    sum += e;
  return sum;
}

void MixedSolid::add_forces(std::span<double> forces) const {
  for (std::size_t t = 0; t < parts_.size(); ++t) {
    const Part& part = parts_[t];
    Eigen::Matrix<double, 30, 1> of_bubble = Eigen::Matrix<double, 30, 1>::Zero();
    if (nodes_ == 10) {
      const Eigen::Map<const Between> between(part.between.data());
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> flexibility(
          part.flexibility.data());
      const Vec3& f = part.force[10];
      of_bubble = between.transpose() * (flexibility * Eigen::Vector3d(f.x, f.y, f.z));
    }
    for (std::size_t a = 0; a < nodes_; ++a)
      for (std::size_t i = 0; i < 3; ++i)
        forces[3 * std::size_t{solid_node(mesh_, t, a)} + i] +=
            part.force[a][static_cast<int>(i)] - of_bubble[static_cast<Eigen::Index>(3 * a + i)];
  }
}

void MixedSolid::take_product(std::span<const double> d, std::span<double> forces) const {
  const auto order = static_cast<Eigen::Index>(3 * nodes_);
  for (std::size_t t = 0; t < parts_.size(); ++t) {
    const std::array<Vec3, 10> all = of_nodes(d, t);
    if (std::ranges::all_of(all, [](const Vec3& v) { return v == Vec3{}; }))
      continue;
    Eigen::Matrix<double, 30, 1> moved = Eigen::Matrix<double, 30, 1>::Zero();
    for (std::size_t a = 0; a < nodes_; ++a)
      for (int i = 0; i < 3; ++i)
        moved[static_cast<Eigen::Index>(3 * a) + i] = all[a][i];
    const Eigen::Map<const ElementMatrix> k(parts_[t].matrix.data(), order, order);
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 30, 1> by = k * moved.head(order);
    for (std::size_t a = 0; a < nodes_; ++a)
      for (std::size_t i = 0; i < 3; ++i)
        forces[3 * std::size_t{solid_node(mesh_, t, a)} + i] -=
            by[static_cast<Eigen::Index>(3 * a + i)];
  }
}

MixedUnknowns MixedSolid::follow(std::span<const double> d, const Context& context) const {
  MixedUnknowns change{std::vector<Vec3>(parts_.size()),
                       std::vector<std::array<double, 4>>(parts_.size())};
  const auto follow = [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Part& part = parts_[t];
      const std::array<Vec3, 10> all = of_nodes(d, t);
      Vec3& bubble = change.bubble[t];
      if (nodes_ == 10) {
        Eigen::Matrix<double, 30, 1> moved;
        for (std::size_t a = 0; a < 10; ++a)
          for (int i = 0; i < 3; ++i)
            moved[static_cast<Eigen::Index>(3 * a) + i] = all[a][i];
        const Eigen::Map<const Between> between(part.between.data());
        const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> flexibility(
            part.flexibility.data());
        const Vec3& f = part.force[10];
        const Eigen::Vector3d by = flexibility * (Eigen::Vector3d(f.x, f.y, f.z) - between * moved);
        bubble = {by[0], by[1], by[2]};
      }
      std::array<double, 4> moment{};
      for (std::size_t p = 0; p < 4; ++p) {
        for (std::size_t a = 0; a < nodes_; ++a)
          moment[p] += dot(part.volume[p][a], all[a]);
        if (nodes_ == 10)
          moment[p] += dot(part.volume[p][10], bubble);
      }
      change.pressure[t] = projected_pressure(elements_[t], nodes_ == 10, moment);
      for (std::size_t p = 0; p < 4; ++p)
        change.pressure[t][p] += part.pressure_jump[p];
    }
  };
  parallel_blocks_if(parts_.size() >= worth, context, parts_.size(), together, follow);
  return change;
}

} // namespace gewebe::fem
