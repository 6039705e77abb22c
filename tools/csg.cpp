// csg: volumes -> volume.

#include "volume/csg.h"
#include "formats/volume/volume_file.h"
#include "tools/cli/cli.h"
#include "tools/cli/report.h"
#include "tools/cli/space_option.h"
#include "tools/volume/volume_output.h"

using namespace gewebe;

namespace {

struct Arguments {
  std::string word;
  std::vector<std::string> volumes;
  volume::CsgOperation operation = volume::CsgOperation::add;
  volume::CsgOptions options;
  cli::VolumeOutput output;
};

void complete(Arguments& a) {
  a.operation = volume::csg_operation_from_name(a.word);
  cli::check_one_pipe(a.volumes);
}

/// The box of what is not background, in mm; empty if there is nothing.
Box3 world_box(const volume::Grid& grid) {
  Box3 box;
  Int3 low{}, high{};
  if (grid.active_box(low, high))
    for (int corner = 0; corner < 8; ++corner) {
      Vec3 index;
      for (int axis = 0; axis < 3; ++axis)
        index[axis] = (corner >> axis & 1) != 0 ? high[static_cast<std::size_t>(axis)] + 0.5
                                                : low[static_cast<std::size_t>(axis)] - 0.5;
      box.add(grid.info().transform.to_world(index));
    }
  return box;
}

/// A volume that lies apart from all before it changes nothing of them, or leaves nothing.
void warn_of_apart(cli::Run& run, const std::vector<volume::CsgOperand>& operands) {
  Box3 all;
  for (const volume::CsgOperand& operand : operands) {
    const Box3 box = world_box(operand.grid);
    if (!box.empty() && !all.empty())
      for (int axis = 0; axis < 3; ++axis)
        if (box.min[axis] >= all.max[axis] || box.max[axis] <= all.min[axis]) {
          run.warn(operand.name + ": does not overlap the volumes before it, expected the same "
                                  "place: look at units, spaces (--space) and transforms");
          break;
        }
    if (!box.empty()) {
      all.add(box.min);
      all.add(box.max);
    }
  }
}

void work(cli::Run& run, const Arguments& a) {
  formats::Output output = cli::open_volume(run);
  std::vector<volume::CsgOperand> operands;
  cli::VolumeOutput result = a.output;
  bool spaces_match = true;
  run.timed("read", [&] {
    std::string stated;
    for (const std::string& path : a.volumes) {
      formats::Input input(path);
      Space space = Space::unknown;
      operands.push_back({formats::read_volume(input, run.context(), &space), input.name()});
      cli::warn_of_spaces(run, stated, result.space, input.name(), space);
      spaces_match = spaces_match && !spaces_differ(result.space, space);
      if (result.space == Space::unknown) {
        result.space = space;
        stated = input.name();
      }
    }
  });
  if (spaces_match)
    warn_of_apart(run, operands);
  volume::CsgReport counts;
  const volume::Grid grid = run.timed(
      "csg", [&] { return volume::csg(run.context(), a.operation, operands, a.options, &counts); });
  cli::write(run, output, grid, result);

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
  p.flag("--resample", a.options.resample, "resample other volumes to the lattice of the first");
  cli::declare(p, a.output);
  p.operand("OPERATION", a.word, "add, subtract, union, intersect, difference, xor", true,
            volume::csg_operation_names());
  p.operands("VOLUME", a.volumes, "volumes, - for standard input", 2);
  p.check([&] { complete(a); });
  return p.run(argc, argv, [&](cli::Run& run) { work(run, a); });
}
