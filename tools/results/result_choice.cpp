#include "tools/results/result_choice.h"

#include "base/error.h"
#include "tools/results/field_result.h"

#include <limits>
#include <vector>

namespace gewebe::cli {
namespace {

std::vector<formats::Kind> kinds_written() {
  std::vector<formats::Kind> kinds = formats::result_kinds();
  kinds.push_back(formats::Kind::nifti);
  return kinds;
}

} // namespace

void ResultChoice::declare(cli::Program& program) {
  program.output_kinds(kinds_written());
  program.option("--field", field_, "IMAGE",
                 "for results of kind nii: image whose voxels the field has");
  program
      .option("--field-at", field_at_, "STATE",
              "vectors of the field: deformed (point back to rest) or rest (point to the tissue)")
      .one_of({"deformed", "rest"});
  program
      .option("--field-outside", field_outside_, "VALUE", "vectors outside all elements: zero, nan")
      .one_of({"zero", "nan"});
  program
      .option("--rows", rows_, "WHAT",
              "rows of a csv: one per frame with all its numbers, or per displaced or touched node")
      .one_of({"frame", "node"});
  rows_given_ = [&program] { return program.given("--rows"); };
}

void ResultChoice::check(const cli::Program& program) const {
  for (const std::string option : {"--field-at", "--field-outside"})
    if (program.given(option) && field_.empty())
      throw UsageError(option + " without --field, expected both");
}

formats::Kind ResultChoice::kind(const cli::Run& run) const {
  const bool none = run.output() == "-" && run.to().empty();
  const formats::Kind kind =
      none ? formats::Kind::unknown
           : formats::output_kind(run.to(), run.output(), formats::Kind::hdf5, kinds_written());
  if ((kind == formats::Kind::nifti) == field_.empty())
    throw UsageError(field_.empty()
                         ? "nii is a displacement field, expected --field IMAGE"
                         : "--field is for a result of kind nii, expected -o FILE.nii.gz");
  if ((kind == formats::Kind::hdf5 || kind == formats::Kind::vtkhdf) && run.output() == "-")
    throw UsageError(std::string(formats::kind_name(kind)) +
                     " can't go to standard output, expected -o FILE");
  if (rows_given_() && kind != formats::Kind::csv)
    throw UsageError("--rows is for a result of kind csv, expected -o FILE.csv or --to csv");
  return kind;
}

std::unique_ptr<formats::ResultWriter> ResultChoice::open(cli::Run& run, formats::Kind kind) const {
  if (kind == formats::Kind::unknown)
    return nullptr;
  if (kind != formats::Kind::nifti)
    return formats::open_result(kind, run.output(), run.output_options(formats::is_binary(kind)),
                                rows_ == "node" ? formats::TableRows::node
                                                : formats::TableRows::frame);
  FieldOptions options;
  options.like = field_;
  options.at_rest = field_at_ == "rest";
  options.outside = field_outside_ == "nan" ? std::numeric_limits<float>::quiet_NaN() : 0;
  options.warn = [&run](const std::string& text) { run.warn(text); };
  return open_field_result(run.output(), run.output_options(true), options, run.context());
}

} // namespace gewebe::cli
