#pragma once
// --space: the anatomical space of a program's result.

#include "geometry/space.h"
#include "tools/cli/cli.h"
#include "volume/grid.h"

#include <string>
#include <vector>

namespace gewebe::cli {

/// Declares --space ras|lps.
void declare_space(cli::Program& program, std::string& space);

/// The space of a result made of what is in `from`: the one of --space where it is given. Input
/// whose space is not known is taken to be in it.
Space result_space(Space from, const std::string& option);

/// The transform to the other space.
volume::GridTransform other_space(const volume::GridTransform& transform);

/// A warning that two inputs are in different spaces.
std::string two_spaces_text(const std::string& first_name, Space first, const std::string& name,
                            Space space);

/// Warns that `name` is in another space than `first`, if both are known.
void warn_of_spaces(cli::Run& run, const std::string& first_name, Space first,
                    const std::string& name, Space space);

} // namespace gewebe::cli
