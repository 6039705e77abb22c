#include "stuffing/stuffing.h"

#include "base/error.h"
#include "base/parallel.h"
#include "stuffing/background_internal.h"
#include "stuffing/bcc_internal.h"
#include "stuffing/cutter_internal.h"
#include "stuffing/grading_internal.h"
#include "stuffing/interface_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/materials.h"
#include "stuffing/numbering_internal.h"
#include "stuffing/refined_octree_internal.h"
#include "stuffing/stencils_internal.h"
#include "stuffing/warp_internal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <string>

// Based on: Labelle and Shewchuk, Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
// Angles, 2007.

namespace gewebe::stuffing {
namespace {

constexpr std::size_t blocks_at_once = 8;

/// Is the second of both ways to cut the better one?
bool other_is_better(const CutTetrahedron& cut, const BlockCutter& cutter, const BlockPoints& block,
                     const std::vector<Vec3>& points) {
  double worst = -1, worst_other = -1;
  const auto look = [&](const Stencil& side) {
    for (std::size_t n = 0; n < side.count; ++n)
      for (const bool other : {false, true}) {
        const Tetrahedron nodes =
            cutter.nodes_of(other ? side.other[n] : side.tetrahedra[n], cut, block);
        double& largest = other ? worst_other : worst;
        largest = std::max(largest, least_angle_cosine({points[nodes[0]], points[nodes[1]],
                                                        points[nodes[2]], points[nodes[3]]}));
      }
  };
  look(*cut.stencil);
  if (cut.beyond != nullptr)
    look(*cut.beyond);
  return worst_other < worst;
}

void write_boundary_points(const StuffingLattice& lattice, const StuffingParts& parts,
                           const StuffingBlock& block, std::vector<Vec3>& points, double& shift) {
  const StuffingNodes& nodes = parts.nodes;
  std::uint32_t n = block.first_surface;
  for_each_point(block.surface.set(), [&](unsigned word, unsigned bit) {
    const BoundaryLatticePoint& point = parts.surface.points[n];
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
}

void write_inner_points(const StuffingLattice& lattice, const StuffingParts& parts, std::size_t b,
                        std::vector<Vec3>& points) {
  const StuffingBlock& block = parts.blocks[b];
  std::uint32_t node = parts.nodes.first_inner[b];
  for_each_point(parts.nodes.inner[b].set(), [&](unsigned word, unsigned bit) {
    Vec3 place = bcc::position(point_at(block, word, bit));
    if (block.surface.contains(word, bit)) {
      const BoundaryLatticePoint& point = parts.surface.points[block.surface_point(word, bit)];
      if (point.warped())
        place += bcc::step(point.warp) * point.cuts[point.warp];
    }
    if (parts.follows() && block.interface.contains(word, bit)) {
      const InterfacePoint& point = parts.interface.points[block.interface_point(word, bit)];
      if (point.warped())
        place += bcc::step(point.warp) * point.cuts[point.warp];
    }
    points[node++] = lattice.to_world.to_world(place);
  });
}

void write_interface_points(const StuffingLattice& lattice, const StuffingParts& parts,
                            std::vector<Vec3>& points) {
  for (std::size_t n = 0; n < parts.interface.points.size(); ++n) {
    const InterfacePoint& point = parts.interface.points[n];
    const Vec3 place = bcc::position(point_at(parts.blocks[point.block], point.word, point.bit));
    std::uint32_t node = parts.nodes.first_interface[n];
    for (unsigned rest = parts.nodes.interface_cuts[n]; rest != 0; rest &= rest - 1) {
      const auto d = static_cast<unsigned>(std::countr_zero(rest));
      const double alpha = bcc::alpha(d), share = std::clamp(point.cuts[d], alpha, 1 - alpha);
      points[node++] = lattice.to_world.to_world(place + bcc::step(d) * share);
    }
  }
}

/// \return how far a boundary node lies from the surface at most, mm
double write_points(const Context& context, const StuffingLattice& lattice,
                    const StuffingParts& parts, std::vector<Vec3>& points) {
  const std::size_t count = parts.blocks.size();
  std::vector<double> shifts((count + blocks_at_once - 1) / blocks_at_once);
  parallel_blocks(context, count, blocks_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      write_boundary_points(lattice, parts, parts.blocks[b], points,
                            shifts[begin / blocks_at_once]);
      write_inner_points(lattice, parts, b, points);
    }
  });
  write_interface_points(lattice, parts, points);
  double largest = 0;
  for (const double shift : shifts)
    largest = std::max(largest, shift * lattice.cell);
  return largest;
}

/// Where the tetrahedra of each block begin.
std::vector<std::uint64_t> count_tetrahedra(const Context& context, const StuffingParts& parts) {
  const BlockCutter cutter(parts);
  std::vector<std::uint64_t> first(parts.blocks.size() + 1);
  parallel_blocks(
      context, parts.blocks.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
        const auto points = std::make_unique<BlockPoints>();
        for (std::size_t b = begin; b < end; ++b) {
          cutter.gather(b, *points);
          cutter.for_each(
              b, *points, [&](const CutTetrahedron& cut) { first[b + 1] += cut.count(); },
              [&](const Tetrahedron&) { ++first[b + 1]; });
        }
      });
  for (std::size_t b = 0; b < parts.blocks.size(); ++b)
    first[b + 1] += first[b];
  if (first.back() >= UINT32_MAX)
    throw Error("the mesh has more than 2^32 - 2 tetrahedra, expected a larger --cell");
  return first;
}

void write_tetrahedra(const Context& context, const StuffingLattice& lattice,
                      const StuffingParts& parts, const MaterialSource& materials,
                      tetrahedra::TetMesh& mesh) {
  Context quiet = context;
  quiet.progress = nullptr;
  const std::vector<std::uint64_t> first = count_tetrahedra(quiet, parts);
  require_memory(context, static_cast<double>(first.back()) * (sizeof(Tetrahedron) + 4),
                 "the tetrahedra");
  mesh.tetrahedra.resize(first.back());
  if (materials)
    mesh.material.resize(first.back());
  const BlockCutter cutter(parts);
  const bool mirrored = lattice.to_world.determinant() < 0;
  const std::vector<Vec3>& at = mesh.points;
  parallel_blocks(
      context, parts.blocks.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
        const auto points = std::make_unique<BlockPoints>();
        const MaterialAt material_at_place = materials ? materials() : MaterialAt();
        for (std::size_t b = begin; b < end; ++b) {
          if (first[b] == first[b + 1])
            continue;
          cutter.gather(b, *points);
          std::uint64_t next = first[b];
          const auto add = [&](Tetrahedron tetrahedron, std::optional<std::int32_t> material) {
            if (mirrored)
              std::swap(tetrahedron[2], tetrahedron[3]);
            if (materials) {
              const auto& [i, j, k, l] = tetrahedron;
              mesh.material[next] =
                  material ? *material : material_at_place((at[i] + at[j] + at[k] + at[l]) / 4);
            }
            mesh.tetrahedra[next++] = tetrahedron;
          };
          cutter.for_each(
              b, *points,
              [&](const CutTetrahedron& cut) {
                const bool other = cut.stencil->choice && other_is_better(cut, cutter, *points, at);
                const auto add_side = [&](const Stencil& side,
                                          std::optional<std::int32_t> material) {
                  for (std::size_t n = 0; n < side.count; ++n)
                    add(cutter.nodes_of(other ? side.other[n] : side.tetrahedra[n], cut, *points),
                        material);
                };
                add_side(*cut.stencil, cut.material);
                if (cut.beyond != nullptr)
                  add_side(*cut.beyond, cut.material_beyond);
              },
              [&](const Tetrahedron& tetrahedron) { add(tetrahedron, std::nullopt); });
        }
      });
}

