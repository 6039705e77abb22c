#pragma once
// Candidates by their present gaps: which may be near, and how far all may go.

#include "collision/candidates.h"
#include "collision/ccd.h"
#include "collision/surface.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::collision {

/// Works on the candidates of one broad phase.
///
/// Keeps for each candidate a lower bound of its gap at reference positions. Where displacements of
/// the vertices of its sides since then differ by at most s, the gap is at least that bound minus
/// s, so that most pairs need no measurement while vertices move little or together. Candidates of
/// the same two owners stand in blocks of similar gaps. A block is skipped as a whole where its
/// smallest bound is larger than what both owners have moved against each other: the difference of
/// their mean displacements and the largest deviations from these.
class CandidateFilter {
public:
  /// Starts with new candidates. Keeps references to all but the gaps.
  /// \param candidates  of the broad phase
  /// \param gaps  theirs at x: BroadPhase::gaps()
  /// \param vertices  those of all candidates, or more
  void reset(const CollisionSurface& surface, const Candidates& candidates,
             std::span<const double> gaps, std::span<const std::uint32_t> vertices,
             std::span<const Vec3> x);
  /// Pairs whose gap at x (distance minus the sum of radii) may be `range` or less, in the order of
  /// the candidates. \return valid until the next call
  const Candidates& select(std::span<const Vec3> x, double range);
  /// As collision_free_step() of all candidates. The nearest are looked at first: behind them few
  /// others remain on what is left of the way. \pre all other vertices stay
  double free_step(std::span<const Vec3> x0, std::span<const Vec3> x1,
                   const Separation& separation);

private:
  /// Candidates of one kind and of the same two owners.
  struct Group {
    std::size_t list = 0;       ///< of Candidates, in their order
    std::uint32_t a = 0, b = 0; ///< owners of both sides
    double moved = 0;           ///< against each other since the reference, at most
    double way = 0;             ///< of free_step(), the same
  };
  struct Block {
    std::size_t begin = 0, end = 0; ///< of its pairs
    std::size_t group = 0;
    double less = 0;  ///< what its bounds are too large by
    double least = 0; ///< smallest bound, that taken away
    bool seen = false;
  };
  struct Pair {
    std::array<std::uint32_t, 4> vertices{}; ///< the first of them, as many as the list has
    std::uint32_t number = 0;                ///< of the candidate, over all lists
    double bound = 0;                        ///< of the gap at the reference
  };
  struct Measured {
    std::size_t block = 0, pair = 0;
    double gap = 0, moved = 0;
  };

  void set_least(Block& block) const;
  /// Vectors of all vertices, and what both sides of each group differ by at most.
  void set_motion(std::span<const Vec3> vectors, double Group::*bound);
  void move_to(std::span<const Vec3> x);
  void keep_measured();

  const CollisionSurface* surface_ = nullptr;
  const Candidates* candidates_ = nullptr;
  std::span<const std::uint32_t> vertices_;
  std::vector<Vec3> reference_; ///< by index in vertices_
  std::vector<Group> groups_;
  std::vector<Block> blocks_;
  std::vector<Pair> pairs_;
  std::vector<Vec3> moved_; ///< since the reference, by vertex of the surface
  std::vector<Vec3> way_;   ///< of free_step(), by vertex of the surface
  std::size_t seen_ = 0;    ///< pairs looked at only since vertices have moved
  std::vector<Measured> measured_;
  std::vector<std::uint32_t> numbers_; ///< of pairs selected
  Candidates near_;
};

} // namespace gewebe::collision
