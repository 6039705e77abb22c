#include "tools/render/render_materials.h"

#include "formats/results/results.h"
#include "texture/tissue_color.h"
#include "tools/render/render_layer.h"
#include "tools/render/render_lighting.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

namespace gewebe::cli {
namespace {

constexpr std::array<RenderLayer RenderMaterial::*, 4> layers{
    &RenderMaterial::base, &RenderMaterial::detail, &RenderMaterial::reflection,
    &RenderMaterial::structure};
constexpr std::array<const char*, 4> words{"texture", "detail", "reflection", "structure"};

/// The numbers of materials, parts or objects that the triangles have.
std::set<std::int32_t> numbers_of(const std::vector<shading::Surface>& surfaces,
                                  shading::GroupBy by) {
  std::set<std::int32_t> numbers;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const TriangleMesh& mesh = surfaces[s].mesh;
    if (surfaces[s].instrument || mesh.triangles.empty())
      continue;
    const std::vector<std::int32_t>& own = by == shading::GroupBy::part ? mesh.part : mesh.material;
    if (by == shading::GroupBy::surface)
      numbers.insert(static_cast<std::int32_t>(s));
    else if (own.empty())
      numbers.insert(0);
    else
      numbers.insert(own.begin(), own.end());
  }
  return numbers;
}

} // namespace

void complete_materials(RenderArguments& a) {
  if (a.materials.empty() && a.view_words.by != "material")
    throw UsageError("--by without a number before a texture or colour, expected such as "
                     "--texture 1=FILE");
  a.drawing.group_by = shading::group_by_from_name(a.view_words.by);
  for (auto& [number, material] : a.materials) {
    a.drawing.groups.push_back(number);
    const RenderLayers of_all{&a.layers.base, &a.layers.detail, &a.layers.reflection,
                              &a.layers.structure};
    for (std::size_t n = 0; n < layers.size(); ++n) {
      RenderLayer& layer = material.*layers[n];
      layer.options = of_all[n]->options;
      complete_layer(a, words[n], layer);
    }
  }
}

bool has_solid_structure(const RenderArguments& a) {
  return a.layers.structure.solid || std::ranges::any_of(a.materials, [](const auto& material) {
           return material.second.structure.solid.has_value();
         });
}

std::vector<std::string> material_paths(const RenderArguments& a) {
  std::vector<std::string> paths;
  for (const auto& [number, material] : a.materials)
    for (const auto layer : layers)
      if (!(material.*layer).path.empty())
        paths.push_back((material.*layer).path);
  return paths;
}

void add_group_materials(texture::SurfaceMaterial& common, const RenderArguments& a,
                         const std::vector<shading::Surface>& surfaces, const Context& context) {
  const std::set<std::int32_t> used = numbers_of(surfaces, a.drawing.group_by);
  std::vector<texture::SurfaceMaterial> others;
  for (const auto& [number, material] : a.materials) {
    texture::SurfaceMaterial& own = others.emplace_back(common);
    if (!a.film.frames.empty() || used.contains(number)) // a cut shows what lies inside
      take_textures(own,
                    {&material.base, &material.detail, &material.reflection, &material.structure},
                    context);
    own.color = material.color.value_or(common.color);
    own.film = film_of(a, &material);
  }
  common.others = std::move(others);
}

void take_instruments(RenderArguments& a, const formats::Input& input) {
  if (a.reading.kind != formats::Kind::hdf5) {
    if (a.look.no_instruments || a.look.instrument_color)
      throw UsageError(input.name(),
                       "--instrument-color or --no-instruments for no result of a run, "
                       "expected neither");
    return;
  }
  constexpr std::size_t smooth = 128, coarse = 32;
  if (!a.look.no_instruments && a.reading.object.empty() && input.name() != "-" &&
      !formats::read_result_index(input.name()).instruments.empty())
    a.reading.ring = a.look.style == "textured" ? smooth : coarse;
}

