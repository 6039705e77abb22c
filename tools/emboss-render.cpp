// emboss-render: mesh, tetrahedra, model, result or volume -> picture, page or glTF.

#include "base/digest.h"
#include "formats/image/film.h"
#include "formats/image/image_file.h"
#include "shading/occlusion.h"
#include "tools/cli/cli.h"
#include "tools/render/picture_sink.h"
#include "tools/render/render_arguments.h"
#include "tools/render/render_field.h"
#include "tools/render/render_legend.h"
#include "tools/render/render_materials.h"
#include "tools/render/render_page.h"
#include "tools/render/render_pictures.h"
#include "tools/render/render_volume.h"
#include "tools/render/solid_surface.h"
#include "tools/render/surface_file.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

using namespace gewebe;
namespace {

std::vector<shading::Surface> read(cli::Run& run, formats::Input& input,
                                   const cli::SurfaceReadOptions& options, bool occluded) {
  cli::SolidReport solid;
  std::vector<shading::Surface> surfaces =
      cli::read_surfaces(input, options, run.context(), &solid);
  tell_solid(run, input.name(), options, solid);
  run.stats().set("surfaces", std::uint64_t{surfaces.size()});
  run.stats().set("triangles", shading::triangle_count(surfaces));
  if (shading::triangle_count(surfaces) == 0)
    run.warn(input.name() + ": no triangle to draw");
  at(input.name(), [&] {
    const double hidden =
        occluded ? shading::occlusion_bytes(static_cast<double>(shading::triangle_count(surfaces)))
                 : 0;
    require_memory(run.context(), shading::drawing_bytes(surfaces) + hidden,
                   "drawing the triangles");
  });
  return surfaces;
}

bool contains(const std::vector<formats::Kind>& kinds, formats::Kind kind) {
  return std::ranges::find(kinds, kind) != kinds.end();
}

/// Kinds of pictures, films and scenes.
std::vector<formats::Kind> output_kinds() {
  std::vector<formats::Kind> kinds = formats::picture_kinds();
  kinds.insert(kinds.end(), formats::film_kinds().begin(), formats::film_kinds().end());
  kinds.insert(kinds.end(), cli::scene_kinds().begin(), cli::scene_kinds().end());
  return kinds;
}

/// The frames to draw: of a result, or one shape from all sides.
std::vector<std::int64_t> drawn_frames(const cli::RenderArguments& a, const formats::Input& input) {
  if (!a.film.frames.empty()) {
    if (a.reading.kind != formats::Kind::hdf5)
      throw UsageError(input.name(), "--frames for no result of a run, expected --frames absent");
    return cli::result_frames(input, a.film.frames);
  }
  std::vector<std::int64_t> frames;
  const std::int64_t count = std::max(a.film.turn.value_or(1), a.film.turn_light.value_or(1));
  for (std::int64_t n = 0; n < count; ++n)
    frames.push_back(n);
  return frames;
}

void draw(cli::Run& run, cli::RenderArguments& a, formats::Input& input, cli::PictureSink& sink) {
  const std::vector<std::int64_t> frames = drawn_frames(a, input);
  if (a.reading.kind == formats::Kind::hdf5)
    take_field(run, a, input,
               a.film.frames.empty() ? std::vector{a.reading.frame.value_or(-1)} : frames);
  sink.expect(frames.size());
  cli::Pictures pictures(run, a);
  cli::SurfaceLegends legends(a, input);
  Digest digest;
  texture::Image picture;
  std::vector<shading::Surface> surfaces;
  for (const std::int64_t frame : frames) {
    if (!a.film.frames.empty())
      a.reading.frame = frame;
    if (!a.film.frames.empty() || surfaces.empty())
      surfaces =
          run.timed("read", [&] { return read(run, input, a.reading, a.drawing.occlusion > 0); });
    picture = pictures.of(surfaces);
    const std::int64_t shown = a.film.frames.empty() ? a.reading.frame.value_or(-1) : frame;
    const bool same = legends.draw(picture, pictures.camera(), shown) && pictures.kept();
    digest.add(picture.values);
    run.timed("write", [&] { sink.put(picture, same, frame); });
  }
  run.timed("write", [&] { sink.commit(); });
  pictures.tell(run.stats(), picture);
  run.stats().set("digest", digest.hex());
}

void work(cli::Run& run, cli::RenderArguments a) {
  const formats::Kind to =
      formats::output_kind(run.to(), run.output(), formats::Kind::png, output_kinds());
  const bool film = contains(formats::film_kinds(), to), scene = contains(cli::scene_kinds(), to);
  if (a.film.rate && !film)
    throw UsageError("--fps for " + std::string(formats::kind_name(to)) + ", expected mp4 or webm");
  const bool sequence = !a.film.frames.empty() || a.film.turn || a.film.turn_light;
  const bool many = sequence && !film && run.output().find('%') != std::string::npos;
  std::optional<cli::PictureSink> sink;
  if (!scene)
    sink.emplace(run, to, many, a.film.rate.value_or(25));
  formats::Input input(a.surface);
  a.reading.kind = formats::input_kind(input.peek(4096), a.surface, run.format());
  check_kind(a, input, a.reading.kind);
  cli::take_instruments(a, input);
  if (scene)
    return cli::write_scene(run, a, input, to);
  if (a.reading.kind != formats::Kind::vdb)
    return draw(run, a, input, *sink);
  const texture::Image picture = cli::volume_picture(run, a, input);
  run.timed("write", [&] {
    sink->put(picture, false, 0);
    sink->commit();
  });
  run.stats().set("digest", texture::image_digest(picture));
}

} // namespace

int main(int argc, char** argv) {
  // Mesa reads these when EGL starts: no talk, and textures filtered in floats instead of 8 bits.
  (void)::setenv("EGL_LOG_LEVEL", "fatal", 0);
  (void)::setenv("GALLIVM_PERF", "no_aos_sampling,no_filter_hacks", 0);
  cli::Program p(
      "emboss-render",
      "Draws a mesh, tetrahedra, a model or a result with embossed textures, or a volume.");
  cli::RenderArguments a;
  declare(p, a);
  p.output_kinds(output_kinds());
  std::vector<formats::Kind> kinds = cli::readable_surface_kinds();
  kinds.push_back(formats::Kind::vdb);
  p.input_kinds(kinds);
  p.operand("SURFACE", a.surface, "mesh, tetrahedra, model, result or volume");
  return p.run(argc, argv, [&](cli::Run& run) { work(run, a); });
}
