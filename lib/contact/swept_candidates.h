#pragma once
// Candidates of the ways that vertices are expected to go, and how far along they may.

#include "collision/candidate_filter.h"
#include "collision/candidates.h"
#include "collision/ccd.h"
#include "contact/step.h"
#include "geometry/vec3.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::contact {

class SweptCandidates {
public:
  /// \pre all outlive this
  SweptCandidates(const Island& island, collision::BroadPhase& broad_phase,
                  const Parameters& parameters)
      : island_(island), broad_phase_(broad_phase), parameters_(parameters) {}

  /// Finds all pairs of features that come within `reach` on straight ways. \param also  vertices
  /// to have among vertices(), in any order
  void search(std::span<const Vec3> from, std::span<const Vec3> to, double reach,
              std::span<const std::uint32_t> also);
  /// Vertices of candidates, and those of `also`, ascending.
  std::span<const std::uint32_t> vertices() const { return vertices_; }
  /// Where the ways began.
  std::span<const Vec3> from() const { return from_; }
  std::uint64_t searches() const { return searches_; }

  /// Candidates whose gap at x may be `range` or less. \return valid until the next call
  const collision::Candidates& near(std::span<const Vec3> x, double range) {
    return filter_.select(x, range);
  }
  /// Largest part of the ways along which no surfaces use up more than a part of their gap.
  /// \pre only vertices() have ways
  double free_part(std::span<const Vec3> from, std::span<const Vec3> to);
  /// Whether that is all of the ways.
  bool keep_gaps(std::span<const Vec3> from, std::span<const Vec3> to);
  /// Whether no surfaces meet on these ways.
  bool are_free(std::span<const Vec3> from, std::span<const Vec3> to);

  /// Whether all vertices at x, or those of vertices(), are within `room` of their ways.
  bool cover(std::span<const Vec3> x, double room) const;
  bool cover_own(std::span<const Vec3> x, double room) const;

private:
  bool covers(std::uint32_t vertex, const Vec3& x, double room) const;
  collision::Separation kept_gaps() const;

  const Island& island_;
  collision::BroadPhase& broad_phase_;
  const Parameters& parameters_;
  collision::Candidates candidates_;
  collision::CandidateFilter filter_;
  std::vector<std::uint32_t> vertices_;
  std::vector<Vec3> from_, way_;
  std::uint64_t searches_ = 0;
};

} // namespace gewebe::contact
