#pragma once
// Warnings of shapes that cannot be trusted, once per object.

#include "scene/simulation.h"
#include "statics/shape_check.h"

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace gewebe::cli {

/// Looks at shapes that are there anyway, and only where something moves farther than it did.
class SceneChecks {
public:
  using Tell = std::function<void(const std::string&)>;

  /// Call it after a step. `distrust` gets triangles turned over, volumes that changed by over 10
  /// %, and edges of elastodynamic objects strained by over half. `warn` gets a change of method by
  /// which an object jumps by over a tenth of its displacement, and of solids whose steps ran out
  /// of rounds. \param shapes whether shapes of elastostatic objects are computed anyway
  void look(const scene::Simulation& simulation, bool shapes, const Tell& warn,
            const Tell& distrust);

private:
  struct Object {
    const model::Model* model = nullptr; ///< that `check` is of
    std::size_t nodes = 0, triangles = 0;
    std::unique_ptr<statics::ShapeCheck> check;
    double looked_at = 0; ///< largest displacement when it was last looked at
    int not_looked = 0;
    bool turned = false, volume = false, strain = false, jump = false,
         unfinished = false; ///< reported
  };
  void look_at(const scene::Simulation& simulation, std::size_t number, bool shapes,
               const Tell& distrust);
  void look_at_shape(const scene::Simulation& simulation, std::size_t number, const Tell& distrust);

  std::map<std::size_t, Object> objects_;
};

} // namespace gewebe::cli
