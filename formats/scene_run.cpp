#include "formats/scene_run.h"

#include "base/digest.h"
#include "base/error.h"
#include "formats/ela.h"
#include "formats/scene.h"
#include "formats/stiffness_store.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <exception>
#include <istream>

namespace gewebe {

namespace {

constexpr std::size_t longest_line = 1U << 20U;
constexpr double most_samples = 1e9;

void append(std::string& text, double value) {
  std::array<char, 32> number{};
  text.append(number.data(),
              std::to_chars(number.data(), number.data() + number.size(), value).ptr);
}

void append(std::string& text, const Vec3& v, char end) {
  append(text, v.x);
  text += ' ';
  append(text, v.y);
  text += ' ';
  append(text, v.z);
  text += end;
}

/// A file that a line names may be wrong in a place of its own: both places count.
template <class Work>
auto at_line(const std::string& name, std::uint64_t line, Work&& work) {
  try {
    return work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error(name + ":" + std::to_string(line),
                (error.place().empty() ? "" : error.place() + ": ") + error.what());
  }
}

/// A failure of what takes answers and results is no fault of the line.
struct Undelivered {
  std::exception_ptr error;
};

template <class Work>
void deliver(Work&& work) {
  try {
    work();
  } catch (const Error&) {
    throw Undelivered{std::current_exception()};
  }
}

} // namespace

SceneFiles scene_files(const std::string& scene, const Context& context) {
  const std::size_t slash = scene.find_last_of('/');
  const std::string folder =
      scene == "-" || slash == std::string::npos ? "" : scene.substr(0, slash + 1);
  const auto resolve = [folder](const std::string& name) {
    if (name == "-")
      return folder + "./-"; // a file, for the pipe may be the scene's
    return name.starts_with('/') ? name : folder + name;
  };
  SceneFiles files;
  files.model = [resolve, context](const std::string& name) {
    Input input(resolve(name), false);
    return read_ela(input, context);
  };
  files.store = [resolve](const std::string& name, const Model& model) {
    const auto store = std::make_shared<StiffnessStore>(resolve(name));
    const StiffnessFacts facts = store->facts(model);
    StiffnessParts parts;
    parts.columns = store->columns(facts);
    parts.factor = [store, facts] { return store->factor(facts); };
    return parts;
  };
  files.second_stage = [resolve](const std::string& name, const Model& model) {
    const auto store = std::make_shared<StiffnessStore>(resolve(name));
    const std::optional<StiffnessFacts> facts = store->second_stage(store->facts(model));
    if (!facts)
      throw Error(resolve(name), "no second stage of this object, expected one, "
                                 "see --stage of ffe-precompute(1)");
    return [store, facts] {
      StiffnessParts parts;
      parts.columns = store->columns(*facts);
      parts.factor = [store, facts] { return store->factor(*facts); };
      return parts;
    };
  };
  files.node_list = [resolve](const std::string& name) {
    return Input(resolve(name), false).read_all();
  };
  return files;
}

struct SceneRun::State {
  std::string name;
  SceneOptions options;
  Simulation simulation;
  SceneCounts counts;
  Digest digest;
  std::uint64_t line = 0, steps = 0;
  std::vector<std::string> stores; ///< by object; "" where it has none

  State(std::string n, const Context& context, SceneOptions o)
      : name(std::move(n)), options(std::move(o)),
        simulation(context, {.measure_error = options.measure, .warn = options.warn}) {}

  std::vector<std::uint32_t> nodes(std::size_t object, const Selector& selector) const {
    return select_nodes(simulation.model(object), selector, options.files.node_list);
  }

  void change(const Command& command, const Change& made) {
    if (command.every)
      simulation.schedule_every(*command.at, made);
    else if (command.at)
      simulation.schedule(*command.at, made);
    else
      simulation.apply(made);
  }

