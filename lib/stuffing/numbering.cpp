#include "stuffing/numbering_internal.h"

#include "base/error.h"
#include "base/parallel.h"

namespace gewebe::stuffing {
namespace {
constexpr const char* too_many = "the mesh has more than 2^32 - 2 nodes, expected a larger --cell";
} // namespace

StuffingNodes number_nodes(const Context& context, const StuffingBlocks& blocks,
                           const Grading& grading, const SurfacePoints& surface,
                           const MaterialInterface& interface) {
  const std::vector<BoundaryLatticePoint>& points = surface.points;
  StuffingNodes nodes;
  nodes.first.resize(points.size());
  nodes.cuts.resize(points.size());
  nodes.meeting.resize(points.size(), Meeting::nothing);
  parallel_blocks(context, points.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (points[n].warped())
        nodes.meeting[n] = meeting(surface.link_signs(points[n]));
      else if (points[n].inside)
        for (unsigned d = 0; d < bcc::directions; ++d)
          if (surface.is_cut(points[n], d))
            nodes.cuts[n] = static_cast<std::uint16_t>(nodes.cuts[n] | 1U << d);
    }
  });
  std::uint64_t count = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    nodes.first[n] = static_cast<std::uint32_t>(count);
    count += nodes.meeting[n] == Meeting::boundary
                 ? 1
                 : static_cast<std::uint32_t>(std::popcount(nodes.cuts[n]));
  }
  nodes.on_surface = static_cast<std::uint32_t>(count);
  nodes.inner.resize(blocks.size());
  nodes.first_inner.resize(blocks.size());
  parallel_blocks(context, blocks.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      PointSet set = blocks[b].inside;
      if (!grading.none() && size(set) != 0 && !grading.is_fine(blocks[b])) {
        const PointSet of_leaves = leaf_points(grading, blocks[b]);
        for (std::size_t word = 0; word < set.size(); ++word)
          set[word] &= of_leaves[word];
      }
      std::uint32_t n = blocks[b].first_surface;
      for_each_point(blocks[b].surface.set(), [&](unsigned word, unsigned bit) {
        const std::uint64_t here = std::uint64_t{1} << bit;
        if (points[n].warped())
          set[word] = nodes.meeting[n] == Meeting::interior ? set[word] | here : set[word] & ~here;
        ++n;
      });
      nodes.inner[b] = PointRanks(set);
    }
  });
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    nodes.first_inner[b] = static_cast<std::uint32_t>(count);
    count += size(nodes.inner[b].set());
    if (count >= UINT32_MAX)
      throw Error(too_many);
  }
  for (const InterfacePoint& point : interface.points) {
    std::uint16_t cuts = 0;
    for (unsigned d = 0; d < bcc::directions; ++d)
      if (interface.is_cut(point, d) &&
          point.material < interface.points[point.neighbours[d]].material)
        cuts = static_cast<std::uint16_t>(cuts | 1U << d);
    nodes.first_interface.push_back(static_cast<std::uint32_t>(count));
    nodes.interface_cuts.push_back(cuts);
    count += static_cast<std::uint32_t>(std::popcount(cuts));
    if (count >= UINT32_MAX)
      throw Error(too_many);
  }
  nodes.all = static_cast<std::uint32_t>(count);
  return nodes;
}

} // namespace gewebe::stuffing