void add_instrument_material(texture::SurfaceMaterial& common, const RenderArguments& a,
                             shading::DrawingOptions& drawing) {
  if (a.reading.ring == 0)
    return;
  constexpr Vec3 steel{0.75, 0.77, 0.8};
  texture::SurfaceMaterial own;
  own.color =
      a.look.instrument_color.value_or(a.look.style == "wireframe" ? a.common.color : steel);
  own.background = common.background;
  own.film = film_of(a, nullptr);
  own.film.reflectance = texture::steel_reflectance;
  common.others.push_back(std::move(own));
  drawing.instruments = true;
}

namespace {

using Colors = std::map<std::int32_t, Vec3>;

Vec3 color_of(const Colors& colors, const shading::Surface& surface, std::size_t material) {
  if (const auto found = colors.find(static_cast<std::int32_t>(material)); found != colors.end())
    return found->second;
  return texture::tissue_color(
      material < surface.materials.size() ? surface.materials[material] : "", material);
}

/// A base from an image has its own colours.
bool takes_tissue_color(const texture::SurfaceMaterial& common) {
  return !common.base;
}

} // namespace

TissueColors::TissueColors(const RenderArguments& a, const std::vector<shading::Surface>& surfaces,
                           texture::SurfaceMaterial& common, shading::DrawingOptions& drawing) {
  if (!a.look.tissue_colors || surfaces.empty())
    return;
  for (const shading::Surface& surface : surfaces)
    of_surfaces_.push_back(texture::tissue_colors(surface.mesh, surface.materials));
  if (!a.materials.empty()) { // as they are numbered there
    const auto color = [&](std::size_t surface, std::size_t material) {
      return color_of(of_surfaces_[surface], surfaces[surface], material);
    };
    if (takes_tissue_color(common))
      common.color = color(0, 0);
    auto own = common.others.begin();
    for (const auto& [number, material] : a.materials) {
      const auto n = static_cast<std::size_t>(number);
      const bool object =
          a.view_words.by == "object" && n < surfaces.size() && !surfaces[n].instrument;
      if (!material.color && takes_tissue_color(*own))
        own->color = object ? color(n, 0) : a.view_words.by == "part" ? common.color : color(0, n);
      ++own;
    }
    return;
  }
  if (!takes_tissue_color(common))
    return;
  renumbers_ = true;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const shading::Surface& surface = surfaces[s];
    if (surface.instrument)
      continue;
    std::vector<std::int32_t> numbers = surface.mesh.material;
    if (numbers.empty())
      numbers.push_back(0);
    std::ranges::sort(numbers);
    const auto [first, last] = std::ranges::unique(numbers);
    numbers.erase(first, last);
    for (const std::int32_t number : numbers) {
      const Vec3 color = color_of(of_surfaces_[s], surface, static_cast<std::size_t>(number));
      if (std::ranges::find(colors_, color) == colors_.end())
        colors_.push_back(color);
    }
  }
  if (colors_.empty())
    return;
  common.color = colors_.front();
  drawing.group_by = shading::GroupBy::material;
  for (std::size_t n = 1; n < colors_.size(); ++n) {
    drawing.groups.push_back(static_cast<std::int32_t>(n));
    texture::SurfaceMaterial& own = common.others.emplace_back(common);
    own.others.clear();
    own.color = colors_[n];
  }
}

void TissueColors::number_materials(std::vector<shading::Surface>& surfaces) const {
  if (!renumbers_ || colors_.size() < 2)
    return;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    shading::Surface& surface = surfaces[s];
    if (surface.instrument)
      continue;
    surface.mesh.material.resize(surface.mesh.triangles.size());
    for (std::int32_t& number : surface.mesh.material) {
      const Vec3 color = color_of(s < of_surfaces_.size() ? of_surfaces_[s] : Colors{}, surface,
                                  static_cast<std::size_t>(number));
      const auto found = std::ranges::find(colors_, color);
      number = found == colors_.end() ? 0 : static_cast<std::int32_t>(found - colors_.begin());
    }
  }
}

} // namespace gewebe::cli
