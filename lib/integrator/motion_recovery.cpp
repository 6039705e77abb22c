#include "integrator/motion_recovery_internal.h"

#include "base/unique_number.h"
#include "fem/assembly_blocks.h"
#include "geometry/vector_at.h"
#include "tetrahedra/tet_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace gewebe::integrator {

namespace {

constexpr double scrambled_part = 0.01; ///< of the volume, inside out
/// Of the shear moduli by volume: a body with so much of it inside out has more energy.
constexpr double scrambled_energy = 1e-3;
constexpr double looseness = 0.01; ///< of the stiffness
/// A body stands whose energy stays within this part for so many of the times that shear waves take
/// across it, in so many steps at least; it may turn.
constexpr double still_part = 1e-3, still_periods = 10;
constexpr int still_steps = 3;

bool is_inside_out(const MotionBody& body, const Numbers& places, std::size_t t) {
  const Tetrahedron& corner = body.mesh.tetrahedra[t];
  return !(tetrahedra::tetrahedron_volume(
               vector_at(places, corner[0]), vector_at(places, corner[1]),
               vector_at(places, corner[2]), vector_at(places, corner[3])) > 0);
}

/// Volume at rest of what is inside out; flat is, and so are places that aren't finite.
double inside_out(const MotionBody& body, const Numbers& places) {
  double sum = 0;
  for (std::size_t t = 0; t < body.mesh.tetrahedra.size(); ++t)
    sum += is_inside_out(body, places, t) ? body.elements[t].volume : 0;
  return sum;
}

/// By tetrahedron: whether it is right side out and shares a node with one that isn't.
std::vector<std::uint8_t> around_inside_out(const MotionBody& body, const Numbers& places) {
  const std::size_t count = body.mesh.tetrahedra.size(), of_element = fem::solid_nodes(body.mesh);
  std::vector<std::uint8_t> inside_out(count), touched(body.nodes()), around(count);
  for (std::size_t t = 0; t < count; ++t) {
    inside_out[t] = is_inside_out(body, places, t) ? 1 : 0;
    for (std::size_t a = 0; inside_out[t] != 0 && a < of_element; ++a)
      touched[fem::solid_node(body.mesh, t, a)] = 1;
  }
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t a = 0; inside_out[t] == 0 && a < of_element; ++a)
      if (touched[fem::solid_node(body.mesh, t, a)] != 0)
        around[t] = 1;
  return around;
}

} // namespace

MotionRecovery::MotionRecovery(const MotionBody& body,
                               std::span<const fem::SolidMaterial> materials, const SolidNet& net,
                               const SolidMotionOptions& options) {
  if (!options.recover || options.reference || !net.springs.empty() || net.bulk > 0 ||
      body.elements.empty())
    return;
  for (const double stiffness : {1.0, looseness})
    for (fem::SolidMaterial m : materials) {
      m.young *= stiffness / (1 + m.poisson);
      m.poisson = 0;
      m.law = {};
      m.prony = {};
      materials_.push_back(m);
    }
  double volume = 0, shear = 0, mass = 0;
  for (const fem::SolidElement& e : body.elements) {
    volume += e.volume;
    shear += e.material.mu * e.volume;
  }
  for (const double m : body.masses)
    mass += m;
  worth_looking_ = scrambled_energy * shear;
  period_ = std::cbrt(volume) * std::sqrt(mass / shear);
}

SolidMotion MotionRecovery::make(const MotionBody& body, const MotionState& state,
                                 const tetrahedra::TetMesh& mesh, SolidLaw law,
                                 const SolidMotionOptions& options, const Context& context) const {
  SolidMotionOptions soft = options;
  soft.law = law;
  soft.recover = false;
  soft.damping = 0; // by strains, which jump where frames do: it would keep them from turning
  SolidMotion motion(mesh, materials_, SolidNet{{}, body.masses, body.drag, {}, 0}, soft, context);
  motion.hold(state.held);
  motion.restore(state.place, state.velocity, context);
  return motion;
}

