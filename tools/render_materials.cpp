#include "tools/render_materials.h"

#include "formats/image_file.h"

#include <array>
#include <utility>

namespace gewebe::cli {
namespace {

constexpr std::array<RenderLayer RenderMaterial::*, 4> layers{
    &RenderMaterial::base, &RenderMaterial::detail, &RenderMaterial::reflection,
    &RenderMaterial::structure};

} // namespace

void complete_materials(RenderArguments& a) {
  if (a.materials.empty() && a.words.by != "material")
    throw UsageError("--by without a number before a texture or colour, expected such as "
                     "--texture 1=FILE");
  a.drawing.group_by = group_by_from_name(a.words.by);
  for (auto& [number, material] : a.materials) {
    a.drawing.groups.push_back(number);
    const std::array<const RenderLayer*, 4> of_all{&a.base, &a.detail, &a.reflection, &a.structure};
    for (std::size_t n = 0; n < layers.size(); ++n) {
      RenderLayer& layer = material.*layers[n];
      layer.options = of_all[n]->options;
      if (!layer.path.empty())
        (layer.options.sphere ? a.drawing.sphere : a.drawing.texcoords) = true;
    }
    if (!material.structure.path.empty())
      a.drawing.structure = a.drawing.texcoords = true;
  }
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
    const auto read = [&](const RenderLayer& layer, std::optional<Texture>& texture) {
      if (layer.path.empty())
        return;
      Input input(layer.path);
      texture = texture_from(read_image(input, context), layer.options);
    };
    read(material.base, own.base);
    read(material.detail, own.detail);
    read(material.reflection, own.reflection);
    if (!material.structure.path.empty()) {
      Input input(material.structure.path);
      own.structure = texture_from(read_heights(input, context), material.structure.options);
    }
    own.color = material.color.value_or(look.color);
  }
  look.others = std::move(others);
}

} // namespace gewebe::cli
