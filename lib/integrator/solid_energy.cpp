#include "integrator/solid_energy_internal.h"

#include "base/parallel.h"
#include "fem/assembly_blocks.h"
#include "fem/hyperelastic.h"

#include <algorithm>

namespace gewebe::integrator {

namespace {

// Elements from where on other threads are worth it, see parallel_blocks_if.
constexpr std::size_t worth_linear = 1024, worth_quadratic = 128;

} // namespace

SolidEnergy::SolidEnergy(const MotionBody& body, const SolidNet& net,
                         const SolidMotionOptions& options)
    : body_(body), law_(options.law), springs_(net.springs),
      frames_(body.mesh, body.elements,
              {options.damping > 0 || options.reference,
               options.law != SolidLaw::corotational || options.reference}) {
  if (net.bulk > 0)
    volumes_ = MotionVolumes(net.enclosing, body.rest, net.bulk);
  if (law_ != SolidLaw::hyperelastic)
    return;
  if (!body.mesh.middles.empty())
    bubbles_.write().resize(body.elements.size());
  new_bubbles_ = *bubbles_;
  for (const fem::SolidElement& e : body.elements)
    unsure_at_rest_ += 1e-14 * e.material.mu * e.volume;
}

void SolidEnergy::keep() {
  frames_.remember();
  springs_.keep();
  if (!new_bubbles_.empty())
    bubbles_.replace() = new_bubbles_;
}

void SolidEnergy::restore(const KeptStep& kept) {
  frames_.restore_strains(kept.strains);
  springs_.restore(kept.lengths);
  bubbles_ = kept.bubbles;
}

void SolidEnergy::extend(const KeptStep& start, double factor) {
  frames_.extend_strains(start.strains, factor);
  springs_.extend(start.lengths, factor);
}

void SolidEnergy::forget_bubbles() {
  std::ranges::fill(new_bubbles_, Vec3{});
  if (!new_bubbles_.empty())
    bubbles_.replace() = new_bubbles_;
}

double SolidEnergy::hyperelastic(const Numbers& at, std::span<double> forces,
                                 const Context& context) {
  const std::size_t count = fem::solid_nodes(body_.mesh);
  Numbers energy(body_.elements.size());
  std::vector<std::array<Vec3, 10>> part(body_.elements.size());
  const bool worth = body_.elements.size() >= (count == 10 ? worth_quadratic : worth_linear);
  const auto respond = [&](std::size_t begin, std::size_t end) {
    std::array<std::array<Vec3, 10>, 4> u;
    std::array<fem::HyperelasticForces, 4> of;
    std::array<Vec3, 4> bubbles;
    for (std::size_t t = begin; t < end; t += 4) {
      const std::size_t together = std::min<std::size_t>(4, end - t);
      for (std::size_t k = 0; k < together; ++k) {
        u[k] = displacements(at, t + k);
        if (count == 10)
          bubbles[k] = (at_rest_ ? new_bubbles_ : *bubbles_)[t + k];
      }
      fem::hyperelastic_forces(std::span(body_.elements).subspan(t, together), count, u, bubbles,
                               {}, of);
      for (std::size_t k = 0; k < together; ++k) {
        if (count == 10)
          new_bubbles_[t + k] = bubbles[k];
        energy[t + k] = of[k].energy;
        for (std::size_t a = 0; a < count; ++a)
          part[t + k][a] = of[k].force[a];
      }
    }
  };
  parallel_blocks_if(worth, context, body_.elements.size(), 64, respond);
  double sum = 0;
  for (std::size_t t = 0; t < body_.elements.size(); ++t) {
    sum += energy[t];
    for (std::size_t a = 0; a < count; ++a)
      for (int i = 0; i < 3; ++i)
        forces[3 * std::size_t{fem::solid_node(body_.mesh, t, a)} + static_cast<std::size_t>(i)] +=
            part[t][a][i];
  }
  return sum;
}

std::array<Vec3, 10> SolidEnergy::displacements(const Numbers& at, std::size_t t) const {
  std::array<Vec3, 10> u;
  for (std::size_t a = 0; a < fem::solid_nodes(body_.mesh); ++a) {
    const std::size_t axis = 3 * std::size_t{fem::solid_node(body_.mesh, t, a)};
    u[a] = {at[axis] - body_.rest[axis], at[axis + 1] - body_.rest[axis + 1],
            at[axis + 2] - body_.rest[axis + 2]};
  }
  return u;
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

} // namespace gewebe::integrator
