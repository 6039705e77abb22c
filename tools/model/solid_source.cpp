#include "tools/model/solid_source.h"

#include "embedding/skin.h"
#include "fem/solid_model.h"
#include "formats/mesh/mesh_file.h"
#include "formats/tetrahedra/tet_file.h"
#include "formats/volume/volume_plugin.h"
#include "tetrahedra/check.h"
#include "tetrahedra/components.h"
#include "text/number_text.h"
#include "text/rounded_text.h"
#include "tools/cli/filling_rule.h"
#include "tools/cli/transform_option.h"
#include "tools/model/solid_cell.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::cli {

namespace {

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

/// Options of springs say nothing of tetrahedra.
void refuse_others(const ModelArguments& a) {
  model::BuildOptions plain;
  plain.material = a.build.material;
  plain.drag_rate = a.build.drag_rate;
  plain.normals = a.build.normals;
  refuse(a.build != plain || a.values.thickness || a.values.damping_ratio || a.dt,
         "a model of tetrahedra, expected no option of springs and no --dt");
}

/// Options of surfaces neither.
void refuse_surfaces(const ModelArguments& a) {
  refuse(a.weld != "auto", "the input holds tetrahedra, expected no --weld");
  refuse((a.repairs.weld || a.repairs.holes) && a.repair != "all",
         "the input holds tetrahedra, expected --repair orientation, duplicates or degenerate");
}

/// Turns and drops tetrahedra by the options, and reports that.
void repair(Run& run, const std::string& name, tetrahedra::TetMesh& mesh,
            const repair::RepairOptions& asked) {
  const tetrahedra::TetRepair done = tetrahedra::repair_tetrahedra(
      mesh, {.turn = asked.orientation, .flat = asked.degenerate, .duplicates = asked.duplicates});
  const auto tell = [&](const char* key, std::uint64_t count, const char* text) {
    run.stats().set(key, count);
    if (count > 0)
      run.say(name + ": " + std::to_string(count) + " " + text);
  };
  tell("repaired_turned", done.turned, "inverted tetrahedra were turned");
  tell("repaired_flat", done.dropped_flat, "flat tetrahedra were left out");
  tell("repaired_duplicates", done.dropped_duplicates, "tetrahedra that stood twice were left out");
}

model::Model model_of(Run& run, tetrahedra::TetMesh mesh, const ModelArguments& a) {
  return run.timed("build", [&] {
    return fem::solid_model(std::move(mesh),
                            {.material = a.build.material,
                             .quadratic = a.order == 2,
                             .drag_rate = a.build.drag_rate,
                             .normals = a.build.normals},
                            run.context());
  });
}

/// The surface goes along with what fills it.
void skin(Run& run, const std::string& name, const TriangleMesh& mesh, double cell,
          const model::MaterialChoice& choice, model::Model& model) {
  std::vector<std::int32_t> materials;
  for (const std::int32_t part : mesh.part)
    materials.push_back(model::chosen_material(choice, part));
  const embedding::SkinReport made =
      run.timed("skin", [&] { return embedding::add_skin(model, mesh, materials, run.context()); });
  run.stats().set("skin_dropped_triangles", made.dropped_triangles);
  run.stats().set("skin_points_outside", made.points_outside);
  run.stats().set("skin_farthest", made.farthest);
  if (made.dropped_triangles > 0)
    run.warn(name + ": " + std::to_string(made.dropped_triangles) +
             " faces with two equal corners are left out of the skin");
  const double size = bounding_box(mesh).longest_side();
  const double allowed = std::fmin(cell / 4, 0.02 * size);
  if (!(made.farthest <= allowed)) {
    // Where the surface is smooth, its distance from the tetrahedra falls with the square of the
    // cell; what is thinner than a cell is lost until cells are as small.
    const double helps = cell * std::fmax(0.25, std::fmin(0.75, allowed / made.farthest));
    run.warn(name + ": the surface lies up to " + text::rounded_text(made.farthest) +
             " mm outside the tetrahedra, where it follows them poorly, expected --cell " +
             text::rounded_text(helps) + " or smaller in place of " + text::rounded_text(cell));
  }
}

/// Loose pieces move away from each other unless each is held.
void warn_of_pieces(Run& run, const std::string& name, const tetrahedra::TetMesh& mesh) {
  const std::uint64_t pieces = tetrahedra::component_count(mesh);
  run.stats().set("pieces", pieces);
  if (pieces < 2)
    return;
  tetrahedra::TetMesh largest = mesh;
  const tetrahedra::TetComponentReport report =
      tetrahedra::keep_components(largest, {.largest = 1});
  run.warn(name + ": the tetrahedra form " + std::to_string(pieces) +
           " pieces that nothing connects, with " + std::to_string(report.dropped_tetrahedra) +
           " tetrahedra beside the largest one, expected one piece: a smaller --cell, or a surface "
           "without loose parts (mc-opt --components largest)");
}

constexpr unsigned usual_grade = 1;
constexpr double voxels_per_cell = 2;
constexpr double most_voxel_halvings = 16;  // of the cells' size, for refined ones
constexpr double least_share = 0.1;         // of the box of an organ that is filled
constexpr double told_loss = 0.02;          // of the volume
constexpr std::int32_t unnamed = INT32_MAX; // no part that --material can name

void warn_of_thickness(Run& run, const std::string& name, const SolidCell& chosen, double volume) {
  const double wanted = chosen.thickness / 2;
  run.warn(name + ": the mean thickness is " + text::rounded_text(chosen.thickness) +
           " mm, cells of " + text::rounded_text(chosen.cell) +
           " mm are less than two across it, expected --cell " + text::rounded_text(wanted) +
           " (about " +
           text::rounded_text(tetrahedra_per_cell * volume / (wanted * wanted * wanted)) +
           " tetrahedra) where it bends");
}

/// Small cells need the surface at their size.
double finest_voxel(double cell, const std::vector<tetrahedra::RefinedRegion>& refined) {
  double finest = cell;
  for (const tetrahedra::RefinedRegion& region : refined)
    finest = std::fmin(finest, region.cell);
  return std::fmax(finest, cell / most_voxel_halvings) / voxels_per_cell;
}

void tell_change(Run& run, const std::string& what, double cell,
                 const formats::FilledSurface::Volume& volume) {
  const double change = (volume.filled - volume.of_surface) / volume.of_surface;
  if (!(std::abs(change) <= told_loss))
    run.warn(what + ": cells of " + text::number_text(cell) + " mm change the volume by " +
             text::number_text(std::round(1000 * change) / 10) + " %, expected a smaller --cell");
}

} // namespace

