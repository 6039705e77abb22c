#include "tools/run/run_report.h"

#include "base/error.h"
#include "statics/warped_statics.h"
#include "text/number_text.h"

#include <cmath>
#include <cstdint>
#include <string>

namespace gewebe::cli {

void report_scene(cli::Run& run, const SceneRun& scene, const StepLatency& latency,
                  const SceneReport& report) {
  const SceneCounts counts = scene.counts();
  const scene::SimulationCounts steps = scene.simulation().counts();
  const statics::ElastostaticCounts& statics = steps.elastostatic;
  cli::Stats& stats = run.stats();
  stats.set("commands", counts.commands);
  stats.set("errors", counts.errors);
  stats.set("objects", static_cast<std::uint64_t>(scene.simulation().object_count()));
  stats.set("models_read", counts.models);
  stats.set("stores_opened", counts.stores);
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
  const scene::SimulationState state = scene.simulation().state();
  stats.set("kinetic_energy", state.kinetic_energy);
  stats.set("elastic_energy", state.elastic_energy);
  stats.set("largest_strain", state.strain);
  if (std::isfinite(state.safe_step))
    stats.set("safe_step", state.safe_step);
  stats.set("updates", statics.updates);
  stats.set("skipped_unchanged", statics.unchanged);
  stats.set("factors", statics.factors);
  stats.set("solves", statics.solves);
  stats.set("columns_read", statics.columns_read);
  stats.set("shapes", statics.shapes);
  stats.set("terms", statics.terms);
  stats.set("terms_left_out", statics.skipped);
  if (report.errors) {
    stats.set("backward_error", statics.backward_error);
    stats.set("backward_limit", statics.worst_shape.limit);
    stats.set("compressed", statics.worst_shape.relative);
    stats.set("shape_error", statics.shape_error);
  }
  if (statics.rounds > 0) {
    stats.set("warp_rounds", statics.rounds);
    stats.set("warp_change", statics.change);
  }
  if (steps.solids.steps > 0) {
    const dynamics::SolidStepCounts& solids = steps.solids;
    stats.set("solid_steps", solids.steps);
    stats.set("solid_rounds", solids.rounds);
    stats.set("solid_factors", solids.factors);
    stats.set("solid_unfinished", solids.unfinished);
    stats.set("solid_limited", solids.limited);
    if (const int order = scene.simulation().settings().order; order > 1) {
      stats.set("solid_order", order);
      stats.set("contact_first_order", steps.contact.first_order);
    }
    stats.seconds("solid_motion", solids.seconds);
  }
  const contact::StepReport& contact = steps.contact;
  if (contact.steps > 0) {
    stats.set("contact_steps", contact.steps);
    stats.set("contact_iterations", contact.iterations);
    stats.set("contact_iterations_largest", contact.most_iterations);
    stats.set("contact_halvings", contact.halvings);
    stats.set("contact_pairs_largest", contact.pairs);
    stats.set("contact_gap_smallest", contact.pairs > 0 ? contact.gap : 0);
    stats.set("contact_friction_residual", contact.friction_residual);
  }
  stats.set("contact_error", statics.contact_error);
  stats.set("largest_displacement", counts.largest_displacement);
  stats.set("largest_jump", steps.largest_jump);
  if (steps.cuts > 0) {
    stats.set("cuts", steps.cuts);
    stats.set("cut_corrections", steps.cut_woodbury);
    stats.set("cut_renewals", steps.cut_refactors);
    stats.set("cut_factors", steps.cut_factors);
    stats.set("cut_unprepared", steps.cut_unprepared);
  }
  stats.set("digest", counts.digest);
  if (report.rate > 0) {
    stats.set("rate", report.rate);
    stats.set("deadline_misses", latency.missed());
  }
  stats.seconds("step_p50", latency.quantile(0.5));
  stats.seconds("step_p99", latency.quantile(0.99));
  stats.seconds("step_p999", latency.quantile(0.999));
  stats.seconds("step_largest", latency.largest());
  stats.seconds("steps", latency.sum());
  // Of the clock, as all that stands here; nothing where no step took any time.
  if (latency.sum() > 0)
    stats.seconds("real_time_factor", scene.simulation().time() / latency.sum());
}

void require_verified(const statics::ElastostaticCounts& errors, double tolerance) {
  const auto require = [](const char* what, bool good, double error, double max,
                          const std::string& because) {
    if (!good)
      throw Error(std::string("the ") + what + " of a shape is " + text::number_text(error) +
                  ", expected at most " + text::number_text(max) + because);
  };
  require("error", errors.shape_error <= tolerance, errors.shape_error, tolerance, "");
  require("last round's change", errors.change <= statics::warp_tolerance, errors.change,
          statics::warp_tolerance, "");
  const statics::ShapeError& worst = errors.worst_shape;
  if (tolerance == 0)
    require("backward error", worst.within(), worst.error, worst.limit,
            worst.relative > 0
                ? " with columns compressed within " + text::number_text(worst.relative)
                : "");
}

} // namespace gewebe::cli
