#pragma once
// Recovery of bodies that are partly inside out (integrator/solid_motion.h).
//
// The energy of a corotational element has minima inside out, since its change of volume is a trace
// in its frame: with nu = 0.49 stretches of 1.72, 1.49, -0.29 cost next to nothing. Without
// Poisson's ratio a single one has none, and rounds get there far sooner by either law. So a body
// moves as a corotational one of the same shear modulus and nu = 0 if more than a hundredth of it
// is inside out. This ends when every element is right side out again and the body's own energy is
// no more than at the start. Meanwhile the difference of both energies at the start is added to the
// energy.
//
// Together elements have minima inside out all the same, if few: 10 of 20,000 scrambled bodies of
// up to 162 linear elements came to a stand with one element of stretches like 1.15, 1.01, -0.24
// that those around it kept so. Where that is seen, what touches an element inside out is a
// hundredth as stiff from then on, so that the element has its way; the energy that this takes
// counts on too. A quadratic element may be in a minimum by itself, a corner turned in, since its
// frame is that of its middle (2 of 1,000 bodies): the looser body of these is a Neo-Hookean one,
// which has no frames. One whose own energy is less than the corotational one moves by its own law
// until it stands (3 of 200 quadratic Neo-Hookean ones).

#include "base/context.h"
#include "integrator/motion_body_internal.h"
#include "integrator/solid_motion.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::integrator {

class MotionRecovery {
public:
  /// What the next step depends on.
  struct Past {
    std::shared_ptr<const SolidMotion::Past> soft{}; ///< null: it isn't on
    Numbers place{}, velocity{};                     ///< of the soft body
    std::uint64_t number = 0;                        ///< of the soft body
    SolidLaw law = SolidLaw::corotational;           ///< and its law
    double kept = 0, stood_at = 0, standing = 0;
    std::vector<std::uint8_t> loose{};
    int steps_standing = 0;
  };
  Past past() const;
  /// \throw as SolidMotion
  void restore(const Past& past, const MotionBody& body, const MotionState& state,
               const SolidMotionOptions& options, const Context& context);

  /// There is none of what Newton's method moves, and of what has springs or encloses something.
  MotionRecovery(const MotionBody& body, std::span<const fem::SolidMaterial> materials,
                 const SolidNet& net, const SolidMotionOptions& options);

  bool on() const noexcept { return soft_.has_value(); }
  /// Before each step, of h: begins, if the body is scrambled and its energy there, `elastic`, is
  /// no less than the other's; loosens what has come to a stand inside out.
  void look(const MotionBody& body, const MotionState& state, double elastic, double h,
            const SolidMotionOptions& options, const Context& context);
  /// The body that moves meanwhile. \pre on()
  SolidMotion& soft() { return *soft_; }
  /// Elastic energy that counts. \pre on()
  double elastic() const { return soft_->elastic_energy() + kept_; }
  /// Whether all elements of the body are right side out there.
  static bool is_right(const MotionBody& body, const Numbers& places);
  void end() { soft_.reset(); }

private:
  SolidMotion make(const MotionBody& body, const MotionState& state,
                   const tetrahedra::TetMesh& mesh, SolidLaw law, const SolidMotionOptions& options,
                   const Context& context) const;
  void loosen(const MotionBody& body, const MotionState& state, double elastic,
              const SolidMotionOptions& options, const Context& context);
  bool stands(double elastic, double h);
  tetrahedra::TetMesh loosened(const MotionBody& body,
                               const std::vector<std::uint8_t>& loose) const;
  void begin(SolidMotion&& soft, SolidLaw law);

  /// Those of the mesh, then as many for what is loosened; empty: there is no recovery.
  std::vector<fem::SolidMaterial> materials_;
  double worth_looking_ = 0; ///< energy
  std::optional<SolidMotion> soft_;
  std::uint64_t number_ = 0; ///< of soft_, see base/unique_number.h
  SolidLaw law_ = SolidLaw::corotational;
  double kept_ = 0;
  std::vector<std::uint8_t> loose_; ///< by tetrahedron; empty: none yet

  double period_ = 0;   ///< of the body, s
  double stood_at_ = 0; ///< the energy when it was last seen to change
  double standing_ = 0; ///< s since then
  int steps_standing_ = 0;
};

} // namespace gewebe::integrator
