#pragma once
// Whether a stiffness matrix determines displacements at all, how well, and what moves freely if it
// doesn't.

#include "base/context.h"
#include "base/error.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace gewebe::linalg {

/// Beyond this condition a matrix counts as singular.
inline constexpr double max_condition = 1e12;
/// Backward error that every solution must keep.
inline constexpr double max_backward_error = 1e-14;

/// The matrix determines no displacements: something moves freely, or nearly so.
class SingularStiffness : public Error {
public:
  using Error::Error;
};

/// Estimate of ‖K⁻¹‖₁, a lower bound that is rarely off by more than a factor of 3 (Hager 1984;
/// Higham 1988, algorithm 2.4).
double inverse_norm(const Factor& factor);
/// The same of a symmetric matrix of order n, given a function that solves y = K⁻¹ x.
double
inverse_norm(std::size_t n,
             const std::function<void(std::span<const double> x, std::span<double> y)>& solve);

/// \throw Error if columns of a matrix of this condition mean nothing in that precision: beyond
/// 1/2^-24 for float32. float64 needs no more than max_condition.
void require_precision(double condition, bool single);

/// ‖K x - f‖ / (‖K‖ ‖x‖ + ‖f‖) in maximum norms, `norm` = ‖K‖. 0 where all is 0; NaN if anything
/// is.
double backward_error(const StiffnessMatrix& matrix, double norm, std::span<const double> x,
                      std::span<const double> f);

/// What of a model can move at no cost.
struct FreeMotion {
  enum class Kind : std::uint8_t {
    isolated,    ///< a node that no spring holds
    free,        ///< all six motions of a rigid body
    translation, ///< a rigid motion along one or more directions
    turn,        ///< rigid turns about a point in two or three directions
    hinge,       ///< a rigid turn about one axis
    local,       ///< a part moves against the rest
  };
  Kind kind = Kind::local;
  std::uint32_t component = 0;
  std::uint32_t node = 0; ///< the one that moves most (of rigid motions the smallest of the part)
  int translations = 0, rotations = 0; ///< of a rigid motion, how many independent ones
  Vec3 direction;                      ///< unit, of the node, where the motion is local
  double stiffness = 0;                ///< uᵀKu / uᵀu of the motion, g/s²
};

/// The motion that the matrix resists least: rigid motions of each connected part by their energy,
/// and what inverse iteration on a slightly shifted matrix finds. Nothing if the matrix has no
/// Cholesky factor even when shifted, so that it is indefinite.
/// \pre the matrix is of this model \throw Cancelled
std::optional<FreeMotion> weakest_motion(const model::Model& model, const StiffnessMatrix& matrix,
                                         const Context& context);

/// "component 0 can turn about an axis".
std::string motion_text(const FreeMotion& motion);

struct StiffnessCheck {
  double norm = 0;      ///< ‖K‖₁
  double condition = 0; ///< ‖K‖₁ times inverse_norm
  double residual = 0;  ///< largest backward error of some solutions
};

/// The factor of a matrix that determines displacements.
/// \throw SingularStiffness naming the component, its free motion and a remedy if the condition
/// exceeds max_condition; Error if the model is unstable at rest, as by springs far too short for
/// their rest length; if a solution exceeds max_backward_error; what Factor throws
Factor checked_factor(const model::Model& model, const StiffnessMatrix& matrix,
                      const Context& context, StiffnessCheck& check);

} // namespace gewebe::linalg
