#include "tools/run/scene_run.h"

#include "base/error.h"
#include "formats/scene/frames_binary.h"
#include "formats/scene/scene.h"
#include "formats/scene/scene_answer.h"
#include "formats/scene/scene_query.h"
#include "tools/results/undelivered.h"
#include "tools/run/event_log.h"
#include "tools/run/scene_record.h"
#include "tools/run/scene_state_internal.h"
#include "tools/run/step_latency.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe::cli {

std::string with_place(const Error& error) {
  return (error.place().empty() ? "" : error.place() + ": ") + error.what();
}

SceneRun::State::State(std::string n, const Context& context, SceneOptions o)
    : name(std::move(n)), options(std::move(o)), simulation(context, simulation_options()) {
  if (options.result != nullptr)
    result.emplace(*options.result, stress);
  if (options.shared != nullptr)
    shared.emplace(*options.shared);
}

scene::SimulationOptions SceneRun::State::simulation_options() {
  scene::SimulationOptions s;
  s.measure_error = s.verify_shapes = options.measure_error;
  s.tolerance = options.tolerance;
  s.guard = options.serve;
  // Now, so that one that can't be made is the fault of its step.
  s.shapes =
      options.shared != nullptr || (options.result != nullptr && options.result->wants_models());
  s.rate = options.rate;
  if (options.warn)
    s.warn = [this](const std::string& text) { warn(text); };
  s.distrust = [this](const std::string& text) { distrust(text); };
  s.applied = [this](const scene::Change& change) {
    if (const auto* const set_gravity = std::get_if<scene::SetGravity>(&change))
      gravity = set_gravity->gravity;
  };
  if (options.events != nullptr)
    s.log = [this](const scene::ChangeRow& row) { options.events->change(simulation.time(), row); };
  return s;
}

void SceneRun::State::warn(const std::string& text) {
  if (options.events != nullptr)
    options.events->message(simulation.time(), "warning", text);
  if (options.warn)
    options.warn(text);
}

void SceneRun::State::distrust(const std::string& text) {
  if (options.events != nullptr)
    options.events->message(simulation.time(), "warning", text);
  if (const auto& tell = options.distrust ? options.distrust : options.warn)
    tell(text);
}

void SceneRun::State::sync() {
  if (options.reply)
    deliver([&] {
      options.reply(options.binary ? formats::binary_sync(simulation, steps)
                                   : formats::text_sync(simulation));
    });
}

/// Also without a reader, so that a wrong question is an error everywhere.
void SceneRun::State::tell(const formats::QueryCommand& query) {
  const std::string text = text_query(simulation, query, options.files.node_list);
  if (options.reply)
    deliver([&] { options.reply(options.binary ? formats::binary_told(steps, text) : text); });
}

void SceneRun::State::acknowledge() {
  if (options.acknowledge && options.reply)
    deliver([&] {
      options.reply(options.binary ? formats::binary_ok(steps, line.line)
                                   : formats::text_ok(line.line));
    });
}

void SceneRun::State::require_object() const {
  if (simulation.object_count() == 0)
    throw Error("there is no object, expected an object command first");
}

void SceneRun::State::answer() {
  ++steps;
  checks.look(
      simulation, simulation.settings().emits.any_shapes() || options.result != nullptr,
      [this](const std::string& text) { warn(text); },
      [this](const std::string& text) { distrust(text); });
  instrument_check.look(simulation, [this](const std::string& text) { warn(text); });
  stress.find(simulation, gravity);
  const std::vector<formats::EstimateAnswer> estimated =
      options.estimate ? estimates.find(simulation, gravity)
                       : std::vector<formats::EstimateAnswer>{};
  if (options.estimate && options.estimated)
    options.estimated(simulation, estimates, estimated);
  answered_gravity = gravity;
  if (shared) // before the reader of the answer looks
    shared->frame(simulation, steps);
  if (options.reply)
    deliver([&] {
      const std::vector<formats::StressAnswer> stresses = stress.answers();
      const formats::AnswerFields fields{stresses, estimated};
      options.reply(options.binary ? binary_answer(simulation, steps, fields)
                                   : text_answer(simulation, steps, fields));
    });
  if (options.events != nullptr) {
    for (const scene::Cutting& c : simulation.news().cuttings)
      options.events->cutting(simulation, c);
    options.events->instruments(simulation);
  }
  if (options.latency != nullptr)
    deliver([&] { options.latency->answered(steps, simulation.time()); });
  if (result)
    result->frame(simulation, estimated);
  simulation.take_news();
  if (options.measure)
    deliver([&] { measure(); });
  if (options.events != nullptr)
    deliver([&] { options.events->keep(); });
  if (options.progress)
    options.progress(simulation.time(), result ? result->frames() : steps);
}

