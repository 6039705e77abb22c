#include "tools/mesh/material_volumes.h"

#include "base/error.h"
#include "formats/volume/volume_file.h"
#include "stuffing/materials.h"
#include "tools/volume/voxelize_labels.h"

#include <cstdint>
#include <string>
#include <utility>

namespace gewebe::cli {
namespace {

/// How many voxels away from a tetrahedron its label may be. The smooth surface of labels lies
/// within a voxel of them, a coarse cell's edge some more.
constexpr std::int32_t label_reach = 3;

/// The materials of a source in the other space.
stuffing::MaterialSource in_other_space(stuffing::MaterialSource source) {
  return [source = std::move(source)]() -> stuffing::MaterialAt {
    return [at = source()](const Vec3& place) { return at(other_space(place)); };
  };
}

} // namespace

MaterialVolumes::MaterialVolumes(const MeshArguments& arguments) {
  const std::vector<std::string> paths = material_paths(arguments);
  for (const std::string& path : paths) {
    formats::Input& input = inputs.emplace_back(path);
    is_labels = formats::is_label_volume(input.peek(4096));
    if (is_labels && paths.size() > 1)
      throw Error(input.name(), "is a label volume, expected it alone in --materials");
    if (!is_labels && !arguments.labels.empty())
      throw Error(input.name(), "is no label volume, expected one for --label");
  }
  if (!arguments.labels.empty())
    wanted = labels_from_text(arguments.labels, "whole numbers, or names");
}

void MaterialVolumes::read(cli::Run& run, Space space) {
  for (formats::Input& input : inputs) {
    Space own = Space::ras; // of labels, as they are read
    if (is_labels) {
      formats::AllLabels all = formats::read_all_labels(input, wanted, run.context());
      for (const std::string& warning : all.warnings)
        run.warn(warning);
      labels = std::move(all.voxels);
    } else {
      own = Space::unknown;
      volumes.push_back(formats::read_volume(input, run.context(), &own));
    }
    turned.push_back(spaces_differ(own, space));
  }
}

stuffing::MaterialSource MaterialVolumes::source(const volume::Grid& solid, double isovalue) const {
  if (inputs.empty())
    return {};
  if (is_labels)
    return at(inputs.front().name(), [&] {
      stuffing::MaterialSource tissue;
      if (wanted.empty()) {
        tissue = stuffing::inside_source(solid, isovalue);
        if (turned.front())
          tissue = in_other_space(std::move(tissue));
      }
      stuffing::MaterialSource source = stuffing::label_source(labels, label_reach, tissue);
      return turned.front() ? in_other_space(std::move(source)) : source;
    });
  std::vector<stuffing::MaterialSource> sources;
  for (std::size_t n = 0; n < volumes.size(); ++n)
    sources.push_back(at(inputs[n].name(), [&] {
      stuffing::MaterialSource source = stuffing::inside_source(volumes[n]);
      return turned[n] ? in_other_space(std::move(source)) : source;
    }));
  return [this, sources]() -> stuffing::MaterialAt {
    std::vector<stuffing::MaterialAt> inside;
    for (const stuffing::MaterialSource& source : sources)
      inside.push_back(source());
    return [this, inside](const Vec3& place) {
      std::int32_t material = 0;
      for (std::size_t n = 0; n < inside.size(); ++n)
        if (at(inputs[n].name(), [&] { return inside[n](place); }) != 0)
          material = static_cast<std::int32_t>(n + 1);
      return material;
    };
  };
}

} // namespace gewebe::cli
