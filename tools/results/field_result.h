#pragma once
// ffe-run --field: the last frame as a displacement field in the voxels of an image.

#include "base/context.h"
#include "formats/results/results_writer.h"

#include <functional>
#include <memory>
#include <string>

namespace gewebe::cli {

struct FieldOptions {
  std::string like;     ///< the image whose voxels it has
  bool at_rest = false; ///< vectors at places of rest, to where they went; else back from there
  float outside = 0;    ///< three times, where no element holds the place
  std::function<void(const std::string&)> warn;
};

/// Reads the image's header. Objects are solids. \throw Error, UsageError as Output, if the image
/// is none or too large, and later (place: the object's name) for an object without tetrahedra
std::unique_ptr<formats::ResultWriter> open_field_result(const std::string& path,
                                                         const formats::Output::Options& output,
                                                         const FieldOptions& options,
                                                         const Context& context);

} // namespace gewebe::cli
