#include "tools/cli/space_option.h"

namespace gewebe::cli {

void declare_space(cli::Program& program, std::string& space) {
  program.option("--space", space, "SPACE", "space of the result: ras or lps")
      .one_of({"ras", "lps"});
}

Space result_space(Space from, const std::string& option) {
  return option.empty() ? from : space_from_name(option);
}

volume::GridTransform other_space(const volume::GridTransform& transform) {
  volume::GridTransform turned = transform;
  for (std::size_t n = 0; n < 8; ++n) // the rows of x and y
    turned.m[n] = 0 - turned.m[n];    // which gives no -0
  return turned;
}

std::string two_spaces_text(const std::string& first_name, Space first, const std::string& name,
                            Space space) {
  return first_name + " is in " + std::string(space_name(first)) + " and " + name + " in " +
         std::string(space_name(space)) +
         ", expected one space: --space of voxelize, mc-opt and exp2ela brings both to the same";
}

void warn_of_spaces(cli::Run& run, const std::string& first_name, Space first,
                    const std::string& name, Space space) {
  if (spaces_differ(first, space))
    run.warn(two_spaces_text(first_name, first, name, space));
}

} // namespace gewebe::cli
