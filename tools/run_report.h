#pragma once
// What ffe-run tells of a scene.

#include "formats/scene_run.h"
#include "formats/step_latency.h"
#include "tools/cli.h"

namespace gewebe {

/// \param rate the one asked for, 0: none
void report_scene(cli::Run& run, const SceneRun& scene, const StepLatency& latency, double rate);

} // namespace gewebe
