#pragma once
// Faces by the points that they have corners among: what depends on all faces round a point is
// found range by range of points, on several threads and in cache, where the numbers of points and
// faces follow their places.

#include "base/context.h"
#include "geometry/mesh.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::mesh {

/// Keeps the triangles' span, and looks at it once to begin with.
class FaceRanges {
public:
  /// \pre corners are below `points`
  FaceRanges(std::span<const Triangle> triangles, std::size_t points, const Context& context);

  /// How many points make a range, by the mesh alone: so few that what meets there stays in cache,
  /// if faces are not looked at too often for that.
  std::size_t grain() const { return grain_; }

  /// Calls use(first, stop, whole) for blocks of faces [first, stop), ascending, among which all
  /// are that have a corner among the points [begin, end); `whole` if they have all their corners
  /// there.
  template <class Use>
  void for_each_block(std::size_t begin, std::size_t end, const Use& use) const {
    for (std::size_t block = 0; block < reach_.size(); ++block) {
      const Reach& reach = reach_[block];
      if (reach.high >= begin && reach.low < end)
        use(block * faces_of_block, std::min(triangles_.size(), (block + 1) * faces_of_block),
            reach.low >= begin && reach.high < end);
    }
  }

private:
  static constexpr std::size_t faces_of_block = 8192;
  /// Points that a block of faces has corners among.
  struct Reach {
    std::uint32_t low = UINT32_MAX, high = 0;
  };

  std::span<const Triangle> triangles_;
  std::vector<Reach> reach_;
  std::size_t grain_ = 4 * faces_of_block;
};

} // namespace gewebe::mesh
