#include "tools/render/render_volume.h"

#include "formats/image/image_file.h"
#include "formats/volume/volume_plugin.h"
#include "raster/raster_cpu.h"
#include "texture/color_ramp.h"
#include "texture/surface_material.h"
#include "tools/render/render_legend.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace gewebe::cli {
namespace {

bool is_ramp_name(const std::string& word) {
  return std::ranges::find(texture::color_ramp_names(), word) != texture::color_ramp_names().end();
}

shading::VolumeAxis axis_of(const std::string& option, const std::string& word) {
  const std::vector<std::string> names{"x", "y", "z", "view"};
  const auto found = std::ranges::find(names, word);
  if (found == names.end())
    throw UsageError(option + ": '" + word + "' is no axis, expected x, y, z or view");
  return static_cast<shading::VolumeAxis>(found - names.begin());
}

double place_of(const std::string& word) {
  double place = 0;
  const char* const end = word.data() + word.size();
  const auto [stop, failure] = std::from_chars(word.data(), end, place);
  if (failure != std::errc() || stop != end || !std::isfinite(place))
    throw UsageError("--slice: '" + word + "' is no place, expected a number of mm");
  return place;
}

void refuse(bool wrong, const formats::Input& input, const std::string& what) {
  if (wrong)
    throw UsageError(input.name(), what);
}

} // namespace

texture::ColorRamp ramp_of(const std::string& word, const Context& context) {
  if (is_ramp_name(word))
    return texture::color_ramp_from_name(word);
  formats::Input input(word);
  const texture::Image image = formats::read_image(input, context);
  return at(input.name(), [&] { return texture::color_ramp_from_image(image); });
}

void declare_volume(Program& p, RenderArguments& a) {
  p.option("--slice", a.volume.slice, "AXIS=MM",
           "slice of a volume across x, y, z or view; default: in the middle")
      .such_as({"x", "y", "z", "view"});
  p.option("--maximum", a.volume.maximum, "AXIS",
           "greatest values of a volume along x, y, z or view (the default)")
      .such_as({"x", "y", "z", "view"});
  p.option("--translucent", a.volume.translucent, "AXIS",
           "emission and absorption of a volume along x, y, z or view")
      .such_as({"x", "y", "z", "view"});
  p.option("--extinction", a.volume.view.transfer.extinction, "K",
           "extinction per mm at the last colour; default: 8 over the longest side")
      .positive();
  p.option("--ramp", a.volume.ramp, "RAMP",
           "colours of values: viridis, cividis, gray, heat, rainbow, or an image")
      .such_as(texture::color_ramp_names());
  p.option("--range", a.volume.range, "A,B", "values of the first and last colour; default: all")
      .count(2);
}

void complete_volume(RenderArguments& a) {
  RenderVolume& v = a.volume;
  if (!v.slice.empty() && !v.maximum.empty())
    throw UsageError("--slice and --maximum, expected one of them");
  if (!v.translucent.empty() && !(v.slice.empty() && v.maximum.empty()))
    throw UsageError("--translucent with --slice or --maximum, expected one of them");
  if (v.view.transfer.extinction && v.translucent.empty())
    throw UsageError("--extinction without --translucent, expected both");
  if (!v.slice.empty()) {
    v.view.mode = shading::VolumeMode::slice;
    const std::size_t mid = v.slice.find('=');
    v.view.axis = axis_of("--slice", v.slice.substr(0, mid));
    if (mid != std::string::npos)
      v.view.place = place_of(v.slice.substr(mid + 1));
  } else if (!v.maximum.empty()) {
    v.view.axis = axis_of("--maximum", v.maximum);
  } else if (!v.translucent.empty()) {
    v.view.mode = shading::VolumeMode::translucent;
    v.view.axis = axis_of("--translucent", v.translucent);
  }
  if (!v.range.empty() && !(v.range[0] < v.range[1]))
    throw UsageError("--range: expected two values, the smaller one first");
  if (v.view.axis != shading::VolumeAxis::view &&
      (a.camera.eye || !a.view_words.view.empty() || a.camera.azimuth != 0 ||
       a.camera.elevation != 0))
    throw UsageError("--view, --orbit or --eye for an axis, expected the axis view");
}

