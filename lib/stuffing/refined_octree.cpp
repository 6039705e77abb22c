#include "stuffing/refined_octree_internal.h"

#include "base/error.h"
#include "base/parallel.h"
#include "stuffing/cut_finder_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace gewebe::stuffing {
namespace {

/// Cells of a block: word i, bit 8 j + k.
using CellSet = std::array<std::uint64_t, 8>;

/// Cells with a corner or centre inside, and those that share a corner with one.
std::vector<CellSet> cells_at_solid(const Context& context, const StuffingBlocks& blocks) {
  std::vector<CellSet> touched(blocks.size()), result(blocks.size());
  const auto each = [&](auto&& body) {
    gewebe::parallel_blocks(context, blocks.size(), 32, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b)
        for (int i = 0; i < gewebe::volume::leaf_dim; ++i)
          body(b, i);
    });
  };
  each([&](std::size_t b, int i) {
    std::uint64_t& word = touched[b][static_cast<std::size_t>(i)];
    word = blocks[b].inside[static_cast<std::size_t>(8 + i)];
    for (int n = 0; n < 8; ++n)
      word |= shifted_word(blocks, blocks[b], 0, i, {n & 1, n >> 1 & 1, n >> 2},
                           [](const StuffingBlock& there, unsigned w) { return there.inside[w]; });
  });
  each([&](std::size_t b, int i) {
    std::uint64_t& word = result[b][static_cast<std::size_t>(i)];
    for (int n = 0; n < 27; ++n)
      word |= shifted_word(blocks, blocks[b], 0, i, {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1},
                           [&](const StuffingBlock& there, unsigned w) {
                             return touched[static_cast<std::size_t>(&there - blocks.data())][w];
                           });
  });
  return result;
}

/// How often the edge is halved until it is at most `cell`, which is above 0.
unsigned halvings(double edge, double cell) {
  unsigned count = 0;
  while (std::ldexp(edge, -static_cast<int>(count)) > cell * (1 + 1e-9))
    ++count;
  return count;
}

} // namespace

RefinedCells::RefinedCells(const volume::Grid& grid, const StuffingLattice& lattice,
                           const StuffingOptions& options)
    : grid_(grid), lattice_(lattice), regions_(options.refine), materials_(options.materials) {
  for (const tetrahedra::RefinedRegion& region : regions_) {
    if (!(region.cell < lattice.cell))
      throw Error("refine '" + region.text + "': cells are " + text::number_text(lattice.cell) +
                  " mm already, expected a smaller size");
    if (!region.materials.empty() && !materials_)
      throw Error("refine '" + region.text + "': the solid has no labels, expected materials");
    levels_ = std::max(levels_, halvings(lattice.cell, region.cell));
  }
  if (levels_ > refined_levels_max)
    throw Error("refine: cells of " + text::number_text(lattice.cell) + " mm would be halved " +
                std::to_string(levels_) + " times, expected at most " +
                std::to_string(refined_levels_max));
}

bool RefinedCells::meets_shape(const tetrahedra::RefinedRegion& region, const Vec3& first,
                               double edge) const {
  for (const tetrahedra::RefinedRegion::Sphere& sphere : region.spheres) {
    const Vec3 centre = lattice_.to_world.to_index(sphere.centre);
    Vec3 apart;
    for (int a = 0; a < 3; ++a)
      apart[a] = centre[a] - std::clamp(centre[a], first[a], first[a] + edge);
    if (!(norm(apart) * lattice_.cell <= sphere.radius))
      return false;
  }
  if (region.boxes.empty())
    return true;
  Box3 here;
  for (int n = 0; n < 8; ++n)
    here.add(lattice_.to_world.to_world(
        first + Vec3{edge * (n & 1), edge * (n >> 1 & 1), edge * (n >> 2)}));
  return std::ranges::all_of(region.boxes, [&](const Box3& box) {
    for (int a = 0; a < 3; ++a)
      if (!(here.min[a] <= box.max[a] && box.min[a] <= here.max[a]))
        return false;
    return true;
  });
}

namespace {
/// Places in a cube grown by half its edge on each side, until one is enough. \param count  along
/// each axis
template <class Visit>
void around(const Vec3& first, double edge, int count, Visit&& visit) {
  const double step = 2 * edge / (count - 1);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      for (int k = 0; k < count; ++k)
        if (!visit(first + Vec3{i * step, j * step, k * step} - Vec3{edge / 2, edge / 2, edge / 2}))
          return;
}
} // namespace

bool RefinedCells::meets(const tetrahedra::RefinedRegion& region, const Vec3& first, double edge,
                         Probe& probe) const {
  if (!meets_shape(region, first, edge))
    return false;
  if (region.surface) {
    bool in = false, out = false;
    around(first, edge, 3, [&](const Vec3& place) {
      (probe.finder.excess(lattice_.to_index.to_world(place)) > 0 ? in : out) = true;
      return !(in && out);
    });
    if (!in || !out)
      return false;
  }
  return std::ranges::all_of(region.materials, [&](std::int32_t wanted) {
    bool found = false;
    around(first, edge, 5, [&](const Vec3& place) {
      found = probe.finder.excess(lattice_.to_index.to_world(place)) > 0 &&
              probe.material(lattice_.to_world.to_world(place)) == wanted;
      return !found;
    });
    return found;
  });
}

