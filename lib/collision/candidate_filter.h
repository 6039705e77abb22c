#pragma once
// Candidates by their present gaps: which may be near, and how far all may go.

#include "collision/candidates.h"
#include "collision/ccd.h"
#include "collision/surface.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::collision {

/// Works on the candidates of one broad phase.
///
/// Keeps for each candidate a lower bound of its gap at reference positions. Where displacements of
/// the vertices of its sides since then differ by at most s, the gap is at least that bound minus
/// s, so that most pairs need no measurement while vertices move little or together. Candidates
/// stand in blocks; one whose smallest bound is large enough is skipped as a whole.
class CandidateFilter {
public:
  /// Starts with new candidates, without known gaps. Keeps references to both lists.
  /// \param candidates  of the broad phase
  /// \param vertices  those of all candidates, or more
  void reset(const Candidates& candidates, std::span<const std::uint32_t> vertices,
             std::span<const Vec3> x);
  /// Pairs whose gap at x (distance minus the sum of radii) may be `range` or less, in the order of
  /// the candidates. \return valid until the next call
  const Candidates& select(const CollisionSurface& surface, std::span<const Vec3> x, double range);
  /// As collision_free_step() of all candidates. The nearest are looked at first: behind them few
  /// others remain on what is left of the way. \pre all other vertices stay
  double free_step(const CollisionSurface& surface, std::span<const Vec3> x0,
                   std::span<const Vec3> x1, const Separation& separation);

private:
  /// Positions of the vertices in relation to the reference. \return longest displacement
  double move_to(std::span<const Vec3> x);
  /// Calls act(list, first, list of near_, number of its first candidate) for each kind of pair.
  template <class Act>
  void for_lists(const Act& act);
  /// Takes over measured gaps, and moves the reference where it is too far away.
  void keep_measured();

  const Candidates* candidates_ = nullptr;
  std::span<const std::uint32_t> vertices_;
  std::vector<Vec3> reference_; ///< by index in vertices_
  std::vector<double> gap_;     ///< lower bounds at the reference, by candidate
  std::vector<double> least_;   ///< smallest of each block of candidates
  std::vector<Vec3> moved_;     ///< since the reference, by vertex of the surface
  std::vector<double> length_;  ///< of that, by vertex of the surface
  std::vector<Vec3> way_;       ///< of free_step(), by vertex of the surface
  std::vector<double> way_length_;
  std::size_t seen_ = 0; ///< candidates looked at only since vertices have moved
  struct Measured {
    std::size_t candidate = 0;
    double gap = 0, moved = 0;
  };
  std::vector<Measured> measured_;
  Candidates near_;
};

} // namespace gewebe::collision
