#include "model/figures.h"

#include "mesh/edges.h"

namespace gewebe::model {

std::vector<std::pair<const char*, std::uint64_t>> model_counts(const Model& model,
                                                                const Context& context) {
  const std::size_t bodies = body_count(model);
  std::uint64_t fixed = 0, boundary = 0;
  for (std::size_t i = 0; i < bodies; ++i)
    fixed += model.nodes[i].fixed != fixed_none ? 1 : 0;
  mesh::EdgeSides(model.nodes.size(), model.triangles, context)
      .for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
        boundary += edge.size() == 1 ? 1 : 0;
      });
  std::vector<std::pair<const char*, std::uint64_t>> counts = {
      {"nodes", bodies},
      {"centrals", model.nodes.size() - bodies},
      {"springs_e", spring_count(model, SpringKind::edge)},
      {"springs_b", spring_count(model, SpringKind::bend)},
      {"springs_c", spring_count(model, SpringKind::central)},
      {"triangles", model.triangles.size()},
      {"components", components(model).count},
      {"boundary_edges", boundary},
      {"fixed_nodes", fixed}};
  if (!model.tetrahedra.empty()) {
    counts.emplace_back("surface_nodes", surface_count(model));
    counts.emplace_back("tetrahedra", model.tetrahedra.size());
    counts.emplace_back("order", model.middles.empty() ? 1 : 2);
    if (!model.skin.points.empty())
      counts.emplace_back("skin_triangles", model.skin.triangles.size());
  }
  return counts;
}

} // namespace gewebe::model
