#pragma once
// Backward Euler for masses and springs: with Δ = u' - u and v' = Δ/h
//
//   M (Δ/h - v)/h = F(u + Δ, Δ/h) + f,
//
// solved by Newton's method with the matrix
//
//   A = M/h² + (D + C)/h + K,   K = Σ k [n nᵀ + max(0, 1 - l0/l)(I - n nᵀ)],   C = Σ c n nᵀ,
//
// positive definite by the max (Baraff, Witkin 1998 take one such step; here the equation is
// solved). A and its Cholesky factor are kept while they serve, the factor's symbolic part while
// the same axes are held. Stable for any h; first order; it damps what the step does not resolve.

#include "base/context.h"
#include "dynamics/spring_force.h"
#include "model/model.h"
#include "solve/factor.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

class ImplicitEuler {
public:
  /// Keeps a reference to the model. \pre check_model(model) passes, what can move has mass
  explicit ImplicitEuler(const Model& model);
  ~ImplicitEuler();
  ImplicitEuler(const ImplicitEuler&) = delete;
  ImplicitEuler& operator=(const ImplicitEuler&) = delete;

  /// Takes `motion` on by h, in parts where Newton's method fails for the whole. Along held axes it
  /// must have its new state already, and keeps it. \param outer what acts beside springs and drag
  /// \param held 3 n flags   \param worst the node that moves most where the result is false
  /// \return whether the equation was solved, to 1e-10 of the displacement or to rounding
  /// \throw Error as Factor; Cancelled
  bool step(std::span<NodeMotion> motion, std::span<const Vec3> outer,
            std::span<const std::uint8_t> held, double h, const Context& context,
            std::uint32_t& worst);

  /// As `step`, but in one part. \param before the state it starts from \param guess whether the
  /// new state is sought near `motion`, else near to where it goes on by itself
  bool solve(std::span<const NodeMotion> before, std::span<NodeMotion> motion,
             std::span<const Vec3> outer, std::span<const std::uint8_t> held, double h, bool guess,
             const Context& context, std::uint32_t& worst);
  /// A⁻¹ f in place, of the last matrix, for right-hand sides over all 3 n axes. \pre a step of
  /// something that can move was solved
  void respond(std::span<double> over_axes, std::size_t columns) const;
  /// Makes A anew, of this state.
  void refactor(std::span<const NodeMotion> motion, const Context& context) {
    make_factor(motion, factor_step_, context);
  }

  std::uint64_t factorisations() const noexcept { return factorisations_; }
  std::uint64_t solves() const noexcept { return solves_; }

private:
  bool hold(std::span<const std::uint8_t> held);
  void make_factor(std::span<const NodeMotion> motion, double h, const Context& context);

  const Model& model_;
  SpringNetwork network_;
  double size_ = 0;
  std::vector<std::uint8_t> held_;
  StiffnessMatrix matrix_;
  std::unique_ptr<Factor> factor_;
  double factor_step_ = 0; ///< h of the factor
  std::uint64_t factorisations_ = 0, solves_ = 0;
};

} // namespace gewebe