void fill_in(StuffingReport& report, const StuffingParts& parts) {
  report.surface_nodes = parts.nodes.on_surface;
  for (std::size_t n = 0; n < parts.surface.points.size(); ++n) {
    report.warped += parts.nodes.meeting[n] == Meeting::boundary ? 1 : 0;
    report.refused_warps += parts.surface.points[n].refused ? 1 : 0;
    report.cut_nodes += static_cast<std::uint64_t>(std::popcount(parts.nodes.cuts[n]));
  }
  for (const std::uint16_t cuts : parts.nodes.interface_cuts)
    report.interface_cuts += static_cast<std::uint64_t>(std::popcount(cuts));
  for (const InterfacePoint& point : parts.interface.points) {
    report.interface_warped += point.warped() ? 1 : 0;
    report.interface_kept += point.on && !point.warped() ? 1 : 0;
  }
}

/// Cells that a node inside has round it but the octree has not, as cubes of the lattice's cells.
std::vector<OctreeCube> open_cells(const StuffingOctree& octree, const Background& background,
                                   const std::vector<bool>& inside, unsigned levels) {
  std::vector<Int3> missing;
  const auto look = [&](const OctreeCube& cube) {
    if (octree.covered(cube))
      return;
    const unsigned up = levels - cube.level;
    missing.push_back({cube.cube[0] >> up, cube.cube[1] >> up, cube.cube[2] >> up});
  };
  for (std::size_t n = 0; n < inside.size(); ++n) {
    if (!inside[n])
      continue;
    const Background::Node& node = background.nodes[n];
    const unsigned level = node.level;
    if (level > levels)
      continue; // deep inside
    const auto cube_of = [&](int back) {
      const auto at = [&](std::size_t a) { return (node.place[a] - back) >> (level + 1); };
      return OctreeCube{level, {at(0), at(1), at(2)}};
    };
    if (node.centre) {
      const OctreeCube cube = cube_of(0);
      for (int k = 0; k < 27; ++k)
        look(cube.neighbour(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1));
    } else
      for (int k = 0; k < 8; ++k)
        look(cube_of(0).neighbour(-(k & 1), -(k >> 1 & 1), -(k >> 2)));
  }
  std::ranges::sort(missing);
  missing.erase(std::ranges::unique(missing).begin(), missing.end());
  std::vector<OctreeCube> cells;
  for (const Int3& cell : missing)
    cells.push_back({levels, cell});
  return cells;
}

