#include "stuffing/background_internal.h"

#include "base/error.h"
#include "stuffing/stencils_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace gewebe::stuffing {
namespace {

constexpr std::uint32_t none = BackgroundSurface::none;

/// Numbers of nodes and of cuts: on the boundary first, then inside.
struct Numbers {
  std::vector<std::uint32_t> node, cut; ///< by background node, by edge
  std::uint32_t on_surface = 0, all = 0;
};

/// Nodes of tetrahedra that are at least partly inside.
std::vector<bool> used_nodes(const Background& background, const BackgroundSurface& surface) {
  std::vector<bool> used(background.nodes.size());
  for (const Tetrahedron& t : background.tetrahedra)
    if (std::ranges::any_of(t, [&](std::uint32_t n) { return surface.sign(n) > 0; }))
      for (const std::uint32_t corner : t)
        if (surface.sign(corner) >= 0)
          used[corner] = true;
  return used;
}

class Cutter {
public:
  Cutter(const StuffingLattice& lattice, const Background& background, unsigned levels,
         const BackgroundSurface& surface)
      : lattice_(lattice), background_(background), surface_(surface), levels_(levels) {}

  tetrahedra::TetMesh cut(StuffingReport& report) {
    number(report);
    place(report);
    for (const Tetrahedron& t : background_.tetrahedra)
      cut(t);
    if (lattice_.to_world.determinant() < 0)
      for (Tetrahedron& t : mesh_.tetrahedra)
        std::swap(t[2], t[3]);
    return std::move(mesh_);
  }

private:
  void number(StuffingReport& report) {
    const NodeTetrahedra tetrahedra(background_, surface_);
    const std::vector<bool> used = used_nodes(background_, surface_);
    numbers_.node.assign(background_.nodes.size(), none);
    numbers_.cut.assign(surface_.edges.size(), none);
    std::uint64_t count = 0;
    for (std::uint32_t n = 0; n < background_.nodes.size(); ++n) {
      report.refused_warps += surface_.refused[n] ? 1 : 0;
      if (surface_.warped(n)) {
        if (used[n] && meeting(background_, surface_, tetrahedra, n) == Meeting::boundary) {
          numbers_.node[n] = static_cast<std::uint32_t>(count++);
          ++report.warped;
        }
      } else if (surface_.inside[n])
        for (const std::uint32_t e : surface_.edges_of(n))
          if (surface_.is_cut(surface_.edges[e])) {
            numbers_.cut[e] = static_cast<std::uint32_t>(count++);
            ++report.cut_nodes;
          }
    }
    numbers_.on_surface = static_cast<std::uint32_t>(count);
    report.surface_nodes = count;
    for (std::uint32_t n = 0; n < background_.nodes.size(); ++n)
      if (used[n] && numbers_.node[n] == none)
        numbers_.node[n] = static_cast<std::uint32_t>(count++);
    if (count >= UINT32_MAX)
      throw Error("the mesh has more than 2^32 - 2 nodes, expected a larger --cell");
    numbers_.all = static_cast<std::uint32_t>(count);
  }

  Vec3 on_edge(const BackgroundSurface::Edge& edge, double share) const {
    const Vec3 from = background_place(background_.nodes[edge.inside], levels_),
               to = background_place(background_.nodes[edge.outside], levels_);
    return from + (to - from) * share;
  }

  void place(StuffingReport& report) {
    mesh_.points.resize(numbers_.all);
    for (std::uint32_t n = 0; n < background_.nodes.size(); ++n) {
      if (numbers_.node[n] == none)
        continue;
      Vec3 at = background_place(background_.nodes[n], levels_);
      if (surface_.warped(n)) {
        const BackgroundSurface::Edge& edge = surface_.edges[surface_.warp[n]];
        at = on_edge(edge, edge.cut);
      }
      mesh_.points[numbers_.node[n]] = lattice_.to_world.to_world(at);
    }
    for (std::size_t e = 0; e < surface_.edges.size(); ++e) {
      if (numbers_.cut[e] == none)
        continue;
      const BackgroundSurface::Edge& edge = surface_.edges[e];
      const double share = std::clamp(edge.cut, edge.least, edge.largest);
      const double shift = std::fabs(share - edge.cut) * norm(on_edge(edge, 1) - on_edge(edge, 0));
      report.largest_shift = std::max(report.largest_shift, shift * lattice_.cell);
      mesh_.points[numbers_.cut[e]] = lattice_.to_world.to_world(on_edge(edge, share));
    }
  }

