#pragma once
// What a run tells of its objects, once of each, because their shapes are not to be trusted.

#include "scene/simulation.h"
#include "statics/shape_check.h"

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace gewebe {

/// Looks at shapes that are there anyway, and only where something moves farther than it did.
class SceneChecks {
public:
  using Tell = std::function<void(const std::string&)>;

  /// Behind a step. `distrust` is told of triangles turned over, of volumes that changed by more
  /// than 10 % and of edges of elastodynamic objects strained by more than half, `warn` of a change
  /// of method by which an object jumps by over a tenth of its displacement, and of solids whose
  /// steps ran out of rounds. \param shapes whether shapes of elastostatic objects are computed
  /// anyway
  void look(const Simulation& simulation, bool shapes, const Tell& warn, const Tell& distrust);

private:
  struct Object {
    const Model* model = nullptr; ///< that `check` is of
    std::size_t nodes = 0, triangles = 0;
    std::unique_ptr<ShapeCheck> check;
    double looked_at = 0; ///< largest displacement when it was last looked at
    int not_looked = 0;
    bool turned = false, volume = false, strain = false, jump = false,
         unfinished = false; ///< told
  };
  void look_at(const Simulation& simulation, std::size_t number, bool shapes, const Tell& distrust);
  void look_at_shape(const Simulation& simulation, std::size_t number, const Tell& distrust);

  std::map<std::size_t, Object> objects_;
};

} // namespace gewebe
