#pragma once
// Passes a running scene to a result: new objects, cut models, frames.

#include "formats/results/results_writer.h"
#include "formats/scene/scene_answer.h"
#include "scene/simulation.h"
#include "tools/results/scene_stress.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::cli {

/// What the writer throws leaves as Undelivered, what the simulation throws as it is.
class SceneResult {
public:
  /// Keeps references to both.
  SceneResult(formats::ResultWriter& writer, const SceneStress& stress)
      : writer_(writer), stress_(stress) {}

  /// Reads the models of the first objects where the result shall have them.
  void need_models(const scene::Simulation& simulation, std::size_t objects) const;
  /// The first objects, and the frame before anything moves if there is none.
  void first_frame(const scene::Simulation& simulation, std::size_t objects);
  /// Behind a step, whose news were not taken yet: new objects, models that were cut, the frame.
  /// \param estimates  of all objects, or none
  void frame(const scene::Simulation& simulation,
             std::span<const formats::EstimateAnswer> estimates = {});

  std::uint64_t frames() const noexcept { return frames_; }

private:
  void add_objects(const scene::Simulation& simulation, std::size_t objects);
  void change_objects(const scene::Simulation& simulation);
  void set_instruments(const scene::Simulation& simulation);
  void set_attachments(const scene::Simulation& simulation);

  formats::ResultWriter& writer_;
  const SceneStress& stress_;
  std::size_t objects_ = 0; ///< that the result knows
  std::uint64_t frames_ = 0;
};

} // namespace gewebe::cli
