#pragma once
// What ffe-run leaves, as its command line says: a result of formats/results, or a field.

#include "formats/results/results_writer.h"
#include "formats/stream/kind.h"
#include "tools/cli/cli.h"

#include <functional>
#include <memory>
#include <string>

namespace gewebe::cli {

class ResultChoice {
public:
  /// Declares options and kinds.
  void declare(cli::Program& program);
  /// \throw UsageError if options need others
  void check(const cli::Program& program) const;
  /// The kind of result, or unknown where there is none but replies. \throw UsageError if that and
  /// the options differ
  formats::Kind kind(const cli::Run& run) const;
  /// Nothing where the kind is unknown. `run` outlives it. \throw as open_result, open_field_result
  std::unique_ptr<formats::ResultWriter> open(cli::Run& run, formats::Kind kind) const;

private:
  std::string field_, field_at_ = "deformed", field_outside_ = "zero", rows_ = "frame";
  std::function<bool()> rows_given_;
};

} // namespace gewebe::cli
