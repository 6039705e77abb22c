// Frames per second of the ways to draw an embossed surface over the number of its triangles, and
// the error of each (figure 3-9 of the report): the three algorithms and the shader on OpenGL, our
// rasteriser. 512 x 512 pixels, a torus with base and structure, the camera moves, textures and
// geometry stay.
//
// OpenGL's times are those of drawing (until glFinish), not of reading the picture; ours are those
// of the whole picture in memory. Where OpenGL is llvmpipe it runs twice: as it is, and filtering
// in floats as emboss-render has it ("exact"), with 8-bit and with float targets. Errors are
// against the formula in double precision, rounded to 8 bits as a picture is.
//
// Writes CSV to standard output. Stage "scaling" holds frames/s over triangles for the figure.

#include "base/error.h"
#include "gl/gl_context.h"
#include "gl/gl_renderer.h"
#include "raster/raster_cpu.h"
#include "tests/bench/timing.h"
#include "tests/unit/render_oracle.h"
#include "tests/unit/render_scenes.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

constexpr std::uint32_t side = 512;
constexpr int views = 16;

struct Scene {
  std::size_t triangles = 0;
  test::OracleScene oracle;
  texture::SurfaceMaterial material;
  std::vector<shading::Camera> cameras;
  std::vector<shading::Projection> projections;
  std::map<bool, shading::Drawing> drawings;    ///< with frames, without
  std::map<bool, test::OraclePicture> pictures; ///< of the first camera
};

Scene make_scene(std::size_t wanted, bool with_oracle) {
  Scene scene;
  const auto across =
      static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(wanted) / 4)));
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = test::torus(2 * across, across, false);
  scene.triangles = surfaces[0].mesh.triangles.size();
  scene.oracle.mesh = surfaces[0].mesh;
  scene.oracle.base = test::spots(256, 256, 3);
  scene.oracle.structure = test::spots(256, 256, 1);
  scene.oracle.offset = 0.01;
  scene.material.base = texture::texture_from(*scene.oracle.base);
  scene.material.structure = texture::texture_from(*scene.oracle.structure);
  scene.material.background = {0, 0, 0};
  shading::CameraOptions view;
  view.view = "iso";
  for (int n = 0; n < views; ++n) {
    view.azimuth = 360.0 * n / views;
    scene.cameras.push_back(shading::make_camera(view, shading::rest_box(surfaces), side, side));
  }
  shading::DrawingOptions options;
  options.texcoords = options.structure = true;
  options.light = scene.oracle.light = shading::default_light(scene.cameras[0]);
  options.offset = {scene.oracle.offset, scene.oracle.offset};
  for (const bool per_pixel : {true, false}) {
    options.per_pixel = scene.oracle.per_pixel = per_pixel;
    scene.drawings[per_pixel] = shading::make_drawing(surfaces, options, {});
    if (with_oracle)
      scene.pictures[per_pixel] = test::oracle_picture(scene.oracle, scene.cameras[0], side, side);
  }
  const shading::Drawing& drawing = scene.drawings[false];
  for (const shading::Camera& camera : scene.cameras)
    scene.projections.push_back(
        shading::make_projection(camera, drawing.box, drawing.origin, drawing.scale));
  return scene;
}

/// Draws frames for a while, after one to warm up.
Times frame_times(const std::function<void(int)>& draw) {
  draw(0);
  std::vector<double> times;
  double sum = 0;
  for (int n = 0; n < 200 && (n < 5 || sum < 600); ++n) {
    times.push_back(milliseconds([&] { draw(n % views); }));
    sum += times.back();
  }
  return times_of(std::move(times));
}

void report(const Scene& scene, const std::string& program, int threads, const Times& times,
            const texture::Image& first, bool per_pixel) {
  const double error = test::compare(first, scene.pictures.at(per_pixel)).rms_rounded;
  for (const bool scaling : {true, false}) {
    std::printf(
        "%s,%s,%zu,%u,%d,%.3f,%.3f,%.3f,%.4g,%s\n",
        scaling ? "scaling" : ("render " + std::to_string(scene.triangles) + " triangles").c_str(),
        program.c_str(), scene.triangles, side, threads, times.median, times.fastest, times.slowest,
        scaling ? 1000 / times.median : error, scaling ? "frames per second" : "RMS of 255");
  }
  std::fflush(stdout);
}

void by_cpu(const Scene& scene, int threads) {
  for (const bool per_pixel : {true, false}) {
    const Context context = with_threads(threads);
    const shading::Drawing& drawing = scene.drawings.at(per_pixel);
    const auto draw = [&](int n) {
      return raster::render_cpu(drawing, scene.projections[static_cast<std::size_t>(n)],
                                scene.material, side, side, 1, context);
    };
    const Times times = frame_times([&](int n) { (void)draw(n); });
    report(scene, per_pixel ? "cpu" : "cpu by vertex", threads, times, draw(0), per_pixel);
  }
}

void by_gl(const Scene& scene, const std::string& suffix) {
  gl::GlContext gl;
  for (const gl::GlMode mode :
       {gl::GlMode::passes3, gl::GlMode::passes2, gl::GlMode::passes1, gl::GlMode::shader})
    for (const bool wide : {false, true}) {
      gl::GlOptions options;
      options.mode = mode;
      options.wide = wide;
      const bool per_pixel = mode == gl::GlMode::shader;
      gl::GlRenderer renderer(gl, scene.material, side, side, options);
      renderer.set_drawing(scene.drawings.at(per_pixel));
      const auto draw = [&](int n) {
        renderer.draw(scene.projections[static_cast<std::size_t>(n)], {});
        renderer.finish();
      };
      const Times times = frame_times(draw);
      draw(0);
      const std::string name =
          per_pixel ? "shader" : "passes " + gl::gl_mode_names()[static_cast<std::size_t>(mode)];
      report(scene, name + (wide ? " float" : " 8bit") + suffix, 0, times, renderer.read({}),
             per_pixel);
    }
}

/// OpenGL in a process of its own, since its driver reads the environment once.
void in_child(const Scene& scene, const char* settings, const std::string& suffix) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    if (settings != nullptr)
      setenv("GALLIVM_PERF", settings, 1);
    try {
      by_gl(scene, suffix);
    } catch (const Error& error) {
      std::fprintf(stderr, "bench_render: %s\n", error.what());
    }
    std::fflush(stdout);
    _exit(0);
  }
  waitpid(child, nullptr, 0);
}

} // namespace

/// Usage: bench_render [LARGEST], of the numbers of triangles 1000, 10000, … 1000000.
int main(int argc, char** argv) {
  setenv("EGL_LOG_LEVEL", "fatal", 0);
  const double largest = argc > 1 ? std::strtod(argv[1], nullptr) : 1e6;
  std::puts("stage,program,triangles,size,threads,median_ms,fastest_ms,slowest_ms,error,measure");
  for (std::size_t triangles = 1000; static_cast<double>(triangles) <= largest; triangles *= 10) {
    // One thread here until the children are forked; oracles are drawn in a child's place too.
    const Scene scene = make_scene(triangles, true);
    in_child(scene, nullptr, "");
    in_child(scene, "no_aos_sampling,no_filter_hacks", " exact");
    by_cpu(scene, 1);
    by_cpu(scene, 0);
  }
}