tetrahedra::TetMesh stuff_refined(const Context& context, const volume::Grid& grid,
                                  const StuffingOptions& options, const StuffingLattice& lattice,
                                  StuffingReport& report) {
  if (options.follow_interface)
    throw Error("refined cells can't follow the interface between materials, expected stairs");
  const RefinedCells cells(grid, lattice, options);
  const unsigned levels = cells.levels();
  StuffingBlocks blocks = stuffing_blocks(
      context, grid, lattice, [&](const Int3& origin) { return cells.meets_block(origin); });
  for (const StuffingBlock& block : blocks)
    for (const std::int32_t place : block.origin)
      if (std::abs(std::int64_t{place}) + volume::leaf_dim >= std::int64_t{1} << (28 - levels))
        throw Error(
            "the volume has cells beyond index 2^28 of the refined lattice, expected larger "
            "cells or a volume nearer to its origin");
  if (options.materials && options.grade > 0)
    find_interface(context, materials_of(context, lattice, blocks, options.materials), blocks);
  const Grading grading = grade_blocks(context, blocks, options.grade);
  StuffingOctree octree = cells.octree(context, blocks, grading);
  for (;;) {
    const Background background = background_of(octree, levels + largest_level);
    std::vector<bool> inside = inside_nodes(context, grid, lattice, background, levels);
    // What the coarse lattice has not seen of the solid.
    const std::vector<OctreeCube> open = open_cells(octree, background, inside, levels);
    if (open.empty()) {
      cells.require_met(background, inside);
      const BackgroundSurface surface =
          warp_background(context, grid, lattice, background, levels, std::move(inside));
      tetrahedra::TetMesh mesh = cut_background(lattice, background, levels, surface, report);
      if (options.materials)
        set_materials(context, options.materials, mesh);
      return mesh;
    }
    for (const OctreeCube& cell : open)
      octree.add(cell);
    cells.refine(octree);
  }
}

} // namespace

tetrahedra::TetMesh stuff(const Context& context, const volume::Grid& grid,
                          const StuffingOptions& options, StuffingReport* report) {
  if (options.grade > stuffing_grade_max)
    throw Error("a grade of " + std::to_string(options.grade) + ", expected 0 to " +
                std::to_string(stuffing_grade_max));
  Context quiet = context;
  quiet.progress = nullptr;
  const StuffingLattice lattice = stuffing_lattice(grid, options.isovalue, options.cell);
  if (!options.refine.empty()) {
    StuffingReport made;
    made.cell = lattice.cell;
    tetrahedra::TetMesh mesh = stuff_refined(quiet, grid, options, lattice, made);
    if (report != nullptr)
      *report = made;
    return mesh;
  }
  StuffingBlocks blocks = stuffing_blocks(context, grid, lattice);
  const SurfacePoints surface = warp_lattice(context, grid, lattice, blocks);
  BlockMaterials materials;
  MaterialInterface interface;
  if (options.materials && (options.follow_interface || options.grade > 0)) {
    materials = materials_of(quiet, lattice, blocks, options.materials);
    find_interface(quiet, materials, blocks);
    if (options.follow_interface)
      interface = follow_interface(quiet, lattice, blocks, surface, materials, options.materials);
    else
      materials.clear();
  }
  const Grading grading = grade_blocks(quiet, blocks, options.grade);
  const StuffingNodes nodes = number_nodes(quiet, blocks, grading, surface, interface);
  const StuffingParts parts{blocks, grading, surface, materials, interface, nodes};
  require_memory(context, static_cast<double>(nodes.all) * sizeof(Vec3), "the nodes");
  tetrahedra::TetMesh mesh;
  mesh.points.resize(nodes.all);
  const double shift = write_points(quiet, lattice, parts, mesh.points);
  write_tetrahedra(context, lattice, parts, options.materials, mesh);
  if (report != nullptr) {
    *report = {};
    report->cell = lattice.cell;
    report->largest_shift = shift;
    fill_in(*report, parts);
  }
  return mesh;
}

} // namespace gewebe::stuffing
