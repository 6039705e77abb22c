#pragma once
// Text of --version.

#include <string>

namespace gewebe::cli {

/// Version and commit of Gewebe, versions of the libraries that this process has loaded, in
/// alphabetical order, and the kernels that GEWEBE_CPU, or else the processor, gives. A line each.
/// \throw Error if GEWEBE_CPU is no level
std::string version_text(const std::string& tool);

} // namespace gewebe::cli
