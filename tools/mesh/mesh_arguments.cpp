#include "tools/mesh/mesh_arguments.h"

#include "base/error.h"
#include "formats/mesh/mesh_file.h"
#include "formats/tetrahedra/tet_file.h"
#include "tools/cli/cli.h"
#include "tools/mesh/surface_choice.h"
#include "tools/volume/voxelize_labels.h"

#include <algorithm>

namespace gewebe::cli {

void check(const MeshArguments& arguments) {
  component_choice(arguments.components);
  box_of(arguments.box);
  if (!arguments.tets && arguments.cell)
    throw UsageError("--cell is for --tets, expected both (--resample gives a surface's spacing)");
  if (!arguments.tets && arguments.grade != 0)
    throw UsageError("--grade is for --tets, expected both");
  if (!arguments.tets && !arguments.materials.empty())
    throw UsageError("--materials is for --tets, expected both");
  if (!arguments.interface.empty() && arguments.materials.empty())
    throw UsageError("--interface is for --materials, expected both");
  if (!arguments.tets && !arguments.refine.empty())
    throw UsageError("--refine is for --tets, expected both");
  if (!arguments.refine.empty() && arguments.interface == "follow")
    throw UsageError("--refine: refined cells can't follow the interface between materials, "
                     "expected --interface stair");
  for (const tetrahedra::RefinedRegion& region : refined_regions(arguments))
    if (!region.materials.empty() && arguments.materials.empty())
      throw UsageError("--refine '" + region.text + "': label is for --materials, expected both");
  if (!arguments.labels.empty() && arguments.materials.empty())
    throw UsageError("--label is for --materials, expected both");
  if (!arguments.labels.empty())
    (void)labels_from_text(arguments.labels, "whole numbers, or names");
  const auto refuse = [&](bool given, const char* option) {
    if (arguments.tets && given)
      throw UsageError(std::string(option) + " is for surfaces, expected it without --tets");
  };
  refuse(arguments.epsilon.has_value(), "--epsilon");
  refuse(!arguments.place.empty(), "--place");
  refuse(arguments.rounds > 0, "--regularize");
  refuse(arguments.normals, "--normals");
  refuse(arguments.self_intersections, "--self-intersections");
  std::vector<std::string> inputs = material_paths(arguments);
  inputs.push_back(arguments.volume);
  cli::check_one_pipe(inputs);
}

std::vector<tetrahedra::RefinedRegion> refined_regions(const MeshArguments& arguments) {
  if (arguments.refine.empty())
    return {};
  try {
    return tetrahedra::parse_refinement(arguments.refine);
  } catch (const Error& error) {
    throw UsageError(std::string("--refine: ") + error.what());
  }
}

std::vector<std::string> material_paths(const MeshArguments& arguments) {
  const std::string& text = arguments.materials;
  std::vector<std::string> paths;
  for (std::size_t begin = 0; begin <= text.size() && !text.empty();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    paths.push_back(text.substr(begin, comma - begin));
    if (paths.back().empty())
      throw UsageError("--materials: '" + text + "', expected files between commas");
    begin = comma + 1;
  }
  return paths;
}

std::vector<formats::Kind> writable_kinds() {
  std::vector<formats::Kind> kinds = formats::writable_mesh_kinds();
  for (const formats::Kind kind : formats::writable_tet_kinds())
    if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
      kinds.push_back(kind);
  return kinds;
}

} // namespace gewebe::cli
