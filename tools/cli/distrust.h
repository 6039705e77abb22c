#pragma once
// A warning that -q does not silence.

#include "tools/cli/cli.h"

#include <string>

namespace gewebe::cli {

/// `tool: warning: text` on standard error whatever -q says, for the result is not what was meant;
/// --stats has "distrusted": true.
void distrust(Run& run, const std::string& tool, const std::string& text);

} // namespace gewebe::cli
