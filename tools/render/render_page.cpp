#include "tools/render/render_page.h"

#include "base/digest.h"
#include "formats/page/glb.h"
#include "formats/page/page.h"
#include "formats/results/results.h"
#include "shading/camera.h"
#include "tools/render/scene_builder.h"
#include "tools/render/surface_file.h"

#include <algorithm>
#include <string>
#include <vector>

namespace gewebe::cli {
namespace {

/// Options that neither pages nor glTF files can serve.
const std::vector<std::string>& picture_options() {
  static const std::vector<std::string> names{"--texture",
                                              "--detail",
                                              "--reflection",
                                              "--structure",
                                              "--by",
                                              "--offset",
                                              "--uv",
                                              "--offset-texels",
                                              "--uv-scale",
                                              "--uv-sharpness",
                                              "--sphere",
                                              "--filter",
                                              "--wrap",
                                              "--turn",
                                              "--turn-light",
                                              "--plain",
                                              "--size",
                                              "--supersample",
                                              "--msaa",
                                              "--style",
                                              "--crease",
                                              "--light",
                                              "--light-direction",
                                              "--shade",
                                              "--fill",
                                              "--occlusion",
                                              "--inside",
                                              "--occlusion-radius",
                                              "--wet-roughness",
                                              "--wet",
                                              "--slice",
                                              "--maximum",
                                              "--translucent",
                                              "--extinction",
                                              "--backend",
                                              "--passes",
                                              "--gl-target",
                                              "--rgb-scale",
                                              "--tbn",
                                              "--compare",
                                              "--legend"};
  return names;
}

/// Options of the view that a page begins with.
const std::vector<std::string>& view_options() {
  static const std::vector<std::string> names{"--view",       "--orbit",     "--distance", "--eye",
                                              "--target",     "--up",        "--fov",      "--clip",
                                              "--background", "--endoscope", "--reach"};
  return names;
}

void refuse_options(const RenderArguments& a, formats::Kind to) {
  for (const std::string& name : a.look_options) {
    const bool view = std::ranges::find(view_options(), name) != view_options().end();
    if (!view)
      throw UsageError(name + " for " + std::string(formats::kind_name(to)) +
                       ", which has no such look, expected a picture or no " + name);
    if (to == formats::Kind::glb)
      throw UsageError(name +
                       " for glb, whose viewers have views and lights of their own, "
                       "expected html, a picture or no " +
                       name);
  }
}

std::vector<std::int64_t> frames_of(const RenderArguments& a, const formats::Input& input) {
  if (a.reading.kind != formats::Kind::hdf5) {
    if (!a.film.frames.empty())
      throw UsageError(input.name(), "--frames for no result of a run, expected --frames absent");
    return {};
  }
  if (a.reading.frame)
    return result_frames(input, std::to_string(*a.reading.frame));
  return result_frames(input, a.film.frames.empty() ? "all" : a.film.frames);
}

/// The field that the command line names is there, and has its range.
void take_scene_field(Run& run, const RenderArguments& a, const formats::Input& input,
                      formats::ShownScene& scene) {
  if (a.reading.field.empty() && !a.volume.range.empty())
    throw UsageError("--range without --field, expected both");
  scene.view.field = a.reading.field;
  if (a.reading.field == "von-mises" && !scene.stored)
    throw Error(input.name(), "no drawn object has stress in a drawn frame, expected a scene with "
                              "'emit stress' before it");
  for (std::optional<formats::ShownField>* const field : {&scene.displacement, &scene.stored}) {
    if (!*field)
      continue;
    if ((*field)->name == a.reading.field && !a.volume.range.empty()) {
      (*field)->least = a.volume.range[0];
      (*field)->greatest = a.volume.range[1];
    }
    if (!((*field)->least < (*field)->greatest)) {
      if ((*field)->name == a.reading.field)
        run.warn(input.name() + ": all values of " + a.reading.field + " are equal");
      (*field)->greatest = (*field)->least + 1;
    }
    if ((*field)->name == a.reading.field)
      run.stats().set("range", std::vector<double>{(*field)->least, (*field)->greatest});
  }
}

void set_view(const RenderArguments& a, formats::ShownScene& scene) {
  constexpr std::uint32_t square = 512;
  const Box3 box = scene.box.empty() ? Box3{{0, 0, 0}, {1, 1, 1}} : scene.box;
  const shading::Camera camera = shading::make_camera(a.camera, box, square, square);
  formats::ShownView& view = scene.view;
  view.eye = camera.eye;
  view.target = camera.target;
  view.up = camera.up;
  view.fov = a.camera.fov;
  view.background = a.common.background;
  view.endoscope = a.look.endoscope;
  view.reach = a.look.reach;
  if (a.reading.clip)
    view.clip = {a.reading.clip->point, a.reading.clip->normal};
  scene.box = box;
}

std::string scene_digest(const formats::ShownScene& scene) {
  Digest digest;
  digest.add(scene.times);
  for (const formats::ShownPart& part : scene.parts) {
    digest.add(part.triangles);
    digest.add(part.rest);
    for (const formats::ShownPaint& paint : part.paints) {
      digest.add(std::uint64_t{paint.triangles});
      digest.add_bytes(&paint.color, sizeof paint.color);
    }
    for (const std::vector<Vec3>& points : part.points)
      digest.add(points);
    for (const std::vector<double>& values : part.values)
      digest.add(values);
  }
  for (const formats::ShownInstrument& instrument : scene.instruments)
    for (const auto& there : instrument.place_and_force)
      if (there)
        digest.add_bytes(&*there, sizeof *there);
  return digest.hex();
}

} // namespace

void note_look_options(const Program& program, RenderArguments& a) {
  for (const auto* const names : {&picture_options(), &view_options()})
    for (const std::string& name : *names)
      if (program.given(name))
        a.look_options.push_back(name);
}

const std::vector<formats::Kind>& scene_kinds() {
  static const std::vector<formats::Kind> kinds{formats::Kind::html, formats::Kind::glb};
  return kinds;
}

void write_scene(Run& run, const RenderArguments& a, formats::Input& input, formats::Kind to) {
  if (a.reading.kind == formats::Kind::vdb)
    throw UsageError(input.name(), "a volume for " + std::string(formats::kind_name(to)) +
                                       ", expected a surface (mc-opt makes one)");
  refuse_options(a, to);
  formats::Output output(run.output(), run.output_options(to != formats::Kind::html));
  const std::vector<std::int64_t> frames = frames_of(a, input);
  formats::ShownScene scene = run.timed("read", [&] { return build_scene(run, a, input, frames); });
  take_scene_field(run, a, input, scene);
  set_view(a, scene);
  const std::uint64_t size = run.timed("write", [&] {
    return to == formats::Kind::glb ? formats::write_glb(output, scene)
                                    : formats::write_page(output, scene);
  });
  output.commit();
  constexpr std::uint64_t large = 100'000'000;
  if (size > large)
    run.warn(run.output() + ": the file has " + std::to_string(size / 1'000'000) +
             " MB, which viewers open slowly; --frames 0:-1:N takes every Nth frame");
  run.stats().set("bytes", size);
  run.stats().set("digest", scene_digest(scene));
}

} // namespace gewebe::cli
