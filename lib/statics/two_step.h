#pragma once
// The two-step method (report 3.3.3, eq. 3.4): soft up to a threshold of the load, stiffer beyond.
//
// f is the object's stacked load over its free axes: forces, weight, and what holds displaced
// nodes; C1 and C2 are the compliances of the two stages. With s = min(1, f0/|f|)
//
//   u = C1 f - (1 - s) C2 f       eq. 3.4, its sgn read as a step
//   u = s C1 f + (1 - s) C2 f     in series
//
// since f - f0 f/|f| = (1 - s) f. Both are continuous at |f| = f0. Beyond it, along one direction
// of f, the first goes on with the slope C1 - C2, the second with C2.
//
// Where displacements d are given, f is what they take: on the contact axes, with A1, A2 the blocks
// of C1, C2 and v1, v2 the displacements there under all other loads,
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

namespace gewebe {

struct TwoStepOptions {
  double threshold = 0; ///< f0 > 0, 1e-6 N
  bool series = false;

  bool operator==(const TwoStepOptions&) const = default;
};

/// |f| of what is given: forces and weight over the free axes, contact forces not among them.
double load_norm(const Model& model, const Load& load);

/// The contact axes of two stages as one problem in s, prepared for many displacements.
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
    std::span<const double> carried;      ///< what else acts on the contact axes
    double outside = 0;                   ///< |f| of all other axes
    double threshold = 0;                 ///< f0 > 0
  };
  struct Answer {
    double s = 1;              ///< 1 where the load is not beyond the threshold
    std::vector<double> force; ///< on the contact axes, `carried` not among it
  };
  /// Of several points of the curve that have this displacement, the one nearest to the threshold
  /// (of 16 evenly spaced parts of s, the first in which the curve crosses). s is exact to
  /// rounding. \pre spans of size() numbers
  Answer solve(const Problem& problem) const;
  std::size_t size() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// One object under the two-step method. Its first stage is an Elastostatic of the caller's.
class TwoStep {
public:
  /// Keeps a reference to the model, that of the first stage: positions, constraints and masses
  /// are shared. \param tolerance of the second stage, see ElastostaticOptions; each stage keeps
  /// its own   \param second of C2
  /// \throw Error if there is none or the threshold is not positive
  TwoStep(const Model& model, std::shared_ptr<ComplianceSource> second, const Context& context,
          const TwoStepOptions& options, double tolerance = 0);
  ~TwoStep();
  TwoStep(TwoStep&&) noexcept;

  void set(const TwoStepOptions& options);

  /// The forces under `load`. Up to the threshold they are those of `first` alone, the second stage
  /// is not touched. \pre as Elastostatic::update
  /// \throw Error as it, and if no force can be found for the displacements: TwoStepContact
  void update(Elastostatic& first, const Load& load);

  /// As those of Elastostatic; the shape is computed by the first call behind an update.
  /// \param first that of the update; between them it may have been asked for other loads
  std::span<const double> displacement(Elastostatic& first);
  /// As Elastostatic's, of the rows that both stages have.
  std::span<const double> surface_displacement(Elastostatic& first);
  std::span<const double> rough_surface(Elastostatic& first);
  /// Of the first stage, as Elastostatic.
  void verify(Elastostatic& first);
  const std::vector<NodeVector>& contact_forces() const noexcept;

  /// As Elastostatic::compliance_blocks, of the second stage.
  void second_compliance_blocks(const Load& load, std::uint32_t node,
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

} // namespace gewebe
