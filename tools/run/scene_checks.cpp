#include "tools/run/scene_checks.h"

#include "text/number_text.h"
#include "text/rounded_text.h"

#include <algorithm>
#include <cmath>

namespace gewebe::cli {

namespace {

constexpr double max_volume = 0.1, max_strain = 0.5, max_jump = 0.1;
constexpr double farther = 1.1; // than when it was last looked at
constexpr int at_least_every = 64;

double largest(std::span<const double> values) {
  double max = 0;
  for (const double value : values)
    max = std::max(max, std::abs(value));
  return max;
}

std::string percent(double share) {
  return text::number_text(std::round(std::abs(share) * 100)) + " %";
}

} // namespace

void SceneChecks::look(const scene::Simulation& simulation, bool shapes, const Tell& warn,
                       const Tell& distrust) {
  for (const scene::MethodJump& jump : simulation.news().jumps) {
    Object& object = objects_[jump.object];
    const double max = largest(simulation.displacement(jump.object));
    if (object.jump || !(jump.size > max_jump * max) || !warn)
      continue;
    object.jump = true;
    warn("object " + simulation.object(jump.object).name + " at " +
         text::number_text(simulation.time()) + " s: its shape jumped by " +
         text::rounded_text(jump.size) + " mm as its method changed, and its forces with it");
  }
  for (const std::size_t number : simulation.news().unfinished) {
    Object& object = objects_[number];
    if (object.unfinished || !warn)
      continue;
    object.unfinished = true;
    warn("object " + simulation.object(number).name + " at " +
         text::number_text(simulation.time()) +
         " s: the rounds of a step ran out before its tolerance, its motion may be off by more");
  }
  for (std::size_t n = 0; n < simulation.object_count(); ++n)
    if (simulation.object(n).known)
      look_at(simulation, n, shapes, distrust);
}

void SceneChecks::look_at(const scene::Simulation& simulation, std::size_t number, bool shapes,
                          const Tell& distrust) {
  Object& object = objects_[number];
  const bool wanted = simulation.object(number).method == scene::Method::ela || shapes;
  if (!wanted || (object.turned && object.volume && object.strain))
    return;
  const model::Model& model = simulation.model(number);
  if (object.model != &model || object.nodes != model.nodes.size() ||
      object.triangles != model.triangles.size()) {
    object.model = &model;
    object.nodes = model.nodes.size();
    object.triangles = model.triangles.size();
    object.check = std::make_unique<statics::ShapeCheck>(model);
    object.looked_at = 0;
  }
  look_at_shape(simulation, number, distrust);
}

void SceneChecks::look_at_shape(const scene::Simulation& simulation, std::size_t number,
                                const Tell& distrust) {
  Object& object = objects_[number];
  const model::Model& model = simulation.model(number);
  const bool surface = !model.tetrahedra.empty() && model.springs.empty();
  const std::span<const double> u =
      surface ? simulation.surface_displacement(number) : simulation.displacement(number);
  if (surface ? u.empty() : u.size() != 3 * object.nodes)
    return;
  const double max = largest(u);
  // Less turns no triangle over, and what moves no farther than before does so seldom.
  if (!(4 * max > object.check->shortest_edge() / 10) ||
      (max <= farther * object.looked_at && ++object.not_looked < at_least_every))
    return;
  object.looked_at = max;
  object.not_looked = 0;
  const statics::ShapeFaults faults = object.check->look(model, u);
  const std::string who = "object " + simulation.object(number).name + " at " +
                          text::number_text(simulation.time()) + " s: ";
  if (faults.turned > 0 && !object.turned && distrust) {
    object.turned = true;
    distrust(who + std::to_string(faults.turned) +
             (faults.turned == 1 ? " triangle is" : " triangles are") + " turned over, the first " +
             std::to_string(faults.triangle) + ", the shape is not to be trusted there");
  }
  if (!(std::abs(faults.volume) <= max_volume) && !object.volume && distrust) {
    object.volume = true;
    distrust(who + "its volume has " + (faults.volume > 0 ? "grown" : "shrunk") + " by " +
             percent(faults.volume) + ", which tissue does not do");
  }
  if (!(faults.strain <= max_strain) && !object.strain && distrust &&
      simulation.object(number).method == scene::Method::ela) {
    object.strain = true;
    distrust(who + "the edge " + std::to_string(faults.i) + "-" + std::to_string(faults.j) +
             " is strained by " + percent(faults.strain) +
             ", beyond the linear range of tissue, its forces are not to be trusted");
  }
}

} // namespace gewebe::cli
