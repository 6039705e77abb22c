// csg: volumes -> volume.

#include "volume/csg.h"
#include "formats/volume/volume_file.h"
#include "tools/shared/cli.h"
#include "tools/shared/report.h"
#include "tools/shared/volume_output.h"

using namespace gewebe;

namespace {

struct Arguments {
  std::string word;
  std::vector<std::string> volumes;
  CsgOperation operation = CsgOperation::add;
  CsgOptions options;
  VolumeOutput output;
};

void complete(Arguments& a) {
  a.operation = csg_operation_from_name(a.word);
  cli::check_one_pipe(a.volumes);
}

void work(cli::Run& run, const Arguments& a) {
  Output output = open_volume(run);
  std::vector<CsgOperand> operands;
  run.timed("read", [&] {
    for (const std::string& path : a.volumes) {
      Input input(path);
      operands.push_back({read_volume(input, run.context()), input.name()});
    }
  });
  CsgReport counts;
  const Grid grid = run.timed(
      "csg", [&] { return csg(run.context(), a.operation, operands, a.options, &counts); });
  write(run, output, grid, a.output);

  cli::Stats& stats = run.stats();
  stats.set("operation", a.word);
  stats.set("operands", static_cast<std::uint64_t>(a.volumes.size()));
  stats.set("resampled", counts.resampled);
  stats.set("leaves_computed", counts.leaves_computed);
  stats.set("leaves_shared", counts.leaves_shared);
  stats.set("leaves_constant", counts.leaves_constant);
  stats.set("leaves_skipped", counts.leaves_skipped);
  stats.set("tiles_combined", counts.tiles_combined);
  cli::report_volume(run, grid);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("csg", "Combines volumes: sums, differences and set operations, left to right.");
  Arguments a;
  p.flag("--resample", a.options.resample, "bring the others to the first volume's lattice");
  declare(p, a.output);
  p.operand("OPERATION", a.word, "add, subtract, union, intersect, difference, xor", true,
            csg_operation_names());
  p.operands("VOLUME", a.volumes, "the volumes, - for standard input", 2);
  p.check([&] { complete(a); });
  return p.run(argc, argv, [&](cli::Run& run) { work(run, a); });
}
