#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/parallel.h"
#include "stuffing/background_internal.h"
#include "stuffing/cut_finder_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace gewebe::stuffing {
namespace {

constexpr std::size_t grain = 4096;

Int3 step(const Background& background, std::uint32_t from, std::uint32_t to) {
  const Int3 &a = background.nodes[from].place, &b = background.nodes[to].place;
  return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

double length(const Int3& step) {
  return norm(
      {static_cast<double>(step[0]), static_cast<double>(step[1]), static_cast<double>(step[2])});
}

std::vector<BackgroundSurface::Edge> edges_to_outside(const Background& background,
                                                      const std::vector<bool>& inside) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ends;
  for (const Tetrahedron& t : background.tetrahedra)
    for (const auto& [i, j] : tetrahedra::tetrahedron_edges)
      if (inside[t[i]] != inside[t[j]])
        ends.push_back(inside[t[i]] ? std::pair(t[i], t[j]) : std::pair(t[j], t[i]));
  std::ranges::sort(ends);
  ends.erase(std::ranges::unique(ends).begin(), ends.end());
  std::vector<BackgroundSurface::Edge> edges;
  edges.reserve(ends.size());
  for (const auto& [in, out] : ends) {
    const Int3 along = step(background, in, out);
    const double size = length(along);
    edges.push_back({in, out, 0, least_cut(background.nodes[in], along) / size,
                     1 - least_cut(background.nodes[out], along) / size});
  }
  return edges;
}

void list_edges(std::size_t nodes, BackgroundSurface& surface) {
  surface.first.assign(nodes + 1, 0);
  for (const BackgroundSurface::Edge& edge : surface.edges)
    for (const std::uint32_t end : {edge.inside, edge.outside})
      ++surface.first[end + 1];
  for (std::size_t n = 0; n < nodes; ++n)
    surface.first[n + 1] += surface.first[n];
  surface.of_node.resize(2 * surface.edges.size());
  std::vector<std::uint32_t> next(surface.first.begin(), surface.first.end() - 1);
  for (std::uint32_t e = 0; e < surface.edges.size(); ++e)
    for (const std::uint32_t end : {surface.edges[e].inside, surface.edges[e].outside})
      surface.of_node[next[end]++] = e;
}

/// The edge with the cut that is nearest to the node, of those that come too near, or none.
std::uint32_t violated(const Background& background, const BackgroundSurface& surface,
                       std::uint32_t node) {
  double nearest = HUGE_VAL;
  std::uint32_t result = BackgroundSurface::none;
  for (const std::uint32_t e : surface.edges_of(node)) {
    const BackgroundSurface::Edge& edge = surface.edges[e];
    const bool in = edge.inside == node;
    if (!surface.is_cut(edge) || (in ? edge.cut >= edge.least : edge.cut <= edge.largest))
      continue;
    const double distance =
        (in ? edge.cut : 1 - edge.cut) * length(step(background, edge.inside, edge.outside));
    if (distance < nearest) {
      nearest = distance;
      result = e;
    }
  }
  return result;
}

/// Takes warps back until no node is pinched. It ends, for without any warp none is.
void keep_manifold(const Background& background, BackgroundSurface& surface) {
  const NodeTetrahedra tetrahedra(background, surface);
  std::vector<std::uint32_t> asked;
  for (std::uint32_t n = 0; n < background.nodes.size(); ++n)
    if (surface.warped(n))
      asked.push_back(n);
  while (!asked.empty()) {
    std::vector<std::uint32_t> pinched, next;
    for (const std::uint32_t n : asked)
      if (surface.warped(n) && meeting(background, surface, tetrahedra, n) == Meeting::pinched)
        pinched.push_back(n);
    for (const std::uint32_t n : pinched) {
      surface.warp[n] = BackgroundSurface::none;
      surface.refused[n] = true;
    }
    for (const std::uint32_t n : pinched)
      for (const std::uint32_t t : tetrahedra.of(n))
        for (const std::uint32_t corner : background.tetrahedra[t])
          if (surface.warped(corner))
            next.push_back(corner);
    std::ranges::sort(next);
    next.erase(std::ranges::unique(next).begin(), next.end());
    asked.swap(next);
  }
}

} // namespace

NodeTetrahedra::NodeTetrahedra(const Background& background, const BackgroundSurface& surface)
    : first_(background.nodes.size() + 1) {
  const auto at_surface = [&](std::uint32_t n) { return surface.first[n] < surface.first[n + 1]; };
  for (const Tetrahedron& t : background.tetrahedra)
    for (const std::uint32_t corner : t)
      first_[corner + 1] += at_surface(corner) ? 1 : 0;
  for (std::size_t n = 1; n < first_.size(); ++n)
    first_[n] += first_[n - 1];
  tetrahedra_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t t = 0; t < background.tetrahedra.size(); ++t)
    for (const std::uint32_t corner : background.tetrahedra[t])
      if (at_surface(corner))
        tetrahedra_[next[corner]++] = t;
}

