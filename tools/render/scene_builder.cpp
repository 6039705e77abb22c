#include "tools/render/scene_builder.h"

#include "formats/results/results.h"
#include "texture/tissue_color.h"
#include "tools/render/render_volume.h"
#include "tools/render/result_surfaces.h"
#include "tools/render/solid_surface.h"
#include "tools/render/surface_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace gewebe::cli {
namespace {

constexpr Vec3 steel{0.75, 0.77, 0.8};

/// Colours of the materials of a surface.
class PartColors {
public:
  PartColors(const RenderArguments& a, const shading::Surface& surface)
      : arguments_(a), surface_(surface),
        tissue_(texture::tissue_colors(surface.mesh, surface.materials)) {}
  Vec3 of(std::int32_t material) const {
    if (surface_.instrument)
      return arguments_.look.instrument_color.value_or(steel);
    if (const auto own = arguments_.materials.find(material);
        own != arguments_.materials.end() && own->second.color)
      return *own->second.color;
    if (arguments_.view_words.color)
      return *arguments_.view_words.color;
    if (const auto found = tissue_.find(material); found != tissue_.end())
      return found->second;
    const auto number = static_cast<std::size_t>(material);
    return texture::tissue_color(
        number < surface_.materials.size() ? surface_.materials[number] : "", number);
  }

private:
  const RenderArguments& arguments_;
  const shading::Surface& surface_;
  std::map<std::int32_t, Vec3> tissue_;
};

/// A new part with the triangles of the surface, sorted by material.
formats::ShownPart part_of(const std::string& name, const shading::Surface& surface,
                           std::size_t first, const RenderArguments& a) {
  formats::ShownPart part;
  part.name = name;
  part.instrument = surface.instrument;
  part.first = first;
  const TriangleMesh& mesh = surface.mesh;
  const PartColors colors(a, surface);
  std::vector<std::size_t> order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto material = [&](std::size_t t) { return mesh.material.empty() ? 0 : mesh.material[t]; };
  std::ranges::stable_sort(order, {}, material);
  for (std::size_t n = 0; n < order.size(); ++n) {
    if (n == 0 || material(order[n]) != material(order[n - 1]))
      part.paints.push_back({0, colors.of(material(order[n]))});
    ++part.paints.back().triangles;
    part.triangles.push_back(mesh.triangles[order[n]]);
  }
  part.rest = surface.rest.empty() ? mesh.points : surface.rest;
  return part;
}

/// Joins surfaces of one name into parts while their triangles stay.
class PartList {
public:
  PartList(const RenderArguments& arguments, formats::ShownScene& scene)
      : arguments_(arguments), scene_(scene) {}

