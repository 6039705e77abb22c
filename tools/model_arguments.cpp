#include "tools/model_arguments.h"

#include "formats/mesh_file.h"
#include "model/check.h"

#include <vector>

namespace gewebe {

namespace {

/// What the library finds wrong with an option's text is wrong use.
template <class Work>
auto parsed(const char* option, Work&& parse) {
  try {
    return parse();
  } catch (const Error& error) {
    throw UsageError(std::string(option) + ": " + error.what());
  }
}

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

} // namespace

void declare(cli::Program& p, ModelArguments& a) {
  BuildOptions& b = a.build;
  p.option("--fix", a.fix, "SELECTOR", "nodes that can't move, or none");
  p.option("--fix-axes", a.axes, "AXES", "axes along which they can't move")
      .one_of({"x", "y", "z", "xy", "xz", "yz", "xyz"});
  p.option("--centrals", b.centrals, "K", "central nodes per component").range(0, 1000);
  p.option("--central-stiffness", b.central_factor, "F",
           "their springs' stiffness over edge springs'")
      .range(0, 1e9);
  p.flag("--centrals-free", b.centrals_free, "central nodes can move");
  p.flag("--bend", b.bend, "add bending springs across edges");
  p.option("--bend-stiffness", b.bend_factor, "F", "their stiffness over that of the edge")
      .range(0, 1e9);
  p.option("--material", a.material, "NAME",
           "generic, liver, gallbladder, uterus; PART=NAME for a part");
  p.option("--density", a.values.density, "D", "g/mm3, instead of the material's").positive();
  p.option("--young", a.values.young, "E", "Young's modulus in Pa, instead of the material's")
      .positive();
  p.option("--thickness", a.values.thickness, "H", "of the wall in mm, instead of the material's")
      .positive();
  p.option("--damping-ratio", a.values.damping_ratio, "Z", "of a spring, instead of the material's")
      .range(0, 1e6);
  p.option("--stiffness", b.stiffness, "K", "of every edge spring in g/s2").positive();
  p.option("--mass", b.mass, "M", "of every surface node in g").positive();
  p.option("--drag", b.drag_rate, "RATE", "drag of a node per mass in 1/s").range(0, 1e9);
  p.flag("--normals", b.normals, "add vertex normals");
  p.option("--dt", a.dt, "T", "refuse a model for which a step of T s is not safe").positive();
  p.flag("--scale-mass", a.scale_mass, "raise masses until --dt is safe instead");
  p.option("--primitive", a.primitive, "KIND",
           "plane:MxN, tube:MxN or sphere:MxN instead of a mesh");
  p.option("--size", a.size, "A,B", "its sides, radius and length or radius in mm");
  p.option("--name", a.name, "NAME", "name of the model, else that of its first material");
  p.option("--unit", a.unit, "UNIT", "unit of the mesh: m, cm, mm").one_of(mesh_unit_names());
  p.option("--weld", a.weld, "MODE", "points that become one: auto, all, part, none")
      .one_of(weld_names());
  p.option("--repair", a.repair, "LIST",
           "weld[:MM], duplicates, orientation, degenerate, holes[:EDGES], all");
}

void complete(ModelArguments& a) {
  refuse(a.build.stiffness && a.values.young, "--stiffness and --young, expected one of them");
  refuse(a.build.mass && a.values.density, "--mass and --density, expected one of them");
  refuse(!a.build.bend && a.build.bend_factor != BuildOptions{}.bend_factor,
         "--bend-stiffness without --bend, expected both");
  refuse(a.fix == "none" && a.axes != ModelArguments{}.axes,
         "--fix-axes without --fix, expected both");
  refuse(a.scale_mass && !a.dt, "--scale-mass without --dt, expected both");
  refuse(a.primitive.empty() && !a.size.empty(), "--size without --primitive, expected both");
  a.repairs = parsed("--repair", [&] { return parse_repair(a.repair); });
  if (!a.primitive.empty()) {
    refuse(a.mesh != "-" || !a.unit.empty() || a.weld != "auto" || !a.repair.empty(),
           "--primitive makes the mesh, expected no other and no option that reads one");
    a.matrix = parsed("--primitive", [&] { return parse_primitive(a.primitive, a.size); });
  }
  parsed("--name", [&] { check_name(a.name); });
  a.build.material = parsed("--material", [&] { return parse_material_choice(a.material); });
  override_materials(a.build.material.materials, a.values);
  if (a.fix == "none")
    return;
  a.fixed = parsed("--fix", [&] { return parse_selector(a.fix); });
  std::vector<std::string> inputs = node_list_names(*a.fixed);
  if (!a.matrix)
    inputs.push_back(a.mesh);
  cli::check_one_pipe(inputs);
}

} // namespace gewebe
