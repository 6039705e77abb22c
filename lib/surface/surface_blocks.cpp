#include "surface/surface_blocks_internal.h"

namespace gewebe::surface {

Vec3 index_position(const EdgeCrossing& crossing) {
  Vec3 p{static_cast<double>(crossing.corner[0]), static_cast<double>(crossing.corner[1]),
         static_cast<double>(crossing.corner[2])};
  p[crossing.axis] += crossing.fraction;
  return p;
}

std::vector<EdgeCrossing> edge_crossings(const IsoSurface& surface) {
  std::vector<EdgeCrossing> crossings;
  if (surface.lattice == nullptr)
    return crossings;
  crossings.reserve(surface.lattice->points);
  for (const SurfaceBlock* const block : surface.lattice->blocks)
    for (int w = 0; w < 24; ++w)
      for (std::uint64_t bits = block->crossed[static_cast<std::size_t>(w)]; bits != 0;
           bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        crossings.push_back({{block->origin[0] + w / 3, block->origin[1] + (bit >> 3),
                              block->origin[2] + (bit & 7)},
                             w % 3,
                             surface.lattice->fractions[crossings.size()]});
      }
  return crossings;
}

CellPlans make_plans(bool mirrored) {
  CellPlans plans{};
  for (std::size_t c = 0; c < plans.size(); ++c) {
    const CellCase& cell = marching_cubes_table()[c];
    plans[c].triangles = cell.count;
    for (std::size_t t = 0; t < cell.count; ++t)
      for (std::size_t n = 0; n < 3; ++n) {
        const CellEdge& edge = cell_edges[cell.triangles[t][mirrored && n > 0 ? 3 - n : n]];
        plans[c].corner[3 * t + n] = static_cast<std::uint16_t>(
            edge_place(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2, edge.axis));
      }
  }
  return plans;
}

} // namespace gewebe::surface
