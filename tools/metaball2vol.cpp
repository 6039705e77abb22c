// metaball2vol: particles -> density volume.

#include "base/bytes.h"
#include "density/density.h"
#include "formats/mesh/particles_file.h"
#include "formats/volume/volume_file.h"
#include "tools/cli/cli.h"
#include "tools/cli/report.h"
#include "tools/volume/volume_output.h"
#include "volume/lattice.h"

#include <array>
#include <cstdio>

using namespace gewebe;

namespace {

struct Arguments {
  std::string particles = "-", like, unit = "mm";
  std::optional<double> voxel, band;
  std::optional<std::int64_t> dim;
  std::vector<double> bbox;
  cli::VolumeOutput output;
};

void check(const Arguments& arguments) {
  const int lattices = int{arguments.voxel.has_value()} + int{arguments.dim.has_value()} +
                       int{!arguments.like.empty()};
  if (lattices != 1)
    throw UsageError("expected exactly one of --voxel, --dim and --like");
  cli::check_one_pipe({arguments.particles, arguments.like});
  for (std::size_t axis = 0; axis < 3 && !arguments.bbox.empty(); ++axis)
    if (!(arguments.bbox[axis] < arguments.bbox[axis + 3]))
      throw UsageError("--bbox: expected x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1, z0 < z1");
}

volume::GridInfo lattice(const Arguments& arguments, const Particles& particles,
                         const Context& context, Space& space) {
  volume::GridInfo info;
  if (arguments.voxel) {
    info.transform = volume::uniform_transform(*arguments.voxel);
  } else if (arguments.dim) {
    info.transform = volume::lattice_for_dim(support_box(particles), *arguments.dim);
  } else {
    formats::Input input(arguments.like);
    info.transform = formats::read_volume(input, context, &space).info().transform;
    if (!info.transform.is_cubic())
      throw Error(input.name(), "has " + info.transform.describe() + ", expected cubic voxels");
  }
  return info;
}

std::string count_text(double count) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.3g", count);
  return text.data();
}

void work(cli::Run& run, const Arguments& arguments) {
  formats::Output output = cli::open_volume(run);
  formats::Input input(arguments.particles, /*binary=*/false);
  const Particles particles = run.timed("read", [&] {
    return formats::read_particles(input.read_all(run.context().max_memory), input.name(),
                                   formats::unit_in_mm(arguments.unit));
  });
  density::DensityOptions options;
  cli::VolumeOutput result = arguments.output;
  options.info = lattice(arguments, particles, run.context(), result.space);
  if (const auto& b = arguments.bbox; !b.empty())
    options.clip = Box3{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
  options.band = arguments.band;
  options.planned = [&](const density::DensityReport& plan) {
    run.say("at most " + count_text(plan.predicted_voxels) + " voxels in " +
            bytes_text(plan.predicted_bytes) + ", about " + count_text(plan.predicted_evaluations) +
            " evaluations");
  };
  density::DensityReport report;
  const volume::Grid grid = run.timed("density", [&] {
    return at(input.name(), [&] {
      return density::metaball_density(run.context(), particles, options, &report);
    });
  });
  if (grid.active_voxels() == 0)
    run.warn("no voxel centre lies inside a particle's support");
  cli::write(run, output, grid, result);

  cli::Stats& stats = run.stats();
  stats.set("particles", static_cast<std::uint64_t>(particles.size()));
  stats.set("particles_out_of_reach", report.particles_out_of_reach);
  stats.set("predicted_voxels", report.predicted_voxels);
  stats.set("predicted_bytes", report.predicted_bytes);
  stats.set("predicted_evaluations", report.predicted_evaluations);
  stats.set("leaves_skipped", report.leaves_skipped);
  stats.set("leaves_evaluated", report.leaves_evaluated);
  stats.set("leaves_stored", report.leaves);
  stats.set("voxel_evaluations", report.voxel_evaluations);
  cli::report_volume(run, grid);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program program("metaball2vol", "Turns particles into a volume of their density.");
  Arguments arguments;
  program
      .option("--voxel", arguments.voxel, "S", "edge of a voxel in mm, centres at multiples of S")
      .positive();
  program
      .option("--dim", arguments.dim, "N",
              "number of voxels along the longest side of the supports' box")
      .range(1, 1 << 30);
  program.option("--like", arguments.like, "VDB", "take the lattice of this volume");
  program
      .option("--bbox", arguments.bbox, "X0,Y0,Z0,X1,Y1,Z1", "only voxels inside this box, in mm")
      .count(6);
  program.option("--band", arguments.band, "ISO",
                 "keep only what mc-opt needs for the isosurface of ISO");
  program.option("--unit", arguments.unit, "UNIT", "unit of the particles: m, cm, mm")
      .one_of({"m", "cm", "mm"});
  cli::declare(program, arguments.output);
  program.operand("PARTICLES", arguments.particles, "file with lines x y z R [weight]");
  program.check([&] { check(arguments); });
  return program.run(argc, argv, [&](cli::Run& run) { work(run, arguments); });
}