void check_kind(const RenderArguments& a, const formats::Input& input, formats::Kind kind) {
  const RenderVolume& v = a.volume;
  const bool field = !a.reading.field.empty();
  if (kind != formats::Kind::vdb)
    return refuse(!v.slice.empty() || !v.maximum.empty() || !v.translucent.empty() ||
                      (!field && (!v.ramp.empty() || !v.range.empty())),
                  input,
                  field ? "--slice, --maximum or --translucent for no volume, expected none of them"
                        : "--slice, --maximum, --translucent, --ramp or --range for no volume, "
                          "expected none of "
                          "them (--ramp and --range with --field too)");
  refuse(field || a.look.field_material, input, "--field for a volume, expected --ramp alone");
  refuse(a.drawing.texcoords || a.drawing.sphere || !a.materials.empty(), input,
         "a texture for a volume, expected --ramp or none");
  refuse(a.look.style != "textured" || !a.film.compare.empty() || a.words.backend == "gl" ||
             a.picture.samples != 1,
         input, "--style, --compare, --backend gl or --msaa for a volume, expected none of them");
  refuse(a.look.light || a.view_words.shade || a.view_words.fill || a.words.plain, input,
         "a light, --shade, --fill or --plain for a volume, expected none");
  refuse(a.drawing.wet || a.drawing.occlusion > 0 || a.look.inside || a.look.endoscope, input,
         "--wet, --occlusion, --inside or --endoscope for a volume, which has no surface, expected "
         "none of them");
  refuse(a.look.crease.has_value(), input,
         "--crease for a volume, which has no edges, expected none");
  refuse(a.reading.clip.has_value(), input,
         "--clip for a volume, expected a tetrahedral mesh (mc-opt --tets makes one)");
  refuse(!a.reading.unit.empty() || !a.reading.object.empty() || a.reading.frame ||
             !a.film.frames.empty(),
         input, "--unit, --object or --frame for a volume, expected none of them");
}

namespace {

/// The colours of a translucent volume before a background.
texture::Image composed(const shading::VolumeView& view, const Vec3& background) {
  texture::Image image{view.width, view.height, 3, {}};
  image.values.reserve(view.colors.size());
  for (std::size_t n = 0; n < view.values.size(); ++n)
    for (std::size_t c = 0; c < 3; ++c)
      image.values.push_back(
          texture::stored(static_cast<double>(view.colors[3 * n + c]) +
                          static_cast<double>(view.values[n]) * background[static_cast<int>(c)]));
  return image;
}

} // namespace

texture::Image volume_picture(Run& run, const RenderArguments& a, formats::Input& input) {
  const Context& context = run.context();
  const texture::ColorRamp ramp = ramp_of(a.volume.ramp.empty() ? "gray" : a.volume.ramp, context);
  shading::VolumeViewOptions options = a.volume.view;
  const std::uint32_t finer = static_cast<std::uint32_t>(a.words.supersample.value_or(1));
  options.camera = a.camera;
  options.width = a.picture.width * finer;
  options.height = a.picture.height * finer;
  if (std::max(options.width, options.height) > raster::max_picture_side)
    throw UsageError("--size times --supersample: expected sides up to " +
                     std::to_string(raster::max_picture_side));
  const bool translucent = options.mode == shading::VolumeMode::translucent;
  if (translucent) {
    options.transfer.ramp = ramp;
    if (!a.volume.range.empty())
      options.transfer.range = {a.volume.range[0], a.volume.range[1]};
  }
  std::string bytes = run.timed("read", [&] { return input.read_all(context.max_memory); });
  const shading::VolumeView view = run.timed("draw", [&] {
    return formats::view_volume_bytes(std::move(bytes), input.name(), options, context);
  });
  double min = view.min, max = view.max;
  if (!a.volume.range.empty()) {
    min = a.volume.range[0];
    max = a.volume.range[1];
  } else if (!(min < max)) {
    run.warn(input.name() + ": all values are equal");
    max = min + 1;
  }
  texture::Image image = texture::shrunk(
      translucent ? composed(view, a.view_words.background.value_or(Vec3{}))
                  : texture::colored(view.values, view.width, view.height, min, max, ramp),
      finer);
  draw_volume_legend(image, a, ramp, {min, max}, 2 * view.half_width / image.width);
  const auto [low, high] = std::ranges::minmax_element(view.values);
  Stats& stats = run.stats();
  stats.set("range", std::vector<double>{min, max});
  if (translucent)
    stats.set("extinction", view.extinction);
  stats.set(translucent ? "left" : "seen",
            std::vector<double>{static_cast<double>(*low), static_cast<double>(*high)});
  stats.set("looks_at", view.camera.target);
  stats.set("looks_along", view.camera.back * -1.0);
  stats.set("width_mm", 2 * view.half_width);
  stats.set("height_mm", 2 * view.half_height);
  stats.set("width", std::uint64_t{image.width});
  stats.set("height", std::uint64_t{image.height});
  return image;
}

} // namespace gewebe::cli