void SceneRun::State::measure() {
  digest.add(simulation.time());
  for (std::size_t i = 0; i < simulation.object_count(); ++i) {
    // Only on request: measuring must not cost a shape.
    const std::span<const double> u = simulation.known_surface(i);
    const std::vector<contact::NodeVector>& forces = simulation.contact_forces(i);
    // Whether an object was read must not matter.
    if (forces.empty() && std::all_of(u.begin(), u.end(), [](double x) { return x == 0; }))
      continue;
    digest.add(u);
    for (std::size_t k = 0; k < u.size(); k += 3)
      counts.largest_displacement =
          std::max(counts.largest_displacement, norm({u[k], u[k + 1], u[k + 2]}));
    for (const contact::NodeVector& f : forces) {
      digest.add(std::uint64_t{f.node});
      digest.add_bytes(&f.value, sizeof f.value);
    }
  }
}

void SceneRun::State::accept(std::string_view text, const formats::Command& command) {
  ++counts.commands;
  answered_gravity = gravity;
  deliver([&] {
    if (options.record != nullptr && !std::holds_alternative<formats::QueryCommand>(command.what) &&
        !std::holds_alternative<formats::EndCommand>(command.what))
      options.record->line(text, command, lists);
    if (options.events != nullptr)
      options.events->keep();
  });
}

void SceneRun::State::refuse(const LinePlace& at, const std::string& text) {
  ++counts.errors;
  gravity = answered_gravity;
  if (counts.errors == 1)
    first_error = Error(named(at), text);
  deliver([&] {
    if (options.record != nullptr && under_way)
      options.record->run(under_way->until, under_way->every);
    if (options.events != nullptr) {
      options.events->drop();
      const std::string client =
          at.client == 0 ? "" : "client " + std::to_string(at.client) + " line ";
      options.events->message(simulation.time(), "error",
                              client + std::to_string(at.line) + ": " + text);
      options.events->keep();
    }
    if (!options.serve)
      throw Error(named(at), text);
    if (options.reply) {
      const std::string other = at.client == line.client ? ": " : " of an earlier client: ";
      const std::string said = at == line ? text : "line " + std::to_string(at.line) + other + text;
      const std::string reply = formats::text_error(line.line, said);
      options.reply(options.binary ? formats::binary_error(steps, reply) : reply);
    }
  });
}

std::string SceneRun::State::named(const LinePlace& at) const {
  return name + (at.client == 0 ? "" : ", client " + std::to_string(at.client)) + ":" +
         std::to_string(at.line);
}

SceneRun::SceneRun(std::string name, const Context& context, SceneOptions options)
    : state_(std::make_unique<State>(std::move(name), context, std::move(options))) {}
SceneRun::~SceneRun() = default;

template <class Work>
void SceneRun::numbered(Work&& work) {
  State& s = *state_;
  ++s.line.line;
  s.lists.clear();
  s.under_way.reset();
  try {
    try {
      work();
      s.acknowledge();
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      s.refuse(s.line, with_place(error));
    } catch (const WrongFile& file) {
      s.refuse(file.at, file.text);
    }
  } catch (const Undelivered& failure) {
    std::rethrow_exception(failure.error);
  }
}

void SceneRun::line(std::string_view text) {
  numbered([&] {
    const std::optional<formats::Command> command = formats::parse_scene_line(text);
    if (!command)
      return;
    state_->execute(*command);
    state_->accept(text, *command);
  });
}

void SceneRun::overlong_line() {
  numbered([] { throw Error("a line of over 16 MiB, expected shorter ones"); });
}

void SceneRun::finish() {
  State& s = *state_;
  try {
    at(s.name, [&] {
      if (s.counts.commands == 0)
        throw first_error().value_or(
            Error("no command, expected object, step or another, see scene(5)"));
      s.require_object();
      if (s.result)
        s.result->first_frame(s.simulation, s.simulation.object_count());
    });
  } catch (const Undelivered& failure) {
    std::rethrow_exception(failure.error);
  } catch (const WrongFile& file) {
    throw Error(s.named(file.at), file.text);
  }
  s.simulation.warn_of_thresholds();
  if (!s.options.warn)
    return;
  if (s.steps == 0)
    s.options.warn(s.name + ": no step, so nothing happens");
  else if (s.simulation.pending() > 0)
    s.options.warn(s.name + ": " + std::to_string(s.simulation.pending()) +
                   (s.simulation.pending() == 1 ? " event lies" : " events lie") +
                   " behind the last step and did not happen");
}

std::optional<Error> SceneRun::first_error() const {
  const State& s = *state_;
  if (s.counts.errors == 0)
    return std::nullopt;
  return Error(s.first_error.place(),
               s.first_error.what() +
                   (s.counts.errors == 1
                        ? ""
                        : " (the first of " + std::to_string(s.counts.errors) + " errors)"));
}

bool SceneRun::ended() const noexcept {
  return state_->ended;
}

std::uint64_t SceneRun::steps() const noexcept {
  return state_->steps;
}

void SceneRun::next_client() {
  state_->line = {0, state_->line.client + 1};
}

const scene::Simulation& SceneRun::simulation() const {
  return state_->simulation;
}

SceneCounts SceneRun::counts() const {
  SceneCounts counts = state_->counts;
  counts.frames = state_->result ? state_->result->frames() : 0;
  counts.digest = state_->digest.hex();
  return counts;
}

StepLatency* SceneRun::latency() const {
  return state_->options.latency;
}

} // namespace gewebe::cli
