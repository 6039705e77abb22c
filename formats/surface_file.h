#pragma once
// Whatever has a surface to draw: a mesh, a model.

#include "base/context.h"
#include "formats/kind.h"
#include "formats/stream.h"
#include "render/drawing.h"

#include <string>
#include <vector>

namespace gewebe {

struct SurfaceReadOptions {
  Kind kind = Kind::unknown; ///< of input_kind()
  std::string unit;          ///< of a mesh, as in MeshReadOptions
};

/// Mesh kinds and ela.
const std::vector<Kind>& readable_surface_kinds();

/// The words of --unit.
const std::vector<std::string>& surface_unit_names();

/// The surfaces of `input` in mm, in order.
/// \throw Error with place; UsageError for options that the kind has no use for
std::vector<Surface> read_surfaces(Input& input, const SurfaceReadOptions& options,
                                   const Context& context);

} // namespace gewebe
