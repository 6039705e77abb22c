// ffe-run: scene -> replies, shapes, forces.

#include "formats/results/partial_result.h"
#include "formats/results/shared_shapes.h"
#include "formats/stream/removal.h"
#include "tools/run/event_log.h"
#include "tools/run/failed_run.h"
#include "tools/run/result_choice.h"
#include "tools/run/run_report.h"
#include "tools/run/scene_answers.h"
#include "tools/run/scene_progress.h"
#include "tools/run/scene_record.h"
#include "tools/run/scene_run.h"
#include "tools/run/step_latency.h"
#include "tools/shared/cli.h"
#include "tools/shared/distrust.h"
#include "tools/shared/progress_bar.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unistd.h>
#include <utility>

using namespace gewebe;

namespace {

struct Arguments {
  std::string scene = "-";
  bool serve = false, acknowledge = false, awake = false, binary = false, verify = false;
  bool no_partial = false;
  std::optional<double> rate;
  double tolerance = 0;
  std::string listen, shapes, events, record, latencies, recover;
  ResultChoice result;
};

void work(cli::Run& run, const Arguments& in) {
  if (!in.recover.empty())
    return report_recovered(run, recover_result(in.recover));
  const Kind kind = in.result.kind(run);
  const auto warn = [&](const std::string& text) { run.warn(text); };
  const std::unique_ptr<ResultWriter> result = in.result.open(run, kind);
  const bool reads = in.listen.empty() || in.scene != "-";
  const bool spoken = reads && (kind == Kind::unknown || (run.output() != "-" && !run.quiet()));
  if (!spoken && in.listen.empty() && (in.serve || in.binary))
    throw UsageError(std::string(in.serve ? "--serve" : "--binary") +
                     " is about answers, of which there are none here, expected it without --to, "
                     "and without -q beside -o");
  const auto shared = // there when the first client comes
      in.shapes.empty() ? nullptr : std::make_unique<SharedShapes>(in.shapes);
  SceneAnswers answers(spoken, in.binary, in.listen, {.awake = in.awake, .warn = warn});
  std::optional<EventLog> events;
  if (!in.events.empty())
    events.emplace(in.events, run.output_options(false));
  StepLatency latency(in.rate.value_or(0));
  if (!in.latencies.empty())
    latency.log_to(in.latencies, run.output_options(false));
  std::optional<SceneProgress> progress;
  start_progress(progress, run.progress_bar(), in.scene, !in.listen.empty());
  std::optional<Input> input;
  if (reads)
    input.emplace(in.scene, false);
  const std::string name = input ? input->name() : "-"; // where names of files count from
  std::optional<SceneRecord> record;
  if (!in.record.empty())
    record.emplace(in.record, run.output_options(false), name);

  SceneOptions options;
  options.files = scene_files(name, run.context(), warn);
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
  context.cancelled = [] { return deferred_signal() != 0; };
  SceneRun scene(input ? name : in.listen, context, options);
  RunLogs logs(events ? &*events : nullptr, record ? &*record : nullptr, latency);
  ResultWriter* const kept = in.no_partial ? nullptr : result.get();
  outlive_failures(kept, logs);
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
    end_failed_run(error, kept, logs, scene.simulation().time());
  }
  if (const std::optional<Error> error = run.timed("write", [&] { return logs.commit(); }))
    throw Error(*error);
  if (run.stats_wanted())
    report_scene(run, scene, latency, {in.rate.value_or(0), options.measure_error});
  if (in.verify)
    require_verified(scene.simulation().counts().elastostatic, in.tolerance);
  if (const std::optional<Error> error = scene.first_error())
    run.fail_at_end(*error);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("ffe-run", "Runs a scene of deformable objects, command by command.");
  Arguments in;
  in.result.declare(p);
  p.flag("--serve", in.serve, "answer a wrong line and go on");
  p.flag("--ack", in.acknowledge, "with --serve, answer each line by its number at last");
  p.option("--listen", in.listen, "PATH", "with --serve, a socket for clients, one at a time");
  p.option("--shapes-in", in.shapes, "FILE", "with --serve, where others map all shapes");
  p.flag("--busy-wait", in.awake, "with --serve, wait for lines without sleep");
  p.flag("--binary", in.binary, "answer in binary frames of float32");
  p.option("--events", in.events, "FILE", "who touched what when, as CSV");
  p.option("--record", in.record, "FILE", "what was accepted, as a scene that does it again");
  p.option("--tolerance", in.tolerance, "E",
           "error that shapes may have, of their largest displacement")
      .range(0, 0.1);
  p.flag("--verify", in.verify, "fail unless every shape is as exact as it should be");
  p.option("--rate", in.rate, "HZ", "steps a second that are wanted").positive();
  p.option("--latencies", in.latencies, "FILE", "how long each step took to answer, as CSV");
  p.flag("--no-partial", in.no_partial, "keep no frames of a run that fails or is interrupted");
  p.option("--recover", in.recover, "FILE", "keep the frames that a killed run has left of FILE");
  p.operand("SCENE", in.scene, "the scene");
  p.check([&] {
    for (const auto& [given, option] : {std::pair{in.acknowledge, "--ack"},
                                        {!in.listen.empty(), "--listen"},
                                        {in.awake, "--busy-wait"},
                                        {!in.shapes.empty(), "--shapes-in"}})
      if (given && !in.serve)
        throw UsageError(std::string(option) + " without --serve, expected both");
    in.result.check(p);
  });
  const int status = p.run(argc, argv, [&](cli::Run& run) { work(run, in); });
  if (deferred_signal() != 0)
    end_by_deferred_signal();
  return status;
}
