#include "surface/marching_cubes.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "surface/inside_field_internal.h"
#include "surface/marching_cubes_table.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <memory>
#include <string>

// Based on: Lorensen and Cline, Marching Cubes: A High Resolution 3D Surface Construction
// Algorithm, 1987.

namespace gewebe {
namespace {

using Content = InsideField::Content;

// ---- one block

/// Inside bits of the 9³ corners of a block's cells: word[i][n] holds for each (j, k) the corner
/// (i, j + (n & 1), k + (n >> 1)).
struct CornerBits {
  std::array<std::array<std::uint64_t, 4>, leaf_dim + 1> word;
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
  for (std::size_t i = 0; i <= leaf_dim; ++i) {
    const std::size_t x = i / leaf_dim, slice = i % leaf_dim;
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

/// What is kept of a block with a crossed cell.
struct Block {
  Int3 origin{};
  std::uint32_t first_point = 0, points = 0;
  std::uint32_t first_triangle = 0, triangles = 0;
  std::uint32_t cells = 0;
  const std::uint8_t* cases = nullptr;     // of each crossed cell in turn
  std::array<std::uint32_t, 8> contents{}; // of the octants
  std::array<std::uint16_t, 24> before{};  // crossed edges of this block in earlier words
  std::array<std::uint64_t, 24> crossed{}; // word 3 i + axis, bit 8 j + k
  std::array<std::uint64_t, 8> active{};   // crossed cells: word i, bit 8 j + k

  std::uint32_t first_of_word(std::size_t w) const { return first_point + before[w]; }
};

/// The crossed blocks among some candidates.
struct Blocks {
  std::vector<Block> blocks;
  std::vector<std::uint8_t> cases;
};

void examine_block(const InsideField& field, const Int3& origin, Blocks& result) {
  const std::array<std::uint32_t, 8> contents = field.octants(origin);
  const CornerBits bits = corner_bits(octants_of(field, contents));
  std::array<std::uint64_t, 8> active{};
  std::uint64_t any = 0;
  for (std::size_t i = 0; i < leaf_dim; ++i)
    any |= active[i] = active_cells(bits, i);
  if (any == 0)
    return;
  Block& block = result.blocks.emplace_back();
  block.origin = origin;
  block.contents = contents;
  block.active = active;
  const auto& table = marching_cubes_table();
  for (std::size_t i = 0; i < leaf_dim; ++i) {
    const std::uint64_t here = bits.word[i][0];
    const std::array<std::uint64_t, 3> crossed{here ^ bits.word[i + 1][0], here ^ bits.word[i][1],
                                               here ^ bits.word[i][2]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      block.before[3 * i + axis] = static_cast<std::uint16_t>(block.points);
      block.crossed[3 * i + axis] = crossed[axis];
      block.points += count_bits(crossed[axis]);
    }
    for (std::uint64_t cells = active[i]; cells != 0; cells &= cells - 1) {
      const unsigned cell = cell_case(bits, i, static_cast<unsigned>(std::countr_zero(cells)));
      result.cases.push_back(static_cast<std::uint8_t>(cell));
      block.triangles += table[cell].count;
      ++block.cells;
    }
  }
}

[[noreturn]] void throw_not_finite(const EdgeCrossing& crossing) {
  const Int3& c = crossing.corner;
  throw Error("the volume has a value beside the surface that is not finite, at voxel (" +
              std::to_string(c[0]) + ", " + std::to_string(c[1]) + ", " + std::to_string(c[2]) +
              ") or its neighbour");
}

/// Numbers of the points on the edges of a block's cells: [place(i, j, k, axis)].
using PointNumbers = std::array<std::uint32_t, std::size_t{3} * 9 * 9 * 9>;
constexpr unsigned place(unsigned i, unsigned j, unsigned k, unsigned axis = 0) {
  return ((axis * 9 + i) * 9 + j) * 9 + k;
}

/// GridTransform::to_world, the same sums, where it can be inlined.
Vec3 world_position(const std::array<double, 12>& m, const Vec3& p) {
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

/// Computes the block's points and notes their numbers.
void write_points(const Octants& octants, const Block& block, double isovalue, IsoSurface& surface,
                  PointNumbers& numbers) {
  constexpr std::array<unsigned, 3> stride{64, 8, 1};
  const std::array<double, 12> transform = surface.transform.m;
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
      EdgeCrossing& crossing = surface.crossings[point];
      crossing.corner = {block.origin[0] + static_cast<int>(i),
                         block.origin[1] + static_cast<int>(j),
                         block.origin[2] + static_cast<int>(k)};
      crossing.axis = static_cast<std::int32_t>(axis);
      crossing.fraction = (isovalue - a) / (b - a);
      if (!std::isfinite(b - a)) // of floats that are finite it is
        throw_not_finite(crossing);
      Vec3 p{static_cast<double>(crossing.corner[0]), static_cast<double>(crossing.corner[1]),
             static_cast<double>(crossing.corner[2])}; // index_position, axis known
      (axis == 0 ? p.x : axis == 1 ? p.y : p.z) += crossing.fraction;
      surface.mesh.points[point] = world_position(transform, p);
      numbers[place(i, j, k, axis)] = point++;
    }
  }
}

/// Notes the numbers of the points on the edges that cells of a block share with its neighbours on
/// the far sides. \pre near[n] has a crossed edge wherever a cell of this block asks for one
void note_far_points(const std::array<const Block*, 8>& near, PointNumbers& numbers) {
  constexpr std::uint64_t first_row = 0xff, first_column = 0x0101010101010101U;
  for (unsigned octant = 1; octant < 7; ++octant) {
    if (near[octant] == nullptr)
      continue;
    const Block& block = *near[octant];
    const unsigned far_i = octant & 1, far_j = octant >> 1 & 1, far_k = octant >> 2;
    const std::uint64_t mask =
        (far_j != 0 ? first_row : ~0ULL) & (far_k != 0 ? first_column : ~0ULL);
    for (unsigned axis = 0; axis < 3; ++axis) {
      if ((octant >> axis & 1) != 0)
        continue; // this edge leads away
      for (unsigned i = 0; i < (far_i != 0 ? 1U : 8U); ++i) {
        const unsigned w = 3 * i + axis;
        const std::uint64_t crossed = block.crossed[w];
        for (std::uint64_t bits = crossed & mask; bits != 0; bits &= bits - 1) {
          const auto bit = static_cast<unsigned>(std::countr_zero(bits));
          numbers[place(i + 8 * far_i, (bit >> 3) + 8 * far_j, (bit & 7) + 8 * far_k, axis)] =
              block.first_of_word(w) + count_bits(crossed & ((std::uint64_t{1} << bit) - 1));
        }
      }
    }
  }
}

/// The table of cases for PointNumbers.
struct CellPlan {
  std::uint8_t triangles = 0;
  std::array<std::uint16_t, std::size_t{3} * max_cell_triangles> corner{};
};
using CellPlans = std::array<CellPlan, 256>;

CellPlans make_plans(bool mirrored) {
  CellPlans plans{};
  for (std::size_t c = 0; c < plans.size(); ++c) {
    const CellCase& cell = marching_cubes_table()[c];
    plans[c].triangles = cell.count;
    for (std::size_t t = 0; t < cell.count; ++t)
      for (std::size_t n = 0; n < 3; ++n) {
        const CellEdge& edge = cell_edges[cell.triangles[t][mirrored && n > 0 ? 3 - n : n]];
        plans[c].corner[3 * t + n] = static_cast<std::uint16_t>(
            place(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2, edge.axis));
      }
  }
  return plans;
}

void write_triangles(const Block& block, const PointNumbers& numbers, const CellPlans& plans,
                     std::vector<Triangle>& triangles) {
  const std::uint8_t* cell = block.cases;
  Triangle* out = triangles.data() + block.first_triangle;
  for (unsigned i = 0; i < leaf_dim; ++i)
    for (std::uint64_t active = block.active[i]; active != 0; active &= active - 1) {
      const auto bit = static_cast<unsigned>(std::countr_zero(active));
      const std::uint32_t* const own = numbers.data() + place(i, bit >> 3, bit & 7);
      const CellPlan& plan = plans[*cell++];
      const std::uint16_t* corner = plan.corner.data();
      for (unsigned t = 0; t < plan.triangles; ++t, corner += 3)
        *out++ = {own[corner[0]], own[corner[1]], own[corner[2]]};
    }
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

void check_input(const GridInfo& info, double isovalue) {
  if (!std::isfinite(isovalue))
    throw Error("the isovalue is not finite");
  const double determinant = info.transform.determinant();
  if (!std::isfinite(determinant) || determinant == 0)
    throw Error("the volume's transform is singular, expected an invertible affine map");
  if (info.band_isovalue && *info.band_isovalue != isovalue)
    throw Error("the volume is exact only near isovalue " + number_text(*info.band_isovalue) +
                " (made with --band), expected that one, not " + number_text(isovalue));
}

} // namespace

double default_isovalue(const GridInfo& info) {
  return info.level_set ? 0 : info.isovalue;
}

Vec3 index_position(const EdgeCrossing& crossing) {
  Vec3 p{static_cast<double>(crossing.corner[0]), static_cast<double>(crossing.corner[1]),
         static_cast<double>(crossing.corner[2])};
  p[crossing.axis] += crossing.fraction;
  return p;
}

IsoSurface marching_cubes(const Context& context, const Grid& grid,
                          std::optional<double> wanted_isovalue) {
  const double isovalue = wanted_isovalue.value_or(default_isovalue(grid.info()));
  check_input(grid.info(), isovalue);
  const InsideField field(context, grid, isovalue);
  Context quiet = context;
  quiet.progress = nullptr;

  const InsideField::Candidates candidates = field.candidates(context);
  const std::size_t count = candidates.blocks.size();
  require_memory(context, static_cast<double>(count) * (sizeof(Block) + leaf_voxels / 8.0),
                 "the crossed blocks");
  constexpr std::size_t at_once = 64;
  std::vector<Blocks> parts((count + at_once - 1) / at_once);
  std::vector<const Block*> crossed(count); // or nullptr: no crossed cell there
  parallel_blocks(quiet, count, at_once, [&](std::size_t begin, std::size_t end) {
    Blocks& part = parts[begin / at_once];
    part.blocks.reserve(end - begin);
    for (std::size_t n = begin; n < end; ++n) {
      const std::size_t before = part.blocks.size();
      examine_block(field, candidates.blocks[n], part);
      if (part.blocks.size() > before)
        crossed[n] = &part.blocks.back();
    }
  });

  IsoSurface surface;
  surface.transform = grid.info().transform;
  surface.leaves = field.leaves();
  std::uint64_t points = 0, triangles = 0;
  for (Blocks& part : parts) {
    const std::uint8_t* cases = part.cases.data();
    for (Block& block : part.blocks) {
      block.first_point = static_cast<std::uint32_t>(points);
      block.first_triangle = static_cast<std::uint32_t>(triangles);
      block.cases = cases;
      cases += block.cells;
      points += block.points;
      triangles += block.triangles;
      surface.active_cells += block.cells;
      surface.leaves_visited += field.is_leaf(block.contents[0]) ? 1 : 0;
      if (points >= UINT32_MAX || triangles >= UINT32_MAX)
        throw Error("the surface has more than 2^32 - 2 points or triangles, expected fewer");
    }
    surface.blocks += part.blocks.size();
  }

  require_memory(context,
                 static_cast<double>(points) * (sizeof(Vec3) + sizeof(EdgeCrossing)) +
                     static_cast<double>(triangles) * sizeof(Triangle),
                 "the mesh of the isosurface");
  resize_all(quiet, resizing(surface.mesh.points, points), resizing(surface.crossings, points),
             resizing(surface.mesh.triangles, triangles));
  const CellPlans plans = make_plans(surface.transform.determinant() < 0);
  parallel_blocks(context, parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    const auto numbers = std::make_unique_for_overwrite<PointNumbers>();
    for (std::size_t n = begin; n < end; ++n)
      for (const Block& block : parts[n].blocks) {
        std::array<const Block*, 8> near{};
        for (unsigned octant = 1; octant < 7; ++octant) {
          const std::uint32_t number = candidates.find(shifted(block.origin, octant, leaf_dim));
          near[octant] = number == IndexMap::none ? nullptr : crossed[number];
        }
        write_points(octants_of(field, block.contents), block, isovalue, surface, *numbers);
        note_far_points(near, *numbers);
        write_triangles(block, *numbers, plans, surface.mesh.triangles);
      }
  });
  return surface;
}

} // namespace gewebe
