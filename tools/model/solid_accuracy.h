#pragma once
// A solid whose cells are refined until a scene's answers are accurate enough.

#include "geometry/mesh.h"
#include "model/model.h"
#include "tetrahedra/refinement.h"
#include "tools/cli/cli.h"
#include "tools/model/model_arguments.h"

#include <functional>
#include <string>
#include <vector>

namespace gewebe::cli {

/// A surface that is filled with tetrahedra.
struct FilledSolid {
  model::Model model;
  double cell = 0;                   ///< of the lattice, before refinement, mm
  std::vector<std::string> warnings; ///< about this mesh
};

/// Makes the solid with the cells that the options state, and smaller ones in these regions.
using FillSolid = std::function<FilledSolid(const std::vector<tetrahedra::RefinedRegion>&)>;

/// Solves the scene of --for with meshes of smaller and smaller cells, and prints a table of them.
///
/// Error: estimated relative error of the energy, the largest of all steps and of all objects that
/// have this model. It is the sum of what the elements cause (fem/stress_error.h) and what their
/// surface does (shape_error.h). Each round halves cells at the centres of the fewest
/// elements that hold most of the error (bulk criterion: Dörfler, SIAM J. Numer. Anal. 33, 1996).
/// The model of an object is the one that is built if the object's file is that of -o, or for
/// standard output if no object has another file.
/// \param surface  that is filled
/// \return the first mesh whose error is at most a.accuracy.error
/// \throw Error if that needs more tetrahedra than a.accuracy.max_tetrahedra, if no object has the
/// model, if nothing deforms it, if an error can't be estimated; as FillSolid and SceneRun
FilledSolid accurate_solid(Run& run, const ModelArguments& a, const TriangleMesh& surface,
                           const FillSolid& fill);

} // namespace gewebe::cli
