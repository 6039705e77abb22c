#pragma once
// Report of ffe-run about a scene.

#include "tools/cli/cli.h"
#include "tools/run/scene_run.h"
#include "tools/run/step_latency.h"

namespace gewebe::cli {

struct SceneReport {
  double rate = 0;     ///< that of --rate; 0: none
  bool errors = false; ///< whether they were measured
};
void report_scene(cli::Run& run, const SceneRun& scene, const StepLatency& latency,
                  const SceneReport& report);

/// \throw Error unless every shape was within the tolerance, and its backward error that of a
/// right solution. \pre errors were measured
void require_verified(const statics::ElastostaticCounts& errors, double tolerance);

} // namespace gewebe::cli
