// emboss-render: mesh, model or result -> picture.

#include "formats/image_file.h"
#include "formats/surface_file.h"
#include "render/picture.h"
#include "render/uv.h"
#include "tools/cli.h"
#include "tools/render_arguments.h"

#include <cstdlib>

using namespace gewebe;
namespace {

std::vector<Surface> read(cli::Run& run, SurfaceReadOptions options, const std::string& path) {
  Input input(path);
  options.kind = input_kind(input.peek(4096), path, run.format());
  std::vector<Surface> surfaces = read_surfaces(input, options, run.context());
  run.stats().set("surfaces", std::uint64_t{surfaces.size()});
  run.stats().set("triangles", triangle_count(surfaces));
  if (triangle_count(surfaces) == 0)
    run.warn(input.name() + ": no triangle to draw");
  at(input.name(),
     [&] { require_memory(run.context(), drawing_bytes(surfaces), "drawing the triangles"); });
  return surfaces;
}

/// The look with its textures; one that was not asked for is not read.
Look look_of(const cli::Run& run, const cli::RenderArguments& a) {
  Look look = a.look;
  const auto load = [&](const std::string& path) {
    Input input(path);
    return read_image(input, run.context());
  };
  if (!a.base.empty())
    look.base = texture_from(load(a.base));
  if (!a.structure.empty())
    look.structure = texture_from(luminance(load(a.structure)));
  return look;
}

void tell(cli::Stats& stats, const PictureReport& told, const Image& picture) {
  stats.set("backend", backend_names()[static_cast<std::size_t>(told.backend)]);
  if (told.backend == Backend::gl) {
    stats.set("platform", told.platform);
    stats.set("renderer", told.renderer);
    stats.set("target", told.target);
  }
  stats.set("passes", told.passes);
  stats.set("triangles_drawn", told.triangles);
  stats.set("samples_covered", told.covered);
  stats.set("width", std::uint64_t{picture.width});
  stats.set("height", std::uint64_t{picture.height});
  stats.set("digest", image_digest(picture));
}

void work(cli::Run& run, const cli::RenderArguments& a) {
  const Kind to = output_kind(run.to(), run.output(), Kind::png, picture_kinds());
  Output output(run.output(), run.output_options(true));
  std::vector<Surface> surfaces =
      run.timed("read", [&] { return read(run, a.reading, a.surface); });
  const Look look = run.timed("textures", [&] { return look_of(run, a); });
  const Camera camera =
      make_camera(a.camera, rest_box(surfaces), a.picture.width, a.picture.height);
  DrawingOptions options = a.drawing;
  options.light = a.light.value_or(default_light(camera));
  const Drawing drawing = run.timed("prepare", [&] {
    if (options.texcoords)
      run.stats().set("surfaces_mapped", add_texcoords(surfaces, a.mapping, run.context()));
    return make_drawing(surfaces, options, run.context());
  });
  PictureReport told;
  const Image picture = run.timed(
      "draw", [&] { return make_picture(drawing, camera, look, a.picture, run.context(), &told); });
  if (!told.gl_failure.empty())
    run.warn(told.gl_failure + "; drawn without OpenGL (--backend cpu)");
  run.timed("write", [&] { write_image(output, picture, to); });
  output.commit();
  run.stats().set("eye", camera.eye);
  run.stats().set("looks_at", camera.target);
  run.stats().set("light", options.light);
  tell(run.stats(), told, picture);
}

} // namespace

int main(int argc, char** argv) {
  // Mesa reads these when EGL starts: no talk, and textures filtered in floats instead of 8 bits.
  (void)::setenv("EGL_LOG_LEVEL", "fatal", 0);
  (void)::setenv("GALLIVM_PERF", "no_aos_sampling", 0);
  cli::Program p("emboss-render", "Draws a mesh, a model or a result with embossed textures.");
  cli::RenderArguments a;
  declare(p, a);
  p.output_kinds(picture_kinds());
  p.input_kinds(readable_surface_kinds());
  p.operand("SURFACE", a.surface, "the mesh, model or result of a run");
  return p.run(argc, argv, [&](cli::Run& run) { work(run, a); });
}
