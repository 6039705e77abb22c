#include "tools/results/scene_result.h"

#include "tools/results/undelivered.h"

#include <algorithm>
#include <set>
#include <span>
#include <vector>

namespace gewebe::cli {

namespace {

/// Of vectors, each three numbers.
double largest_norm(std::span<const double> u) {
  double largest = 0;
  for (std::size_t k = 0; k + 2 < u.size(); k += 3)
    if (const double size = norm({u[k], u[k + 1], u[k + 2]}); !(size <= largest))
      largest = size;
  return largest;
}

} // namespace

void SceneResult::need_models(const scene::Simulation& simulation, std::size_t objects) const {
  for (std::size_t i = 0; writer_.wants_models() && i < objects; ++i)
    (void)simulation.first_model(i);
}

void SceneResult::add_objects(const scene::Simulation& simulation, std::size_t objects) {
  static const model::Model none;
  for (; objects_ < objects; ++objects_) {
    const model::Model& model = writer_.wants_models() ? simulation.first_model(objects_) : none;
    const std::vector<scene::Cutting>& cuttings = simulation.news().cuttings;
    const bool part = std::any_of(cuttings.begin(), cuttings.end(), [&](const scene::Cutting& c) {
      return c.kind == scene::Cutting::Kind::part && c.part == objects_;
    });
    deliver([&] {
      if (part)
        writer_.add_part(simulation.object(objects_).name, model);
      else
        writer_.add_object(simulation.object(objects_).name, model);
    });
  }
}

/// Those that were cut since the last frame.
void SceneResult::change_objects(const scene::Simulation& simulation) {
  if (!writer_.wants_models())
    return;
  std::set<std::size_t> changed;
  for (const scene::Cutting& c : simulation.news().cuttings)
    if (c.kind == scene::Cutting::Kind::cut || c.kind == scene::Cutting::Kind::restored)
      changed.insert(c.object);
  for (const std::size_t object : changed)
    deliver([&] {
      writer_.change_object(object, simulation.model(object),
                            simulation.object(object).first_nodes);
    });
}

void SceneResult::first_frame(const scene::Simulation& simulation, std::size_t objects) {
  add_objects(simulation, objects);
  if (frames_ > 0)
    return;
  std::vector<std::vector<double>> rest;
  std::vector<formats::FrameObject> frame;
  for (std::size_t i = 0; i < objects; ++i)
    rest.emplace_back(simulation.object(i).known ? 3 * simulation.first_model(i).nodes.size() : 0);
  for (std::size_t i = 0; i < objects; ++i)
    frame.push_back({rest[i], {}, stress_.fields(i)});
  deliver([&] { writer_.add_frame(0, frame); });
  ++frames_;
}

void SceneResult::set_instruments(const scene::Simulation& simulation) {
  std::vector<scene::InstrumentReport> reports;
  for (std::size_t k = 0; k < simulation.instrument_count(); ++k)
    reports.push_back(simulation.instrument(k));
  std::vector<formats::FrameInstrument> instruments;
  for (const scene::InstrumentReport& r : reports)
    instruments.push_back({r.name, r.present, r.shape, r.pose, r.hand.value_or(r.pose.place),
                           r.force, r.torque, r.nodes});
  deliver([&] { writer_.set_instruments(instruments); });
}

void SceneResult::set_attachments(const scene::Simulation& simulation) {
  std::vector<formats::FrameAttachment> attachments;
  for (const scene::AttachmentReport& a : simulation.attachments())
    attachments.push_back(
        {simulation.object(a.object).name, simulation.object(a.other).name, a.springs, a.force});
  deliver([&] { writer_.set_attachments(attachments); });
}

void SceneResult::frame(const scene::Simulation& simulation,
                        std::span<const formats::EstimateAnswer> estimates) {
  add_objects(simulation, simulation.object_count());
  change_objects(simulation);
  set_instruments(simulation);
  const bool curves = writer_.wants_curves();
  if (curves)
    set_attachments(simulation);
  std::vector<formats::FrameObject> frame;
  for (std::size_t i = 0; i < simulation.object_count(); ++i) {
    formats::FrameObject& object = frame.emplace_back();
    if (writer_.wants_models())
      object.displacement = simulation.displacement(i);
    object.forces = simulation.contact_forces(i);
    object.fields = stress_.fields(i);
    if (i < estimates.size())
      object.estimate = &estimates[i].error;
    if (curves && simulation.settings().emits.any_shapes())
      object.largest_displacement = largest_norm(simulation.surface_displacement(i));
  }
  deliver([&] { writer_.add_frame(simulation.time(), frame); });
  ++frames_;
}

} // namespace gewebe::cli
