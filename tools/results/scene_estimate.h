#pragma once
// Discretisation errors of the solids of a running scene (fem/stress_error.h).

#include "fem/assembly.h"
#include "fem/element.h"
#include "formats/scene/scene_answer.h"
#include "geometry/vec3.h"
#include "scene/simulation.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <map>
#include <vector>

namespace gewebe::cli {

/// Keeps the elements of each solid between steps.
class SceneEstimates {
public:
  /// Estimates the errors of all objects after a step whose news were not taken yet.
  /// \param gravity  mm/s²  \throw Error as Simulation::displacement
  std::vector<formats::EstimateAnswer> find(const scene::Simulation& simulation,
                                            const Vec3& gravity);

private:
  struct Solid {
    tetrahedra::TetMesh mesh;
    std::vector<fem::SolidMaterial> materials;
    std::vector<fem::SolidElement> elements;
  };
  std::map<std::size_t, Solid> solids_; ///< by object
};

} // namespace gewebe::cli
