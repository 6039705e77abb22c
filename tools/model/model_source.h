#pragma once
// The model that exp2ela begins with, of whichever input it has.

#include "model/model.h"
#include "tools/cli/cli.h"
#include "tools/cli/space_option.h"
#include "tools/model/model_arguments.h"

namespace gewebe::cli {

/// Makes a primitive, or reads a mesh or tetrahedra and builds a model of them, or reads a model.
/// \param space  gets the space that the model is in
/// \throw UsageError if an option says nothing of such an input; Error as the readers
model::Model model_source(Run& run, ModelArguments a, Space& space);

/// Fixes the nodes that --fix selects. \throw Error if there are none
void fix_nodes(model::Model& model, const ModelArguments& a);

/// Warns of materials whose law becomes unstable under strains, naming the smallest of them.
void warn_of_laws(Run& run, const model::Model& model);

} // namespace gewebe::cli
