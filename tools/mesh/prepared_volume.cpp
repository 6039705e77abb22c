#include "tools/mesh/prepared_volume.h"

#include "formats/volume/volume_file.h"
#include "surface/marching_cubes.h"
#include "tools/cli/distrust.h"
#include "tools/cli/space_option.h"
#include "tools/mesh/surface_choice.h"
#include "volume/crop.h"
#include "volume/resample.h"

#include <optional>
#include <string>

namespace gewebe::cli {
namespace {

/// Topology of the requested surface on the volume as read.
mesh::Topology topology_of(const Context& context, const volume::Grid& grid,
                           const MeshArguments& arguments) {
  if (arguments.box.empty())
    return mesh::topology(surface::marching_cubes(context, grid, arguments.isovalue).mesh);
  const double isovalue = arguments.isovalue.value_or(surface::default_isovalue(grid.info()));
  const volume::Grid part = volume::crop(context, grid, box_of(arguments.box), isovalue);
  return mesh::topology(surface::marching_cubes(context, part, arguments.isovalue).mesh);
}

} // namespace

void bring_to_space(cli::Run& run, Space from, const MeshArguments& arguments,
                    std::vector<Vec3>& points, std::vector<std::array<float, 3>>* normals) {
  const Space to = result_space(from, arguments.space);
  if (to != Space::unknown)
    run.stats().set("space", std::string(space_name(to)));
  if (!spaces_differ(from, to))
    return;
  for (Vec3& p : points)
    p = other_space(p);
  if (normals != nullptr)
    for (std::array<float, 3>& n : *normals)
      n = {0 - n[0], 0 - n[1], n[2]};
  run.say("turned from " + std::string(space_name(from)) + " to " + std::string(space_name(to)));
}

void warn_of_components(cli::Run& run, std::uint64_t kept, std::uint64_t dropped) {
  run.say(std::to_string(dropped) + " components dropped, " + std::to_string(kept) + " kept");
  if (kept == 0 && dropped > 0)
    run.warn("no component is as large as --components requires");
}

PreparedVolume prepare(cli::Run& run, const MeshArguments& arguments, formats::Input& input) {
  const Context& context = run.context();
  PreparedVolume result;
  result.grid =
      run.timed("read", [&] { return formats::read_volume(input, context, &result.space); });
  result.isovalue = arguments.isovalue.value_or(surface::default_isovalue(result.grid.info()));
  at(input.name(), [&] {
    std::optional<volume::Grid> resampled; // first, since what it needs is refused before long work
    if (arguments.voxel)
      resampled = run.timed("resample", [&] {
        return volume::resample(context, result.grid, volume::uniform_transform(*arguments.voxel));
      });
    if (arguments.voxel || arguments.cell)
      result.before =
          run.timed("topology", [&] { return topology_of(context, result.grid, arguments); });
    if (resampled)
      result.grid = *std::move(resampled);
    if (!arguments.box.empty())
      result.grid = run.timed("crop", [&] {
        return volume::crop(context, result.grid, box_of(arguments.box), result.isovalue);
      });
  });
  return result;
}

void warn_if_empty(cli::Run& run, bool empty) {
  if (empty)
    cli::distrust(run, "mc-opt",
                  "the surface is empty: no value lies across the isovalue from another");
}

} // namespace gewebe::cli
