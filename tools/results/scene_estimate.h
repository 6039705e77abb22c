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
#include <optional>
#include <span>
#include <vector>

namespace gewebe::cli {

/// Estimated errors of the elements of one object after the last step.
struct ElementErrors {
  const tetrahedra::TetMesh* mesh = nullptr; ///< at rest, cut as the object is
  std::span<const double> energy;            ///< as StressError::energy, one per tetrahedron
  double total = 0;                          ///< σ : ε of the body in the same unit, above 0
  std::span<const fem::SolidElement> elements;
  std::span<const fem::CornerTensors> stresses;
};

/// Keeps the elements of each solid between steps.
class SceneEstimates {
public:
  /// Estimates the errors of all objects after a step whose news were not taken yet.
  /// \param gravity  mm/s²  \throw Error as Simulation::displacement
  std::vector<formats::EstimateAnswer> find(const scene::Simulation& simulation,
                                            const Vec3& gravity);

  /// Errors that the last find() summed up. None where it had no estimate, or nothing is deformed.
  /// Valid until the next find().
  std::optional<ElementErrors> elements(std::size_t object) const;

private:
  struct Solid {
    tetrahedra::TetMesh mesh;
    std::vector<fem::SolidMaterial> materials;
    std::vector<fem::SolidElement> elements;
    std::vector<double> energy; ///< errors by element, empty where nothing is deformed
    std::vector<fem::CornerTensors> stresses;
    double total = 0;
  };
  std::map<std::size_t, Solid> solids_; ///< by object
};

} // namespace gewebe::cli
