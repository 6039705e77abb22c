#pragma once
// Frames of a run as VTK's unstructured grids: gewebe_results(5).

#include "formats/results/results_writer.h"
#include "formats/stream/stream.h"

#include <memory>
#include <string>

namespace gewebe::formats {

/// The last frame, or a series of all. \throw Error, UsageError as Output and for a wrong pattern
std::unique_ptr<ResultWriter> open_vtu_result(const std::string& path,
                                              const Output::Options& options);

} // namespace gewebe::formats
