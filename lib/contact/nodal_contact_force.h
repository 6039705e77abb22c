#pragma once
// Contact forces on nodes of an object, as results tell them.

#include "geometry/vec3.h"

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

namespace gewebe::contact {

/// In place of an instrument's number: a surface, of another object or the object's own.
inline constexpr std::uint32_t other_surface = UINT32_MAX;

struct NodalContactForce {
  std::uint32_t node = 0;
  std::uint32_t instrument = 0; ///< that it comes from, or other_surface
  Vec3 force;                   ///< on the node, 1e-6 N

  bool operator==(const NodalContactForce&) const = default;
};

/// One for each node and instrument, by ascending ones, with the sum of its forces in their order.
inline std::vector<NodalContactForce> sums_of(std::vector<NodalContactForce> forces) {
  const auto key = [](const NodalContactForce& f) { return std::pair(f.node, f.instrument); };
  std::ranges::stable_sort(forces, {}, key);
  std::vector<NodalContactForce> sums;
  for (const NodalContactForce& f : forces)
    if (!sums.empty() && key(sums.back()) == key(f))
      sums.back().force += f.force;
    else
      sums.push_back(f);
  return sums;
}

} // namespace gewebe::contact
