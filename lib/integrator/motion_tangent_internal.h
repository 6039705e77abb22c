#pragma once
// The tangent of the reference of integrator/solid_motion.h.

#include "base/context.h"
#include "integrator/motion_objective_internal.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::integrator {

class MotionTangent {
public:
  /// The matrix without its factor, which is made again where it is another one's. Copies share it.
  struct Past {
    std::shared_ptr<const linalg::StiffnessMatrix> matrix;
    std::uint64_t version = 0;
    bool made = false;
  };
  Past past() const { return {tangent_, version_, made_}; }
  /// \throw as Factor
  void restore(const Past& past, const Context& context);

  /// Other axes are held.
  void renew() noexcept { renewed_ = true; }
  bool is_made() const noexcept { return made_; }
  /// Number of the matrix (base/unique_number.h), a new one by each make().
  std::uint64_t version() const noexcept { return version_; }
  /// Its factor where the last evaluation was, at `at`: at rest that of the tangent itself, where
  /// it is positive definite, else of its positive parts. \throw as Factor: then it isn't made
  void make(const MotionObjective& objective, const Numbers& at, const Context& context);
  /// Of a matrix made elsewhere. \throw as Factor: then it isn't made
  void make(linalg::StiffnessMatrix matrix, const Context& context);
  /// Responses to unit forces along axes, columns of all axes. \pre made
  void unit_responses(std::span<const std::size_t> axes, std::span<double> columns) const;
  /// In place. \pre made
  void solve(Numbers& v) const;

private:
  void make(const MotionObjective& objective, const Numbers& at, bool positive,
            const Context& context);

  bool renewed_ = true, made_ = false;
  std::uint64_t version_ = 0;
  void factorise(const Context& context);

  std::shared_ptr<const linalg::StiffnessMatrix> tangent_;
  std::optional<linalg::Factor> factor_;
};

} // namespace gewebe::integrator
