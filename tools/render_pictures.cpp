#include "tools/render_pictures.h"

#include "formats/image_file.h"
#include "render/style.h"

#include <algorithm>
#include <utility>

namespace gewebe::cli {
namespace {

Image load(const RenderLayer& layer, const Context& context) {
  Input input(layer.path);
  return read_image(input, context);
}

/// The look with its textures; one that was not asked for is not read.
Look look_of(const RenderArguments& a, const Context& context) {
  Look look = a.look;
  look.solid_base = a.base.solid;
  look.solid_detail = a.detail.solid;
  look.solid_structure = a.structure.solid;
  const auto is_file = [](const RenderLayer& layer) { return !layer.path.empty() && !layer.solid; };
  if (is_file(a.base))
    look.base = texture_from(load(a.base, context), a.base.options);
  if (is_file(a.detail))
    look.detail = texture_from(load(a.detail, context), a.detail.options);
  if (is_file(a.reflection))
    look.reflection = texture_from(load(a.reflection, context), a.reflection.options);
  if (is_file(a.structure))
    look.structure = texture_from(luminance(load(a.structure, context)), a.structure.options);
  return look;
}

std::vector<PictureOptions> options_of(const RenderArguments& a) {
  if (a.compare.empty())
    return {a.picture};
  std::vector<PictureOptions> all;
  for (const std::string& mode : a.compare) {
    PictureOptions options = a.picture;
    options.backend = mode == "cpu" ? Backend::cpu : Backend::gl;
    if (mode != "cpu")
      options.gl.mode = gl_mode_from_name(mode);
    if (mode != "cpu" && options.gl.mode != GlMode::shader)
      options.per_pixel.reset();
    all.push_back(options);
  }
  return all;
}

} // namespace

Pictures::Pictures(Run& run, const RenderArguments& arguments)
    : run_(run), arguments_(arguments),
      look_(run.timed("textures", [&] { return look_of(arguments, run.context()); })),
      options_(options_of(arguments)), drawing_(arguments.drawing) {}

void Pictures::start(const std::vector<Surface>& surfaces) {
  const RenderArguments& a = arguments_;
  camera_ = make_camera(a.camera, rest_box(surfaces), a.picture.width, a.picture.height);
  drawing_.camera = *camera_;
  drawing_.light = a.light.value_or(default_light(*camera_));
  drawing_.offset = {a.offset, a.offset};
  if (a.offset_texels && look_.structure)
    drawing_.offset = {*a.offset_texels / look_.structure->width(),
                       *a.offset_texels / look_.structure->height()};
  if (drawing_.rest)
    place_at_rest(look_, rest_box(surfaces), a.mapping.edge);
  run_.timed("start", [&] {
    for (const PictureOptions& options : options_)
      modes_.push_back({std::make_unique<Painter>(look_, options, run_.context()), {}});
  });
}

std::vector<Surface> Pictures::styled(std::vector<Surface> surfaces) const {
  for (Surface& surface : surfaces) {
    if (arguments_.style == "flat")
      surface = faceted(surface);
    if (arguments_.style == "wireframe")
      surface = wireframe(surface, *camera_, 1.25, arguments_.picture.height);
  }
  return surfaces;
}

Image Pictures::of(std::vector<Surface> surfaces) {
  if (!camera_)
    start(surfaces);
  ++pictures_;
  const bool same = pictures_ > 1 && drawn_points_.size() == surfaces.size() &&
                    std::equal(surfaces.begin(), surfaces.end(), drawn_points_.begin(),
                               [](const Surface& s, const std::vector<Vec3>& points) {
                                 return s.mesh.points == points;
                               });
  if (same) {
    ++kept_;
    return last_;
  }
  drawn_points_.clear();
  for (const Surface& surface : surfaces)
    drawn_points_.push_back(surface.mesh.points);
  surfaces = styled(std::move(surfaces));
  if (drawing_.texcoords)
    mapped_ = run_.timed(
        "prepare", [&] { return add_texcoords(surfaces, arguments_.mapping, run_.context()); });
  std::vector<Image> images;
  std::optional<Drawing> drawing;
  for (Mode& mode : modes_) {
    const bool per_pixel = mode.painter->per_pixel();
    if (!drawing || per_pixel != drawing_.per_pixel) {
      drawing_.per_pixel = per_pixel;
      drawing =
          run_.timed("prepare", [&] { return make_drawing(surfaces, drawing_, run_.context()); });
    }
    images.push_back(
        run_.timed("draw", [&] { return mode.painter->paint(*drawing, *camera_, &mode.report); }));
    if (pictures_ == 1 && !mode.report.gl_failure.empty())
      run_.warn(mode.report.gl_failure + "; drawn without OpenGL (--backend cpu)");
  }
  last_ = images.size() == 1 ? std::move(images.front()) : side_by_side(images);
  return last_;
}

void Pictures::tell(Stats& stats, const Image& last) const {
  if (drawing_.texcoords)
    stats.set("surfaces_mapped", mapped_);
  stats.set("eye", camera_->eye);
  stats.set("looks_at", camera_->target);
  stats.set("light", drawing_.light);
  stats.set("pictures", pictures_);
  stats.set("pictures_kept", kept_);
  const PictureReport& told = modes_.back().report;
  stats.set("backend", backend_names()[static_cast<std::size_t>(told.backend)]);
  if (told.backend == Backend::gl) {
    stats.set("platform", told.platform);
    stats.set("renderer", told.renderer);
    stats.set("target", told.target);
  }
  stats.set("passes", told.passes);
  stats.set("triangles_drawn", told.triangles);
  if (told.backend == Backend::cpu)
    stats.set("samples_covered", told.covered);
  stats.set("width", std::uint64_t{last.width});
  stats.set("height", std::uint64_t{last.height});
}

} // namespace gewebe::cli
