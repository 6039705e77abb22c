// ffe-run: scene -> replies, shapes, forces.

#include "formats/results/partial_result.h"
#include "formats/results/shared_shapes.h"
#include "formats/stream/removal.h"
#include "tools/cli/cli.h"
#include "tools/cli/distrust.h"
#include "tools/cli/progress_bar.h"
#include "tools/run/event_log.h"
#include "tools/run/failed_run.h"
#include "tools/run/run_arguments.h"
#include "tools/run/run_report.h"
#include "tools/run/scene_progress.h"
#include "tools/run/scene_record.h"
#include "tools/run/scene_run.h"
#include "tools/run/step_latency.h"
#include "tools/serve/scene_answers.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unistd.h>
#include <utility>

using namespace gewebe;

namespace {

void work(cli::Run& run, const cli::RunArguments& in) {
  if (!in.recover.empty())
    return cli::report_recovered(run, formats::recover_result(in.recover));
  const formats::Kind kind = in.result.kind(run);
  const auto warn = [&](const std::string& text) { run.warn(text); };
  const std::unique_ptr<formats::ResultWriter> result = in.result.open(run, kind);
  const bool reads = in.listen.empty() || in.scene != "-";
  const bool spoken =
      reads && (kind == formats::Kind::unknown || (run.output() != "-" && !run.quiet()));
  if (!spoken && in.listen.empty() && (in.serve || in.binary))
    throw UsageError(std::string(in.serve ? "--serve" : "--binary") +
                     " needs answers, but this run prints none, expected it without --to, "
                     "and without -q together with -o");
  const auto shared = // there when the first client comes
      in.shapes.empty() ? nullptr : std::make_unique<formats::SharedShapes>(in.shapes);
  cli::SceneAnswers answers(spoken, in.binary, in.listen, {.awake = in.awake, .warn = warn});
  std::optional<cli::EventLog> events;
  if (!in.events.empty())
    events.emplace(in.events, run.output_options(false));
  cli::StepLatency latency(in.rate.value_or(0));
  if (!in.latencies.empty())
    latency.log_to(in.latencies, run.output_options(false));
  std::optional<cli::SceneProgress> progress;
  cli::start_progress(progress, run.progress_bar(), in.scene, !in.listen.empty());
  std::optional<formats::Input> input;
  if (reads)
    input.emplace(in.scene, false);
  const std::string name = input ? input->name() : "-"; // where names of files count from
  std::optional<cli::SceneRecord> record;
  if (!in.record.empty())
    record.emplace(in.record, run.output_options(false), name);

  cli::SceneOptions options;
  options.files = cli::scene_files(name, run.context(), warn);
  options.warn = warn;
  options.distrust = [&](const std::string& text) { cli::distrust(run, "ffe-run", text); };
  options.serve = in.serve;
  options.acknowledge = in.acknowledge;
  options.binary = in.binary;
  options.rate = in.rate.value_or(0);
  options.result = result.get();
  options.events = events ? &*events : nullptr;
  options.record = record ? &*record : nullptr;
  options.latency = &latency;
  options.shared = shared.get();
  options.measure = run.stats_wanted();
  options.measure_error = in.verify;
  options.estimate = in.estimate;
  options.tolerance = in.tolerance;
  options.gone = [&] { return answers.unheard(); };
  const bool shared_screen = progress && spoken && ::isatty(1) != 0;
  if (answers.any())
    options.reply = [&](std::string_view bytes) {
      if (shared_screen)
        cli::erase_progress();
      answers.write(bytes);
    };
  if (progress)
    options.progress = [&](double time, std::uint64_t frames) { progress->advance(time, frames); };
  Context context = run.context();
  context.cancelled = [] { return formats::deferred_signal() != 0; };
  cli::SceneRun scene(input ? name : in.listen, context, options);
  cli::RunLogs logs(events ? &*events : nullptr, record ? &*record : nullptr, latency);
  formats::ResultWriter* const kept = in.no_partial ? nullptr : result.get();
  cli::outlive_failures(kept, logs);
  try {
    run.timed("run", [&] {
      answers.run(input ? &*input : nullptr, scene);
      scene.finish();
    });
    if (progress)
      progress->finish();
    run.timed("write", [&] {
      if (result)
        result->commit();
      answers.commit();
    });
  } catch (const Error& error) {
    cli::end_failed_run(error, kept, logs, scene.simulation().time());
  }
  if (const std::optional<Error> error = run.timed("write", [&] { return logs.commit(); }))
    throw Error(*error);
  if (run.stats_wanted())
    cli::report_scene(run, scene, latency, {in.rate.value_or(0), options.measure_error});
  if (in.verify)
    cli::require_verified(scene.simulation().counts().elastostatic, in.tolerance);
  if (const std::optional<Error> error = scene.first_error())
    run.fail_at_end(*error);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("ffe-run", "Runs a scene of deformable objects, command by command.");
  cli::RunArguments in;
  in.declare(p);
  const int status = p.run(argc, argv, [&](cli::Run& run) { work(run, in); });
  if (formats::deferred_signal() != 0)
    formats::end_by_deferred_signal();
  return status;
}
