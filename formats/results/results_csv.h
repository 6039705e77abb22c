#pragma once
// Numbers of a run over time as CSV: gewebe_results(5).

#include "formats/results/results_writer.h"
#include "formats/stream/stream.h"

#include <memory>
#include <string>

namespace gewebe::formats {

/// Without a temporary file (a pipe, a device) rows of frames are written by `commit`, since their
/// columns are known only then. \throw Error, UsageError as Output
std::unique_ptr<ResultWriter> open_csv_result(const std::string& path,
                                              const Output::Options& options, TableRows rows);

} // namespace gewebe::formats
