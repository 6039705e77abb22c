#include "tools/render/render_pictures.h"

#include "shading/angles.h"
#include "shading/endoscope.h"
#include "shading/style.h"
#include "tools/render/render_layer.h"
#include "tools/render/render_lighting.h"
#include "tools/render/render_materials.h"

#include <algorithm>
#include <array>
#include <utility>

namespace gewebe::cli {
namespace {

/// The material with its textures; textures that are not requested are not read.
texture::SurfaceMaterial material_of(const RenderArguments& a,
                                     const std::vector<shading::Surface>& surfaces,
                                     const Context& context) {
  texture::SurfaceMaterial material = a.common;
  material.film = film_of(a, nullptr);
  take_textures(material,
                {&a.layers.base, &a.layers.detail, &a.layers.reflection, &a.layers.structure},
                context);
  add_group_materials(material, a, surfaces, context);
  return material;
}

std::vector<render::PictureOptions> options_of(const RenderArguments& a) {
  if (a.film.compare.empty())
    return {a.picture};
  std::vector<render::PictureOptions> all;
  for (const std::string& mode : a.film.compare) {
    render::PictureOptions options = a.picture;
    options.backend = mode == "cpu" ? render::Backend::cpu : render::Backend::gl;
    if (mode != "cpu")
      options.gl.mode = gl::gl_mode_from_name(mode);
    if (mode != "cpu" && options.gl.mode != gl::GlMode::shader)
      options.per_pixel.reset();
    all.push_back(options);
  }
  return all;
}

/// The light walked around the target, about what points up in the picture.
Vec3 rotated_light(const Vec3& light, const shading::Camera& camera, double part,
                   bool directional) {
  const Vec3 from = directional ? Vec3{} : camera.target, k = camera.up, v = light - from;
  const Vec3 along = k * dot(k, v), across = v - along;
  const auto [cosine, sine] = shading::cos_sin(360 * part);
  return from + along + across * cosine + cross(k, across) * sine;
}

} // namespace

Pictures::Pictures(Run& run, const RenderArguments& arguments)
    : run_(run), arguments_(arguments), options_(options_of(arguments)),
      drawing_(arguments.drawing) {}

void Pictures::start(const std::vector<shading::Surface>& surfaces) {
  const RenderArguments& a = arguments_;
  material_ = run_.timed("textures", [&] { return material_of(a, surfaces, run_.context()); });
  box_ = shading::rest_box(surfaces);
  camera_ = camera_of(0);
  drawing_.light = a.look.light.value_or(shading::default_light(*camera_));
  if (a.look.endoscope)
    drawing_.full_distance = a.look.reach.value_or(norm(camera_->eye - camera_->target));
  first_light_ = drawing_.light;
  drawing_.occlusion_radius = a.look.occlusion_radius.value_or(box_.longest_side() / 4);
  drawing_.offset = {a.look.offset, a.look.offset};
  const auto structured =
      std::ranges::find_if(material_.others, [](const texture::SurfaceMaterial& material) {
        return material.structure.has_value();
      });
  if (const texture::SurfaceMaterial& material =
          material_.structure || structured == material_.others.end() ? material_ : *structured;
      a.look.offset_texels && material.structure)
    drawing_.offset = {*a.look.offset_texels / material.structure->width(),
                       *a.look.offset_texels / material.structure->height()};
  tissue_.emplace(a, surfaces, material_, drawing_);
  add_inside_material(material_, a);
  add_instrument_material(material_, a, drawing_);
  if (drawing_.rest)
    texture::place_at_rest(material_, box_, a.mapping.edge);
  run_.timed("start", [&] {
    for (const render::PictureOptions& options : options_)
      modes_.push_back({std::make_unique<render::Painter>(material_, options, run_.context()), {}});
  });
}

shading::Camera Pictures::camera_of(std::uint64_t number) const {
  const RenderArguments& a = arguments_;
  shading::CameraOptions options = a.camera;
  if (a.film.turn)
    options.azimuth += 360.0 * static_cast<double>(number) / static_cast<double>(*a.film.turn);
  return shading::make_camera(options, box_, a.picture.width, a.picture.height);
}

/// Places camera and light of a picture; whether one of them is elsewhere than before.
bool Pictures::place(std::uint64_t number) {
  const RenderArguments& a = arguments_;
  const Vec3 eye = drawing_.camera.eye, light = drawing_.light;
  camera_ = camera_of(number);
  drawing_.camera = *camera_;
  if (a.look.endoscope)
    drawing_.light = shading::endoscope_light(*camera_);
  if (a.film.turn_light) {
    const double part = static_cast<double>(number) / static_cast<double>(*a.film.turn_light);
    drawing_.light = rotated_light(first_light_, *camera_, part, drawing_.directional);
  }
  return drawing_.camera.eye != eye || drawing_.light != light;
}

std::vector<shading::Surface> Pictures::styled(std::vector<shading::Surface> surfaces) const {
  for (shading::Surface& surface : surfaces) {
    if (arguments_.look.style == "flat")
      surface = shading::faceted(surface);
    if (arguments_.look.style == "wireframe")
      surface = shading::wireframe(surface, *camera_, 1.25, arguments_.picture.height);
  }
  if (arguments_.look.inside)
    surfaces = shading::two_sided(std::move(surfaces), camera_->eye);
  return surfaces;
}

namespace {

/// Whether two surfaces have the same triangles, coordinates, materials and rest.
bool same_but_points(const shading::Surface& kept, const shading::Surface& now, bool coordinates) {
  const TriangleMesh &a = kept.mesh, &b = now.mesh;
  return a.points.size() == b.points.size() && a.triangles == b.triangles &&
         (!coordinates || b.texcoords.empty() || a.texcoords == b.texcoords) && a.part == b.part &&
         a.material == b.material && kept.rest == now.rest && !now.rest.empty();
}

} // namespace

/// What the surfaces have that those drawn last had not; takes them over.
std::optional<shading::DrawingChange> Pictures::take(std::vector<shading::Surface> surfaces,
                                                     bool placed) {
  const auto each = [&](const auto& same) {
    return pictures_ > 1 && surfaces_.size() == surfaces.size() &&
           std::equal(surfaces_.begin(), surfaces_.end(), surfaces.begin(), same);
  };
  if (arguments_.look.style != "textured" ||
      arguments_.look.inside) { // made of the points, and of the camera
    const bool same =
        pictures_ > 1 && plain_.size() == surfaces.size() &&
        std::equal(surfaces.begin(), surfaces.end(), plain_.begin(),
                   [](const shading::Surface& s, const Drawn& drawn) {
                     return s.mesh.points == drawn.points && s.mesh.triangles == drawn.triangles;
                   });
    if (same && !placed)
      return std::nullopt;
    plain_.clear();
    for (const shading::Surface& surface : surfaces)
      plain_.push_back({surface.mesh.points, surface.mesh.triangles});
    surfaces_ = styled(std::move(surfaces));
    return shading::DrawingChange::all;
  }
  if (each([&](const shading::Surface& kept, const shading::Surface& now) {
        return kept.mesh.points == now.mesh.points && kept.mesh.normals == now.mesh.normals &&
               kept.mesh.triangles == now.mesh.triangles &&
               (!drawing_.rest || kept.rest == now.rest);
      }))
    return placed ? std::optional(shading::DrawingChange::view) : std::nullopt;
  const bool coordinates = !arguments_.mapping.mapping; // else they are made here
  if (each([&](const shading::Surface& kept, const shading::Surface& now) {
        return same_but_points(kept, now, coordinates);
      })) {
    for (std::size_t n = 0; n < surfaces.size(); ++n) {
      surfaces_[n].mesh.points = std::move(surfaces[n].mesh.points);
      surfaces_[n].mesh.normals = std::move(surfaces[n].mesh.normals);
    }
    return shading::DrawingChange::points;
  }
  surfaces_ = std::move(surfaces);
  return shading::DrawingChange::all;
}

const texture::Image& Pictures::of(std::vector<shading::Surface> surfaces) {
  for (shading::Surface& surface : surfaces)
    if (arguments_.look.crease && !surface.instrument)
      surface = shading::creased(surface, *arguments_.look.crease);
  if (modes_.empty())
    start(surfaces);
  tissue_->number_materials(surfaces);
  const bool placed = place(pictures_++);
  const auto change = run_.timed("compare", [&] { return take(std::move(surfaces), placed); });
  kept_last_ = !change;
  if (kept_last_) {
    ++kept_;
    return last_;
  }
  if (*change == shading::DrawingChange::all && drawing_.texcoords)
    mapped_ = run_.timed("prepare", [&] {
      return shading::add_texcoords(surfaces_, arguments_.mapping, run_.context());
    });
  std::vector<texture::Image> images;
  std::array<const shading::Drawing*, 2> drawings{}; // by kind of vertex data
  for (Mode& mode : modes_) {
    drawing_.per_pixel = mode.painter->per_pixel();
    const shading::Drawing*& drawing = drawings[drawing_.per_pixel ? 1 : 0];
    if (drawing == nullptr) {
      shading::DrawingMaker& maker = makers_[drawing_.per_pixel ? 1 : 0];
      drawing = run_.timed(
          "prepare", [&] { return &maker.make(surfaces_, drawing_, *change, run_.context()); });
      tell_groups(*drawing);
    }
    images.push_back(
        run_.timed("draw", [&] { return mode.painter->paint(*drawing, *camera_, &mode.report); }));
    if (arguments_.look.endoscope)
      shading::look_through_endoscope(images.back(), *camera_);
    if (pictures_ == 1 && !mode.report.gl_failure.empty())
      run_.warn(mode.report.gl_failure + "; drawn without OpenGL (--backend cpu)");
  }
  last_ = images.size() == 1 ? std::move(images.front()) : texture::side_by_side(images);
  return last_;
}

/// How many triangles have which material; one that none has is a mistake more likely than not.
void Pictures::tell_groups(const shading::Drawing& drawing) {
  if (groups_told_ || arguments_.materials.empty() || drawing.group_start.empty() ||
      drawing.triangles.empty())
    return;
  groups_told_ = true;
  std::vector<std::uint64_t> counts;
  for (std::size_t g = 0; g < shading::group_count(drawing); ++g)
    counts.push_back(shading::triangles_of_group(drawing, g).size());
  run_.stats().set("triangles_by_look", counts);
  for (std::size_t g = 1; g <= drawing_.groups.size(); ++g)
    if (counts[g] == 0)
      run_.warn("no triangle is of " + arguments_.view_words.by + " " +
                std::to_string(drawing_.groups[g - 1]));
}

void Pictures::tell(Stats& stats, const texture::Image& last) const {
  if (drawing_.texcoords)
    stats.set("surfaces_mapped", mapped_);
  stats.set("eye", camera_->eye);
  stats.set("looks_at", camera_->target);
  stats.set("light", drawing_.light);
  stats.set("pictures", pictures_);
  stats.set("pictures_kept", kept_);
  shading::DrawingCounts counts;
  for (const shading::DrawingMaker& maker : makers_) {
    counts.splits += maker.counts().splits;
    counts.frames += maker.counts().frames;
    counts.vertices += maker.counts().vertices;
  }
  stats.set("vertex_splits", counts.splits);
  stats.set("frames_made", counts.frames);
  stats.set("vertices_made", counts.vertices);
  const render::PictureReport& told = modes_.back().report;
  stats.set("backend", render::backend_names()[static_cast<std::size_t>(told.backend)]);
  if (told.backend == render::Backend::gl) {
    stats.set("platform", told.platform);
    stats.set("renderer", told.renderer);
    stats.set("target", told.target);
  }
  stats.set("passes", told.passes);
  if (told.backend == render::Backend::gl)
    stats.set("uploads", told.uploads);
  stats.set("triangles_drawn", told.triangles);
  if (told.backend == render::Backend::cpu)
    stats.set("samples_covered", told.covered);
  stats.set("width", std::uint64_t{last.width});
  stats.set("height", std::uint64_t{last.height});
}

} // namespace gewebe::cli
