#include "tools/render/render_field.h"

#include "formats/results/results.h"
#include "tools/render/render_volume.h"
#include "tools/render/result_surfaces.h"

#include <array>
#include <vector>

namespace gewebe::cli {

void declare_field(Program& p, RenderArguments& a) {
  p.option("--field", a.reading.field, "NAME", "of a result: colours by a value at its nodes")
      .one_of(result_field_names());
}

void complete_field(RenderArguments& a) {
  if (a.reading.field.empty())
    return;
  for (const auto* const path :
       {&a.base.path, &a.detail.path, &a.reflection.path, &a.structure.path})
    if (!path->empty() || !a.materials.empty())
      throw UsageError("--field with a texture or colours of materials, expected one of them");
  if (a.style == "wireframe" || a.words.color)
    throw UsageError("--field with --style wireframe or --color, which have colours of their own, "
                     "expected one of them");
  a.drawing.texcoords = true;
}

void take_field(Run& run, RenderArguments& a, const Input& input,
                const std::vector<std::int64_t>& frames) {
  if (a.reading.field.empty())
    return;
  a.common.base =
      ramp_texture(ramp_of(a.volume.ramp.empty() ? "rainbow" : a.volume.ramp, run.context()));
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
