#include "tools/model/model_arguments.h"

#include "formats/mesh/mesh_file.h"
#include "model/check.h"
#include "model/material_table.h"

#include <charconv>
#include <system_error>
#include <vector>

namespace gewebe::cli {

namespace {

/// What the library finds wrong with an option's text is wrong use.
template <class Work>
auto parsed(const char* option, Work&& parse) {
  try {
    return parse();
  } catch (const gewebe::Error& error) {
    throw gewebe::UsageError(std::string(option) + ": " + error.what());
  }
}

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const model::Material& material : model::material_presets())
    names.push_back(material.name);
  return names;
}

/// The text of a table that parses.
std::string checked_table(const std::string& file) {
  formats::Input input(file, false);
  std::string text = input.read_all();
  (void)model::parse_material_table(text, input.name());
  return text;
}

/// "5%" as 0.05.
double share_from_percent(const std::string& text) {
  const std::string expected = ", expected 0.1% to 50%, such as 5%";
  double percent = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, percent);
  if (error != std::errc() || end + 1 != last || *end != '%' || !(percent >= 0.1 && percent <= 50))
    throw Error("'" + text + "'" + expected);
  return percent / 100;
}

void complete_accuracy(ModelArguments& a) {
  AccuracyGoal& goal = a.accuracy;
  refuse(goal.text.empty() != goal.scene.empty(),
         "--accuracy and --for need each other, expected both");
  refuse(goal.text.empty() && goal.max_tetrahedra, "--max-tets without --accuracy, expected both");
  if (goal.text.empty())
    return;
  refuse(!a.solid, "--accuracy without --solid, expected both");
  refuse(!a.fit.empty(), "--accuracy and --fit, expected one of them");
  goal.error = parsed("--accuracy", [&] { return share_from_percent(goal.text); });
}

} // namespace

void declare(cli::Program& p, ModelArguments& a) {
  model::BuildOptions& b = a.build;
  p.option("--fix", a.fix, "SELECTOR", "nodes that cannot move, or none");
  p.option("--fix-axes", a.axes, "AXES", "axes along which --fix holds nodes")
      .one_of({"x", "y", "z", "xy", "xz", "yz", "xyz"});
  p.option("--centrals", b.centrals, "K", "central nodes per component").range(0, 1000);
  p.option("--central-stiffness", b.central_factor, "F",
           "stiffness of c springs over that of e springs")
      .range(0, 1e9);
  p.flag("--centrals-free", b.centrals_free, "central nodes can move");
  p.flag("--bend", b.bend, "add bending springs across edges");
  p.option("--bend-stiffness", b.bend_factor, "F", "stiffness of b springs over that of the edge")
      .range(0, 1e9);
  p.option("--material", a.material, "NAME",
           "material, or PART=NAME for a part; see --list-materials")
      .such_as(preset_names());
  p.option("--materials", a.materials, "FILE", "table of materials that adds to the presets");
  p.flag("--list-materials", a.list_materials, "write the table of materials instead of a model");
  p.option("--density", a.values.density, "D", "density in g/mm3, instead of the material's")
      .positive();
  p.option("--young", a.values.young, "E", "Young's modulus in Pa, instead of the material's")
      .positive();
  p.flag("--solid", a.solid, "fill a closed surface with tetrahedra");
  p.option("--cell", a.cell, "S", "with --solid: edge of the cells in mm").positive();
  p.option("--refine", a.refine, "SELECTOR:SIZE[;...]",
           "with --solid: cells of at most SIZE mm there, such as sphere:0,0,50,8:2");
  p.option("--accuracy", a.accuracy.text, "PERCENT",
           "with --solid --for: smaller cells until the estimated error is below, such as 5%");
  p.option("--for", a.accuracy.scene, "SCENE", "with --accuracy: scene that is solved");
  p.option("--max-tets", a.accuracy.max_tetrahedra, "N",
           "with --accuracy: most tetrahedra (default 50000)")
      .range(1, 1e9);
  p.option("--rule", a.rule, "RULE", "with --solid: when a point is inside: parity, winding")
      .one_of({"parity", "winding"});
  p.option("--on-open", a.on_open, "WHAT",
           "with --solid, an open surface: error, warn (odd rays stay empty), fill (close the "
           "holes)")
      .one_of({"error", "warn", "fill"});
  p.flag("--no-skin", a.no_skin, "with --solid: leave out the skin");
  p.option("--poisson", a.values.poisson, "NU",
           "Poisson's ratio of tetrahedra, instead of the material's")
      .range(0, 0.4999999);
  p.option("--law", a.law, "LAW",
           "law of large strains of tetrahedra, instead of the material's, such as yeoh:c20=0.1")
      .such_as({"neo-hookean", "classical-neo-hookean", "mooney-rivlin:", "yeoh:", "ogden:"});
  p.option("--prony", a.prony, "TERMS",
           "viscoelastic tetrahedra: G@TAU,G@TAU,... shares of the stress and their times in s, or "
           "none, instead of the material's");
  p.option("--order", a.order, "N", "elements: 1 linear, 2 quadratic").range(1, 2);
  p.option("--thickness", a.values.thickness, "H",
           "thickness of a net in mm, instead of the material's")
      .positive();
  p.option("--damping-ratio", a.values.damping_ratio, "Z",
           "damping ratio of springs, instead of the material's")
      .range(0, 1e6);
  p.option("--stiffness", b.stiffness, "K", "stiffness of every e spring in g/s2").positive();
  p.option("--mass", b.mass, "M", "mass of every surface node in g").positive();
  p.option("--drag", b.drag_rate, "RATE", "drag of a node per mass in 1/s").range(0, 1e9);
  p.flag("--normals", b.normals, "add vertex normals");
  p.option("--dt", a.dt, "T", "refuse a net for which an explicit step of T s is not safe")
      .positive();
  p.flag("--scale-mass", a.scale_mass, "with --dt: raise masses until the step is safe");
  p.option("--fit", a.fit, "FILE", "find Young's moduli of a solid from measurements");
  p.option("--primitive", a.primitive, "KIND",
           "plane:MxN, tube:MxN or sphere:MxN instead of a mesh")
      .such_as({"plane:", "tube:", "sphere:"});
  p.option("--size", a.size, "A,B", "size of the primitive in mm");
  p.option("--name", a.name, "NAME", "name of the model; default: that of its first material");
  p.option("--unit", a.unit, "UNIT", "unit of the mesh: m, cm, mm")
      .one_of(formats::mesh_unit_names());
  p.option("--weld", a.weld, "MODE", "points at one place to merge: auto, all, part, none")
      .one_of(formats::weld_names());
  p.option("--repair", a.repair, "LIST",
           "repairs: weld[:MM], duplicates, orientation, degenerate, holes[:EDGES], all")
      .such_as({"weld", "duplicates", "orientation", "degenerate", "holes", "all"});
}