  void add(const std::string& name, shading::Surface surface, std::vector<double> values,
           std::size_t frame) {
    const auto key = std::make_pair(surface.instrument, name);
    Open& open = open_[key];
    if (open.next != frame || open.triangles != surface.mesh.triangles ||
        open.material != surface.mesh.material || !same_rest(open, surface)) {
      open.part = scene_.parts.size();
      scene_.parts.push_back(part_of(name, surface, frame, arguments_));
      open.triangles = std::move(surface.mesh.triangles);
      open.material = std::move(surface.mesh.material);
    }
    formats::ShownPart& part = scene_.parts[open.part];
    part.points.push_back(std::move(surface.mesh.points));
    part.values.push_back(std::move(values));
    open.next = frame + 1;
  }

private:
  struct Open {
    std::size_t part = 0, next = SIZE_MAX; ///< next frame
    std::vector<Triangle> triangles;
    std::vector<std::int32_t> material;
  };
  bool same_rest(const Open& open, const shading::Surface& surface) const {
    return surface.rest.empty() || scene_.parts[open.part].rest == surface.rest;
  }
  const RenderArguments& arguments_;
  formats::ShownScene& scene_;
  std::map<std::pair<bool, std::string>, Open> open_;
};

formats::ShownCurve& curve_of(formats::ShownScene& scene, const std::string& name,
                              const std::string& unit) {
  for (formats::ShownCurve& curve : scene.curves)
    if (curve.name == name)
      return curve;
  scene.curves.push_back({name, unit, {}});
  scene.curves.back().values.resize(scene.times.size());
  return scene.curves.back();
}

/// Makes the field's ends include a value; the first one sets both.
void include(std::optional<formats::ShownField>& field, const formats::ShownField& fresh,
             double value) {
  if (!field) {
    field = fresh;
    field->least = field->greatest = value;
  }
  field->least = std::min(field->least, value);
  field->greatest = std::max(field->greatest, value);
}

void add_object(formats::ShownScene& scene, PartList& parts, const std::string& path,
                const std::string& object, std::size_t frame, std::size_t number) {
  formats::ResultSurface read = formats::read_result_surface(path, object, number);
  if (!read.there)
    return;
  std::vector<double> stress = formats::read_result_surface_stress(path, object, number);
  double farthest = 0;
  for (std::size_t i = 0; i < read.rest.size(); ++i) {
    const double length = norm(read.mesh.points[i] - read.rest[i]);
    farthest = std::max(farthest, length);
    include(scene.displacement, {"displacement", "mm"}, length);
  }
  curve_of(scene, object + ": greatest displacement", "mm").values[frame] = farthest;
  for (const double value : stress)
    include(scene.stored, {"von-mises", "Pa"}, value);
  if (!stress.empty())
    curve_of(scene, object + ": greatest von Mises stress", "Pa").values[frame] =
        *std::ranges::max_element(stress);
  parts.add(object, {std::move(read.mesh), std::move(read.rest), std::move(read.materials)},
            std::move(stress), frame);
}

void add_instrument(formats::ShownScene& scene, PartList& parts, formats::ResultInstrument of,
                    std::size_t ring, std::size_t frame) {
  const std::string name = of.name;
  const Vec3 force = of.force * 1e-6;
  const auto found = std::ranges::find(scene.instruments, name, &formats::ShownInstrument::name);
  formats::ShownInstrument& instrument =
      found != scene.instruments.end() ? *found : scene.instruments.emplace_back();
  instrument.name = name;
  instrument.place_and_force.resize(scene.times.size());
  instrument.place_and_force[frame] = {of.place, force};
  curve_of(scene, name + ": force", "N").values[frame] = norm(force);
  curve_of(scene, name + ": force along x", "N").values[frame] = force.x;
  curve_of(scene, name + ": force along y", "N").values[frame] = force.y;
  curve_of(scene, name + ": force along z", "N").values[frame] = force.z;
  curve_of(scene, name + ": torque", "N mm").values[frame] = norm(of.torque) * 1e-6;
  shading::Surface surface = instrument_surface(std::move(of), ring);
  if (!surface.mesh.triangles.empty())
    parts.add(name, std::move(surface), {}, frame);
}

void add_result(Run& run, const RenderArguments& a, const std::string& path,
                const std::vector<std::int64_t>& frames, formats::ShownScene& scene) {
  const formats::ResultIndex index = formats::read_result_index(path);
  const std::vector<std::string> objects =
      a.reading.object.empty() ? index.objects : std::vector<std::string>{a.reading.object};
  for (const std::int64_t frame : frames)
    scene.times.push_back(index.times[static_cast<std::size_t>(frame)]);
  PartList parts(a, scene);
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    const auto number = static_cast<std::size_t>(frames[frame]);
    for (const std::string& object : objects)
      add_object(scene, parts, path, object, frame, number);
    if (a.reading.ring > 0)
      for (formats::ResultInstrument& of : formats::read_result_instruments(path, number))
        add_instrument(scene, parts, std::move(of), a.reading.ring, frame);
    // What was read, its packed form, and what comes.
    const double share = static_cast<double>(frame + 1) / static_cast<double>(frames.size());
    at(path, [&] {
      require_memory(run.context(), 1.5 * formats::scene_bytes(scene) / share,
                     "the frames of the scene");
    });
  }
}

void add_surfaces(Run& run, const RenderArguments& a, formats::Input& input,
                  formats::ShownScene& scene) {
  scene.times = {0};
  SurfaceReadOptions reading = a.reading;
  reading.clip.reset();
  SolidReport solid;
  std::vector<shading::Surface> surfaces = read_surfaces(input, reading, run.context(), &solid);
  tell_solid(run, input.name(), reading, solid);
  PartList parts(a, scene);
  for (std::size_t n = 0; n < surfaces.size(); ++n)
    parts.add(surfaces.size() == 1 ? "surface" : "surface " + std::to_string(n),
              std::move(surfaces[n]), {}, 0);
}

} // namespace

formats::ShownScene build_scene(Run& run, const RenderArguments& a, formats::Input& input,
                                const std::vector<std::int64_t>& frames) {
  formats::ShownScene scene;
  const std::size_t slash = input.name().find_last_of('/');
  scene.title = input.name() == "-" ? "Gewebe" : input.name().substr(slash + 1);
  if (a.reading.kind == formats::Kind::hdf5)
    add_result(run, a, input.name(), frames, scene);
  else
    add_surfaces(run, a, input, scene);
  std::uint64_t triangles = 0;
  for (const formats::ShownPart& part : scene.parts) {
    triangles += part.triangles.size();
    if (!part.instrument)
      for (const Vec3& p : part.rest)
        scene.box.add(p);
  }
  if (triangles == 0)
    run.warn(input.name() + ": no triangle to draw");
  const texture::ColorRamp ramp =
      ramp_of(a.volume.ramp.empty() ? "viridis" : a.volume.ramp, run.context());
  for (int n = 0; n < 256; ++n) {
    const std::array<double, 3> color = texture::ramp_color(ramp, n / 255.0);
    scene.ramp.push_back({static_cast<std::uint8_t>(std::floor(color[0] + 0.5)),
                          static_cast<std::uint8_t>(std::floor(color[1] + 0.5)),
                          static_cast<std::uint8_t>(std::floor(color[2] + 0.5))});
  }
  run.stats().set("triangles", triangles);
  run.stats().set("parts", std::uint64_t{scene.parts.size()});
  run.stats().set("frames", std::uint64_t{scene.times.size()});
  return scene;
}

} // namespace gewebe::cli
