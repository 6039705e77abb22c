#pragma once
// Filter of candidates: selects those whose present distance may be below a bound.

#include "collision/candidates.h"
#include "collision/surface.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::collision {

/// Selects from the candidates of one broad phase the pairs that may be near.
///
/// Keeps for each candidate a lower bound of its gap at reference positions. Where the vertices of
/// its sides moved by at most s and t since then, the gap is at least that bound minus s + t, so
/// that most pairs need no measurement while vertices move little.
class CandidateFilter {
public:
  /// Starts with new candidates, without known gaps. Keeps references to both lists.
  /// \param candidates  of the broad phase
  /// \param vertices  those of all candidates, or more
  void reset(const Candidates& candidates, std::span<const std::uint32_t> vertices,
             std::span<const Vec3> x);
  /// Pairs whose gap at x (distance minus the sum of radii) may be `range` or less, in the order of
  /// the candidates. \param steps  by vertex of the surface, or empty: a pair is selected, too, if
  /// its gap may be `range` or less behind steps of these lengths \return valid until the next call
  const Candidates& select(const CollisionSurface& surface, std::span<const Vec3> x, double range,
                           std::span<const double> steps = {});

private:
  const Candidates* candidates_ = nullptr;
  std::span<const std::uint32_t> vertices_;
  std::vector<Vec3> reference_; ///< by index in vertices_
  std::vector<double> gap_;     ///< lower bounds at the reference, by candidate
  std::vector<double> moved_;   ///< since the reference, by vertex of the surface
  struct Measured {
    std::size_t candidate = 0;
    double gap = 0, moved = 0;
  };
  std::vector<Measured> measured_;
  Candidates near_;
};

} // namespace gewebe::collision
