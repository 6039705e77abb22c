#pragma once
// The constant matrix of the quick way of integrator/solid_motion.h.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "integrator/motion_body_internal.h"
#include "integrator/motion_objective_internal.h"
#include "integrator/secants_internal.h"
#include "linalg/factor.h"
#include "linalg/single_factor.h"
#include "linalg/stiffness.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::integrator {

/// What rounds write to, kept for its memory.
struct MotionScratch {
  MotionPoint next;
  Numbers direction, moved, turned;
};

/// A⁻¹ in frames that turn with the nodes, and what rounds have learned since A was made: secants
/// stand in the frames, where they hold on as the body turns.
class MotionQuick {
public:
  /// What the next step depends on, without factors. Copies share the numbers.
  struct Past {
    double step = 0; ///< of the matrix; 0: there is none
    CopyOnWrite<std::vector<std::uint8_t>> held{};
    std::shared_ptr<const linalg::StiffnessMatrix>
        tangent{}; ///< of springs, in place of their bound
    std::uint64_t tangent_version = 0;
    Secants secants{};
    double rate = 1;
  };
  Past past() const;
  /// \throw as prepare
  void restore(const Past& past, const MotionBody& body, const MotionSprings& springs,
               const SolidMotionOptions& options, const Context& context);

  /// For a step of h; returns how many factors had to be made. \throw as Factor
  int prepare(const MotionBody& body, const MotionSprings& springs,
              const std::vector<std::uint8_t>& held, double h, const SolidMotionOptions& options,
              const Context& context);
  /// Takes the tangent of springs at these positions in place of their bound, until the step or
  /// `held` change, or drop_tangent. \pre prepared, wants_tangent()
  void take_tangent(const MotionBody& body, const MotionSprings& springs, const Numbers& at,
                    const Context& context);
  void drop_tangent() noexcept;
  bool has_tangent() const noexcept { return tangent_.taken; }
  /// Another number, see base/unique_number.h, whenever the matrix is another one.
  std::uint64_t version() const noexcept { return version_; }
  /// A net without elements: the bound of its springs is a poor model.
  bool wants_tangent() const noexcept { return all_still_ && stiffness_is_bound_; }
  /// Rotation of a node's frame, row-major. \pre turned
  std::array<double, 9> frame_of(std::size_t node) const;
  /// Frames as in the last evaluation; those of nodes held along an axis, or of no tetrahedron,
  /// don't turn.
  /// \pre prepared
  void turn(SolidEnergy& energy, const Context& context);
  // \pre turned
  void into_frames(Numbers& v, const Context& context) const;
  void out_of_frames(Numbers& v, const Context& context) const;
  /// In frames: responses to unit forces along axes that are not held, columns of all axes.
  void unit_responses(std::span<const std::size_t> axes, std::span<double> columns) const;
  /// In frames and in place, to single precision.
  void solve(Numbers& v, const Context& context);
  /// The volumes' part of the matrix joins at the places of the last evaluation. \pre turned
  void fill(MotionVolumes& volumes, const Context& context);

  /// How many rounds cost as much as a tangent of this body, by counts of operations. \pre prepared
  double rounds_of_tangent(const MotionBody& body) const;
  /// Solves with the constant matrix at rest, in place and in the fixed frame. \pre prepared
  void solve_at_rest(Numbers& v) const;
  /// Lower estimate of the condition of the constant matrix. \pre prepared
  double condition() const;

  /// What was learned from other motions.
  void forget();
  Secants& secants() noexcept { return secants_; }
  MotionScratch& scratch() noexcept { return scratch_; }
  /// What the second round of a step changes, over the first one's change, as far as is known.
  double rate() const noexcept { return rate_; }
  void set_rate(double rate) noexcept { rate_ = rate; }

private:
  std::uint64_t version_ = 0;
  double step_ = 0;
  CopyOnWrite<std::vector<std::uint8_t>> held_; ///< axes
  std::vector<std::uint8_t> still_;             ///< nodes whose frames don't turn
  bool all_still_ = false;
  bool stiffness_is_bound_ = false; ///< there are springs and no elements
  bool alike_ = false;              ///< the matrix is of nodes, and serves each axis
  linalg::StiffnessMatrix stiffness_;
  std::optional<linalg::Factor> factor_;
  std::optional<linalg::SingleFactor> single_;
  /// The tangent's, of all axes, in place of these.
  struct Tangent {
    bool taken = false;
    std::vector<std::uint8_t> held;
    linalg::StiffnessMatrix axes;
    std::shared_ptr<const linalg::StiffnessMatrix> matrix; ///< of the factor
    std::uint64_t version = 0;
    std::optional<linalg::Factor> factor;
    std::optional<linalg::SingleFactor> single;
  } tangent_;
  void factorise_tangent(const Context& context);
  void solve_constant(Numbers& v, const Context& context);

  const MotionVolumes* filled_ = nullptr;
  Numbers rotations_, rows_, solved_;
  Secants secants_;
  MotionScratch scratch_;
  double rate_ = 1;
};

/// Adds the masses times their inertia in a step of h to the diagonal.
void add_masses(const MotionBody& body, double h, linalg::StiffnessMatrix& matrix);

} // namespace gewebe::integrator
