#pragma once
// Names of files that are numbered by frame.

#include <cstdint>
#include <string>

namespace gewebe::cli {

/// The pattern with its "%d" or "%04d" replaced by the number; "%%" is one "%".
/// \throw UsageError for any other use of "%"
std::string numbered(const std::string& pattern, std::int64_t number);

} // namespace gewebe::cli