void complete(ModelArguments& a) {
  refuse(a.build.stiffness && a.values.young, "--stiffness and --young, expected one of them");
  refuse(a.build.mass && a.values.density, "--mass and --density, expected one of them");
  refuse(!a.build.bend && a.build.bend_factor != model::BuildOptions{}.bend_factor,
         "--bend-stiffness without --bend, expected both");
  refuse(a.fix == "none" && a.axes != ModelArguments{}.axes,
         "--fix-axes without --fix, expected both");
  refuse(a.cell && !a.solid, "--cell without --solid, expected both");
  refuse(!a.refine.empty() && !a.solid, "--refine without --solid, expected both");
  if (!a.refine.empty())
    a.refined = parsed("--refine", [&] { return tetrahedra::parse_refinement(a.refine); });
  for (const tetrahedra::RefinedRegion& region : a.refined)
    refuse(!region.materials.empty(),
           "--refine: label is for mc-opt --tets, expected sphere, box or surface");
  complete_accuracy(a);
  refuse(!a.solid && a.rule != ModelArguments{}.rule, "--rule without --solid, expected both");
  refuse(!a.solid && a.on_open != ModelArguments{}.on_open,
         "--on-open without --solid, expected both");
  refuse(a.no_skin && !a.solid, "--no-skin without --solid, expected both");
  refuse(a.scale_mass && !a.dt, "--scale-mass without --dt, expected both");
  refuse(a.primitive.empty() && !a.size.empty(), "--size without --primitive, expected both");
  a.repairs = parsed("--repair", [&] { return repair::parse_repair(a.repair); });
  if (!a.primitive.empty()) {
    refuse(a.mesh != "-" || !a.unit.empty() || a.weld != "auto" || !a.repair.empty(),
           "--primitive makes the mesh, expected no other and no option that reads one");
    a.matrix = parsed("--primitive", [&] { return model::parse_primitive(a.primitive, a.size); });
  }
  parsed("--name", [&] { model::check_name(a.name); });
  if (!a.law.empty())
    a.values.law = parsed("--law", [&] { return model::parse_law(a.law); });
  if (a.prony == "none")
    a.values.prony.emplace();
  else if (!a.prony.empty())
    a.values.prony = parsed("--prony", [&] { return model::parse_prony("prony:" + a.prony); });
  refuse(a.list_materials && (a.mesh != "-" || a.matrix || a.fix != "none" || !a.fit.empty()),
         "--list-materials makes no model, expected no mesh and no nodes");
  if (a.materials.empty())
    choose_materials(a); // what is wrong is known before anything is read
  std::vector<std::string> inputs;
  if (!a.materials.empty())
    inputs.push_back(a.materials);
  if (!a.fit.empty())
    inputs.push_back(a.fit);
  if (!a.accuracy.scene.empty())
    inputs.push_back(a.accuracy.scene);
  if (!a.matrix && !a.list_materials)
    inputs.push_back(a.mesh);
  if (a.fix != "none") {
    a.fixed = parsed("--fix", [&] { return model::parse_selector(a.fix); });
    for (const std::string& name : model::node_list_names(*a.fixed))
      inputs.push_back(name);
    refuse(!a.accuracy.text.empty() && has_node_numbers(*a.fixed),
           "--fix: nodes have other numbers in each mesh of --accuracy, expected places");
  }
  cli::check_one_pipe(inputs);
}

void choose_materials(ModelArguments& a) {
  std::string table(model::preset_table());
  if (!a.materials.empty())
    table = model::merged_tables(table, checked_table(a.materials));
  const std::vector<model::Material> known = model::parse_material_table(table, a.materials);
  a.build.material =
      parsed("--material", [&] { return model::parse_material_choice(a.material, known); });
  model::override_materials(a.build.material.materials, a.values);
}

void list_materials(cli::Run& run, const ModelArguments& a) {
  formats::Output output(run.output(), run.output_options(false));
  output.write(a.materials.empty()
                   ? std::string(model::preset_table())
                   : model::merged_tables(model::preset_table(), checked_table(a.materials)));
  output.commit();
}

} // namespace gewebe::cli
