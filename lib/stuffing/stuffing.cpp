#include "stuffing/stuffing.h"

#include "base/error.h"
#include "base/parallel.h"
#include "stuffing/bcc_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/stencils_internal.h"
#include "stuffing/warp_internal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>

// Based on: Labelle and Shewchuk, Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
// Angles, 2007.

namespace gewebe {
namespace {

constexpr std::size_t blocks_at_once = 8;

/// Numbers of the mesh's nodes.
struct Nodes {
  /// Of surface points: where they lie on the boundary the first is the point's own; then those of
  /// its cuts, by direction.
  std::vector<std::uint32_t> first;
  std::vector<std::uint16_t> cuts; ///< directions with a cut node, of points inside
  std::vector<Meeting> meeting;    ///< of warped points
  std::vector<PointRanks> inner;   ///< by block: nodes inside
  std::vector<std::uint32_t> first_inner;
  std::uint32_t on_surface = 0, all = 0;

  std::uint32_t cut(std::uint32_t point, unsigned direction) const {
    return first[point] +
           static_cast<std::uint32_t>(std::popcount(cuts[point] & ((1U << direction) - 1)));
  }
};

Nodes number_nodes(const Context& context, const StuffingBlocks& blocks,
                   const SurfacePoints& surface) {
  const std::vector<SurfacePoint>& points = surface.points;
  Nodes nodes;
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
      throw Error("the mesh has more than 2^32 - 2 nodes, expected a larger --cell");
  }
  nodes.all = static_cast<std::uint32_t>(count);
  return nodes;
}

/// The points of a block's cells, those on its far sides included.
struct BlockPoints {
  static constexpr unsigned dim = leaf_dim + 1, count = 2 * dim * dim * dim;
  static constexpr unsigned at(unsigned kind, unsigned i, unsigned j, unsigned k) {
    return ((kind * dim + i) * dim + j) * dim + k;
  }
  std::array<int, count> sign{};
  std::array<std::uint32_t, count> node{};    ///< where the sign isn't -1
  std::array<std::uint32_t, count> surface{}; ///< number of the surface point
};

void gather(const StuffingBlocks& blocks, const SurfacePoints& surface, const Nodes& nodes,
            const StuffingBlock& block, BlockPoints& points) {
  unsigned n = 0;
  for (unsigned kind = 0; kind < 2; ++kind)
    for (int i = 0; i <= leaf_dim; ++i)
      for (int j = 0; j <= leaf_dim; ++j)
        for (int k = 0; k <= leaf_dim; ++k, ++n) {
          const PlaceInBlock place = locate(block, kind, {i, j, k});
          points.sign[n] = -1;
          if (place.block == StuffingBlock::none)
            continue;
          const StuffingBlock& there = blocks[place.block];
          if (!there.surface.contains(place.word, place.bit)) {
            if (!there.in(place.word, place.bit))
              continue;
          } else {
            const std::uint32_t point = there.surface_point(place.word, place.bit);
            points.surface[n] = point;
            if (surface.points[point].warped()) {
              points.sign[n] = 0;
              points.node[n] = nodes.first[point];
              if (nodes.meeting[point] != Meeting::interior)
                continue;
            } else if (!surface.points[point].inside)
              continue;
          }
          if (points.sign[n] != 0)
            points.sign[n] = 1;
          points.node[n] =
              nodes.first_inner[place.block] + nodes.inner[place.block].rank(place.word, place.bit);
        }
}

double least_angle_cosine(const std::array<Vec3, 4>& p) {
  std::array<Vec3, 4> normals;
  for (std::size_t f = 0; f < 4; ++f) {
    const auto& face = tetrahedron_faces[f];
    const Vec3 normal = cross(p[face[1]] - p[face[0]], p[face[2]] - p[face[0]]);
    normals[f] = normal / norm(normal);
  }
  double largest = -1;
  for (std::size_t f = 0; f < 4; ++f)
    for (std::size_t g = 0; g < f; ++g)
      largest = std::max(largest, -dot(normals[f], normals[g]));
  return largest;
}

/// The tetrahedra of a block's cells, by cell, then as in bcc::cell_tetrahedra, then by stencil.
class BlockCutter {
public:
  explicit BlockCutter(const Nodes& nodes) : nodes_(nodes) {
    for (unsigned n = 0; n < bcc::cell_points; ++n) {
      const bcc::Point point = bcc::cell_point(n);
      offset_[n] = BlockPoints::at(point.kind, static_cast<unsigned>(point.place[0]),
                                   static_cast<unsigned>(point.place[1]),
                                   static_cast<unsigned>(point.place[2]));
    }
  }

