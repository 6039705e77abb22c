#include "tools/run/scene_run.h"

#include "base/digest.h"
#include "base/error.h"
#include "formats/scene/frames_binary.h"
#include "formats/scene/scene.h"
#include "formats/scene/scene_answer.h"
#include "formats/scene/scene_changes.h"
#include "tools/run/event_log.h"
#include "tools/run/scene_checks.h"
#include "tools/run/scene_record.h"
#include "tools/run/scene_result.h"
#include "tools/run/scene_stress.h"
#include "tools/run/step_latency.h"
#include "tools/run/undelivered.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <istream>
#include <map>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

namespace gewebe {

namespace {

constexpr std::uint64_t longest_line = 1U << 24U; // that is carried out
constexpr std::uint64_t longest_rest = 1U << 30U; // of one that is not, to be passed over
constexpr double max_samples = 1e9;
constexpr double default_step = 1.0 / 60;

/// A file that a line names may be wrong in a place of its own: both places count.
std::string with_place(const Error& error) {
  return (error.place().empty() ? "" : error.place() + ": ") + error.what();
}

/// A file of an object, read late, is the fault of the line that named it.
struct WrongFile {
  std::uint64_t line = 0;
  std::string text;
};

template <class Work>
auto of_object(std::uint64_t line, Work&& work) {
  try {
    return work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw WrongFile{line, with_place(error)};
  }
}

} // namespace

struct SceneRun::State {
  std::string name;
  SceneOptions options;
  Simulation simulation;
  SceneCounts counts;
  Digest digest;
  std::uint64_t line = 0, steps = 0;
  std::map<std::string, std::string> lists; // node lists that the line named
  std::optional<RunCommand> under_way;      // of a run of several steps, as far as it came
  std::uint64_t first_error = 0;
  std::string first_error_text;
  SceneChecks checks;
  SceneStress stress;
  Vec3 gravity, answered_gravity; ///< now, and at the last answer or accepted line
  std::optional<SceneResult> result;
  std::vector<std::string> stores; ///< by object; "" where it has none
  std::vector<std::string> models; ///< files that objects were made of

  State(std::string n, const Context& context, SceneOptions o)
      : name(std::move(n)), options(std::move(o)), simulation(context, simulation_options()) {
    if (options.result != nullptr)
      result.emplace(*options.result, stress);
  }

  SimulationOptions simulation_options() {
    SimulationOptions s;
    s.measure_error = options.measure_error;
    s.tolerance = options.tolerance;
    s.guard = options.serve;
    // Now, so that one that can't be made is the fault of its step.
    s.shapes =
        options.measure_error || (options.result != nullptr && options.result->wants_models());
    s.surfaces = options.serve && options.measure;
    s.rate = options.rate;
    if (options.warn)
      s.warn = [this](const std::string& text) { warn(text); };
    s.distrust = [this](const std::string& text) { distrust(text); };
    s.applied = [this](const Change& change) {
      if (const auto* const set = std::get_if<SetInstrument>(&change))
        checks.instrument(set->instrument, set->shape);
      else if (const auto* const set_gravity = std::get_if<SetGravity>(&change))
        gravity = set_gravity->gravity;
    };
    if (options.events != nullptr)
      s.log = [this](const ChangeRow& row) { options.events->change(simulation.time(), row); };
    return s;
  }

  void warn(const std::string& text) {
    if (options.events != nullptr)
      options.events->message(simulation.time(), "warning", text);
    if (options.warn)
      options.warn(text);
  }

  void distrust(const std::string& text) {
    if (options.events != nullptr)
      options.events->message(simulation.time(), "warning", text);
    if (const auto& tell = options.distrust ? options.distrust : options.warn)
      tell(text);
  }

  void add(const ObjectCommand& c) {
    if (options.files.check) {
      options.files.check(c.model);
      if (!c.store.empty())
        options.files.check(c.store);
    }
    ObjectSource source;
    source.model = [this, file = c.model, at = line] {
      return of_object(at, [&] {
        Model model = options.files.model(file);
        ++counts.models;
        counts.nodes += model.nodes.size();
        return model;
      });
    };
    source.stiffness = [this, file = c.store, at = line](const Model& model) {
      if (file.empty())
        return std::shared_ptr<ComplianceSource>();
      StoredStiffness stored = of_object(at, [&] { return options.files.store(file, model); });
      ++counts.stores;
      stored.factor = [at, factor = std::move(stored.factor)] { return of_object(at, factor); };
      return compliance_of_store(std::move(stored));
    };
    simulation.add_object(c.name, std::move(source), c.method, c.integration, c.solid);
    if (c.warp)
      simulation.apply(SetWarp{simulation.object_count() - 1});
    stores.resize(simulation.object_count()); // parts that came off have none
    stores.back() = c.store;
    models.push_back(c.model);
    if (options.events != nullptr)
      options.events->object(simulation.time(), c.name, c.model, c.method);
  }

