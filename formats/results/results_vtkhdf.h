#pragma once
// Frames of a run as one VTKHDF file: gewebe_results(5).

#include "formats/results/results_writer.h"
#include "formats/stream/stream.h"

#include <memory>
#include <string>

namespace gewebe::formats {

/// All frames. \throw Error as Output, place = path; it needs a file
std::unique_ptr<ResultWriter> open_vtkhdf_result(const std::string& path,
                                                 const Output::Options& options);

} // namespace gewebe::formats
