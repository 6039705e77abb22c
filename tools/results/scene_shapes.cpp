#include "tools/results/scene_shapes.h"

#include "formats/scene/scene_answer.h"
#include "geometry/vector_at.h"
#include "tools/results/undelivered.h"

#include <span>

namespace gewebe::cli {

void SceneShapes::need_models(const scene::Simulation& simulation, std::size_t objects) {
  for (std::size_t i = 0; i < objects; ++i)
    (void)simulation.model(i);
}

void SceneShapes::frame(const scene::Simulation& simulation, std::uint64_t step) {
  const std::size_t objects = simulation.object_count();
  positions_.resize(objects);
  std::vector<formats::SharedShape> shapes;
  bool changed = false;
  for (std::size_t i = 0; i < objects; ++i) {
    const std::vector<model::Node>& nodes = simulation.model(i).nodes;
    const std::span<const double> u = simulation.displacement(i);
    std::vector<double>& positions = positions_[i];
    positions.clear();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const Vec3 p = nodes[k].position + vector_at(u, k);
      positions.insert(positions.end(), {p.x, p.y, p.z});
    }
    shapes.push_back({simulation.object(i).name, positions});
    changed = changed || formats::topology_changed(simulation, i);
  }
  deliver([&] { file_.write(step, simulation.time(), shapes, changed); });
}

} // namespace gewebe::cli
