#pragma once
// Shapes of a run as meshes: gewebe_results(5).

#include "formats/results/results_writer.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"

#include <memory>
#include <string>

namespace gewebe::formats {

/// The last shape, or a series of all frames. \param kind ply or obj
/// \throw Error, UsageError as Output and for a wrong pattern
std::unique_ptr<ResultWriter> open_mesh_result(Kind kind, const std::string& path,
                                               const Output::Options& options);

} // namespace gewebe::formats
