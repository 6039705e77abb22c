#include "tools/model/model_fit.h"

#include "base/error.h"
#include "dynamics/solid_law.h"
#include "fem/solid_model.h"
#include "fit/swing_fit.h"
#include "fit/young_fit.h"
#include "formats/scene/measurements.h"
#include "formats/stream/stream.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gewebe::cli {

namespace {

/// Four digits, for people.
std::string figure(double value) {
  if (!(value > 0 && std::isfinite(value)))
    return text::number_text(value);
  const double unit = std::pow(10, std::floor(std::log10(value)) - 3);
  return text::number_text(unit < 1 ? std::round(value / unit) / std::round(1 / unit)
                                    : std::round(value / unit) * unit);
}

fit::SolidVector load_of(const model::Model& model, const tetrahedra::TetMesh& mesh,
                         const std::vector<fem::SolidMaterial>& materials,
                         const std::vector<fem::SolidElement>& elements,
                         const formats::LoadCase& c) {
  fit::SolidVector load = fit::hyperelastic_weight(mesh, materials, elements, c.gravity);
  const auto lists = [](const std::string& name) { return formats::Input(name, false).read_all(); };
  for (const formats::MeasuredForce& f : c.forces) {
    const auto nodes = model::select_nodes(model, f.nodes, lists, model::SelectorScope::body);
    const Vec3 each = f.total ? f.force / static_cast<double>(nodes.size()) : f.force;
    for (const auto node : nodes)
      for (int axis = 0; axis < 3; ++axis)
        load.axes[3 * std::size_t{node} + static_cast<std::size_t>(axis)] += each[axis];
  }
  return load;
}

/// Axes that are held, and those of nodes that no tetrahedron has.
std::vector<std::uint8_t> held_axes(const model::Model& model) {
  std::vector<std::uint8_t> fixed(3 * model.nodes.size(), 1);
  const auto set = [&](std::uint32_t node) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      fixed[3 * std::size_t{node} + axis] = (model.nodes[node].fixed >> axis) & 1;
  };
  for (const Tetrahedron& t : model.tetrahedra)
    std::ranges::for_each(t, set);
  for (const EdgeMiddles& m : model.middles)
    std::ranges::for_each(m, set);
  return fixed;
}

std::vector<std::size_t> wanted_of(const model::Model& model,
                                   const formats::Measurements& measured) {
  std::vector<std::uint8_t> sought(model.materials.size());
  for (const std::int32_t m : model.tetrahedron_material)
    sought[static_cast<std::size_t>(m)] = 1;
  for (const std::string& name : measured.known) {
    const auto found = std::ranges::find(model.materials, name, &model::Material::name);
    if (found == model.materials.end())
      throw Error("known '" + name + "' is no material of the model");
    sought[static_cast<std::size_t>(found - model.materials.begin())] = 0;
  }
  std::vector<std::size_t> wanted;
  for (std::size_t m = 0; m < sought.size(); ++m)
    if (sought[m] != 0)
      wanted.push_back(m);
  return wanted;
}

void fit_moduli(Run& run, model::Model& model, const formats::Measurements& measured,
                Stats& stats) {
  const tetrahedra::TetMesh mesh = fem::element_mesh(model);
  const std::vector<fem::SolidMaterial> materials = fem::element_materials(model);
  const std::vector<fem::SolidElement> elements =
      fem::solid_elements(mesh, materials, run.context());
  const std::vector<std::size_t> wanted = wanted_of(model, measured);
  std::vector<std::string> names;
  for (const model::Material& m : model.materials)
    names.push_back(m.name);
  std::vector<fit::MeasuredCase> cases;
  for (const formats::LoadCase& c : measured.cases)
    cases.push_back({load_of(model, mesh, materials, elements, c), c.measurements});
  const fit::YoungFit fit =
      fit::fit_young(mesh, materials, names, wanted, held_axes(model), cases, {}, run.context());
  for (const fit::FittedYoung& young : fit.materials) {
    const std::string& name = names[young.material];
    std::string text = name + ": Young's modulus " + figure(young.young) + " Pa";
    Stats& own = stats.object("young").object(name);
    own.set("value", young.young);
    if (young.interval) {
      own.set("interval", std::vector<double>{(*young.interval)[0], (*young.interval)[1]});
      text += ", by 95 % between " + figure((*young.interval)[0]) + " and " +
              figure((*young.interval)[1]);
    }
    run.say(text);
    model.materials[young.material].young = young.young;
  }
  stats.set("solves", fit.solves);
  stats.set("measured_axes", std::uint64_t{fit.axes});
  stats.set("measured", fit.measured);
  stats.set("residual", fit.residual);
  run.say(std::to_string(fit.solves) + " solves; " + std::to_string(fit.axes) + " measured axes, " +
          figure(fit.measured) + " mm on average, are met within " + figure(fit.residual) + " mm");
  for (const std::string& name : fit.outliers)
    run.warn(name + ": is off by more than chance, expected a measurement like the others");
}

void fit_damping(Run& run, const formats::Measurements& measured, Stats& stats) {
  const fit::SwingFit swing = fit::fit_swing(measured.times, measured.values);
  const std::string damping = figure(swing.ratio) + "@" + figure(swing.frequency);
  Stats& own = stats.object("swing");
  own.set("frequency", swing.frequency);
  own.set("frequency_interval",
          std::vector<double>{swing.frequency_interval[0], swing.frequency_interval[1]});
  own.set("damping_ratio", swing.ratio);
  own.set("damping_ratio_interval",
          std::vector<double>{swing.ratio_interval[0], swing.ratio_interval[1]});
  own.set("explained", swing.explained);
  own.set("damping", damping);
  run.say("swing of " + figure(swing.frequency) + " Hz, damping ratio " + figure(swing.ratio) +
          ": damping=" + damping + " in scenes");
}

} // namespace

void fit_model(Run& run, model::Model& model, const std::string& file) {
  if (model.tetrahedra.empty() || !model.springs.empty())
    throw Error("--fit: the model has springs, expected one of tetrahedra alone");
  if (dynamics::is_viscoelastic(model))
    throw Error("--fit: the model is viscoelastic, and measurements have no time, expected --prony "
                "none");
  formats::Input input(file, false);
  const formats::Measurements measured =
      formats::parse_measurements(input.read_all(), input.name());
  at(input.name(), [&] {
    Stats& stats = run.stats().object("fit");
    run.timed("fit", [&] {
      if (!measured.cases.empty())
        fit_moduli(run, model, measured, stats);
      if (!measured.times.empty())
        fit_damping(run, measured, stats);
    });
  });
}

} // namespace gewebe::cli