  /// Two-step asks the object's store for its second stage, where it has no model.
  void add_stage(SetTwoStep& set, const std::string& file) {
    if (!file.empty()) {
      set.model = std::make_shared<const Model>(options.files.model(file));
      models.push_back(file);
      return;
    }
    if (simulation.object(set.object).staged)
      return;
    if (set.object >= stores.size() || stores[set.object].empty())
      throw Error("object " + simulation.object(set.object).name +
                  " has no store, expected one with a second stage");
    set.second = options.files.second_stage(stores[set.object], simulation.model(set.object));
  }

  void write(const EmitModelCommand& c) {
    const std::size_t object = find_object(simulation, c.object);
    if (!options.files.write_model)
      throw Error("models can't be written here");
    if (std::find(models.begin(), models.end(), c.file) != models.end())
      throw Error(c.file + " is the model of an object of this scene, expected another file");
    options.files.write_model(c.file, simulation.model(object));
    if (options.events != nullptr)
      options.events->model(simulation.time(), c.object, c.file);
  }

  void tell_stress(const EmitStressCommand& c) {
    const std::vector<std::uint32_t>& nodes =
        stress.ask(simulation, c, [&](const std::string& list) {
          return lists[list] = options.files.node_list(list);
        });
    simulation.want_shapes();
    if (options.events != nullptr)
      options.events->stress(simulation.time(), c.object, nodes);
  }

  void schedule(const Command& command, const ChangeCommand& what) {
    Change change = scene_change(what, simulation, [&](const std::string& list) {
      return lists[list] = options.files.node_list(list);
    });
    if (auto* const two_step = std::get_if<SetTwoStep>(&change)) {
      if (stress.asked(two_step->object))
        throw Error("object " + what.object +
                    " tells its stress, which would be that of no one material, expected no "
                    "two-step");
      add_stage(*two_step, what.stage);
    }
    if (command.every)
      simulation.schedule(simulation.time(), change, *command.at);
    else if (command.at)
      simulation.schedule(*command.at, change);
    else
      simulation.apply(change);
  }

  void step(const StepCommand& c) {
    go_on([&] {
      simulation.step(c.dt.value_or(simulation.settings().timestep.value_or(default_step)));
    });
  }

  void sync() {
    if (options.reply)
      deliver([&] {
        options.reply(options.binary ? binary_sync(simulation, steps) : text_sync(simulation));
      });
  }

  void execute(const Command& command) {
    if (const auto* const change = std::get_if<ChangeCommand>(&command.what))
      schedule(command, *change);
    else if (const auto* const object = std::get_if<ObjectCommand>(&command.what))
      add(*object);
    else if (const auto* const emit = std::get_if<EmitModelCommand>(&command.what))
      write(*emit);
    else if (const auto* const tensors = std::get_if<EmitStressCommand>(&command.what))
      tell_stress(*tensors);
    else if (const auto* const one = std::get_if<StepCommand>(&command.what))
      step(*one);
    else if (const auto* const many = std::get_if<RunCommand>(&command.what))
      run(*many);
    else
      sync();
  }

  /// A step and its answer, behind the first frame. Only when the step is done, so that one that
  /// fails leaves nothing.
  template <class Step>
  void go_on(Step&& step) {
    require_object();
    const std::size_t objects = simulation.object_count(); // before parts come off
    if (result)
      result->need_models(simulation, objects); // a file that is wrong fails the step
    step();
    if (result)
      result->first_frame(simulation, objects);
    answer();
  }

  void run(const RunCommand& c) {
    require_object();
    const double start = simulation.time(), span = c.until - start;
    const double exact = span / c.every;
    if (!(exact <= max_samples))
      throw Error("over 1e9 steps, expected fewer");
    const auto sample = [&](double time) {
      go_on([&] {
        simulation.step_to(time);
        under_way = RunCommand{time, c.every};
      });
    };
    // A hair more than a whole number of steps is rounding; a last one may be shorter.
    const auto count = static_cast<std::int64_t>(std::ceil(exact * (1 - 1e-12)));
    for (std::int64_t k = 1; k < count; ++k)
      sample(start + static_cast<double>(k) * c.every);
    if (!(span == 0))
      sample(c.until); // which refuses a past one
  }

  void require_object() const {
    if (simulation.object_count() == 0)
      throw Error("there is no object, expected an object command first");
  }

