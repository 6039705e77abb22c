#pragma once
// What is kept of a run that fails or is interrupted: frames, logs, record.

#include "base/error.h"
#include "formats/results/results_writer.h"
#include "tools/cli/cli.h"
#include "tools/run/event_log.h"
#include "tools/run/scene_record.h"
#include "tools/run/step_latency.h"

#include <optional>

namespace gewebe::cli {

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

/// From now on a signal ends the run at its next check, so that frames and logs can be kept.
/// \param result  null: no frames are to be kept
void outlive_failures(formats::ResultWriter* result, RunLogs& logs);

/// Keeps logs and, if `result` is there, frames. The error's message, or "interrupted" behind a
/// signal, is completed by a note of the kept files. Where the reader of answers has gone
/// (SIGPIPE), the program ends by the signal without a message, and logs stay FILE.part. \param
/// time  of the scene, s
[[noreturn]] void end_failed_run(const Error& error, formats::ResultWriter* result, RunLogs& logs,
                                 double time);

/// Reports with -v and in --stats what `recover_result` found.
void report_recovered(cli::Run& run, const formats::KeptResult& kept);

} // namespace gewebe::cli
