#pragma once
// Radii that leave a gap between surfaces at the beginning of a step. d_min of a pair depends on
// d_hat, and so on all members of an island. Where members or a shape have changed, surfaces that
// were in contact before may be too close.

#include "collision/candidates.h"
#include "contact/step.h"

#include <span>
#include <vector>

namespace gewebe::contact {

class RadiusFit {
public:
  /// \param island  its radii are those to be had; outlives this
  explicit RadiusFit(Island& island);

  /// Makes the radii of the island's surface so small that nothing at x is nearer than a part of
  /// d_hat, by at most a hundredth of each. Where they may, they are those of the constructor.
  void fit(std::span<const Vec3> x);

private:
  Island& island_;
  std::vector<double> radius_; ///< by vertex
  collision::BroadPhase broad_phase_;
  collision::AllowedPairs allowed_; ///< pairs with a radius
  collision::Candidates candidates_;
  bool any_ = false;
};

} // namespace gewebe::contact