  void answer() {
    ++steps;
    checks.look(
        simulation,
        simulation.settings().emits.any_shapes() || options.result != nullptr || options.measure,
        [this](const std::string& text) { warn(text); },
        [this](const std::string& text) { distrust(text); });
    stress.find(simulation, gravity);
    answered_gravity = gravity;
    if (options.reply)
      deliver([&] {
        options.reply(options.binary ? binary_answer(simulation, steps, stress.answers())
                                     : text_answer(simulation, steps, stress.answers()));
      });
    if (options.events != nullptr)
      for (const Cutting& c : simulation.news().cuttings)
        options.events->cutting(simulation, c);
    if (options.latency != nullptr)
      deliver([&] { options.latency->answered(steps, simulation.time()); });
    if (result)
      result->frame(simulation);
    simulation.take_news();
    if (options.measure)
      deliver([&] { measure(); });
    if (options.events != nullptr)
      deliver([&] { options.events->keep(); });
  }

  void measure() {
    digest.add(simulation.time());
    for (std::size_t i = 0; i < simulation.object_count(); ++i) {
      // Not whole, for to measure a solid must not cost what is inside.
      const std::span<const double> u = simulation.surface_displacement(i);
      const std::vector<NodeVector>& forces = simulation.contact_forces(i);
      // Whether an object was read must not matter.
      if (forces.empty() && std::all_of(u.begin(), u.end(), [](double x) { return x == 0; }))
        continue;
      digest.add(u);
      for (std::size_t k = 0; k < u.size(); k += 3)
        counts.largest_displacement =
            std::max(counts.largest_displacement, norm({u[k], u[k + 1], u[k + 2]}));
      for (const NodeVector& f : forces) {
        digest.add(std::uint64_t{f.node});
        digest.add_bytes(&f.value, sizeof f.value);
      }
    }
  }

  /// The line was carried out.
  void accept(std::string_view text, const Command& command) {
    ++counts.commands;
    answered_gravity = gravity;
    deliver([&] {
      if (options.record != nullptr)
        options.record->line(text, command, lists);
      if (options.events != nullptr)
        options.events->keep();
    });
  }

  /// The line was not carried out, or only in part if it asked for many steps.
  void refuse(std::uint64_t at, const std::string& text) {
    ++counts.errors;
    gravity = answered_gravity;
    if (first_error == 0) {
      first_error = at;
      first_error_text = text;
    }
    deliver([&] {
      if (options.record != nullptr) {
        if (under_way)
          options.record->run(under_way->until, under_way->every);
        for (const std::size_t object : simulation.take_renewed())
          options.record->renew(simulation.object(object).name);
      }
      if (options.events != nullptr) {
        options.events->drop();
        options.events->message(simulation.time(), "error", std::to_string(at) + ": " + text);
        options.events->keep();
      }
      if (!options.serve)
        throw Error(name + ":" + std::to_string(at), text);
      if (options.reply) {
        const std::string said = at == line ? text : "line " + std::to_string(at) + ": " + text;
        options.reply(options.binary ? binary_error(steps, text_error(line, said))
                                     : text_error(line, said));
      }
    });
  }
};

SceneRun::SceneRun(std::string name, const Context& context, SceneOptions options)
    : state_(std::make_unique<State>(std::move(name), context, std::move(options))) {}
SceneRun::~SceneRun() = default;

template <class Work>
void SceneRun::numbered(Work&& work) {
  State& s = *state_;
  ++s.line;
  s.lists.clear();
  s.under_way.reset();
  try {
    try {
      work();
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      s.refuse(s.line, with_place(error));
    } catch (const WrongFile& file) {
      s.refuse(file.line, file.text);
    }
  } catch (const Undelivered& failure) {
    std::rethrow_exception(failure.error);
  }
}

void SceneRun::line(std::string_view text) {
  numbered([&] {
    const std::optional<Command> command = parse_scene_line(text);
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
    throw Error(s.name + ":" + std::to_string(file.line), file.text);
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
  return Error(s.name + ":" + std::to_string(s.first_error),
               s.first_error_text +
                   (s.counts.errors == 1
                        ? ""
                        : " (the first of " + std::to_string(s.counts.errors) + " errors)"));
}

const Simulation& SceneRun::simulation() const {
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

void run_scene(Input& input, SceneRun& run) {
  // The stream's buffer hands out what has come so far and waits only for more.
  std::streambuf& bytes = *input.stream().rdbuf();
  std::string line;
  std::uint64_t size = 0; // of the line, also of what is not kept
  for (;;) {
    const bool waits = bytes.in_avail() <= 0;
    const auto c = bytes.sbumpc();
    if (waits && run.latency() != nullptr)
      run.latency()->line_arrived();
    const bool end = c == std::streambuf::traits_type::eof();
    if (!end && c != '\n') {
      if (++size <= longest_line)
        line += static_cast<char>(c);
      else if (size == longest_line + 1)
        run.overlong_line(); // now: there may be no end to it
      else if (size > longest_rest)
        throw Error(input.name(), "a line of over 1 GiB, expected an end");
      continue;
    }
    if (size <= longest_line && (!end || !line.empty()))
      run.line(line);
    line.clear();
    size = 0;
    if (end)
      break;
  }
  run.finish();
}

} // namespace gewebe
