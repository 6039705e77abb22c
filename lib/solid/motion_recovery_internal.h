#pragma once
// How bodies that are scrambled, part of them inside out, find back (solid/solid_motion.h).
//
// The energy of a corotational element has minima inside out, since its change of volume is a trace
// in its frame: with nu = 0.49 stretches of 1.72, 1.49, -0.29 cost next to nothing. Without
// Poisson's ratio it has none, and rounds get there far sooner by either law. So a body of which
// more than a hundredth is inside out moves as a corotational one of the same shear modulus and
// nu = 0, until every element is right side out again and its own energy is no more than what it
// had; the energy that it had more than the other one when that began counts on meanwhile.

#include "base/context.h"
#include "solid/motion_body_internal.h"
#include "solid/solid_motion.h"

#include <optional>
#include <span>
#include <vector>

namespace gewebe {

class MotionRecovery {
public:
  /// There is none of what Newton's method moves, of what has springs or encloses something, and of
  /// what has no Poisson's ratio.
  MotionRecovery(const MotionBody& body, std::span<const SolidMaterial> materials,
                 const SolidNet& net, const SolidMotionOptions& options);

  bool on() const noexcept { return soft_.has_value(); }
  /// Begins, if the body is scrambled and its energy there, `elastic`, is no less than the other's.
  void look(const MotionBody& body, const MotionState& state, double elastic,
            const SolidMotionOptions& options, const Context& context);
  /// The body that moves meanwhile. \pre on()
  SolidMotion& soft() { return *soft_; }
  /// Elastic energy that counts. \pre on()
  double elastic() const { return soft_->elastic_energy() + kept_; }
  /// Whether all elements of the body are right side out there.
  static bool is_right(const MotionBody& body, const Numbers& places);
  void end() { soft_.reset(); }

private:
  std::vector<SolidMaterial> materials_; ///< empty: there is no recovery
  double worth_looking_ = 0;             ///< energy
  std::optional<SolidMotion> soft_;
  double kept_ = 0;
};

} // namespace gewebe
