#pragma once
// What is kept of a run that fails or is interrupted: frames, logs, record.

#include "base/error.h"
#include "formats/results/results_writer.h"
#include "tools/run/event_log.h"
#include "tools/run/scene_record.h"
#include "tools/run/step_latency.h"
#include "tools/shared/cli.h"

#include <optional>

namespace gewebe {

/// The files beside the result.
class RunLogs {
public:
  /// Those that aren't there are null, or no log of latencies.
  RunLogs(EventLog* events, SceneRecord* record, StepLatency& latency)
      : events_(events), record_(record), latency_(latency) {}

  bool any() const;
  /// From now on a signal or a crash leaves what they hold, as FILE.part.
  void outlive_signals();
  /// All of them appear that can. \return the first failure
  std::optional<Error> commit();

private:
  EventLog* events_;
  SceneRecord* record_;
  StepLatency& latency_;
};

/// Keeps the frames, if `result` is there, and says so behind the error that ended the run, or
/// behind "interrupted" where a signal did. \param time of the scene
Error ending_of_failed_run(const Error& error, ResultWriter* result, double time);

/// Tells with -v and in --stats what `recover_result` found.
void report_recovered(cli::Run& run, const KeptResult& kept);

} // namespace gewebe
