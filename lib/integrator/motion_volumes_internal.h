#pragma once
// Volumes that a net encloses and keeps (integrator/solid_motion.h).
//
// Each closed part of a surface encloses a volume V, at rest V₀, and has the energy
//
//   K (V - V₀)² / (2 |V₀|),   dV/dx = the area vectors of the triangles around, by thirds:
//
// a pressure of K (V₀ - V)/V₀ from inside, K being the bulk modulus of what fills it. Its second
// derivative is K/|V₀| g gᵀ with g = dV/dx and a part by the pressure, which is left out of the
// matrix, as it is not positive.

#include "geometry/mesh.h"
#include "integrator/motion_numbers_internal.h"

#include <Eigen/Core>

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace gewebe::integrator {

class MotionVolumes {
public:
  MotionVolumes() = default;
  /// \param rest places of nodes at rest \param bulk K, g/(mm s²), which is Pa
  /// \throw Error if the surface is not closed and oriented, or a part of it encloses no volume
  MotionVolumes(std::span<const Triangle> triangles, const Numbers& rest, double bulk);

  bool empty() const noexcept { return parts_.empty(); }
  /// The energy at these places; its negative gradient is added to the forces.
  double evaluate(const Numbers& at, std::span<double> forces);
  double elastic() const noexcept { return elastic_; } ///< in the last evaluation

  /// Prepares correct() for the places of the last evaluation. `solve` is A⁻¹ in place.
  void linearise(const std::function<void(Numbers&)>& solve);
  /// Of v = A⁻¹ f makes (A + Σ K/|V₀| g gᵀ)⁻¹ f (Sherman, Morrison, Woodbury).
  void correct(Numbers& v) const;

private:
  struct Part {
    std::vector<Triangle> triangles;
    double rest = 0;                ///< V₀
    double stiffness = 0;           ///< K/|V₀|
    Numbers gradient{}, response{}; ///< g in the last evaluation; A⁻¹ g of linearise()
  };
  double volume(Part& part, const Numbers& at, bool gradient) const;

  std::vector<Part> parts_;
  Eigen::MatrixXd inner_;          ///< (C⁻¹ + Gᵀ A⁻¹ G)⁻¹
  std::vector<Numbers> gradients_; ///< g of linearise()
  double elastic_ = 0;
};

} // namespace gewebe::integrator
