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
#include "tools/model/solid_accuracy.h"
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
  const tetrahedra::TetRepair done = repair_tetrahedra(
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
void skin(Run& run, const TriangleMesh& mesh, const model::MaterialChoice& choice,
          FilledSolid& solid) {
  std::vector<std::int32_t> materials;
  for (const std::int32_t part : mesh.part)
    materials.push_back(chosen_material(choice, part));
  const embedding::SkinReport made = run.timed(
      "skin", [&] { return embedding::add_skin(solid.model, mesh, materials, run.context()); });
  run.stats().set("skin_dropped_triangles", made.dropped_triangles);
  run.stats().set("skin_points_outside", made.points_outside);
  run.stats().set("skin_farthest", made.farthest);
  if (made.dropped_triangles > 0)
    solid.warnings.push_back(std::to_string(made.dropped_triangles) +
                             " faces with two equal corners are left out of the skin");
  const double cell = solid.cell;
  const double size = bounding_box(mesh).longest_side();
  const double allowed = std::fmin(cell / 4, 0.02 * size);
  if (!(made.farthest <= allowed)) {
    // Where the surface is smooth, its distance from the tetrahedra falls with the square of the
    // cell; what is thinner than a cell is lost until cells are as small.
    const double helps = cell * std::fmax(0.25, std::fmin(0.75, allowed / made.farthest));
    solid.warnings.push_back("the surface lies up to " + text::rounded_text(made.farthest) +
                             " mm outside the tetrahedra, where it follows them poorly, expected "
                             "--cell " +
                             text::rounded_text(helps) + " or smaller in place of " +
                             text::rounded_text(cell));
  }
}

/// Loose pieces move away from each other unless each is held.
void warn_of_pieces(Run& run, const tetrahedra::TetMesh& mesh, std::vector<std::string>& warnings) {
  const std::uint64_t pieces = component_count(mesh);
  run.stats().set("pieces", pieces);
  if (pieces < 2)
    return;
  tetrahedra::TetMesh largest = mesh;
  const tetrahedra::TetComponentReport report = keep_components(largest, {.largest = 1});
  warnings.push_back(
      "the tetrahedra form " + std::to_string(pieces) + " pieces that nothing connects, with " +
      std::to_string(report.dropped_tetrahedra) +
      " tetrahedra beside the largest one, expected one piece: a smaller --cell, or a surface "
      "without loose parts (mc-opt --components largest)");
}

constexpr unsigned usual_grade = 1;
constexpr double voxels_per_cell = 2;
constexpr double most_voxel_halvings = 16;  // of the cells' size, for refined ones
constexpr double least_share = 0.1;         // of the box of an organ that is filled
constexpr double told_loss = 0.02;          // of the volume
constexpr std::int32_t unnamed = INT32_MAX; // no part that --material can name

std::string thickness_warning(const SolidCell& chosen, double volume) {
  const double wanted = chosen.thickness / 2;
  return "the mean thickness is " + text::rounded_text(chosen.thickness) + " mm, cells of " +
         text::rounded_text(chosen.cell) + " mm are less than two across it, expected --cell " +
         text::rounded_text(wanted) + " (about " +
         text::rounded_text(tetrahedra_per_cell * volume / (wanted * wanted * wanted)) +
         " tetrahedra) where it bends";
}

/// Small cells need the surface at their size.
double finest_voxel(double cell, const std::vector<tetrahedra::RefinedRegion>& refined) {
  double finest = cell;
  for (const tetrahedra::RefinedRegion& region : refined)
    finest = std::fmin(finest, region.cell);
  return std::fmax(finest, cell / most_voxel_halvings) / voxels_per_cell;
}

void add_change(const std::string& part, double cell, const formats::FilledSurface::Volume& volume,
                std::vector<std::string>& warnings) {
  const double change = (volume.filled - volume.of_surface) / volume.of_surface;
  if (!(std::abs(change) <= told_loss))
    warnings.push_back(part + "cells of " + text::number_text(cell) + " mm change the volume by " +
                       text::number_text(std::round(1000 * change) / 10) +
                       " %, expected a smaller --cell");
}

/// Fills one surface, with any refinement.
class Filling {
public:
  Filling(Run& run, const std::string& name, const TriangleMesh& mesh, const ModelArguments& a)
      : run_(run), name_(name), mesh_(mesh), a_(a),
        rule_{.rule = voxel_rule_from_text(a.rule), .on_open = open_mesh_from_text(a.on_open)},
        parts_(mesh.part.empty() ? std::vector<std::int32_t>{} : a.build.material.named),
        volume_(std::abs(signed_volume(mesh))), area_(surface_area(mesh)) {
    if (rule_.rule != voxelization::VoxelRule::parity ||
        rule_.on_open != voxelization::OpenMesh::refuse) {
      area_ = 0; // parts that overlap say nothing about the thickness
      // Parts that are turned inward or open can take all of it away.
      const Vec3 box = bounding_box(mesh).size();
      volume_ = std::max(volume_, least_share * box.x * box.y * box.z);
    }
    chosen_ = default_cell(volume_, area_);
    cell_ = a.cell.value_or(chosen_.cell);
  }

  /// \param more  regions beside those of --refine
  FilledSolid fill(const std::vector<tetrahedra::RefinedRegion>& more) const {
    if (!(cell_ > 0 && std::isfinite(cell_)))
      throw Error("the surface has no volume, expected a closed one");
    std::vector<tetrahedra::RefinedRegion> refined = a_.refined;
    refined.insert(refined.end(), more.begin(), more.end());
    refuse(!parts_.empty() && (!refined.empty() || !a_.accuracy.text.empty()),
           "--refine, --accuracy: refined cells can't follow the interface between parts, expected "
           "one material for all");
    formats::FilledSurface filled = run_.timed("fill", [&] {
      return formats::fill_surface(mesh_, name_,
                                   {finest_voxel(cell_, refined), cell_, usual_grade, parts_,
                                    rule_.rule, rule_.on_open, refined},
                                   run_.context());
    });
    FilledSolid solid{{}, cell_, warnings_of(filled)};
    if (!a_.cell && chosen_.capped)
      solid.warnings.push_back(thickness_warning(chosen_, volume_));
    tetrahedra::TetMesh& tets = filled.mesh;
    report(filled);
    for (std::size_t k = 0; k < filled.volumes.size(); ++k)
      add_change(k < parts_.size() ? "part " + std::to_string(parts_[k]) + ": " : "", cell_,
                 filled.volumes[k], solid.warnings);
    for (std::int32_t& material : tets.material) // others have the material of all
      material = static_cast<std::size_t>(material) < parts_.size()
                     ? parts_[static_cast<std::size_t>(material)]
                     : unnamed;
    warn_of_pieces(run_, tets, solid.warnings);
    solid.model = model_of(run_, std::move(tets), a_);
    if (!a_.no_skin)
      skin(run_, mesh_, a_.build.material, solid);
    return solid;
  }

private:
  std::vector<std::string> warnings_of(const formats::FilledSurface& filled) const {
    std::vector<std::string> warnings;
    for (const voxelization::VoxelizeReport& found : filled.found)
      if (std::string defects = mesh_defects(found, rule_); !defects.empty())
        warnings.push_back(std::move(defects));
    return warnings;
  }

  void report(const formats::FilledSurface& filled) const {
    if (filled.mesh.tetrahedra.empty())
      throw Error("no cell of " + text::number_text(cell_) +
                  " mm lies inside, expected a smaller --cell");
    run_.stats().set("cell", cell_);
    if (area_ > 0)
      run_.stats().set("mean_thickness", chosen_.thickness);
    double of_surface = std::abs(signed_volume(mesh_));
    if (of_surface < volume_) { // what was found to be inside it
      of_surface = 0;
      for (const formats::FilledSurface::Volume& one : filled.volumes)
        of_surface += one.of_surface;
    }
    run_.stats().set("volume_surface", of_surface);
    run_.stats().set("volume", tetrahedra::volume(filled.mesh));
    run_.say(name_ + ": " + std::to_string(filled.mesh.tetrahedra.size()) +
             " tetrahedra of cells of " + text::number_text(cell_) + " mm");
  }

  Run& run_;
  const std::string& name_;
  const TriangleMesh& mesh_;
  const ModelArguments& a_;
  voxelization::VoxelizeOptions rule_;
  std::vector<std::int32_t> parts_; ///< that are bodies of their own
  double volume_, area_;            ///< area 0: unknown
  SolidCell chosen_;
  double cell_ = 0;
};

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
  tetrahedra::TetMesh mesh = run.timed("read", [&] { return read_tet_mesh(input, options); });
  if (!a.transform.empty())
    at(input.name(), [&] { apply(transform_from_text(a.transform), mesh); });
  return at(input.name(), [&] {
    if (!a.repair.empty())
      repair(run, input.name(), mesh, a.repairs);
    const tetrahedra::TetReport found = examine_tetrahedra(mesh);
    require_sound(found);
    run.stats().set("dropped_points", found.unused_points.count);
    require_parts(a.build.material, mesh.material);
    return model_of(run, std::move(mesh), a);
  });
}

model::Model filled_surface(Run& run, const std::string& name, const TriangleMesh& mesh,
                            const ModelArguments& a) {
  refuse_others(a);
  const Filling filling(run, name, mesh, a);
  const FillSolid fill = [&](const std::vector<tetrahedra::RefinedRegion>& more) {
    return at(name, [&] { return filling.fill(more); });
  };
  const FilledSolid solid = a.accuracy.text.empty()
                                ? fill({})
                                : at(name, [&] { return accurate_solid(run, a, mesh, fill); });
  for (const std::string& warning : solid.warnings)
    run.warn(name + ": " + warning);
  return solid.model;
}

} // namespace gewebe::cli