  /// Calls visit(stencil, tetrahedron of the cell, its four points) for what isn't outside.
  template <class Visit>
  void for_each(const BlockPoints& points, Visit&& visit) const {
    for (unsigned i = 0; i < leaf_dim; ++i)
      for (unsigned j = 0; j < leaf_dim; ++j)
        for (unsigned k = 0; k < leaf_dim; ++k) {
          const unsigned base = BlockPoints::at(0, i, j, k);
          const bool even = ((i + j + k) & 1) == 0; // so is the sum of a block's origin
          int inside = 0;
          for (const unsigned offset : offset_)
            inside += points.sign[base + offset] > 0 ? 1 : 0;
          if (inside == 0)
            continue;
          for (std::size_t t = 0; t < 12; ++t) {
            std::array<unsigned, 4> at{};
            std::array<int, 4> signs{};
            for (std::size_t c = 0; c < 4; ++c) {
              at[c] = base + offset_[bcc::cell_tetrahedra[t][c]];
              signs[c] = points.sign[at[c]];
            }
            const unsigned octant = bcc::cell_tetrahedra[t][2] - 4U;
            const Stencil& cut = stencil(signs, even, even == ((std::popcount(octant) & 1) == 0));
            if (cut.count != 0)
              visit(cut, t, at);
          }
        }
  }

  Tetrahedron nodes_of(const std::array<StencilNode, 4>& of, std::size_t t,
                       const std::array<unsigned, 4>& at, const BlockPoints& points) const {
    Tetrahedron result{};
    for (std::size_t n = 0; n < 4; ++n) {
      const StencilNode node = of[n];
      result[n] = node.is_cut() ? nodes_.cut(points.surface[at[node.inner()]],
                                             bcc::cell_directions[t][node.inner()][node.outer()])
                                : points.node[at[node.code]];
    }
    return result;
  }

private:
  const Nodes& nodes_;
  std::array<unsigned, bcc::cell_points> offset_{};
};

/// The better of both ways to cut.
const StencilTetrahedra& better(const Stencil& cut, std::size_t t,
                                const std::array<unsigned, 4>& at, const BlockPoints& block,
                                const BlockCutter& cutter, const std::vector<Vec3>& points) {
  const auto worst = [&](const StencilTetrahedra& tetrahedra) {
    double largest = -1;
    for (std::size_t n = 0; n < cut.count; ++n) {
      const Tetrahedron nodes = cutter.nodes_of(tetrahedra[n], t, at, block);
      largest = std::max(largest, least_angle_cosine({points[nodes[0]], points[nodes[1]],
                                                      points[nodes[2]], points[nodes[3]]}));
    }
    return largest;
  };
  return worst(cut.tetrahedra) <= worst(cut.other) ? cut.tetrahedra : cut.other;
}

void write_points(const Context& context, const StuffingLattice& lattice,
                  const StuffingBlocks& blocks, const SurfacePoints& surface, const Nodes& nodes,
                  std::vector<Vec3>& points, double& largest_shift) {
  std::vector<double> shifts((blocks.size() + blocks_at_once - 1) / blocks_at_once);
  parallel_blocks(context, blocks.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    double& shift = shifts[begin / blocks_at_once];
    for (std::size_t b = begin; b < end; ++b) {
      const StuffingBlock& block = blocks[b];
      std::uint32_t n = block.first_surface;
      for_each_point(block.surface.set(), [&](unsigned word, unsigned bit) {
        const SurfacePoint& point = surface.points[n];
        const Vec3 place = bcc::position(point_at(block, word, bit));
        if (nodes.meeting[n] == Meeting::boundary)
          points[nodes.first[n]] =
              lattice.to_world.to_world(place + bcc::step(point.warp) * point.cuts[point.warp]);
        std::uint32_t node = nodes.first[n];
        for (unsigned rest = nodes.cuts[n]; rest != 0; rest &= rest - 1) {
          const auto d = static_cast<unsigned>(std::countr_zero(rest));
          const double alpha = bcc::alpha(d), share = std::clamp(point.cuts[d], alpha, 1 - alpha);
          shift = std::max(shift, std::fabs(share - point.cuts[d]) * norm(bcc::step(d)));
          points[node++] = lattice.to_world.to_world(place + bcc::step(d) * share);
        }
        ++n;
      });
      std::uint32_t node = nodes.first_inner[b];
      for_each_point(nodes.inner[b].set(), [&](unsigned word, unsigned bit) {
        Vec3 place = bcc::position(point_at(block, word, bit));
        if (block.surface.contains(word, bit)) {
          const SurfacePoint& point = surface.points[block.surface_point(word, bit)];
          if (point.warped())
            place += bcc::step(point.warp) * point.cuts[point.warp];
        }
        points[node++] = lattice.to_world.to_world(place);
      });
    }
  });
  largest_shift = 0;
  for (const double shift : shifts)
    largest_shift = std::max(largest_shift, shift * lattice.cell);
}