  void add(const ObjectCommand& c) {
    for (std::size_t i = 0; i < simulation.object_count(); ++i)
      if (simulation.name(i) == c.name)
        throw Error("there is an object '" + c.name + "' already, expected another name");
    Model model = options.files.model(c.model);
    StiffnessParts parts;
    if (!c.store.empty())
      parts = options.files.store(c.store, model);
    counts.nodes += model.nodes.size();
    simulation.add_object(c.name, std::move(model), c.method, std::move(parts),
                          c.implicit ? Integration::implicit : Integration::semi_implicit);
    stores.push_back(c.store);
    if (options.result != nullptr)
      deliver([&] {
        options.result->add_object(c.name, simulation.model(simulation.object_count() - 1));
      });
  }

  void execute(const Command& command) {
    if (const auto* const object = std::get_if<ObjectCommand>(&command.what)) {
      add(*object);
    } else if (const auto* const force = std::get_if<ForceCommand>(&command.what)) {
      SetForce set{simulation.find(force->object), {}, force->force, force->period};
      set.nodes = nodes(set.object, force->nodes);
      if (force->total)
        set.force = set.force / static_cast<double>(set.nodes.size());
      change(command, set);
    } else if (const auto* const displace = std::get_if<DisplaceCommand>(&command.what)) {
      SetDisplacement set{
          simulation.find(displace->object), {}, displace->displacement, displace->over};
      set.nodes = nodes(set.object, displace->nodes);
      change(command, set);
    } else if (const auto* const pressure = std::get_if<PressureCommand>(&command.what)) {
      SetPressure set{
          simulation.find(pressure->object), {}, {pressure->pressure, pressure->period}};
      set.nodes = nodes(set.object, pressure->nodes);
      change(command, set);
    } else if (const auto* const tie = std::get_if<AttachCommand>(&command.what)) {
      Attach set{simulation.find(tie->object), {}, simulation.find(tie->other), {}, tie->stiffness};
      set.nodes = nodes(set.object, tie->nodes);
      set.others = nodes(set.other, tie->others);
      change(command, set);
    } else if (const auto* const release = std::get_if<ReleaseCommand>(&command.what)) {
      Release set{simulation.find(release->object), {}};
      set.nodes = nodes(set.object, release->nodes);
      change(command, set);
    } else if (const auto* const gravity = std::get_if<GravityCommand>(&command.what)) {
      change(command, SetGravity{gravity->gravity});
    } else if (const auto* const timestep = std::get_if<TimestepCommand>(&command.what)) {
      change(command, SetTimestep{timestep->dt});
    } else if (const auto* const two_step = std::get_if<TwoStepCommand>(&command.what)) {
      SetTwoStep set{
          simulation.find(two_step->object), {two_step->threshold, two_step->series}, {}};
      if (stores.at(set.object).empty())
        throw Error("object " + two_step->object +
                    " has no store, expected one with a second stage");
      set.second = options.files.second_stage(stores[set.object], simulation.model(set.object));
      change(command, set);
    } else if (const auto* const emit = std::get_if<EmitCommand>(&command.what)) {
      change(command, Emit{emit->forces});
    } else if (const auto* const step = std::get_if<StepCommand>(&command.what)) {
      first_frame();
      simulation.step(step->dt.value_or(simulation.timestep().value_or(default_step)));
      answer();
    } else {
      run(std::get<RunCommand>(command.what));
    }
  }

  void run(const RunCommand& c) {
    first_frame();
    const double start = simulation.time(), span = c.until - start;
    const double exact = span / c.every;
    if (!(exact <= most_samples))
      throw Error("over 1e9 steps, expected fewer");
    // A hair more than a whole number of steps is rounding; a last one may be shorter.
    const auto count = static_cast<std::int64_t>(std::ceil(exact * (1 - 1e-12)));
    for (std::int64_t k = 1; k < count; ++k) {
      simulation.step_to(start + static_cast<double>(k) * c.every);
      answer();
    }
    if (!(span == 0)) {
      simulation.step_to(c.until); // which refuses a past one
      answer();
    }
  }

  /// The frame before anything moves.
  void first_frame() {
    if (simulation.object_count() == 0)
      throw Error("there is no object, expected an object command first");
    if (options.result == nullptr || counts.frames > 0)
      return;
    std::vector<std::vector<double>> rest;
    std::vector<FrameObject> frame;
    for (std::size_t i = 0; i < simulation.object_count(); ++i) {
      rest.emplace_back(3 * simulation.model(i).nodes.size());
      frame.push_back({rest.back(), {}});
    }
    deliver([&] { options.result->add_frame(0, frame); });
    ++counts.frames;
  }