  void cut(const Tetrahedron& corners) {
    std::array<int, 4> signs{};
    bool some = false;
    for (std::size_t n = 0; n < 4; ++n) {
      signs[n] = surface_.sign(corners[n]);
      some = some || signs[n] > 0;
    }
    if (!some)
      return;
    const Stencil& one = stencil(signs, order(corners, signs));
    const bool other = one.choice && least_angle(one, one.other, corners) >
                                         least_angle(one, one.tetrahedra, corners);
    for (std::size_t n = 0; n < one.count; ++n)
      mesh_.tetrahedra.push_back(nodes_of((other ? one.other : one.tetrahedra)[n], corners));
  }

  /// As on the body-centred lattice a diagonal ends at the cut point on the longer edge.
  DiagonalOrder order(const Tetrahedron& corners, const std::array<int, 4>& signs) const {
    DiagonalOrder result{};
    for (std::size_t n = 0; n < 4; ++n) {
      if (signs[n] >= 0)
        continue;
      std::array<std::pair<std::int64_t, std::uint32_t>, 4> keys{};
      for (std::size_t p = 0; p < 4; ++p) {
        std::int64_t squared = 0;
        for (std::size_t a = 0; a < 3; ++a) {
          const std::int64_t step = std::int64_t{background_.nodes[corners[p]].place[a]} -
                                    background_.nodes[corners[n]].place[a];
          squared += step * step;
        }
        keys[p] = {squared, corners[p]};
      }
      for (std::size_t p = 0; p < 4; ++p)
        for (std::size_t q = 0; q < 4; ++q)
          result[n][p] = static_cast<std::uint8_t>(result[n][p] + (keys[q] < keys[p] ? 1 : 0));
    }
    return result;
  }

  Tetrahedron nodes_of(const std::array<StencilNode, 4>& of, const Tetrahedron& corners) const {
    Tetrahedron result{};
    for (std::size_t n = 0; n < 4; ++n)
      result[n] = of[n].is_cut() ? cut_node(corners[of[n].inner()], corners[of[n].outer()])
                                 : numbers_.node[corners[of[n].code]];
    return result;
  }
  std::uint32_t cut_node(std::uint32_t inside, std::uint32_t outside) const {
    for (const std::uint32_t e : surface_.edges_of(inside))
      if (surface_.edges[e].outside == outside)
        return numbers_.cut[e];
    return none;
  }

  double least_angle(const Stencil& stencil, const StencilTetrahedra& tetrahedra,
                     const Tetrahedron& corners) const {
    double largest = -1; // cosine
    for (std::size_t n = 0; n < stencil.count; ++n) {
      const Tetrahedron t = nodes_of(tetrahedra[n], corners);
      largest = std::max(largest, least_angle_cosine({mesh_.points[t[0]], mesh_.points[t[1]],
                                                      mesh_.points[t[2]], mesh_.points[t[3]]}));
    }
    return -largest;
  }

  const StuffingLattice& lattice_;
  const Background& background_;
  const BackgroundSurface& surface_;
  unsigned levels_;
  Numbers numbers_;
  tetrahedra::TetMesh mesh_;
};

} // namespace

tetrahedra::TetMesh cut_background(const StuffingLattice& lattice, const Background& background,
                                   unsigned levels, const BackgroundSurface& surface,
                                   StuffingReport& report) {
  return Cutter(lattice, background, levels, surface).cut(report);
}

} // namespace gewebe::stuffing
