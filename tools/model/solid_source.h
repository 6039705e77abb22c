#pragma once
// exp2ela's way from tetrahedra to a model of finite elements.

#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "geometry/mesh.h"
#include "model/model.h"
#include "tools/cli/cli.h"
#include "tools/model/model_arguments.h"

#include <string>

namespace gewebe::cli {

/// Reads a tetrahedral mesh, repairs it by the options, and makes a model of it. \throw UsageError
/// if an option was given that says nothing of tetrahedra; Error if the mesh isn't sound
model::Model solid_source(Run& run, formats::Input& input, formats::Kind kind,
                          const ModelArguments& a);

/// Fills a closed surface: a volume of it is stuffed with tetrahedra of cells of a.cell, or of
/// default_cell(), which is reported. \throw UsageError as above; Error as
/// voxelize and stuff, or if nothing is left of it
model::Model filled_surface(Run& run, const std::string& name, const TriangleMesh& mesh,
                            const ModelArguments& a);

} // namespace gewebe::cli
