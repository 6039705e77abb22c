#include "solid/solid_energy_internal.h"

#include "base/parallel.h"
#include "solid/assembly_internal.h"
#include "solid/hyperelastic.h"
#include "solid/matrix3_internal.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

namespace gewebe {

SolidEnergy::SolidEnergy(const MotionBody& body, const SolidNet& net,
                         const SolidMotionOptions& options)
    : body_(body), law_(options.law), springs_(net.springs),
      frames_(body.mesh, body.elements,
              {options.damping > 0 || options.reference,
               options.law != SolidLaw::corotational || options.reference}) {
  if (net.bulk > 0)
    volumes_ = MotionVolumes(net.enclosing, body.rest, net.bulk);
  if (law_ != SolidLaw::stable_neo_hookean)
    return;
  if (!body.mesh.middles.empty())
    bubbles_.resize(body.elements.size());
  new_bubbles_ = bubbles_;
  for (const SolidElement& e : body.elements)
    unsure_at_rest_ += 1e-14 * e.material.mu * e.volume;
}

void SolidEnergy::keep() {
  frames_.remember();
  springs_.keep();
  bubbles_ = new_bubbles_;
}

void SolidEnergy::forget_bubbles() {
  std::ranges::fill(bubbles_, Vec3{});
}

double SolidEnergy::hyperelastic(const Numbers& at, std::span<double> forces,
                                 const Context& context) {
  const std::size_t count = solid_nodes(body_.mesh);
  Numbers energy(body_.elements.size());
  std::vector<std::array<Vec3, 10>> part(body_.elements.size());
  parallel_blocks(context, body_.elements.size(), 64, [&](std::size_t begin, std::size_t end) {
    HyperelasticResponse response;
    for (std::size_t t = begin; t < end; ++t) {
      const std::array<Vec3, 10> u = displacements(at, t);
      Vec3 bubble;
      if (count == 10)
        bubble = new_bubbles_[t] = settled_bubble(t, u);
      hyperelastic_response(body_.elements[t], HyperelasticLaw::stable_neo_hookean,
                            std::span(u).first(count), bubble, HyperelasticPart::force, response);
      energy[t] = response.energy;
      for (std::size_t a = 0; a < count; ++a)
        part[t][a] = response.force[a];
    }
  });
  double sum = 0;
  for (std::size_t t = 0; t < body_.elements.size(); ++t) {
    sum += energy[t];
    for (std::size_t a = 0; a < count; ++a)
      for (int i = 0; i < 3; ++i)
        forces[3 * std::size_t{solid_node(body_.mesh, t, a)} + static_cast<std::size_t>(i)] +=
            part[t][a][i];
  }
  return sum;
}

std::array<Vec3, 10> SolidEnergy::displacements(const Numbers& at, std::size_t t) const {
  std::array<Vec3, 10> u;
  for (std::size_t a = 0; a < solid_nodes(body_.mesh); ++a) {
    const std::size_t axis = 3 * std::size_t{solid_node(body_.mesh, t, a)};
    u[a] = {at[axis] - body_.rest[axis], at[axis + 1] - body_.rest[axis + 1],
            at[axis + 2] - body_.rest[axis + 2]};
  }
  return u;
}

/// The least energy's bubble, from the state's: BFGS from the bubble's flexibility at rest.
Vec3 SolidEnergy::settled_bubble(std::size_t t, const std::array<Vec3, 10>& u) const {
  constexpr auto law = HyperelasticLaw::stable_neo_hookean;
  const SolidElement& e = body_.elements[t];
  const SymmetricBlock& f = e.bubble_flexibility;
  const double integral = 32.0 / 105 * e.volume;
  const Matrix3 r = matrix(frames_.frame(t).rotation);
  Matrix3 inverse;
  inverse << f[0], f[1], f[2], f[1], f[3], f[4], f[2], f[4], f[5];
  inverse = r * inverse * r.transpose() / (integral * integral);
  HyperelasticResponse response;
  const auto at = [&](const Eigen::Vector3d& w) {
    hyperelastic_response(e, law, u, {w[0], w[1], w[2]}, HyperelasticPart::force, response);
  };
  Eigen::Vector3d w = eigen(bubbles_[t]);
  at(w);
  for (int round = 0; round < 60; ++round) {
    const Eigen::Vector3d force = eigen(response.force[10]), by = inverse * force;
    const double slope = force.dot(by), energy = response.energy,
                 unsure = 1e-14 * (std::abs(energy) + e.material.mu * e.volume);
    // Of the second order in what the bubble is off by: what is left changes no force.
    if (!(slope > 1e-10 * unsure))
      break;
    double s = 1;
    for (; s > 1e-6; s /= 2) {
      at(w + s * by);
      if (response.energy <= energy - 1e-4 * s * slope + unsure)
        break;
    }
    if (!(s > 1e-6))
      break;
    w += s * by;
    const Eigen::Vector3d step = s * by, turned = force - eigen(response.force[10]);
    if (const double curvature = step.dot(turned); curvature > 0) {
      const Matrix3 side = Matrix3::Identity() - step * turned.transpose() / curvature;
      inverse = (side * inverse * side.transpose() + step * step.transpose() / curvature).eval();
    }
  }
  return {w[0], w[1], w[2]};
}

double SolidEnergy::evaluate(const Numbers& at, const StepDamping& damping,
                             std::span<double> forces, const Context& context, bool turns) {
  const bool corotational = law_ == SolidLaw::corotational;
  double energy =
      frames_.evaluate(at, {corotational ? 1.0 : 0.0, damping.by_strain}, forces, context, turns);
  if (corotational) {
    elastic_ = frames_.elastic_energy();
  } else {
    elastic_ = hyperelastic(at, forces, context);
    energy += elastic_;
  }
  if (!volumes_.empty()) {
    energy += volumes_.evaluate(at, forces);
    elastic_ += volumes_.elastic();
  }
  if (springs_.empty())
    return energy;
  energy += springs_.evaluate(at, damping.per_time, forces, context);
  elastic_ += springs_.elastic();
  return energy;
}

} // namespace gewebe
