#pragma once
// Two-step method (report 3.3.3, eq. 3.4): soft up to a threshold of the load, stiffer beyond.
//
// f is the object's stacked load over its free axes: forces, weight, and reactions of displaced
// nodes. C1 and C2 are the compliances of the two stages. With s = min(1, f0/|f|)
//
//   u = C1 f - (1 - s) C2 f       eq. 3.4, its sgn read as a step
//   u = s C1 f + (1 - s) C2 f     in series
//
// since f - f0 f/|f| = (1 - s) f. Both are continuous at |f| = f0. Beyond it, along one direction
// of f, the first has the slope C1 - C2, the second C2.
//
// If displacements d are prescribed, f includes their unknown reactions f_c. On the prescribed
// axes, with A1, A2 the blocks of C1, C2 and v1, v2 the displacements there under all other loads,
//
//   (A1 - (1-s) B) f_c = d - v1 + (1-s) w,   B = A2, w = v2;  in series B = A1 - A2, w = v1 - v2
//
// together with s |f| = f0: one unknown s.

#include "base/context.h"
#include "contact/load.h"
#include "model/model.h"
#include "statics/elastostatic.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::statics {

struct TwoStepOptions {
  double threshold = 0; ///< f0 > 0, 1e-6 N
  bool series = false;  ///< the second of the formulas above

  bool operator==(const TwoStepOptions&) const = default;
};

/// |f| of the given forces and weight over the free axes, without the reactions of displaced nodes.
double load_norm(const model::Model& model, const contact::Load& load);

/// Solver for the reactions of prescribed displacements in the two-step method: one problem in s,
/// prepared for many displacements.
class TwoStepContact {
public:
  /// Blocks of `size` times `size` numbers, symmetric. \throw Error if A1 is not positive definite,
  /// or A1 - A2 is not (A2 in series)
  TwoStepContact(std::span<const double> first, std::span<const double> second, std::size_t size,
                 bool series);
  ~TwoStepContact();
  TwoStepContact(TwoStepContact&&) noexcept;
  TwoStepContact& operator=(TwoStepContact&&) noexcept;

  struct Problem {
    std::span<const double> wanted;       ///< d
    std::span<const double> first, other; ///< v1, v2
    std::span<const double> carried;      ///< other forces on the prescribed axes
    double outside = 0;                   ///< |f| of all other axes
    double threshold = 0;                 ///< f0 > 0
  };
  struct Answer {
    double s = 1;              ///< 1 if the load is not beyond the threshold
    std::vector<double> force; ///< on the prescribed axes, without `carried`
  };
  /// Solves for s and the forces. If several points of the curve have this displacement, the result
  /// is the one nearest to the threshold (of 16 evenly spaced parts of s, the first in which the
  /// curve crosses). s is exact to rounding. \pre spans of size() numbers
  Answer solve(const Problem& problem) const;
  std::size_t size() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Solver of one object with the two-step method. The caller owns the Elastostatic of its first
/// stage.
class TwoStep {
public:
  /// Keeps a reference to the model, that of the first stage. Both stages share positions,
  /// constraints and masses.
  /// \param second  source of C2
  /// \param tolerance  of the second stage, see ElastostaticOptions; each stage has its own
  /// \throw Error if `second` is null or the threshold is not positive
  TwoStep(const model::Model& model, std::shared_ptr<compliance::ComplianceSource> second,
          const Context& context, const TwoStepOptions& options, double tolerance = 0);
  ~TwoStep();
  TwoStep(TwoStep&&) noexcept;

  void set(const TwoStepOptions& options);

  /// As those of Elastostatic, of the second stage and of this object; not of the first stage.
  struct Past;
  std::shared_ptr<const Past> past() const;
  void restore(const Past& past);

  /// Computes the forces under `load`. Up to the threshold they are those of `first`, and the
  /// second stage is not used. \pre as Elastostatic::update
  /// \throw Error as Elastostatic::update, and if no force is found for the displacements, see
  /// TwoStepContact
  void update(Elastostatic& first, const contact::Load& load);

  /// As Elastostatic::displacement; computed by the first call after an update.
  /// \param first  that of the update; it may have been updated for other loads since
  std::span<const double> displacement(Elastostatic& first);
  /// As those of Elastostatic, of the rows that both stages have.
  std::span<const double> surface_displacement(Elastostatic& first);
  std::span<const double> rough_surface(Elastostatic& first);
  /// As Elastostatic::verify, of the first stage.
  void verify(Elastostatic& first);
  const std::vector<contact::NodeVector>& contact_forces() const noexcept;

  /// As Elastostatic::compliance_blocks, of the second stage.
  void second_compliance_blocks(const contact::Load& load, std::uint32_t node,
                                std::span<const std::uint32_t> rows,
                                std::span<std::array<double, 9>> blocks);

  const TwoStepOptions& options() const noexcept;
  double threshold() const noexcept;
  double load() const noexcept;    ///< |f| of the last update
  double largest() const noexcept; ///< of all updates
  ElastostaticCounts second_counts() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::statics