void MotionRecovery::look(const MotionBody& body, const MotionState& state, double elastic,
                          double h, const SolidMotionOptions& options, const Context& context) {
  if (on()) {
    if (stands(soft_->elastic_energy(), h))
      loosen(body, state, this->elastic(), options, context);
    return;
  }
  if (materials_.empty() || !(elastic > worth_looking_))
    return;
  double volume = 0;
  for (const fem::SolidElement& e : body.elements)
    volume += e.volume;
  if (!(inside_out(body, state.place) > scrambled_part * volume))
    return;
  SolidMotion soft = make(body, state, body.mesh, SolidLaw::corotational, options, context);
  const double more = elastic - soft.elastic_energy();
  loose_.clear();
  if (!(more >= 0)) {
    if (stands(elastic, h))
      loosen(body, state, elastic, options, context);
    return;
  }
  begin(std::move(soft), SolidLaw::corotational);
  kept_ = more;
  stood_at_ = 0;
}

void MotionRecovery::begin(SolidMotion&& soft, SolidLaw law) {
  soft_ = std::move(soft);
  law_ = law;
  number_ = unique_number();
}

/// The mesh with the material of loose elements.
tetrahedra::TetMesh MotionRecovery::loosened(const MotionBody& body,
                                             const std::vector<std::uint8_t>& loose) const {
  tetrahedra::TetMesh mesh = body.mesh;
  if (loose.empty())
    return mesh;
  mesh.material.resize(loose.size());
  for (std::size_t t = 0; t < loose.size(); ++t)
    if (loose[t] != 0)
      mesh.material[t] += static_cast<std::int32_t>(materials_.size() / 2);
  return mesh;
}

MotionRecovery::Past MotionRecovery::past() const {
  Past past{.number = number_,
            .law = law_,
            .kept = kept_,
            .stood_at = stood_at_,
            .standing = standing_,
            .loose = loose_,
            .steps_standing = steps_standing_};
  if (!on())
    return past;
  past.soft = soft_->past();
  past.place.assign(soft_->places().begin(), soft_->places().end());
  past.velocity.assign(soft_->velocity().begin(), soft_->velocity().end());
  return past;
}

void MotionRecovery::restore(const Past& past, const MotionBody& body, const MotionState& state,
                             const SolidMotionOptions& options, const Context& context) {
  kept_ = past.kept;
  stood_at_ = past.stood_at;
  standing_ = past.standing;
  loose_ = past.loose;
  steps_standing_ = past.steps_standing;
  if (!past.soft) {
    end();
    return;
  }
  if (!on() || number_ != past.number) {
    begin(make(body, state, loosened(body, loose_), past.law, options, context), past.law);
    number_ = past.number;
  }
  soft_->restore(past.place, past.velocity, state.held, *past.soft, context);
}

/// Whether it does, with this energy, a step of h ahead.
bool MotionRecovery::stands(double elastic, double h) {
  if (!(std::abs(elastic - stood_at_) <= still_part * stood_at_)) {
    stood_at_ = elastic;
    standing_ = 0;
    steps_standing_ = 0;
  }
  const double slower = loose_.empty() ? 1 : 1 / std::sqrt(looseness);
  if (steps_standing_ >= still_steps && standing_ >= still_periods * slower * period_)
    return true;
  standing_ += h;
  ++steps_standing_;
  return false;
}

void MotionRecovery::loosen(const MotionBody& body, const MotionState& state, double elastic,
                            const SolidMotionOptions& options, const Context& context) {
  stood_at_ = 0;
  std::vector<std::uint8_t> loose = around_inside_out(body, state.place);
  if (loose == loose_)
    return;
  const tetrahedra::TetMesh mesh = loosened(body, loose);
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::hyperelastic}) {
    if (law == SolidLaw::corotational && !mesh.middles.empty())
      continue;
    SolidMotion soft = make(body, state, mesh, law, options, context);
    const double kept = elastic - soft.elastic_energy();
    if (!(kept >= 0))
      continue;
    begin(std::move(soft), law);
    kept_ = kept;
    loose_ = std::move(loose);
    return;
  }
}

bool MotionRecovery::is_right(const MotionBody& body, const Numbers& places) {
  return inside_out(body, places) == 0;
}

} // namespace gewebe::integrator
