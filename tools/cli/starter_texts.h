#pragma once
// Help of the program `gewebe`, which starts the others.

#include <string>

namespace gewebe::cli {

/// Usage, options, examples, exit statuses and the list of programs.
std::string starter_help();

/// The same as JSON, with the members of --help-json of the other programs (gewebe(7)).
std::string starter_help_json();

} // namespace gewebe::cli
