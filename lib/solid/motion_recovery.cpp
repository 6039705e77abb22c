#include "solid/motion_recovery_internal.h"

#include "base/vector_at.h"
#include "tetrahedra/tet_mesh.h"

#include <algorithm>
#include <cstddef>

namespace gewebe {

namespace {

constexpr double scrambled_part = 0.01; ///< of the volume, inside out
/// Of the shear moduli by volume: a body with so much of it inside out has more energy.
constexpr double scrambled_energy = 1e-3;

/// Volume at rest of what is inside out; flat is, and so are places that aren't finite.
double inside_out(const MotionBody& body, const Numbers& places) {
  double sum = 0;
  for (std::size_t t = 0; t < body.mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& corner = body.mesh.tetrahedra[t];
    const bool right =
        tetrahedron_volume(vector_at(places, corner[0]), vector_at(places, corner[1]),
                           vector_at(places, corner[2]), vector_at(places, corner[3])) > 0;
    sum += right ? 0 : body.elements[t].volume;
  }
  return sum;
}

} // namespace

MotionRecovery::MotionRecovery(const MotionBody& body, std::span<const SolidMaterial> materials,
                               const SolidNet& net, const SolidMotionOptions& options) {
  if (options.reference || !net.springs.empty() || net.bulk > 0 ||
      std::ranges::all_of(materials, [](const SolidMaterial& m) { return !(m.poisson > 0); }))
    return;
  for (SolidMaterial m : materials) {
    m.young /= 1 + m.poisson;
    m.poisson = 0;
    materials_.push_back(m);
  }
  for (const SolidElement& e : body.elements)
    worth_looking_ += scrambled_energy * e.material.mu * e.volume;
}

void MotionRecovery::look(const MotionBody& body, const MotionState& state, double elastic,
                          const SolidMotionOptions& options, const Context& context) {
  if (on() || materials_.empty() || !(elastic > worth_looking_))
    return;
  double volume = 0;
  for (const SolidElement& e : body.elements)
    volume += e.volume;
  if (!(inside_out(body, state.place) > scrambled_part * volume))
    return;
  SolidMotionOptions soft = options;
  soft.law = SolidLaw::corotational;
  soft_.emplace(body.mesh, materials_, SolidNet{{}, body.masses, body.drag, {}, 0}, soft, context);
  soft_->hold(state.held);
  soft_->restore(state.place, state.velocity, context);
  kept_ = elastic - soft_->elastic_energy();
  if (!(kept_ >= 0))
    soft_.reset();
}

bool MotionRecovery::is_right(const MotionBody& body, const Numbers& places) {
  return inside_out(body, places) == 0;
}

} // namespace gewebe