// As for the body-centred lattice: the link is a sphere of triangles, whose parts inside and
// outside must both be connected across edges.
Meeting meeting(const Background& background, const BackgroundSurface& surface,
                const NodeTetrahedra& tetrahedra, std::uint32_t node) {
  struct Side {
    std::array<std::uint32_t, 2> ends{};
    std::uint32_t beyond = 0, face = 0;
  };
  std::vector<Side> sides;
  std::uint32_t faces = 0;
  std::vector<std::uint8_t> has_inside, has_outside;
  for (const std::uint32_t t : tetrahedra.of(node)) {
    Triangle face{};
    std::size_t count = 0;
    for (const std::uint32_t corner : background.tetrahedra[t])
      if (corner != node)
        face[count++] = corner;
    std::ranges::sort(face);
    const auto some = [&](int sign) {
      return std::ranges::any_of(face, [&](std::uint32_t n) { return surface.sign(n) == sign; });
    };
    has_inside.push_back(some(1) ? 1 : 0);
    has_outside.push_back(some(-1) ? 1 : 0);
    for (std::size_t k = 0; k < 3; ++k)
      sides.push_back({{face[k == 0 ? 1 : 0], face[k == 2 ? 1 : 2]}, face[k], faces});
    ++faces;
  }
  std::ranges::sort(sides, {}, [](const Side& side) { return std::pair(side.ends, side.face); });
  DisjointSets inner(faces), outer(faces);
  int inner_parts = 0, outer_parts = 0;
  for (std::size_t f = 0; f < faces; ++f) {
    inner_parts += has_inside[f];
    outer_parts += has_inside[f] == 0 || has_outside[f] != 0 ? 1 : 0;
  }
  if (inner_parts == 0)
    return Meeting::nothing;
  for (std::size_t s = 0; s + 1 < sides.size(); ++s) {
    const Side &one = sides[s], &two = sides[s + 1];
    if (one.ends != two.ends)
      continue;
    const auto some = [&](int sign) {
      return surface.sign(one.ends[0]) == sign || surface.sign(one.ends[1]) == sign;
    };
    const bool in = some(1), out = some(-1), on = !in && !out;
    const bool beyond = surface.sign(one.beyond) > 0, beyond2 = surface.sign(two.beyond) > 0;
    if (in || (on && beyond && beyond2))
      inner_parts -= inner.join(one.face, two.face) ? 1 : 0;
    if (out || (on && !beyond && !beyond2))
      outer_parts -= outer.join(one.face, two.face) ? 1 : 0;
  }
  if (inner_parts != 1 || outer_parts > 1)
    return Meeting::pinched;
  return outer_parts == 0 ? Meeting::interior : Meeting::boundary;
}

Vec3 background_place(const Background::Node& node, unsigned levels) {
  return Vec3{static_cast<double>(node.place[0]), static_cast<double>(node.place[1]),
              static_cast<double>(node.place[2])} *
         std::ldexp(0.5, -static_cast<int>(levels));
}

std::vector<bool> inside_nodes(const Context& context, const volume::Grid& grid,
                               const StuffingLattice& lattice, const Background& background,
                               unsigned levels) {
  std::vector<std::uint8_t> inside(background.nodes.size());
  parallel_blocks(context, inside.size(), grain, [&](std::size_t begin, std::size_t end) {
    CutFinder finder(grid, lattice);
    for (std::size_t n = begin; n < end; ++n) {
      const Vec3 index = lattice.to_index.to_world(background_place(background.nodes[n], levels));
      const double excess = finder.excess(index);
      if (!std::isfinite(excess))
        throw Error("the volume has a value that is not finite near voxel (" +
                    text::number_text(index.x) + ", " + text::number_text(index.y) + ", " +
                    text::number_text(index.z) + ")");
      inside[n] = excess > 0 ? 1 : 0;
    }
  });
  return {inside.begin(), inside.end()};
}

BackgroundSurface warp_background(const Context& context, const volume::Grid& grid,
                                  const StuffingLattice& lattice, const Background& background,
                                  unsigned levels, std::vector<bool> inside) {
  BackgroundSurface surface;
  surface.edges = edges_to_outside(background, inside);
  surface.inside = std::move(inside);
  parallel_blocks(context, surface.edges.size(), grain, [&](std::size_t begin, std::size_t end) {
    CutFinder finder(grid, lattice);
    for (std::size_t e = begin; e < end; ++e) {
      BackgroundSurface::Edge& edge = surface.edges[e];
      const auto index = [&](std::uint32_t n) {
        return lattice.to_index.to_world(background_place(background.nodes[n], levels));
      };
      const Vec3 from = index(edge.inside);
      edge.cut = finder.find(from, index(edge.outside), finder.excess(from));
    }
  });
  list_edges(background.nodes.size(), surface);
  surface.warp.assign(background.nodes.size(), BackgroundSurface::none);
  surface.refused.assign(background.nodes.size(), false);
  for (std::uint32_t n = 0; n < background.nodes.size(); ++n)
    surface.warp[n] = violated(background, surface, n);
  keep_manifold(background, surface);
  return surface;
}

} // namespace gewebe::stuffing
