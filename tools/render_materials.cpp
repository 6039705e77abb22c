#include "tools/render_materials.h"

#include "tools/render_layer.h"

#include <algorithm>
#include <array>
#include <utility>

namespace gewebe::cli {
namespace {

constexpr std::array<RenderLayer RenderMaterial::*, 4> layers{
    &RenderMaterial::base, &RenderMaterial::detail, &RenderMaterial::reflection,
    &RenderMaterial::structure};
constexpr std::array<const char*, 4> words{"texture", "detail", "reflection", "structure"};

} // namespace

void complete_materials(RenderArguments& a) {
  if (a.materials.empty() && a.words.by != "material")
    throw UsageError("--by without a number before a texture or colour, expected such as "
                     "--texture 1=FILE");
  a.drawing.group_by = group_by_from_name(a.words.by);
  for (auto& [number, material] : a.materials) {
    a.drawing.groups.push_back(number);
    const RenderLayers of_all{&a.base, &a.detail, &a.reflection, &a.structure};
    for (std::size_t n = 0; n < layers.size(); ++n) {
      RenderLayer& layer = material.*layers[n];
      layer.options = of_all[n]->options;
      complete_layer(a, words[n], layer);
    }
  }
}

bool has_solid_structure(const RenderArguments& a) {
  return a.structure.solid || std::ranges::any_of(a.materials, [](const auto& material) {
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

void add_material_looks(Look& look, const RenderArguments& a, const Context& context) {
  std::vector<Look> others;
  for (const auto& [number, material] : a.materials) {
    Look& own = others.emplace_back(look);
    take_textures(own,
                  {&material.base, &material.detail, &material.reflection, &material.structure},
                  context);
    own.color = material.color.value_or(look.color);
  }
  look.others = std::move(others);
}

} // namespace gewebe::cli
