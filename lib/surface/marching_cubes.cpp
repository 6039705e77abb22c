#include "surface/marching_cubes.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "surface/inside_field_internal.h"
#include "surface/marching_cubes_table.h"
#include "surface/surface_blocks_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <string>

// Based on: Lorensen and Cline, Marching Cubes: A High Resolution 3D Surface Construction
// Algorithm, 1987.

namespace gewebe::surface {
namespace {

using Content = InsideField::Content;

// ---- one block

/// Inside bits of the 9³ corners of a block's cells: word[i][n] holds for each (j, k) the corner
/// (i, j + (n & 1), k + (n >> 1)).
struct CornerBits {
  std::array<std::array<std::uint64_t, 4>, volume::leaf_dim + 1> word;
};

using Octants = std::array<const Content*, 8>; // the block and its neighbours on the far sides

Octants octants_of(const InsideField& field, const std::array<std::uint32_t, 8>& contents) {
  Octants octants{};
  for (unsigned n = 0; n < 8; ++n)
    octants[n] = &field.content(contents[n]);
  return octants;
}

CornerBits corner_bits(const Octants& octants) {
  constexpr std::uint64_t column = 0x0101010101010101U;
  CornerBits bits;
  for (std::size_t i = 0; i <= volume::leaf_dim; ++i) {
    const std::size_t x = i / volume::leaf_dim, slice = i % volume::leaf_dim;
    const std::uint64_t here = octants[x]->word(slice), y = octants[x | 2]->word(slice),
                        z = octants[x | 4]->word(slice), yz = octants[x | 6]->word(slice);
    const std::uint64_t next_z = (here >> 1 & ~(column << 7)) | (z & column) << 7;
    const std::uint64_t y_next_z = (y >> 1 & ~(column << 7)) | (yz & column) << 7;
    bits.word[i] = {here, here >> 8 | y << 56, next_z, next_z >> 8 | y_next_z << 56};
  }
  return bits;
}

/// Bit 8 j + k: the surface crosses cell (i, j, k).
std::uint64_t active_cells(const CornerBits& bits, std::size_t i) {
  const auto& a = bits.word[i];
  const auto& b = bits.word[i + 1];
  return (a[0] | a[1] | a[2] | a[3] | b[0] | b[1] | b[2] | b[3]) &
         ~(a[0] & a[1] & a[2] & a[3] & b[0] & b[1] & b[2] & b[3]);
}

/// Which corners of the cell at bit n of slice i are inside: the index of the table.
unsigned cell_case(const CornerBits& bits, std::size_t i, unsigned n) {
  unsigned result = 0;
  for (unsigned corner = 0; corner < 8; ++corner)
    result |= static_cast<unsigned>(bits.word[i + (corner & 1)][corner >> 1] >> n & 1) << corner;
  return result;
}

void examine_block(const InsideField& field, const Int3& origin, SurfaceBlocks::Part& result) {
  const std::array<std::uint32_t, 8> contents = field.octants(origin);
  const CornerBits bits = corner_bits(octants_of(field, contents));
  std::array<std::uint64_t, 8> active{};
  std::uint64_t any = 0;
  for (std::size_t i = 0; i < volume::leaf_dim; ++i)
    any |= active[i] = active_cells(bits, i);
  if (any == 0)
    return;
  result.contents.push_back(contents);
  SurfaceBlock& block = result.blocks.emplace_back();
  block.origin = origin;
  block.active = active;
  for (unsigned n = 0; n < 8; ++n) {
    block.inside[n] = bits.word[n][0];
    const std::uint64_t slice = bits.word[(n & 1) != 0 ? volume::leaf_dim : 0][n >> 1];
    const unsigned bit = ((n & 2) != 0 ? 56U : 0U) + ((n & 4) != 0 ? 7U : 0U);
    block.outer = static_cast<std::uint8_t>(block.outer | (slice >> bit & 1) << n);
  }
  const auto& table = marching_cubes_table();
  for (std::size_t i = 0; i < volume::leaf_dim; ++i) {
    const std::uint64_t here = bits.word[i][0];
    const std::array<std::uint64_t, 3> crossed{here ^ bits.word[i + 1][0], here ^ bits.word[i][1],
                                               here ^ bits.word[i][2]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      block.before[3 * i + axis] = static_cast<std::uint16_t>(block.points);
      block.crossed[3 * i + axis] = crossed[axis];
      block.points += count_bits(crossed[axis]);
    }
    block.cells_before[i] = static_cast<std::uint16_t>(block.cells);
    for (std::uint64_t cells = active[i]; cells != 0; cells &= cells - 1) {
      const unsigned cell = cell_case(bits, i, static_cast<unsigned>(std::countr_zero(cells)));
      result.cases.push_back(static_cast<std::uint8_t>(cell));
      block.triangles += table[cell].count;
      ++block.cells;
    }
  }
}

[[noreturn]] void throw_not_finite(const Int3& c) {
  throw Error("the volume has a value beside the surface that is not finite, at voxel (" +
              std::to_string(c[0]) + ", " + std::to_string(c[1]) + ", " + std::to_string(c[2]) +
              ") or its neighbour");
}

/// Numbers of the points on the edges of a block's cells, by edge_place.
using PointNumbers = std::array<std::uint32_t, edge_places>;

/// Computes the block's fractions and, with a mesh, its points and notes their numbers.
template <bool with_mesh>
void write_points(const Octants& octants, const SurfaceBlock& block, double isovalue,
                  const volume::GridTransform& to_world, SurfaceBlocks& lattice, Vec3* points,
                  PointNumbers& numbers) {
  constexpr std::array<unsigned, 3> stride{64, 8, 1};
  const std::array<double, 12> transform = to_world.m;
  std::uint32_t point = block.first_point;
  const auto value = [](const Content& content, unsigned n) {
    return static_cast<double>(content.values != nullptr ? content.values[n] : content.constant);
  };
  for (unsigned w = 0; w < 24; ++w) {
    const unsigned i = w / 3, axis = w % 3;
    for (std::uint64_t crossed = block.crossed[w]; crossed != 0; crossed &= crossed - 1) {
      const auto bit = static_cast<unsigned>(std::countr_zero(crossed));
      const unsigned j = bit >> 3, k = bit & 7, n = i << 6 | bit;
      const unsigned along = axis == 0 ? i : axis == 1 ? j : k;
      const double a = value(*octants[0], n);
      const double b = along < 7 ? value(*octants[0], n + stride[axis])
                                 : value(*octants[1U << axis], n - 7 * stride[axis]);
      const double fraction = (isovalue - a) / (b - a);
      const Int3 corner{block.origin[0] + static_cast<int>(i),
                        block.origin[1] + static_cast<int>(j),
                        block.origin[2] + static_cast<int>(k)};
      if (!std::isfinite(b - a)) // of floats that are finite it is
        throw_not_finite(corner);
      lattice.fractions[point] = fraction;
      lattice.edges[point] = BlockEdge::at(i, axis, bit);
      if (with_mesh) {
        Vec3 p{static_cast<double>(corner[0]), static_cast<double>(corner[1]),
               static_cast<double>(corner[2])}; // index_position, axis known
        (axis == 0 ? p.x : axis == 1 ? p.y : p.z) += fraction;
        points[point] = world_position(transform, p);
        numbers[edge_place(i, j, k, axis)] = point;
      }
      ++point;
    }
  }
}

void write_triangles(const SurfaceBlock& block, const PointNumbers& numbers, const CellPlans& plans,
                     std::vector<Triangle>& triangles) {
  const std::uint8_t* cell = block.cases;
  Triangle* out = triangles.data() + block.first_triangle;
  for (unsigned i = 0; i < volume::leaf_dim; ++i)
    for (std::uint64_t active = block.active[i]; active != 0; active &= active - 1) {
      const auto bit = static_cast<unsigned>(std::countr_zero(active));
      const std::uint32_t* const own = numbers.data() + edge_place(i, bit >> 3, bit & 7);
      const CellPlan& plan = plans[*cell++];
      const std::uint16_t* corner = plan.corner.data();
      for (unsigned t = 0; t < plan.triangles; ++t, corner += 3)
        *out++ = {own[corner[0]], own[corner[1]], own[corner[2]]};
    }
}

void check_input(const volume::GridInfo& info, double isovalue) {
  if (!std::isfinite(isovalue))
    throw Error("the isovalue is not finite");
  const double determinant = info.transform.determinant();
  if (!std::isfinite(determinant) || determinant == 0)
    throw Error("the volume's transform is singular, expected an invertible affine map");
  if (info.band_isovalue && *info.band_isovalue != isovalue)
    throw Error("the volume is exact only near isovalue " + text::number_text(*info.band_isovalue) +
                " (made with --band), expected that one, not " + text::number_text(isovalue));
}

/// Notes which blocks lie round each of those of some parts, and the other way round. Each pair is
/// looked up once, from the block that comes first.
void link_neighbours(const InsideField::Candidates& candidates,
                     const std::vector<std::uint32_t>& numbers, std::vector<SurfaceBlock*>& blocks,
                     std::size_t begin, std::size_t end) {
  for (std::size_t n = begin; n < end; ++n)
    for (std::size_t place = 14; place < 27; ++place) {
      Int3 origin = blocks[n]->origin;
      origin[0] += volume::leaf_dim * (static_cast<int>(place / 9) - 1);
      origin[1] += volume::leaf_dim * (static_cast<int>(place / 3 % 3) - 1);
      origin[2] += volume::leaf_dim * (static_cast<int>(place % 3) - 1);
      const std::uint32_t candidate = candidates.find(origin);
      if (candidate == IndexMap::none || numbers[candidate] == SurfaceBlock::none)
        continue;
      blocks[n]->neighbours[place] = numbers[candidate];
      blocks[numbers[candidate]]->neighbours[26 - place] = static_cast<std::uint32_t>(n);
    }
}

IsoSurface make_surface(const Context& context, const volume::Grid& grid,
                        std::optional<double> wanted_isovalue, bool with_mesh) {
  const double isovalue = wanted_isovalue.value_or(default_isovalue(grid.info()));
  check_input(grid.info(), isovalue);
  const InsideField field(context, grid, isovalue);
  Context quiet = context;
  quiet.progress = nullptr;

  const InsideField::Candidates candidates = field.candidates(context);
  const std::size_t count = candidates.blocks.size();
  require_memory(context,
                 static_cast<double>(count) * (sizeof(SurfaceBlock) + volume::leaf_voxels / 8.0),
                 "the crossed blocks");
  constexpr std::size_t at_once = 64;
  const auto lattice = std::make_shared<SurfaceBlocks>();
  std::vector<SurfaceBlocks::Part>& parts = lattice->parts;
  parts.resize((count + at_once - 1) / at_once);
  std::vector<std::uint32_t> numbers(count, SurfaceBlock::none); // none: no crossed cell there
  parallel_blocks(quiet, count, at_once, [&](std::size_t begin, std::size_t end) {
    SurfaceBlocks::Part& part = parts[begin / at_once];
    part.blocks.reserve(end - begin);
    for (std::size_t n = begin; n < end; ++n) {
      const std::size_t before = part.blocks.size();
      examine_block(field, candidates.blocks[n], part);
      if (part.blocks.size() > before)
        numbers[n] = 0;
    }
  });

  IsoSurface surface;
  surface.transform = grid.info().transform;
  surface.leaves = field.leaves();
  std::uint32_t next = 0;
  for (std::uint32_t& number : numbers)
    if (number != SurfaceBlock::none)
      number = next++;
  std::vector<SurfaceBlock*> blocks;
  blocks.reserve(next);
  std::uint64_t points = 0, triangles = 0;
  for (SurfaceBlocks::Part& part : parts) {
    const std::uint8_t* cases = part.cases.data();
    part.first = static_cast<std::uint32_t>(blocks.size());
    for (std::size_t n = 0; n < part.blocks.size(); ++n) {
      SurfaceBlock& block = part.blocks[n];
      block.first_point = static_cast<std::uint32_t>(points);
      block.first_triangle = static_cast<std::uint32_t>(triangles);
      block.cases = cases;
      cases += block.cells;
      points += block.points;
      triangles += block.triangles;
      surface.active_cells += block.cells;
      surface.leaves_visited += field.is_leaf(part.contents[n][0]) ? 1 : 0;
      blocks.push_back(&block);
      if (points >= UINT32_MAX || triangles >= UINT32_MAX)
        throw Error("the surface has more than 2^32 - 2 points or triangles, expected fewer");
    }
  }
  surface.blocks = blocks.size();
  lattice->blocks.assign(blocks.begin(), blocks.end());
  lattice->points = points;
  lattice->triangles = triangles;

  require_memory(context,
                 static_cast<double>(points) *
                         (sizeof(double) + sizeof(BlockEdge) + (with_mesh ? sizeof(Vec3) : 0)) +
                     static_cast<double>(with_mesh ? triangles : 0) * sizeof(Triangle),
                 "the mesh of the isosurface");
  if (with_mesh)
    resize_all(quiet, resizing(surface.mesh.points, points), resizing(lattice->fractions, points),
               resizing(lattice->edges, points), resizing(surface.mesh.triangles, triangles));
  else
    resize_all(quiet, resizing(lattice->fractions, points), resizing(lattice->edges, points));
  const CellPlans plans = make_plans(surface.transform.determinant() < 0);
  parallel_blocks(context, parts.size(), 1, [&](std::size_t n, std::size_t) {
    const SurfaceBlocks::Part& part = parts[n];
    const auto point_numbers = std::make_unique_for_overwrite<PointNumbers>();
    Vec3* const mesh_points = surface.mesh.points.data();
    link_neighbours(candidates, numbers, blocks, part.first, part.first + part.blocks.size());
    for (std::size_t b = 0; b < part.blocks.size(); ++b) {
      const SurfaceBlock& block = part.blocks[b];
      const Octants octants = octants_of(field, part.contents[b]);
      if (!with_mesh) {
        write_points<false>(octants, block, isovalue, surface.transform, *lattice, mesh_points,
                            *point_numbers);
        continue;
      }
      write_points<true>(octants, block, isovalue, surface.transform, *lattice, mesh_points,
                         *point_numbers);
      for_far_edges(*lattice, block,
                    [&](const SurfaceBlock& far, std::uint32_t, unsigned w, unsigned bit,
                        unsigned place) { (*point_numbers)[place] = far.point(w, bit); });
      write_triangles(block, *point_numbers, plans, surface.mesh.triangles);
    }
  });
  surface.lattice = lattice;
  return surface;
}

} // namespace

double default_isovalue(const volume::GridInfo& info) {
  return info.level_set ? 0 : info.isovalue;
}

IsoSurface marching_cubes(const Context& context, const volume::Grid& grid,
                          std::optional<double> isovalue) {
  return make_surface(context, grid, isovalue, true);
}

IsoSurface marching_cubes_to_snap(const Context& context, const volume::Grid& grid,
                                  std::optional<double> isovalue) {
  return make_surface(context, grid, isovalue, false);
}

} // namespace gewebe::surface
