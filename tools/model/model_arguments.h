#pragma once
// The options of exp2ela: how a model is built.

#include "model/build.h"
#include "model/material.h"
#include "model/primitive.h"
#include "model/selector.h"
#include "repair/repair.h"
#include "tetrahedra/refinement.h"
#include "tools/cli/cli.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::cli {

/// How accurate a solid shall be, and for what.
struct AccuracyGoal {
  std::string text, scene; ///< as given; the file of the scene
  double error = 0;        ///< relative
  std::optional<std::int64_t> max_tetrahedra;
};

struct ModelArguments {
  std::string mesh = "-", unit, weld = "auto", material = "generic", name, fix = "none",
              axes = "xyz", primitive, size, repair, materials, fit, rule = "parity",
              on_open = "error", space, transform, law, prony, refine;
  model::MaterialOverrides values;
  model::BuildOptions build;
  repair::RepairOptions repairs;
  std::optional<model::Selector> fixed;
  std::optional<model::Primitive> matrix;
  std::optional<double> dt;
  std::int64_t order = 2;     ///< of finite elements
  std::optional<double> cell; ///< of the lattice that fills a surface
  std::vector<tetrahedra::RefinedRegion> refined;
  AccuracyGoal accuracy; ///< no text: none
  bool solid = false, no_skin = false, scale_mass = false, list_materials = false;
};

/// Declares the options of a program, with their values in `a`.
void declare(cli::Program& p, ModelArguments& a);

/// Checks them against each other and reads their texts. \throw UsageError
void complete(ModelArguments& a);

/// Chooses among the presets and the materials of --materials. \throw UsageError if there is none
/// of a name; Error if the table is bad
void choose_materials(ModelArguments& a);

/// Writes the table of the materials there are.
void list_materials(cli::Run& run, const ModelArguments& a);

} // namespace gewebe::cli
