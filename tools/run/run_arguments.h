#pragma once
// What the command line of ffe-run says.

#include "tools/cli/cli.h"
#include "tools/results/result_choice.h"

#include <optional>
#include <string>

namespace gewebe::cli {

struct RunArguments {
  std::string scene = "-";
  bool serve = false, acknowledge = false, awake = false, binary = false, verify = false;
  bool no_partial = false, estimate = false;
  std::optional<double> rate;
  double tolerance = 0;
  std::string listen, shapes, events, record, latencies, recover;
  ResultChoice result;

  /// Declares the options and what must hold of them together.
  void declare(cli::Program& p);
};

} // namespace gewebe::cli
