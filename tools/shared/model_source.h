#pragma once
// The model that exp2ela begins with, of whichever input it has.

#include "model/model.h"
#include "tools/shared/cli.h"
#include "tools/shared/model_arguments.h"
#include "tools/shared/space_option.h"

namespace gewebe::cli {

/// Makes a primitive, or reads a mesh or tetrahedra and builds a model of them, or reads a model.
/// \param space  gets the space that the model is in
/// \throw UsageError if an option says nothing of such an input; Error as the readers
Model model_source(Run& run, ModelArguments a, Space& space);

} // namespace gewebe::cli
