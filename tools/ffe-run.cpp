// ffe-run: scene -> replies, shapes, forces.

#include "formats/results_writer.h"
#include "formats/scene_run.h"
#include "tools/cli.h"

#include <cmath>
#include <memory>
#include <optional>

using namespace gewebe;

namespace {

/// The kind of result, or unknown where there is none but replies.
Kind result_kind(const cli::Run& run) {
  if (run.output() == "-" && run.to().empty())
    return Kind::unknown;
  const Kind kind = output_kind(run.to(), run.output(), Kind::hdf5, result_kinds());
  if (kind == Kind::hdf5 && run.output() == "-")
    throw UsageError("h5 can't go to standard output, expected -o FILE");
  return kind;
}

void report(cli::Run& run, const SceneRun& scene) {
  const SceneCounts counts = scene.counts();
  const SimulationCounts steps = scene.simulation().counts();
  const ElastostaticCounts& still = steps.elastostatic;
  cli::Stats& stats = run.stats();
  stats.set("commands", counts.commands);
  stats.set("objects", static_cast<std::uint64_t>(scene.simulation().object_count()));
  stats.set("nodes", counts.nodes);
  stats.set("steps", steps.steps);
  stats.set("frames", counts.frames);
  stats.set("time", scene.simulation().time());
  stats.set("integration_steps", steps.integration);
  stats.set("skipped_at_rest", steps.resting);
  const std::uint64_t advances = steps.resting + steps.moving;
  stats.set("sleeping_share",
            advances == 0 ? 0.0
                          : static_cast<double>(steps.resting) / static_cast<double>(advances));
  const SimulationState state = scene.simulation().state();
  stats.set("kinetic_energy", state.kinetic_energy);
  stats.set("elastic_energy", state.elastic_energy);
  stats.set("largest_strain", state.strain);
  if (std::isfinite(state.safe_step))
    stats.set("safe_step", state.safe_step);
  stats.set("updates", still.updates);
  stats.set("skipped_unchanged", still.unchanged);
  stats.set("factors", still.factors);
  stats.set("solves", still.solves);
  stats.set("columns_read", still.columns_read);
  stats.set("backward_error", still.backward_error);
  stats.set("contact_error", still.contact_error);
  stats.set("largest_displacement", counts.largest_displacement);
  stats.set("digest", counts.digest);
}

void work(cli::Run& run, const std::string& path) {
  const Kind kind = result_kind(run);
  std::unique_ptr<ResultWriter> result;
  if (kind != Kind::unknown)
    result = open_result(kind, run.output(), run.output_options(is_binary(kind)));
  std::optional<Output> replies;
  if (kind == Kind::unknown || (run.output() != "-" && !run.quiet()))
    replies.emplace("-", Output::Options{.binary = false});
  Input input(path, false);

  SceneOptions options;
  options.files = scene_files(input.name(), run.context());
  options.warn = [&](const std::string& text) { run.warn(text); };
  options.result = result.get();
  options.measure = run.stats_wanted();
  if (replies)
    options.reply = [&](std::string_view text) {
      replies->write(text);
      replies->stream().flush(); // at once: who asked waits for it
    };
  SceneRun scene(input.name(), run.context(), options);
  run.timed("run", [&] { run_scene(input, scene); });
  run.timed("write", [&] {
    if (result)
      result->commit();
    if (replies)
      replies->commit();
  });
  if (run.stats_wanted())
    report(run, scene);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("ffe-run", "Runs a scene of deformable objects, command by command.");
  std::string scene = "-";
  p.output_kinds(result_kinds());
  p.operand("SCENE", scene, "the scene");
  return p.run(argc, argv, [&](cli::Run& run) { work(run, scene); });
}
