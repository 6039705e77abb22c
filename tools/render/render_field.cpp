#include "tools/render/render_field.h"

#include "formats/results/results.h"
#include "tools/render/render_volume.h"
#include "tools/render/result_surfaces.h"

#include <array>
#include <string>
#include <vector>

namespace gewebe::cli {

void declare_field(Program& p, RenderArguments& a) {
  std::vector<std::string> names = formats::result_field_names();
  names.emplace_back("material");
  p.option("--field", a.reading.field, "NAME",
           "colour by material; of results by displacement or von-mises")
      .one_of(names);
}

void complete_field(RenderArguments& a) {
  if (a.reading.field.empty())
    return;
  for (const auto* const path : {&a.layers.base.path, &a.layers.detail.path,
                                 &a.layers.reflection.path, &a.layers.structure.path})
    if (!path->empty() || !a.materials.empty())
      throw UsageError("--field with a texture or colours of materials, expected one of them");
  if (a.look.style == "wireframe" || a.view_words.color)
    throw UsageError("--field with --style wireframe or --color, which have colours of their own, "
                     "expected one of them");
  if (a.reading.field != "material") {
    a.drawing.texcoords = true;
    return;
  }
  if (a.words.plain || !a.volume.ramp.empty() || !a.volume.range.empty())
    throw UsageError("--field material with --plain, --ramp or --range, expected none of them");
  a.look.field_material = true; // what is drawn without textures
  a.reading.field.clear();
}

void take_field(Run& run, RenderArguments& a, const formats::Input& input,
                const std::vector<std::int64_t>& frames) {
  if (a.reading.field.empty())
    return;
  a.ramp = ramp_of(a.volume.ramp.empty() ? "viridis" : a.volume.ramp, run.context());
  a.common.base = ramp_texture(a.ramp);
  std::array<double, 2> range{};
  if (a.volume.range.empty()) {
    range = run.timed("read", [&] { return result_field_range(input, a.reading, frames); });
    if (!(range[0] < range[1])) {
      run.warn(input.name() + ": all values of " + a.reading.field + " are equal");
      range[1] = range[0] + 1;
    }
  } else {
    range = {a.volume.range[0], a.volume.range[1]};
  }
  a.reading.field_range = range;
  run.stats().set("range", std::vector<double>{range[0], range[1]});
}

} // namespace gewebe::cli
