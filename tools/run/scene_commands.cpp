// One command of a scene that runs.

#include "formats/scene/scene_changes.h"
#include "formats/stream/removal.h"
#include "tools/run/event_log.h"
#include "tools/run/scene_state_internal.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <variant>

namespace gewebe::cli {

namespace {

constexpr double max_samples = 1e9;

template <class Work>
auto of_object(const gewebe::cli::LinePlace& line, Work&& work) {
  try {
    return work();
  } catch (const gewebe::Cancelled&) {
    throw;
  } catch (const gewebe::Error& error) {
    throw gewebe::cli::WrongFile{line, gewebe::cli::with_place(error)};
  }
}

} // namespace

template <class Step>
void SceneRun::State::go_on(Step&& step) {
  formats::check_deferred_signal();
  require_object();
  const std::size_t objects = simulation.object_count(); // before parts come off
  if (result)
    result->need_models(simulation, objects); // a file that is wrong fails the step
  if (shared)
    SceneShapes::need_models(simulation, objects);
  step();
  if (result)
    result->first_frame(simulation, objects);
  answer();
}

namespace {} // namespace

void SceneRun::State::add(const formats::ObjectCommand& c) {
  if (options.files.check) {
    options.files.check(c.model);
    if (!c.store.empty())
      options.files.check(c.store);
  }
  scene::ObjectSource source;
  source.model = [this, file = c.model, at = line] {
    return of_object(at, [&] {
      model::Model model = options.files.model(file);
      ++counts.models;
      counts.nodes += model.nodes.size();
      return model;
    });
  };
  source.stiffness = [this, file = c.store, at = line](const model::Model& model) {
    if (file.empty())
      return std::shared_ptr<compliance::ComplianceSource>();
    compliance::StoredStiffness stored =
        of_object(at, [&] { return options.files.store(file, model); });
    ++counts.stores;
    stored.factor = [at, factor = std::move(stored.factor)] { return of_object(at, factor); };
    return compliance::compliance_of_store(std::move(stored));
  };
  simulation.add_object(c.name, std::move(source), c.method, c.integration, c.solid);
  if (c.warp)
    simulation.apply(scene::SetWarp{simulation.object_count() - 1});
  stores.resize(simulation.object_count()); // parts that came off have none
  stores.back() = c.store;
  models.push_back(c.model);
  if (options.events != nullptr)
    options.events->object(simulation.time(), c.name, c.model, c.method);
}

void SceneRun::State::add_stage(scene::SetTwoStep& set, const std::string& file) {
  if (!file.empty()) {
    set.model = std::make_shared<const model::Model>(options.files.model(file));
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

void SceneRun::State::write(const formats::EmitModelCommand& c) {
  const std::size_t object = scene::find_object(simulation, c.object);
  if (!options.files.write_model)
    throw Error("models can't be written here");
  if (std::find(models.begin(), models.end(), c.file) != models.end())
    throw Error(c.file + " is the model of an object of this scene, expected another file");
  options.files.write_model(c.file, simulation.weighed_model(object));
  if (options.events != nullptr)
    options.events->model(simulation.time(), c.object, c.file);
}

void SceneRun::State::tell_stress(const formats::EmitStressCommand& c) {
  const std::vector<std::uint32_t>& nodes = stress.ask(simulation, c, [&](const std::string& list) {
    return lists[list] = options.files.node_list(list);
  });
  simulation.want_shapes();
  if (options.events != nullptr)
    options.events->stress(simulation.time(), c.object, nodes);
}

void SceneRun::State::schedule(const formats::Command& command,
                               const formats::ChangeCommand& what) {
  scene::Change change = formats::scene_change(what, simulation, [&](const std::string& list) {
    return lists[list] = options.files.node_list(list);
  });
  if (auto* const two_step = std::get_if<scene::SetTwoStep>(&change)) {
    if (stress.asked(two_step->object))
      throw Error("object " + what.object +
                  " emits its stress, which two stiffnesses do not define, expected no two-step");
    add_stage(*two_step, what.stage);
  }
  if (auto* const set = std::get_if<scene::SetInstrument>(&change);
      set != nullptr && !what.mesh.empty())
    set->shape = options.files.instrument(what.mesh, set->shape);
  if (command.every)
    simulation.schedule(simulation.time(), change, *command.at);
  else if (command.at)
    simulation.schedule(*command.at, change);
  else
    simulation.apply(change);
}

void SceneRun::State::step(const formats::StepCommand& c) {
  go_on([&] {
    simulation.step(c.dt.value_or(simulation.settings().timestep.value_or(formats::default_step)));
  });
}

void SceneRun::State::run(const formats::RunCommand& c) {
  require_object();
  const double start = simulation.time(), span = c.until - start;
  const double exact = span / c.every;
  if (!(exact <= max_samples))
    throw Error("over 1e9 steps, expected fewer");
  const auto sample = [&](double time) {
    if (options.gone && options.gone())
      throw Error("the client of these steps has disconnected");
    go_on([&] {
      simulation.step_to(time);
      under_way = formats::RunCommand{time, c.every};
    });
  };
  // A hair more than a whole number of steps is rounding; a last one may be shorter.
  const auto count = static_cast<std::int64_t>(std::ceil(exact * (1 - 1e-12)));
  for (std::int64_t k = 1; k < count; ++k)
    sample(start + static_cast<double>(k) * c.every);
  if (!(span == 0))
    sample(c.until); // which refuses a past one
}

void SceneRun::State::execute(const formats::Command& command) {
  if (const auto* const change = std::get_if<formats::ChangeCommand>(&command.what))
    schedule(command, *change);
  else if (const auto* const object = std::get_if<formats::ObjectCommand>(&command.what))
    add(*object);
  else if (const auto* const emit = std::get_if<formats::EmitModelCommand>(&command.what))
    write(*emit);
  else if (const auto* const tensors = std::get_if<formats::EmitStressCommand>(&command.what))
    tell_stress(*tensors);
  else if (const auto* const one = std::get_if<formats::StepCommand>(&command.what))
    step(*one);
  else if (const auto* const many = std::get_if<formats::RunCommand>(&command.what))
    run(*many);
  else if (const auto* const query = std::get_if<formats::QueryCommand>(&command.what))
    tell(*query);
  else if (std::holds_alternative<formats::EndCommand>(command.what))
    ended = true;
  else
    sync();
}

} // namespace gewebe::cli
