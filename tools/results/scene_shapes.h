#pragma once
// Passes a running scene to shared shapes: ffe-run --shapes-in, gewebe_serve(5).

#include "formats/results/shared_shapes.h"
#include "scene/simulation.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::cli {

/// What the file throws leaves as Undelivered, what the simulation throws as it is.
class SceneShapes {
public:
  explicit SceneShapes(formats::SharedShapes& file) : file_(file) {} ///< keeps a reference

  /// Reads the models of the first objects; all of them have a shape.
  static void need_models(const scene::Simulation& simulation, std::size_t objects);
  /// Behind a step, whose news were not taken yet: where all nodes of all objects stand.
  /// \pre shapes were made within the step
  void frame(const scene::Simulation& simulation, std::uint64_t step);

private:
  formats::SharedShapes& file_;
  std::vector<std::vector<double>> positions_; ///< by object
};

} // namespace gewebe::cli
