#pragma once
// Stresses of solids in a running scene: requests and values.

#include "fem/assembly.h"
#include "fem/stress.h"
#include "formats/scene/command.h"
#include "formats/scene/scene_answer.h"
#include "geometry/vec3.h"
#include "model/selector.h"
#include "scene/simulation.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace gewebe::cli {

class SceneStress {
public:
  /// Requests those of an object from now on, replacing an earlier request.
  /// \return the nodes   \throw Error if there is no such object or node, it has no tetrahedra, or
  /// goes on by two steps, whose stress is that of no one material
  const std::vector<std::uint32_t>& ask(const scene::Simulation& simulation,
                                        const formats::EmitStressCommand& command,
                                        const model::LoadNodeList& lists);
  bool asked(std::size_t object) const { return solids_.contains(object); }

  /// Behind a step, whose news were not taken yet: finds the fields of its shapes under the present
  /// gravity (mm/s²). Of a solid that was cut answers tell of the copies of its nodes too, and of
  /// what was put nearest to one.
  /// \throw Error as Simulation::displacement
  void find(const scene::Simulation& simulation, const Vec3& gravity);
  /// Of the last find(), 0 before it; nothing without a request.
  const fem::SolidFields* fields(std::size_t object) const;
  std::vector<formats::StressAnswer> answers() const;

private:
  struct Solid {
    tetrahedra::TetMesh mesh;
    std::vector<fem::SolidMaterial> materials;
    std::vector<fem::SolidElement> elements;
    std::vector<std::uint32_t> first; ///< of answers' nodes: what they were in the model as it came
    std::vector<std::uint32_t> nodes; ///< that answers tell of
    fem::SolidFields fields;
  };
  static void take_elements(Solid& solid, const model::Model& model);
  std::map<std::size_t, Solid> solids_; ///< by object
};

} // namespace gewebe::cli
