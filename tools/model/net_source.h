#pragma once
// exp2ela's way from a surface to a model.

#include "geometry/mesh.h"
#include "model/model.h"
#include "tools/cli/cli.h"
#include "tools/model/model_arguments.h"

#include <string>

namespace gewebe::cli {

/// Repairs the surface by the options, reports that, and makes a net of it, or fills it.
model::Model model_of_surface(Run& run, const std::string& name, TriangleMesh mesh,
                              const ModelArguments& a);

/// Few central nodes hold a part of few nodes.
void warn_of_hinges(Run& run, const model::Model& model);

} // namespace gewebe::cli