model::Model solid_source(Run& run, formats::Input& input, formats::Kind kind,
                          const ModelArguments& a) {
  refuse_others(a);
  refuse_surfaces(a);
  formats::TetReadOptions options;
  options.kind = kind;
  options.max_memory = run.context().max_memory;
  if (!a.unit.empty())
    options.scale = formats::millimetres_per(a.unit);
  tetrahedra::TetMesh mesh =
      run.timed("read", [&] { return formats::read_tet_mesh(input, options); });
  if (!a.transform.empty())
    at(input.name(), [&] { apply(transform_from_text(a.transform), mesh); });
  return at(input.name(), [&] {
    if (!a.repair.empty())
      repair(run, input.name(), mesh, a.repairs);
    const tetrahedra::TetReport found = tetrahedra::examine_tetrahedra(mesh);
    tetrahedra::require_sound(found);
    run.stats().set("dropped_points", found.unused_points.count);
    model::require_parts(a.build.material, mesh.material);
    return model_of(run, std::move(mesh), a);
  });
}

model::Model filled_surface(Run& run, const std::string& name, const TriangleMesh& mesh,
                            const ModelArguments& a) {
  refuse_others(a);
  const voxelization::VoxelizeOptions rule{.rule = voxel_rule_from_text(a.rule),
                                           .on_open = open_mesh_from_text(a.on_open)};
  double volume = std::abs(signed_volume(mesh));
  double area = surface_area(mesh);
  if (rule.rule != voxelization::VoxelRule::parity ||
      rule.on_open != voxelization::OpenMesh::refuse) {
    area = 0; // parts that overlap say nothing about the thickness
    // Parts that are turned inward or open can take all of it away.
    const Vec3 box = bounding_box(mesh).size();
    volume = std::max(volume, least_share * box.x * box.y * box.z);
  }
  const SolidCell chosen = default_cell(volume, area);
  const double cell = a.cell.value_or(chosen.cell);
  return at(name, [&] {
    if (!(cell > 0 && std::isfinite(cell)))
      throw Error("the surface has no volume, expected a closed one");
    const std::vector<std::int32_t> parts =
        mesh.part.empty() ? std::vector<std::int32_t>{} : a.build.material.named;
    refuse(
        !parts.empty() && !a.refined.empty(),
        "--refine: refined cells can't follow the interface between parts, expected one material "
        "for all");
    formats::FilledSurface filled = run.timed("fill", [&] {
      return formats::fill_surface(mesh, name,
                                   {finest_voxel(cell, a.refined), cell, usual_grade, parts,
                                    rule.rule, rule.on_open, a.refined},
                                   run.context());
    });
    for (const voxelization::VoxelizeReport& found : filled.found)
      if (const std::string defects = mesh_defects(found, rule); !defects.empty())
        run.warn(name + ": " + defects);
    tetrahedra::TetMesh& tets = filled.mesh;
    if (tets.tetrahedra.empty())
      throw Error("no cell of " + text::number_text(cell) +
                  " mm lies inside, expected a smaller --cell");
    run.stats().set("cell", cell);
    if (area > 0)
      run.stats().set("mean_thickness", chosen.thickness);
    if (!a.cell && chosen.capped)
      warn_of_thickness(run, name, chosen, volume);
    double of_surface = std::abs(signed_volume(mesh));
    if (of_surface < volume) { // what was found to be inside it
      of_surface = 0;
      for (const formats::FilledSurface::Volume& one : filled.volumes)
        of_surface += one.of_surface;
    }
    run.stats().set("volume_surface", of_surface);
    run.stats().set("volume", gewebe::tetrahedra::volume(tets));
    run.say(name + ": " + std::to_string(tets.tetrahedra.size()) + " tetrahedra of cells of " +
            text::number_text(cell) + " mm");
    for (std::size_t k = 0; k < filled.volumes.size(); ++k)
      tell_change(run, k < parts.size() ? name + ": part " + std::to_string(parts[k]) : name, cell,
                  filled.volumes[k]);
    for (std::int32_t& material : tets.material) // others have the material of all
      material = static_cast<std::size_t>(material) < parts.size()
                     ? parts[static_cast<std::size_t>(material)]
                     : unnamed;
    warn_of_pieces(run, name, tets);
    model::Model model = model_of(run, std::move(tets), a);
    if (!a.no_skin)
      skin(run, name, mesh, cell, a.build.material, model);
    return model;
  });
}

} // namespace gewebe::cli
