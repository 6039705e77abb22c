#include "stuffing/stuffing.h"

#include "base/error.h"
#include "base/parallel.h"
#include "stuffing/bcc_internal.h"
#include "stuffing/grading_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/numbering_internal.h"
#include "stuffing/stencils_internal.h"
#include "stuffing/warp_internal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <string>

// Based on: Labelle and Shewchuk, Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
// Angles, 2007.

namespace gewebe {
namespace {

constexpr std::size_t blocks_at_once = 8;

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

void gather(const StuffingBlocks& blocks, const SurfacePoints& surface, const StuffingNodes& nodes,
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

/// The tetrahedra of a block's cells, by cell, then as in bcc::cell_tetrahedra, then by stencil;
/// with a grading those between leaves in their place.
class BlockCutter {
public:
  BlockCutter(const Grading& grading, const StuffingNodes& nodes)
      : grading_(grading), nodes_(nodes) {
    for (unsigned n = 0; n < bcc::cell_points; ++n) {
      const bcc::Point point = bcc::cell_point(n);
      offset_[n] = BlockPoints::at(point.kind, static_cast<unsigned>(point.place[0]),
                                   static_cast<unsigned>(point.place[1]),
                                   static_cast<unsigned>(point.place[2]));
    }
  }

  /// Calls cut(stencil, tetrahedron of the cell, its four points) for what isn't outside, and
  /// whole(nodes) for a tetrahedron between leaves that aren't both single cells.
  template <class Cut, class Whole>
  void for_each(const StuffingBlock& block, const BlockPoints& points, Cut&& cut,
                Whole&& whole) const {
    const bool fine = grading_.none() || grading_.is_fine(block);
    for (unsigned i = 0; i < leaf_dim; ++i)
      for (unsigned j = 0; j < leaf_dim; ++j)
        for (unsigned k = 0; k < leaf_dim; ++k) {
          const unsigned base = BlockPoints::at(0, i, j, k);
          int inside = 0;
          for (const unsigned offset : offset_)
            inside += points.sign[base + offset] > 0 ? 1 : 0;
          if (inside == 0)
            continue;
          if (fine)
            cut_cell(points, i, j, k, 0, 3, cut);
          else
            cut_leaf(block, points, i, j, k, cut, whole);
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
  /// Those round the long edges from a cell's centre along axes begin … end - 1.
  template <class Cut>
  void cut_cell(const BlockPoints& points, unsigned i, unsigned j, unsigned k, std::size_t begin,
                std::size_t end, Cut&& cut) const {
    const unsigned base = BlockPoints::at(0, i, j, k);
    const bool even = ((i + j + k) & 1) == 0; // so is the sum of a block's origin
    for (std::size_t t = 4 * begin; t < 4 * end; ++t) {
      std::array<unsigned, 4> at{};
      std::array<int, 4> signs{};
      for (std::size_t c = 0; c < 4; ++c) {
        at[c] = base + offset_[bcc::cell_tetrahedra[t][c]];
        signs[c] = points.sign[at[c]];
      }
      const unsigned octant = bcc::cell_tetrahedra[t][2] - 4U;
      const Stencil& of = stencil(signs, even, even == ((std::popcount(octant) & 1) == 0));
      if (of.count != 0)
        cut(of, t, at);
    }
  }

  template <class Cut, class Whole>
  void cut_leaf(const StuffingBlock& block, const BlockPoints& points, unsigned i, unsigned j,
                unsigned k, Cut&& cut, Whole&& whole) const {
    const Int3 cell{static_cast<int>(i), static_cast<int>(j), static_cast<int>(k)};
    const unsigned level = grading_.level(block, cell);
    if (((i | j | k) & ((1U << level) - 1)) != 0)
      return;
    for (unsigned axis = 0; axis < 3; ++axis) {
      Int3 next = cell;
      ++next[axis];
      if (level == 0 && grading_.level(block, next) == 0) {
        cut_cell(points, i, j, k, axis, axis + 1, cut);
        continue;
      }
      for_each_between(
          grading_, block, cell, axis,
          [&](const Int3& corner) {
            return find(block, {0, corner}).is_node;
          },
          [&](const LatticeTetrahedron& tetrahedron) {
            Tetrahedron result{};
            for (std::size_t n = 0; n < 4; ++n)
              result[n] = find(block, tetrahedron[n]).number;
            whole(result);
          });
    }
  }

  struct Found {
    bool is_node = false;
    std::uint32_t number = 0;
  };
  Found find(const StuffingBlock& block, const bcc::Point& point) const {
    const PlaceInBlock place = locate(block, point.kind, point.place);
    if (place.block == StuffingBlock::none)
      return {};
    const PointRanks& inner = nodes_.inner[place.block];
    return {inner.contains(place.word, place.bit),
            nodes_.first_inner[place.block] + inner.rank(place.word, place.bit)};
  }

  const Grading& grading_;
  const StuffingNodes& nodes_;
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
                  const StuffingBlocks& blocks, const SurfacePoints& surface,
                  const StuffingNodes& nodes, std::vector<Vec3>& points, double& largest_shift) {
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
                      const StuffingBlocks& blocks, const Grading& grading,
                      const SurfacePoints& surface, const StuffingNodes& nodes, TetMesh& mesh) {
  Context quiet = context;
  quiet.progress = nullptr;
  const BlockCutter cutter(grading, nodes);
  std::vector<std::uint64_t> first(blocks.size() + 1);
  parallel_blocks(quiet, blocks.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    const auto points = std::make_unique<BlockPoints>();
    for (std::size_t b = begin; b < end; ++b) {
      gather(blocks, surface, nodes, blocks[b], *points);
      cutter.for_each(
          blocks[b], *points,
          [&](const Stencil& cut, std::size_t, const std::array<unsigned, 4>&) {
            first[b + 1] += cut.count;
          },
          [&](const Tetrahedron&) { ++first[b + 1]; });
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
      const auto add = [&](Tetrahedron tetrahedron) {
        if (mirrored)
          std::swap(tetrahedron[2], tetrahedron[3]);
        *next++ = tetrahedron;
      };
      cutter.for_each(
          blocks[b], *points,
          [&](const Stencil& cut, std::size_t t, const std::array<unsigned, 4>& at) {
            const StencilTetrahedra& tetrahedra =
                cut.choice ? better(cut, t, at, *points, cutter, mesh.points) : cut.tetrahedra;
            for (std::size_t n = 0; n < cut.count; ++n)
              add(cutter.nodes_of(tetrahedra[n], t, at, *points));
          },
          add);
    }
  });
}

} // namespace

TetMesh stuff(const Context& context, const Grid& grid, const StuffingOptions& options,
              StuffingReport* report) {
  if (options.grade > stuffing_grade_max)
    throw Error("a grade of " + std::to_string(options.grade) + ", expected 0 to " +
                std::to_string(stuffing_grade_max));
  const StuffingLattice lattice = stuffing_lattice(grid, options.isovalue, options.cell);
  const StuffingBlocks blocks = stuffing_blocks(context, grid, lattice);
  const SurfacePoints surface = warp_lattice(context, grid, lattice, blocks);
  Context quiet = context;
  quiet.progress = nullptr;
  const Grading grading = grade_blocks(quiet, blocks, options.grade);
  const StuffingNodes nodes = number_nodes(quiet, blocks, grading, surface);
  require_memory(context, static_cast<double>(nodes.all) * sizeof(Vec3), "the nodes");
  TetMesh mesh;
  mesh.points.resize(nodes.all);
  double shift = 0;
  write_points(quiet, lattice, blocks, surface, nodes, mesh.points, shift);
  write_tetrahedra(context, lattice, blocks, grading, surface, nodes, mesh);
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
