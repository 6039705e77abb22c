// emboss-render: mesh, tetrahedra, model, result or volume -> picture.

#include "base/digest.h"
#include "formats/image/image_file.h"
#include "shading/occlusion.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"
#include "tools/render/render_field.h"
#include "tools/render/render_materials.h"
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

std::vector<Surface> read(cli::Run& run, Input& input, const SurfaceReadOptions& options,
                          bool occluded) {
  SolidReport solid;
  std::vector<Surface> surfaces = read_surfaces(input, options, run.context(), &solid);
  tell_solid(run, input.name(), options, solid);
  run.stats().set("surfaces", std::uint64_t{surfaces.size()});
  run.stats().set("triangles", triangle_count(surfaces));
  if (triangle_count(surfaces) == 0)
    run.warn(input.name() + ": no triangle to draw");
  at(input.name(), [&] {
    const double hidden =
        occluded ? occlusion_bytes(static_cast<double>(triangle_count(surfaces))) : 0;
    require_memory(run.context(), drawing_bytes(surfaces) + hidden, "drawing the triangles");
  });
  return surfaces;
}

/// PATTERN with its "%d" or "%04d" replaced; "%%" is one "%".
std::string numbered(const std::string& pattern, std::int64_t n) {
  std::string name;
  bool used = false;
  for (std::size_t at = 0; at < pattern.size(); ++at) {
    if (pattern[at] != '%') {
      name += pattern[at];
      continue;
    }
    const std::size_t end = pattern.find_first_not_of("0123456789", at + 1);
    if (end != std::string::npos && pattern[end] == 'd' && end - at <= 3 && !used) {
      const std::string digits = std::to_string(n);
      const std::size_t width =
          end == at + 1 ? 0 : std::stoul(pattern.substr(at + 1, end - at - 1));
      name += std::string(width > digits.size() ? width - digits.size() : 0, '0') + digits;
      used = true;
    } else if (end == at + 1 && pattern[end] == '%') {
      name += '%';
    } else {
      throw UsageError("-o: '" + pattern +
                       "', expected one %d or %04d for the number of the frame");
    }
    at = end;
  }
  return name;
}

void work(cli::Run& run, cli::RenderArguments a) {
  const Kind to = output_kind(run.to(), run.output(), Kind::png, picture_kinds());
  const bool sequence = !a.frames.empty() || a.turn || a.turn_light;
  const bool many = sequence && run.output().find('%') != std::string::npos;
  std::optional<Output> one;
  if (!many)
    one.emplace(run.output(), run.output_options(true));
  Input input(a.surface);
  SurfaceReadOptions& reading = a.reading;
  reading.kind = input_kind(input.peek(4096), a.surface, run.format());
  check_kind(a, input, reading.kind);
  cli::take_instruments(a, input);
  if (reading.kind == Kind::vdb) {
    const Image picture = cli::volume_picture(run, a, input);
    run.timed("write", [&] { write_image(*one, picture, to); });
    one->commit();
    return run.stats().set("digest", image_digest(picture));
  }
  std::vector<std::int64_t> frames;
  if (!a.frames.empty()) {
    if (reading.kind != Kind::hdf5)
      throw UsageError(input.name(), "--frames for no result of a run, expected --frames absent");
    frames = result_frames(input, a.frames);
  } else { // one shape from all sides
    const std::int64_t count = std::max(a.turn.value_or(1), a.turn_light.value_or(1));
    for (std::int64_t n = 0; n < count; ++n)
      frames.push_back(n);
  }
  if (reading.kind == Kind::hdf5)
    take_field(run, a, input, a.frames.empty() ? std::vector{reading.frame.value_or(-1)} : frames);
  if (frames.size() > 1 && !many && run.output() != "-" && to == Kind::png)
    throw UsageError(run.output() + ": " + std::to_string(frames.size()) +
                     " pictures for one file, expected %d or %04d in its name, --to rgb, or "
                     "-o - for a stream");
  cli::Pictures pictures(run, a);
  Digest digest;
  Image picture;
  std::vector<Surface> surfaces;
  std::string bytes;
  for (const std::int64_t frame : frames) {
    if (!a.frames.empty())
      reading.frame = frame;
    if (!a.frames.empty() || surfaces.empty())
      surfaces =
          run.timed("read", [&] { return read(run, input, reading, a.drawing.occlusion > 0); });
    picture = pictures.of(surfaces);
    digest.add(picture.values);
    run.timed("write", [&] {
      if (to != Kind::rgb && !pictures.kept())
        bytes = image_bytes(picture, to);
      const auto put = [&](Output& output) {
        return to == Kind::rgb ? write_image(output, picture, to) : output.write(bytes);
      };
      if (!many)
        return put(*one);
      Output output(numbered(run.output(), frame), run.output_options(true));
      put(output);
      output.commit();
    });
  }
  if (one)
    one->commit();
  pictures.tell(run.stats(), picture);
  run.stats().set("digest", digest.hex());
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
  p.output_kinds(picture_kinds());
  std::vector<Kind> kinds = readable_surface_kinds();
  kinds.push_back(Kind::vdb);
  p.input_kinds(kinds);
  p.operand("SURFACE", a.surface, "mesh, tetrahedra, model, result or volume");
  return p.run(argc, argv, [&](cli::Run& run) { work(run, a); });
}