void write_tetrahedra(const Context& context, const StuffingLattice& lattice,
                      const StuffingBlocks& blocks, const SurfacePoints& surface,
                      const Nodes& nodes, TetMesh& mesh) {
  Context quiet = context;
  quiet.progress = nullptr;
  const BlockCutter cutter(nodes);
  std::vector<std::uint64_t> first(blocks.size() + 1);
  parallel_blocks(quiet, blocks.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    const auto points = std::make_unique<BlockPoints>();
    for (std::size_t b = begin; b < end; ++b) {
      gather(blocks, surface, nodes, blocks[b], *points);
      cutter.for_each(*points, [&](const Stencil& cut, std::size_t,
                                   const std::array<unsigned, 4>&) { first[b + 1] += cut.count; });
    }
  });
  for (std::size_t b = 0; b < blocks.size(); ++b)
    first[b + 1] += first[b];
  if (first.back() >= UINT32_MAX)
    throw Error("the mesh has more than 2^32 - 2 tetrahedra, expected a larger --cell");
  require_memory(context, static_cast<double>(first.back()) * sizeof(Tetrahedron),
                 "the tetrahedra");
  mesh.tetrahedra.resize(first.back());
  const bool mirrored = lattice.to_world.determinant() < 0;
  parallel_blocks(context, blocks.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    const auto points = std::make_unique<BlockPoints>();
    for (std::size_t b = begin; b < end; ++b) {
      if (first[b] == first[b + 1])
        continue;
      gather(blocks, surface, nodes, blocks[b], *points);
      Tetrahedron* next = mesh.tetrahedra.data() + first[b];
      cutter.for_each(
          *points, [&](const Stencil& cut, std::size_t t, const std::array<unsigned, 4>& at) {
            const StencilTetrahedra& tetrahedra =
                cut.choice ? better(cut, t, at, *points, cutter, mesh.points) : cut.tetrahedra;
            for (std::size_t n = 0; n < cut.count; ++n, ++next) {
              *next = cutter.nodes_of(tetrahedra[n], t, at, *points);
              if (mirrored)
                std::swap((*next)[2], (*next)[3]);
            }
          });
    }
  });
}

} // namespace

TetMesh stuff(const Context& context, const Grid& grid, const StuffingOptions& options,
              StuffingReport* report) {
  const StuffingLattice lattice = stuffing_lattice(grid, options.isovalue, options.cell);
  const StuffingBlocks blocks = stuffing_blocks(context, grid, lattice);
  const SurfacePoints surface = warp_lattice(context, grid, lattice, blocks);
  Context quiet = context;
  quiet.progress = nullptr;
  const Nodes nodes = number_nodes(quiet, blocks, surface);
  require_memory(context, static_cast<double>(nodes.all) * sizeof(Vec3), "the nodes");
  TetMesh mesh;
  mesh.points.resize(nodes.all);
  double shift = 0;
  write_points(quiet, lattice, blocks, surface, nodes, mesh.points, shift);
  write_tetrahedra(context, lattice, blocks, surface, nodes, mesh);
  if (report != nullptr) {
    *report = {};
    report->cell = lattice.cell;
    report->surface_nodes = nodes.on_surface;
    report->largest_shift = shift;
    for (std::size_t n = 0; n < surface.points.size(); ++n) {
      report->warped += nodes.meeting[n] == Meeting::boundary ? 1 : 0;
      report->refused_warps += surface.points[n].refused ? 1 : 0;
      report->cut_nodes += static_cast<std::uint64_t>(std::popcount(nodes.cuts[n]));
    }
  }
  return mesh;
}

} // namespace gewebe
