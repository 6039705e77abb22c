// What textures cost: an image by coordinates, by three projections, noise and veins, each as
// colours, as structure and as both, in millions of covered pixels a second, by our rasteriser and
// by the shader, with the error beside. 512 x 512 pixels, a torus of 10,000 triangles.
//
// Times are those of bench_render: OpenGL's of drawing, ours of the whole picture. Errors are
// against the formulas in double precision, rounded to 8 bits as a picture is, where the picture is
// continuous.
//
// Writes CSV to standard output.

#include "base/error.h"
#include "gl/gl_context.h"
#include "gl/gl_renderer.h"
#include "raster/raster_cpu.h"
#include "tests/bench/timing.h"
#include "tests/unit/render_oracle.h"
#include "tests/unit/render_scenes.h"

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr std::uint32_t side = 512;

struct Scene {
  std::string name;
  test::OracleScene oracle;
  texture::SurfaceMaterial material;
  shading::Drawing drawing;
  shading::Projection projection;
  test::OraclePicture picture;
  double covered = 0; ///< pixels
};

enum class Paint { none, image, triplanar, noise, veins };

Scene make_scene(const std::string& name, Paint base, Paint structure) {
  Scene scene;
  scene.name = name;
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = test::torus(100, 50, false);
  test::OracleScene& oracle = scene.oracle;
  oracle.mesh = surfaces[0].mesh;
  oracle.rest = texture::rest_mapping(shading::rest_box(surfaces), {});
  oracle.rest.triplanar = base == Paint::triplanar || structure == Paint::triplanar;
  oracle.color = {0.91, 0.62, 0.53}; // no halves of 1/255 where nothing else is
  oracle.offset = 0.01;
  oracle.per_pixel = true;
  const auto solid = [](Paint paint) -> std::optional<texture::SolidTexture> {
    if (paint == Paint::noise)
      return texture::solid_texture_from_text("noise:scale=5");
    if (paint == Paint::veins)
      return texture::solid_texture_from_text("veins:scale=10");
    return {};
  };
  oracle.solid_base = scene.material.solid_base = solid(base);
  oracle.solid_structure = scene.material.solid_structure = solid(structure);
  if (base == Paint::image || base == Paint::triplanar)
    oracle.base = test::spots(256, 256, 3);
  if (structure == Paint::image || structure == Paint::triplanar)
    oracle.structure = test::spots(256, 256, 1);
  if (oracle.base)
    scene.material.base = texture::texture_from(*oracle.base);
  if (oracle.structure)
    scene.material.structure = texture::texture_from(*oracle.structure);
  scene.material.rest = oracle.rest;
  scene.material.color = oracle.color;
  scene.material.background = {0, 0, 0};
  shading::CameraOptions view;
  view.view = "iso";
  const shading::Camera camera =
      shading::make_camera(view, shading::rest_box(surfaces), side, side);
  shading::DrawingOptions options;
  options.texcoords = base == Paint::image || structure == Paint::image;
  options.structure = structure == Paint::image;
  options.rest = texture::is_at_rest(scene.material);
  options.rest_normals = oracle.rest.triplanar || oracle.solid_structure;
  options.rest_light = options.rest && structure != Paint::none;
  options.per_pixel = true;
  options.light = oracle.light = shading::default_light(camera);
  options.offset = {oracle.offset, oracle.offset};
  options.camera = camera;
  scene.drawing = shading::make_drawing(surfaces, options, {});
  scene.projection = shading::make_projection(camera, scene.drawing.box, scene.drawing.origin,
                                              scene.drawing.scale);
  scene.picture = test::oracle_picture(oracle, camera, side, side);
  raster::RenderReport report;
  (void)raster::render_cpu(scene.drawing, scene.projection, scene.material, side, side, 1, {},
                           &report);
  scene.covered = static_cast<double>(report.covered);
  return scene;
}

/// Draws for a while, after one to warm up.
Times frame_times(const std::function<void()>& draw) {
  draw();
  std::vector<double> times;
  double sum = 0;
  for (int n = 0; n < 200 && (n < 5 || sum < 400); ++n) {
    times.push_back(milliseconds(draw));
    sum += times.back();
  }
  return times_of(std::move(times));
}

void report(const Scene& scene, const std::string& program, int threads, const Times& times,
            const texture::Image& image) {
  const double error = test::compare(image, scene.picture).rms_rounded;
  std::printf("%s,%s,%zu,%u,%d,%.3f,%.3f,%.3f,%.4g,RMS of 255,%.1f\n", scene.name.c_str(),
              program.c_str(), scene.drawing.triangles.size(), side, threads, times.median,
              times.fastest, times.slowest, error, scene.covered / 1000 / times.median);
  std::fflush(stdout);
}

void by_cpu(const Scene& scene, int threads) {
  const Context context = with_threads(threads);
  const auto draw = [&] {
    return raster::render_cpu(scene.drawing, scene.projection, scene.material, side, side, 1,
                              context);
  };
  const Times times = frame_times([&] { (void)draw(); });
  report(scene, "cpu", threads, times, draw());
}

void by_shader(gl::GlContext& gl, const Scene& scene) {
  gl::GlRenderer renderer(gl, scene.material, side, side, {});
  renderer.set_drawing(scene.drawing);
  const auto draw = [&] {
    renderer.draw(scene.projection, {});
    renderer.finish();
  };
  const Times times = frame_times(draw);
  report(scene, "shader", 0, times, renderer.read({}));
}

} // namespace

int main() {
  setenv("EGL_LOG_LEVEL", "fatal", 0);
  setenv("GALLIVM_PERF", "no_aos_sampling,no_filter_hacks", 0);
  std::optional<gl::GlContext> gl;
  try {
    gl.emplace();
  } catch (const Error& error) {
    std::fprintf(stderr, "bench_render_rest: %s\n", error.what());
  }
  std::puts("stage,program,triangles,size,threads,median_ms,fastest_ms,slowest_ms,error,measure,"
            "mpixel_per_s");
  struct Row {
    const char* name;
    Paint base, structure;
  };
  for (const Row& row : {Row{"none", Paint::none, Paint::none},
                         {"image", Paint::image, Paint::none},
                         {"image + relief", Paint::image, Paint::image},
                         {"triplanar", Paint::triplanar, Paint::none},
                         {"triplanar + relief", Paint::triplanar, Paint::triplanar},
                         {"noise", Paint::noise, Paint::none},
                         {"noise + relief", Paint::noise, Paint::noise},
                         {"veins", Paint::veins, Paint::none},
                         {"veins + relief of noise", Paint::veins, Paint::noise}}) {
    const Scene scene = make_scene(row.name, row.base, row.structure);
    by_cpu(scene, 1);
    by_cpu(scene, 0);
    if (gl)
      by_shader(*gl, scene);
  }
}
