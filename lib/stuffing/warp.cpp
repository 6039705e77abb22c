#include "stuffing/warp_internal.h"

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "stuffing/cut_finder_internal.h"

#include <algorithm>

namespace gewebe::stuffing {
namespace {

constexpr std::size_t grain = 1024;

/// Fills in all but cuts and warps.
void gather(const Context& context, const StuffingBlocks& blocks,
            std::vector<BoundaryLatticePoint>& points) {
  parallel_blocks(context, blocks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const StuffingBlock& block = blocks[n];
      std::uint32_t next = block.first_surface;
      for_each_point(block.surface.set(), [&](unsigned word, unsigned bit) {
        BoundaryLatticePoint& point = points[next++];
        point.block = static_cast<std::uint32_t>(n);
        point.word = static_cast<std::uint16_t>(word);
        point.bit = static_cast<std::uint16_t>(bit);
        point.inside = block.in(word, bit);
        for (unsigned d = 0; d < bcc::directions; ++d) {
          const PlaceInBlock there = neighbour(block, word, bit, d);
          point.neighbours[d] = BoundaryLatticePoint::none;
          if (there.block == StuffingBlock::none)
            continue;
          const StuffingBlock& other = blocks[there.block];
          if (other.surface.contains(there.word, there.bit))
            point.neighbours[d] = other.surface_point(there.word, there.bit);
        }
      });
    }
  });
}

void find_cuts(const Context& context, const volume::Grid& grid, const StuffingLattice& lattice,
               const StuffingBlocks& blocks, SurfacePoints& surface) {
  std::vector<BoundaryLatticePoint>& points = surface.points;
  parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
    CutFinder finder(grid, lattice);
    for (std::size_t n = begin; n < end; ++n) {
      BoundaryLatticePoint& point = points[n];
      if (!point.inside)
        continue;
      const Vec3 place = bcc::position(point_at(blocks[point.block], point.word, point.bit));
      const Vec3 index = lattice.to_index.to_world(place);
      const double excess = finder.excess(index);
      for (unsigned d = 0; d < bcc::directions; ++d)
        if (surface.other_side(point, d))
          point.cuts[d] =
              finder.find(index, lattice.to_index.to_world(place + bcc::step(d)), excess);
    }
  });
  // The other ends see the same cuts.
  parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      BoundaryLatticePoint& point = points[n];
      for (unsigned d = 0; d < bcc::directions; ++d)
        if (!point.inside && surface.other_side(point, d))
          point.cuts[d] = 1 - points[point.neighbours[d]].cuts[bcc::opposite(d)];
    }
  });
}

void warp(const Context& context, const StuffingBlocks& blocks, SurfacePoints& surface) {
  std::vector<BoundaryLatticePoint>& points = surface.points;
  for (unsigned turn = 0; turn < bcc::colours; ++turn)
    parallel_blocks(context, points.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        if (bcc::colour(point_at(blocks[points[n].block], points[n].word, points[n].bit)) == turn)
          points[n].warp = violated(surface, points[n]);
    });
}

/// Takes warps back until no point is pinched. It ends, for without any warp none is.
void keep_manifold(const Context& context, SurfacePoints& surface) {
  std::vector<BoundaryLatticePoint>& points = surface.points;
  std::vector<std::uint32_t> asked;
  for (std::size_t n = 0; n < points.size(); ++n)
    if (points[n].warped())
      asked.push_back(static_cast<std::uint32_t>(n));
  while (!asked.empty()) {
    std::vector<std::uint8_t> pinched(asked.size());
    parallel_blocks(context, asked.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        pinched[n] = meeting(surface.link_signs(points[asked[n]])) == Meeting::pinched;
    });
    std::vector<std::uint32_t> next;
    for (std::size_t n = 0; n < asked.size(); ++n)
      if (pinched[n] != 0) {
        points[asked[n]].warp = BoundaryLatticePoint::stays;
        points[asked[n]].refused = true;
      }
    for (std::size_t n = 0; n < asked.size(); ++n)
      if (pinched[n] != 0)
        for (const std::uint32_t neighbour : points[asked[n]].neighbours)
          if (neighbour != BoundaryLatticePoint::none && points[neighbour].warped())
            next.push_back(neighbour);
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    asked.swap(next);
  }
}

} // namespace

LinkSigns SurfacePoints::link_signs(const BoundaryLatticePoint& point) const {
  LinkSigns signs;
  for (unsigned d = 0; d < bcc::directions; ++d) {
    const std::uint32_t n = point.neighbours[d];
    if (n != BoundaryLatticePoint::none && points[n].warped())
      continue;
    const bool in = n == BoundaryLatticePoint::none ? point.inside : points[n].inside;
    (in ? signs.inside : signs.outside) |= 1U << d;
  }
  return signs;
}

// The link of a point is a sphere of 24 triangles. With the signs of its corners it falls into a
// part inside and one outside; the inside is half a ball just if both parts are connected (then the
// curve between them is one), where two triangles are connected across an edge, not at a point.
Meeting meeting(const LinkSigns& signs) {
  const auto is = [](std::uint32_t set, unsigned d) { return (set >> d & 1) != 0; };
  if (signs.inside == 0)
    return Meeting::nothing;
  std::array<bool, 24> has_inside{}, has_outside{};
  for (std::size_t f = 0; f < 24; ++f)
    for (const std::uint8_t d : bcc::link.faces[f]) {
      has_inside[f] = has_inside[f] || is(signs.inside, d);
      has_outside[f] = has_outside[f] || is(signs.outside, d);
    }
  DisjointSets inner(24), outer(24);
  int inner_parts = 0, outer_parts = 0;
  for (std::size_t f = 0; f < 24; ++f) {
    inner_parts += has_inside[f] ? 1 : 0;
    outer_parts += !has_inside[f] || has_outside[f] ? 1 : 0;
  }
  for (const bcc::Link::Edge& edge : bcc::link.edges) {
    const bool in = is(signs.inside, edge.ends[0]) || is(signs.inside, edge.ends[1]);
    const bool out = is(signs.outside, edge.ends[0]) || is(signs.outside, edge.ends[1]);
    const bool on = !in && !out; // then each side is what lies beyond
    const bool beyond0 = is(signs.inside, edge.beyond[0]),
               beyond1 = is(signs.inside, edge.beyond[1]);
    if (in || (on && beyond0 && beyond1))
      inner_parts -= inner.join(edge.faces[0], edge.faces[1]) ? 1 : 0;
    if (out || (on && !beyond0 && !beyond1))
      outer_parts -= outer.join(edge.faces[0], edge.faces[1]) ? 1 : 0;
  }
  if (inner_parts != 1 || outer_parts > 1)
    return Meeting::pinched;
  return outer_parts == 0 ? Meeting::interior : Meeting::boundary;
}

SurfacePoints warp_lattice(const Context& context, const volume::Grid& grid,
                           const StuffingLattice& lattice, const StuffingBlocks& blocks) {
  SurfacePoints surface;
  if (blocks.empty())
    return surface;
  Context quiet = context;
  quiet.progress = nullptr;
  const std::size_t count = blocks.back().first_surface + size(blocks.back().surface.set());
  require_memory(context, static_cast<double>(count) * sizeof(BoundaryLatticePoint),
                 "the lattice points beside the surface");
  surface.points.resize(count);
  gather(quiet, blocks, surface.points);
  find_cuts(quiet, grid, lattice, blocks, surface);
  warp(quiet, blocks, surface);
  keep_manifold(quiet, surface);
  return surface;
}

} // namespace gewebe::stuffing