  void answer() {
    ++steps;
    if (options.result != nullptr) {
      std::vector<FrameObject> frame;
      for (std::size_t i = 0; i < simulation.object_count(); ++i)
        frame.push_back({simulation.displacement(i), simulation.contact_forces(i)});
      deliver([&] { options.result->add_frame(simulation.time(), frame); });
      ++counts.frames;
    }
    if (options.measure)
      measure();
    if (options.reply)
      deliver([&] { options.reply(reply()); });
  }

  std::string reply() const {
    std::string text = "step " + std::to_string(steps) + " ";
    append(text, simulation.time());
    text += '\n';
    for (std::size_t i = 0; simulation.emits_forces() && i < simulation.object_count(); ++i) {
      const std::vector<NodeVector>& forces = simulation.contact_forces(i);
      text += "forces " + simulation.name(i) + " " + std::to_string(forces.size()) + "\n";
      for (const NodeVector& f : forces) {
        text += std::to_string(f.node) + " ";
        append(text, f.value, '\n');
      }
    }
    for (std::size_t i = 0; simulation.emits_shapes() && i < simulation.object_count(); ++i) {
      const std::vector<Node>& nodes = simulation.model(i).nodes;
      const std::span<const double> u = simulation.displacement(i);
      text += "shapes " + simulation.name(i) + " " + std::to_string(nodes.size()) + "\n";
      for (std::size_t k = 0; k < nodes.size(); ++k)
        append(text, nodes[k].position + Vec3{u[3 * k], u[3 * k + 1], u[3 * k + 2]}, '\n');
    }
    return text + "done\n";
  }

  void measure() {
    digest.add(simulation.time());
    for (std::size_t i = 0; i < simulation.object_count(); ++i) {
      const std::span<const double> u = simulation.displacement(i);
      digest.add(u);
      for (std::size_t k = 0; k < u.size(); k += 3)
        counts.largest_displacement =
            std::max(counts.largest_displacement, norm({u[k], u[k + 1], u[k + 2]}));
      for (const NodeVector& f : simulation.contact_forces(i)) {
        digest.add(std::uint64_t{f.node});
        digest.add_bytes(&f.value, sizeof f.value);
      }
    }
  }

  static constexpr double default_step = 1.0 / 60;
};

SceneRun::SceneRun(std::string name, const Context& context, SceneOptions options)
    : state_(std::make_unique<State>(std::move(name), context, std::move(options))) {}
SceneRun::~SceneRun() = default;

void SceneRun::line(std::string_view text) {
  State& s = *state_;
  ++s.line;
  try {
    at_line(s.name, s.line, [&] {
      const std::optional<Command> command = parse_scene_line(text);
      if (!command)
        return;
      ++s.counts.commands;
      s.execute(*command);
    });
  } catch (const Undelivered& failure) {
    std::rethrow_exception(failure.error);
  }
}

void SceneRun::finish() {
  State& s = *state_;
  try {
    at(s.name, [&] {
      if (s.counts.commands == 0)
        throw Error("no command, expected object, step or another, see scene(5)");
      s.first_frame();
    });
  } catch (const Undelivered& failure) {
    std::rethrow_exception(failure.error);
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

const Simulation& SceneRun::simulation() const {
  return state_->simulation;
}

SceneCounts SceneRun::counts() const {
  SceneCounts counts = state_->counts;
  counts.digest = state_->digest.hex();
  return counts;
}

void run_scene(Input& input, SceneRun& run) {
  // The stream's buffer hands out what has come so far and waits only for more.
  std::streambuf& bytes = *input.stream().rdbuf();
  std::string line;
  for (;;) {
    const auto c = bytes.sbumpc();
    const bool end = c == std::streambuf::traits_type::eof();
    if (!end && c != '\n') {
      if (line.size() == longest_line)
        throw Error(input.name(), "a line of over 1 MiB, expected shorter ones");
      line += static_cast<char>(c);
      continue;
    }
    if (!end || !line.empty())
      run.line(line);
    line.clear();
    if (end)
      break;
  }
  run.finish();
}

} // namespace gewebe