RefinedCells::Probe RefinedCells::probe() const {
  return {CutFinder(grid_, lattice_), materials_ ? materials_() : MaterialAt()};
}

Vec3 RefinedCells::place_of(const OctreeCube& cube) const {
  const Int3 first = cube.first_cell();
  return Vec3{static_cast<double>(first[0]), static_cast<double>(first[1]),
              static_cast<double>(first[2])} *
         std::ldexp(1.0, -static_cast<int>(levels_));
}

bool RefinedCells::meets_block(const Int3& origin) const {
  return std::ranges::any_of(regions_, [&](const tetrahedra::RefinedRegion& region) {
    return meets_shape(region,
                       {static_cast<double>(origin[0]), static_cast<double>(origin[1]),
                        static_cast<double>(origin[2])},
                       volume::leaf_dim);
  });
}

/// Has the fine lattice of a cell of the block's lattice, outside of it, a point inside?
bool RefinedCells::has_inside(const Vec3& first, Probe& probe) const {
  double finest = HUGE_VAL;
  for (const tetrahedra::RefinedRegion& region : regions_)
    if (meets_shape(region, first, 1))
      finest = std::fmin(finest, region.cell);
  if (!std::isfinite(finest))
    return false;
  const int count =
      2 << halvings(lattice_.cell, finest); // steps of half a cell: corners and centres
  const double step = 1.0 / count;
  for (int i = 0; i <= count; ++i)
    for (int j = 0; j <= count; ++j)
      for (int k = 0; k <= count; ++k)
        if ((i & 1) == (j & 1) && (i & 1) == (k & 1) &&
            probe.finder.excess(
                lattice_.to_index.to_world(first + Vec3{i * step, j * step, k * step})) > 0)
          return true;
  return false;
}

StuffingOctree RefinedCells::octree(const Context& context, const StuffingBlocks& blocks,
                                    const Grading& grading) const {
  const std::vector<CellSet> solid = cells_at_solid(context, blocks);
  const auto is_set = [](const CellSet& set, unsigned i, unsigned bit) {
    return (set[i] >> bit & 1) != 0;
  };
  std::vector<CellSet> more(blocks.size());
  parallel_blocks(context, blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    Probe at = probe();
    for (std::size_t b = begin; b < end; ++b) {
      if (!meets_block(blocks[b].origin))
        continue;
      for (unsigned i = 0; i < volume::leaf_dim; ++i)
        for (unsigned bit = 0; bit < 64; ++bit)
          if (!is_set(solid[b], i, bit) &&
              has_inside(bcc::position(point_at(blocks[b], i, bit)), at))
            more[b][i] |= std::uint64_t{1} << bit;
    }
  });
  StuffingOctree octree(levels_ + grading.levels + 1);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (unsigned i = 0; i < volume::leaf_dim; ++i)
      for (unsigned bit = 0; bit < 64; ++bit) {
        if (!is_set(solid[b], i, bit) && !is_set(more[b], i, bit))
          continue;
        const unsigned level = grading.none() ? 0 : grading.blocks[b].level(i, bit >> 3, bit & 7);
        const Int3 cell = point_at(blocks[b], i, bit).place;
        if (((cell[0] | cell[1] | cell[2]) & ((1 << level) - 1)) == 0)
          octree.add({levels_ + level, {cell[0] >> level, cell[1] >> level, cell[2] >> level}});
      }
  refine(octree);
  return octree;
}

void RefinedCells::refine(StuffingOctree& octree) const {
  Probe at = probe();
  std::vector<OctreeCube> open = octree.leaves(levels_);
  while (!open.empty()) {
    const OctreeCube leaf = open.back();
    open.pop_back();
    const double edge = std::ldexp(1.0, static_cast<int>(leaf.level) - static_cast<int>(levels_));
    bool wanted = false;
    for (std::size_t r = 0; r < regions_.size(); ++r)
      if (edge * lattice_.cell > regions_[r].cell * (1 + 1e-9) &&
          meets(regions_[r], place_of(leaf), edge, at))
        wanted = true;
    if (!wanted)
      continue;
    octree.split(leaf);
    for (unsigned n = 0; n < 8; ++n)
      open.push_back(leaf.child(n));
  }
  octree.balance();
}

void RefinedCells::require_met(const Background& background,
                               const std::vector<bool>& inside) const {
  for (const tetrahedra::RefinedRegion& region : regions_) {
    const double reach = region.cell / lattice_.cell;
    bool met = false;
    for (std::size_t n = 0; n < inside.size() && !met; ++n)
      met = inside[n] &&
            meets_shape(region,
                        background_place(background.nodes[n], levels_) - Vec3{reach, reach, reach},
                        2 * reach);
    if (!met)
      throw Error("refine '" + region.text +
                  "': no cell of the solid lies there, expected a place in it or at it");
  }
}

} // namespace gewebe::stuffing
