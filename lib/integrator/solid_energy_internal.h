#pragma once
// The energy of a body's elements by either law, and damping, for integrator/solid_motion.h.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "fem/corotational.h"
#include "integrator/motion_body_internal.h"
#include "integrator/motion_springs_internal.h"
#include "integrator/motion_volumes_internal.h"
#include "integrator/solid_motion.h"

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::integrator {

/// What damping takes in a step; nothing at rest.
struct StepDamping {
  double by_strain = 0; ///< times the energy of what strains changed by
  double per_time = 0;  ///< 1/h, for dampers of springs
};

/// What an energy keeps of the last step. Copies share it.
struct KeptStep {
  std::shared_ptr<const void> strains;
  CopyOnWrite<Numbers> lengths;
  CopyOnWrite<std::vector<Vec3>> bubbles;
};

class SolidEnergy {
public:
  /// \pre the body outlives this and stays where it is
  SolidEnergy(const MotionBody& body, const SolidNet& net, const SolidMotionOptions& options);

  SolidLaw law() const noexcept { return law_; }
  /// The energy at the places `at`, and that of damping from the strains and lengths kept; -dE/dx
  /// into `forces`. Bubbles of Neo-Hookean elements are where they have least energy.
  /// `turns`: computes node_rotations() too.
  double evaluate(const Numbers& at, const StepDamping& damping, std::span<double> forces,
                  const Context& context, bool turns = false);
  /// Strains and bubbles of the last evaluation are kept: damping counts from the ones, bubbles
  /// are sought from the others.
  void keep();
  KeptStep kept() const { return {frames_.strains(), springs_.kept(), bubbles_}; }
  void restore(const KeptStep& kept);
  /// Damping counts from start + factor (kept() - start). \param start  kept() of an earlier time
  void extend(const KeptStep& start, double factor);
  /// Bubbles are sought from rest.
  void forget_bubbles();
  /// At rest bubbles are sought from those of the last evaluation: there is no step to begin again.
  void set_at_rest(bool at_rest) noexcept { at_rest_ = at_rest; }
  /// What rounding may add to an energy whatever its size: a Neo-Hookean one is a difference of
  /// numbers of the size of mu.
  double unsure_at_rest() const noexcept { return unsure_at_rest_; }
  const MotionSprings& springs() const noexcept { return springs_; }
  MotionVolumes& volumes() noexcept { return volumes_; }
  const MotionVolumes& volumes() const noexcept { return volumes_; }

  // As in the last evaluation.
  double elastic() const noexcept { return elastic_; }
  /// \pre of the last one with turns
  void node_rotations(std::span<double> rotations, const Context& context) {
    frames_.node_rotations(rotations, context);
  }
  /// From the next evaluation on frame() is known.
  void note_frames() { frames_.note_all(); }
  /// \pre note_frames(), or the law is Neo-Hookean, or the way is that of the reference
  fem::ElementFrame frame(std::size_t t) const { return frames_.frame(t); }
  Vec3 bubble(std::size_t t) const { return new_bubbles_.empty() ? Vec3{} : new_bubbles_[t]; }
  /// Of the nodes of tetrahedron t.
  std::array<Vec3, 10> displacements(const Numbers& at, std::size_t t) const;

private:
  double hyperelastic(const Numbers& at, std::span<double> forces, const Context& context);

  const MotionBody& body_;
  SolidLaw law_;
  MotionSprings springs_;
  MotionVolumes volumes_;
  fem::CorotationalSolid frames_;          ///< and corotational energy, and damping
  CopyOnWrite<std::vector<Vec3>> bubbles_; ///< of quadratic Neo-Hookean elements
  std::vector<Vec3> new_bubbles_;
  bool at_rest_ = false;
  double elastic_ = 0, unsure_at_rest_ = 0;
};

} // namespace gewebe::integrator
