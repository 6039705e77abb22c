#include "model/figures.h"

#include "mesh/edges.h"

namespace gewebe {

std::vector<std::pair<const char*, std::uint64_t>> model_counts(const Model& model,
                                                                const Context& context) {
  const std::size_t surface = surface_count(model);
  std::uint64_t fixed = 0, boundary = 0;
  for (std::size_t i = 0; i < surface; ++i)
    fixed += model.nodes[i].fixed != fixed_none ? 1 : 0;
  EdgeSides(model.nodes.size(), model.triangles, context)
      .for_each_edge([&](std::uint32_t, std::span<const EdgeSide> edge) {
        boundary += edge.size() == 1 ? 1 : 0;
      });
  return {{"nodes", surface},
          {"centrals", model.nodes.size() - surface},
          {"springs_e", spring_count(model, SpringKind::edge)},
          {"springs_b", spring_count(model, SpringKind::bend)},
          {"springs_c", spring_count(model, SpringKind::central)},
          {"triangles", model.triangles.size()},
          {"components", components(model).count},
          {"boundary_edges", boundary},
          {"fixed_nodes", fixed}};
}

} // namespace gewebe
